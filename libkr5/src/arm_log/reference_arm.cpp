// SPDX-License-Identifier: BSD-3-Clause
#include "reference_arm.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include <Eigen/LU>
#include <Eigen/QR>

#include <kr5/gap/estimated_effect.hpp>

#include "joint_columns.hpp"
#include "load_delay.hpp"

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Positions among the base parameters of the columns of a joint.
std::vector<Index> base_indices(const identification::BaseParameters& base,
                                const identification::JointRegressor& joint) {
  std::vector<Index> out;
  for (const int column : joint.columns)
    out.push_back(std::ranges::lower_bound(base.independent, column) - base.independent.begin());
  return out;
}

/// Torques of a motion by the reference, and the variances that its covariance gives them, samples x joints.
struct Expected {
  MatrixXd torques, variances;
};

Expected expected_of(const identification::DynamicsResult& found, const identification::JointMotion& motion) {
  Expected out{identification::predict_torques(found, motion), MatrixXd::Zero(motion.samples(), motion.joints())};
  const auto rows = identification::DynamicsRegressor(found.model).joint_regressors(motion, found.base.independent);
  for (int k = 0; k < motion.joints(); ++k) {
    const std::vector<Index> own = base_indices(found.base, rows[k]);
    const MatrixXd covariance = found.covariance(own, own);
    out.variances.col(k) = (rows[k].X * covariance).cwiseProduct(rows[k].X).rowwise().sum();
  }
  return out;
}

/// Puts what the simulator shows, and the difference of the loads from what was expected, in the place of the loads.
/// Rows outside the motion as it was shifted are left out.
void replace_loads(cell::Experiment& e, const MatrixXd& difference, double first_time, const cell::Cell& cell,
                   const cell::Simulator& simulator) {
  const std::string family = load_family(e);
  const VectorXd t = e.data.column("t");
  const Index first = std::ranges::lower_bound(t, first_time) - t.begin();
  const io::Table shown = simulator.predict(cell, e);
  for (int k = 0; k < cell.robot.joints(); ++k) {
    const std::string column = family + std::to_string(k + 1);
    e.data.values.col(e.data.find(column)).segment(first, difference.rows()) =
        shown.column(column).segment(first, difference.rows()) + difference.col(k);
  }
  e.data.values = MatrixXd(e.data.values.middleRows(first, difference.rows()));
}

/// Torques that a cell shows in an experiment, on the joint side of the drives of another, samples x joints.
MatrixXd shown_torques(const cell::Cell& shown, const cell::Cell& drives, const cell::Experiment& e,
                       const cell::Simulator& simulator) {
  cell::Experiment simulated = e;
  const std::string family = load_family(e);
  const io::Table table = simulator.predict_unchecked(shown, e);  // a step may lead beyond a bound
  for (int k = 1; k <= drives.robot.joints(); ++k) {
    const std::string column = family + std::to_string(k);
    simulated.data.values.col(e.data.find(column)) = table.column(column);
  }
  return motion_of(drives, simulated).tau;
}

/// Slopes of these torques by every number of every parameter of causes; zero by what has no standard deviation, and by
/// poses.
std::vector<MatrixXd> slopes_of(const cell::Cell& cell, const cell::Experiment& e, const cell::Simulator& simulator,
                                const std::vector<gap::Cause>& causes) {
  cell::Cell tuned = cell;
  for (const gap::Cause& cause : causes) gap::set_estimates(tuned, cause, cause.parameters);
  const MatrixXd base = shown_torques(tuned, cell, e, simulator);
  std::vector<MatrixXd> out;
  for (const gap::Cause& cause : causes)
    for (const gap::ParameterEstimate& p : cause.parameters)
      for (std::size_t i = 0; i < p.std.size(); ++i) {
        MatrixXd& slope = out.emplace_back(MatrixXd::Zero(base.rows(), base.cols()));
        if (!(p.std[i] > 0) || p.value.size() != p.std.size()) continue;
        gap::ParameterEstimate moved = p;
        moved.value[i] += p.std[i];
        cell::Cell changed = tuned;
        gap::set_estimates(changed, cause, {moved});
        slope = (shown_torques(changed, cell, e, simulator) - base) / p.std[i];
      }
  return out;
}

