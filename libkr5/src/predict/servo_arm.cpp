// SPDX-License-Identifier: BSD-3-Clause
#include "predict/servo_arm.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>
#include <kr5/physics/effective_arm.hpp>
#include <kr5/physics/effective_drives.hpp>
#include <kr5/physics/torque_servo.hpp>
#include <kr5/predict/fast_simulator.hpp>

namespace kr5::predict {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double shortest_step = 0.002;  // [s]
constexpr double angle_per_step = 0.5;   // of the fastest oscillation of a joint on its servo, in a step [rad]
constexpr int most_settling_passes = 4;  // in which limits and dead bands of a step settle
constexpr double least_inertia = 1e-9;   // of a joint that can be moved [kg m^2 or kg]

/// Part of a step that each of its two stages solves implicitly (SDIRK2: Alexander 1977), so that what decays or swings
/// within a step is gone at its end.
const double stage_part = 1.0 - std::sqrt(0.5);

/// A command as its integral over time, so that its mean over any span is exact.
class CommandIntegral {
 public:
  CommandIntegral(const VectorXd& t, const VectorXd& values, const cell::TorqueServo& servo)
      : t_(t), values_(values), delay_(servo.delay), straight_(servo.hold == cell::CommandHold::FirstOrderHold) {
    sums_ = VectorXd::Zero(t.size());
    for (Index k = 0; k + 1 < t.size(); ++k) sums_[k + 1] = sums_[k] + within(k, t[k + 1]);
  }

  /// Mean of the delayed command from `begin` to `end` [s].
  double mean(double begin, double end) { return (upto(end - delay_) - upto(begin - delay_)) / (end - begin); }
  /// The delayed command in both stages of a step [begin, end]: in sum its mean; of a straight one what it is at their
  /// ends, of one that holds the mean.
  std::pair<double, double> stages(double begin, double end) {
    const double all = mean(begin, end);
    if (!straight_) return {all, all};
    const double first = mean(begin, begin + 2.0 * stage_part * (end - begin));
    return {first, (all - (1.0 - stage_part) * first) / stage_part};
  }
  /// Mean speed of the delayed command; 0 while it holds.
  double speed(double begin, double end) {
    return straight_ ? (value(end - delay_) - value(begin - delay_)) / (end - begin) : 0.0;
  }

 private:
  /// The last row at or before a time; it is asked for rising times.
  Index row(double at) {
    while (at_ + 1 < t_.size() && t_[at_ + 1] <= at) ++at_;
    while (at_ > 0 && t_[at_] > at) --at_;
    return at_;
  }
  double value(double at) {
    const Index k = row(at);
    if (!straight_ || at <= t_[0] || k + 1 >= t_.size()) return values_[k];
    return values_[k] + (at - t_[k]) / (t_[k + 1] - t_[k]) * (values_[k + 1] - values_[k]);
  }
  /// Integral from row k to a time before the next row.
  double within(Index k, double at) const {
    const double s = at - t_[k];
    if (!straight_ || k + 1 >= t_.size()) return values_[k] * s;
    return s * (values_[k] + 0.5 * s / (t_[k + 1] - t_[k]) * (values_[k + 1] - values_[k]));
  }
  double upto(double at) {
    if (at <= t_[0]) return values_[0] * (at - t_[0]);
    const Index k = row(at);
    return sums_[k] + within(k, at);
  }

  const VectorXd& t_;
  VectorXd values_, sums_;
  double delay_;
  bool straight_;
  Index at_ = 0;
};

/// Speeds w with A w = b - f, f the dry friction: of magnitude `level` against the speed of what moves, less on what
/// stands. Which joints move is found by pivoting from which moved before.
class DryFriction {
 public:
  explicit DryFriction(Index joints) : side_(VectorXd::Zero(joints)), matrix_(joints, joints), right_(joints) {}

  void solve(const MatrixXd& A, const VectorXd& b, const VectorXd& level, VectorXd& w) {
    const Index n = b.size();
    for (Index i = 0; i < n; ++i)
      if (level[i] == 0.0) side_[i] = 1.0;
    for (int pass = 0; pass < 3 * n + 3; ++pass) {
      solve_moving(A, b, level, w);
      if (!turn(A, b, level, w)) return;
    }
    sweep(A, b, level, w);
  }

