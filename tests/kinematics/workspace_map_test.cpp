#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <kr5/core/error.hpp>
#include <kr5/kinematics/jacobian.hpp>
#include <kr5/kinematics/workspace_map.hpp>

namespace workspace_map_test {

using namespace kr5;
using namespace kr5::kinematics;

namespace {

constexpr double pi = std::numbers::pi;

DhChain planar_arm(double l1, double l2) {
  DhChain chain;
  chain.joints = {{.a = l1}, {.a = l2}};
  return chain;
}

/// The KR5 arc: b1 0.4, a1 0.18, a2 0.6, a3 0.12, b4 0.62, b6 0.115 m.
DhChain kr5_arm() {
  DhChain chain;
  chain.joints = {{.b = 0.4, .a = 0.18, .alpha = -pi / 2},
                  {.a = 0.6},
                  {.a = 0.12, .alpha = -pi / 2},
                  {.b = 0.62, .alpha = pi / 2},
                  {.alpha = -pi / 2},
                  {.b = 0.115}};
  return chain;
}

}  // namespace

TEST_CASE("manipulability of a planar arm is l1 l2 |sin q2|") {
  const double l1 = 0.7, l2 = 0.4;
  const DhChain arm = planar_arm(l1, l2);
  const Eigen::Vector2d least(-pi, -2.0), most(pi, 2.0);
  const WorkspaceMap map = workspace_map(arm, least, most, {.samples = 20'000, .cells = 50});
  CHECK(map.reach == Approx(l1 + l2).epsilon(1e-9));
  CHECK(map.inner == Approx(std::sqrt(l1 * l1 + l2 * l2 + 2 * l1 * l2 * std::cos(2.0))).epsilon(1e-9));
  int seen = 0;
  for (Eigen::Index c = 0; c < 50; ++c) {
    // In a cell the radius, and so q2, varies: the greatest value is that of its edges or of q2 = 90 deg.
    const double half = map.reach / 100;
    const auto at = [&](double r) {
      const double cosine = std::clamp((r * r - l1 * l1 - l2 * l2) / (2 * l1 * l2), std::cos(2.0), 1.0);
      return l1 * l2 * std::sqrt(1 - cosine * cosine);
    };
    const double a = at(map.radius[c] - half), b = at(map.radius[c] + half);
    for (Eigen::Index r = 0; r < 50; ++r) {
      if (map.counts(r, c) == 0) {
        CHECK(std::isnan(map.dexterity(r, c)));
        continue;
      }
      ++seen;
      CHECK(map.dexterity(r, c) >= std::min(a, b) - 1e-9);
      CHECK(map.dexterity(r, c) <=
            (std::abs(map.radius[c] - std::hypot(l1, l2)) < half ? l1 * l2 : std::max(a, b)) + 1e-9);
    }
  }
  CHECK(seen > 20);
}

TEST_CASE("the reach of the KR5 is that of its wrist centre, with any base and any turn of joint 1") {
  DhChain arm = kr5_arm();
  const auto wrist = wrist_centre(arm);
  REQUIRE(wrist);
  CHECK((*wrist - Eigen::Vector3d(0, 0, -0.115)).norm() < 1e-12);
  const Eigen::VectorXd limit = Eigen::VectorXd::Constant(6, pi);
  const double reach = 0.18 + 0.6 + std::hypot(0.12, 0.62);
  CHECK(reach == Approx(1.4115).margin(5e-5));  // Hayat et al. 2022
  CHECK(workspace_map(arm, -limit, limit, {.point = *wrist, .samples = 3000}).reach == Approx(reach).epsilon(1e-7));
  arm.T_base_0 = from_xyzrpy((Vector6() << 1, 2, 3, pi, 0, 0.4).finished());
  const WorkspaceMap turned = workspace_map(arm, -limit, limit, {.point = *wrist, .samples = 3000});
  CHECK(turned.reach == Approx(reach).epsilon(1e-7));
  CHECK(turned.highest == Approx(3 - 0.4 + 0.6 + std::hypot(0.12, 0.62)).epsilon(1e-7));
  CHECK(arm.flange(turned.q_reach).translation().allFinite());
}

TEST_CASE("a limit takes away what it shuts off") {
  const DhChain arm = planar_arm(1.0, 1.0);
  const WorkspaceMap map = workspace_map(arm, Eigen::Vector2d(-pi, pi / 2), Eigen::Vector2d(pi, pi), {.samples = 2000});
  CHECK(map.reach == Approx(std::sqrt(2.0)).epsilon(1e-9));
  CHECK(map.inner == Approx(0.0).margin(1e-6));
}

TEST_CASE("a slide carries the workspace along, and the same arm gives the same map") {
  DhChain arm;
  arm.joints = {{.type = JointType::Prismatic}, {.a = 0.5}, {.a = 0.3}};
  const Eigen::Vector3d lower(0.0, -pi, -pi), upper(1.2, pi, pi);
  const WorkspaceMap map = workspace_map(arm, lower, upper, {.samples = 5000});
  CHECK(map.reach == Approx(0.8).epsilon(1e-9));
  CHECK(map.highest - map.lowest == Approx(1.2).epsilon(1e-9));
  CHECK(map.counts.sum() == 5000);
  CHECK(workspace_map(arm, lower, upper, {.samples = 5000}).counts == map.counts);
}

TEST_CASE("joints without end turn once, slides without end and wrong limits are refused") {
  const double infinite = std::numeric_limits<double>::infinity();
  const DhChain arm = planar_arm(0.7, 0.4);
  const Eigen::Vector2d free = Eigen::Vector2d::Constant(infinite);
  CHECK(workspace_map(arm, -free, free, {.samples = 500}).reach == Approx(1.1).epsilon(1e-9));
  DhChain slide;
  slide.joints = {{.type = JointType::Prismatic}};
  CHECK_THROWS_WITH(workspace_map(slide, Eigen::VectorXd::Constant(1, -infinite), Eigen::VectorXd::Zero(1)),
                    Catch::Contains("no end"));
  CHECK_THROWS_WITH(workspace_map(arm, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()), Catch::Contains("2 joints"));
  CHECK_THROWS_WITH(workspace_map(arm, Eigen::Vector2d(1, 1), Eigen::Vector2d(0, 2)),
                    Catch::Contains("joint 1: the lower limit"));
  CHECK_THROWS_WITH(workspace_map(arm, -free, free, {.samples = 5}), Catch::Contains("samples"));
  CHECK_THROWS_WITH(workspace_map({}, {}, {}), Catch::Contains("no joints"));
}

}  // namespace workspace_map_test
