#include <limits>

#include <catch2/catch.hpp>

#include <calibration/scanner_world.hpp>
#include <kr5/calibration/profile_cloud.hpp>
#include <kr5/core/error.hpp>

namespace profile_cloud_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("profiles of a known plane make a cloud on that plane", "[cloud]") {
  const ScannerWorld w = make_scanner_world({.tips = 0, .planes = 12});
  const ProfileCloud cloud = profiles_to_cloud(w.profiles, w.true_flange, w.T_flange_scanner);
  REQUIRE(cloud.points.cols() > 1000);
  for (Eigen::Index k = 0; k < cloud.points.cols(); ++k)
    CHECK(std::abs(w.normal.dot(cloud.points.col(k) - w.plane_point)) < 1e-12);
  // With the inverse of the flange's pose, as eq. 2.8 is printed, the points are elsewhere.
  std::vector<Pose> inverse;
  for (const Pose& T : w.true_flange) inverse.push_back(T.inverse());
  const ProfileCloud wrong = profiles_to_cloud(w.profiles, inverse, w.T_flange_scanner);
  CHECK(std::abs(w.normal.dot(wrong.points.col(0) - w.plane_point)) > 0.01);
  CHECK_THROWS_WITH(profiles_to_cloud(w.profiles, std::vector<Pose>{}, w.T_flange_scanner),
                    Contains("expected as many"));
}

TEST_CASE("poses are interpolated at the times of the profiles, less their delay", "[cloud]") {
  std::vector<double> t;
  std::vector<Pose> poses;
  const auto pose_at = [](double time) {
    Pose T = Pose::Identity();
    T.linear() = exp_rotation(Eigen::Vector3d(0.1, 0.8, -0.3) * time);
    T.translation() = Eigen::Vector3d(0.2, -0.1, 0.05) * time;
    return T;
  };
  for (int k = 0; k <= 50; ++k) t.push_back(0.05 * k), poses.push_back(pose_at(t.back()));
  std::vector<TimedProfile> profiles;
  LineProfile line;
  line.x = Eigen::Vector2d(0.01, 0.02), line.z = Eigen::Vector2d(0.2, std::numeric_limits<double>::quiet_NaN());
  for (const double time : {0.013, 1.001, 2.49, 2.61, -0.2}) profiles.push_back({time + 0.03, line});
  const ProfileCloud cloud = profiles_to_cloud(profiles, t, poses, Pose::Identity(), {.delay = 0.03});
  REQUIRE(cloud.points.cols() == 3);
  CHECK(cloud.dropped == std::vector<int>{3, 4});
  const double times[] = {0.013, 1.001, 2.49};
  for (int k = 0; k < 3; ++k) {  // a constant speed is interpolated exactly
    CHECK((cloud.points.col(k) - pose_at(times[k]) * Eigen::Vector3d(0.01, 0, 0.2)).norm() < 1e-12);
    CHECK(cloud.profile[k] == k);
  }
  const ProfileCloud late = profiles_to_cloud(profiles, t, poses, Pose::Identity());
  CHECK((late.points.col(0) - cloud.points.col(0)).norm() == Approx(0.03 * 0.29).epsilon(0.5));
  t[3] = t[2];
  CHECK_THROWS_WITH(profiles_to_cloud(profiles, t, poses, Pose::Identity()), Contains("must increase"));
}

}  // namespace profile_cloud_test
