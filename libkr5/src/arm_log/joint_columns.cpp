// SPDX-License-Identifier: BSD-3-Clause
#include "joint_columns.hpp"

#include <vector>

#include <Eigen/LU>

#include <kr5/physics/cubic_spline.hpp>
#include <kr5/physics/motors.hpp>
#include <kr5/predict/fast_simulator.hpp>

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using identification::JointMotion;

bool has_column(const cell::Experiment& experiment, const std::string& name) { return experiment.data.find(name) >= 0; }

std::string load_family(const cell::Experiment& experiment) {
  for (const char* family : {"tau", "i"})
    if (has_column(experiment, std::string(family) + "1")) return family;
  return "";
}

bool on_measured_positions(const cell::Experiment& experiment) {
  return experiment.kind == cell::Kind::Motion && experiment.joint_reference == cell::JointReference::Measured &&
         !load_family(experiment).empty();
}

MatrixXd joint_columns(const cell::Experiment& experiment, const std::string& family, int joints) {
  MatrixXd out(experiment.data.values.rows(), joints);
  for (int k = 0; k < joints; ++k) out.col(k) = experiment.data.column(family + std::to_string(k + 1));
  return out;
}

MatrixXd in_columns(const cell::Cell& cell, const std::string& family, const MatrixXd& torques) {
  if (family != "i") return torques;
  return torques * cell.drives->structure.inverse() * cell.drives->torque_constant.cwiseInverse().asDiagonal();
}

MatrixXd link_loads(const cell::Cell& cell, const cell::Experiment& experiment) {
  cell::Cell bare = cell;
  bare.drives.reset();
  cell::Experiment shown = experiment;
  shown.data = predict::FastSimulator().predict(bare, experiment);
  return joint_columns(shown, "tau", cell.robot.joints());
}

JointMotion motion_of(const cell::Cell& cell, const cell::Experiment& experiment, double delay) {
  const int n = cell.robot.joints();
  const VectorXd t = experiment.data.column("t");
  const MatrixXd q = joint_columns(experiment, "qc", n);
  const std::string family = load_family(experiment);
  const MatrixXd loads = joint_columns(experiment, family, n);
  const MatrixXd tau = family == "i" ? physics::reported_torques(cell, loads) : loads;
  std::vector<Index> shown, pieces;
  Index piece = 0;
  for (Index i = 0; i < t.size(); ++i) {
    const double at = t[i] - delay;
    if (at < t[0] || at > t[t.size() - 1]) continue;
    while (piece + 2 < t.size() && t[piece + 1] <= at) ++piece;
    shown.push_back(i);
    pieces.push_back(piece);
  }
  const auto rows = static_cast<Index>(shown.size());
  JointMotion out{t(shown), MatrixXd(rows, n), MatrixXd(rows, n), MatrixXd(rows, n), tau(shown, Eigen::all), {}};
  out.speed_noise = experiment.speed_noise;
  for (int k = 0; k < n; ++k) {
    const physics::SplinePieces spline = physics::cubic_spline(t, q.col(k));
    for (Index i = 0; i < rows; ++i) {
      const Index p = pieces[static_cast<std::size_t>(i)];
      const Eigen::Vector3d state = physics::spline_state(spline.row(p), out.t[i] - delay - t[p]);
      out.q(i, k) = state[0], out.qd(i, k) = state[1], out.qdd(i, k) = state[2];
    }
  }
  return out;
}

JointMotion merged_motion(const cell::Cell& cell, const std::vector<cell::Experiment>& experiments, double delay) {
  std::vector<JointMotion> motions;
  for (const cell::Experiment& e : experiments) motions.push_back(motion_of(cell, e, delay));
  Index rows = 0;
  for (const JointMotion& m : motions) rows += m.samples();
  const Index n = motions.empty() ? 0 : motions.front().q.cols();
  JointMotion out{VectorXd(rows), MatrixXd(rows, n), MatrixXd(rows, n), MatrixXd(rows, n), MatrixXd(rows, n), {}};
  Index at = 0;
  for (const JointMotion& m : motions) {
    const Index count = m.samples();
    out.run_starts.push_back(static_cast<int>(at));
    out.t.segment(at, count) = m.t;
    out.q.middleRows(at, count) = m.q;
    out.qd.middleRows(at, count) = m.qd;
    out.qdd.middleRows(at, count) = m.qdd;
    out.tau.middleRows(at, count) = m.tau;
    out.speed_noise = out.speed_noise.size() == 0 ? m.speed_noise
                      : m.speed_noise.size() == 0 ? out.speed_noise
                                                  : VectorXd(out.speed_noise.cwiseMax(m.speed_noise));
    at += count;
  }
  return out;
}

std::string load_unit(const cell::Cell& cell, int joint) {
  return cell.robot.dh.at(static_cast<std::size_t>(joint)).type == kinematics::JointType::Prismatic ? "N" : "N m";
}

std::string joint_name(const cell::Cell& cell, int joint) {
  const auto& names = cell.robot.joint_names;
  return names.empty() ? "joint " + std::to_string(joint + 1) : names.at(static_cast<std::size_t>(joint));
}

}  // namespace kr5::arm_log
