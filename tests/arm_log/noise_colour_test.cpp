#include "arm_log/noise_colour.hpp"

#include <catch2/catch.hpp>

#include <kr5/arm_log/diagnose_log.hpp>

#include "arm_log/logged_arm.hpp"
#include "gap/diagnosis_matchers.hpp"

namespace noise_colour_test {

using namespace kr5;
using namespace kr5::test;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

/// Noise of unit variance whose neighbours are correlated.
VectorXd coloured(Random& random, Index rows, double correlation) {
  VectorXd out = random.normal_vector(rows);
  for (Index i = 1; i < rows; ++i)
    out[i] = correlation * out[i - 1] + std::sqrt(1 - correlation * correlation) * out[i];
  return out;
}

identification::JointMotion motion_of(Index rows) {
  identification::JointMotion out;
  out.t = VectorXd::LinSpaced(rows, 0.0, 0.02 * static_cast<double>(rows - 1));
  out.q = swinging(out.t);
  const VectorXd later = out.t.array() + 1e-4;
  out.qd = (swinging(later) - out.q) / 1e-4;
  out.qdd = Eigen::MatrixXd::Zero(rows, logged_joints);
  out.tau = out.q;
  return out;
}

}  // namespace

TEST_CASE("coloured noise is found with its size and correlation; white noise is not coloured") {
  const identification::JointMotion motion = motion_of(3000);
  Random random(11);
  int found = 0, white = 0;
  constexpr int trials = 40;
  for (int k = 0; k < trials; ++k) {
    const double correlation = random.uniform(0.6, 0.95), size = random.uniform(0.1, 10.0);
    const arm_log::NoiseColour colour =
        arm_log::noise_colour(motion, size * coloured(random, 3000, correlation), k % logged_joints);
    if (colour.sigma > 0) {
      ++found;
      CHECK(colour.sigma == Approx(size).epsilon(4 * std::sqrt(gap::colour_factor(correlation) / 2 / 3000)));
      CHECK(colour.correlation == Approx(correlation).margin(0.06));
    }
    white += arm_log::noise_colour(motion, size * random.normal_vector(3000), k % logged_joints).sigma > 0;
  }
  CHECK(found >= 36);
  CHECK(white == 0);
}

TEST_CASE("what depends on the motion is no noise, whatever noise it has beside it") {
  const identification::JointMotion motion = motion_of(3000);
  Random random(12);
  for (int k = 0; k < 20; ++k) {
    const int joint = k % logged_joints;
    const Eigen::ArrayXd q = motion.q.col(joint), side = motion.qd.col(joint).array().sign();
    const std::vector<Eigen::ArrayXd> shapes = {side * (2 * q).sin(), q.cos() * side, (40 * q).sin(),
                                                (motion.q.col((joint + 1) % logged_joints).array()).sin(),
                                                (-(motion.qd.col(joint).array() / 0.1).square()).exp() * side};
    const Eigen::ArrayXd shape = shapes[static_cast<std::size_t>(k) % shapes.size()];
    const double size = random.uniform(1.0, 3.0) / std::sqrt(shape.square().mean());
    const VectorXd left = size * shape.matrix() + coloured(random, 3000, k % 2 == 0 ? 0.0 : 0.7);
    CHECK(arm_log::noise_colour(motion, left, joint).sigma == 0.0);
  }
}

TEST_CASE("a sound arm under coloured noise has no gap, and its friction is found with an honest size") {
  cell::Cell arm = moved_arm();
  arm.drives->friction.coulomb[1] = 1.5;
  for (const bool rubs : {false, true}) {
    arm_log::ArmLog log = logged(rubs ? arm : moved_arm(), {.noise = {0.0, 0.0, 0.0}});
    Random random(21);
    const Eigen::Vector3d size(0.4, 0.3, 0.1);
    for (int j = 0; j < logged_joints; ++j) log.effort.col(j) += size[j] * coloured(random, log.t.size(), 0.9);
    const arm_log::LogDiagnosis found = arm_log::diagnose_log(log, described_arm());
    INFO(text(found.diagnosis));
    if (!rubs) {
      CHECK(found.diagnosis.verdict == gap::Verdict::NoGap);
      continue;
    }
    CHECK(found.diagnosis.verdict == gap::Verdict::Explained);
    CHECK(names_only(found.diagnosis, {{"coulomb_friction", "joint2"}}));
    REQUIRE(!found.diagnosis.causes.empty());
    const gap::ParameterEstimate& level = found.diagnosis.causes[0].parameters.at(0);
    CHECK(std::abs(level.value[0] - 1.5) < 3 * level.std[0]);
    CHECK(level.std[0] > 0.3 * std::sqrt(gap::colour_factor(0.9) / 1500) * size[1]);
  }
}

}  // namespace noise_colour_test
