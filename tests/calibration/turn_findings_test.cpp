#include <algorithm>
#include <cmath>
#include <optional>

#include <catch2/catch.hpp>

#include <kr5/calibration/arm_axes.hpp>
#include <kr5/core/error.hpp>
#include <support/rates.hpp>
#include <support/trials.hpp>

#include "calibration/turns_world.hpp"

namespace turn_findings_test {

using namespace kr5;
using namespace kr5::calibration;
using Catch::Matchers::Contains;
using test::ArmTurns, test::make_arm_turns;

const Eigen::Vector3d device_shift(0.003, 0.0, 0.001);

void shift(std::vector<JointSample>& turn, std::size_t first, const Eigen::Vector3d& by) {
  for (std::size_t i = first; i < turn.size(); ++i) {
    turn[i].points.colwise() += by;
    if (turn[i].T_world_tool) turn[i].T_world_tool->pretranslate(by);
  }
}

/// The turns of the first joints alone, as of an arm that has no others.
ArmTurns first_joints(ArmTurns w, std::size_t count) {
  w.turns.resize(count);
  w.home.conservativeResize(static_cast<Eigen::Index>(count));
  return w;
}

void scale(ArmTurns& w, const Eigen::Vector3d& by) {
  for (std::vector<JointSample>& turn : w.turns)
    for (JointSample& sample : turn) sample.points = by.asDiagonal() * sample.points;
}

/// The arm as a cell has it: in its own base.
kinematics::DhChain nominal() { return test::book_arm(); }

ArmAxesResult identified(const ArmTurns& w, const std::optional<kinematics::DhChain>& cell = nominal()) {
  ArmAxesResult r = identify_arm_axes(w.turns, w.home, {.nominal = cell});
  REQUIRE(r.fit.usable());
  return r;
}

TEST_CASE("nothing is found in sound turns, of a tracker as of a total station", "[statistics]") {
  const int trials = test::trials(200, 30);
  for (const double sigma : {1e-5, 5e-4}) {
    Random random(1);
    int found = 0;
    for (int trial = 0; trial < trials; ++trial)
      found += !identified(make_arm_turns(random, {.sigma = sigma, .home_spread = 0.2})).findings.empty();
    test::check_rare(found, trials, 0.01, 0.18);
  }
}

TEST_CASE("a device that moved during a turn is found with the sample, and between turns with the joint") {
  const int trials = test::trials(20, 20);
  Random random(2);
  for (const bool poses : {false, true})
    for (const std::size_t joints : {std::size_t{6}, std::size_t{3}}) {
      CAPTURE(poses, joints);
      int found = 0, steps = 0, jumps = 0, others = 0;
      for (int trial = 0; trial < trials; ++trial) {
        ArmTurns within =
            first_joints(make_arm_turns(random, {.sigma = 1e-5, .home_spread = 0.2, .poses = poses}), joints);
        ArmTurns between = within;
        const int turned = trial % 3, first = 1 + trial % static_cast<int>(joints - 1);
        shift(within.turns[static_cast<std::size_t>(turned)], 10, device_shift);
        const TurnFindings noise = identified(within, std::nullopt).findings;
        found += noise.uneven_noise.size() == 1 && noise.uneven_noise[0].joint == turned;
        if (!noise.uneven_noise.empty()) {
          steps += noise.uneven_noise[0].after_step == 10;
          CHECK(noise.uneven_noise[0].sigma > 5 * noise.uneven_noise[0].sigma_others);
        }
        for (std::size_t k = static_cast<std::size_t>(first); k < joints; ++k) shift(between.turns[k], 0, device_shift);
        const TurnFindings jump = identified(between, std::nullopt).findings;
        jumps += jump.home_jumps.size() == 1 && jump.home_jumps[0].joint == first;
        others += !jump.uneven_noise.empty() || jump.shifted_rows || jump.implausible_length;
        if (!jump.home_jumps.empty()) {
          CHECK(jump.home_jumps[0].distance == Approx(device_shift.norm()).epsilon(0.05));
          CHECK(jump.home_jumps[0].std < device_shift.norm() / 8);
        }
      }
      test::check_rate(found, trials, 0.95, 0.83);
      test::check_rate(steps, trials, 0.95, 0.83);
      test::check_rate(jumps, trials, 0.95, 0.83);
      CHECK(others == 0);
    }
}

TEST_CASE("of an even number of other turns the usual noise is the mean of both in the middle") {
  Random random(9);
  const ArmTurns w = first_joints(make_arm_turns(random), 3);
  ArmAxesResult r = identified(w, std::nullopt);
  const double unit = std::ldexp(1.0, -17);
  r.axes[0].sigma_position = 10 * unit, r.axes[1].sigma_position = unit, r.axes[2].sigma_position = 3 * unit;
  const std::vector<UnevenNoise> found = find_in_turns(w.turns, r.axes, r.arm, w.home).uneven_noise;
  REQUIRE(found.size() == 1);
  CHECK(found[0].joint == 0);
  CHECK(found[0].sigma_others == 2 * unit);
}

TEST_CASE("jumps at home are not looked for without joint values") {
  Random random(3);
  ArmTurns w = make_arm_turns(random, {.sigma = 1e-5});
  for (std::size_t k = 3; k < 6; ++k) shift(w.turns[k], 0, device_shift);
  CHECK(identified(w).findings.home_jumps.size() == 1);
  w.turns[0][4].q.reset();
  CHECK(identified(w).findings.home_jumps.empty());
}

TEST_CASE("measurements shifted by a row are found by the ends of the turns") {
  Random random(4);
  for (const TurnEnd end : {TurnEnd::Last, TurnEnd::First}) {
    ArmTurns w = make_arm_turns(random, {.sigma = 1e-5});
    std::vector<JointSample*> all;
    for (std::vector<JointSample>& turn : w.turns)
      for (JointSample& sample : turn) all.push_back(&sample);
    if (end == TurnEnd::First) std::reverse(all.begin(), all.end());
    for (std::size_t i = 0; i + 1 < all.size(); ++i) all[i]->points = all[i + 1]->points;
    const std::optional<ShiftedRows> found = identified(w).findings.shifted_rows;
    REQUIRE(found);
    CHECK(found->end == end);
    CHECK(found->joints.size() >= 4);
  }
}

TEST_CASE("lengths in millimetres, or in a unit a thousand times greater, are found with their size") {
  Random random(5);
  ArmTurns w = make_arm_turns(random);
  const double length = 0.18 + 0.6 + 0.12 + 0.62;  // at least; the first row's b lies anywhere
  scale(w, Eigen::Vector3d::Constant(1e3));
  const std::optional<ImplausibleLength> longer = identified(w, std::nullopt).findings.implausible_length;
  REQUIRE(longer);
  CHECK(longer->too_long);
  CHECK(longer->length > 1e3 * length);
  scale(w, Eigen::Vector3d::Constant(1e-6));
  const std::optional<ImplausibleLength> shorter = identified(w, std::nullopt).findings.implausible_length;
  REQUIRE(shorter);
  CHECK_FALSE(shorter->too_long);
  CHECK(shorter->length < 1e-2);
}

TEST_CASE("mirrored and scaled measurements, and an arm of another number of joints, contradict the nominal arm") {
  Random random(6);
  const ArmTurns sound = make_arm_turns(random, {.sigma = 1e-5});
  CHECK_FALSE(identified(sound).findings.nominal_mismatch);
  ArmTurns mirrored = sound, scaled = sound;
  scale(mirrored, Eigen::Vector3d(-1, 1, 1));
  const std::optional<NominalMismatch> mirror = identified(mirrored).findings.nominal_mismatch;
  REQUIRE(mirror);
  CHECK(mirror->kind == NominalMismatchKind::Mirrored);
  CHECK(mirror->scale == Approx(-1).epsilon(1e-3));
  CHECK_FALSE(identified(mirrored, std::nullopt).findings.nominal_mismatch);
  scale(scaled, Eigen::Vector3d::Constant(1.05));
  const std::optional<NominalMismatch> factor = identified(scaled).findings.nominal_mismatch;
  REQUIRE(factor);
  CHECK(factor->kind == NominalMismatchKind::Scaled);
  CHECK(factor->scale == Approx(1.05).epsilon(1e-3));
  CHECK(factor->residual < 1e-3);
  kinematics::DhChain shorter = nominal();
  shorter.joints.pop_back();
  const std::optional<NominalMismatch> count = identified(sound, shorter).findings.nominal_mismatch;
  REQUIRE(count);
  CHECK(count->kind == NominalMismatchKind::JointCount);
  CHECK(count->nominal_joints == 5);
}

TEST_CASE("a real arm that differs from the nominal one in some lengths is no scaled one") {
  Random random(7);
  kinematics::DhChain other = nominal();
  other.joints[0].a *= 1.2, other.joints[3].b *= 0.95;
  CHECK_FALSE(identified(make_arm_turns(random, {.sigma = 1e-5}), other).findings.nominal_mismatch);
}

TEST_CASE("turns, axes and joints of different numbers, and limits that are none, are refused") {
  Random random(8);
  const ArmTurns w = make_arm_turns(random);
  const ArmAxesResult r = identified(w);
  CHECK_THROWS_WITH(find_in_turns(std::span(w.turns).first(5), r.axes, r.arm, w.home), Contains("of one number"));
  CHECK_THROWS_WITH(find_in_turns(w.turns, r.axes, r.arm, w.home.head(5)), Contains("of one number"));
  const auto with = [&](const TurnFindingOptions& o) { find_in_turns(w.turns, r.axes, r.arm, w.home, nullptr, o); };
  CHECK_THROWS_WITH(with({.min_noise_ratio = 1}), Contains("min_noise_ratio"));
  CHECK_THROWS_WITH(with({.min_jump = -1}), Contains("min_jump"));
  CHECK_THROWS_WITH(with({.min_length = 30}), Contains("min_length"));
  CHECK_THROWS_WITH(with({.max_scale_difference = 0}), Contains("max_scale_difference"));
}

}  // namespace turn_findings_test
