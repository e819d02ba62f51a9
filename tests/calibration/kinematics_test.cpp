#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>

#include <catch2/catch.hpp>

#include <calibration/arm_world.hpp>
#include <kr5/calibration/kinematics.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

namespace kinematics_test {

using namespace kr5;
using namespace kr5::calibration;
using namespace kr5::test;
using Catch::Matchers::Contains;

namespace {

/// RMS error of the calibrated tip at postures that were not measured.
double tip_error(const ArmWorld& w, const KinematicsResult& r, unsigned seed = 99) {
  Random random(seed);
  double squares = 0.0;
  for (int i = 0; i < 100; ++i) {
    const Eigen::VectorXd q = random_posture(random);
    const Eigen::Vector3d truth = r.points.cols()
                                      ? Eigen::Vector3d(w.T_world_base * w.flange(q) * w.tip)
                                      : Eigen::Vector3d((w.T_world_base * w.flange(q) * w.T_flange_tool).translation());
    const Eigen::Vector3d found = r.points.cols()
                                      ? Eigen::Vector3d(r.T_world_base * r.flange(q) * r.points.col(0))
                                      : Eigen::Vector3d((r.T_world_base * r.flange(q) * r.T_flange_tool).translation());
    squares += (truth - found).squaredNorm();
  }
  return std::sqrt(squares / 100);
}

}  // namespace

TEST_CASE("exact points of an arm that is off by millimetres give its postures to a micrometre") {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const ArmWorld w = make_arm_world({.seed = seed, .sigma = 1e-9});
    const KinematicsResult r = calibrate_kinematics(w.nominal, w.postures, {}, {.joint_errors = false});
    CAPTURE(seed, r.fit.message);
    CHECK(r.fit.usable());
    CHECK(tip_error(w, r) < 1e-6);
    CHECK(r.sigma_position < 1e-6);
  }
}

TEST_CASE("an arm from 60 noisy points predicts postures that were not measured, from poses better") {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    CAPTURE(seed);
    const ArmWorld points = make_arm_world({.seed = seed}), poses = make_arm_world({.seed = seed, .poses = true});
    const KinematicsResult from_points = calibrate_kinematics(points.nominal, points.postures),
                           from_poses = calibrate_kinematics(poses.nominal, poses.postures);
    CHECK(tip_error(points, from_points) < 1e-4);  // noise 0.05 mm an axis, 30 parameters of 180 numbers
    CHECK(tip_error(poses, from_poses) < 1e-4);
    CHECK(from_points.sigma_position == Approx(5e-5).epsilon(0.25));
    CHECK(from_poses.sigma_rotation == Approx(1e-4).epsilon(0.25));
    CHECK(from_points.postures[3].nominal_error > 1e-3);
    for (const ArmPostureReport& p : from_points.postures) CHECK_FALSE(p.outlier);
  }
}

TEST_CASE("errors of the joints once and twice a turn are found where there are any, and else kept near zero") {
  const ArmWorld wavy = make_arm_world({.seed = 7, .postures = 150, .joint = 4e-4}),
                 plain = make_arm_world({.seed = 7, .postures = 150});
  const KinematicsResult without = calibrate_kinematics(wavy.nominal, wavy.postures, {}, {.joint_errors = false}),
                         with = calibrate_kinematics(wavy.nominal, wavy.postures),
                         needless = calibrate_kinematics(plain.nominal, plain.postures);
  CHECK(tip_error(wavy, with) < 0.35 * tip_error(wavy, without));
  CHECK(with.tolerance_joint == Approx(4e-4).epsilon(0.5));
  CHECK(needless.tolerance_joint < 5e-5);
  CHECK(tip_error(plain, needless) < 6e-5);
}

