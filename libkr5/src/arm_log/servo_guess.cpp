// SPDX-License-Identifier: BSD-3-Clause
#include "servo_guess.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/core/parallel.hpp>
#include <kr5/physics/effective_arm.hpp>
#include <kr5/physics/effective_drives.hpp>

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double lead_in = 1.0;                     // before the part that is compared [s]
constexpr double usual_acceleration = 10.0;         // of a joint that is not held against gravity [rad/s^2]
constexpr double max_droop = 0.5;                   // under the greatest torque [rad]
constexpr int droops = 10;                          // each half of the one before
constexpr double lags[] = {0.01, 0.03, 0.08, 0.2};  // damping over stiffness [s]
constexpr double delays[] = {0.0, 0.01, 0.02, 0.04, 0.07, 0.1, 0.15};  // [s]
constexpr double dead_angles[] = {0.0, 0.003, 0.01, 0.03, 0.08};       // dry friction over stiffness [rad]
constexpr double periods[] = {0.0, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2};      // inertia over stiffness [s^2]
constexpr double refinement[] = {0.6, 0.8, 1.25, 1.6};
constexpr int refining_sweeps = 3;

/// What is tried of a joint.
struct JointValues {
  double stiffness = 0.0, damping = 0.0, coulomb = 0.0, rotor = 0.0;
};

struct Values {
  std::vector<JointValues> joints;
  double delay = 0.0;
};

class ServoGuess {
 public:
  ServoGuess(const cell::Recording& motion, const cell::Simulator& simulator, int threads)
      : cell_(motion.cell), motion_(motion.experiments.at(0)), simulator_(simulator), threads_(threads) {
    const int n = cell_.robot.joints();
    for (int j = 0; j < n; ++j) {
      const cell::TorqueServo& s = cell_.servo->torque_of(j);
      best_.joints.push_back({s.stiffness, s.damping + cell_.drives->friction.viscous[j],
                              cell_.drives->friction.coulomb[j], cell_.drives->rotor_inertia[j]});
      measured_.push_back(motion_.data.column("q" + std::to_string(j + 1)));
    }
    best_.delay = cell_.servo->torque_of(0).delay;
    load_ = greatest_loads();
    costs_ = costs(best_);
  }

  cell::Cell run(const std::function<void(double)>& tell) {
    try_gains();
    tell(0.4);
    try_others();
    tell(0.6);
    for (int sweep = 0; sweep < refining_sweeps; ++sweep) {
      refine();
      tell(0.6 + 0.4 * (sweep + 1) / refining_sweeps);
    }
    return cell_with(best_);
  }

 private:
  /// Greatest torques that gravity and a usual acceleration ask of each joint [N m or N].
  VectorXd greatest_loads() const {
    const int n = cell_.robot.joints();
    kinematics::Dynamics arm = physics::EffectiveArm(cell_).dynamics(0.0);
    VectorXd out = VectorXd::Zero(n);
    constexpr Index looks = 50;
    const Index rows = measured_[0].size();
    for (Index k = 0; k < rows; k += std::max<Index>(1, rows / looks)) {
      VectorXd q(n);
      for (int j = 0; j < n; ++j) q[j] = measured_[static_cast<std::size_t>(j)][k];
      out = out.cwiseMax(arm.gravity_torques(q).cwiseAbs());
      out = out.cwiseMax(usual_acceleration * arm.mass_matrix(q).diagonal());
    }
    return out.cwiseMax(1e-6);
  }

  /// A cell with these values. A damping below the viscous friction of the cell takes its place.
  cell::Cell cell_with(const Values& values) const {
    cell::Cell out = cell_;
    for (std::size_t j = 0; j < values.joints.size(); ++j) {
      const auto k = static_cast<Index>(j);
      const JointValues& v = values.joints[j];
      cell::TorqueServo servo = cell_.servo->torque_of(static_cast<int>(j));
      servo.integral *= v.stiffness / std::max(servo.stiffness, 1e-12);
      servo.stiffness = v.stiffness;
      servo.delay = values.delay;
      double& viscous = out.drives->friction.viscous[k];
      if (v.damping < viscous) viscous = 0.0;
      servo.damping = v.damping - viscous;
      out.drives->friction.coulomb[k] = v.coulomb;
      out.drives->rotor_inertia[k] = v.rotor;
      if (out.servo->torque.size() <= j) out.servo->torque.resize(j + 1, servo);
      out.servo->torque[j] = servo;
    }
    return out;
  }

  /// Mean square of what each joint is off; infinite where the simulation is impossible.
  VectorXd costs(const Values& values) const {
    const auto n = static_cast<Index>(measured_.size());
    VectorXd out = VectorXd::Constant(n, std::numeric_limits<double>::infinity());
    try {
      const io::Table shown = simulator_.predict_unchecked(cell_with(values), motion_);
      for (Index j = 0; j < n; ++j) {
        const double cost =
            (shown.column("q" + std::to_string(j + 1)) - measured_[static_cast<std::size_t>(j)]).squaredNorm() /
            static_cast<double>(measured_[0].size());
        if (std::isfinite(cost)) out[j] = cost;
      }
    } catch (const InvalidArgument&) {
      return out;  // values beyond what a simulation bears
    }
    return out;
  }

  std::vector<VectorXd> all_costs(const std::vector<Values>& sets) const {
    std::vector<VectorXd> out(sets.size());
    parallel_for(static_cast<int>(sets.size()), threads_,
                 [&](int i) { out[static_cast<std::size_t>(i)] = costs(sets[static_cast<std::size_t>(i)]); });
    return out;
  }

