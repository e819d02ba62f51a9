#include "gap/screening/pose_noise.hpp"

#include <cmath>
#include <vector>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Noise of poses: what no effect could explain.

namespace pose_noise_test {

using namespace kr5;
using namespace linear_world;

namespace {

constexpr Eigen::Index count = 80;

cell::Experiment poses(double noise, double with_q1) { return moved_poses(Random(51), count, noise, with_q1); }

/// An effect that moves x with a joint.
gap::Hypothesis moves_with(const std::string& joint) {
  gap::OwnEffect own{{"moves", joint}, {{"size", "m", 1.0, -1e9, 1e9, {}}}, {}, {}};
  own.change = [joint](io::Table& table, const cell::Experiment& e, const Eigen::VectorXd& x) {
    table.values.col(table.find("x")) += x(0) * e.data.column(joint);
  };
  return gap::own_hypothesis(own);
}

}  // namespace

TEST_CASE("the noise of poses is the residual that no effect takes, over its degrees of freedom") {
  const gap::Hypothesis q1 = moves_with("q1"), q2 = moves_with("q2");
  for (const double noise : {0.5, 1.0, 2.0}) {
    World world({poses(noise, 40.0)});
    int stray = 0;
    const auto found = gap::pose_noise_scales(world.data, world.base, {&q1, &q2}, stray);
    REQUIRE(found.size() == 1);
    CHECK(found[0].key == "pose_position");
    CHECK(stray == 0);
    // Independent: regression of x on the two joints.
    const cell::Experiment& e = world.recording.experiments[0];
    Eigen::MatrixXd J(count, 2);
    J << e.data.column("q1"), e.data.column("q2");
    const Eigen::VectorXd x = e.data.column("x");
    const Eigen::VectorXd left = x - J * (J.transpose() * J).ldlt().solve(J.transpose() * x);
    const double chi2 = left.squaredNorm() + e.data.column("y").squaredNorm() + e.data.column("z").squaredNorm();
    CHECK(found[0].samples == Approx(3.0 * count - 2));
    CHECK(found[0].ratio == Approx(std::sqrt(chi2 / (3.0 * count - 2))));
    CHECK(found[0].std == Approx(found[0].ratio / std::sqrt(2 * (3.0 * count - 2))));
    CHECK(std::abs(found[0].ratio - noise) < 4 * found[0].std);
  }
}

TEST_CASE("without the effect that made them, residuals count as noise") {
  World world({poses(1.0, 40.0)});
  int stray = 0;
  const gap::Hypothesis q2 = moves_with("q2");
  const auto found = gap::pose_noise_scales(world.data, world.base, {&q2}, stray);
  REQUIRE(found.size() == 1);
  CHECK(found[0].ratio > 10.0);
}

TEST_CASE("a stray pose is marked and does not count") {
  cell::Experiment e = poses(1.0, 40.0);
  e.data.values(17, e.data.find("y")) += 25.0;
  World world({e});
  int stray = 2;  // found before
  const gap::Hypothesis q1 = moves_with("q1");
  const auto found = gap::pose_noise_scales(world.data, world.base, {&q1}, stray);
  CHECK(stray == 3);
  CHECK(world.data.use.sum() == static_cast<double>(world.data.size) - 1);
  CHECK(world.data.use(count + 17) == 0.0);
  REQUIRE(found.size() == 1);
  CHECK(found[0].ratio == Approx(1.0).epsilon(0.15));
}

TEST_CASE("poses that show hardly any noise, and recordings without poses, tell of none") {
  int stray = 0;
  World computed({poses(0.1, 0.0)});
  CHECK(gap::pose_noise_scales(computed.data, computed.base, {}, stray).empty());
  cell::Experiment e = motion("motion-1", cell::Split::Fit, 100);
  add_column(e, "i1", Eigen::VectorXd::Zero(100));
  World moving({e});
  CHECK(gap::pose_noise_scales(moving.data, moving.base, {}, stray).empty());
  CHECK(stray == 0);
}

}  // namespace pose_noise_test
