#include <limits>

#include <catch2/catch.hpp>

#include <calibration/arm_world.hpp>
#include <kr5/calibration/further_postures.hpp>
#include <kr5/core/error.hpp>

namespace further_postures_test {

using namespace kr5;
using namespace kr5::calibration;
using namespace kr5::test;
using Catch::Matchers::Contains;

namespace {

std::vector<ArmPosture> taken_out(ArmWorld& w, std::size_t count) {
  std::vector<ArmPosture> out(w.postures.end() - static_cast<std::ptrdiff_t>(count), w.postures.end());
  w.postures.resize(w.postures.size() - count);
  return out;
}

}  // namespace

TEST_CASE("an identified arm predicts postures left out to the noise, the nominal arm to its errors") {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    ArmWorld w = make_arm_world({.seed = seed, .postures = 80, .poses = seed % 2 == 0});
    const std::vector<ArmPosture> further = taken_out(w, 20);
    const KinematicsResult result = calibrate_kinematics(w.nominal, w.postures);
    const FurtherPostures found = evaluate_arm(result, w.nominal, w.postures, further);
    CHECK_FALSE(found.placed);
    REQUIRE(found.errors.size() == 20);
    REQUIRE(found.nominal_errors.size() == 20);
    CHECK(found.mean < 3e-4);
    CHECK(found.nominal_mean > 1e-3);
    const ArmPosture& p = further[7];
    const Pose T = result.T_world_base * result.flange(p.q);
    const double off = p.T_world_tool ? (T * result.T_flange_tool.translation() - p.T_world_tool->translation()).norm()
                                      : (T * Eigen::Vector3d(result.points.col(0)) - p.points.col(0)).norm();
    CHECK(found.errors[7] == Approx(off).epsilon(1e-12));
    CHECK(found.max >= found.rms);
    CHECK(found.rms >= found.mean);
  }
}

TEST_CASE("a device of which the fit says nothing is placed on the further postures") {
  ArmWorld w = make_arm_world({.seed = 1, .poses = true});
  const ArmWorld points = make_arm_world({.seed = 1});  // the same arm and device, one point a posture
  CHECK(need_placing(w.postures, points.postures));
  CHECK_FALSE(need_placing(w.postures, w.postures));
  CHECK_FALSE(need_placing(w.postures, {}));
  const KinematicsResult result = calibrate_kinematics(w.nominal, w.postures);
  const FurtherPostures found = evaluate_arm(result, w.nominal, w.postures, points.postures);
  CHECK(found.placed);
  CHECK(found.mean < 0.2 * found.nominal_mean);
  CHECK_THROWS_WITH(evaluate_arm(result, w.nominal, w.postures, std::span(points.postures).first(5)),
                    Contains("found 5 postures, expected at least 6"));
}

TEST_CASE(
    "points that were not seen do not count; a posture without any, none at all and an unusable fit are refused") {
  ArmWorld w = make_arm_world({.seed = 2});
  for (ArmPosture& p : w.postures) {
    Eigen::Matrix3Xd two(3, 2);
    two << p.points, p.points + 0.1 * (w.T_world_base * w.flange(p.q)).linear().col(0);
    p.points = two;
  }
  std::vector<ArmPosture> further = taken_out(w, 10);
  KinematicsResult result = calibrate_kinematics(w.nominal, w.postures);
  further[3].points(1, 0) = std::numeric_limits<double>::quiet_NaN();
  const FurtherPostures found = evaluate_arm(result, w.nominal, w.postures, further);
  CHECK(found.max < 5e-4);
  further[3].points.setConstant(std::numeric_limits<double>::quiet_NaN());
  CHECK_THROWS_WITH(evaluate_arm(result, w.nominal, w.postures, further), Contains("nothing was measured"));
  CHECK_THROWS_AS(evaluate_arm(result, w.nominal, w.postures, {}), InvalidArgument);
  further.pop_back(), further.erase(further.begin() + 3);
  CHECK_THROWS_WITH(evaluate_arm(result, w.nominal, std::span(w.postures).first(20), further), Contains("20 postures"));
  result.fit.status = FitStatus::Degenerate;
  CHECK_THROWS_AS(evaluate_arm(result, w.nominal, w.postures, further), InvalidArgument);
}

}  // namespace further_postures_test
