// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/pellet_image.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/SVD>

#include <kr5/core/error.hpp>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/statistics.hpp>
#include <kr5/uncertainty/confidence.hpp>

#include "edge_image.hpp"
#include "outline.hpp"

namespace kr5::picking {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;

void PelletImageOptions::validate() const {
  require(edge_spacing >= 1 && edge_spacing <= 50, "edge_spacing must lie between 1 and 50 [px]");
  require(search_sigmas >= 1 && search_sigmas <= 10, "search_sigmas must lie between 1 and 10 [-]");
  require(max_search >= 3 && max_search <= 500, "max_search must lie between 3 and 500 [px]");
  require(min_edge >= 2 && min_edge <= 100, "min_edge must lie between 2 and 100 [-]");
  require(edge_sigma > 0 && edge_sigma < 10, "edge_sigma must lie between 0 and 10 [px]");
  require(edge_bias > 0 && edge_bias < 10, "edge_bias must lie between 0 and 10 [px]");
  require(min_supported > 0 && min_supported <= 1, "min_supported must lie between 0 and 1 [-]");
  require(clearly_better > 0 && clearly_better <= 1, "clearly_better must lie between 0 and 1 [-]");
  require(confidence > 0.5 && confidence < 1, "confidence must lie between 0.5 and 1 [-]");
}

namespace {

constexpr int image_steps = outline_steps + outline_parts;
using StepVector = Eigen::Matrix<double, image_steps, 1>;
using ViewVector = Eigen::Matrix<double, outline_steps, 1>;
using ViewMatrix = Eigen::Matrix<double, outline_steps, outline_steps>;

/// A cylinder before a camera, and how far the edges of each part of the outline stand off it [px].
struct ImageState {
  OutlineView view;
  Eigen::Matrix<double, outline_parts, 1> bias = Eigen::Matrix<double, outline_parts, 1>::Zero();
};

/// An edge that was found for a place on the outline.
struct FoundEdge {
  OutlinePoint point;
  double offset = 0.0;  ///< [px]
  double sigma = 0.0;   ///< [px]
};

/// Edges against the outline, and the estimate that the cloud and the calibration of the camera give.
struct EdgeProblem {
  const Pinhole& camera;
  const std::vector<FoundEdge>& edges;
  const OutlineView& start;
  const ViewMatrix& whitening;  ///< Inverse root of the covariance of the start.
  double edge_bias, inflation;

  NormalEquations<image_steps> equations(const ImageState& at) const {
    NormalEquations<image_steps> out;
    for (const FoundEdge& edge : edges) {
      OutlineRow row;
      const auto part = static_cast<int>(edge.point.part);
      const double residual = outline_offset(at.view, camera, edge.point, &row) + at.bias[part] - edge.offset;
      StepVector jacobian = StepVector::Zero();
      jacobian.head<outline_steps>() = row.transpose();
      jacobian[outline_steps + part] = 1;
      const double sigma = edge.sigma * inflation;
      out.add_huber(jacobian / sigma, residual / sigma, 2.5);
    }
    const ViewVector residuals = whitening * departure(at.view);
    for (int i = 0; i < outline_steps; ++i) {
      StepVector jacobian = StepVector::Zero();
      jacobian.head<outline_steps>() = whitening.row(i).transpose();
      out.add(jacobian, residuals[i]);
    }
    for (int k = 0; k < outline_parts; ++k)
      out.add(StepVector::Unit(outline_steps + k) / edge_bias, at.bias[k] / edge_bias);
    return out;
  }

  ImageState moved(const ImageState& from, const StepVector& step) const {
    return {from.view.moved(step.head<outline_steps>()), from.bias + step.tail<outline_parts>()};
  }

