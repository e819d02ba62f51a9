// SPDX-License-Identifier: BSD-3-Clause
#include "gap/planning/workspace.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <kr5/core/statistics.hpp>

namespace kr5::gap {
namespace {

constexpr double margin = 0.05;  // of its range, by which a joint stays within its limits

/// Recorded postures of moving and still kinds, thinned, one a row.
Eigen::MatrixXd postures(const cell::Recording& recording, cell::Kind kind) {
  const cell::Experiment* e = recorded_experiment(recording, kind);
  if (!e) return {};
  const int n = recording.cell.robot.joints();
  const std::string letters = kind == cell::Kind::Motion ? "qc" : "q";
  const Eigen::Index stride = std::max<Eigen::Index>(1, e->data.values.rows() / 200);
  Eigen::MatrixXd out((e->data.values.rows() + stride - 1) / stride, n);
  for (int j = 0; j < n; ++j) {
    const int at = e->data.find(letters + std::to_string(j + 1));
    if (at < 0) return {};
    for (Eigen::Index i = 0; i < out.rows(); ++i) out(i, j) = e->data.values(i * stride, at);
  }
  return out;
}

/// The middle one of the steps between the rows of a recorded motion, if there is one [s].
std::optional<double> recorded_step(const cell::Recording& recording) {
  const cell::Experiment* e = recorded_experiment(recording, cell::Kind::Motion);
  if (!e || e->data.find("t") < 0 || e->data.values.rows() < 2) return std::nullopt;
  const Eigen::VectorXd t = e->data.column("t");
  const Eigen::VectorXd steps = t.tail(t.size() - 1) - t.head(t.size() - 1);
  return median({steps.begin(), steps.end()});
}

/// Torque servos take commands at any times: those of a plan come as often as the recorded ones.
double cycle_of(const cell::Recording& recording) {
  const auto& servo = recording.cell.servo;
  if (recording.cell.has_torque_servos())
    if (const auto step = recorded_step(recording)) return *step;
  return servo && servo->cycle > 0 ? servo->cycle : robot::usual_cycle;
}

}  // namespace

Workspace::Workspace(const Family& family) : cell(family.recording.cell), cycle(cycle_of(family.recording)) {
  const int n = cell.robot.joints();
  std::vector<Eigen::MatrixXd> seen;
  for (const cell::Kind kind : {cell::Kind::Motion, cell::Kind::Poses, cell::Kind::Views, cell::Kind::Scan})
    if (Eigen::MatrixXd q = postures(family.recording, kind); q.rows() > 0) seen.push_back(std::move(q));
  low = Eigen::VectorXd::Constant(n, -0.3);
  high = -low;
  speed = Eigen::VectorXd::Ones(n);
  if (!seen.empty()) {
    low = high = seen.front().row(0);
    for (const Eigen::MatrixXd& q : seen) {
      low = low.cwiseMin(q.colwise().minCoeff().transpose());
      high = high.cwiseMax(q.colwise().maxCoeff().transpose());
    }
    floor = 1e9;
    for (const Eigen::MatrixXd& q : seen)
      for (Eigen::Index i = 0; i < q.rows(); ++i)
        floor = std::min(floor, cell::T_base_tool(cell, q.row(i)).translation().z() - 0.02);
  }
  if (const auto& limits = cell.robot.limits) {  // otherwise what was recorded is all that is known to be safe
    low = limits->lower + margin * (limits->upper - limits->lower);
    high = limits->upper - margin * (limits->upper - limits->lower);
    if (limits->velocity.size() == n) speed = limits->velocity;
  }
  speed *= family.speed;
  home = seen.empty() ? Eigen::VectorXd((low + high) / 2) : Eigen::VectorXd(seen.front().row(0).transpose());
  home = home.cwiseMax(low).cwiseMin(high);
}

bool Workspace::contains_path(const Eigen::MatrixXd& path) const {
  constexpr Eigen::Index stride = 10;
  for (Eigen::Index i = 0; i < path.rows(); ++i) {
    const Eigen::VectorXd q = path.row(i);
    if ((q.array() < low.array() - 1e-9).any() || (q.array() > high.array() + 1e-9).any()) return false;
    if (i % stride == 0 && cell::T_base_tool(cell, q).translation().z() < floor) return false;
  }
  return true;
}

Eigen::VectorXd Workspace::random_near(Random& random, const Eigen::VectorXd& middle, double reach) const {
  constexpr int tries = 50;
  for (int i = 0; i < tries; ++i) {
    Eigen::VectorXd q = middle;
    for (double& x : q) x += random.uniform(-reach, reach);
    q = q.cwiseMax(low).cwiseMin(high);
    if (contains_path(q.transpose())) return q;
  }
  return middle;
}

Eigen::VectorXd Workspace::random_extreme(Random& random, bool far) const {
  constexpr int draws = 300;
  const kinematics::DhChain arm = cell::nominal_chain(cell);
  Eigen::VectorXd best = home;
  double most = -1e9;
  for (int i = 0; i < draws; ++i) {
    const Eigen::VectorXd q = random_near(random, home, 1.0);
    const double distance = arm.flange(q).translation().head<2>().norm() * (far ? 1 : -1);
    if (distance <= most) continue;
    most = distance;
    best = q;
  }
  return best;
}

}  // namespace kr5::gap
