#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/gap/diagnose.hpp>
#include <kr5/gap/measure.hpp>
#include <kr5/gap/sentences.hpp>
#include <kr5/gap/words.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/diagnosis_matchers.hpp"
#include "gap/protocol.hpp"

namespace diagnose_input_test {

/// @file
/// Recordings that are not as one would wish: the diagnosis judges by what there is, and says what it left out.

using namespace kr5;
using test::limits;
using test::names_only;
using test::text;
using test::warns;

namespace {

gap::Diagnosis diagnosed(const cell::Recording& r) { return gap::diagnose(r, predict::FastSimulator()); }

/// A motion in which one joint moves and the others stand; all of them, for joint 0.
cell::Experiment one_joint(cell::Experiment e, int joint) {
  for (int j = 1; j <= 6; ++j)
    if (j != joint) {
      auto column = e.data.values.col(e.data.find("qc" + std::to_string(j)));
      column.setConstant(column(0));
    }
  return e;
}

}  // namespace

TEST_CASE("columns and experiments that the simulator cannot show are left out with a word") {
  Random random(31);
  cell::Recording r = protocol::record(protocol::nominal(), random);
  r.cell.drives.reset();
  r.cell.peg.reset();
  r.cell.noise.laser = 0.0;
  const gap::Diagnosis d = diagnosed(r);
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::NoGap);
  CHECK(d.where.empty());
  CHECK(d.scope.empty());
  CHECK(warns(d, "motion.i1 to i6 (6 columns) were not compared: the simulator does not predict it"));
  CHECK(warns(d, "profile-1 was not compared"));
  CHECK(warns(d, "scan.z was not compared: the cell does not state noise.laser"));
}

TEST_CASE("a recording of which nothing can be shown is refused with the reason") {
  Random random(32);
  cell::Recording r = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Profile);
  r.cell.peg.reset();
  CHECK_THROWS_WITH(diagnosed(r), Catch::Contains("no column that can be compared") && Catch::Contains("peg"));
}

TEST_CASE("an effect is found although the first motions move other joints", "[not_sanitized]") {
  Random random(33);
  const cell::Cell broken = protocol::carrying("coulomb_friction", "joint3", "coulomb", 40.0);
  cell::Recording r;
  r.cell = protocol::nominal();
  for (int j = 1; j <= 6; ++j) {
    const std::string name = "motion-" + std::to_string(j);
    const auto split = cell::Split::Fit;
    r.experiments.push_back(
        one_joint(protocol::motion(random, 30.0 * j, 600, 2.0).experiment(name, cell::Kind::Motion, split), j));
  }
  r.experiments.push_back(
      protocol::motion(random, 300.0, 900, 2.0).experiment("motion-7", cell::Kind::Motion, cell::Split::Check));
  for (cell::Experiment& e : r.experiments) protocol::show(e, broken, random);
  const gap::Diagnosis d = diagnosed(r);
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::Explained);
  REQUIRE(names_only(d, {{"coulomb_friction", "joint3"}}));
}

TEST_CASE("a clock that counts from another epoch changes neither cause nor size", "[not_sanitized]") {
  Random random(34);
  cell::Cell broken = protocol::carrying("thermal_friction", "joint1", "drop", 0.6);
  cell::set_effect(broken, "thermal_friction", "joint1", "time_constant", cell::EffectValue(150.0));
  cell::Recording r = protocol::record(broken, random);
  const gap::Diagnosis before = diagnosed(r);
  for (cell::Experiment& e : r.experiments)
    if (const int t = e.data.find("t"); t >= 0) e.data.values.col(t).array() += 1.7e9;
  const gap::Diagnosis d = diagnosed(r);
  INFO(text(d));
  CHECK(d.clock_reset);
  CHECK(d.verdict == before.verdict);
  CHECK(names_only(d, {{"thermal_friction", "joint1"}}));
}

