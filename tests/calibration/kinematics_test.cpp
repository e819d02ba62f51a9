#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/calibration/kinematics.hpp>
#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <support/coverage.hpp>
#include <support/rates.hpp>
#include <support/trials.hpp>

using namespace kr5;
using namespace kr5::calibration;
using Catch::Matchers::Contains;

namespace {

kinematics::DhChain nominal_arm() {
  return cell::nominal_chain(cell::load_cell(std::string(KR5_SHARE_DIR) + "/cells/kr5_arc.yaml"));
}

struct ArmWorldOptions {
  unsigned seed = 1;
  int postures = 60;
  double length = 1e-3, angle = 2e-3, joint = 0.0;  // spread of the true arm about the nominal one
  double sigma = 5e-5, sigma_rotation = 1e-4;
  bool poses = false;  // else one point a posture
  int sockets = 0;     // else measured from outside
};

/// The true arm and what a device sees of it.
struct ArmWorld {
  kinematics::DhChain nominal, arm;
  Eigen::MatrixXd joint_errors;
  Pose T_world_base = Pose::Identity(), T_flange_tool = Pose::Identity();
  Eigen::Vector3d tip;
  std::vector<ArmPosture> postures;

  Pose flange(const Eigen::VectorXd& q) const {
    Eigen::VectorXd there = q;
    for (Eigen::Index i = 0; i < q.size(); ++i)
      there[i] += joint_errors.row(i).dot(
          Eigen::RowVector4d(std::sin(q[i]), std::cos(q[i]) - 1, std::sin(2 * q[i]), std::cos(2 * q[i]) - 1));
    return arm.flange(there);
  }
};

Eigen::VectorXd random_posture(Random& random) {
  Eigen::VectorXd q(6);
  const double range[] = {2.0, 0.8, 1.0, 2.5, 1.8, 3.0};
  for (int i = 0; i < 6; ++i) q[i] = random.uniform(-range[i], range[i]);
  return q;
}

ArmWorld make_arm_world(const ArmWorldOptions& o) {
  Random random(o.seed);
  ArmWorld w;
  w.nominal = w.arm = nominal_arm();
  for (std::size_t i = 0; i < w.arm.joints.size(); ++i) {
    auto& joint = w.arm.joints[i];
    joint.b += random.normal(o.length), joint.a += random.normal(o.length);
    joint.theta_offset += random.normal(o.angle), joint.alpha += random.normal(o.angle);
    if (std::abs(std::sin(joint.alpha)) < 0.1 && i + 1 < 6) joint.beta += random.normal(o.angle);
  }
  w.joint_errors = Eigen::MatrixXd::Zero(6, 4);
  for (Eigen::Index i = 0; i < 6; ++i) w.joint_errors.row(i) = random.normal_vector(4, o.joint).transpose();
  Vector6 at;
  at << random.normal_vector(3, 2.0), random.normal_vector(3, 1.0);
  w.T_world_base = to_pose(at);
  at << random.normal_vector(3, 0.05), random.normal_vector(3, 1.0);
  w.T_flange_tool = to_pose(at);
  w.tip = Eigen::Vector3d(0.1, -0.05, 0.15);
  for (int i = 0; i < o.postures; ++i) {
    ArmPosture& p = w.postures.emplace_back();
    p.name = "p" + std::to_string(i);
    p.q = random_posture(random);
    const Pose T = w.T_world_base * w.flange(p.q);
    if (o.poses) {
      Vector6 noise;
      noise << random.normal_vector(3, o.sigma), random.normal_vector(3, o.sigma_rotation);
      p.T_world_tool = T * w.T_flange_tool * to_pose(noise);
    } else {
      p.points = T * w.tip + random.normal_vector(3, o.sigma);
    }
  }
  return w;
}

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
  const Eigen::Vector3d sockets[] = {{0.8, 0.1, 0.4}, {0.85, 0.1, 0.4}};
  std::vector<ArmPosture> postures;
  // Postures that put the tip into a socket, by a few Newton steps from random ones.
  while (postures.size() < 120) {
    ArmPosture p;
    p.socket = postures.size() % 2 ? "right" : "left";
    p.q = random_posture(random);
    for (int step = 0; step < 50; ++step) {
      const Pose T = w.flange(p.q);
      const Eigen::Vector3d off = sockets[postures.size() % 2] - T * w.tip;
      Eigen::MatrixXd J(3, 6);
      for (int k = 0; k < 6; ++k) {
        Eigen::VectorXd moved = p.q;
        moved[k] += 1e-7;
        J.col(k) = (w.flange(moved) * w.tip - T * w.tip) / 1e-7;
      }
      p.q += J.transpose() * (J * J.transpose() + 1e-9 * Eigen::Matrix3d::Identity()).ldlt().solve(off);
    }
    if ((w.flange(p.q) * w.tip - sockets[postures.size() % 2]).norm() > 1e-9 || p.q.cwiseAbs().maxCoeff() > 3.2)
      continue;
    p.q += random.normal_vector(6, 2e-5);
    postures.push_back(p);
  }
  const SocketDistance apart{.first = "left", .second = "right", .distance = 0.05};
  const KinematicsResult r = calibrate_kinematics(w.nominal, postures, std::span(&apart, 1));
  CHECK(r.fit.usable());
  CHECK((r.sockets.col(0) - r.sockets.col(1)).norm() == Approx(0.05).margin(3e-5));
  double spread = 0.0, nominal = 0.0;
  for (const auto& p : r.postures) spread += p.position_error / 120, nominal += p.nominal_error / 120;
  CHECK(spread < 1e-4);
  CHECK(nominal > 10 * spread);
  CHECK_FALSE(r.unidentifiable.empty());  // the arm as a whole may turn about axis 1
}

TEST_CASE("standard deviations of the identified parameters are as large as their errors", "[statistics]") {
  const int trials = test::trials(300, 30);
  int inside = 0, all = 0;
  for (int trial = 0; trial < trials; ++trial) {
    const ArmWorld w = make_arm_world({.seed = 100u + static_cast<unsigned>(trial), .poses = true});
    const KinematicsResult r = calibrate_kinematics(w.nominal, w.postures, {}, {.joint_errors = false});
    for (const EstimatedParameter& c : r.coordinates) {
      const auto joint = [&](const kinematics::DhChain& arm) -> const kinematics::DhJoint& {
        return arm.joints[static_cast<std::size_t>(c.name[9] - '1')];
      };
      if (!c.name.starts_with("arm.joint")) continue;
      const std::string parameter = c.name.substr(11);
      const double truth = parameter == "b"              ? joint(w.arm).b
                           : parameter == "theta_offset" ? joint(w.arm).theta_offset
                           : parameter == "a"            ? joint(w.arm).a
                           : parameter == "alpha"        ? joint(w.arm).alpha
                                                         : joint(w.arm).beta;
      inside += std::abs(c.value - truth) < 1.96 * c.std;
      ++all;
    }
  }
  CAPTURE(inside, all);
  // Parameters of one arm are correlated: the interval is that of a fifth as many independent ones.
  const auto rate = uncertainty::binomial_interval(inside / 5, all / 5, 0.99);
  CHECK(rate.low < 0.95);
  CHECK(rate.high > 0.95);
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
