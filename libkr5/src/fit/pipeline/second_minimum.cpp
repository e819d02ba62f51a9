// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/pipeline/second_minimum.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace kr5::fit::pipeline {

std::optional<SecondMinimum> second_minimum(const Pose& best, const Pose& second, double best_cost, double second_cost,
                                            double dof) {
  constexpr double near = 4.0;  // ratio of squares up to which another pose is told, however certain the choice
  SecondMinimum out;
  out.T = second;
  out.cost_ratio = second_cost / std::max(best_cost, 1e-300);
  // The likelihood of a noise that was itself estimated falls off like Student's distribution, not the normal one.
  const double likelihood = std::pow(1 + std::max(0.0, second_cost - best_cost) / dof, -dof / 2);
  out.probability = likelihood / (1 + likelihood);
  const Vector6 d = pose_difference(best, second);
  out.position = d.head<3>().norm(), out.rotation = d.tail<3>().norm();
  if (out.cost_ratio > near && out.probability < undecided) return std::nullopt;
  return out;
}

void refuse_undecided(const std::optional<SecondMinimum>& second, const std::string& claim, const std::string& remedy,
                      FitReport& fit) {
  if (!second || second->probability < undecided || !fit.usable()) return;
  fit.status = FitStatus::Degenerate;
  fit.message = claim + ": " + second_text(*second) + "; " + remedy;
}

std::string second_text(const SecondMinimum& second) {
  char text[160];
  std::snprintf(text, sizeof text, "the other, %.1f mm and %.1f deg away, has %.2f times the squared residuals",
                1e3 * second.position, 180 / std::numbers::pi * second.rotation, second.cost_ratio);
  return text;
}

}  // namespace kr5::fit::pipeline
