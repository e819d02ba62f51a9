// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/workspace_map.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Dense>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/kinematics/jacobian.hpp>

#include "kinematics/wrist_arm.hpp"

namespace kr5::kinematics {
namespace {

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();
constexpr int searches = 12;       // postures from which the extremes are searched
constexpr int most_sweeps = 400;   // of such a search
constexpr double settled = 1e-10;  // gain of a sweep, over the size, at which it ends

/// The point in cylinder coordinates about the axis of the first joint.
struct Place {
  double radius = 0.0;
  double height = 0.0;
};

class Space {
 public:
  Space(const DhChain& chain, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
        const WorkspaceOptions& options)
      : chain_(chain), lower_(lower), upper_(upper), point_(options.point) {
    const auto n = static_cast<Eigen::Index>(chain.joints.size());
    require(n > 0, "the arm has no joints");
    require(lower.size() == n && upper.size() == n, "the arm has " + std::to_string(n) + " joints, the limits have " +
                                                        std::to_string(lower.size()) + " and " +
                                                        std::to_string(upper.size()) + " values");
    for (Eigen::Index i = 0; i < n; ++i) limit(i);
    axis_ = chain.T_base_0.linear().col(2);
    if (axis_.z() < -1e-9) axis_ = -axis_;  // heights count upwards in the base
  }

  Place place(const Eigen::VectorXd& q) const {
    const Eigen::Vector3d p = chain_.flange(q) * point_, from = p - chain_.T_base_0.translation();
    return {(from - axis_.dot(from) * axis_).norm(), axis_.dot(p)};
  }

  /// Posture k of a sequence that fills the limits evenly (additive recurrence, Roberts 2018); the first joint, when it
  /// turns, changes neither radius nor height.
  Eigen::VectorXd posture(int k) const {
    const Eigen::Index n = lower_.size();
    const bool turns = chain_.joints.front().type == JointType::Revolute;
    const auto dimensions = static_cast<double>(n - (turns ? 1 : 0));
    double phi = 2.0;
    for (int round = 0; round < 60; ++round) phi = std::pow(1 + phi, 1 / (dimensions + 1));
    Eigen::VectorXd q = 0.5 * (lower_ + upper_);
    double factor = 1.0;
    for (Eigen::Index i = turns ? 1 : 0; i < n; ++i) {
      factor /= phi;
      const double share = std::fmod(0.5 + factor * (k + 1), 1.0);
      q[i] = lower_[i] + share * (upper_[i] - lower_[i]);
    }
    return q;
  }

  /// The posture of the greatest value, found from a first one joint by joint.
  Eigen::VectorXd climb(Eigen::VectorXd q, const auto& value) const {
    double best = value(place(q)), step = 0.3;
    for (int sweep = 0; sweep < most_sweeps && step > 1e-9; ++sweep) {
      const double before = best;
      const Eigen::VectorXd from = q;
      for (Eigen::Index i = 0; i < q.size(); ++i) best = climb_joint(q, i, step, best, value);
      // Along the way that the sweep went, for joints that only help together.
      const Eigen::VectorXd further = (q + 2 * (q - from)).cwiseMax(lower_).cwiseMin(upper_);
      if (const double there = value(place(further)); there > best) best = there, q = further;
      if (best - before < settled * (1 + std::abs(best))) step *= 0.3;
    }
    return q;
  }

 private:
  void limit(Eigen::Index i) {
    const std::string joint = "joint " + std::to_string(i + 1);
    require(!std::isnan(lower_[i]) && !std::isnan(upper_[i]) && lower_[i] <= upper_[i],
            joint + ": the lower limit must not exceed the upper one");
    if (std::isfinite(lower_[i]) && std::isfinite(upper_[i])) return;
    require(chain_.joints[static_cast<std::size_t>(i)].type == JointType::Revolute,
            joint + " is prismatic and has no limits: its workspace has no end");
    const double middle = std::isfinite(lower_[i])   ? lower_[i] + std::numbers::pi
                          : std::isfinite(upper_[i]) ? upper_[i] - std::numbers::pi
                                                     : 0.0;
    lower_[i] = middle - std::numbers::pi, upper_[i] = middle + std::numbers::pi;
  }

  double climb_joint(Eigen::VectorXd& q, Eigen::Index i, double step, double best, const auto& value) const {
    const double range = std::max(upper_[i] - lower_[i], 0.0), here = q[i];
    double found = here;
    for (const double side : {-1.0, 1.0}) {
      q[i] = std::clamp(here + side * step * range, lower_[i], upper_[i]);
      if (const double there = value(place(q)); there > best) best = there, found = q[i];
    }
    q[i] = found;
    return best;
  }