  /// From the start, as steps.
  ViewVector departure(const OutlineView& view) const {
    ViewVector out;
    const SolidCylinder &from = start.cylinder, &to = view.cylinder;
    out.head<3>() = from.frame.transpose() * (to.centre - from.centre);
    out.segment<2>(3) = log_rotation(from.frame.transpose() * to.frame).head<2>();
    out[5] = to.radius - from.radius;
    out[6] = to.height - from.height;
    out.tail<6>() = pose_difference(start.T_camera_base, view.T_camera_base);
    return out;
  }
};

/// Covariance of the steps beforehand; what is exactly known is known to a nanometre, so that there is an inverse.
ViewMatrix prior_covariance(const Pellet& pellet, const UncertainPose& T_camera_base) {
  ViewMatrix out = ViewMatrix::Zero();
  out.topLeftCorner<7, 7>() = pellet.covariance;
  out.bottomRightCorner<6, 6>() = T_camera_base.covariance;
  out.diagonal().array() += 1e-18;
  return out;
}

void require_pellet(const Pellet& pellet) {
  require(pellet.centre.allFinite() && is_rotation(pellet.frame), "pellet: centre or frame is no pose");
  require(pellet.radius > 0 && pellet.radius < 1 && pellet.height > 0 && pellet.height < 1,
          "pellet: radius and height must be positive and below 1 m; are they in millimetres? [m]");
  const std::string defect = covariance_defect(pellet.covariance);
  require(defect.empty(), "pellet: no covariance: " + defect);
}

/// Whether another cylinder stands between the camera and a place, or shows its own outline within `margin` [m] of it.
bool hidden(const OutlineView& view, const OutlinePoint& point, const std::vector<Pellet>& others, double margin) {
  const Vector3d eye = view.T_camera_base.inverse().translation(), place = outline_place(view, point);
  const double distance = (place - eye).norm(), nearer = 0.1 * view.cylinder.radius;
  return std::any_of(others.begin(), others.end(), [&](const Pellet& other) {
    if ((other.centre - view.cylinder.centre).norm() < 0.5 * view.cylinder.radius) return false;  // itself
    SolidCylinder solid = solid_of(other);
    solid.radius += margin;
    solid.height += 2 * margin;
    const auto chord = solid.chord(solid.local(eye), solid.frame.transpose() * ((place - eye) / distance));
    return chord.hits() && chord.in < distance - nearer;
  });
}

/// The places to search, how they move, and how the image supports an edge there.
struct Search {
  std::vector<OutlinePoint> points;
  MatrixXd rows;                             ///< By steps of one prior standard deviation each [px].
  std::vector<double> half;                  ///< [px]
  std::vector<std::vector<double>> support;  ///< By place along the normal.

  static constexpr double step = 0.5;  ///< Of the places along a normal [px].

