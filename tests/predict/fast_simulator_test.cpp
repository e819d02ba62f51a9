#include <kr5/predict/fast_simulator.hpp>

#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <thread>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "predict/world.hpp"
#include "support/usual_effect.hpp"

namespace fast_simulator_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;

namespace {

/// Columns that mean the same thing.
std::string group_of(cell::Kind kind, const std::string& column) {
  const std::string kind_name(name_of(kind));
  const bool wrench = std::set<std::string>{"fx", "fy", "fz", "tx", "ty", "tz"}.contains(column);
  if (wrench) return kind_name + ".wrench";
  if (kind == cell::Kind::Poses) return kind_name + (column.size() == 1 ? ".position" : ".orientation");
  if (kind == cell::Kind::Views) return "views";
  if (kind == cell::Kind::Scan) return "scan";
  return kind_name + "." + column.substr(0, 1);
}

std::set<std::string> changed(const World& before, const World& after) {
  std::set<std::string> out;
  for (const auto& [kind, name] : cell::enum_names(cell::Kind{})) {
    const io::Table a = before.show(kind), b = after.show(kind);
    REQUIRE(a.columns == b.columns);
    for (std::size_t c = 0; c < a.columns.size(); ++c)
      if (a.values.col(c) != b.values.col(c)) out.insert(group_of(kind, a.columns[c]));
  }
  return out;
}

struct Case {
  std::string effect, target;
  Parameters parameters;
  std::set<std::string> changes;
};

const std::set<std::string> currents = {"motion.i"};
const std::set<std::string> arm = {"motion.i", "motion.wrench", "poses.position", "poses.orientation", "views", "scan"};
const std::set<std::string> servo = {"motion.q", "motion.i", "motion.wrench"};
const std::set<std::string> path = {"step.z", "press.z", "press.wrench"};
const std::set<std::string> wrench = {"motion.wrench", "press.wrench", "profile.wrench"};
const std::set<std::string> contact = {"press.wrench", "profile.z"};

/// Effects of the catalogue, on one target each, and all they may touch. A row that is not among them is tried at its
/// usual size, and touches what its kin touch.
std::vector<Case> stated_cases(const World& world) {
  const Pose nudge = from_xyzrpy(0.01 * Vector6::Ones());
  return {
      {"coulomb_friction", "joint2", {{"coulomb", 50.0}}, currents},
      {"viscous_friction", "joint2", {{"viscous", 90.0}}, currents},
      {"stribeck_friction", "joint2", {{"stribeck", 20.0}, {"stribeck_velocity", 0.05}}, currents},
      {"load_friction", "joint2", {{"coefficient", 0.1}}, currents},
      {"thermal_friction", "joint2", {{"drop", 0.3}, {"time_constant", 100.0}}, currents},
      {"joint_elasticity", "joint5", {{"stiffness", 2600.0}}, arm},
      {"backlash", "joint5", {{"gap", 0.002}}, arm},
      {"torque_constant", "joint3", {{"torque_constant", 0.7}}, currents},
      {"rotor_inertia", "joint3", {{"rotor_inertia", 0.001}}, currents},
      {"cable_spring", "joint4", {{"stiffness", 5.0}, {"rest", 0.3}}, currents},
      {"torque_ripple", "joint1", {{"amplitude", 3.0}, {"cycles", 12.0}, {"phase", 0.5}}, currents},
      {"wrist_coupling", "motor6", {{"element", 3.0}, {"value", -1.4}}, currents},
      {"payload",
       "tool",
       {{"mass", 0.3}, {"com", numbers({0.01, 0.02, 0.1})}},
       {"motion.i", "motion.wrench", "press.wrench", "profile.wrench"}},
      {"link_mass", "joint3", {{"mass", 20.0}}, currents},
      {"link_com", "joint4", {{"com", numbers({0.02, 0.01, -0.15})}}, currents},
      {"base_tilt", "base", {{"roll", 0.004}, {"pitch", -0.003}}, arm},
      {"encoder_offset", "joint2", {{"offset", 0.002}}, arm},
      {"link_length", "joint2", {{"a", 0.602}}, {"motion.i", "motion.wrench", "poses.position", "views", "scan"}},
      {"link_twist", "joint3", {{"alpha", 1.575}}, arm},
      {"transmission_error", "joint3", {{"amplitude", 0.001}, {"cycles", 7.0}}, arm},
      {"tool_offset", "tool", {{"offset", numbers({0.001, 0.0, 0.0005})}}, {"poses.position"}},
      {"thermal_growth",
       "links",
       {{"growth", 0.001}, {"time_constant", 300.0}},
       {"motion.i", "motion.wrench", "poses.position", "views", "scan"}},
      {"current_delay", "drives", {{"delay", 0.006}}, currents},
      {"joint_servo", "joint2", {{"natural_frequency", 30.0}}, servo},
      {"joint_delay", "drives", {{"delay", 0.024}}, servo},
      {"tool_servo", "servo", {{"natural_frequency", 4.0}}, path},
      {"tool_damping", "servo", {{"damping_ratio", 0.6}}, path},
      {"tool_delay", "servo", {{"delay", 0.06}}, path},
      {"ft_bias", "fy", {{"bias", 2.0}}, wrench},
      {"ft_drift", "tz", {{"rate", 0.01}}, wrench},
      {"ft_gain", "fz", {{"gain", 1.1}}, wrench},
      {"ft_crosstalk", "tx", {{"source", 2.0}, {"gain", 0.01}}, wrench},
      {"ft_lag", "force_torque", {{"time_constant", 0.03}}, wrench},
      {"camera_focal", "camera", {{"fx", 2330.0}, {"fy", 2330.0}}, {"views"}},
      {"lens_distortion", "camera", {{"k1", -0.19}, {"k2", 0.01}}, {"views"}},
      {"hand_eye", "camera", {{"T_E_C", *world.cell.camera->T_tool_camera * nudge}}, {"views"}},
      {"laser_mount", "laser", {{"T_E_L", *world.cell.laser->T_tool_scanner * nudge}}, {"scan"}},
      {"laser_bias", "laser", {{"bias", 0.001}}, {"scan"}},
      {"laser_lag", "laser", {{"lag", 0.02}}, {"scan"}},
      {"contact_stiffness", "contact", {{"stiffness", 15000.0}}, contact},
      {"contact_hardening", "contact", {{"hardening", 0.5}}, contact},
      {"contact_friction", "contact", {{"friction", 0.25}}, {"profile.wrench"}},
      {"gripper_compliance", "gripper", {{"lateral", 1e-5}, {"axial", 1e-5}}, contact},
      {"tube_tilt", "tube", {{"tilt", numbers({0.02, -0.01})}}, {"profile.z"}},
      {"tube_shift", "tube", {{"shift", numbers({0.001, 0.0005, 0.0})}}, {"profile.z"}},
      {"tube_radius", "tube", {{"inner_radius", 0.0098}}, {"profile.z"}},
  };
}

/// Whether two effects sit on the same kind of target and act on the same part of a cell beside it.
bool are_kin(const cell::Effect& a, const cell::Effect& b) {
  return a.target == b.target && a.needs.part == b.needs.part;
}

/// What the kin of an effect touch; empty when it has none that all touch the same.
std::set<std::string> touched_by_kin(const cell::Effect& effect, const std::vector<Case>& stated) {
  std::set<std::set<std::string>> out;
  for (const Case& c : stated)
    if (are_kin(cell::find_effect(c.effect), effect)) out.insert(c.changes);
  return out.size() == 1 ? *out.begin() : std::set<std::string>{};
}

/// Every effect of the catalogue.
std::vector<Case> cases(const World& world) {
  const std::vector<Case> stated = stated_cases(world);
  std::vector<Case> out = stated;
  for (const cell::Effect& effect : cell::effect_catalogue()) {
    if (std::ranges::any_of(stated, [&](const Case& c) { return c.effect == effect.id; })) continue;
    const std::vector<std::string> targets = cell::effect_targets(effect, world.cell);
    if (!cell::lacking_part(effect, world.cell).empty()) continue;
    const std::size_t middle = targets.size() / 2;
    out.push_back({effect.id, targets.at(middle), usual_values(world.cell, effect, static_cast<int>(middle)),
                   touched_by_kin(effect, stated)});
  }
  return out;
}

}  // namespace

