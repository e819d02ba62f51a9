#include <kr5/rsi/kuka_pose.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace kuka_pose_test {

Vector6 vector(double x, double y, double z, double a, double b, double c) {
  return (Vector6() << x, y, z, a, b, c).finished();
}

TEST_CASE("A turns about Z, B about the new Y, C about the newest X") {
  const auto x_axis = [](const Vector6& v) { return Eigen::Vector3d(from_kuka(v).linear().col(0)); };
  CHECK((x_axis(vector(0, 0, 0, 90, 0, 0)) - Eigen::Vector3d(0, 1, 0)).norm() < 1e-12);
  CHECK((x_axis(vector(0, 0, 0, 0, 90, 0)) - Eigen::Vector3d(0, 0, -1)).norm() < 1e-12);
  CHECK((x_axis(vector(0, 0, 0, 90, 90, 0)) - Eigen::Vector3d(0, 0, -1)).norm() < 1e-12);
  const Pose T = from_kuka(vector(36.72, 807.74, 862.89, 126.03, 0, 179.99));  // the sample of the book's appendix
  CHECK((T.translation() - Eigen::Vector3d(0.03672, 0.80774, 0.86289)).norm() < 1e-12);
  CHECK(T.linear()(2, 2) == Approx(-1.0).epsilon(1e-6));  // the tool points down
}

TEST_CASE("poses go to KUKA's numbers and back") {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    Vector6 v;
    for (int k = 0; k < 6; ++k) v[k] = k < 3 ? random.uniform(-2000, 2000) : random.uniform(-179, 179);
    v[4] /= 2.02;
    CHECK((to_kuka(from_kuka(v)) - v).norm() < 1e-9);
  }
  for (const double b : {90.0, -90.0, 89.9999999})  // there A and C are one turn
    for (const double a : {-170.0, 0.0, 33.0}) {
      const Pose T = from_kuka(vector(1, 2, 3, a, b, 17.0));
      CHECK((from_kuka(to_kuka(T)).matrix() - T.matrix()).norm() < 1e-9);
    }
}

}  // namespace kuka_pose_test
