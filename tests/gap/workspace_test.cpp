#include "gap/planning/workspace.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Where the arm may go.

namespace workspace_test {

using namespace kr5;
using namespace linear_world;

namespace {

/// A motion about a posture that the arm can take, the tool well above the floor.
cell::Experiment usual_motion(int rows) {
  cell::Experiment e = motion("motion-1", cell::Split::Fit, rows);
  const double middle[] = {0.02, -2.75, 0.0, -0.3, 1.571};
  for (int j = 2; j <= 6; ++j) e.data.values.col(e.data.find("qc" + std::to_string(j))).setConstant(middle[j - 2]);
  return e;
}

cell::Recording recorded() {
  cell::Recording r;
  r.cell = unit_noise();
  r.experiments = {usual_motion(200)};
  return r;
}

}  // namespace

TEST_CASE("joints keep a twentieth of their range from their limits, and a part of their speed") {
  const cell::Recording r = recorded();
  REQUIRE(r.cell.robot.limits);
  const auto& limits = *r.cell.robot.limits;
  const gap::Workspace w(gap::Family{r, {}, 0.7});
  CHECK((w.low - (0.95 * limits.lower + 0.05 * limits.upper)).norm() < 1e-12);
  CHECK((w.high - (0.05 * limits.lower + 0.95 * limits.upper)).norm() < 1e-12);
  CHECK((w.speed - 0.7 * limits.velocity).norm() < 1e-12);
  Eigen::VectorXd first(6);
  first << 0.0, 0.02, -2.75, 0.0, -0.3, 1.571;
  CHECK((w.home - first.cwiseMax(w.low).cwiseMin(w.high)).norm() < 1e-12);
  CHECK(w.cycle == r.cell.servo->cycle);
}

TEST_CASE("commands to torque servos come as often as those that were recorded") {
  cell::Recording r = recorded();
  r.cell.servo->joint.clear();
  r.cell.servo->torque = {{.stiffness = 20.0, .damping = 1.0}};
  r.experiments[0].data.values.col(r.experiments[0].data.find("t")) = Eigen::VectorXd::LinSpaced(200, 5.0, 8.98);
  CHECK(gap::Workspace(gap::Family{r, {}, 0.7}).cycle == Approx(0.02));
  r.experiments.clear();
  CHECK(gap::Workspace(gap::Family{r, {}, 0.7}).cycle == r.cell.servo->cycle);
}

TEST_CASE("without limits what was recorded is all that is safe") {
  cell::Recording r = recorded();
  r.cell.robot.limits.reset();
  r.cell.servo.reset();
  const gap::Workspace w(gap::Family{r, {}, 0.5});
  CHECK(w.low(0) == Approx(-1.0).margin(1e-3));
  CHECK(w.high(0) == Approx(1.0).margin(1e-3));
  CHECK(w.low(4) == -0.3);
  CHECK(w.high(4) == -0.3);
  CHECK(w.speed == Eigen::VectorXd::Constant(6, 0.5));
  CHECK(w.cycle == 0.012);
  Eigen::MatrixXd path = w.home.transpose().replicate(3, 1);
  CHECK(w.contains_path(path));
  path(2, 3) += 0.01;
  CHECK_FALSE(w.contains_path(path));
}

TEST_CASE("no posture lies below the lowest that was recorded") {
  const cell::Recording r = recorded();
  const gap::Workspace w(gap::Family{r, {}});
  double lowest = 1e9;
  const io::Table& table = r.experiments[0].data;
  for (Eigen::Index i = 0; i < table.values.rows(); ++i)
    lowest = std::min(
        lowest,
        cell::T_base_tool(r.cell, table.values.row(i).segment(table.find("qc1"), 6).transpose()).translation().z());
  CHECK(w.floor == Approx(lowest - 0.02).margin(1e-3));
  Random random(121);
  bool far_above_near = true;
  const kinematics::DhChain arm = cell::nominal_chain(r.cell);
  for (int k = 0; k < 20; ++k) {
    const Eigen::VectorXd q = w.random_near(random, w.home, 0.5);
    CHECK(w.contains_path(q.transpose()));
    CHECK((q - w.home).cwiseAbs().maxCoeff() <= 0.5);
    const auto reach = [&](const Eigen::VectorXd& at) { return arm.flange(at).translation().head<2>().norm(); };
    if (k == 0) {
      const Eigen::VectorXd far = w.random_extreme(random, true), near = w.random_extreme(random, false);
      CHECK(w.contains_path(far.transpose()));
      far_above_near = reach(far) > reach(near) + 0.1;
    }
  }
  CHECK(far_above_near);
}

}  // namespace workspace_test
