// SPDX-License-Identifier: BSD-3-Clause
#include "identification/dynamics/slow_samples.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace kr5::identification {
namespace {

constexpr double min_speed_spread = 0.3;  // of the speeds of a joint, over their mean
constexpr std::size_t min_slow_rows = 10;

bool at_several_speeds(const Eigen::VectorXd& speeds) {
  if (speeds.size() == 0) return false;
  const double mean = speeds.mean();
  return (speeds.array() - mean).matrix().norm() > min_speed_spread * mean * std::sqrt(double(speeds.size()));
}

}  // namespace

std::vector<SlowSamples> slow_samples(const JointMotion& motion, double min_speed, double max_speed) {
  std::vector<SlowSamples> out(static_cast<std::size_t>(motion.joints()));
  for (int j = 0; j < motion.joints(); ++j) out[static_cast<std::size_t>(j)].joint = j;
  for (Eigen::Index k = 0; k < motion.samples(); ++k) {
    if (motion.qd.row(k).cwiseAbs().maxCoeff() > max_speed) continue;
    for (SlowSamples& s : out)
      if (std::abs(motion.qd(k, s.joint)) >= min_speed) s.rows.push_back(k);
  }
  for (SlowSamples& s : out) {
    Eigen::VectorXd speeds(static_cast<Eigen::Index>(s.rows.size()));
    for (Eigen::Index r = 0; r < speeds.size(); ++r)
      speeds[r] = std::abs(motion.qd(s.rows[static_cast<std::size_t>(r)], s.joint));
    s.several_speeds = at_several_speeds(speeds);
  }
  return out;
}

std::vector<SlowSamples> resting_samples(const JointMotion& postures) {
  std::vector<SlowSamples> out(static_cast<std::size_t>(postures.joints()));
  for (int j = 0; j < postures.joints(); ++j) {
    SlowSamples& s = out[static_cast<std::size_t>(j)];
    s.joint = j;
    s.resting = true;
    s.rows.resize(static_cast<std::size_t>(postures.samples()));
    std::iota(s.rows.begin(), s.rows.end(), Eigen::Index{0});
  }
  return out;
}

Eigen::Index held_out_count(Eigen::Index samples, double part) {
  return static_cast<Eigen::Index>(std::floor(part * static_cast<double>(samples)));
}

std::string objection_to_postures(Eigen::Index postures, double held_out) {
  const Eigen::Index fitted = postures - held_out_count(postures, held_out);
  if (fitted >= static_cast<Eigen::Index>(min_slow_rows)) return "";
  return "found " + std::to_string(postures) + " postures, of which " + std::to_string(fitted) +
         " are not held out; at least " + std::to_string(min_slow_rows) + " such are needed";
}

std::string objection(const JointMotion& motion, const std::vector<SlowSamples>& samples, double held_out) {
  bool any = false;
  for (const SlowSamples& s : samples) {
    if (s.rows.empty()) continue;
    any = true;
    const std::string joint = "joint " + std::to_string(s.joint + 1);
    const auto fitted = static_cast<Eigen::Index>(s.rows.size());
    const Eigen::Index count = fitted - held_out_count(fitted, held_out);
    if (s.rows.size() < min_slow_rows)
      return joint + " moves slowly in " + std::to_string(s.rows.size()) + " samples only; at least " +
             std::to_string(min_slow_rows) + " are needed, or none";
    Eigen::Index forwards = 0;
    for (Eigen::Index r = 0; r < count; ++r) forwards += motion.qd(s.rows[static_cast<std::size_t>(r)], s.joint) > 0;
    if (forwards == 0 || forwards == count)
      return joint +
             " moved in one direction only, so its friction and its gravity cannot be separated: move it to "
             "and fro" +
             (held_out > 0 ? ", also in the samples that are not held out" : "");
  }
  return any ? "" : "no joint moves slowly: every speed is below min_speed or above max_speed [rad/s or m/s]";
}

}  // namespace kr5::identification
