// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <functional>
#include <set>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>
#include <kr5/predict/fast_simulator.hpp>
#include <kr5/sim/dart_simulator.hpp>

#include "support/reference.hpp"
#include "support/usual_effect.hpp"

namespace dart_simulator_test {

using namespace kr5;
using cell::Kind;

namespace {

using Change = std::function<void(cell::Cell&)>;

Change effect(const char* id, const char* target,
              const std::vector<std::pair<std::string, cell::EffectValue>>& parameters) {
  return [=](cell::Cell& cell) {
    for (const auto& [name, value] : parameters) cell::set_effect(cell, id, target, name, value);
  };
}

cell::EffectValue list(std::initializer_list<double> values) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(values.size()));
  std::copy(values.begin(), values.end(), out.begin());
  return out;
}

double sigma(const cell::Noise& noise, const std::string& key) {
  const double out = noise.of(key);
  return out > 0 ? out : 1.0;
}

/// The largest RMS difference of the two grades in any column, in noise.
double difference(const cell::Cell& cell, const cell::Experiment& experiment, double step = 0.0) {
  const io::Table full = sim::DartSimulator({step}).predict(cell, experiment);
  const io::Table fast = predict::FastSimulator().predict(cell, experiment);
  REQUIRE(full.columns == fast.columns);
  REQUIRE(full.values.rows() == fast.values.rows());
  double worst = 0.0;
  for (const cell::Column& column : cell::columns(experiment.kind, cell.robot.joints())) {
    if (full.find(column.name) < 0) continue;
    const Eigen::VectorXd error = full.column(column.name) - fast.column(column.name);
    REQUIRE(error.allFinite());
    const double rms = std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
    worst = std::max(worst, rms / sigma(cell.noise, column.noise));
  }
  return worst;
}

/// The given columns of one real experiment of a kind, the first `rows` of it.
cell::Experiment part_of(const cell::Recording& recording, const std::string& name, Eigen::Index rows) {
  cell::Experiment out = recording.experiment(name);
  out.data.values = Eigen::MatrixXd(out.data.values.topRows(std::min(rows, out.data.values.rows())));
  return out;
}

/// A quaternion and its negative are the same rotation.
void align_signs(io::Table& shown, const io::Table& recorded) {
  const int at = shown.find("qw");
  for (Eigen::Index k = 0; k < shown.values.rows(); ++k) {
    auto q = shown.values.block<1, 4>(k, at);
    if (q.dot(recorded.values.block<1, 4>(k, recorded.find("qw"))) < 0.0) q = -q;
  }
}

Pose moved(Pose T) {
  T.translation().x() += 2e-3;
  return T.rotate(Eigen::AngleAxisd(3e-3, Eigen::Vector3d::UnitY()));
}

/// A number, a vector, or the rows of a pose.
cell::EffectValue value_of(const io::Node& node) {
  if (node.kind != io::Node::Kind::Sequence) return std::stod(node.scalar);
  const std::size_t count = node.items.size();
  if (count == 4) {
    Pose T;
    for (std::size_t i = 0; i < 16; ++i)
      T(static_cast<int>(i / 4), static_cast<int>(i % 4)) = std::stod(node.items[i / 4].items[i % 4].scalar);
    return T;
  }
  Eigen::VectorXd out(static_cast<Eigen::Index>(count));
  for (std::size_t i = 0; i < count; ++i) out[static_cast<Eigen::Index>(i)] = std::stod(node.items[i].scalar);
  return out;
}

std::string complaint(const cell::Cell& cell, const cell::Experiment& experiment,
                      const sim::DartSimulatorOptions& options = {}) {
  try {
    sim::DartSimulator(options).predict(cell, experiment);
  } catch (const InvalidArgument& e) {
    return e.what();
  }
  return "";
}

}  // namespace

