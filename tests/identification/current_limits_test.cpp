#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/identification/current_limits.hpp>
#include <kr5/kinematics/jacobian.hpp>
#include <kr5/kinematics/newton_euler.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace current_limits_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// A KR5 whose gravity is known to a standard deviation of each mass moment.
struct LimitWorld {
  cell::Cell cell = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  kinematics::DhChain chain = cell::nominal_chain(cell);
  GravityModel model;
  VectorXd coulomb = cell.drives->friction.coulomb;
  MatrixXd postures{2, 6};

  explicit LimitWorld(double sigma = 0.0) {
    postures << 0.2, -0.4, -2.4, 0.3, -0.6, 0.1, 0.0, 0.3, -2.0, 0.0, -0.5, 0.0;
    JointMotion motion;  // exact, so that the model is the arm
    const Index n = 400;
    motion.t = VectorXd::LinSpaced(n, 0.0, 40.0);
    motion.q = motion.qd = motion.qdd = motion.tau = MatrixXd::Zero(n, 6);
    kinematics::Dynamics arm(chain, cell.robot.links);
    for (Index k = 0; k < n; ++k) {
      for (Index j = 0; j < 6; ++j) {
        motion.q(k, j) = std::sin((0.5 + 0.11 * double(j)) * motion.t[k] + double(j));
        motion.qd(k, j) = 0.1 * std::cos((0.5 + 0.11 * double(j)) * motion.t[k] + double(j));
      }
      motion.tau.row(k) = arm.gravity_torques(motion.q.row(k).transpose()).transpose();
    }
    model = identify_gravity(chain, motion).model;
    model.covariance = sigma * sigma * MatrixXd::Identity(model.parameters.size(), model.parameters.size());
  }

  PassiveLimits limits(const PassiveLimitOptions& options = {}) const {
    return passive_limits(model, coulomb, physics::Motors(cell), postures, options);
  }
  /// Currents that hold a posture with a force of the environment on the flange.
  VectorXd currents(Index k, const Eigen::Vector3d& force) const {
    const VectorXd q = postures.row(k);
    kinematics::Dynamics arm(chain, cell.robot.links);
    VectorXd tau = arm.gravity_torques(q);
    tau -= kinematics::jacobian(chain, q).topRows<3>().transpose() * force;
    return cell.drives->structure.transpose().inverse() * tau;
  }
  VectorXd motor_currents(Index k, const Eigen::Vector3d& force) const {
    return currents(k, force).cwiseQuotient(cell.drives->torque_constant);
  }
};

}  // namespace

TEST_CASE("limits are a tenth above gravity and friction of the most demanding posture") {
  const LimitWorld world;
  const PassiveLimits found = world.limits();
  REQUIRE(found.fit.usable());
  for (Index m = 0; m < 6; ++m) {
    const double one = std::abs(world.motor_currents(0, {0, 0, 0})[m]),
                 two = std::abs(world.motor_currents(1, {0, 0, 0})[m]);
    CHECK(found.limit[m] == Approx(1.1 * (std::max(one, two) + found.friction[m])).epsilon(1e-6));
    CHECK(found.posture[static_cast<std::size_t>(m)] == (two > one));
  }
  CHECK(found.friction[0] == Approx(34.0 / 125.04 / 0.82));
  // With a coupled wrist the friction of two joints may add up on one motor.
  const MatrixXd inverse = world.cell.drives->structure.transpose().inverse().cwiseAbs();
  CHECK(found.friction[3] == Approx((inverse.row(3) * world.coulomb).value() / 0.38));
}

TEST_CASE("an arm gives way at the force at which its first motor is out of its limit and friction") {
  const LimitWorld world;
  const PassiveLimits found = world.limits();
  const PassiveLimitOptions options;
  for (Index k = 0; k < 2; ++k)
    for (Index c = 0; c < 6; ++c) {
      const Eigen::Vector3d u = options.directions.col(c);
      const double yields = found.yield_force(k, c), pushes = found.push_force(k, c);
      const auto over = [&](double force, double friction) {
        const VectorXd i = world.motor_currents(k, force * u).cwiseAbs();
        return (i - found.limit - friction * found.friction).maxCoeff();
      };
      CHECK(over(0.999 * yields, 1.0) < 0.0);
      CHECK(over(1.001 * yields, 1.0) > 0.0);
      // What stops the tool acts against it: the force on the tool is the other way.
      CHECK(over(-0.999 * pushes, -1.0) < 1e-9);
      CHECK(over(-1.001 * pushes, -1.0) > -1e-9);
      CHECK(pushes < yields);
      const int motor = found.yield_motor(k, c);
      CHECK(std::abs(world.motor_currents(k, yields * u)[motor]) ==
            Approx(found.limit[motor] + found.friction[motor]).epsilon(1e-6));
    }
  // 34 N m of friction and a tenth of it, twice, on the reach: joint 1 against a force along Y (tests/sim).
  const double reach = kinematics::jacobian(world.chain, world.postures.row(1).transpose())(1, 0);
  CHECK(found.yield_force(1, 1) <= Approx(2.1 * 34.0 / reach).epsilon(1e-6));
}

