// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/pellets.hpp>

#include <cmath>
#include <limits>
#include <numbers>

#include <kr5/core/error.hpp>
#include <kr5/picking/grasp.hpp>

#include "picking/drawn_pile.hpp"
#include "support/rates.hpp"
#include "support/trials.hpp"

namespace pellets_test {

using namespace kr5;
using namespace kr5::picking;
using Catch::Matchers::Contains;
using Eigen::Vector3d;

namespace {

/// Number of the cylinder of the pile that this is, within 2 mm and 5 degrees, or -1.
int true_number(const Pellet& found, const test::DrawnPile& pile) {
  for (std::size_t i = 0; i < pile.cylinders.size(); ++i) {
    const Pose T = pile.bin.T_base_bin * pile.cylinders[i].T_bin_cylinder;
    const double cosine = std::abs(T.linear().col(2).dot(found.axis));
    if ((T.translation() - found.centre).norm() < 0.002 && cosine > std::cos(5 * std::numbers::pi / 180))
      return static_cast<int>(i);
  }
  return -1;
}

struct Count {
  int visible = 0, found = 0, listed = 0, wrong = 0;
};
void count(const test::DrawnPile& pile, const PelletResult& result, Count& out) {
  std::vector<bool> found(pile.cylinders.size(), false);
  for (const Pellet& p : result.pellets) {
    const int number = true_number(p, pile);
    ++out.listed;
    out.wrong += number < 0;
    if (number >= 0) found[static_cast<std::size_t>(number)] = true;
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    const bool visible = pile.cylinders[i].exposed >= 0.4;
    out.visible += visible;
    out.found += visible && found[i];
  }
}

}  // namespace

TEST_CASE("the visible cylinders of a pile are found with their poses, and no others", "[statistics]") {
  Count all;
  const int piles = test::trials(40, 5);
  for (int i = 0; i < piles; ++i) {
    Random random(static_cast<std::uint64_t>(500 + i));
    test::PileOptions options;
    options.noise = i % 2 == 0 ? 5e-5 : 2e-4;
    options.pitch = i % 4 < 2 ? 0.0006 : 0.001;
    options.radius_spread = i % 3 == 0 ? 4e-4 : 0.0;
    options.T_base_bin = to_pose((Vector6() << random.normal_vector(3, 0.5), random.normal_vector(3, 0.2)).finished());
    const test::DrawnPile pile = test::drawn_pile(i, options);
    const PelletResult result = find_pellets(pile.cloud, pile.bin);
    REQUIRE(result.check.finding == CloudFinding::Good);
    count(pile, result, all);
  }
  INFO(all.found << " of " << all.visible << " visible, " << all.wrong << " wrong of " << all.listed);
  test::check_rate(all.found, all.visible, 0.95, 0.9);
  test::check_rare(all.wrong, all.listed, 0.01, 0.03);
}

TEST_CASE("cylinders of other proportions are found with the options that say so") {
  test::PileOptions options{
      .count = 12, .side = 0.3, .pitch = 0.003, .noise = 3e-4, .radius = 0.025, .low = 0.08, .high = 0.08};
  const test::DrawnPile pile = test::drawn_pile(3, options);
  const PelletResult result = find_pellets(pile.cloud, pile.bin,
                                           {.radius = 0.025,
                                            .radius_tolerance = 0.001,
                                            .min_height = 0.08,
                                            .max_height = 0.08,
                                            .accepted_position_std = 0.003});
  Count all;
  count(pile, result, all);
  CHECK(all.found >= all.visible - 1);
  CHECK(all.wrong == 0);
  for (const Pellet& p : result.pellets) CHECK(p.height == Approx(0.08));
}

TEST_CASE("one cylinder is found to a fraction of the noise, upright, leaning or lying") {
  for (const double tilt : {0.0, 0.6, 1.2, std::numbers::pi / 2}) {
    const test::DrawnPile pile = test::drawn_pile(1, {.count = 1, .side = 0.08, .pitch = 0.0005, .tilt = tilt});
    const PelletResult result = find_pellets(pile.cloud, pile.bin);
    REQUIRE(result.pellets.size() == 1);
    const Pellet& p = result.pellets[0];
    CHECK(true_number(p, pile) == 0);
    CHECK(p.exposed > 0.95);
    const Pose T = pile.cylinders[0].T_bin_cylinder;
    const Vector3d error = p.frame.transpose() * (T.translation() - p.centre);
    const double squared = error.dot(p.covariance.topLeftCorner<3, 3>().ldlt().solve(error));
    CHECK(squared < 21);  // chi-square with 3 degrees of freedom, once in 10 000
    CHECK(p.frame.determinant() == Approx(1));
    CHECK((p.frame.col(2) - p.axis).norm() < 1e-12);
    CHECK(p.axis.z() >= 0);
  }
}

TEST_CASE("rays that start at a sensor are used as they run") {
  test::DrawnPile pile = test::drawn_pile(8, {.count = 20, .side = 0.1, .pitch = 0.0006});
  pile.cloud.origins = Vector3d(0, 0, 5);  // nearly the straight rays of the drawing
  Count all;
  count(pile, find_pellets(pile.cloud, pile.bin), all);
  CHECK(all.found >= all.visible - 1);
  CHECK(all.wrong == 0);
}

TEST_CASE("a cloud that cannot be picked from is told in words, and nothing is listed") {
  const test::DrawnPile pile = test::drawn_pile(5, {.count = 12});
  const auto finding = [&](const Cloud& cloud, const Bin& bin) {
    const PelletResult result = find_pellets(cloud, bin);
    CHECK(result.pellets.empty());
    CHECK(result.check.message.size() > 20);
    return result.check.finding;
  };
  Cloud changed = pile.cloud;
  changed.points *= 1000;
  CHECK(finding(changed, pile.bin) == CloudFinding::WrongUnit);
  changed = pile.cloud;
  changed.points.setConstant(std::numeric_limits<double>::quiet_NaN());
  CHECK(finding(changed, pile.bin) == CloudFinding::Empty);
  changed.points.resize(3, 0);
  CHECK(finding(changed, pile.bin) == CloudFinding::Empty);
  Bin moved = pile.bin;
  moved.T_base_bin.translation().x() += 0.5;
  CHECK(finding(pile.cloud, moved) == CloudFinding::OutsideBin);
  moved = pile.bin;
  moved.T_base_bin.linear() = exp_rotation({std::numbers::pi, 0, 0});  // Z down
  CHECK(finding(pile.cloud, moved) == CloudFinding::UpsideDown);
  changed = pile.cloud;
  changed.origins = Vector3d(0, 0, -0.5);
  CHECK(finding(changed, pile.bin) == CloudFinding::SensorBelow);
  CHECK(finding(test::drawn_pile(6, {.count = 0}).cloud, pile.bin) == CloudFinding::NoPellets);
  CHECK(finding(test::drawn_pile(6, {.count = 12, .pitch = 0.005}).cloud, pile.bin) == CloudFinding::Sparse);
}

TEST_CASE("missing points and streaks make no cylinders") {
  test::DrawnPile pile = test::drawn_pile(9, {.count = 20, .pitch = 0.0006});
  Random random(10);
  for (Eigen::Index i = 0; i < pile.cloud.points.cols(); ++i) {
    if (random.uniform() < 0.2) pile.cloud.points.col(i).setConstant(std::numeric_limits<double>::quiet_NaN());
    if (random.uniform() < 0.01) pile.cloud.points(2, i) += random.uniform(0.005, 0.05);  // mirrored light
  }
  Count all;
  count(pile, find_pellets(pile.cloud, pile.bin), all);
  CHECK(all.wrong == 0);
  CHECK(all.found >= 0.85 * all.visible);
}

TEST_CASE("what is no cylinder is not listed") {
  // balls and boxes of the size of a cylinder
  Cloud cloud;
  cloud.points.resize(3, 160 * 160);
  for (int i = 0; i < 160; ++i)
    for (int k = 0; k < 160; ++k) {
      const double x = (i - 79.5) * 6e-4, y = (k - 79.5) * 6e-4;
      double z = 0;
      for (int b = 0; b < 4; ++b) {
        const double dx = x - (b % 2 == 0 ? -0.02 : 0.02), dy = y - (b < 2 ? -0.02 : 0.02);
        if (b < 2 && std::hypot(dx, dy) < 0.011) z = 0.011 + std::sqrt(0.011 * 0.011 - dx * dx - dy * dy);
        if (b >= 2 && std::abs(dx) < 0.012 && std::abs(dy) < 0.006) z = 0.015;
      }
      cloud.points.col(i * 160 + k) = Vector3d(x, y, z);
    }
  Bin bin;
  bin.size = {0.096, 0.096, 0.1};
  const PelletResult result = find_pellets(cloud, bin);
  REQUIRE(result.check.finding == CloudFinding::Good);
  CHECK(result.pellets.empty());
}

TEST_CASE("invalid options and clouds are refused by name") {
  const test::DrawnPile pile = test::drawn_pile(5, {.count = 2, .pitch = 0.002});
  CHECK_THROWS_WITH(find_pellets(pile.cloud, pile.bin, {.radius = 0}), Contains("radius"));
  CHECK_THROWS_WITH(find_pellets(pile.cloud, pile.bin, {.min_height = 0.02, .max_height = 0.01}),
                    Contains("max_height"));
  CHECK_THROWS_WITH(find_pellets(pile.cloud, Bin{}), Contains("size"));
  Cloud wrong = pile.cloud;
  wrong.origins = Eigen::Matrix3Xd::Zero(3, 7);
  CHECK_THROWS_WITH(find_pellets(wrong, pile.bin), Contains("origins"));
}

TEST_CASE("a plan picks what is free first, keeps clear of walls, and gives a reason for the rest") {
  const test::DrawnPile pile = test::drawn_pile(12, {.count = 30, .side = 0.11, .pitch = 0.0006});
  const PelletResult found = find_pellets(pile.cloud, pile.bin);
  const GraspOptions options;
  const std::vector<Grasp> plan = plan_picks(found.pellets, pile.cloud, pile.bin, options);
  REQUIRE(plan.size() == found.pellets.size());
  int graspable = 0, refused = 0;
  for (std::size_t i = 0; i < plan.size(); ++i) {
    const Grasp& g = plan[i];
    CHECK_FALSE(g.reason.empty());
    if (!g.graspable()) {
      ++refused;
      continue;
    }
    ++graspable;
    CHECK((i == 0 || plan[i - 1].graspable()));  // all that can be picked come first
    CHECK(g.covered_by.empty());
    CHECK(found.pellets[static_cast<std::size_t>(g.pellet)].exposed >= options.min_exposed);
    const Vector3d outwards = -g.T_base_gripper.linear().col(2), tip = g.T_base_gripper.translation();
    CHECK(gripper_clearance({tip, outwards}, options.gripper, pile.bin) >= options.clearance);
    CHECK(outwards.z() > std::cos(options.max_lean) - 1e-9);
    const Pellet& p = found.pellets[static_cast<std::size_t>(g.pellet)];
    const Vector3d local = p.frame.transpose() * (tip - p.centre);  // the tip stands on the surface
    const double side = local.head<2>().norm() - p.radius, end = std::abs(local.z()) - p.height / 2;
    CHECK(std::abs(std::max(side, end)) < 1e-9);
  }
  CHECK(graspable > 5);
  CHECK(refused > 3);
}

TEST_CASE("what lies on another cylinder is picked before it") {
  // one that stands, and one let down upon it
  const test::DrawnPile pile =
      test::drawn_pile(4, {.count = 2, .side = 0.08, .pitch = 0.0005, .tilt = 0.0, .place = Eigen::Vector2d(0.004, 0)});
  const PelletResult seen = find_pellets(pile.cloud, pile.bin);
  REQUIRE(seen.pellets.size() == 1);  // the lower one is hidden
  Pellet hidden = seen.pellets[0];
  hidden.centre.z() -= 0.0155;
  hidden.exposed = 0.9;  // as if known from an earlier scan
  const std::vector<Grasp> plan = plan_picks({hidden, seen.pellets[0]}, pile.cloud, pile.bin);
  REQUIRE(plan.size() == 2);
  CHECK(plan[0].pellet == 1);
  CHECK(plan[0].graspable());
  CHECK(plan[1].covered_by == std::vector<int>{1});
  CHECK_FALSE(plan[1].graspable());
}

TEST_CASE("a cylinder against the wall is picked with the gripper leaning away, or not at all") {
  // one that stands with its side 0.5 mm from the wall
  const test::DrawnPile pile = test::drawn_pile(
      2, {.count = 1, .side = 0.08, .pitch = 0.0005, .tilt = 0.0, .place = Eigen::Vector2d(0.0315, 0)});
  const PelletResult found = find_pellets(pile.cloud, pile.bin);
  REQUIRE(found.pellets.size() == 1);
  GraspOptions options;
  options.clearance = 0.0005;
  options.gripper = {{.radius = 0.0082, .start = 0.001, .end = 0.12}};  // 8.5 mm are free
  options.max_tilt = 0;
  const Grasp upright = plan_picks(found.pellets, pile.cloud, pile.bin, options)[0];
  CHECK(upright.finding == GraspFinding::TouchesBin);
  CHECK_THAT(upright.reason, Contains("bin"));
  options.max_tilt = 0.2;
  const Grasp leaning = plan_picks(found.pellets, pile.cloud, pile.bin, options)[0];
  REQUIRE(leaning.graspable());
  CHECK(-leaning.T_base_gripper.linear()(0, 2) < -0.1);  // away from the wall
  CHECK(leaning.clearance >= options.clearance);
  options.gripper[0].radius = 0.05;  // wider than the bin
  CHECK(plan_picks(found.pellets, pile.cloud, pile.bin, options)[0].finding == GraspFinding::TouchesBin);
}

TEST_CASE("a gripper that is shorter than the walls is followed to above the rim") {
  test::DrawnPile pile =
      test::drawn_pile(2, {.count = 1, .side = 0.08, .pitch = 0.0005, .tilt = 0.6, .place = Eigen::Vector2d(0.02, 0)});
  const PelletResult found = find_pellets(pile.cloud, pile.bin);
  REQUIRE(found.pellets.size() == 1);
  GraspOptions options;
  options.gripper = {{.radius = 0.005, .start = 0.001, .end = 0.02}};
  Bin deep = pile.bin;
  deep.size.z() = 0.3;
  for (const Grasp& g : plan_picks(found.pellets, pile.cloud, deep, options)) {
    const Vector3d outwards = -g.T_base_gripper.linear().col(2), tip = g.T_base_gripper.translation();
    const std::vector<GripperPart> whole{{.radius = 0.005, .start = 0.001, .end = 0.4}};
    if (g.graspable()) CHECK(gripper_clearance({tip, outwards}, whole, deep) >= options.clearance);
    CHECK((g.graspable() || g.finding == GraspFinding::TouchesBin));
  }
}

TEST_CASE("a sheet that fills the bin is no cylinder, and takes no time to be told so") {
  Cloud cloud;
  cloud.points.resize(3, 300 * 300);
  for (int i = 0; i < 300; ++i)
    for (int k = 0; k < 300; ++k)
      cloud.points.col(i * 300 + k) = Vector3d(0.001 * i - 0.15, 0.001 * k - 0.15, 0.02 + 0.003 * std::sin(0.02 * i));
  Bin bin;
  bin.size = {0.3, 0.3, 0.1};
  const PelletResult result = find_pellets(cloud, bin);
  CHECK(result.pellets.empty());
  CHECK(result.unexplained > 1000);
}

TEST_CASE("no cloud at all is no reason to fail a plan") {
  const test::DrawnPile pile = test::drawn_pile(3, {.count = 4, .side = 0.08});
  const PelletResult found = find_pellets(pile.cloud, pile.bin);
  REQUIRE_FALSE(found.pellets.empty());
  for (const Grasp& g : plan_picks(found.pellets, Cloud{}, pile.bin)) CHECK_FALSE(g.graspable());
}

}  // namespace pellets_test