 private:
  void solve_moving(const MatrixXd& A, const VectorXd& b, const VectorXd& level, VectorXd& w) {
    matrix_ = A;
    right_ = b - level.cwiseProduct(side_);
    for (Index i = 0; i < b.size(); ++i) {
      if (side_[i] != 0.0) continue;
      matrix_.row(i).setZero();
      matrix_.col(i).setZero();
      matrix_(i, i) = 1.0;
      right_[i] = 0.0;
    }
    factor_.compute(matrix_);
    w = factor_.solve(right_);
  }
  /// Stops the joint that friction would push and starts what is pulled free; whether any did.
  bool turn(const MatrixXd& A, const VectorXd& b, const VectorXd& level, const VectorXd& w) {
    bool turned = false;
    for (Index i = 0; i < b.size(); ++i) {
      if (level[i] == 0.0) continue;
      if (side_[i] != 0.0) {
        if (side_[i] * w[i] >= 0.0) continue;
        side_[i] = 0.0;
      } else {
        const double pull = b[i] - A.row(i).dot(w);
        if (std::abs(pull) <= level[i]) continue;
        side_[i] = pull > 0.0 ? 1.0 : -1.0;
      }
      turned = true;
    }
    return turned;
  }
  /// Projected Gauss-Seidel, which cannot cycle.
  void sweep(const MatrixXd& A, const VectorXd& b, const VectorXd& level, VectorXd& w) {
    constexpr int sweeps = 300;
    for (int pass = 0; pass < sweeps; ++pass) {
      double moved = 0.0;
      for (Index i = 0; i < b.size(); ++i) {
        const double pull = b[i] - A.row(i).dot(w) + A(i, i) * w[i];
        const double next = (pull - std::clamp(pull, -level[i], level[i])) / A(i, i);
        moved = std::max(moved, std::abs(next - w[i]));
        w[i] = next;
        side_[i] = next > 0.0 ? 1.0 : next < 0.0 ? -1.0 : 0.0;
      }
      if (moved < 1e-12) return;
    }
  }

  VectorXd side_;  // 1 or -1: moves so; 0: stands
  MatrixXd matrix_;
  VectorXd right_;
  Eigen::LLT<MatrixXd> factor_;
};

/// How a servo acts in a stage: torque = constant - stiffness x - damping w at its end.
struct Action {
  double constant = 0.0, stiffness = 0.0, damping = 0.0;
  bool bounded = false;  ///< It gives all that it can.

  double torque(double x, double w) const { return constant - stiffness * x - damping * w; }

  bool operator==(const Action&) const = default;
};

class ServoArm {
 public:
  ServoArm(const cell::Cell& cell, const VectorXd& t, const MatrixXd& command, const VectorXd& start, double gain)
      : drives_(cell),
        dynamics_(physics::EffectiveArm(cell).dynamics((t[0] + t[t.size() - 1]) / 2)),
        rotors_(drives_.rotor_matrix()),
        servos_(physics::torque_servos(cell)),
        friction_(start.size()),
        x_(start),
        gain_(gain) {
    const Index n = start.size();
    require(drives_.rigid(),
            "effects: an elastic joint and play are not simulated behind torque servos (servo.torque); leave "
            "joint_elasticity and backlash out, or state joint servos (servo.joint)");
    for (Index i = 0; i < n; ++i) commands_.emplace_back(t, command.col(i), servos_[static_cast<std::size_t>(i)]);
    v_ = a_ = w_ = integral_ = bias_ = torque_ = slope_ = x_mid_ = v_mid_ = last_ = dry_ = VectorXd::Zero(n);
    from_x_ = from_v_ = from_integral_ = next_command_ = VectorXd::Zero(n);
    ripple_ = gear_ = offset_ = VectorXd::Zero(n);
    for (Index i = 0; i < n; ++i) loaded_ = loaded_ || drives_.joint(i).friction.needs_gear_torque();
    q_ = qd_ = qdd_ = level_ = b_ = drag_ = command_ = rate_ = VectorXd::Zero(n);
    actions_.resize(static_cast<std::size_t>(n));
    inertia(x_, v_);
    for (Index i = 0; i < n; ++i)
      require(M_(i, i) > least_inertia, "drives.rotor_inertia: joint " + std::to_string(i + 1) +
                                            " has no inertia, by which a torque servo could move it; state masses of "
                                            "its links (robot.links) or the inertia of its rotor");
    rest(t[0]);
    note_gear_torque();
  }

  /// The longest step that follows the joints on their servos at the highest of their gains: how they swing, or creep
  /// where damping is strong [s].
  double step(double highest_gain) const {
    double out = servo_arm_step;
    for (std::size_t i = 0; i < servos_.size(); ++i) {
      const auto k = static_cast<Index>(i);
      const double rate = std::sqrt(std::max(highest_gain * servos_[i].stiffness, 1e-12) / M_(k, k));
      const double ratio = servos_[i].damping / (2.0 * rate * M_(k, k));
      const double slowest = ratio > 1.0 ? rate / (ratio + std::sqrt(ratio * ratio - 1.0)) : rate;
      out = std::min(out, angle_per_step / slowest);
    }
    return std::max(out, shortest_step);
  }