TEST_CASE("the margin for a contact force is the one with which that force is just enough") {
  LimitWorld world(0.02);
  PassiveLimitOptions options{.margin = 0.2};
  options.contact_force = world.limits(options).yield_force.maxCoeff();
  options.margin = 0.7;  // of no influence
  CHECK(world.limits(options).max_margin == Approx(0.2).epsilon(1e-6));
  options.contact_force = 1.0;  // less than friction alone holds
  CHECK(world.limits(options).max_margin < 0.0);
  options.contact_force = 0.0;
  CHECK(std::isinf(world.limits(options).max_margin));
}

TEST_CASE("limits grow by what gravity may be off") {
  const LimitWorld sure, unsure(0.05);
  const PassiveLimits a = sure.limits(), b = unsure.limits();
  for (Index m = 1; m < 5; ++m) CHECK(b.limit[m] > a.limit[m]);
  // Motor 2 alone: 1.96 deviations of the torque of joint 2, by gear and torque constant.
  const auto k = static_cast<Index>(b.posture[1]);
  const double sigma = unsure.model.predict(unsure.postures.row(k).transpose()).sigma[1];
  CHECK(b.uncertainty[1] == Approx(uncertainty::normal_factor(0.95) * sigma / 125.05 / 0.82));
  CHECK(b.limit[1] == Approx(a.limit[1] + b.uncertainty[1]).epsilon(1e-6));
}

TEST_CASE("the book's saturation currents are a tenth above what the axes needed") {
  // Row 46: axes 1 and 3 of a standing arm at 0.48 and -2.28 A, axis 1 of a moving one at 0.7998 A.
  for (const double saturated : {0.48, -2.28, 0.7998}) {
    const double needed = std::abs(saturated) / 1.1;
    const VectorXd limit = force::current_limits(VectorXd::Constant(1, std::copysign(0.6 * needed, saturated)),
                                                 VectorXd::Constant(1, 0.4 * needed));
    CHECK(limit[0] == Approx(std::abs(saturated)));
  }
}

TEST_CASE("what limits cannot be made from is named") {
  LimitWorld world;
  const auto complaint = [&](auto&& call) {
    CHECK_THROWS_WITH(passive_limits(world.model, world.coulomb, physics::Motors(world.cell), world.postures),
                      Contains(call));
  };
  world.postures(1, 2) = std::numeric_limits<double>::quiet_NaN();
  complaint("postures must be finite");
  world.postures.resize(0, 6);
  complaint("postures: none");
  world.postures = MatrixXd::Zero(1, 5);
  complaint("postures: found 5 columns, expected one a joint: 6");
  world.postures = MatrixXd::Zero(1, 6);
  world.coulomb[0] = -1.0;
  complaint("coulomb must not be negative");
  world.coulomb.resize(2);
  complaint("coulomb: found 2 values");
  CHECK_THROWS_WITH((PassiveLimitOptions{.margin = -0.1}.validate()), Contains("margin"));
  CHECK_THROWS_WITH((PassiveLimitOptions{.confidence = 1.0}.validate()), Contains("confidence"));
  CHECK_THROWS_WITH((PassiveLimitOptions{.directions = 2 * Eigen::Matrix3d::Identity()}.validate()),
                    Contains("directions must be unit"));
  world = LimitWorld();
  world.model.untold = MatrixXd::Zero(world.model.parameters.size(), 1);
  world.model.untold(0, 0) = 1.0;  // the moment of link 2
  const PassiveLimits untold = world.limits();
  CHECK_FALSE(untold.fit.usable());
  CHECK_THAT(untold.fit.message, Contains("posture 0: the gravity torque of joint 2"));
}

}  // namespace current_limits_test