TEST_CASE("full and fast grade agree within a tenth of the noise in every kind, without and with every effect") {
  const auto folder = test::reference("cases/case-006");
  const cell::Recording recording = cell::load_recording(folder);
  const double tilt = 0.02;
  const std::vector<std::pair<std::string, std::vector<Change>>> tried = {
      {"motion-3",
       {[](cell::Cell&) {},
        effect("coulomb_friction", "joint2", {{"coulomb", 55.0}}),
        effect("viscous_friction", "joint3", {{"viscous", 40.0}}),
        effect("stribeck_friction", "joint2", {{"stribeck", 20.0}, {"stribeck_velocity", 0.05}}),
        effect("load_friction", "joint3", {{"coefficient", 0.1}}),
        effect("driven_friction", "joint3", {{"coefficient", 0.1}}),
        effect("quadratic_drag", "joint2", {{"quadratic", 40.0}}),
        effect("angle_friction", "joint3", {{"amplitude", 8.0}, {"cycles", 4.0}, {"phase", 0.4}}),
        effect("thermal_friction", "joint1", {{"drop", 0.3}, {"time_constant", 20.0}}),
        effect("torque_constant", "joint4", {{"torque_constant", 0.42}}),
        effect("rotor_inertia", "joint1", {{"rotor_inertia", 0.0008}}),
        effect("cable_spring", "joint3", {{"stiffness", 30.0}, {"rest", -2.0}}),
        effect("torque_ripple", "joint4", {{"amplitude", 3.0}, {"cycles", 7.0}, {"phase", 0.4}}),
        effect("wrist_coupling", "motor6", {{"element", 3.0}, {"value", -2.0}}),
        effect("payload", "tool", {{"mass", 0.4}, {"com", list({0.02, -0.01, 0.1})}}),
        effect("link_mass", "joint3", {{"mass", 20.0}}),
        effect("link_com", "joint4", {{"com", list({0.02, 0.01, -0.15})}}),
        effect("base_tilt", "base", {{"roll", tilt}, {"pitch", -tilt}}),
        effect("encoder_offset", "joint2", {{"offset", 0.01}}),
        effect("link_length", "joint2", {{"a", 0.61}}),
        effect("link_twist", "joint3", {{"alpha", 1.56}}),
        effect("transmission_error", "joint3", {{"amplitude", 1e-3}, {"cycles", 9.0}}),
        effect("thermal_growth", "links", {{"growth", 2e-3}}),
        effect("current_delay", "drives", {{"delay", 0.007}}),
        effect("joint_servo", "joint5", {{"natural_frequency", 30.0}}),
        effect("joint_delay", "drives", {{"delay", 0.03}}),
        effect("ft_lag", "force_torque", {{"time_constant", 0.04}}),
        effect("ft_crosstalk", "fx", {{"source", 4.0}, {"gain", 0.3}}),
        effect("joint_elasticity", "joint6", {{"stiffness", 1500.0}}),
        effect("joint_elasticity", "joint5", {{"stiffness", 400.0}}),
        effect("joint_elasticity", "joint2", {{"stiffness", 4e4}}),
        effect("joint_elasticity", "joint1", {{"stiffness", 4e4}}),
        effect("ft_bias", "fx", {{"bias", 1.0}}),
        effect("ft_drift", "ty", {{"rate", 0.01}}),
        effect("ft_gain", "tx", {{"gain", 1.1}})}},
      {"poses-1",
       {[](cell::Cell&) {}, effect("joint_elasticity", "joint2", {{"stiffness", 1e5}}),
        effect("backlash", "joint5", {{"gap", 2e-3}}), effect("tool_offset", "tool", {{"offset", list({1e-3, 0, 0})}}),
        effect("thermal_growth", "links", {{"growth", 2e-3}}),
        effect("base_tilt", "base", {{"roll", tilt}, {"pitch", tilt}}),
        effect("transmission_error", "joint3", {{"amplitude", 1e-3}, {"cycles", 9.0}})}},
      {"views-1",
       {[](cell::Cell&) {}, effect("camera_focal", "camera", {{"fx", 2340.0}, {"fy", 2320.0}}),
        effect("lens_distortion", "camera", {{"k1", -0.19}}), effect("link_length", "joint4", {{"b", 0.621}}),
        [](cell::Cell& cell) {
          cell::set_effect(cell, "hand_eye", "camera", "T_E_C", moved(cell.camera->T_tool_camera.value()));
        }}},
      {"scan-1",
       {[](cell::Cell&) {},
        [](cell::Cell& cell) {
          cell::set_effect(cell, "laser_mount", "laser", "T_E_L", moved(cell.laser->T_tool_scanner.value()));
        },
        effect("laser_bias", "laser", {{"bias", 1e-3}}), effect("laser_lag", "laser", {{"lag", 0.02}}),
        effect("cable_spring", "joint3", {{"stiffness", 30.0}, {"rest", 0.0}})}},
      {"step-1",
       {[](cell::Cell&) {}, effect("tool_servo", "servo", {{"natural_frequency", 4.0}}),
        effect("tool_damping", "servo", {{"damping_ratio", 1.3}}), effect("tool_delay", "servo", {{"delay", 0.06}})}},
      {"press-1",
       {[](cell::Cell&) {}, effect("contact_stiffness", "contact", {{"stiffness", 15000.0}}),
        effect("contact_hardening", "contact", {{"hardening", 0.8}}),
        effect("gripper_compliance", "gripper", {{"axial", 1e-5}}),
        effect("payload", "tool", {{"mass", 0.4}, {"com", list({0.02, -0.01, 0.1})}}),
        effect("ft_gain", "fz", {{"gain", 1.1}})}},
      {"profile-2",
       {[](cell::Cell&) {}, effect("contact_stiffness", "contact", {{"stiffness", 15000.0}}),
        effect("contact_friction", "contact", {{"friction", 0.3}}),
        effect("gripper_compliance", "gripper", {{"lateral", 2e-5}, {"axial", 1e-5}}),
        effect("tube_tilt", "tube", {{"tilt", list({0.04, -0.02})}}),
        effect("tube_shift", "tube", {{"shift", list({6e-4, -3e-4, 2e-4})}}),
        effect("tube_radius", "tube", {{"inner_radius", 0.0099}})}},
  };
  std::set<std::string> seen = {"backlash"};  // in motion it has a case of its own below
  const auto try_all = [&](const std::string& name, const std::vector<Change>& changes) {
    const cell::Experiment experiment = part_of(recording, name, 400);
    for (std::size_t i = 0; i < changes.size(); ++i) {
      cell::Cell cell = recording.cell;
      changes[i](cell);
      for (const cell::ActiveEffect& active : cell::active_effects(cell.effects)) seen.insert(active.id);
      INFO(name << ", change " << i);
      CHECK(difference(cell, experiment) < 0.1);
    }
  };
  for (const auto& [name, changes] : tried) try_all(name, changes);
  for (const cell::Effect& each : cell::effect_catalogue()) {  // whatever row came since: at its usual size, everywhere
    if (seen.contains(each.id)) continue;
    INFO(each.id);
    const std::vector<std::string> targets = cell::effect_targets(each, recording.cell);
    if (each.needs.part.starts_with("torque servo")) continue;  // this grade does not simulate them
    REQUIRE_FALSE(targets.empty());
    const std::size_t middle = targets.size() / 2;
    const Change change = [&](cell::Cell& cell) {
      test::put_usual(cell, each, targets[middle], static_cast<int>(middle));
    };
    for (const auto& one : tried) try_all(one.first, {change});
    CHECK(seen.contains(each.id));
  }
}

