// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/tag_grid.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include <Eigen/Geometry>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>

#include "vision/homography.hpp"

namespace kr5::vision {
namespace {

using Eigen::Matrix2Xd;

/// Corners by id, of one image.
using TagCorners = std::map<int, Eigen::Matrix<double, 2, 4>>;
using ImagesOfTags = std::span<const std::vector<TagDetection>>;

void require_tags(ImagesOfTags images) {
  for (const std::vector<TagDetection>& tags : images)
    for (const TagDetection& tag : tags) {
      require(tag.id >= 0, "tag " + std::to_string(tag.id) + ": an id must not be negative");
      require(tag.corners.allFinite(), "tag " + std::to_string(tag.id) + ": corners must be finite [px]");
    }
}

std::string commonest_family(ImagesOfTags images) {
  std::map<std::string, int> count;
  std::string best;
  for (const std::vector<TagDetection>& tags : images)
    for (const TagDetection& tag : tags) ++count[tag.family];
  for (const auto& [family, number] : count)
    if (best.empty() || number > count[best]) best = family;
  return best;
}

/// Ids of a family, by the number of images that show them; a wrong one is seen now and then.
std::vector<int> believed_ids(ImagesOfTags images, const std::string& family) {
  std::map<int, int> count;
  int most = 0;
  for (const std::vector<TagDetection>& tags : images) {
    std::set<int> shown;
    for (const TagDetection& tag : tags)
      if (tag.family == family && shown.insert(tag.id).second) most = std::max(most, ++count[tag.id]);
  }
  std::vector<int> out;
  for (const auto& [id, number] : count)
    if (2 * number > most) out.push_back(id);
  return out;
}

/// The tags of the image that shows most of them.
TagCorners fullest_image(ImagesOfTags images, const TagGrid& grid) {
  TagCorners best;
  for (const std::vector<TagDetection>& tags : images) {
    TagCorners seen;
    std::set<int> twice;
    for (const TagDetection& tag : tags) {
      if (tag.family != grid.family || !std::binary_search(grid.ids.begin(), grid.ids.end(), tag.id)) continue;
      if (!seen.emplace(tag.id, tag.corners).second) twice.insert(tag.id);
    }
    for (const int id : twice) seen.erase(id);
    if (seen.size() > best.size()) best = std::move(seen);
  }
  return best;
}

Matrix2Xd corners_of(const TagCorners& tags, int corner) {
  Matrix2Xd out(2, static_cast<Eigen::Index>(tags.size()));
  Eigen::Index k = 0;
  for (const auto& [id, corners] : tags) out.col(k++) = corners.col(corner);
  return out;
}

/// Whether values differ.
bool vary(const Eigen::RowVectorXd& values) { return values.size() > 0 && (values.array() != values[0]).any(); }

/// Largest distance along an axis of the grid of a tag from its place, or by which tags, which are square, are wider
/// than high, in pitches; nothing where tags would lie upside down, or do not determine it. By their places alone those
/// of two columns of four would also stand in every other row of two.
std::optional<double> misfit_of(const TagCorners& tags, int cols) {
  Matrix2Xd places(2, static_cast<Eigen::Index>(tags.size()));
  Eigen::Index k = 0;
  for (const auto& [id, corners] : tags) {
    const int row = id / cols;
    places.col(k++) << id % cols, row;
  }
  if (!vary(places.row(0)) || !vary(places.row(1))) return std::nullopt;
  const auto H = fit_homography(corners_of(tags, 0), places);
  if (!H) return std::nullopt;
  const auto beside = [&](int corner) -> Matrix2Xd {
    return (*H * corners_of(tags, corner).colwise().homogeneous()).colwise().hnormalized() - places;
  };
  const Matrix2Xd right = beside(1), below = beside(3), off = beside(0);
  if (!(right.row(0).array() > 0).all() || !(below.row(1).array() > 0).all() || !off.allFinite()) return std::nullopt;
  const double width = (right - off).row(0).mean(), height = (below - off).row(1).mean();
  return std::max(off.cwiseAbs().maxCoeff(), std::abs(width - height));
}

/// Number of columns under which the tags stand best, within the tolerance.
std::optional<std::pair<int, double>> best_columns(const TagCorners& tags, double tolerance) {
  std::optional<std::pair<int, double>> best;
  for (int cols = 2; cols <= tags.rbegin()->first; ++cols) {
    const auto misfit = misfit_of(tags, cols);
    if (misfit && *misfit < (best ? best->second : tolerance)) best = {cols, *misfit};
  }
  return best;
}

/// Gap over side of two tags on one line: `end` is the corner of the first tag that is towards the second.
double gap_between(const Eigen::Matrix<double, 2, 4>& a, const Eigen::Matrix<double, 2, 4>& b, int end) {
  const double inner = (a.col(end) - b.col(0)).norm(), outer = (a.col(0) - b.col(end)).norm();
  const double sides = (a.col(end) - a.col(0)).norm() * (b.col(end) - b.col(0)).norm();
  return std::sqrt(1 + inner * outer / sides) - 1;  // the root is the spacing over the side
}

std::vector<double> neighbour_gaps(const TagCorners& tags, int cols) {
  std::vector<double> out;
  const auto add = [&](const Eigen::Matrix<double, 2, 4>& from, int id, int end) {
    const auto next = tags.find(id);
    if (next == tags.end()) return;
    const double gap = gap_between(from, next->second, end);
    if (std::isfinite(gap)) out.push_back(gap);
  };
  for (const auto& [id, corners] : tags) {
    if ((id + 1) % cols) add(corners, id + 1, 1);
    add(corners, id + cols, 3);
  }
  return out;
}

double robust_spread(std::vector<double> values, double middle) {
  for (double& value : values) value = std::abs(value - middle);
  return mad_to_sigma * midpoint_median(std::move(values));
}

}  // namespace

void TagGridOptions::validate() const {
  require(tolerance > 0 && tolerance < 0.5, "tolerance must lie between 0 and 0.5 [-]");
  require(min_tags >= 5, "min_tags must be at least 5, as any four fit");
}

TagGrid guess_tag_grid(std::span<const std::vector<TagDetection>> images, const TagGridOptions& options) {
  options.validate();
  require_tags(images);
  TagGrid out;
  out.family = commonest_family(images);
  out.ids = believed_ids(images, out.family);
  const TagCorners tags = fullest_image(images, out);
  if (tags.size() < static_cast<std::size_t>(options.min_tags)) {
    out.fit.message = "found " + std::to_string(tags.size()) + " tags in one image, expected at least " +
                      std::to_string(options.min_tags);
    return out;
  }
  const auto found = best_columns(tags, options.tolerance);
  const std::vector<double> gaps = found ? neighbour_gaps(tags, found->first) : std::vector<double>();
  if (gaps.empty()) {
    out.fit.message = found ? "no two neighbours of the grid are seen in one image"
                            : "the tags stand in no grid numbered row by row from 0";
    return out;
  }
  std::tie(out.cols, out.misfit) = *found;
  out.rows = out.ids.back() / out.cols + 1;
  out.gap = midpoint_median(gaps);
  out.gap_spread = robust_spread(gaps, out.gap);
  out.fit.status = FitStatus::Converged;
  out.fit.final_rms = out.misfit / options.tolerance;
  out.fit.message = "grid of " + std::to_string(out.rows) + " x " + std::to_string(out.cols) + " tags";
  return out;
}

}  // namespace kr5::vision