/// Normal equations of numbers that are fitted relative to a reference: among them, and with the base parameters.
struct RelativeInformation {
  MatrixXd own, mixed;
};

void add_motion(RelativeInformation& out, const ReferenceArm& arm, const identification::JointMotion& motion,
                const std::vector<MatrixXd>& slopes) {
  const auto rows =
      identification::DynamicsRegressor(arm.found.model).joint_regressors(motion, arm.found.base.independent);
  for (int k = 0; k < motion.joints(); ++k) {
    const double weight = 1 / std::max(arm.found.sigma[k] * arm.found.sigma[k], std::numeric_limits<double>::min());
    MatrixXd by_number(motion.samples(), std::ssize(slopes));
    for (Index i = 0; i < by_number.cols(); ++i) by_number.col(i) = slopes[static_cast<std::size_t>(i)].col(k);
    out.own += weight * by_number.transpose() * by_number;
    out.mixed(Eigen::all, base_indices(arm.found.base, rows[k])) += weight * by_number.transpose() * rows[k].X;
  }
}

}  // namespace

std::optional<ReferenceArm> reference_arm(const cell::Recording& recording) {
  std::vector<cell::Experiment> motions;
  std::ranges::copy_if(recording.experiments, std::back_inserter(motions), on_measured_positions);
  if (motions.empty() || !recording.cell.drives) return std::nullopt;
  std::vector<int> joints(static_cast<std::size_t>(recording.cell.robot.joints()));
  std::iota(joints.begin(), joints.end(), 0);
  BestArm best = best_arm_with_delay(recording.cell, motions, joints);
  if (best.left.size() == 0) return std::nullopt;
  return ReferenceArm{std::move(best.found), best.delay};
}

Relative relative_to(const ReferenceArm& arm, const cell::Recording& recording, const cell::Simulator& simulator) {
  Relative out{recording, {}};
  const cell::Cell& cell = recording.cell;
  const int n = cell.robot.joints();
  VectorXd squares = VectorXd::Zero(n);
  double rows = 0.0;
  std::string family;
  for (cell::Experiment& e : out.recording.experiments) {
    if (!on_measured_positions(e)) continue;
    const identification::JointMotion motion = motion_of(cell, e, arm.delay);
    const Expected expected = expected_of(arm.found, motion);
    family = load_family(e);
    replace_loads(e, in_columns(cell, family, motion.tau - expected.torques), motion.t[0], cell, simulator);
    squares += expected.variances.colwise().sum().transpose();
    rows += static_cast<double>(motion.samples());
  }
  if (rows == 0.0) return out;
  VectorXd error = (squares / rows).cwiseSqrt();
  if (family == "i")  // variances of the joints, as if they were independent
    error = ((squares / rows).transpose() * cell.drives->structure.inverse().cwiseAbs2())
                .cwiseSqrt()
                .transpose()
                .cwiseQuotient(cell.drives->torque_constant.cwiseAbs());
  for (int k = 0; k < n; ++k) out.errors.push_back({"motion." + family + std::to_string(k + 1), error[k]});
  return out;
}

VectorXd deviations_by(const std::optional<ReferenceArm>& arm, const cell::Recording& relative,
                       const cell::Simulator& simulator, const std::vector<gap::Cause>& causes) {
  Index numbers = 0;
  for (const gap::Cause& cause : causes)
    for (const gap::ParameterEstimate& p : cause.parameters) numbers += std::ssize(p.std);
  if (!arm || numbers == 0) return VectorXd::Zero(numbers);
  RelativeInformation information{MatrixXd::Zero(numbers, numbers), MatrixXd::Zero(numbers, arm->found.base.size())};
  for (const cell::Experiment& e : relative.experiments)
    if (e.split == cell::Split::Fit && on_measured_positions(e))
      add_motion(information, *arm, motion_of(relative.cell, e), slopes_of(relative.cell, e, simulator, causes));
  // What the reference does not determine made the error of its columns large, so that nothing was fitted to them.
  MatrixXd covariance = arm->found.covariance;
  covariance = covariance.array().isFinite().select(covariance, 0.0);
  const MatrixXd gain = information.own.completeOrthogonalDecomposition().solve(information.mixed);
  return (gain * covariance * gain.transpose()).diagonal().cwiseMax(0).cwiseSqrt();
}

}  // namespace kr5::arm_log
