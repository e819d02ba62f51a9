// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/point_alignment.hpp>

#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>

namespace kr5 {
namespace {

constexpr double min_spread = 1e-9;  // second over first singular value of points that are not on one line

Eigen::VectorXd weights_of(Eigen::Index points, const PointAlignmentOptions& options) {
  options.validate();
  if (options.weights.size() == 0) return Eigen::VectorXd::Ones(points);
  require(options.weights.size() == points, "weights: found " + std::to_string(options.weights.size()) +
                                                ", expected one for each of " + std::to_string(points) + " points");
  return options.weights;
}

/// Whether points differ by more than the rounding of their coordinates.
bool differ(const Eigen::Matrix3Xd& points, const Eigen::Vector3d& centre) {
  return (points.colwise() - centre).norm() > 1e-12 * points.norm();
}

}  // namespace

void PointAlignmentOptions::validate() const {
  require(weights.size() == 0 || (weights.allFinite() && weights.minCoeff() >= 0 && weights.sum() > 0),
          "weights must be finite and not negative, and one positive [-]");
}

PointAlignment align_points(const Eigen::Matrix3Xd& from, const Eigen::Matrix3Xd& to,
                            const PointAlignmentOptions& options) {
  require(from.cols() > 0 && from.cols() == to.cols(), "found " + std::to_string(from.cols()) + " points and " +
                                                           std::to_string(to.cols()) +
                                                           " to carry them to, expected as many");
  require(from.allFinite() && to.allFinite(), "points must be finite [m]");
  const Eigen::VectorXd w = weights_of(from.cols(), options);
  const Eigen::Vector3d a = from * w / w.sum(), b = to * w / w.sum();
  const Eigen::Matrix3Xd centred = from.colwise() - a;
  const Eigen::Matrix3d H = (to.colwise() - b) * w.asDiagonal() * centred.transpose();
  PointAlignment out;
  out.T_to_from.linear() = nearest_rotation(H);
  const bool spread = differ(from, a) && differ(to, b);
  const double squares = centred.colwise().squaredNorm().dot(w);
  if (options.scale && spread && squares > 0) out.scale = out.T_to_from.linear().cwiseProduct(H).sum() / squares;
  out.T_to_from.translation() = b - out.scale * (out.T_to_from.linear() * a);
  const Eigen::VectorXd extent = singular_values(H);
  const bool open = !spread || !(extent[1] > min_spread * extent[0]);
  out.fit = {open ? FitStatus::Degenerate : FitStatus::Converged, 1, 0.0, 0.0,
             open ? "the points lie on one line: the turn about it is not determined"
                  : "pose from " + std::to_string(from.cols()) + " points"};
  return out;
}

}  // namespace kr5