TEST_CASE("an effect beside a wrench that is logged late is explained, and the clock is told", "[not_sanitized]") {
  Random random(35);
  cell::Recording r = protocol::record(protocol::carrying("coulomb_friction", "joint2", "coulomb", 50.0), random);
  protocol::late(r, cell::Kind::Motion, {"fx", "fy", "fz", "tx", "ty", "tz"}, 0.012);
  const gap::Diagnosis d = diagnosed(r);
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::Explained);
  REQUIRE(names_only(d, {{"coulomb_friction", "joint2"}}));
  REQUIRE(d.clock_faults.size() == 1);
  CHECK(gap::clock_text(d.clock_faults[0]) == "wrench of motion");
  CHECK(std::abs(d.clock_faults[0].delay - 0.012) < 4 * d.clock_faults[0].std);
  CHECK(gap::warnings(d).size() == 1);
}

TEST_CASE("a dead column does not make the noise of its like seem small", "[not_sanitized]") {
  Random random(36);
  cell::Recording r = protocol::record(protocol::carrying("coulomb_friction", "joint2", "coulomb", 50.0), random);
  for (cell::Experiment& e : r.experiments)
    if (e.kind == cell::Kind::Motion) e.data.values.col(e.data.find("tz")).setZero();
  const gap::Diagnosis d = diagnosed(r);
  INFO(text(d));
  CHECK(d.verdict != gap::Verdict::NoGap);
  CHECK(names_only(d, {{"coulomb_friction", "joint2"}, {"ft_gain", "tz"}}));  // a gain of zero shows nothing
  CHECK(std::ranges::none_of(d.noise, [](const gap::NoiseRatio& n) { return n.key == "torque"; }));
  CHECK(std::ranges::all_of(d.coarse, [](const gap::ColumnName& c) { return c.column == "tz"; }));
  CHECK_FALSE(d.coarse.empty());
}

TEST_CASE("joint torques in the place of currents tell of friction", "[not_sanitized]") {
  Random random(37);
  cell::Cell nominal = protocol::nominal();
  nominal.drives.reset();
  cell::Cell broken = nominal;
  cell::set_effect(broken, "coulomb_friction", "joint2", "coulomb", cell::EffectValue(20.0));
  cell::Recording r = protocol::record(broken, random);
  r.cell = nominal;
  const gap::Diagnosis d = diagnosed(r);
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::Explained);
  REQUIRE(names_only(d, {{"coulomb_friction", "joint2"}}));
  CHECK(std::abs(d.causes[0].parameters[0].value[0] - 20.0) < 4 * d.causes[0].parameters[0].std[0]);
}

TEST_CASE("a kind that cannot be fitted, or not be checked, is told", "[not_sanitized]") {
  Random random(38);
  cell::Recording r = protocol::record(protocol::nominal(), random);
  std::erase_if(r.experiments, [](const cell::Experiment& e) { return e.name == "views-1" || e.name == "poses-2"; });
  const gap::Diagnosis d = diagnosed(r);
  INFO(text(d));
  CHECK(d.verdict == gap::Verdict::NoGap);
  CHECK(warns(d, "views: no fit experiment"));
  CHECK(warns(d, "poses: no check experiment"));
}

TEST_CASE("columns of one kind that are left out for one reason are named once, however many joints there are") {
  Random random(39);
  cell::Recording r = protocol::record(protocol::nominal(), random);
  r.cell.noise.current = 0.0;
  const gap::Measure found = gap::measure(r, predict::FastSimulator());
  REQUIRE(found.refused.size() == 1);
  CHECK(found.refused[0] == "motion.i1 to i6 (6 columns) were not compared: the cell does not state noise.current");
}

