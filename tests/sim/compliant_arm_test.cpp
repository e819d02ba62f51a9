#include <kr5/force/safety_stop.hpp>
#include <kr5/sim/driven_arm.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/cell/cell.hpp>

namespace compliant_arm_test {

using namespace kr5;
using namespace kr5::sim;
using Eigen::VectorXd;

namespace {

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

VectorXd posture() {
  VectorXd q(6);
  q << 0.2, -0.4, -2.4, 0.3, -0.6, 0.1;
  return q;
}

/// Limits a tenth above what gravity and dry friction take at the posture (Hayat et al. 2022, section 5.2).
VectorXd limits_at(const cell::Cell& cell, const VectorXd& q) {
  DrivenArm arm(cell);
  arm.reset(q);
  const VectorXd gravity = arm.read().current;
  const VectorXd friction = arm.drives().currents(VectorXd::Zero(6), cell.drives->friction.coulomb).cwiseAbs();
  return force::current_limits(gravity, friction);
}

/// How far each joint goes in a time under a push of the tool along Y of the base [rad].
VectorXd moved(const cell::Cell& cell, const VectorXd& limits, double push, double time, bool* limited) {
  DrivenArm arm(cell, {0.0, limits});
  arm.reset(posture());
  arm.set_environment([push](const Pose&, const Vector6&, double) {
    Vector6 out = Vector6::Zero();
    out[1] = push;
    return out;
  });
  *limited = false;
  while (arm.read().t < time) {
    arm.follow_limited(posture());
    *limited = *limited || arm.read().limited;
  }
  return (arm.read().position - posture()).cwiseAbs();
}

}  // namespace

TEST_CASE("within limits a tenth above what its pose needs the arm holds itself and yields to a push") {
  const cell::Cell cell = arc();
  const VectorXd limits = limits_at(cell, posture());
  bool limited = false;
  CHECK(moved(cell, limits, 0.0, 2.0, &limited).maxCoeff() < 1e-3);
  CHECK_FALSE(limited);
  // 34 N m of friction and a tenth of it on a reach of 0.9 m: beyond some 80 N joint 1 gives way.
  CHECK(moved(cell, limits, 60.0, 1.0, &limited)[0] < 1e-3);
  CHECK(moved(cell, limits, 200.0, 1.0, &limited)[0] > 0.05);
  CHECK(limited);
  CHECK(moved(cell, VectorXd(), 200.0, 1.0, &limited)[0] < 1e-3);  // without limits it does not
}

}  // namespace compliant_arm_test
