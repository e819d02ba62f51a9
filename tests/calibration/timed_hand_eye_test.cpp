#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>

#include <catch2/catch.hpp>

#include <kr5/calibration/timed_hand_eye.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/io/csv.hpp>
#include <kr5/uncertainty/confidence.hpp>
#include <support/coverage.hpp>
#include <support/reference.hpp>
#include <support/trials.hpp>

namespace timed_hand_eye_test {

using namespace kr5;
using namespace kr5::calibration;

namespace {

/// A smooth motion of the hand, the same for every seed but for its phases.
struct Motion {
  Eigen::Matrix<double, 6, 3> amplitude, frequency, phase;
  explicit Motion(Random& random, const Vector6& scale) {
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 3; ++j) {
        amplitude(i, j) = scale[i] * random.uniform(0.5, 1);
        frequency(i, j) = random.uniform(0.5, 4);
        phase(i, j) = random.uniform(0, 6.28);
      }
  }
  Pose at(double t) const {
    return to_pose((amplitude.array() * (frequency.array() * t + phase.array()).sin()).rowwise().sum().matrix());
  }
};

struct World {
  Pose X, Z;
  double offset = 0;
  PoseStream hand, camera;
};

Vector6 scale(double rx, double ry, double rz) { return (Vector6() << 0.2, 0.2, 0.2, rx, ry, rz).finished(); }

/// Forty seconds at 100 and 30 Hz; the camera's errors last for `memory` seconds.
World world(Random& random, double sigma_position, double sigma_rotation, double memory = 0.0,
            const Vector6& turn = scale(0.3, 0.3, 0.3)) {
  World w{to_pose(random.normal_vector(6, 0.3)), to_pose(random.normal_vector(6)), random.uniform(-0.5, 0.5), {}, {}};
  const Motion motion(random, turn);
  for (double t = 1000; t < 1040; t += 0.01) {
    w.hand.t.push_back(t);
    w.hand.poses.push_back(motion.at(t));
  }
  const double keep = memory > 0 ? std::exp(-1 / (30 * memory)) : 0.0;
  Vector6 error = Vector6::Zero();
  for (double t = 1000.7; t < 1039; t += 1 / 30.0) {
    Vector6 fresh;
    fresh << random.normal_vector(3, sigma_position), random.normal_vector(3, sigma_rotation);
    error = keep * error + std::sqrt(1 - keep * keep) * fresh;
    w.camera.t.push_back(t + w.offset);
    w.camera.poses.push_back(w.Z.inverse() * motion.at(t) * w.X * to_pose(error));
  }
  return w;
}

PoseStream load(const std::string& name) {
  const io::Table table = io::load_csv(test::reference("data/handeye_asl_timed/" + name + ".csv"));
  PoseStream stream;
  for (Eigen::Index i = 0; i < table.values.rows(); ++i) {
    const auto row = table.values.row(i);
    Pose T = Pose::Identity();
    T.translation() = row.segment<3>(1).transpose();
    T.linear() = Eigen::Quaterniond(row[7], row[4], row[5], row[6]).normalized().toRotationMatrix();
    stream.t.push_back(row[0]);
    stream.poses.push_back(T);
  }
  return stream;
}

/// Poses in alternate blocks of two seconds.
PoseStream blocks(const PoseStream& stream, int which) {
  PoseStream out;
  for (std::size_t i = 0; i < stream.t.size(); ++i)
    if (static_cast<int>((stream.t[i] - stream.t[0]) / 2) % 2 == which) {
      out.t.push_back(stream.t[i]);
      out.poses.push_back(stream.poses[i]);
    }
  return out;
}

}  // namespace

TEST_CASE("exact streams give offset, camera and world back") {
  Random random(1);
  for (int i = 0; i < 5; ++i) {
    const World w = world(random, 0, 0);
    const auto result = calibrate_timed_hand_eye(w.hand, w.camera);
    CAPTURE(result.fit.message, w.offset, result.offset);
    REQUIRE(result.fit.usable());
    CHECK(std::abs(result.offset - w.offset) < 1e-5);
    CHECK(pose_difference(w.X, result.T_hand_camera).norm() < 1e-4);
    CHECK(pose_difference(w.Z, result.T_base_world).norm() < 1e-4);
    CHECK(result.spread_median < 1e-4);
  }
}

