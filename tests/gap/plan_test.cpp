#include <kr5/gap/plan.hpp>

#include <algorithm>
#include <map>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/gap/hypotheses.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include <support/rates.hpp>
#include <support/trials.hpp>
#include "gap/protocol.hpp"

namespace plan_test {

using namespace kr5;

namespace {

/// The first rows of the first experiment of each kind: what a hasty person records.
cell::Recording hasty(cell::Recording r, Random& random) {
  const std::map<cell::Kind, Eigen::Index> rows = {
      {cell::Kind::Motion, 250}, {cell::Kind::Poses, 6},   {cell::Kind::Views, 72},   {cell::Kind::Scan, 300},
      {cell::Kind::Step, 120},   {cell::Kind::Press, 300}, {cell::Kind::Profile, 300}};
  std::erase_if(r.experiments, [](const cell::Experiment& e) { return !e.name.ends_with("-1"); });
  for (cell::Experiment& e : r.experiments) {
    const Eigen::Index most = std::min(e.data.values.rows(), rows.at(e.kind) + random.integer(20));
    e.data.values = Eigen::MatrixXd(e.data.values.topRows(most));
  }
  return r;
}

/// Effects that are alike in hasty recordings of a kind. A joint or component is drawn at random for `*`.
struct Suspects {
  cell::Kind kind;
  gap::EffectName first, second;
};

const std::vector<Suspects>& suspects() {
  using enum cell::Kind;
  static const std::vector<Suspects> all = {
      {Motion, {"coulomb_friction", "joint*"}, {"stribeck_friction", "joint*"}},
      {Motion, {"coulomb_friction", "joint*"}, {"load_friction", "joint*"}},
      {Motion, {"coulomb_friction", "joint*"}, {"thermal_friction", "joint*"}},
      {Motion, {"viscous_friction", "joint*"}, {"thermal_friction", "joint*"}},
      {Motion, {"torque_constant", "joint*"}, {"cable_spring", "joint*"}},
      {Motion, {"joint_delay", "drives"}, {"joint_servo", "joint*"}},
      {Motion, {"rotor_inertia", "joint*"}, {"current_delay", "drives"}},
      {Motion, {"ft_bias", "fx"}, {"ft_drift", "fx"}},
      {Motion, {"ft_bias", "tz"}, {"ft_drift", "tz"}},
      {Motion, {"ft_gain", "fz"}, {"ft_bias", "fz"}},
      {Poses, {"encoder_offset", "joint*"}, {"link_twist", "joint*"}},
      {Poses, {"link_length", "joint*"}, {"joint_elasticity", "joint*"}},
      {Poses, {"encoder_offset", "joint6"}, {"tool_offset", "tool"}},
      {Poses, {"base_tilt", "base"}, {"link_twist", "joint*"}},
      {Poses, {"thermal_growth", "links"}, {"link_length", "joint*"}},
      {Views, {"camera_focal", "camera"}, {"hand_eye", "camera"}},
      {Views, {"lens_distortion", "camera"}, {"camera_focal", "camera"}},
      {Scan, {"laser_bias", "laser"}, {"laser_mount", "laser"}},
      {Scan, {"laser_lag", "laser"}, {"laser_mount", "laser"}},
      {Step, {"tool_servo", "servo"}, {"tool_damping", "servo"}},
      {Step, {"tool_servo", "servo"}, {"tool_delay", "servo"}},
      {Press, {"contact_stiffness", "contact"}, {"contact_hardening", "contact"}},
      {Profile, {"tube_shift", "tube"}, {"tube_tilt", "tube"}},
      {Profile, {"contact_friction", "contact"}, {"gripper_compliance", "gripper"}}};
  return all;
}

gap::EffectName at_random(gap::EffectName name, int joint) {
  if (name.target.ends_with("*")) name.target = name.target.substr(0, name.target.size() - 1) + std::to_string(joint);
  return name;
}

/// A hasty recording of a cell with one of two effects, one to three times its usual size.
struct Tie {
  cell::Recording recording;
  std::vector<gap::Alternative> alternatives;
};

Tie draw_tie(Random& random) {
  const Suspects& drawn = suspects()[static_cast<std::size_t>(random.integer(static_cast<int>(suspects().size())))];
  const int joint = 2 + random.integer(4);  // joint 1 carries no weight, joint 6 hardly any
  Tie out;
  out.alternatives = {{at_random(drawn.first, joint)}, {at_random(drawn.second, joint)}};
  if (random.integer(2) == 1) std::swap(out.alternatives[0], out.alternatives[1]);
  const gap::EffectName& carried = out.alternatives[0][0];
  cell::Cell c = protocol::nominal();
  for (const gap::Hypothesis& h : gap::hypotheses(c, {0.0, 300.0}))
    if (h.effect == carried.effect && h.target == carried.target) {
      Eigen::VectorXd x = h.probes.front().points.front() * random.uniform(1.0, 3.0);
      for (Eigen::Index i = 0; i < x.size(); ++i) {
        const gap::Coordinate& bounds = h.coordinates[static_cast<std::size_t>(i)];
        x(i) = std::clamp(x(i), bounds.lower, bounds.upper);
      }
      h.apply(c, x);
      break;
    }
  out.recording = hasty(protocol::record(c, random), random);
  std::erase_if(out.recording.experiments, [&](const cell::Experiment& e) { return e.kind != drawn.kind; });
  return out;
}

/// What a cell would show in a planned experiment, done as often as planned.
cell::Recording done(const gap::Plan& plan, std::size_t truth, const cell::Recording& before, Random& random) {
  const gap::PlannedExperiment& best = plan.experiments.front();
  cell::Recording out;
  out.cell = best.load > 0 ? gap::with_load(before.cell, best.load) : before.cell;
  const cell::Cell real = best.load > 0 ? gap::with_load(plan.cells[truth], best.load) : plan.cells[truth];
  for (int i = 0; i < best.repeats; ++i) {
    out.experiments.push_back(best.experiment);
    out.experiments.back().name += std::to_string(i);
    protocol::show(out.experiments.back(), real, random);
  }
  return out;
}

std::string text(const std::vector<gap::Alternative>& all) {
  std::string out;
  for (const gap::Alternative& a : all)
    for (const gap::EffectName& name : a) out += name.effect + " " + name.target + " | ";
  return out;
}

}  // namespace

TEST_CASE("the planned experiment tells random ties apart", "[not_sanitized][statistics]") {
  constexpr double tied = 3.0;  // separation of a hasty recording below which it decides nothing
  const int trials = test::trials(200, 3);
  gap::PlanOptions options;
  options.load = 3.0;
  Random random(31);
  int right = 0, decided = 0, inseparable = 0;
  double expected = 0.0;
  std::string log;
  while (decided < trials) {
    const Tie tie = draw_tie(random);
    const gap::Plan plan = gap::plan(tie.recording, predict::FastSimulator(), tie.alternatives, options);
    if (plan.already > tied) continue;
    INFO(text(tie.alternatives) << plan.text);
    REQUIRE(plan.cells.size() == 2);
    if (plan.exact_tie || plan.experiments.front().separation_repeated < 5.0) {
      log += "inseparable: " + text(tie.alternatives) + plan.text + "\n";
      REQUIRE(++inseparable < trials + 10);
      continue;
    }
    const auto truth = static_cast<std::size_t>(random.integer(2));
    const cell::Recording next = done(plan, truth, tie.recording, random);
    const gap::ModelComparison w =
        gap::compare_models({tie.recording, next}, predict::FastSimulator(), tie.alternatives);
    ++decided;
    expected += plan.experiments.front().wrong;
    const bool is_right = w.best == static_cast<int>(truth);
    right += is_right;
    log += (is_right ? "right: " : "WRONG: ") + text(tie.alternatives) + plan.text + "\n";
  }
  INFO(log << right << " of " << decided << " right, " << expected << " wrong expected");
  if (test::full()) WARN(log << right << " of " << decided << " right, " << inseparable << " inseparable");
  test::check_rate(right, decided, 0.95, 0.93);
}

TEST_CASE("what no sensor of the cell can tell apart is called an exact tie") {
  Random random(32);
  // Axes 2 and 3 are parallel: an offset along one is an offset along the other.
  const cell::Recording r = protocol::only(
      protocol::record(protocol::carrying("link_length", "joint2", "b", 2e-3), random), cell::Kind::Poses);
  const gap::Plan plan =
      gap::plan(r, predict::FastSimulator(), {{{"link_length", "joint2"}}, {{"link_length", "joint3"}}});
  INFO(plan.text);
  CHECK(plan.exact_tie);
  CHECK(plan.experiments.empty());
  CHECK(plan.already < 0.5);
  CHECK(plan.text.find("link_length on joint3") != std::string::npos);
}

TEST_CASE("planned motions stay within what the arm may do") {
  Random random(33);
  const cell::Recording r = protocol::only(
      hasty(protocol::record(protocol::carrying("coulomb_friction", "joint2", "coulomb", 46.0), random), random),
      cell::Kind::Motion);
  gap::PlanOptions options;
  options.load = 3.0;
  options.keep = 100;
  const gap::Plan plan = gap::plan(r, predict::FastSimulator(),
                                   {{{"coulomb_friction", "joint2"}}, {{"load_friction", "joint2"}}}, options);
  const cell::Limits& limits = *r.cell.robot.limits;
  bool loaded = false;
  int motions = 0;
  for (const gap::PlannedExperiment& p : plan.experiments) {
    CAPTURE(p.what);
    loaded |= p.load > 0;
    CHECK(p.seconds > 0);
    if (p.experiment.kind != cell::Kind::Motion) continue;
    ++motions;
    const Eigen::MatrixXd q = p.experiment.data.values.rightCols(6);
    const Eigen::Index n = q.rows() - 1;
    for (int j = 0; j < 6; ++j) {
      CHECK(q.col(j).minCoeff() >= limits.lower(j));
      CHECK(q.col(j).maxCoeff() <= limits.upper(j));
      const Eigen::VectorXd rate = (q.col(j).tail(n) - q.col(j).head(n)) / 0.012;
      CHECK(rate.cwiseAbs().maxCoeff() <= limits.velocity(j));
    }
  }
  CHECK(loaded);
  CHECK(motions > 2);
}

TEST_CASE("effects that the recording does not show are told apart at a usual size") {
  Random random(34);
  const cell::Recording r = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Step);
  const gap::Plan plan =
      gap::plan(r, predict::FastSimulator(), {{{"tool_servo", "servo"}}, {{"tool_damping", "servo"}}});
  INFO(plan.text);
  CHECK(plan.assumed);
  CHECK_FALSE(plan.exact_tie);
}