TEST_CASE("up to 20 % of wrong postures are named and do not spoil the arm") {
  Random random(11);
  int named = 0, wrong = 0, false_names = 0;
  for (unsigned seed = 1; seed <= 5; ++seed) {
    ArmWorld w = make_arm_world({.seed = seed});
    for (std::size_t i = 0; i < w.postures.size(); i += 5) w.postures[i].points.col(0) += 0.02 * random.direction();
    const KinematicsResult r = calibrate_kinematics(w.nominal, w.postures);
    CHECK(tip_error(w, r) < 1.2e-4);
    for (std::size_t i = 0; i < w.postures.size(); ++i)
      (i % 5 == 0 ? named : false_names) += r.postures[i].outlier, wrong += i % 5 == 0;
  }
  CHECK(named == wrong);
  CHECK(false_names <= 1);
}

TEST_CASE("a ball in two sockets of known distance calibrates an arm without a measuring device") {
  Random random(13);
  ArmWorld w = make_arm_world({.seed = 3, .postures = 0});
  const std::vector<ArmPosture> postures = socket_postures(w, 120, random);
  const SocketDistance apart{.first = "left", .second = "right", .distance = socket_distance};
  const KinematicsResult r = calibrate_kinematics(w.nominal, postures, std::span(&apart, 1));
  CHECK(r.fit.usable());
  CHECK((r.sockets.col(0) - r.sockets.col(1)).norm() == Approx(0.05).margin(3e-5));
  double spread = 0.0, nominal = 0.0;
  for (const auto& p : r.postures) spread += p.position_error / 120, nominal += p.nominal_error / 120;
  CHECK(spread < 1e-4);
  CHECK(nominal > 10 * spread);
  CHECK_FALSE(r.unidentifiable.empty());  // the arm as a whole may turn about axis 1
}

/// Value of a parameter of an arm by the name of its coordinate, such as arm.joint2.a.
double arm_parameter(const kinematics::DhChain& arm, const std::string& name) {
  const kinematics::DhJoint& joint = arm.joints[static_cast<std::size_t>(name[9] - '1')];
  const std::string parameter = name.substr(11);
  return parameter == "b"              ? joint.b
         : parameter == "theta_offset" ? joint.theta_offset
         : parameter == "a"            ? joint.a
         : parameter == "alpha"        ? joint.alpha
                                       : joint.beta;
}

/// Shares, trial by trial: those of one trial hang together.
struct TrialShares {
  double sum = 0.0, squares = 0.0, trials = 0.0;

  void add(double inside, double all) {
    if (all == 0) return;
    sum += inside / all, squares += inside * inside / (all * all), ++trials;
  }
  double mean() const { return sum / trials; }
  double standard_error() const { return std::sqrt((squares / trials - mean() * mean()) / trials); }
};

TEST_CASE("95 % intervals of the arm's parameters hold the truth, told by the data or by their spread",
          "[coverage][statistics]") {
  const int trials = test::trials(2000, 40);
  for (const bool poses : {false, true}) {
    TrialShares told, held;
    test::Coverage coverage(poses ? "parameter of an arm from poses" : "parameter of an arm from points", 1);
    for (int trial = 0; trial < trials; ++trial) {
      const ArmWorld w = make_arm_world({.seed = 100u + static_cast<unsigned>(trial), .postures = 40, .poses = poses});
      const KinematicsResult r = calibrate_kinematics(w.nominal, w.postures);
      REQUIRE(r.fit.usable());
      double inside[2] = {0, 0}, all[2] = {0, 0};
      std::vector<std::pair<double, double>> errors;
      for (const EstimatedParameter& c : r.coordinates) {
        if (!c.name.starts_with("arm.joint")) continue;
        errors.emplace_back(c.value - arm_parameter(w.arm, c.name), c.std);
        inside[c.identifiable] += std::abs(errors.back().first) < 1.96 * c.std;
        ++all[c.identifiable];
      }
      const auto [error, std] = errors[static_cast<std::size_t>(trial) % errors.size()];  // one a trial, in turn
      coverage.add(Eigen::VectorXd::Constant(1, error), Eigen::MatrixXd::Constant(1, 1, std * std));
      told.add(inside[1], all[1]), held.add(inside[0], all[0]);
    }
    coverage.check_rate();
    for (const TrialShares& shares : {told, held}) {
      CAPTURE(poses, shares.trials, shares.mean(), shares.standard_error());
      CHECK(shares.mean() - 3.3 * shares.standard_error() < 0.97);
      CHECK(shares.mean() + 3.3 * shares.standard_error() > 0.93);
      if (trials >= 1000) CHECK(std::abs(shares.mean() - 0.95) < 0.02);
    }
  }
}