TEST_CASE("what a recording cannot show is told with the verdict") {
  Random random(40);
  cell::Recording still;
  still.cell = protocol::nominal();
  for (const cell::Split split : {cell::Split::Fit, cell::Split::Check}) {
    const std::string name = split == cell::Split::Fit ? "motion-1" : "motion-2";
    cell::Experiment e =
        one_joint(protocol::motion(random, 0.0, 200, 2.0).experiment(name, cell::Kind::Motion, split), 0);
    protocol::show(e, still.cell, random);
    still.experiments.push_back(e);
  }
  const gap::Diagnosis at_rest = diagnosed(still);
  INFO(text(at_rest));
  CHECK(at_rest.verdict == gap::Verdict::NoGap);
  CHECK(limits(at_rest, "motion-1 commands no motion: it cannot show friction, inertia and servos"));
  CHECK(limits(at_rest, "experiments of the kind motion only"));
  CHECK(limits(at_rest, "not the rest of the cell"));
  CHECK(gap::to_json(at_rest).find("commands no motion") != std::string::npos);

  cell::Recording brief = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Poses);
  brief.experiments[0].data.values.conservativeResize(4, Eigen::NoChange);
  const gap::Diagnosis few = diagnosed(brief);
  CHECK(limits(few, "poses-1 has 4 rows: it can show neither a gap nor its absence"));
  CHECK(few.scope.size() == 2);
}

TEST_CASE("progress tells which part of the whole is done, and never falls") {
  Random random(77);
  gap::DiagnoseOptions options;
  std::vector<double> done;
  std::vector<std::string> stages;
  options.progress = [&](const std::string& stage, double fraction) {
    done.push_back(fraction);
    if (stages.empty() || stages.back() != stage) stages.push_back(stage);
  };
  gap::diagnose(protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Poses),
                predict::FastSimulator(), options);
  REQUIRE(!done.empty());
  CHECK(std::is_sorted(done.begin(), done.end()));
  CHECK(done.front() >= 0.0);
  CHECK(done.back() == 1.0);
  CHECK(stages.front() == "simulating the nominal cell");
  CHECK(stages.back() == "analysing the residuals");
}

TEST_CASE("a motion that is cut while the arm moves is judged after a lead-in as a whole one is", "[not_sanitized]") {
  Random random(41);
  cell::Recording r;
  r.cell = protocol::nominal();
  cell::Experiment whole =
      protocol::motion(random, 0.0, 1200, 2.0).experiment("motion-1", cell::Kind::Motion, cell::Split::Fit);
  protocol::show(whole, r.cell, random);
  cell::Experiment late = cell::split_lead_in(whole, 9.6);
  cell::Experiment early = whole;
  early.data.values = Eigen::MatrixXd(whole.data.values.topRows(800));
  late.name = "motion-2", late.file = "motion-2.csv", late.split = cell::Split::Check;
  r.experiments = {early, late};
  const gap::Diagnosis led = diagnosed(r);
  INFO(text(led));
  CHECK(led.verdict == gap::Verdict::NoGap);
  r.experiments[1].lead_in = {};  // simulated from rest, although the arm moves
  CHECK(diagnosed(r).verdict != gap::Verdict::NoGap);
}

TEST_CASE("effects that a cell or a recording cannot show are listed as not tried, with what is missing") {
  Random random(42);
  cell::Recording r;
  r.cell = protocol::nominal();
  r.cell.tool.reset();
  r.cell.camera.reset();
  r.cell.laser.reset();
  for (const cell::Split split : {cell::Split::Fit, cell::Split::Check}) {
    const std::string name = "motion-" + std::to_string(r.experiments.size() + 1);
    r.experiments.push_back(protocol::motion(random, 0.0, 800, 2.0).experiment(name, cell::Kind::Motion, split));
    protocol::show(r.experiments.back(), r.cell, random);
  }
  const gap::Diagnosis d = diagnosed(r);
  CHECK(d.verdict == gap::Verdict::NoGap);
  const auto reason = [&](const std::string& effect) {
    for (const gap::UntriedEffect& e : d.not_tried)
      if (e.effect == effect) return gap::reason_text(e);
    return std::string("tried");
  };
  CHECK(reason("payload") == "the cell has no tool");
  CHECK(reason("hand_eye") == "the cell has no camera");
  CHECK(reason("tool_delay").find("no recorded column shows it") == 0);
  CHECK(reason("coulomb_friction") == "tried");
  CHECK(d.nearest.empty());
  CHECK(gap::to_json(d).find("the cell has no tool") != std::string::npos);
}