TEST_CASE(
    "full and fast grade agree within a tenth of the noise on backlash, also where nothing loads the joint at rest") {
  const auto folder = test::reference("cases/case-006");
  const cell::Recording recording = cell::load_recording(folder);
  const cell::Experiment experiment = part_of(recording, "motion-3", 400);
  for (const char* joint : {"joint1", "joint2", "joint4"}) {
    cell::Cell cell = recording.cell;
    cell::set_effect(cell, "backlash", joint, "gap", 1.5e-3);
    const io::Table full = sim::DartSimulator().predict(cell, experiment);
    const io::Table fast = predict::FastSimulator().predict(cell, experiment);
    for (const cell::Column& column : cell::columns(experiment.kind, 6)) {
      if (full.find(column.name) < 0) continue;
      const Eigen::VectorXd error = full.column(column.name) - fast.column(column.name);
      INFO(joint << ' ' << column.name);
      const double off = error.norm() / std::sqrt(error.size()) / sigma(cell.noise, column.noise);
      CHECK(off < 0.1);
    }
  }
}

TEST_CASE("the full grade shows what was recorded of every cell with known effects, down to the noise",
          "[not_sanitized]") {
  const auto folder = test::reference("cases");
  const io::Node labels = io::load_yaml(folder / "labels.json");
  REQUIRE(labels.entries.size() == 14);
  for (const auto& [name, label] : labels.entries) {
    const cell::Recording recording = cell::load_recording(folder / name);
    cell::Cell cell = recording.cell;
    bool blows = false;
    for (const io::Node& e : label.find("effects")->items) {
      const std::string id = e.find("effect")->scalar, target = e.find("target")->scalar;
      blows |= id == "backlash";
      for (const auto& [parameter, value] : e.find("parameters")->entries)
        cell::set_effect(cell, id, target, parameter, value_of(value));
    }
    for (const cell::Experiment& whole : recording.experiments) {
      const cell::Experiment experiment = part_of(recording, whole.name, 300);
      io::Table full = sim::DartSimulator().predict(cell, experiment);
      if (whole.kind == Kind::Poses) align_signs(full, experiment.data);
      for (const cell::Column& column : cell::columns(experiment.kind, 6)) {
        if (column.noise.empty() || full.find(column.name) < 0) continue;
        const Eigen::VectorXd error = full.column(column.name) - experiment.data.column(column.name);
        const auto rows = static_cast<double>(error.size());
        INFO(name << ' ' << experiment.name << '.' << column.name);
        const bool blow = blows && column.noise != "position" && column.noise != "current";
        const double limit = blow ? 2.0 : 1.0 + 4.5 / std::sqrt(2.0 * rows);  // 4.5 sigma of the chi-square
        CHECK(error.norm() / std::sqrt(rows) / sigma(cell.noise, column.noise) < limit);
      }
    }
  }
}

