#include "gap/screening/recording_faults.hpp"

#include <algorithm>
#include <set>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Columns that are logged late or early.

namespace recording_faults_test {

using namespace kr5;
using namespace linear_world;

namespace {

const std::vector<std::string> wrench = {"fx", "fy", "fz", "tx", "ty", "tz"};

cell::Experiment motion_with(const std::vector<std::string>& columns) {
  cell::Experiment e = motion("motion-1", cell::Split::Fit, 200);
  for (const std::string& column : columns) add_column(e, column, e.data.column("t"));
  return e;
}

/// Two runs that begin at different times; fz is the time in each.
cell::Experiment press() {
  cell::Experiment e = experiment("press-1", cell::Kind::Press, cell::Split::Fit);
  Eigen::VectorXd run(200), t(200);
  for (Eigen::Index i = 0; i < 200; ++i)
    run(i) = i < 100 ? 0 : 1, t(i) = step * static_cast<double>(i) + (i < 100 ? 0 : 50);
  add_column(e, "run", run);
  add_column(e, "t", t);
  add_column(e, "zc", 0.0 * t);
  for (const std::string& column : wrench) add_column(e, column, t);
  return e;
}

std::set<std::string> targets(const std::vector<gap::Hypothesis>& all) {
  std::set<std::string> out;
  for (const gap::Hypothesis& h : all) out.insert(h.target);
  return out;
}

const gap::Hypothesis& of(const std::vector<gap::Hypothesis>& all, const std::string& target) {
  return *std::ranges::find(all, target, &gap::Hypothesis::target);
}

}  // namespace

TEST_CASE("each group of columns that was recorded with a clock may be late, and faults are of the recording") {
  cell::Recording r;
  r.cell = unit_noise();
  using Names = std::set<std::string>;
  r.experiments = {motion_with({"i1"})};
  CHECK(targets(gap::recording_faults(r)) == Names{"motor currents"});
  r.experiments = {motion_with(wrench)};
  CHECK(targets(gap::recording_faults(r)) == Names{"wrench of motion"});
  r.experiments = {press()};
  CHECK(targets(gap::recording_faults(r)) == Names{"wrench of contact", "wrench"});
  r.experiments = {motion_with({"i1", "q1"}), press()};
  const auto all = gap::recording_faults(r);
  CHECK(targets(all) == Names{"joint angles", "motor currents", "wrench of contact", "wrench"});
  for (const gap::Hypothesis& h : all) {
    CHECK(h.effect == "clock_offset");
    CHECK(h.of_recording);
    REQUIRE(h.coordinates.size() == 1);
    CHECK(h.coordinates[0].unit == "s");
  }
  r.experiments[0].data.columns[0] = "time";  // without a clock nothing can be late
  CHECK(targets(gap::recording_faults(r)) == Names{"wrench of contact", "wrench"});
}

TEST_CASE("currents may only be early in a cell that states its servo, whose delay is an effect") {
  cell::Recording r;
  r.cell = unit_noise();
  r.experiments = {motion_with({"i1"})};
  REQUIRE(r.cell.servo);
  const auto with = gap::recording_faults(r);
  CHECK(with[0].coordinates[0].upper == 0.0);
  CHECK(with[0].probes[0].points[0](0) < 0.0);
  r.cell.servo.reset();
  CHECK(gap::recording_faults(r)[0].coordinates[0].upper > 100.0);
}

TEST_CASE("a column that is late shows what it ought to have shown before, run by run") {
  cell::Recording r;
  r.cell = unit_noise();
  r.experiments = {press()};
  const gap::Hypothesis h = of(gap::recording_faults(r), "wrench of contact");
  for (const double delay : {0.018, -0.018}) {
    io::Table table = r.experiments[0].data;
    h.change(table, r.experiments[0], Eigen::VectorXd::Constant(1, delay / h.coordinates[0].size));
    const Eigen::VectorXd t = r.experiments[0].data.column("t"), late = table.column("fz");
    for (const Eigen::Index first : {0, 100})
      for (Eigen::Index i = first + 3; i < first + 97; ++i) CHECK(late(i) == Approx(t(i) - delay));
    CHECK(table.column("t") == t);
    CHECK(table.column("zc") == r.experiments[0].data.column("zc"));
  }
  io::Table other = motion_with(wrench).data;  // of another kind: not its clock
  const io::Table before = other;
  h.change(other, motion_with(wrench), Eigen::VectorXd::Constant(1, 3.0));
  CHECK(other.values == before.values);
}

}  // namespace recording_faults_test