  /// Lets each joint take the set that fits it best, and keeps that where it is better for all together.
  void choose(const std::vector<Values>& sets) {
    const std::vector<VectorXd> found = all_costs(sets);
    Values mixed = best_;
    for (std::size_t j = 0; j < best_.joints.size(); ++j) {
      double least = costs_[static_cast<Index>(j)];
      for (std::size_t s = 0; s < sets.size(); ++s)
        if (const double cost = found[s][static_cast<Index>(j)]; cost < least) {
          least = cost;
          mixed.joints[j] = sets[s].joints[j];
        }
    }
    keep_if_better(mixed, costs(mixed));
    for (std::size_t s = 0; s < sets.size(); ++s) keep_if_better(sets[s], found[s]);
  }

  void keep_if_better(const Values& values, const VectorXd& costs) {
    if (!(costs.array().sqrt().sum() < costs_.array().sqrt().sum())) return;
    best_ = values;
    costs_ = costs;
  }

  void try_gains() {
    std::vector<Values> sets;
    for (int k = 0; k < droops; ++k)
      for (const double lag : lags) {
        Values set = best_;
        for (std::size_t j = 0; j < set.joints.size(); ++j) {
          set.joints[j].stiffness = load_[static_cast<Index>(j)] / (max_droop * std::pow(0.5, k));
          set.joints[j].damping = lag * set.joints[j].stiffness;
        }
        sets.push_back(std::move(set));
      }
    choose(sets);
  }

  void try_others() {
    std::vector<Values> sets;
    for (const double delay : delays) sets.push_back({best_.joints, delay});
    choose(sets);
    try_shares(&JointValues::coulomb, dead_angles);
    try_shares(&JointValues::rotor, periods);
  }

  template <class Shares>
  void try_shares(double JointValues::*member, const Shares& shares) {
    std::vector<Values> sets;
    for (const double share : shares) {
      sets.push_back(best_);
      for (JointValues& joint : sets.back().joints) joint.*member = share * joint.stiffness;
    }
    choose(sets);
  }

  void refine() {
    std::vector<Values> sets;
    for (const double factor : refinement) {  // gains alone, and with all that they carry
      for (const bool with_friction : {false, true}) {
        sets.push_back(best_);
        for (JointValues& joint : sets.back().joints) {
          joint.stiffness *= factor;
          joint.damping *= factor;
          if (with_friction) joint.coulomb *= factor, joint.rotor *= factor;
        }
      }
    }
    choose(sets);
    for (double JointValues::*member :
         {&JointValues::stiffness, &JointValues::damping, &JointValues::coulomb, &JointValues::rotor}) {
      sets.assign(std::size(refinement), best_);
      for (std::size_t s = 0; s < sets.size(); ++s)
        for (JointValues& joint : sets[s].joints) joint.*member *= refinement[s];
      choose(sets);
    }
    sets.clear();
    for (const double factor : refinement) sets.push_back({best_.joints, factor * best_.delay});
    choose(sets);
  }

  const cell::Cell& cell_;
  const cell::Experiment& motion_;
  const cell::Simulator& simulator_;
  int threads_;
  std::vector<VectorXd> measured_;
  VectorXd load_, costs_;
  Values best_;
};

/// A span of rows of an experiment, by the sum of the parts of each joint's way that are in it.
struct MovingSpan {
  std::size_t experiment = 0;
  Index first = 0, last = 0;
  double way = -1.0;
};

/// Way of each joint up to each row.
MatrixXd ways(const cell::Experiment& e, int joints) {
  MatrixXd out = MatrixXd::Zero(e.data.values.rows(), joints);
  for (int j = 0; j < joints; ++j) {
    const int column = e.data.find("qc" + std::to_string(j + 1));
    if (column < 0) continue;
    for (Index i = 1; i < out.rows(); ++i)
      out(i, j) = out(i - 1, j) + std::abs(e.data.values(i, column) - e.data.values(i - 1, column));
  }
  return out;
}

MovingSpan best_span(const cell::Recording& recording, double duration) {
  const int joints = recording.cell.robot.joints();
  VectorXd total = VectorXd::Constant(joints, 1e-9);
  std::vector<MatrixXd> each;
  for (const cell::Experiment& e : recording.experiments) {
    each.push_back(ways(e, joints));
    if (each.back().rows() > 0) total = total.cwiseMax(each.back().bottomRows(1).transpose());
  }
  MovingSpan best;
  for (std::size_t k = 0; k < recording.experiments.size(); ++k) {
    const cell::Experiment& e = recording.experiments[k];
    if (e.kind != cell::Kind::Motion || e.split != cell::Split::Fit || e.data.values.rows() == 0) continue;
    const VectorXd t = e.data.column("t");
    Index last = 0;
    for (Index first = 0; first < t.size(); ++first) {
      while (last + 1 < t.size() && t[last + 1] - t[first] <= duration) ++last;
      const double way = ((each[k].row(last) - each[k].row(first)).transpose().array() / total.array()).sum();
      if (way > best.way) best = {k, first, last, way};
    }
  }
  require(best.way >= 0.0, "found no motion to fit");
  return best;
}

}  // namespace

cell::Recording moving_part(const cell::Recording& recording, double duration) {
  const MovingSpan span = best_span(recording, duration + lead_in);
  cell::Experiment part = recording.experiments[span.experiment];
  if (span.first > 0) part.lead_in = {};
  part.data.values = part.data.values.middleRows(span.first, span.last + 1 - span.first).eval();
  if (span.first > 0) part = cell::split_lead_in(part, lead_in);
  cell::Recording out;
  out.cell = recording.cell;
  out.experiments = {std::move(part)};
  return out;
}

cell::Cell guess_servos(const cell::Recording& motion, const cell::Simulator& simulator, int threads,
                        const std::function<void(double)>& tell) {
  return ServoGuess(motion, simulator, threads).run(tell);
}

}  // namespace kr5::arm_log
