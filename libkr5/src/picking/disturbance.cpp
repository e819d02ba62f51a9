// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/disturbance.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "changed_pixels.hpp"
#include "share_text.hpp"

namespace kr5::picking {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;

void ImageNoiseOptions::validate() const {
  require(average >= 0 && average <= 10, "average must lie between 0 and 10 [px]");
  require(min_spread > 0 && min_spread < 50, "min_spread must lie between 0 and 50 [grey]");
  require(moved_share > 0 && moved_share < 1, "moved_share must lie between 0 and 1 [-]");
}

void ChangeOptions::validate() const {
  require(false_alarms > 0 && std::isfinite(false_alarms), "false_alarms must be positive [-]");
  require(min_region >= 1, "min_region must be 1 or more [px]");
  require(max_light_change > 0 && max_light_change < 1, "max_light_change must lie between 0 and 1 [-]");
  require(max_saturated > 0 && max_saturated <= 1, "max_saturated must lie between 0 and 1 [-]");
  require(max_moved_tiles > 0 && max_moved_tiles <= 1, "max_moved_tiles must lie between 0 and 1 [-]");
}

namespace {

/// Mean over a square about each pixel, of as much of it as lies in the image.
MatrixXd averaged(ImageView image, int half) {
  MatrixXd sums = MatrixXd::Zero(image.height + 1, image.width + 1);
  for (int x = 0; x < image.width; ++x)
    for (int y = 0; y < image.height; ++y)
      sums(y + 1, x + 1) = image.at(x, y) + sums(y, x + 1) + sums(y + 1, x) - sums(y, x);
  MatrixXd out(image.height, image.width);
  for (int x = 0; x < image.width; ++x)
    for (int y = 0; y < image.height; ++y) {
      const int x0 = std::max(x - half, 0), x1 = std::min(x + half + 1, image.width);
      const int y0 = std::max(y - half, 0), y1 = std::min(y + half + 1, image.height);
      out(y, x) = (sums(y1, x1) - sums(y0, x1) - sums(y1, x0) + sums(y0, x0)) / ((x1 - x0) * (y1 - y0));
    }
  return out;
}

/// How much of the square about each pixel lies in the image: at the border fewer pixels are averaged, which scatter
/// more.
MatrixXd averaged_share(Index rows, Index columns, int half) {
  const auto within = [half](Index i, Index size) {
    return static_cast<double>(std::min(i + half, size - 1) - std::max<Index>(i - half, 0) + 1) / (2 * half + 1);
  };
  return MatrixXd::NullaryExpr(rows, columns, [&](Index r, Index c) { return within(r, rows) * within(c, columns); });
}

void require_image(ImageView image, const char* name) {
  require(image.data != nullptr && image.width > 0 && image.height > 0, std::string(name) + ": the image is empty");
}

/// A line from the grey levels of one image to those of another, about the middle of the first.
struct Light {
  double gain = 1.0, level = 0.0, middle = 0.0;

  double offset() const { return level - gain * middle; }
  MatrixXd applied(const MatrixXd& grey) const { return (gain * grey.array() + offset()).matrix(); }
};

/// State: gain, and grey level at the middle. The gain is kept near 1 as far as an image of one grey level does not
/// tell it.
struct LightProblem {
  const std::vector<Vector2d>& pairs;
  double middle, sigma, limit;