TEST_CASE("an effect that no test names is tried as its kin") {
  const World world;
  const std::vector<Case> stated = stated_cases(world);
  CHECK(touched_by_kin(cell::find_effect("link_com"), stated) == currents);
  CHECK(touched_by_kin(cell::find_effect("ft_gain"), stated) == wrench);
  CHECK(touched_by_kin(cell::find_effect("encoder_offset"), stated).empty());  // a friction has the same target
}

TEST_CASE("every effect of the catalogue changes the columns it may touch, and no other") {
  const World world;
  std::set<std::string> seen;
  for (const Case& c : cases(world)) {
    INFO(c.effect);
    seen.insert(c.effect);
    CHECK(changed(world, world.with(c.effect, c.target, c.parameters)) == c.changes);
  }
  for (const cell::Effect& effect : cell::effect_catalogue()) {
    INFO(effect.id);  // those of torque servos: servo_arm_test
    CHECK(seen.contains(effect.id) == cell::lacking_part(effect, world.cell).empty());
  }
}

TEST_CASE("an effect at its off value leaves no trace, bit for bit") {
  const World world;
  for (const cell::Effect& effect : cell::effect_catalogue())
    for (const std::string& target : cell::effect_targets(effect, world.cell)) {
      World off = world;
      for (const cell::EffectParameter& p : effect.parameters) {
        if (p.nominal_when_off) continue;  // off is: as in the cell
        const cell::EffectValue value = p.off.size() == 1
                                            ? cell::EffectValue(p.off[0])
                                            : cell::EffectValue(Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(
                                                  p.off.data(), static_cast<Eigen::Index>(p.off.size()))));
        cell::set_effect(off.cell, effect.id, target, p.name, value);
      }
      INFO(effect.id << " on " << target);
      CHECK(changed(world, off).empty());
    }
}

