#include <cmath>
#include <limits>

#include <Eigen/QR>

#include <catch2/catch.hpp>

#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/gravity_model.hpp>
#include <kr5/kinematics/newton_euler.hpp>
#include <support/arm_cells.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

namespace gravity_model_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

struct SlowWorld {
  kinematics::DhChain chain;
  std::vector<kinematics::Body> bodies;
  VectorXd coulomb;
  Eigen::Vector3d gravity = {0.0, 0.0, -9.81};

  explicit SlowWorld(const cell::Cell& cell)
      : chain(cell::nominal_chain(cell)), bodies(cell.robot.links), coulomb(cell.drives->friction.coulomb) {
    for (kinematics::DhJoint& joint : chain.joints)  // which a file has with six digits
      joint.alpha = M_PI_2 * std::round(joint.alpha / M_PI_2);
  }

  int joints() const { return static_cast<int>(bodies.size()); }

  /// Every joint to and fro about its own middle, slowly; those of `standing` stand.
  JointMotion motion(double noise, std::uint64_t seed, const std::vector<int>& standing = {}, Index samples = 600) {
    const Index n = joints();
    JointMotion out;
    out.t = VectorXd::LinSpaced(samples, 0.0, 60.0);
    out.q = out.qd = out.qdd = out.tau = MatrixXd::Zero(samples, n);
    kinematics::Dynamics arm(chain, bodies, gravity);
    Random random(seed);
    for (Index k = 0; k < samples; ++k) {
      for (Index j = 0; j < n; ++j) {
        if (std::find(standing.begin(), standing.end(), j) != standing.end()) continue;
        const double rate = 0.15 + 0.037 * double(j), phase = rate * out.t[k] + double(j);
        out.q(k, j) = 0.3 * double(j) + 0.9 * std::sin(phase);
        out.qd(k, j) = 0.9 * rate * std::cos(phase);
      }
      out.tau.row(k) = arm.gravity_torques(out.q.row(k).transpose()).transpose();
      for (Index j = 0; j < n; ++j) out.tau(k, j) += (out.qd(k, j) > 0 ? 1 : -1) * coulomb[j] + random.normal(noise);
    }
    return out;
  }
};

cell::Cell kuka() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

const GravityOptions fast_enough{.max_speed = 2.0};

VectorXd drawn(Random& random, Index n) {
  return VectorXd::NullaryExpr(n, [&] { return random.uniform(-2.0, 2.0); });
}

}  // namespace

TEST_CASE("the backward recursion of the mass moment holds any arm as Newton-Euler does") {
  Random random(3);
  for (const char* joints : {"r", "rrp", "prrr", "rrrrrr", "rrrrrrrrrrrr"}) {
    SlowWorld world(test::arm_cell({joints}));
    world.gravity = {1.0, -2.0, -9.0};
    kinematics::Dynamics arm(world.chain, world.bodies, world.gravity);
    const VectorXd q = drawn(random, world.joints());
    const auto carried = carried_masses(world.chain, world.bodies, q);
    CHECK((holding_torques(world.chain, carried, q, world.gravity) - arm.gravity_torques(q)).norm() < 1e-10);
    double mass = 0.0;
    for (const kinematics::Body& b : world.bodies) mass += b.mass;
    CHECK(carried.front().mass == Approx(mass));
  }
  SlowWorld world(kuka());
  CHECK_THROWS_WITH(carried_masses(world.chain, std::vector<kinematics::Body>(2), VectorXd::Zero(6)),
                    Contains("bodies: found 2, expected one a joint: 6"));
}