  double at(std::size_t i, double offset) const {
    const double place = (offset + half[i]) / step;
    const auto k = static_cast<std::ptrdiff_t>(std::floor(place));
    if (k < 0 || k + 1 >= static_cast<std::ptrdiff_t>(support[i].size())) return 0.0;
    const double share = place - static_cast<double>(k);
    const auto at = support[i].begin() + k;
    return (1 - share) * at[0] + share * at[1];
  }
};

/// A place of the outline and how well it is supported.
struct Hypothesis {
  Eigen::Vector3d along = Eigen::Vector3d::Zero();  ///< In prior standard deviations, along the directions.
  Eigen::VectorXd offsets;                          ///< [px]
  double score = -std::numeric_limits<double>::infinity();
};

/// The outline moves along the three directions, as uncertain beforehand, in which it moves the most; every place on a
/// grid of them, a pixel apart, is judged by the edges that support it and by the prior. Beside the best: the support
/// of the best of the others, relative to it, where the two differ by more than `apart` pixels.
struct SearchResult {
  ViewVector steps = ViewVector::Zero();  ///< In prior standard deviations.
  double second_best = 0.0;
};
SearchResult search_outline(const Search& search, double sigmas) {
  constexpr double apart = 3.0;
  const Eigen::JacobiSVD<MatrixXd> svd(search.rows, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const MatrixXd directions = svd.matrixV().leftCols(3), motion = search.rows * directions;
  std::array<int, 3> count{};
  for (int k = 0; k < 3; ++k)
    count[static_cast<std::size_t>(k)] =
        std::clamp(static_cast<int>(std::ceil(sigmas * motion.col(k).cwiseAbs().maxCoeff())), 0, 25);
  const auto supported = [&](const Eigen::VectorXd& offsets, std::size_t i) {
    return search.at(i, offsets[static_cast<Index>(i)]);
  };
  std::vector<Hypothesis> all;
  for (int a = -count[0]; a <= count[0]; ++a)
    for (int b = -count[1]; b <= count[1]; ++b)
      for (int c = -count[2]; c <= count[2]; ++c) {
        Hypothesis h;
        h.along = Vector3d(a / std::max(1.0, double(count[0])), b / std::max(1.0, double(count[1])),
                           c / std::max(1.0, double(count[2]))) *
                  sigmas;
        if (h.along.norm() > 1.3 * sigmas) continue;
        h.offsets = motion * h.along;
        h.score = -0.5 * h.along.squaredNorm();
        for (std::size_t i = 0; i < search.points.size(); ++i) h.score += supported(h.offsets, i);
        all.push_back(std::move(h));
      }
  const Hypothesis& best =
      *std::max_element(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.score < b.score; });
  SearchResult out;
  out.steps = directions * best.along;
  for (const Hypothesis& h : all) {
    double own = 0;  // what speaks for the best place against this one
    for (std::size_t i = 0; i < search.points.size(); ++i)
      if (std::abs(h.offsets[static_cast<Index>(i)] - best.offsets[static_cast<Index>(i)]) > apart)
        own += supported(best.offsets, i);
    if (own < 0.1 * static_cast<double>(search.points.size())) continue;  // nearly the same place
    out.second_best = std::max(out.second_best, 1 - (best.score - h.score) / own);
  }
  return out;
}

class Refinement {
 public:
  Refinement(ImageView image, const Pinhole& camera, const UncertainPose& T_camera_base, const Pellet& pellet,
             const std::vector<Pellet>& others, const PelletImageOptions& options)
      : camera_(camera),
        others_(others),
        options_(options),
        prior_(prior_covariance(pellet, T_camera_base)),
        start_{solid_of(pellet), T_camera_base.T},
        image_(image, {0, 0}, {-1, -1}, 1) {
    out_.pellet = pellet;
    root_ = Eigen::LLT<ViewMatrix>(prior_).matrixL();
    whitening_ = root_.triangularView<Eigen::Lower>().solve(ViewMatrix::Identity());
    prepare(image);
  }

  PelletRefinement run() {
    if (search_.points.empty()) return out_;
    const SearchResult found = search_outline(search_, options_.search_sigmas);
    out_.second_best = found.second_best;
    ImageState at{start_.moved(root_ * found.steps)};
    fit(at);
    return judged(at);
  }

 private:
  PelletRefinement& say(PelletImageStatus status, const std::string& message) {
    out_.status = status;
    out_.fit.message = message;
    return out_;
  }

  std::vector<OutlinePoint> visible(const OutlineView& view) const {
    std::vector<OutlinePoint> out = outline(view, camera_, options_.edge_spacing);
    const double depth = (view.T_camera_base * view.cylinder.centre).z();
    const double margin = options_.edge_spacing * depth / std::max(camera_.fx, camera_.fy);
    std::erase_if(out, [&](const OutlinePoint& p) { return hidden(view, p, others_, margin); });
    return out;
  }

