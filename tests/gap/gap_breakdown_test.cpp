#include "gap/reporting/gap_breakdown.hpp"

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// The gap of columns that have something in common.

namespace gap_breakdown_test {

using namespace kr5;
using namespace linear_world;

namespace {

const gap::GapPart& of(const std::vector<gap::GapPart>& all, const std::string& by, const std::string& name) {
  for (const gap::GapPart& p : all)
    if (p.by == by && p.name == name) return p;
  FAIL("no part " << by << " " << name);
  return all.front();
}

cell::Recording two_motions() {
  cell::Recording r;
  r.cell = unit_noise();
  r.experiments = {motion("motion-1", cell::Split::Fit, 100), motion("motion-2", cell::Split::Check, 100)};
  return r;
}

}  // namespace

TEST_CASE("a column's gap counts the rows that can be compared, against the limit of noise") {
  const cell::Recording r = two_motions();
  gap::GapBreakdown breakdown(r);
  Eigen::VectorXd residual = Eigen::VectorXd::Constant(100, 2.0);
  residual(7) = std::numeric_limits<double>::quiet_NaN();
  const gap::ColumnGap c = breakdown.add(1, "i3", 0.5, residual);
  CHECK(c.experiment == "motion-2");
  CHECK(c.split == cell::Split::Check);
  CHECK(c.target == "joint3");
  CHECK(c.unit == "A");
  CHECK(c.gap == Approx(2.0));
  CHECK(c.rms == Approx(1.0));
  CHECK(c.rows == 99);
  CHECK(c.left_out == 1);
  CHECK(c.limit == Approx(std::sqrt(148.230 / 99)).epsilon(1e-4));  // 99.9 % of chi-square, from tables
  CHECK(c.exceeds);
  CHECK_FALSE(breakdown.add(1, "i3", 0.5, 0.5 * residual).exceeds);
}

TEST_CASE("the unit of a joint's column is that of its kind of joint") {
  cell::Recording r = two_motions();
  r.cell.robot.dh[1].type = kinematics::JointType::Prismatic;
  gap::GapBreakdown breakdown(r);
  CHECK(breakdown.add(0, "q1", 1.0, Eigen::VectorXd::Zero(100)).unit == "rad");
  CHECK(breakdown.add(0, "q2", 1.0, Eigen::VectorXd::Zero(100)).unit == "m");
}

TEST_CASE("parts share the excess of the columns that exceed, and the widest is first") {
  const cell::Recording r = two_motions();
  gap::GapBreakdown breakdown(r);
  breakdown.add(0, "i1", 1.0, Eigen::VectorXd::Constant(100, 2.0));  // excess 3
  breakdown.add(0, "i2", 1.0, Eigen::VectorXd::Constant(100, 4.0));  // excess 15
  breakdown.add(1, "fx", 1.0, Eigen::VectorXd::Constant(100, 1.0));  // none
  const std::vector<gap::GapPart> all = breakdown.all();
  const gap::GapPart& first = of(all, "experiment", "motion-1");
  CHECK(first.columns == 2);
  CHECK(first.exceeding == 2);
  CHECK(first.gap == Approx(std::sqrt(10.0)));
  CHECK(first.share == Approx(1.0));
  CHECK(of(all, "experiment", "motion-2").share == 0.0);
  CHECK(of(all, "target", "joint1").share == Approx(3.0 / 18));
  CHECK(of(all, "target", "joint2").share == Approx(15.0 / 18));
  std::vector<std::string> targets;
  for (const gap::GapPart& p : all)
    if (p.by == "target") targets.push_back(p.name);
  CHECK(targets == std::vector<std::string>{"joint2", "joint1", "fx"});
}

TEST_CASE("rows are told by what the arm did in them") {
  cell::Recording r = two_motions();
  r.experiments.resize(1);
  cell::Experiment& e = r.experiments[0];
  for (Eigen::Index i = 0; i < 100; ++i)  // at rest, then moving
    e.data.values(i, e.data.find("qc1")) = i < 50 ? 0.0 : 0.01 * static_cast<double>(i - 50);
  gap::GapBreakdown breakdown(r);
  Eigen::VectorXd residual = Eigen::VectorXd::Constant(100, 1.0);
  residual.tail(49).setConstant(3.0);
  const gap::ColumnGap whole = breakdown.add(0, "i1", 1.0, residual);
  REQUIRE(whole.exceeds);
  const std::vector<gap::GapPart> all = breakdown.all();
  const gap::GapPart& rest = of(all, "speed", "at rest");
  CHECK(rest.gap == Approx(1.0));
  CHECK(rest.share == Approx(0.0).margin(1e-12));
  double moving = 0.0;
  for (const gap::GapPart& p : all)
    if (p.by == "speed" && p.name != "at rest") moving += p.share;
  CHECK(moving == Approx(1.0));
}

}  // namespace gap_breakdown_test