TEST_CASE("gravity identified from exact slow motion holds postures that the motion never visited") {
  Random random(5);
  for (const char* joints : {"rr", "rrp", "rrrr", "rrrrrr", "rrrrrrrrr"}) {
    SlowWorld world(test::arm_cell({joints}));
    world.gravity = {1.0, -2.0, -9.0};  // so that every joint carries something
    GravityOptions options = fast_enough;
    options.gravity = world.gravity;
    const GravityResult result = identify_gravity(world.chain, world.motion(0.0, 1), options);
    INFO(joints);
    REQUIRE(result.fit.usable());
    CHECK(result.model.untold.cols() == 0);
    CHECK((result.coulomb - world.coulomb).norm() < 1e-6);
    kinematics::Dynamics arm(world.chain, world.bodies, world.gravity);
    for (int k = 0; k < 5; ++k) {
      const VectorXd q = drawn(random, world.joints());
      CHECK((result.model.predict(q).tau - arm.gravity_torques(q)).norm() < 1e-6);
    }
  }
}

TEST_CASE("a twist that is hardly off a right angle makes no further mass moments") {
  SlowWorld world(test::arm_cell({"rrr"}));
  const GravityResult square = identify_gravity(world.chain, world.motion(0.0, 1), fast_enough);
  const int digits = GENERATE(2, 3, 4, 5, 8, 11, 14);
  const double unit = std::pow(10.0, -digits), off = M_PI_2 - std::round(M_PI_2 / unit) * unit,
               twice = M_PI - std::round(M_PI / unit) * unit, rounded = std::abs(off);
  CAPTURE(digits);
  world.chain.joints[0].alpha += off;
  world.chain.joints[1].alpha -= twice;
  world.chain.T_base_0 = world.chain.T_base_0 * Eigen::AngleAxisd(off, Eigen::Vector3d::UnitX());
  const GravityResult result = identify_gravity(world.chain, world.motion(0.0, 1), fast_enough);
  CHECK(result.model.names == square.model.names);
  const VectorXd q = VectorXd::Constant(3, 0.7);
  const VectorXd truth = kinematics::Dynamics(world.chain, world.bodies).gravity_torques(q);
  CHECK((result.model.predict(q).tau - truth).norm() < std::max(1e-2, 5 * rounded * truth.norm()));
}

TEST_CASE("postures at rest tell gravity, and friction that holds them is their noise") {
  SlowWorld world(kuka());
  kinematics::Dynamics arm(world.chain, world.bodies, world.gravity);
  Random random(5);
  const Index rows = 400;
  MatrixXd q(rows, 6), tau(rows, 6);
  for (Index k = 0; k < rows; ++k) {
    q.row(k) = drawn(random, 6).transpose();
    tau.row(k) = arm.gravity_torques(q.row(k).transpose()).transpose();
    for (Index j = 0; j < 6; ++j) tau(k, j) += random.uniform(-1.0, 1.0) * world.coulomb[j];
  }
  const GravityResult result = identify_gravity_at_rest(world.chain, q, tau);
  REQUIRE(result.fit.usable());
  CHECK(result.model.names == identify_gravity(world.chain, world.motion(0.1, 1), fast_enough).model.names);
  const VectorXd posture = drawn(random, 6), truth = arm.gravity_torques(posture);
  const GravityPrediction predicted = result.model.predict(posture);
  for (Index j = 0; j < 6; ++j) {
    CHECK(std::abs(predicted.tau[j] - truth[j]) < 4 * predicted.sigma[j] + 1e-9);
    CHECK(predicted.sigma[j] < 0.3 * world.coulomb[j]);
    CHECK(result.residual_rms[j] == Approx(world.coulomb[j] / std::sqrt(3.0)).epsilon(0.15));
    CHECK(result.coulomb_sigma[j] == std::numeric_limits<double>::infinity());
  }
  CHECK_THAT(identify_gravity_at_rest(world.chain, q.topRows(8), tau.topRows(8)).fit.message, Contains("8 postures"));
  CHECK_THROWS_AS(identify_gravity_at_rest(world.chain, q.leftCols(5), tau), InvalidArgument);
}