TEST_CASE("beside an unknown cause the nearest effects are named, with the gap that each leaves", "[not_sanitized]") {
  Random random(43);
  cell::Recording r = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Motion);
  r.cell.robot.joint_names = {"a", "b", "c", "d", "e", "f"};
  for (cell::Experiment& e : r.experiments) {  // what no catalogue names: a current that follows another joint
    const Eigen::VectorXd q = e.data.column("qc4");
    e.data.values.col(e.data.find("i2")) += 0.3 * (3.0 * q.array()).cos().matrix();
  }
  gap::DiagnoseOptions options;
  options.max_effects = 2;  // the nearest effects are sought beside what is blamed, and larger sets take long
  const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator(), options);
  INFO(text(d));
  REQUIRE(d.verdict == gap::Verdict::Unknown);
  CHECK(d.reduction.after == d.reduction.before);  // nothing is said to fall where nothing is blamed
  REQUIRE_FALSE(d.nearest.empty());
  CHECK(d.nearest.size() <= 3);
  for (std::size_t k = 0; k < d.nearest.size(); ++k) {
    CHECK(d.nearest[k].gap < 1.05 * d.reduction.before);
    CHECK(d.nearest[k].reason != gap::NotBlamed::Described);
    CHECK_FALSE(gap::reason_text(d.nearest[k]).empty());
    if (k > 0) CHECK(d.nearest[k].gap >= d.nearest[k - 1].gap);
  }
  CHECK(gap::to_json(d).find("\"joint\": \"b\"") != std::string::npos);
}

namespace {

/// Currents of a sound arm, with one that follows another joint, which no catalogue names: amplitude [A].
cell::Recording with_stray_current(double amplitude) {
  Random random(44);
  cell::Recording r = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Motion);
  for (cell::Experiment& e : r.experiments)
    e.data.values.col(e.data.find("i2")) += amplitude * (3.0 * e.data.column("qc4").array()).cos().matrix();
  return r;
}

gap::DiagnoseOptions with_known_error(const std::string& column, double error, bool of_recording) {
  gap::DiagnoseOptions out;
  out.max_effects = out.refits = out.beam = 1;
  out.simulator_errors = {{column, error}};
  out.errors_of_recording = of_recording;
  return out;
}

}  // namespace

TEST_CASE("what a simulator is known to be off in a column is no structure there, and is one in others",
          "[not_sanitized]") {
  const cell::Recording r = with_stray_current(0.1);
  const gap::Diagnosis known = gap::diagnose(r, predict::FastSimulator(), with_known_error("motion.i2", 0.15, false));
  INFO(text(known));
  CHECK(known.verdict == gap::Verdict::NoGap);
  gap::DiagnoseOptions options = with_known_error("motion.i3", 0.15, false);
  CHECK(gap::diagnose(r, predict::FastSimulator(), options).verdict != gap::Verdict::NoGap);
  const auto refused = [&](std::vector<gap::ColumnError> errors, const std::string& why) {
    options.simulator_errors = std::move(errors);
    CHECK_THROWS_WITH(gap::diagnose(r, predict::FastSimulator(), options), Catch::Contains(why));
  };
  refused({{"motion.i3", -1.0}}, "motion.i3 must be finite and not negative");
  refused({{"motion.i3", 0.1}, {"motion.i3", 0.1}}, "motion.i3 is stated twice");
  refused({{"motion.j3", 0.1}}, "found column 'motion.j3', expected one of motion.fx");
}

