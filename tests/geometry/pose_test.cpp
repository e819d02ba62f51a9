#include <numbers>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/geometry/pose_derivatives.hpp>

namespace pose_test {

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
  for (const double off : {0.0, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2})
    for (const double pitch : {std::numbers::pi / 2 - off, -std::numbers::pi / 2 + off}) {
      v << 0, 0, 0, 0.3, pitch, -1.1;
      CHECK((from_xyzrpy(to_xyzrpy(from_xyzrpy(v))).matrix() - from_xyzrpy(v).matrix()).norm() < 1e-14);
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

TEST_CASE("derivatives of rotation vectors and six-vectors are those of finite differences at any angle") {
  Random random(3);
  const double h = 1e-6;
  for (const double angle : {0.0, 1e-9, 0.9e-4, 1.1e-4, 0.3, 2.0, 3.0}) {
    Vector6 v;
    v << random.normal_vector(3), angle * random.direction();
    const Eigen::Vector3d w = v.tail<3>();
    CAPTURE(angle);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d d = h * Eigen::Vector3d::Unit(k);
      const Eigen::Vector3d turned = log_rotation(exp_rotation(w - d).transpose() * exp_rotation(w + d)) / (2 * h);
      CHECK((turned - right_jacobian(w).col(k)).norm() < 1e-8);
    }
    CHECK((right_jacobian(w) * right_jacobian_inverse(w) - Eigen::Matrix3d::Identity()).norm() < 1e-8);
    for (int k = 0; k < 6; ++k) {
      const Vector6 d = h * Vector6::Unit(k);
      const Vector6 moved = (to_vector(to_pose(v) * to_pose(d)) - to_vector(to_pose(v) * to_pose(-d))) / (2 * h);
      CHECK((moved - vector_by_perturbation(v).col(k)).norm() < 1e-8);
    }
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

}  // namespace pose_test