TEST_CASE("postures jump from row to row, motions do not") {
  Random random(6);
  MatrixXd postures(50, 3), grid(50, 1);
  for (Index k = 0; k < postures.rows(); ++k) {
    postures.row(k) = drawn(random, 3).transpose();
    grid(k, 0) = -1.0 + 0.04 * double(k) * 1.5;
  }
  CHECK(are_postures(postures));
  CHECK(are_postures(grid, false));  // without times, steps of 3 degrees are those of postures
  CHECK_FALSE(are_postures(grid));
  SlowWorld world(kuka());
  CHECK_FALSE(are_postures(world.motion(0.0, 1).q));
  CHECK_FALSE(are_postures(world.motion(0.0, 1).q, false));
}

TEST_CASE("a KR5 has ten mass moments that torques tell, the distal masses among the proximal moments") {
  SlowWorld world(kuka());
  const GravityResult result = identify_gravity(world.chain, world.motion(0.0, 1), fast_enough);
  const GravityModel& model = result.model;
  // Rank by another decomposition, of torques of random postures and masses.
  Random random(9);
  MatrixXd A(40 * 6, 24);
  for (Index k = 0; k < 40; ++k) {
    const VectorXd q = drawn(random, 6);
    for (Index c = 0; c < 24; ++c) {
      std::vector<kinematics::Body> unit(6);
      kinematics::Body& b = unit[static_cast<std::size_t>(c / 4)];
      b.mass = 1.0;
      if (c % 4) b.com[c % 4 - 1] = 1.0;
      A.col(c).segment(6 * k, 6) = kinematics::Dynamics(world.chain, unit).gravity_torques(q);
    }
  }
  Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  qr.setThreshold(1e-9);
  CHECK(model.parameters.size() == qr.rank());
  CHECK(model.parameters.size() == 10);
  CHECK(model.names.size() == static_cast<std::size_t>(model.parameters.size()));
  CHECK(model.names[0] == "m2 c2x + 0.6 m2 + 0.6 m3 + 0.6 m4 + 0.6 m5 + 0.6 m6");
  const Index p = model.parameters.size();
  CHECK(model.names[static_cast<std::size_t>(p - 1)] == "m6 c6y");
}

TEST_CASE("bodies with an identified gravity hold the arm as the model says and keep what it cannot tell") {
  SlowWorld world(kuka());
  const GravityResult result = identify_gravity(world.chain, world.motion(0.0, 1), fast_enough);
  std::vector<kinematics::Body> believed = world.bodies;
  believed[2].com.x() += 0.05;
  believed[5].mass *= 2.0;
  const std::vector<kinematics::Body> found = result.model.bodies(believed);
  const VectorXd q = VectorXd::LinSpaced(6, -1.0, 1.0);
  CHECK((kinematics::Dynamics(world.chain, found).gravity_torques(q) -
         kinematics::Dynamics(world.chain, world.bodies).gravity_torques(q))
            .norm() < 1e-6);
  CHECK(found[5].mass == believed[5].mass);
  CHECK(found[1].inertia == believed[1].inertia);
  believed[2].mass = 0.0;
  CHECK_THROWS_WITH(result.model.bodies(believed), Contains("link 3 has no mass"));
}

TEST_CASE("a torque that the slow motion does not tell is infinitely uncertain, others are not") {
  SlowWorld world(kuka());
  const GravityResult result = identify_gravity(world.chain, world.motion(0.1, 1, {3, 5}), fast_enough);
  REQUIRE(result.fit.usable());
  CHECK(result.model.untold.cols() > 0);
  CHECK_THAT(result.notes.front(), Contains("joint 4 did not move slowly"));
  VectorXd q = VectorXd::Zero(6);
  q[3] = 0.9;  // joint 4 stood at 0
  CHECK(std::isinf(result.model.predict(q).sigma[3]));
  q[3] = 0.0;
  q[1] = 0.4;
  const GravityPrediction told = result.model.predict(q);
  const VectorXd truth = kinematics::Dynamics(world.chain, world.bodies).gravity_torques(q);
  for (const int j : {1, 2, 4}) {
    CHECK(told.sigma[j] < 0.5);
    CHECK(std::abs(told.tau[j] - truth[j]) < 4 * told.sigma[j]);
  }
}