  const DhChain& chain_;
  Eigen::VectorXd lower_, upper_;
  Eigen::Vector3d point_, axis_;
};

/// The greatest value of all postures.
Eigen::VectorXd extreme(const Space& space, const std::vector<Place>& places, const auto& value) {
  std::vector<int> order(places.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
  const auto count = static_cast<std::ptrdiff_t>(std::min<std::size_t>(searches, order.size()));
  std::partial_sort(order.begin(), order.begin() + count, order.end(), [&](int a, int b) {
    return value(places[static_cast<std::size_t>(a)]) > value(places[static_cast<std::size_t>(b)]);
  });
  Eigen::VectorXd best;
  for (std::ptrdiff_t k = 0; k < count; ++k) {
    const Eigen::VectorXd q = space.climb(space.posture(order[static_cast<std::size_t>(k)]), value);
    if (best.size() == 0 || value(space.place(q)) > value(space.place(best))) best = q;
  }
  return best;
}

void keep_greatest(double& cell, double value) { cell = std::isnan(cell) ? value : std::max(cell, value); }
void keep_least(double& cell, double value) { cell = std::isnan(cell) ? value : std::min(cell, value); }

}  // namespace

void WorkspaceOptions::validate() const {
  require(point.allFinite(), "point must be finite [m]");
  require(characteristic_length >= 0 && std::isfinite(characteristic_length),
          "characteristic_length must not be negative [m]; 0 means the reach");
  require(samples >= 100 && samples <= 50'000'000, "samples must lie between 100 and 50 million");
  require(cells >= 4 && cells <= 2000, "cells must lie between 4 and 2000");
}

WorkspaceMap workspace_map(const DhChain& chain, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                           const WorkspaceOptions& options) {
  options.validate();
  const Space space(chain, lower, upper, options);
  std::vector<Place> places;
  for (int k = 0; k < options.samples; ++k) places.push_back(space.place(space.posture(k)));
  WorkspaceMap out;
  out.q_reach = extreme(space, places, [](const Place& p) { return p.radius; });
  out.reach = space.place(out.q_reach).radius;
  out.inner = space.place(extreme(space, places, [](const Place& p) { return -p.radius; })).radius;
  out.lowest = space.place(extreme(space, places, [](const Place& p) { return -p.height; })).height;
  out.highest = space.place(extreme(space, places, [](const Place& p) { return p.height; })).height;
  out.length = options.characteristic_length > 0 ? options.characteristic_length : std::max(out.reach, 1e-9);

  const int n = options.cells;
  const double wide = std::max(out.reach, 1e-9) / n, high = std::max(out.highest - out.lowest, 1e-9) / n;
  out.radius = Eigen::VectorXd::LinSpaced(n, wide / 2, (n - 0.5) * wide);
  out.height = Eigen::VectorXd::LinSpaced(n, out.lowest + high / 2, out.lowest + (n - 0.5) * high);
  out.counts = Eigen::MatrixXd::Zero(n, n);
  for (Eigen::MatrixXd* map : {&out.dexterity, &out.volume, &out.min_singular_value, &out.condition})
    map->setConstant(n, n, no_value);
  Pose T_flange_point = Pose::Identity();
  T_flange_point.translation() = options.point;
  for (int k = 0; k < options.samples; ++k) {
    const Place& p = places[static_cast<std::size_t>(k)];
    const auto column = std::clamp(static_cast<Eigen::Index>(p.radius / wide), Eigen::Index{0}, Eigen::Index{n - 1});
    const auto row =
        std::clamp(static_cast<Eigen::Index>((p.height - out.lowest) / high), Eigen::Index{0}, Eigen::Index{n - 1});
    const Jacobian J = jacobian(chain, space.posture(k), T_flange_point);
    const Manipulability all = manipulability(J, out.length);
    ++out.counts(row, column);
    keep_greatest(out.dexterity(row, column), singular_values(Eigen::MatrixXd(J.topRows<3>())).prod());
    keep_greatest(out.volume(row, column), all.volume);
    keep_greatest(out.min_singular_value(row, column), all.singular_values.tail<1>()[0]);
    keep_least(out.condition(row, column), all.condition);
  }
  return out;
}

std::optional<Eigen::Vector3d> wrist_centre(const DhChain& chain) {
  const auto arm = wrist_arm(chain);
  if (!arm) return {};
  return arm->T_base_flange.inverse() * (arm->size * arm->wrist);
}

}  // namespace kr5::kinematics
