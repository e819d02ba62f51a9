#pragma once

#include <algorithm>
#include <cmath>

#include <kr5/kinematics/inverse.hpp>

namespace kr5::test {

/// Difference of angles, whatever the full turns.
inline double apart(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  double sum = 0;
  for (Eigen::Index i = 0; i < a.size(); ++i) sum += std::abs(std::remainder(a[i] - b[i], 2 * M_PI));
  return sum;
}

inline double nearest(const kinematics::InverseResult& result, const Eigen::VectorXd& q) {
  double best = 1e9;
  for (const kinematics::Posture& p : result.postures) best = std::min(best, apart(p.q, q));
  return best;
}

}  // namespace kr5::test