TEST_CASE("the covariance of identified gravity covers the truth", "[statistics]") {
  SlowWorld world(test::arm_cell({"rrr"}));
  const VectorXd q = VectorXd::Constant(3, 0.7);
  const VectorXd truth = kinematics::Dynamics(world.chain, world.bodies).gravity_torques(q);
  test::Coverage coverage("gravity torque", 1);
  for (int k = 0; k < test::trials(2000, 250); ++k) {
    const GravityResult result =
        identify_gravity(world.chain, world.motion(1.0, 100 + static_cast<std::uint64_t>(k), {}, 150), fast_enough);
    const GravityPrediction p = result.model.predict(q);
    coverage.add(VectorXd::Constant(1, p.tau[1] - truth[1]), MatrixXd::Constant(1, 1, p.sigma[1] * p.sigma[1]));
  }
  coverage.check_rate();
}

TEST_CASE("noise that is correlated in time widens the covariance of gravity") {
  SlowWorld world(test::arm_cell({"rrr"}));
  JointMotion motion = world.motion(0.0, 1);
  Random random(2);
  const auto sigma_of = [&](double memory) {
    JointMotion noisy = motion;
    VectorXd e = VectorXd::Zero(3);
    for (Index k = 0; k < noisy.samples(); ++k) {
      e = memory * e + std::sqrt(1 - memory * memory) * random.normal_vector(3);
      noisy.tau.row(k) += e.transpose();
    }
    return identify_gravity(world.chain, noisy, fast_enough).model.predict(VectorXd::Constant(3, 0.7)).sigma[1];
  };
  // An AR(1) process of memory 0.9 has (1 + 0.9) / (1 - 0.9) = 19 times the variance of the mean of a white one.
  CHECK(sigma_of(0.9) / sigma_of(0.0) == Approx(std::sqrt(19.0)).epsilon(0.4));
}

TEST_CASE("the error on the samples held out is that of the noise") {
  SlowWorld world(kuka());
  const GravityResult result = identify_gravity(world.chain, world.motion(2.0, 4), fast_enough);
  for (Index j = 0; j < 6; ++j) {
    CHECK(result.held_out_rms[j] == Approx(2.0).epsilon(0.25));
    CHECK(result.residual_rms[j] == Approx(2.0).epsilon(0.15));
  }
  CHECK(result.torque_rms[1] > 100.0);
}

TEST_CASE("slow motion that tells no gravity is named") {
  SlowWorld world(kuka());
  const JointMotion sound = world.motion(0.0, 1);
  CHECK_THAT(identify_gravity(world.chain, sound, {.max_speed = 0.006}).fit.message, Contains("no joint moves slowly"));
  JointMotion motion = sound;
  motion.qd.col(2) = motion.qd.col(2).cwiseAbs();
  GravityResult result = identify_gravity(world.chain, motion, fast_enough);
  CHECK_FALSE(result.fit.usable());
  CHECK_THAT(result.fit.message, Contains("joint 3 moved in one direction only"));
  motion = sound;
  motion.tau(3, 1) = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(identify_gravity(world.chain, motion, fast_enough), Contains("tau: row 3, joint 2"));
  world.chain.joints.pop_back();
  CHECK_THROWS_WITH(identify_gravity(world.chain, sound, fast_enough), Contains("motion.q: found 6, expected one a"));
  CHECK_THROWS_WITH(GravityOptions{.min_speed = 0.0}.validate(), Contains("min_speed"));
  CHECK_THROWS_WITH(GravityOptions{.max_speed = 0.001}.validate(), Contains("max_speed"));
  CHECK_THROWS_WITH(GravityOptions{.held_out = 1.0}.validate(), Contains("held_out"));
}

}  // namespace gravity_model_test
