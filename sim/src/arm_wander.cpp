// SPDX-License-Identifier: BSD-3-Clause
#include "arm_wander.hpp"

#include <cmath>

namespace kr5::sim {
namespace {

constexpr double wandering = 1.5;  // time in which the arm forgets how far it was off [s]
constexpr double lever = 0.5;      // over which the same errors turn the tool [m]

}  // namespace

double ArmWander::sigma(int axis) const { return repeatability_ / 3 / (axis < 3 ? 1.0 : lever); }

void ArmWander::draw(Random& random) {
  for (int i = 0; i < 6; ++i) off_[i] = random.normal(sigma(i));
}

void ArmWander::pass(double time, Random& random) {
  const double keep = std::exp(-time / wandering), fresh = std::sqrt(1 - keep * keep);
  for (int i = 0; i < 6; ++i) off_[i] = keep * off_[i] + random.normal(fresh * sigma(i));
}

Pose ArmWander::applied(const Pose& T) const {
  Pose out = T;
  out.translation() += off_.head<3>();
  out.linear() = exp_rotation(off_.tail<3>()) * out.linear();
  return out;
}

}  // namespace kr5::sim