TEST_CASE("the full grade shows what was recorded of a healthy cell, down to the noise") {
  const auto folder = test::reference("cases/case-006");
  const cell::Recording recording = cell::load_recording(folder);
  for (const char* name : {"motion-1", "views-1", "scan-1", "press-1", "profile-2"}) {
    const cell::Experiment& experiment = recording.experiment(name);
    const io::Table full = sim::DartSimulator().predict(recording.cell, experiment);
    for (const cell::Column& column : cell::columns(experiment.kind, 6)) {
      if (column.noise.empty() || full.find(column.name) < 0) continue;
      const Eigen::VectorXd error = full.column(column.name) - experiment.data.column(column.name);
      INFO(name << "." << column.name);
      const double gap = error.norm() / std::sqrt(error.size()) / sigma(recording.cell.noise, column.noise);
      CHECK(gap < 1.0 + 4.5 / std::sqrt(2.0 * static_cast<double>(error.size())));  // 4.5 sigma of the chi-square
      CHECK(gap > 1.0 - 4.5 / std::sqrt(2.0 * static_cast<double>(error.size())));
    }
  }
}

TEST_CASE("both grades move an arm through measured angles alike, with elastic gears and without") {
  const auto folder = test::reference("cases/case-006");
  const cell::Recording recording = cell::load_recording(folder);
  cell::Experiment experiment = part_of(recording, "motion-3", 400);
  experiment.joint_reference = cell::JointReference::Measured;
  cell::Cell cell = recording.cell;
  cell.servo.reset();
  CHECK(difference(cell, experiment) < 0.1);
  cell::set_effect(cell, "joint_elasticity", "joint5", "stiffness", 6000.0);
  CHECK(difference(cell, experiment) < 0.1);
}