  /// Predicts the outline and collects, along each normal, what the image says.
  void prepare(ImageView image) {
    const std::vector<OutlinePoint> points = visible(start_);
    Vector2d low = Vector2d::Constant(1e9), high = -low;
    double longest = 0;
    std::vector<OutlineRow> rows;
    for (const OutlinePoint& p : points) {
      OutlineRow row;
      outline_offset(start_, camera_, p, &row);
      rows.push_back(row * root_);
      low = low.cwiseMin(p.pixel);
      high = high.cwiseMax(p.pixel);
      longest = std::max(longest, half_width(rows.back()));
    }
    if (points.empty()) {
      say(PelletImageStatus::OutsideImage, "the outline lies outside the image, or other cylinders hide it");
      return;
    }
    const double margin = longest + 4, reach = 0.15 * (high - low).minCoeff();
    image_ = EdgeImage(image, low.array() - margin, high.array() + margin, std::max(8, static_cast<int>(reach)));
    out_.noise = image_.noise();
    for (std::size_t i = 0; i < points.size(); ++i) add_place(points[i], rows[i]);
    search_.rows.resize(static_cast<Index>(search_.points.size()), outline_steps);
    for (std::size_t i = 0; i < rows_.size(); ++i) search_.rows.row(static_cast<Index>(i)) = rows_[i];
    const double inside = static_cast<double>(search_.points.size()) / static_cast<double>(points.size());
    if (search_.points.size() < 12 || inside < 0.5) {
      search_.points.clear();
      say(PelletImageStatus::OutsideImage, "too little of the outline lies in the image and is not hidden");
    }
  }

  double half_width(const OutlineRow& row) const {
    return std::clamp(options_.search_sigmas * row.norm() + 2, 3.0, options_.max_search);
  }

  void add_place(const OutlinePoint& point, const OutlineRow& row) {
    const double half = half_width(row);
    if (!image_.covers(point.pixel + half * point.normal) || !image_.covers(point.pixel - half * point.normal)) return;
    std::vector<double> support;
    for (double s = -half; s <= half + Search::step; s += Search::step) {
      const Vector2d pixel = point.pixel + std::min(s, half) * point.normal;
      support.push_back(image_.support(pixel, image_.slope(pixel, point.normal), options_.min_edge));
    }
    search_.points.push_back(point);
    search_.half.push_back(half);
    search_.support.push_back(std::move(support));
    rows_.push_back(row);
  }

  /// Fits to the edges nearest to the outline, again and again within less of it.
  void fit(ImageState& at) {
    double inflation = 1;
    NormalEquations<image_steps> end;
    for (const double gate : {3.5, 2.5, 1.5, 1.5, 1.5}) {
      associate(at, gate);
      const EdgeProblem problem{camera_, edges_, start_, whitening_, options_.edge_bias, inflation};
      const auto result = levenberg_marquardt<image_steps>(at, problem, {.max_iterations = 20, .sigma = 1.0});
      if (!result.usable() && result.status != LevenbergMarquardtStatus::MaxIterations) break;
      at = result.x;
      out_.fit.iterations += result.iterations;
      std::vector<double> residuals;
      double sum = 0;
      for (const FoundEdge& edge : edges_) {
        const double r = outline_offset(at.view, camera_, edge.point, nullptr) +
                         at.bias[static_cast<int>(edge.point.part)] - edge.offset;
        residuals.push_back(std::abs(r) / edge.sigma);
        sum += r * r;
      }
      out_.rms_px = std::sqrt(sum / std::max<double>(1, static_cast<double>(edges_.size())));
      inflation = std::clamp(mad_to_sigma * median(residuals), 1.0, 10.0);
      out_.fit.final_rms = mad_to_sigma * median(residuals);
      end = EdgeProblem{camera_, edges_, start_, whitening_, options_.edge_bias, inflation}.equations(at);
      if (out_.fit.iterations == result.iterations) out_.fit.initial_rms = out_.fit.final_rms;
    }
    covariance_ = end.covariance(1.0);
  }

