// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <span>

#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/force/insertion.hpp>
#include <kr5/force/peg_on_tube.hpp>

namespace kr5::force {

/// Least squares of a depth profile, a few evaluations at a time: the same in real time and at a desk. Nothing here
/// allocates or throws.
class TubeSearch {
 public:
  /// Centre x, y of the tube, height of its face [m], and by how much what gives way gives more than the heights were
  /// corrected by [m/N].
  using Place = Eigen::Vector4d;

  struct Solution {
    Place place = Place::Zero();
    NormalEquations<4> normal;
    int iterations = 0;
    bool converged = false;  ///< No step leads to a better place.
  };

  /// @param compliance_std Standard deviation of the fourth of a place, about 0; at 0 it stays 0 [m/N].
  TubeSearch(const PegTube& bodies, int max_iterations, double compliance_std = 0.0);

  /// The rows are not copied. @param about Where the tube is looked for, up to its outer radius and a fifth around.
  void begin(std::span<const ProfileRow> rows, const Eigen::Vector2d& about) noexcept;
  /// @return All is done: best() is the answer.
  bool advance(int evaluations) noexcept;
  const Solution& best() const noexcept { return best_; }
  /// By how much the best place moves when the peg is tilted otherwise than its rows say: by x and y of a rotation
  /// vector [m/rad], [m/N/rad].
  Eigen::Matrix<double, 4, 2> by_tilt() const noexcept;

 private:
  static constexpr int directions = 12, distances = 4, kept = 10;

  /// Cost: sum of squares [m^2]; infinite where the peg would fall.
  NormalEquations<4> at(const Place& place) const noexcept;
  Eigen::Vector4d slope_of(const PegRest& rest, const ProfileRow& row) const noexcept;
  Place start(int number) const noexcept;
  void look() noexcept;
  void next() noexcept;
  void refine() noexcept;
  void finish() noexcept;

  PegTube bodies_;
  double compliance_std_;
  std::span<const ProfileRow> rows_;
  Eigen::Vector2d about_ = Eigen::Vector2d::Zero();
  int looked_ = 0, refined_ = 0;
  std::array<Solution, kept> starts_;  ///< The best of all, rising by cost.
  int started_ = 0;
  Solution now_, best_;
  LevenbergMarquardt<4> optimizer_;
};

}  // namespace kr5::force
