// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/joint_motion.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::identification {

void JointMotion::validate() const {
  require(samples() > 0 && q.cols() > 0, "q: no sample of any joint");
  for (const auto& [name, values] : {std::pair<std::string, const Eigen::MatrixXd*>{"q", &q},
                                     {"qd", &qd},
                                     {"qdd", &qdd},
                                     {"tau", &tau},
                                     {"temperature", &temperature}}) {
    if (values == &temperature && temperature.size() == 0) continue;
    require(values->rows() == samples() && values->cols() == q.cols(),
            name + ": expected " + std::to_string(samples()) + " x " + std::to_string(q.cols()) + " numbers, found " +
                std::to_string(values->rows()) + " x " + std::to_string(values->cols()));
    if (values->allFinite()) continue;
    for (Eigen::Index i = 0; i < values->rows(); ++i)
      for (Eigen::Index j = 0; j < values->cols(); ++j)
        require(std::isfinite((*values)(i, j)),
                name + ": row " + std::to_string(i) + ", joint " + std::to_string(j + 1) + " is not finite");
  }
  require(speed_noise.size() == 0 ||
              (speed_noise.size() == q.cols() && speed_noise.allFinite() && (speed_noise.array() >= 0).all()),
          "speed_noise: expected a finite number, not negative, for each of the " + std::to_string(q.cols()) +
              " joints, or none [rad/s or m/s]");
  require(t.allFinite(), "t: times must be finite [s]");
  std::size_t next = 0;
  for (Eigen::Index i = 0; i < samples(); ++i) {
    const bool starts = i == 0 || (next < run_starts.size() && run_starts[next] == i);
    while (next < run_starts.size() && run_starts[next] <= i) ++next;
    if (!starts && !(t[i] > t[i - 1]))
      throw InvalidArgument("t: row " + std::to_string(i) + " is not later than the one before [s]");
  }
  require(next == run_starts.size() && (run_starts.empty() || run_starts.front() == 0),
          "run_starts: rows in ascending order, 0 first");
}

JointMotion merged_motion(std::span<const JointMotion> motions) {
  require(!motions.empty(), "motions: expected at least one");
  const Eigen::Index joints = motions.front().q.cols();
  Eigen::Index rows = 0;
  for (const JointMotion& motion : motions) {
    motion.validate();
    require(motion.q.cols() == joints, "motions: expected " + std::to_string(joints) +
                                           " joints as in the first, found " + std::to_string(motion.q.cols()));
    rows += motion.samples();
  }
  const bool warm = std::all_of(motions.begin(), motions.end(), [](const auto& m) { return m.temperature.size() > 0; });
  const Eigen::MatrixXd empty = Eigen::MatrixXd::Zero(rows, joints);
  JointMotion out{Eigen::VectorXd::Zero(rows), empty, empty, empty, empty, {}};
  if (warm) out.temperature = empty;
  Eigen::Index at = 0;
  for (const JointMotion& motion : motions) {
    const Eigen::Index n = motion.samples();
    out.t.segment(at, n) = motion.t;
    out.q.middleRows(at, n) = motion.q;
    out.qd.middleRows(at, n) = motion.qd;
    out.qdd.middleRows(at, n) = motion.qdd;
    out.tau.middleRows(at, n) = motion.tau;
    if (warm) out.temperature.middleRows(at, n) = motion.temperature;
    if (motion.run_starts.empty()) out.run_starts.push_back(static_cast<int>(at));
    for (const int start : motion.run_starts) out.run_starts.push_back(static_cast<int>(at) + start);
    if (out.speed_noise.size() == 0)
      out.speed_noise = motion.speed_noise;
    else if (motion.speed_noise.size() > 0)
      out.speed_noise = out.speed_noise.cwiseMax(motion.speed_noise).eval();
    at += n;
  }
  return out;
}

}  // namespace kr5::identification