  /// Factor on the stiffness of all servos from now on; 0: they are off.
  void set_gain(double gain) { gain_ = gain; }

  void advance(double begin, double end, int steps) {
    const double h = (end - begin) / steps;
    for (int k = 0; k < steps; ++k) one_step(begin + k * h, h);
  }

  const VectorXd& x() const { return x_; }
  const VectorXd& v() const { return v_; }
  const VectorXd& a() const { return a_; }
  const VectorXd& torque() const { return torque_; }

 private:
  /// Mass matrix and load on the motor side at a state; the load without accelerations.
  void inertia(const VectorXd& x, const VectorXd& v) {
    for (Index i = 0; i < x.size(); ++i) {
      const physics::Transmission& gear = drives_.joint(i).transmission;
      const physics::LinkState link = gear.motion(x[i], v[i], 0.0);
      q_[i] = link.q, qd_[i] = link.v, qdd_[i] = link.a;
      slope_[i] = gear.uniform() ? 1.0 : gear.slope(x[i]);
    }
    dynamics_.mass_matrix(q_, M_);
    for (Index k = 0; k < x.size(); ++k) M_.col(k) = slope_[k] * slope_.cwiseProduct(M_.col(k)) + rotors_.col(k);
    dynamics_.torques(q_, qd_, qdd_, bias_);
    for (Index i = 0; i < x.size(); ++i) {
      const physics::JointDrive& joint = drives_.joint(i);
      bias_[i] = slope_[i] * (bias_[i] + physics::cable_spring(joint.cable, q_[i]));
      if (joint.ripple.amplitude == 0.0) continue;
      ripple_[i] = physics::torque_ripple(joint.ripple, x[i]);
      bias_[i] += ripple_[i];
    }
  }

  /// What links and dress pack ask of the gears, for friction that needs it.
  void note_gear_torque() {
    if (loaded_) gear_.noalias() = M_ * a_ - rotors_ * a_ + bias_ - ripple_;
  }

  void rest(double t) {
    for (Index i = 0; i < x_.size(); ++i) {
      const auto k = static_cast<std::size_t>(i);
      const double u = commands_[k].mean(t, t + shortest_step);
      cell::TorqueServo servo = servos_[k];
      servo.stiffness *= gain_;
      torque_[i] = physics::servo_torque(servo, u - x_[i], 0.0, 0.0, 0.0);
    }
  }

  /// How the servo of a joint acts, if a stage of length h ends with the speed w: its own line, or the bound that it
  /// reaches.
  Action action(std::size_t i, double h, double w) const {
    if (gain_ == 0.0) return {};
    const cell::TorqueServo& s = servos_[i];
    const auto k = static_cast<Index>(i);
    const double u = command_[k], x = from_x_[k] + h * w;
    const double error = u - x;
    const double held = s.integral * (from_integral_[k] + h * physics::effective_error(s, error));
    const bool inside = std::abs(error) <= s.dead_band && s.dead_band > 0.0;
    const double edge = inside ? 0.0 : std::copysign(s.dead_band, error);
    const double stiffness = inside ? 0.0 : gain_ * s.stiffness;
    Action line{held + s.feed_forward * rate_[k] + stiffness * (u - edge), stiffness, s.damping};
    const double asked = line.torque(x, w), given = physics::effective_torque(s, asked);
    for (const double side : {-1.0, 1.0}) {
      const physics::TorqueBound bound = physics::torque_bound(s, side, w);
      if (side * given > side * bound.at(w)) return {bound.at_rest, 0.0, bound.slope, true};
    }
    if (given == 0.0 && s.torque_dead_band > 0.0) return {};
    line.constant += given - asked;
    return line;
  }

  void one_step(double t, double h) {
    const Index n = x_.size();
    x_mid_ = x_ + 0.5 * h * v_;
    v_mid_ = v_ + 0.5 * h * a_;
    inertia(x_mid_, v_mid_);
    for (Index i = 0; i < n; ++i) {
      CommandIntegral& command = commands_[static_cast<std::size_t>(i)];
      const physics::JointFriction& f = drives_.joint(i).friction;
      const physics::FrictionRange dry = physics::dry_friction_at(f, {x_mid_[i], w_[i], gear_[i], t});
      level_[i] = dry.level;
      offset_[i] = dry.offset;
      drag_[i] = physics::friction_slope_at(f, v_mid_[i], t);
      std::tie(command_[i], next_command_[i]) = command.stages(t, t + h);
      rate_[i] = command.speed(t, t + h);
    }
    first_stage(h);
    second_stage(h);
    note_gear_torque();
  }