  NormalEquations<2> equations(const Vector2d& x) const {
    NormalEquations<2> out;
    for (const Vector2d& pair : pairs) {
      const double r = x[0] * (pair.x() - middle) + x[1] - pair.y();
      if (std::abs(r) > limit) continue;
      out.add_huber(Vector2d(pair.x() - middle, 1) / sigma, r / sigma, 1.5);
    }
    out.add(Vector2d(1 / 0.1, 0), (x[0] - 1) / 0.1);
    return out;
  }
};

/// The line that most pixels keep to.
Light fit_light(const MatrixXd& before, const MatrixXd& after, double sigma) {
  const Index step = std::max<Index>(1, before.size() / 20000);
  std::vector<Vector2d> pairs;
  std::vector<double> first, second;
  for (Index i = 0; i < before.size(); i += step) {
    const Vector2d pair(before.data()[i], after.data()[i]);
    if (pair.minCoeff() <= 1 || pair.maxCoeff() >= 254) continue;  // the ends of the scale keep to no line
    pairs.push_back(pair);
    first.push_back(pair.x());
    second.push_back(pair.y());
  }
  Light out;
  if (pairs.empty()) return out;
  out.middle = median(first);
  Vector2d x(1.0, median(second));
  for (const double limit : {1e9, 40.0, 12.0, 6.0, 4.0})
    x = levenberg_marquardt<2>(x, LightProblem{pairs, out.middle, sigma, limit * sigma}, {.sigma = 1.0}).x;
  out.gain = x[0];
  out.level = x[1];
  return out;
}

MatrixXd median_image(const std::vector<MatrixXd>& images) {
  MatrixXd out(images.front().rows(), images.front().cols());
  std::vector<double> values(images.size());
  for (Index i = 0; i < out.size(); ++i) {
    std::transform(images.begin(), images.end(), values.begin(), [i](const auto& m) { return m.data()[i]; });
    std::sort(values.begin(), values.end());
    out.data()[i] = (values[(values.size() - 1) / 2] + values[values.size() / 2]) / 2;
  }
  return out;
}

/// A robust standard deviation of all entries.
double scatter(const MatrixXd& m) {
  const MatrixXd sizes = m.cwiseAbs();
  return mad_to_sigma * median(std::vector<double>(sizes.data(), sizes.data() + sizes.size()));
}

/// The light of each image made that of their median, and images in which something moved taken out.
int keep_still(std::vector<MatrixXd>& images, const ImageNoiseOptions& options) {
  const MatrixXd middle = median_image(images);
  for (MatrixXd& image : images) image = fit_light(image, middle, options.min_spread).applied(image);
  std::vector<double> scatters;  // of pairs: of few images the median is one of them
  for (std::size_t i = 0; i < images.size(); ++i)
    scatters.push_back(scatter(images[i] - images[(i + 1) % images.size()]) / std::sqrt(2.0));
  const double limit = 8 * std::max(median(scatters), options.min_spread);
  std::vector<MatrixXd> still;
  for (std::size_t i = 0; i < images.size(); ++i) {
    const auto far = static_cast<double>(((images[i] - middle).array().abs() > limit).count());
    if (far <= options.moved_share * static_cast<double>(middle.size())) still.push_back(std::move(images[i]));
  }
  const auto left_out = static_cast<int>(images.size() - still.size());
  images = std::move(still);
  return left_out;
}

/// Logarithmic derivative of the gamma function, and its derivative: by recurrence to large x, then the series.
double digamma(double x) {
  double out = 0;
  for (; x < 8; ++x) out -= 1 / x;
  const double y = 1 / (x * x);
  return out + std::log(x) - 0.5 / x - y * (1.0 / 12 - y * (1.0 / 120 - y / 252));
}
double trigamma(double x) {
  double out = 0;
  for (; x < 8; ++x) out += 1 / (x * x);
  const double y = 1 / (x * x);
  return out + 1 / x + 0.5 * y + y / x * (1.0 / 6 - y * (1.0 / 30 - y / 42));
}
double inverse_trigamma(double value) {
  double low = 1e-3, high = 1e6;
  for (int i = 0; i < 100; ++i) {
    const double middle = std::sqrt(low * high);
    (trigamma(middle) > value ? low : high) = middle;
  }
  return std::sqrt(low * high);
}

/// What the variances of all pixels have in common, as degrees of freedom and a value (Smyth 2004, eq. 10): their
/// logarithms scatter by chance alone as trigamma says, and what they scatter beyond is their own.
struct SharedVariance {
  double dof = 0.0, value = 0.0;
};
SharedVariance shared_variance(const ArrayXd& variances, double dof) {
  const ArrayXd e = variances.log() - digamma(dof / 2) + std::log(dof / 2);
  const double mean = e.mean(), own = (e - mean).square().mean() - trigamma(dof / 2);
  constexpr double most = 1000;
  const double shared = own > trigamma(most / 2) ? 2 * inverse_trigamma(own) : most;
  return {shared, std::exp(mean + digamma(shared / 2) - std::log(shared / 2))};
}

double share_of_ends(ImageView image) {
  int ends = 0;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) ends += image.at(x, y) == 0 || image.at(x, y) == 255;
  return static_cast<double>(ends) / (static_cast<double>(image.width) * image.height);
}

/// Share of the parts of an image with structure in which something changed: a motion of the camera shows wherever
/// there is structure. 0 when there is hardly any.
double share_of_moved_tiles(const MatrixXd& before, const PixelMask& changed, const ImageNoise& noise) {
  constexpr Index tiles = 8;
  int structured = 0, moved = 0;
  for (Index i = 0; i < tiles; ++i)
    for (Index j = 0; j < tiles; ++j) {
      const Index r = i * before.rows() / tiles, c = j * before.cols() / tiles;
      const Index rows = (i + 1) * before.rows() / tiles - r, columns = (j + 1) * before.cols() / tiles - c;
      if (rows == 0 || columns == 0) continue;
      const auto grey = before.block(r, c, rows, columns);
      if (grey.maxCoeff() - grey.minCoeff() < 20 * noise.spread.block(r, c, rows, columns).mean()) continue;
      ++structured;
      moved += changed.block(r, c, rows, columns).any();
    }
  return structured < 6 ? 0.0 : static_cast<double>(moved) / structured;
}

}  // namespace

