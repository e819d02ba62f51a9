// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <kr5/force/contact_wrench.hpp>
#include <kr5/force/peg_on_tube.hpp>

#include <kr5/predict/contact.hpp>
#include <kr5/predict/wrench.hpp>
#include "held_tool.hpp"
#include "kinds.hpp"

namespace kr5::sim {
namespace {

using Eigen::Index;
using Eigen::Vector3d;
using Eigen::VectorXd;
using predict::Given;
using predict::Run;
using predict::Shown;

constexpr double local_stiffness = 1e7;  // of the touching edges alone, what else gives way is in series [N/m]
constexpr double longest_step = 2.5e-4;  // resolves the tool on that stiffness [s]
constexpr double settling = 0.05;        // before the first row of a run [s]
constexpr double closing = 200.0;        // Hunt-Crossley: a third of critical damping at 15 N [s/m]

force::PegTubeShape real_shape(const cell::Cell& cell) {
  const cell::Peg& peg = *cell.peg;
  const cell::Tube& tube = *cell.tube;
  return {peg.radius,        peg.length, peg.chamfer, cell.effects.task.tube_radius.value_or(tube.inner_radius),
          tube.outer_radius, tube.depth, tube.chamfer};
}

Pose real_tube(const cell::TaskEffects& e) {
  Pose T_T_tube(Eigen::Translation3d(e.tube_shift));
  T_T_tube.rotate(Eigen::AngleAxisd(e.tube_tilt.x(), Vector3d::UnitX()));
  T_T_tube.rotate(Eigen::AngleAxisd(e.tube_tilt.y(), Vector3d::UnitY()));
  return T_T_tube;
}

/// One row of the experiment, or a point between two.
struct Posture {
  double tilt = 0.0, alpha = 0.0, cx = 0.0, cy = 0.0, held = 0.0;
};

Posture between(const Posture& a, const Posture& b, double part) {
  const auto mix = [part](double x, double y) { return x + part * (y - x); };
  return {mix(a.tilt, b.tilt), mix(a.alpha, b.alpha), mix(a.cx, b.cx), mix(a.cy, b.cy), mix(a.held, b.held)};
}

/// The peg pressed on the tube with a held force; it moves along Z of T.
class Roll {
 public:
  explicit Roll(const cell::Cell& cell)
      : shape_(real_shape(cell)),
        T_tube_T_(real_tube(cell.effects.task).inverse()),
        R_B_T_(cell.tube->T_B_T.linear()),
        contact_(cell),
        lateral_(cell.effects.task.lateral),
        tool_(cell, cell.tube->T_B_T) {
    shape_.validate();
    law_.stiffness = std::max(local_stiffness, 10.0 * stiffness());
    law_.damping = closing;
    law_.friction = 0.0;
  }

  double longest() const { return longest_step * std::sqrt(local_stiffness / law_.stiffness); }

  void rest(double z, const Posture& at) {
    tool_.place(z - at.held / law_.stiffness, 0.0);
    const double step = longest();
    for (int i = 0; i < static_cast<int>(settling / step); ++i) advance(at, step);
  }

  void advance(const Posture& at, double step) {
    tool_.touch(R_B_T_ * force_on_peg(at));
    tool_.push(-at.held, step);
  }

  /// What the arm reads: the peg is ahead of it by what gives way between them.
  double reading(const Posture& at) const { return tool_.z() + at.held / law_.stiffness - contact_.depth(at.held); }

  Vector6 wrench() const { return tool_.wrench(); }
  const force::PegTubeShape& shape() const { return shape_; }
  Pose T_T_tube() const { return T_tube_T_.inverse(); }
  Eigen::Vector2d centre(const Posture& at) const {
    return Eigen::Vector2d(at.cx, at.cy) + lateral_ * friction(at).head<2>();
  }

 private:
  double stiffness() const { return 1.0 / std::max(contact_.depth(1.0), 1e-12); }

  /// Against the way of the peg's low side, which runs round with alpha.
  Vector3d friction(const Posture& at) const {
    return contact_.friction() * at.held * Vector3d(std::sin(at.alpha), -std::cos(at.alpha), 0.0);
  }

