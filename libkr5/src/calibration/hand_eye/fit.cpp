// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye/fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

namespace kr5::calibration::hand_eye {
namespace {

constexpr double student_dof = 4.0;
constexpr int variance_steps = 4;  // at each step of the poses; they settle together

Poses moved(const Poses& poses, const Vector12& b) {
  Poses out{poses.X * to_pose(b.head<6>()), poses.Z * to_pose(b.tail<6>())};
  out.X.linear() = nearest_rotation(out.X.linear());
  out.Z.linear() = nearest_rotation(out.Z.linear());
  return out;
}

}  // namespace

std::optional<LinearView> HandEyeFit::linear(std::size_t i) const {
  return linearise(mount, poses, observed_views[i], *camera, errors[i]);
}

std::vector<WeightedView> HandEyeFit::active() const {
  std::vector<WeightedView> out;
  for (std::size_t i = 0; i < observed_views.size(); ++i)
    if (weights[i] > 0)
      if (const auto view = linear(i)) out.push_back({*view, weights[i]});
  return out;
}

double HandEyeFit::cost(const Poses& at, const std::vector<Vector6>& e) const {
  const Vector6 information = variances.robot().diagonal().cwiseInverse();
  double sum = 0;
  for (std::size_t i = 0; i < observed_views.size(); ++i) {
    if (!(weights[i] > 0)) continue;
    const double pixel = variances.value[2] * observed_views[i].input->correlation;
    sum += weights[i] *
           (pixel_squares(mount, at, observed_views[i], *camera, e[i]) / pixel + e[i].cwiseAbs2().dot(information));
  }
  return sum;
}

/// One Gauss-Newton step, shortened until it helps. Returns whether it was large enough to go on.
bool HandEyeFit::move(const std::vector<WeightedView>& views, const std::vector<std::size_t>& index) {
  std::vector<Vector6> best = errors;
  for (std::size_t k = 0; k < views.size(); ++k) {
    const LinearView& view = views[k].view;
    best[index[k]] = variances.robot() * variances.of(view).ldlt().solve(Vector6(view.y - view.F * estimate.b));
  }
  const double before = cost(poses, errors);
  for (double length = 1; length > 1e-3; length *= 0.5) {
    const Poses next = moved(poses, length * estimate.b);
    std::vector<Vector6> e = errors;
    double far = 0;
    for (const std::size_t i : index) {
      e[i] += length * (best[i] - errors[i]);
      const Vector6 sigma = variances.robot().diagonal().cwiseSqrt();
      far = std::max(far, (best[i] - errors[i]).cwiseQuotient(sigma).cwiseAbs().maxCoeff());
    }
    if (!(cost(next, e) <= before * (1 + 1e-9) + 1e-12)) continue;
    poses = next;
    errors = e;
    const Vector12 sigma = estimate.covariance.diagonal().cwiseSqrt();
    return far > 1e-4 || estimate.b.cwiseQuotient(sigma).cwiseAbs().maxCoeff() > 1e-4;
  }
  return false;
}

void HandEyeFit::settle(int max_iterations, bool student) {
  settled = false;
  for (int step = 0; step < max_iterations && !settled; ++step, ++iterations) {
    std::vector<WeightedView> views;
    std::vector<std::size_t> index;
    for (std::size_t i = 0; i < observed_views.size(); ++i) {
      if (!(weights[i] > 0)) continue;
      if (const auto view = linear(i)) {
        views.push_back({*view, weights[i]});
        index.push_back(i);
      }
    }
    const Eigen::Vector3d before = variances.value;
    estimate_variances(views, variances, variance_steps);
    estimate = solve(views, variances);
    const bool moving = move(views, index);
    double reweighted = 0;
    for (std::size_t k = 0; student && k < views.size(); ++k) {
      const LinearView& view = views[k].view;
      const Vector6 r = view.y - view.F * estimate.b;
      const double weight = (student_dof + 6) / (student_dof + r.dot(variances.of(view).ldlt().solve(r)));
      reweighted = std::max(reweighted, std::abs(weight - weights[index[k]]));
      weights[index[k]] = weight;
    }
    const double varied = (variances.value.cwiseQuotient(before).array() - 1).abs().maxCoeff();
    settled = !moving && reweighted < 0.05 && varied < 1e-3;
  }
}

double HandEyeFit::deleted_distance(std::size_t i) const {
  const auto view = linear(i);
  if (!view) return std::numeric_limits<double>::infinity();
  const Matrix6 spread = view->F * estimate.covariance * view->F.transpose();
  const Matrix6 V = variances.of(*view);
  const Matrix6 Q = weights[i] > 0 ? Matrix6(V - spread) : Matrix6(V + spread);
  return std::max(0.0, view->y.dot(Q.ldlt().solve(view->y)));
}

}  // namespace kr5::calibration::hand_eye