TEST_CASE("what a diagnosis could not tell apart is what to plan for") {
  gap::Diagnosis diagnosis;
  CHECK(gap::tied_alternatives(diagnosis).empty());
  diagnosis.causes = {{{"backlash", "joint5"}, 1}, {{"payload", "tool"}, 1}};
  CHECK(gap::tied_alternatives(diagnosis).empty());
  diagnosis.causes[0].tied_with = {{"joint_elasticity", "joint5"}, {"encoder_offset", "joint5"}};
  diagnosis.causes[1].tied_with = {{"ft_bias", "fz"}};
  const gap::EffectName play{"backlash", "joint5"}, load{"payload", "tool"};
  const std::vector<gap::Alternative> expected = {{play, load},
                                                  {{"joint_elasticity", "joint5"}, load},
                                                  {{"encoder_offset", "joint5"}, load},
                                                  {play, {"ft_bias", "fz"}}};
  CHECK(gap::tied_alternatives(diagnosis) == expected);
}

TEST_CASE("measured motions of a cell without servos are planned for, and nothing is called a tie that was not tried",
          "[not_sanitized]") {
  Random random(77);
  cell::Recording r = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Motion);
  r.cell.servo.reset();
  for (cell::Experiment& e : r.experiments) e.joint_reference = cell::JointReference::Measured;
  gap::PlanOptions options;
  options.keep = 3;
  const gap::Plan plan = gap::plan(r, predict::FastSimulator(),
                                   {{{"coulomb_friction", "joint2"}}, {{"viscous_friction", "joint2"}}}, options);
  INFO(plan.text);
  CHECK_FALSE(plan.exact_tie);
  REQUIRE_FALSE(plan.experiments.empty());
  CHECK(plan.experiments.front().separation_repeated > options.separation);
  for (const gap::PlannedExperiment& e : plan.experiments)
    CHECK((e.experiment.kind != cell::Kind::Motion || e.experiment.joint_reference == cell::JointReference::Measured));
}

TEST_CASE("plans that make no sense are refused") {
  Random random(35);
  const cell::Recording r = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Step);
  const predict::FastSimulator simulator;
  const gap::Alternative servo = {{"tool_servo", "servo"}};
  CHECK_THROWS_AS(gap::plan(r, simulator, {servo}), InvalidArgument);
  CHECK_THROWS_WITH(gap::plan(r, simulator, {servo, {{"tool_servo", "joint1"}}}), Catch::Contains("joint1"));
  CHECK_THROWS_WITH(gap::plan(r, simulator, {servo, {{"camera_focal", "camera"}}}),
                    Catch::Contains("does not show in this recording"));
  gap::PlanOptions options;
  options.speed = 2.0;
  CHECK_THROWS_WITH(options.validate(), Catch::Contains("speed"));
  CHECK(gap::with_load(r.cell, 2.0).tool->mass == Approx(r.cell.tool->mass + 2.0));
  CHECK_THROWS_AS(gap::with_load(r.cell, -1.0), InvalidArgument);
}

}  // namespace plan_test