ImageNoise learn_image_noise(std::span<const ImageView> images, const ImageNoiseOptions& options) {
  options.validate();
  std::vector<MatrixXd> used;
  for (const ImageView& image : images) {
    require_image(image, "images");
    require(image.width == images[0].width && image.height == images[0].height, "images must all have the same size");
    used.push_back(averaged(image, options.average));
  }
  ImageNoise out;
  out.average = options.average;
  const auto fail = [&](const std::string& message) {
    out.fit.message = message;
    return out;
  };
  if (used.size() < 3)
    return fail("three images of the scene at rest are needed, better ten; found " + std::to_string(used.size()));
  out.left_out = keep_still(used, options);
  out.images = static_cast<int>(used.size());
  if (used.size() < 3)
    return fail("something moved in " + std::to_string(out.left_out) + " of " + std::to_string(images.size()) +
                " images; take them while scene and camera are at rest");
  out.mean = median_image(used);
  MatrixXd sum = MatrixXd::Zero(out.mean.rows(), out.mean.cols()), squares = sum;
  for (const MatrixXd& image : used) sum += image;
  sum /= out.images;
  for (const MatrixXd& image : used) squares += (image - sum).cwiseAbs2();
  const double dof = out.images - 1, least = options.min_spread * options.min_spread;
  const ArrayXd share = averaged_share(out.mean.rows(), out.mean.cols(), options.average).reshaped().array();
  const ArrayXd variances = (share * squares.reshaped().array() / dof).max(least);
  const SharedVariance shared = shared_variance(variances, dof);
  const ArrayXd moderated = (shared.dof * shared.value + dof * variances) / (shared.dof + dof);
  out.spread = (moderated.max(least) / share).sqrt().matrix().reshaped(out.mean.rows(), out.mean.cols());
  out.dof = shared.dof + dof;
  out.fit.status = FitStatus::Converged;
  out.fit.message = std::to_string(out.images) + " images at rest" +
                    (out.left_out > 0 ? ", " + std::to_string(out.left_out) + " left out" : "");
  return out;
}

ImageChange find_changes(ImageView before, ImageView after, const ImageNoise& noise, const ChangeOptions& options) {
  options.validate();
  require(noise.fit.usable(), "noise is not usable: " + noise.fit.message);
  for (const auto& [image, name] : {std::pair{before, "before"}, std::pair{after, "after"}}) {
    require_image(image, name);
    require(image.width == noise.spread.cols() && image.height == noise.spread.rows(),
            std::string(name) + ": the image must have the size of those the noise was learnt from, " +
                std::to_string(noise.spread.cols()) + " x " + std::to_string(noise.spread.rows()) + " px");
  }
  ImageChange out;
  out.changed = PixelMask::Constant(before.height, before.width, false);
  const auto say = [&](ChangeFinding finding, const std::string& message) {
    out.finding = finding;
    out.message = message;
    return out;
  };
  const double ends = std::max(share_of_ends(before), share_of_ends(after));
  if (ends > options.max_saturated)
    return say(ChangeFinding::Saturated, share_text(ends) +
                                             " of an image is black or white, where no change shows; set "
                                             "the exposure so that less than " +
                                             share_text(options.max_saturated) + " is");

  const MatrixXd first = averaged(before, noise.average), second = averaged(after, noise.average);
  const Light light = fit_light(first, second, noise.spread.mean());
  out.gain = light.gain;
  out.offset = light.offset();
  const double change = std::max(std::abs(light.gain - 1), std::abs(light.level / std::max(light.middle, 1.0) - 1));
  if (change > options.max_light_change)
    return say(ChangeFinding::LightChanged, "the light changed by " + share_text(change) +
                                                "; switch the exposure to "
                                                "manual, shield the cell, or "
                                                "learn the noise again");
  const double per_pixel = std::min(0.5, options.false_alarms / static_cast<double>(first.size()));
  out.threshold = uncertainty::student_factor(noise.dof, 1 - per_pixel);
  const MatrixXd size = (second - light.applied(first)).cwiseAbs();
  const double both = std::hypot(1.0, light.gain);  // both images scatter
  out.changed = (size.array() > out.threshold * both * noise.spread.array()).matrix();
  out.regions = keep_regions(out.changed, size, options.min_region);
  const double moved = share_of_moved_tiles(first, out.changed, noise);
  if (moved > options.max_moved_tiles)
    return say(ChangeFinding::CameraMoved,
               share_text(moved) +
                   " of the parts of the image with structure changed: the camera or the bin moved, or "
                   "something stands before the lens; scan again");
  if (out.regions.empty()) return say(ChangeFinding::Unchanged, "nothing moved");
  return say(ChangeFinding::Changed,
             std::to_string(out.regions.size()) + (out.regions.size() == 1 ? " region changed" : " regions changed"));
}

}  // namespace kr5::picking
