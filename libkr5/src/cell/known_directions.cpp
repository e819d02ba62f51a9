// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/cell/known_directions.hpp>

#include <algorithm>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/statistics.hpp>

namespace kr5::cell {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Slopes between the neighbours of each row.
ArrayXd speeds_of(const VectorXd& t, const VectorXd& q) {
  ArrayXd out = ArrayXd::Zero(t.size());
  for (Index i = 0; i < t.size(); ++i) {
    const Index before = std::max<Index>(i - 1, 0), after = std::min<Index>(i + 1, t.size() - 1);
    if (t[after] > t[before]) out[i] = (q[after] - q[before]) / (t[after] - t[before]);
  }
  return out;
}

}  // namespace

Eigen::ArrayXXd known_directions(const Experiment& experiment, int joints) {
  const VectorXd t = experiment.data.column("t");
  Eigen::ArrayXXd out = Eigen::ArrayXXd::Ones(t.size(), joints);
  if (experiment.speed_noise.size() == 0) return out;
  require(experiment.speed_noise.size() == joints, "speed_noise: found " +
                                                       std::to_string(experiment.speed_noise.size()) +
                                                       " values, expected one a joint, " + std::to_string(joints));
  for (int k = 0; k < joints; ++k) {
    const ArrayXd speed = speeds_of(t, experiment.data.column("qc" + std::to_string(k + 1)));
    out.col(k) = known_signs(speed, experiment.speed_noise[k]);
  }
  return out;
}

}  // namespace kr5::cell