TEST_CASE("postures too few to tell their noise from errors of the arm are refused, unless the noise is stated",
          "[not_sanitized]") {
  TrialShares stated;
  for (unsigned seed = 1; seed <= 6; ++seed)
    for (const int postures : {6, 8, 10}) {
      const ArmWorld w = make_arm_world({.seed = seed, .postures = postures});
      const KinematicsResult r = calibrate_kinematics(w.nominal, w.postures);
      CAPTURE(seed, postures, r.sigma_position);
      CHECK(r.fit.status == FitStatus::Degenerate);
      CHECK_THAT(r.fit.message, Contains("measure more postures, or state the noise, as sigma_position"));
      KinematicsOptions known;
      known.sigma_position = 5e-5, known.tolerance_length = 1e-3, known.tolerance_angle = 2e-3;
      known.joint_errors = false;
      const KinematicsResult s = calibrate_kinematics(w.nominal, w.postures, {}, known);
      CHECK(s.fit.usable());
      double inside = 0, all = 0;
      for (const EstimatedParameter& c : s.coordinates)
        if (c.name.starts_with("arm.joint"))
          inside += std::abs(c.value - arm_parameter(w.arm, c.name)) < 1.96 * c.std, ++all;
      stated.add(inside, all);
    }
  CAPTURE(stated.mean(), stated.standard_error());
  CHECK(stated.mean() + 3.3 * stated.standard_error() > 0.93);
}

TEST_CASE("a point that postures of one joint do not determine is no estimate") {
  ArmWorld w = make_arm_world({.seed = 5, .postures = 20});
  Random random(6);
  for (ArmPosture& p : w.postures) {
    p.q.tail(5).setZero();
    p.points = w.T_world_base * w.flange(p.q) * w.tip + random.normal_vector(3, 5e-5);
  }
  const KinematicsResult r = calibrate_kinematics(w.nominal, w.postures);
  CHECK(r.fit.status == FitStatus::Degenerate);
  CHECK_THAT(r.fit.message, Contains("neither the measurements nor the nominal arm determine"));
  const auto point = std::find_if(r.coordinates.begin(), r.coordinates.end(), [](const EstimatedParameter& c) {
    return c.name.find("point") != std::string::npos;
  });
  REQUIRE(point != r.coordinates.end());
  CHECK(std::isinf(point->std));
}

TEST_CASE("compliance of joints under gravity is found from postures with torques, within its uncertainty") {
  ArmWorld w = make_arm_world({.seed = 21, .postures = 80, .length = 0, .angle = 0, .poses = true});
  Random random(22);
  const Eigen::VectorXd truth = (Eigen::VectorXd(6) << 0, 4e-6, 6e-6, 0, 3e-5, 0).finished();
  for (ArmPosture& p : w.postures) {
    p.torques = random.normal_vector(6, 1.0).cwiseProduct(
        Eigen::VectorXd::Map(std::array{10., 400., 200., 5., 20., 1.}.data(), 6));
    Vector6 noise;
    noise << random.normal_vector(3, 5e-5), random.normal_vector(3, 1e-4);
    p.T_world_tool =
        w.T_world_base * w.arm.flange(p.q - truth.cwiseProduct(p.torques)) * w.T_flange_tool * to_pose(noise);
  }
  const KinematicsResult rigid = calibrate_kinematics(w.nominal, w.postures, {}, {.joint_errors = false});
  const KinematicsResult r =
      calibrate_kinematics(w.nominal, w.postures, {}, {.joint_errors = false, .elasticity = true});
  REQUIRE(r.compliances.size() == 6);
  CHECK(r.sigma_position < 7e-5);
  CHECK(rigid.sigma_position > 2 * r.sigma_position);
  int found = 0;
  for (const EstimatedParameter& c : r.coordinates) {
    const auto at = c.name.find(".compliance");
    if (at == std::string::npos) continue;
    const int joint = c.name[at - 1] - '1';
    CAPTURE(c.name, c.value, c.std);
    CHECK(c.unit == "rad/(N m)");
    CHECK(std::abs(c.value - truth[joint]) < 3.5 * c.std);
    ++found;
  }
  CHECK(found == 6);
  const ArmPosture& p = w.postures.front();
  CHECK((r.corrected(p.q, p.torques) - (p.q - r.compliances.cwiseProduct(p.torques))).norm() < 1e-15);
  CHECK_THROWS_WITH(r.flange(p.q), Contains("torques: found 0, expected one a joint: 6"));
  w.postures[3].torques.resize(0);
  CHECK_THROWS_WITH(calibrate_kinematics(w.nominal, w.postures, {}, {.elasticity = true}), Contains("posture 3"));
}