  void first_stage(double h) {
    from_x_ = x_, from_v_ = v_, from_integral_ = integral_;
    solve_stage(stage_part * h);
    for (Index i = 0; i < x_.size(); ++i) {
      const double rest = (1.0 - stage_part) * h;  // of the step
      from_x_[i] = x_[i] + rest * w_[i];
      from_v_[i] = w_[i] == 0.0 ? 0.0 : v_[i] + (1.0 - stage_part) / stage_part * (w_[i] - v_[i]);
      from_integral_[i] = integral_[i] + rest * error_at(i, x_[i] + stage_part * h * w_[i]);
    }
    command_ = next_command_;
  }

  void second_stage(double h) {
    const double own = stage_part * h;
    solve_stage(own);
    x_ = from_x_ + own * w_;
    v_ = w_;
    a_ = (v_ - from_v_) / own;
    for (Index i = 0; i < x_.size(); ++i) {
      integral_[i] = from_integral_[i] + own * error_at(i, x_[i]);
      torque_[i] = actions_[static_cast<std::size_t>(i)].torque(x_[i], w_[i]);
    }
  }

  /// Finds the speeds w at the end of a stage of length h from `from_x_`, `from_v_`.
  void solve_stage(double h) {
    for (std::size_t k = 0; k < actions_.size(); ++k) actions_[k] = action(k, h, w_[static_cast<Index>(k)]);
    dry_ = h * level_;
    for (int pass = 0; pass < most_settling_passes; ++pass) {
      A_ = M_;
      b_.noalias() = M_ * from_v_;
      b_ -= h * (bias_ + offset_);
      for (Index i = 0; i < b_.size(); ++i) {
        const Action& act = actions_[static_cast<std::size_t>(i)];
        A_(i, i) += h * (act.damping + drag_[i]) + h * h * act.stiffness;
        b_[i] += h * (act.constant - act.stiffness * from_x_[i]);
      }
      last_ = w_;
      friction_.solve(A_, b_, dry_, w_);
      if (settled(h)) break;
    }
  }

  /// Whether the servos act at the speed that was found as they did to find it; otherwise they do from now on.
  bool settled(double h) {
    if ((w_ - last_).cwiseAbs().maxCoeff() <= 1e-9 + 1e-6 * w_.cwiseAbs().maxCoeff()) return true;
    bool same = true;
    for (std::size_t k = 0; k < servos_.size(); ++k) {
      const Action act = action(k, h, w_[static_cast<Index>(k)]);
      same = same && act == actions_[k];
      actions_[k] = act;
    }
    return same;
  }

  /// What a servo integrates: nothing while it gives all that it can.
  double error_at(Index i, double x) const {
    const auto k = static_cast<std::size_t>(i);
    return actions_[k].bounded || gain_ == 0.0 ? 0.0 : physics::effective_error(servos_[k], command_[i] - x);
  }

  physics::EffectiveDrives drives_;
  kinematics::Dynamics dynamics_;
  MatrixXd rotors_;
  std::vector<cell::TorqueServo> servos_;
  std::vector<CommandIntegral> commands_;
  std::vector<Action> actions_;
  DryFriction friction_;
  VectorXd x_, v_, a_, w_, integral_, bias_, torque_, slope_, q_, qd_, qdd_, level_, b_, drag_;
  VectorXd ripple_, gear_, offset_;  // torque of the motors, torque through the gears, dry friction (FrictionRange)
  VectorXd command_, rate_;          // over the present stage and step
  VectorXd from_x_, from_v_, from_integral_, next_command_;  // of stages
  VectorXd x_mid_, v_mid_, last_, dry_;                      // of a step, so that none is allocated
  MatrixXd M_, A_;
  bool loaded_ = false;  // some friction asks for the torque through its gear
  double gain_ = 1.0;    // of all servos
};

}  // namespace

ServoMotion move_by_servos(const cell::Cell& cell, const VectorXd& t, const MatrixXd& command, const VectorXd& start,
                           const VectorXd& gain) {
  ServoArm arm(cell, t, command, start, gain.size() > 0 ? gain[0] : 1.0);
  const double step = arm.step(gain.size() > 0 ? gain.maxCoeff() : 1.0);
  const MatrixXd none = MatrixXd::Zero(command.rows(), command.cols());
  ServoMotion out{none, none, none, none};
  for (Index k = 0; k < t.size(); ++k) {
    if (k > 0) {
      if (gain.size() > 0) arm.set_gain(gain[k - 1]);
      arm.advance(t[k - 1], t[k], std::max(1, static_cast<int>(std::ceil((t[k] - t[k - 1]) / step - 1e-9))));
    }
    out.x.row(k) = arm.x();
    out.v.row(k) = arm.v();
    out.a.row(k) = arm.a();
    out.torque.row(k) = arm.torque();
  }
  return out;
}

}  // namespace kr5::predict
