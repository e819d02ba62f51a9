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

/// Gives the joints of an arm compliances and its postures torques, and measures them again.
void load(ArmWorld& w, const Eigen::VectorXd& compliances, unsigned seed) {
  Random random(seed);
  const Eigen::VectorXd most = (Eigen::VectorXd(6) << 10, 400, 200, 5, 20, 1).finished();
  for (ArmPosture& p : w.postures) {
    p.torques = random.normal_vector(6, 1.0).cwiseProduct(most);
    const Pose T = w.T_world_base * w.flange(p.q - compliances.cwiseProduct(p.torques));
    Vector6 noise;
    noise << random.normal_vector(3, 5e-5), random.normal_vector(3, 1e-4);
    if (p.T_world_tool)
      p.T_world_tool = T * w.T_flange_tool * to_pose(noise);
    else
      p.points = T * w.tip + noise.head<3>();
  }
}

}  // namespace

TEST_CASE("an identified arm predicts postures left out to the noise, the nominal arm to its errors") {
  for (unsigned seed = 1; seed <= 4; ++seed) {
    ArmWorld w = make_arm_world({.seed = seed, .postures = 80, .poses = seed % 2 == 0});
    const std::vector<ArmPosture> further = taken_out(w, 20);
    const KinematicsResult result = calibrate_kinematics(w.nominal, w.postures);
    const FurtherPostures found = evaluate_arm(result, w.nominal, w.postures, further);
    CHECK(found.fit.usable());
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
  CHECK(found.fit.usable());
  CHECK(found.placed);
  CHECK(found.mean < 0.2 * found.nominal_mean);
  CHECK_THROWS_WITH(evaluate_arm(result, w.nominal, w.postures, std::span(points.postures).first(5)),
                    Contains("found 5 postures, expected at least 6"));
}

TEST_CASE("further postures that do not place a device give no errors, with the reason") {
  const ArmWorld w = make_arm_world({.seed = 3, .poses = true});
  ArmWorld points = make_arm_world({.seed = 3, .postures = 20});
  Random random(4);
  for (ArmPosture& p : points.postures) {  // joint 1 alone moves
    p.q.tail(5).setZero();
    p.points = w.T_world_base * w.flange(p.q) * w.tip + random.normal_vector(3, 5e-5);
  }
  const KinematicsResult result = calibrate_kinematics(w.nominal, w.postures);
  const FurtherPostures found = evaluate_arm(result, w.nominal, w.postures, points.postures);
  CHECK(found.placed);
  CHECK(found.fit.status == FitStatus::Degenerate);
  CHECK_THAT(found.fit.message, Contains("the identified arm cannot be placed: ") && Contains("determine"));
  CHECK(found.errors.empty());
  CHECK(found.nominal_errors.empty());
  CHECK(found.mean == 0.0);
}

TEST_CASE("parameters that the fit held do not matter to the nominal arm") {
  ArmWorld w = make_arm_world({.seed = 5, .postures = 80, .length = 0.0});
  const std::vector<ArmPosture> further = taken_out(w, 20);
  const KinematicsOptions hold{.hold = {"arm.joint3.a", "joint_errors"}};
  const KinematicsResult held = calibrate_kinematics(w.nominal, w.postures, {}, hold);
  const FurtherPostures found = evaluate_arm(held, w.nominal, w.postures, further, {}, hold),
                        free =
                            evaluate_arm(calibrate_kinematics(w.nominal, w.postures), w.nominal, w.postures, further);
  REQUIRE(found.fit.usable());
  CHECK(found.mean < 3e-4);
  CHECK(found.nominal_mean > 3 * found.mean);
  CHECK(found.nominal_mean == Approx(free.nominal_mean).epsilon(0.02));
}

TEST_CASE("the nominal arm is placed without postures that contradict the others") {
  ArmWorld w = make_arm_world({.seed = 6, .postures = 80});
  const std::vector<ArmPosture> further = taken_out(w, 20);
  ArmWorld without = w;
  without.postures.erase(without.postures.begin() + 5);
  w.postures[5].points.col(0) += Eigen::Vector3d(0.5, -0.3, 0.2);
  const KinematicsResult result = calibrate_kinematics(w.nominal, w.postures),
                         sound = calibrate_kinematics(w.nominal, without.postures);
  REQUIRE(result.postures[5].outlier);
  const FurtherPostures found = evaluate_arm(result, w.nominal, w.postures, further),
                        expected = evaluate_arm(sound, w.nominal, without.postures, further);
  REQUIRE(found.nominal_errors.size() == 20);
  for (std::size_t i = 0; i < 20; ++i)
    CHECK(found.nominal_errors[i] == Approx(expected.nominal_errors[i]).margin(1e-5));
}

TEST_CASE("errors of the joints and compliances count where a device is placed on further postures") {
  const Eigen::VectorXd compliances = (Eigen::VectorXd(6) << 0, 4e-6, 6e-6, 0, 3e-5, 0).finished();
  ArmWorld w = make_arm_world({.seed = 7, .postures = 150, .joint = 4e-4, .poses = true}),
           points = make_arm_world({.seed = 7, .postures = 40, .joint = 4e-4});
  load(w, compliances, 8), load(points, compliances, 9);
  const KinematicsOptions elastic{.elasticity = true};
  const KinematicsResult result = calibrate_kinematics(w.nominal, w.postures, {}, elastic);
  const auto mean_of = [&](const KinematicsResult& r) {
    const FurtherPostures found = evaluate_arm(r, w.nominal, w.postures, points.postures, {}, elastic);
    REQUIRE(found.fit.usable());
    CHECK(found.placed);
    CHECK(found.mean < found.nominal_mean);
    return found.mean;
  };
  const double mean = mean_of(result);
  CHECK(mean < 5e-4);
  KinematicsResult straight = result, rigid = result;
  straight.joint_errors.resize(0, 0), rigid.compliances.resize(0);
  CHECK(mean_of(straight) > 1.5 * mean);
  CHECK(mean_of(rigid) > 1.5 * mean);
}

TEST_CASE("sockets of a known distance among the fitted postures place the nominal arm, too") {
  ArmWorld w = make_arm_world({.seed = 3});
  const std::vector<ArmPosture> further = taken_out(w, 20);
  Random random(13);
  for (const ArmPosture& p : socket_postures(w, 40, random)) w.postures.push_back(p);
  const SocketDistance apart{.first = "left", .second = "right", .distance = socket_distance};
  const KinematicsResult result = calibrate_kinematics(w.nominal, w.postures, std::span(&apart, 1));
  const FurtherPostures found = evaluate_arm(result, w.nominal, w.postures, further, std::span(&apart, 1));
  REQUIRE(found.fit.usable());
  CHECK_FALSE(found.placed);
  CHECK(found.mean < 3e-4);
  CHECK(found.nominal_mean > 1e-3);
  const SocketDistance unknown{.first = "left", .second = "middle", .distance = socket_distance};
  CHECK_THROWS_WITH(evaluate_arm(result, w.nominal, w.postures, further, std::span(&unknown, 1)), Contains("'middle'"));
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