  void associate(const ImageState& at, double gate) {
    edges_.clear();
    ends_predicted_ = 0;
    ends_supported_ = 0;
    const std::vector<OutlinePoint> points = visible(at.view);
    out_.predicted = 0;
    for (const OutlinePoint& point : points) {
      const double bias = at.bias[static_cast<int>(point.part)];
      if (!image_.covers(point.pixel + (gate + 3) * point.normal) ||
          !image_.covers(point.pixel - (gate + 3) * point.normal))
        continue;
      ++out_.predicted;
      const bool on_end = point.part != OutlinePart::Left && point.part != OutlinePart::Right;
      ends_predicted_ += on_end;
      const auto found =
          edges_on_line(image_, point.pixel + bias * point.normal, point.normal, gate, options_.min_edge);
      if (found.empty()) continue;
      ends_supported_ += on_end;
      const auto nearest = std::min_element(found.begin(), found.end(), [](const auto& a, const auto& b) {
        return std::abs(a.offset) < std::abs(b.offset);
      });
      edges_.push_back({point, nearest->offset + bias, std::hypot(nearest->sigma, options_.edge_sigma)});
    }
    out_.supported = static_cast<int>(edges_.size());
  }

  PelletRefinement judged(const ImageState& at) {
    const std::string counts = std::to_string(out_.supported) + " of " + std::to_string(out_.predicted);
    if (out_.supported < 8 || out_.supported < options_.min_supported * out_.predicted || !covariance_)
      return say(PelletImageStatus::TooFewEdges,
                 "only " + counts + " expected edges were found; check the light, the focus and T_camera_base");
    if (ends_supported_ < 3 || ends_supported_ < options_.min_supported * ends_predicted_)
      return say(PelletImageStatus::TooFewEdges, "only " + std::to_string(ends_supported_) + " of " +
                                                     std::to_string(ends_predicted_) +
                                                     " edges of its ends were found; the cloud is too far off, or "
                                                     "others hide them");
    const EdgeProblem problem{camera_, edges_, start_, whitening_, options_.edge_bias, 1.0};
    const double squared = (whitening_ * problem.departure(at.view)).squaredNorm();
    // The refined estimate lies nearer to the first one than the truth does: its departure is a chi-square at most.
    if (squared > uncertainty::chi_square_quantile(options_.confidence, 7))
      return say(PelletImageStatus::Contradiction,
                 "the edges lie where the cloud rules them out; check T_camera_base, and whether something moved since "
                 "the scan");
    if (out_.second_best > options_.clearly_better)
      return say(PelletImageStatus::Ambiguous,
                 "two places are supported nearly alike; the edges of a neighbour may be taken for its own");
    const SolidCylinder& c = at.view.cylinder;
    Pellet& p = out_.pellet;
    p.centre = c.centre;
    p.frame = c.frame;
    p.axis = c.axis();
    p.radius = c.radius;
    p.height = c.height;
    p.covariance = covariance_->topLeftCorner<7, 7>();
    out_.fit.status = FitStatus::Converged;
    return say(PelletImageStatus::Refined, counts + " expected edges were found");
  }

  const Pinhole& camera_;
  const std::vector<Pellet>& others_;
  const PelletImageOptions& options_;
  ViewMatrix prior_, root_, whitening_;
  OutlineView start_;
  EdgeImage image_;
  Search search_;
  std::vector<OutlineRow> rows_;
  std::vector<FoundEdge> edges_;
  int ends_predicted_ = 0, ends_supported_ = 0;
  std::optional<NormalEquations<image_steps>::Matrix> covariance_;
  PelletRefinement out_;
};

}  // namespace

PelletRefinement refine_pellet(ImageView image, const Pinhole& camera, const UncertainPose& T_camera_base,
                               const Pellet& pellet, const std::vector<Pellet>& others,
                               const PelletImageOptions& options) {
  options.validate();
  camera.validate();
  require(image.data != nullptr && image.width == camera.width && image.height == camera.height,
          "image: must have the size of the camera's, " + std::to_string(camera.width) + " x " +
              std::to_string(camera.height) + " px");
  require(T_camera_base.T.matrix().allFinite() && is_rotation(T_camera_base.T.linear()),
          "T_camera_base is no rigid motion");
  const std::string defect = covariance_defect(T_camera_base.covariance);
  require(defect.empty(), "T_camera_base has no covariance: " + defect);
  require_pellet(pellet);
  for (const Pellet& other : others) require_pellet(other);
  return Refinement(image, camera, T_camera_base, pellet, others, options).run();
}

}  // namespace kr5::picking