TEST_CASE("an error estimated from the recording excuses no disturbance beyond noise, and its pattern is told",
          "[not_sanitized]") {
  // As large as an estimate from the recording makes it: the RMS of the disturbance.
  const auto disturbed_by = [](double amplitude, const std::string& disturbed) {
    cell::Recording r = with_stray_current(disturbed == "by joint 4" ? amplitude : 0.0);
    if (disturbed == "by time")
      for (cell::Experiment& e : r.experiments)
        e.data.values.col(e.data.find("i2")) += amplitude * (9.0 * e.data.column("t").array()).sin().matrix();
    return gap::diagnose(r, predict::FastSimulator(), with_known_error("motion.i2", amplitude / std::sqrt(2.0), true));
  };
  CHECK(disturbed_by(0.04, "by joint 4").verdict == gap::Verdict::NoGap);  // about the noise of 0.03 A
  for (const auto& [disturbed, variable] :
       std::vector<std::array<std::string, 2>>{{"by joint 4", "q4"}, {"by time", "t"}}) {
    const gap::Diagnosis d = disturbed_by(0.5, disturbed);
    INFO(disturbed << ": " << text(d));
    CHECK(d.verdict == gap::Verdict::Unknown);
    CHECK(d.reduction.before > 5.0);
    REQUIRE_FALSE(d.unexplained.empty());
    CHECK(d.unexplained.front().column == "i2");
    REQUIRE_FALSE(d.unexplained.front().depends_on.empty());
    const gap::Dependence& depends = d.unexplained.front().depends_on.front();
    CHECK(gap::symbol(depends.variable) == variable);
    if (disturbed == "by time") {
      CHECK(depends.shape == gap::Shape::Oscillates);
      CHECK(std::abs(depends.period - 2 * M_PI / 9.0) < 0.01);
    }
    REQUIRE(d.excused.size() == 1);
    CHECK(d.excused.front().column == "motion.i2");
  }
}

TEST_CASE("friction of a description far from that of the arm is named on every joint, wherever the log is cut",
          "[not_sanitized]") {
  Random random(46);
  cell::Cell described = protocol::nominal();
  described.servo.reset();
  cell::Cell arm = described;
  described.drives->friction.viscous *= 30.0;  // a placeholder, as in many a URDF
  for (cell::Link& link : arm.robot.links) {
    link.mass *= 1.0 + 0.1 * random.normal();
    link.com += 0.01 * Eigen::Vector3d::NullaryExpr([&](Eigen::Index) { return random.normal(); });
  }
  for (const Eigen::Index rows : {1000, 1400}) {
    cell::Recording r;
    r.cell = described;
    r.experiments.push_back(protocol::motion(random, 0.0, static_cast<int>(rows), 2.0)
                                .experiment("fit", cell::Kind::Motion, cell::Split::Fit));
    r.experiments.push_back(
        protocol::motion(random, 60.0, 600, 2.0).experiment("check", cell::Kind::Motion, cell::Split::Check));
    for (cell::Experiment& e : r.experiments) {
      e.joint_reference = cell::JointReference::Measured;
      protocol::show(e, arm, random);
    }
    gap::DiagnoseOptions options;
    options.max_effects = 14, options.refits = 4, options.beam = 1;  // as for a log
    const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator(), options);
    INFO(rows << " rows: " << text(d));
    for (int j = 1; j <= 6; ++j) CHECK(test::names_cause(d, "viscous_friction", "joint" + std::to_string(j)));
    CHECK(d.reduction.after < 0.05 * d.reduction.before);
  }
}

TEST_CASE("gaps are relative to the noise whether the simulator is known to be off or not", "[not_sanitized]") {
  Random random(45);
  cell::Recording r = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Motion);
  for (cell::Experiment& e : r.experiments)  // an offset of 20 standard deviations, which is named
    e.data.values.col(e.data.find("i2")).array() += 20 * r.cell.noise.current;
  gap::DiagnoseOptions options;
  options.max_effects = options.refits = options.beam = 1;
  const auto gap_of_i2 = [&] {
    const gap::Diagnosis d = gap::diagnose(r, predict::FastSimulator(), options);
    INFO(text(d));
    for (const gap::ColumnReduction& c : d.reduction.columns)
      if (c.column == "motion.i2") return c.before;
    FAIL("no gap in motion.i2");
    return 0.0;
  };
  const double plain = gap_of_i2();
  options.simulator_errors = {{"motion.i2", 3 * r.cell.noise.current}};
  CHECK(gap_of_i2() == Approx(plain).epsilon(0.02));
}

}  // namespace diagnose_input_test