TEST_CASE("pixels of a fixed target make the arm better known than poses of the tool alone") {
  ArmWorld w = make_arm_world({.seed = 31, .postures = 40, .length = 5e-4, .angle = 0, .poses = true});
  Random random(32);
  Pinhole camera{.width = 2448, .height = 2050, .fx = 2330, .fy = 2330, .cx = 1224, .cy = 1025};
  const Pose T_flange_camera = to_pose((Vector6() << 0.05, 0.02, 0.1, 0.1, 0, 0.5).finished());
  Eigen::Matrix3Xd board(3, 24);
  for (int k = 0; k < 24; ++k) board.col(k) << 0.04 * (k % 6) - 0.1, 0.04 * (k / 6) - 0.06, 0.0;
  const Eigen::VectorXd home = (Eigen::VectorXd(6) << 0.1, 0.2, -0.4, 0.3, 0.8, -0.2).finished();
  const Pose T_base_target =
      w.arm.flange(home) * T_flange_camera * to_pose((Vector6() << 0, 0, 0.5, 0, 0, 0).finished());
  int seen = 0;
  for (int i = 0; seen < 12 && i < 1000; ++i) {
    ArmPosture p;
    p.name = "view" + std::to_string(i), p.q = home + random.normal_vector(6, 0.15);
    const Eigen::Matrix3Xd in_camera =
        (w.arm.flange(p.q) * T_flange_camera).inverse() * T_base_target * board.colwise().homogeneous();
    if (in_camera.row(2).minCoeff() < 0.2) continue;
    p.pixels.resize(2, 24);
    for (int k = 0; k < 24; ++k)
      p.pixels.col(k) = camera.project(Eigen::Vector3d(in_camera.col(k))) + random.normal_vector(2, 0.1);
    if (p.pixels.minCoeff() < 0 || p.pixels.row(0).maxCoeff() > 2448 || p.pixels.row(1).maxCoeff() > 2050) continue;
    p.target_points = board;
    w.postures.push_back(p), ++seen;
  }
  REQUIRE(seen == 12);
  KinematicsOptions options{.joint_errors = false, .T_world_base = w.T_world_base, .T_flange_tool = w.T_flange_tool};
  const KinematicsResult poses = calibrate_kinematics(w.nominal, std::span(w.postures).first(40), {}, options);
  CHECK_THROWS_WITH(calibrate_kinematics(w.nominal, w.postures, {}, options), Contains("need camera"));
  const Vector6 off = (Vector6() << 0.003, -0.002, 0.002, 0.01, 0.01, -0.01).finished();
  options.camera = camera, options.T_flange_camera = T_flange_camera * to_pose(off);
  options.T_base_target = T_base_target * to_pose(off);
  const KinematicsResult both = calibrate_kinematics(w.nominal, w.postures, {}, options);
  CAPTURE(both.fit.message, both.sigma_pixel);
  REQUIRE(both.fit.usable());
  CHECK(both.sigma_pixel == Approx(0.1).epsilon(0.15));
  CHECK((both.T_flange_camera.translation() - T_flange_camera.translation()).norm() < 3e-4);
  CHECK((both.T_base_target.translation() - T_base_target.translation()).norm() < 3e-4);
  CHECK(both.postures.back().pixel_error < 0.3);
  CHECK(both.postures.back().position_error == 0.0);
  double before = 0, after = 0;
  for (std::size_t k = 0; k < poses.coordinates.size() && k < both.coordinates.size(); ++k)
    if (poses.coordinates[k].name.rfind("arm.", 0) == 0 && poses.coordinates[k].identifiable) {
      REQUIRE(poses.coordinates[k].name == both.coordinates[k].name);
      before += std::pow(poses.coordinates[k].std, 2), after += std::pow(both.coordinates[k].std, 2);
    }
  CHECK(after < before);
}