TEST_CASE("the 95 % intervals hold the truth, for errors that last as well", "[coverage][statistics][not_sanitized]") {
  const int trials = test::trials(2000, 150);
  for (const double memory : {0.0, 0.5}) {
    Random random(2);
    const std::string what = memory > 0 ? ", errors that last" : "";
    test::Coverage offsets("clock offset" + what, 1), cameras("camera on the hand by two clocks" + what, 6),
        worlds("world in the base by two clocks" + what, 6);
    for (int i = 0; i < trials; ++i) {
      const World w = world(random, 2e-3, 3e-3, memory);
      const auto result = calibrate_timed_hand_eye(w.hand, w.camera);
      REQUIRE(result.fit.usable());
      const double dof = result.covariance_dof, span = w.camera.t.back() - w.camera.t.front();
      offsets.add(Eigen::VectorXd::Constant(1, result.offset - w.offset),
                  Eigen::MatrixXd::Constant(1, 1, std::pow(result.offset_std, 2)), span / result.correlation_time - 1);
      cameras.add(pose_difference(w.X, result.T_hand_camera), result.covariance, dof);
      worlds.add(pose_difference(w.Z, result.T_base_world), result.covariance_world, dof);
    }
    for (const test::Coverage* c : {&offsets, &cameras, &worlds}) {
      CAPTURE(memory, c->inside(), trials);
      c->check_mean();
      c->check_rate();
    }
  }
}

TEST_CASE("outliers hardly move the offset") {
  Random random(3);
  World w = world(random, 1e-3, 2e-3);
  for (std::size_t i = 0; i < w.camera.poses.size(); i += 12)
    w.camera.poses[i] = w.camera.poses[i] * to_pose(random.normal_vector(6, 0.3));
  const auto result = calibrate_timed_hand_eye(w.hand, w.camera);
  REQUIRE(result.fit.usable());
  CHECK(std::abs(result.offset - w.offset) < 1e-3);
  CHECK(result.outliers >= static_cast<int>(w.camera.poses.size() / 15));
}

TEST_CASE("camera poses beyond the ends and in gaps of the hand stream are left out, whatever the offset") {
  Random random(19);
  World w = world(random, 0, 0);
  PoseStream hand;
  for (std::size_t k = 0; k < w.hand.t.size(); ++k) {
    const double t = w.hand.t[k];
    if (t < 1003 || t > 1036 || (t > 1010 && t < 1011) || (t > 1020 && t < 1020.3)) continue;
    hand.t.push_back(t);
    hand.poses.push_back(w.hand.poses[k]);
  }
  const TimedHandEyeResult r = calibrate_timed_hand_eye(hand, w.camera);
  REQUIRE(r.fit.status == FitStatus::Converged);
  CHECK(std::abs(r.offset - w.offset) < 1e-5);
  CHECK(pose_difference(r.T_hand_camera, w.X).norm() < 1e-4);
  int covered = 0;
  for (const double camera : w.camera.t) {
    const double t = camera - r.offset;
    const auto after = std::upper_bound(hand.t.begin(), hand.t.end(), t);
    if (after != hand.t.begin() && after != hand.t.end()) covered += *after - *(after - 1) < 0.15;
  }
  CHECK(r.used == covered);
}

TEST_CASE("unsorted and repeated time stamps change nothing") {
  Random random(4);
  const World w = world(random, 1e-3, 1e-3);
  World shuffled = w;
  std::reverse(shuffled.hand.t.begin(), shuffled.hand.t.end());
  std::reverse(shuffled.hand.poses.begin(), shuffled.hand.poses.end());
  shuffled.camera.t.push_back(shuffled.camera.t.back());
  shuffled.camera.poses.push_back(Pose::Identity());
  CHECK(calibrate_timed_hand_eye(w.hand, w.camera).offset ==
        Approx(calibrate_timed_hand_eye(shuffled.hand, shuffled.camera).offset).margin(1e-12));
}

TEST_CASE("streams that do not suffice are told apart by cause") {
  Random random(5);
  World w = world(random, 1e-3, 1e-3);
  const auto cause = [](const World& world) {
    const auto result = calibrate_timed_hand_eye(world.hand, world.camera);
    CHECK_FALSE(result.fit.usable());
    CHECK(result.fit.message.size() > 20);
    return result.cause;
  };
  World other = w;
  for (double& t : other.camera.t) t += 500;
  CHECK(cause(other) == "no_overlap");
  other = w;
  other.camera.t.resize(60), other.camera.poses.resize(60);
  CHECK(cause(other) == "too_short");
  other = w;
  other.camera = world(random, 1e-3, 1e-3).camera;
  CHECK(cause(other) == "no_correlation");
  CHECK(cause(world(random, 1e-3, 1e-3, 0, scale(0.3, 0, 0))) == "one_axis");
  CHECK(cause(world(random, 1e-3, 1e-3, 0, scale(0, 0, 0))) == "no_motion");
}