  Vector3d force_on_peg(const Posture& at) {
    Pose T_T_peg = Pose::Identity();
    T_T_peg.translation() << centre(at), tool_.z();
    T_T_peg.linear() =
        Eigen::AngleAxisd(at.tilt, Vector3d(-std::sin(at.alpha), std::cos(at.alpha), 0.0)).toRotationMatrix();
    Vector6 twist = Vector6::Zero();
    twist.head<3>() = T_tube_T_.linear().col(2) * tool_.speed();
    const Pose T_tube_peg = T_tube_T_ * T_T_peg;
    force::Stiction none;
    const force::ContactForce contact = force::contact_wrench(force::peg_tube_contacts(shape_, T_tube_peg), law_,
                                                              T_tube_peg, twist, longest_step, none);
    Vector3d on_peg = T_tube_T_.linear().transpose() * contact.wrench.head<3>();
    on_peg.head<2>().setZero();  // the arm holds the peg across, but for friction
    return on_peg + friction(at);
  }

  force::PegTubeShape shape_;
  Pose T_tube_T_;
  Eigen::Matrix3d R_B_T_;
  predict::RealContact contact_;
  double lateral_;
  force::ContactLaw law_;
  HeldTool tool_;
};

void roll_run(Roll& roll, const Run& run, const std::vector<Posture>& rows, const VectorXd& t, const VectorXd& start,
              double longest, VectorXd& z, Eigen::MatrixXd& wrench) {
  bool carried = false;
  for (Index k = run.first; k < run.last; ++k) {
    const Posture& now = rows[static_cast<std::size_t>(k)];
    if (!std::isfinite(start[k])) {  // nothing carries the peg here
      carried = false;
      z[k] = std::numeric_limits<double>::quiet_NaN();
      continue;
    }
    if (!carried) {
      roll.rest(start[k], now);
      carried = true;
    } else {
      const Posture& before = rows[static_cast<std::size_t>(k - 1)];
      const auto steps = static_cast<int>(std::ceil((t[k] - t[k - 1]) / longest - 1e-6));
      for (int i = 1; i <= steps; ++i)
        roll.advance(between(before, now, static_cast<double>(i) / steps), (t[k] - t[k - 1]) / steps);
    }
    z[k] = roll.reading(now);
    wrench.row(k) = roll.wrench();
  }
}

}  // namespace

Shown profile(const cell::Cell& cell, const Given& given, const DartSimulatorOptions& options) {
  given.need(cell.contact.has_value(), "contact");
  given.need(cell.peg.has_value(), "peg");
  given.need(cell.tube.has_value(), "tube");
  given.need(cell.tool.has_value(), "tool");
  Roll roll(cell);
  const VectorXd tilt = given["tilt"], alpha = given["alpha"], held = given["fc"], cx = given["cx"], cy = given["cy"];
  std::vector<Posture> rows;
  VectorXd start(given.rows());  // only where each run begins
  const force::PegTube bodies{roll.shape().peg_radius, roll.shape().inner_radius, roll.shape().outer_radius};
  for (Index k = 0; k < given.rows(); ++k) {
    rows.push_back({tilt[k], alpha[k], cx[k], cy[k], held[k]});
    start[k] = force::resting_height(bodies, roll.T_T_tube(), tilt[k], alpha[k], roll.centre(rows.back()));
  }
  if (options.step > roll.longest())
    given.fail("step: the stable bound of this contact is " + std::to_string(1e3 * roll.longest()) + " ms");
  VectorXd z(given.rows());
  Eigen::MatrixXd wrench = Eigen::MatrixXd::Constant(given.rows(), 6, std::numeric_limits<double>::quiet_NaN());
  for (const Run& run : given.runs())
    roll_run(roll, run, rows, given["t"], start, options.step > 0.0 ? options.step : roll.longest(), z, wrench);
  predict::sense(cell.effects, given["t"], given.runs(), wrench);
  Shown out(given.rows());
  out.add("z", z);
  out.add_wrench(wrench);
  return out;
}

}  // namespace kr5::sim