TEST_CASE("what cannot be simulated is named: limits, masses, joints, columns and steps") {
  const cell::Cell good = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  cell::Experiment still{"still", Kind::Motion, "still.csv", cell::Split::Fit, {}};
  still.data.columns = {"t", "qc1", "qc2", "qc3", "qc4", "qc5", "qc6"};
  still.data.values.resize(5, 7);
  for (int k = 0; k < 5; ++k) still.data.values.row(k) << 0.012 * k, 0.1, 0.2, -2.5, 0.1, -0.3, 0.2;
  CHECK(complaint(good, still).empty());
  SECTION("a command beyond the limits") {
    still.data.values(3, 3) = -1.0;
    CHECK_THAT(complaint(good, still), Catch::Contains("experiment 'still' (motion): column 'qc3', row 4: found -1") &&
                                           Catch::Contains("robot.limits.upper[2] is -1.60570"));
  }
  SECTION("a column that is missing") {
    still.data.columns[2] = "other";
    CHECK_THAT(complaint(good, still), Catch::Contains("has no column 'qc2'"));
  }
  SECTION("time that stands still") {
    still.data.values(2, 0) = still.data.values(1, 0);
    CHECK_THAT(complaint(good, still), Catch::Contains("column 't', row 3: does not increase"));
  }
  SECTION("an inertia that is not positive") {
    cell::Cell cell = good;
    cell.robot.links[3].inertia[0] = -0.1;
    CHECK_THAT(complaint(cell, still), Catch::Contains("robot.links[3].inertia"));
  }
  SECTION("an effect on a joint that is not there") {
    cell::Cell cell = good;
    cell.effects.set("backlash", "joint8", "gap", 1e-3);
    CHECK_THAT(complaint(cell, still), Catch::Contains("joint8") && Catch::Contains("joint6"));
  }
  SECTION("a part the cell does not have") {
    cell::Cell cell = good;
    cell.servo.reset();
    CHECK_THAT(complaint(cell, still), Catch::Contains("needs 'servo.joint'"));
    cell::Experiment view{"view", Kind::Views, "view.csv", cell::Split::Fit, {}};
    view.data.columns = {"view", "t", "q1", "q2", "q3", "q4", "q5", "q6", "marker", "corner"};
    view.data.values = Eigen::MatrixXd::Zero(1, 10);
    cell.camera.reset();
    CHECK_THAT(complaint(cell, view), Catch::Contains("needs 'camera'"));
  }
  SECTION("a step that is not stable") {
    cell::Cell cell = good;
    cell::set_effect(cell, "backlash", "joint6", "gap", 1e-3);
    CHECK_THAT(complaint(cell, still, {5e-3}),
               Catch::Contains("5 ms is not stable") && Catch::Contains("the stable bound here is"));
    CHECK_THROWS_WITH(sim::DartSimulator({-1.0}), Catch::StartsWith("step:"));
  }
}

TEST_CASE("an arm of other joints is simulated as well, without drives its torques are shown") {
  cell::Cell cell = cell::load_cell(KR5_SHARE_DIR "/cells/gantry_rrp.yaml");
  cell.effects = {};
  cell::Experiment move{"move", Kind::Motion, "move.csv", cell::Split::Fit, {}};
  move.data.columns = {"t", "qc1", "qc2", "qc3", "qc4"};
  move.data.values.resize(200, 5);
  for (int k = 0; k < 200; ++k) {
    const double t = 0.004 * k, s = std::sin(3 * t);
    move.data.values.row(k) << t, 0.3 * s, 0.5 - 0.2 * s, 0.1 * s, 0.1 + 0.05 * s;
  }
  CHECK(difference(cell, move) < 0.1);
  cell.drives.reset();
  CHECK(difference(cell, move, 2.5e-4) < 0.1);  // the noise of a torque is tiny beside the torques of a large arm
  CHECK(sim::DartSimulator().predict(cell, move).find("tau4") >= 0);
}

}  // namespace dart_simulator_test