TEST_CASE("a value equal to the believed one leaves no trace either") {
  const World w;
  const cell::Cell& c = w.cell;
  const World same = w.with("coulomb_friction", "joint2", {{"coulomb", c.drives->friction.coulomb[1]}})
                         .with("rotor_inertia", "joint6", {{"rotor_inertia", c.drives->rotor_inertia[5]}})
                         .with("wrist_coupling", "motor6", {{"element", 3.0}, {"value", c.drives->structure(5, 3)}})
                         .with("link_length", "joint4", {{"b", c.robot.dh[3].b}})
                         .with("link_mass", "joint2", {{"mass", c.robot.links[1].mass}})
                         .with("link_com", "joint3", {{"com", Eigen::VectorXd(c.robot.links[2].com)}})
                         .with("tool_delay", "servo", {{"delay", c.servo->tool->delay}})
                         .with("hand_eye", "camera", {{"T_E_C", *c.camera->T_tool_camera}})
                         .with("contact_stiffness", "contact", {{"stiffness", c.contact->stiffness}})
                         .with("tube_radius", "tube", {{"inner_radius", c.tube->inner_radius}});
  CHECK(changed(w, same).empty());
}

TEST_CASE("drawn sets of effects predict finite numbers, the same by every thread") {
  const World world;
  const auto catalogue = cases(world);
  Random random(7);
  for (int draw = 0; draw < 40; ++draw) {
    World w = world;
    for (int i = 0; i < 6; ++i) {
      const Case& c = catalogue[static_cast<std::size_t>(random.integer(static_cast<int>(catalogue.size())))];
      w = w.with(c.effect, c.target, c.parameters);
    }
    for (const auto& [kind, name] : cell::enum_names(cell::Kind{})) {
      INFO(name << ", draw " << draw);
      const io::Table here = w.show(kind);
      io::Table there;
      std::thread([&w, &there, one = kind] { there = w.show(one); }).join();
      CHECK(here.values.allFinite());
      CHECK((here.values.array() == there.values.array()).all());
    }
  }
}

TEST_CASE("an experiment is predicted with the columns of its kind, in their order") {
  const World world;
  for (const auto& [kind, name] : cell::enum_names(cell::Kind{})) {
    const io::Table shown = world.show(kind);
    std::vector<std::string> expected;
    for (const cell::Column& c : cell::columns(kind, 6))
      if (c.role == cell::Role::Predicted && !c.name.starts_with("tau")) expected.push_back(c.name);
    CHECK(shown.columns == expected);
    CHECK(shown.values.rows() == world.of(kind).data.values.rows());
  }
}

TEST_CASE("a cell without drives shows joint torques, without masses only angles and the tool's wrench") {
  World w;
  const Eigen::VectorXd i2 = [&] {
    World rigid = w;
    rigid.cell.drives->rotor_inertia.setZero();
    rigid.cell.drives->friction.coulomb.setZero();
    rigid.cell.drives->friction.viscous.setZero();
    return Eigen::VectorXd(rigid.show(cell::Kind::Motion, "i2"));
  }();
  const double factor = w.cell.drives->structure(1, 1) * w.cell.drives->torque_constant[1];
  w.cell.drives.reset();
  const io::Table shown = w.show(cell::Kind::Motion);
  CHECK(shown.find("i1") < 0);
  CHECK((shown.column("tau2") - factor * i2).norm() < 1e-9 * shown.column("tau2").norm());
  w.cell.robot.links.clear();
  CHECK(w.show(cell::Kind::Motion).columns ==
        std::vector<std::string>{"q1", "q2", "q3", "q4", "q5", "q6", "fx", "fy", "fz", "tx", "ty", "tz"});
  w.cell.camera.reset();  // which, like the scanner, is placed from the tool
  w.cell.laser.reset();
  w.cell.tool.reset();
  CHECK(w.show(cell::Kind::Motion).columns == std::vector<std::string>{"q1", "q2", "q3", "q4", "q5", "q6"});
}

