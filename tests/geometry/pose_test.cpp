#include <numbers>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>

using namespace kr5;

TEST_CASE("rotation vector survives the round trip at any angle") {
  Random random(1);
  for (const double angle : {0.0, 1e-13, 1e-9, 1e-5, 0.3, 2.0, 3.1, std::numbers::pi - 1e-7, std::numbers::pi})
    for (int i = 0; i < 20; ++i) {
      const Eigen::Vector3d w = angle * random.direction();
      const Eigen::Matrix3d R = exp_rotation(w);
      CAPTURE(angle, w.transpose());
      CHECK(is_rotation(R, 1e-12));
      CHECK((exp_rotation(log_rotation(R)) - R).norm() < 1e-12);
      if (angle < 3.1) CHECK((log_rotation(R) - w).norm() <= 1e-13 + 1e-9 * angle);
    }
}

TEST_CASE("roll pitch yaw means Rz Ry Rx, and survives the poles") {
  Vector6 v;
  v << 1, 2, 3, 0.4, -0.5, 0.6;
  const Pose T = from_xyzrpy(v);
  const Eigen::Matrix3d R = Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
                            Eigen::AngleAxisd(-0.5, Eigen::Vector3d::UnitY()).toRotationMatrix() *
                            Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitX()).toRotationMatrix();
  CHECK((T.linear() - R).norm() < 1e-14);
  CHECK((to_xyzrpy(T) - v).norm() < 1e-14);
  for (const double pitch : {std::numbers::pi / 2, -std::numbers::pi / 2}) {
    v << 0, 0, 0, 0.3, pitch, -1.1;
    CHECK((from_xyzrpy(to_xyzrpy(from_xyzrpy(v))).matrix() - from_xyzrpy(v).matrix()).norm() < 1e-9);
  }
}

TEST_CASE("adjoint moves a small perturbation across a pose") {
  Random random(2);
  for (int i = 0; i < 20; ++i) {
    const Pose T = to_pose(random.normal_vector(6));
    const Vector6 d = random.normal_vector(6, 1e-6);
    const Pose left = T * to_pose(d), right = to_pose(adjoint(T) * d) * T;
    CHECK((left.matrix() - right.matrix()).norm() < 1e-10);
  }
}

TEST_CASE("nearest rotation is proper even for a mirror") {
  const Eigen::Matrix3d mirror = Eigen::Vector3d(1, 1, -1).asDiagonal();
  CHECK(is_rotation(nearest_rotation(mirror)));
  CHECK_FALSE(is_rotation(mirror));
  CHECK_FALSE(is_rotation(Eigen::Matrix3d::Constant(std::nan(""))));
}

TEST_CASE("mean of scattered poses is their centre") {
  Random random(3);
  const Pose centre = to_pose(random.normal_vector(6));
  std::vector<Pose> poses;
  for (int i = 0; i < 400; ++i) {
    const Vector6 d = random.normal_vector(6, 0.01);
    poses.push_back(centre * to_pose(d));
    poses.push_back(centre * to_pose(d).inverse());
  }
  CHECK(pose_difference(centre, mean_pose(poses)).norm() < 1e-4);
  CHECK_THROWS_AS(mean_pose({}), InvalidArgument);
}