TEST_CASE("wrong quaternion order and inverted poses are named") {
  Random random(6);
  for (int trial = 0; trial < 5; ++trial) {
    const World w = world(random, 2e-3, 3e-3);
    const auto misread = [](PoseStream s) {
      for (Pose& T : s.poses) {
        const Eigen::Quaterniond q(T.linear());  // written x y z w, read as w x y z
        T.linear() = Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).toRotationMatrix();
      }
      return s;
    };
    const auto invert = [](PoseStream s) {
      for (Pose& T : s.poses) T = T.inverse();
      return s;
    };
    CHECK(calibrate_timed_hand_eye(misread(w.hand), w.camera).cause == "quaternion_order_hand");
    CHECK(calibrate_timed_hand_eye(w.hand, misread(w.camera)).cause == "quaternion_order_camera");
    CHECK(calibrate_timed_hand_eye(misread(w.hand), misread(w.camera)).cause == "quaternion_order_both");
    CHECK(calibrate_timed_hand_eye(invert(w.hand), w.camera).cause == "inverted");
    CHECK(calibrate_timed_hand_eye(w.hand, invert(w.camera)).cause == "inverted");
  }
}

TEST_CASE("broken streams and options are refused by name") {
  Random random(7);
  World w = world(random, 0, 0);
  w.camera.t.pop_back();
  CHECK_THROWS_WITH(calibrate_timed_hand_eye(w.hand, w.camera), Catch::Contains("camera"));
  w.hand.t[3] = std::nan("");
  CHECK_THROWS_WITH(calibrate_timed_hand_eye(w.hand, w.camera), Catch::Contains("hand: pose 4"));
  TimedHandEyeOptions options;
  options.max_offset = -1;
  CHECK_THROWS_WITH(options.validate(), Catch::Contains("max_offset"));
}

TEST_CASE("shifts injected into real recordings are recovered within 1 ms, with less spread than the published check",
          "[not_sanitized]") {
  for (const auto& [name, hand_name] :
       {std::pair<std::string, std::string>{"robot_arm_real", "hand"}, {"prime_sense_2", "vicon"}}) {
    const PoseStream hand = load(name + "_" + hand_name), camera = load(name + "_camera");
    const auto plain = calibrate_timed_hand_eye(hand, camera);
    REQUIRE(plain.fit.status == FitStatus::Converged);
    Random random(8);
    for (int i = 0; i < 5; ++i) {
      const double shift = random.uniform(-0.5, 0.5);
      PoseStream shifted = camera;
      for (double& t : shifted.t) t += shift;
      const auto result = calibrate_timed_hand_eye(hand, shifted);
      CAPTURE(name, shift, result.offset, plain.offset);
      CHECK(std::abs(result.offset - plain.offset - shift) < 1e-3);
    }
    if (name != "robot_arm_real") continue;
    CHECK(plain.spread_median < 3.1e-3);
    const auto fit = calibrate_timed_hand_eye(hand, blocks(camera, 0));
    CHECK(position_spread(world_in_base(hand, blocks(camera, 1), fit)).first < 3.1e-3);
  }
}

TEST_CASE("times of another unit, or one of another clock, are refused before anything is resampled") {
  PoseStream stream;
  for (int i = 0; i < 50; ++i) {
    stream.t.push_back(0.1 * i);
    stream.poses.push_back(to_pose((Vector6() << 0.01 * i, 0, 0, 0.02 * i, 0, 0).finished()));
  }
  PoseStream lone = stream, nanoseconds = stream;
  lone.t[0] = -1.7e9;  // one stamp 0 among stamps of an epoch
  for (double& t : nanoseconds.t) t *= 1e9;
  CHECK_THROWS_WITH(calibrate_timed_hand_eye(lone, stream), Catch::Contains("hand: the times span"));
  CHECK_THROWS_WITH(calibrate_timed_hand_eye(stream, nanoseconds), Catch::Contains("camera: the times span"));
}

}  // namespace timed_hand_eye_test