TEST_CASE("a target of the general form is seen as the same board of the short form") {
  World w;
  const io::Table board = w.show(cell::Kind::Views);
  cell::Target map;
  map.kind = TargetKind::MarkerMap;
  map.T_base_target = w.cell.board->T_base_target;
  for (int id = 0; id < 35; ++id) {
    Pose T = Pose::Identity();
    const int down = id / 7, across = id % 7;
    T.translation() << across * 0.04 + 0.015, down * 0.04 + 0.015, 0.0;
    map.map.push_back({id, 0.03, T});
  }
  w.cell.board.reset();
  w.cell.targets = {map};
  CHECK((w.show(cell::Kind::Views).values - board.values).cwiseAbs().maxCoeff() < 1e-9);
}

TEST_CASE("what is missing or wrong is named") {
  World w;
  const auto complains = [&](cell::Kind kind, const std::string& text) {
    CHECK_THROWS_WITH(w.show(kind), Contains(text));
    CHECK_THROWS_AS(w.show(kind), InvalidArgument);
    w = World();
  };
  w.of(cell::Kind::Motion).data.columns[3] = "other";
  complains(cell::Kind::Motion, "motion-1' (motion): has no column 'qc3'");
  w.of(cell::Kind::Press).data.values(7, 2) = std::numeric_limits<double>::quiet_NaN();
  complains(cell::Kind::Press, "column 'zc', row 8: found nan, expected a finite number");
  w.of(cell::Kind::Motion).data.values(5, 0) = 0.0;
  complains(cell::Kind::Motion, "column 't', row 6: does not increase");
  w.of(cell::Kind::Scan).data.values.resize(0, 10);
  complains(cell::Kind::Scan, "has no rows");
  w.of(cell::Kind::Views).data.values(3, 8) = 99;
  complains(cell::Kind::Views, "has no marker 99");
  w.cell.servo.reset();
  complains(cell::Kind::Motion, "needs 'servo.joint', which the cell does not have");
  w.cell.servo->tool.reset();
  complains(cell::Kind::Step, "needs 'servo.tool'");
  w.cell.board.reset();
  complains(cell::Kind::Views, "needs 'board'");
  w.cell.laser->target.reset();
  complains(cell::Kind::Scan, "needs 'laser.target'");
  w.cell.contact.reset();
  complains(cell::Kind::Press, "needs 'contact'");
  w.cell.tube.reset();
  complains(cell::Kind::Profile, "needs 'tube'");
  w.cell.robot.links.clear();
  w.cell.effects.set("backlash", "joint5", "gap", 0.001);
  complains(cell::Kind::Poses, "needs 'robot.links'");
  w.cell.effects.set("backlash", "joint9", "gap", 0.001);
  complains(cell::Kind::Step, "effects.backlash.joint9");
}

TEST_CASE("step experiments obey mode and limits of the cell") {
  World w;
  const Eigen::VectorXd free = w.show(cell::Kind::Step, "z");
  w.cell.servo->correction = cell::Correction{cell::CorrectionMode::Absolute, {}, 0.004};
  const Eigen::VectorXd held = w.show(cell::Kind::Step, "z");
  CHECK((held - 0.4 * free).cwiseAbs().maxCoeff() < 1e-12);  // steps of 0.01 m cut to 0.004 m
  w.cell.servo->correction = cell::Correction{cell::CorrectionMode::Relative, {}, {}};
  const Eigen::VectorXd moved = w.show(cell::Kind::Step, "z");
  CHECK(moved[299] > 2 * free[299]);
}

TEST_CASE("a prediction refuses an invalid cell and names the field") {
  const cell::Cell good = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  cell::Experiment e;
  e.kind = cell::Kind::Step;
  e.data = {{"run", "t", "zc"}, Eigen::MatrixXd::Zero(2, 3)};
  CHECK_NOTHROW(predict::FastSimulator().predict(good, e));
  cell::Cell wrong = good;
  wrong.tool->mass = 0.0;
  CHECK_THROWS_AS(predict::FastSimulator().predict(wrong, e), InvalidArgument);
  CHECK_THROWS_WITH(predict::FastSimulator().predict(wrong, e), Catch::Contains("tool.mass"));
  wrong = good;
  wrong.robot.links[2].mass = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(predict::FastSimulator().predict(wrong, e), Catch::Contains("robot.links[2].mass"));
}

}  // namespace fast_simulator_test