TEST_CASE("a tool whose orientation is known and whose place is not is found apart from the last joint's zero") {
  ArmWorld w = make_arm_world({.seed = 41, .postures = 60, .length = 0, .angle = 0, .poses = true});
  const Pose believed = w.T_flange_tool;
  Random random(42);
  kinematics::DhChain arm = w.arm;
  arm.joints.back().theta_offset += 2.5e-3;
  const Eigen::Vector3d shift(1.5e-3, -4e-4, 4e-4);
  Pose tool = believed;
  tool.translation() += believed.linear() * shift;
  for (ArmPosture& p : w.postures) {
    Vector6 noise;
    noise << random.normal_vector(3, 5e-5), random.normal_vector(3, 8e-5);
    p.T_world_tool = w.T_world_base * arm.flange(p.q) * tool * to_pose(noise);
  }
  const KinematicsOptions options{
      .tolerance_tool = 5e-3, .joint_errors = false, .T_world_base = w.T_world_base, .T_flange_tool = believed};
  const KinematicsResult r = calibrate_kinematics(w.nominal, w.postures, {}, options);
  REQUIRE(r.fit.usable());
  CHECK(r.arm.joints.back().theta_offset - w.nominal.joints.back().theta_offset == Approx(2.5e-3).margin(8e-5));
  CHECK((believed.inverse() * r.T_flange_tool.translation() - shift).norm() < 5e-5);
  CHECK((r.T_flange_tool.linear() - believed.linear()).norm() < 1e-12);
  CHECK_THROWS_WITH(calibrate_kinematics(w.nominal, w.postures, {}, {.tolerance_tool = 1e-3}),
                    Contains("tolerance_tool"));
  // Whole poses and single coordinates of them may be held.
  const KinematicsResult held = calibrate_kinematics(
      w.nominal, w.postures, {}, {.joint_errors = false, .hold = {"base", "tool.rx", "arm.joint2.a"}});
  for (const EstimatedParameter& c : held.coordinates) {
    CHECK(c.name.rfind("base.", 0) != 0);
    CHECK(c.name != "tool.rx");
    CHECK(c.name != "arm.joint2.a");
  }
}

TEST_CASE("bad input of a kinematic calibration is refused with the posture's name") {
  ArmWorld w = make_arm_world({.postures = 8});
  const auto call = [&](const KinematicsOptions& options = {}) {
    calibrate_kinematics(w.nominal, w.postures, {}, options);
  };
  const std::vector<ArmPosture> good = w.postures;
  w.postures.resize(5);
  CHECK_THROWS_WITH(call(), Contains("at least six postures"));
  w.postures = good;
  w.postures[2].q.conservativeResize(5);
  CHECK_THROWS_WITH(call(), Contains("posture p2: found 5 joint values"));
  w.postures = good;
  w.postures[3].q[1] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(call(), Contains("posture p3: joint values must be finite"));
  w.postures = good;
  w.postures[4].points.setConstant(std::numeric_limits<double>::quiet_NaN());
  CHECK_THROWS_WITH(call(), Contains("posture p4: nothing was measured"));
  w.postures = good;
  CHECK_THROWS_WITH(call({.hold = {"arm.joint9.a"}}), Contains("arm.joint9.a"));
  CHECK_THROWS_WITH(call({.sigma_position = -1}), Contains("sigma_position"));
}

}  // namespace kinematics_test
