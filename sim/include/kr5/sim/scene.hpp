// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/io/csv.hpp>
#include <kr5/robot/cycle.hpp>
#include <kr5/sim/mesh_contact.hpp>
#include <kr5/sim/scene_view.hpp>

/// @file
/// Scenes: a cell, its objects, its controller, its duration, and the expected results. Format `kr5-scene/1`.

namespace kr5::sim {

enum class ControllerKind {
  Off,      ///< No current: the arm falls, or friction and gears hold it.
  Servo,    ///< The joint servos follow a target, whatever it takes.
  Limited,  ///< The same within a current limit.
  Push,     ///< The tool alone, on a slide, is pushed at the tube with its peg.
};
constexpr auto enum_names(ControllerKind) {
  using enum ControllerKind;
  return names<ControllerKind>({{Off, "off"}, {Servo, "servo"}, {Limited, "limited"}, {Push, "push"}});
}

struct Controller {
  ControllerKind kind = ControllerKind::Servo;
  Eigen::VectorXd target;  ///< [rad or m]
  std::vector<WayPoint> way_points;
  double within = 0.0;                               ///< [s]
  double rest = 0.5;                                 ///< [s]
  Eigen::VectorXd amplitude;                         ///< [rad or m]
  double frequency = 0.0;                            ///< [Hz]
  Eigen::VectorXd current_limit;                     ///< [A]
  double force = 15.0;                               ///< [N]
  double speed = 0.02;                               ///< [m/s]
  double tilt = 0.0;                                 ///< [rad]
  double turns = 0.0;                                ///< [-]
  Eigen::Vector2d offset = Eigen::Vector2d::Zero();  ///< [m]
  double height = 0.002;                             ///< [m]
  Eigen::Vector3d direction = {0.0, 0.0, -1.0};      ///< [-]

  static constexpr std::array<std::string_view, 1> required = {"kind"};
  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Kind of the controller: off | servo | limited | push.");
    visit("target", self.target, "Target joint values; empty: stay at the start [rad or m].");
    visit("way_points", self.way_points, "Way points, one after the other, in place of a target.");
    visit("within", self.within, "Duration of the smooth motion to the target, or to each way point; 0: a step [s].");
    visit("rest", self.rest, "Time at rest at each way point [s].");
    visit("amplitude", self.amplitude, "Amplitude of a sine of each joint about its start; empty: none [rad or m].");
    visit("frequency", self.frequency, "Frequency of that sine [Hz].");
    visit("current_limit", self.current_limit, "Maximum current of each motor, for kind limited [A].");
    visit("force", self.force, "Force of a push [N].");
    visit("speed", self.speed, "Maximum speed of a push [m/s].");
    visit("tilt", self.tilt, "Tilt of the pushed peg [rad].");
    visit("turns", self.turns, "Number of turns of the direction of tilt during the scene [-].");
    visit("offset", self.offset, "Offset of the peg-bottom centre from the axis of the tube, x and y in T [m].");
    visit("height", self.height, "Height of the pushed peg above the top face at the start [m].");
    visit("direction", self.direction,
          "Direction of the push, along which the tool moves freely; of any length, in T [-].");
  }
};

/// What the arm can meet.
struct Objects {
  std::optional<double> bench;                     ///< [m]
  double push_at = 0.0;                            ///< [s]
  Eigen::Vector3d push = Eigen::Vector3d::Zero();  ///< [N]
  std::vector<cell::PlacedObject> solids;

  static void each_field(auto& self, auto&& visit) {
    visit("bench", self.bench, "Height in B of a flat bench that the tool tip touches; stiffness is the cell's [m].");
    visit("push_at", self.push_at, "Time from which the tool is pushed [s].");
    visit("push", self.push, "Force of that push, in B, at the sensor [N].");
    visit("solids", self.solids,
          "Balls, tubes and plates that camera and scanner see, in addition to those of the cell.");
  }
};

/// From `at` on the cell carries these effects instead; the arm keeps its place.
struct SceneEvent {
  double at = 0.0;  ///< [s]
  cell::Effects effects;

  static constexpr std::array<std::string_view, 2> required = {"at", "effects"};
  static void each_field(auto& self, auto&& visit) {
    visit("at", self.at, "Time of the event [s].");
    visit("effects", self.effects, "Effects of the cell from that time on.");
  }
};

enum class Statistic { Last, Mean, Min, Max, Range, Rms };
constexpr auto enum_names(Statistic) {
  using enum Statistic;
  return names<Statistic>({{Last, "last"}, {Mean, "mean"}, {Min, "min"}, {Max, "max"}, {Range, "range"}, {Rms, "rms"}});
}
constexpr auto old_names(Statistic) {
  return names<Statistic>({{Statistic::Min, "least"}, {Statistic::Max, "greatest"}});
}

/// What a column of the scene must show.
struct Expectation {
  std::string column;
  Statistic statistic = Statistic::Last;
  double begin = 0.0;         ///< [s]
  std::optional<double> end;  ///< [s]
  std::optional<double> min, max;

  static constexpr std::array<std::string_view, 1> required = {"column"};
  static void each_field(auto& self, auto&& visit) {
    visit("column", self.column, "Column of the scene, e.g. q2, i3, fz, z, energy.");
    visit("statistic", self.statistic, "Statistic from begin to end: last | mean | min | max | range | rms.");
    visit("begin", self.begin, "Time of the first row that counts [s].");
    visit("end", self.end, "Time of the last row that counts; without it, the end of the scene [s].");
    visit("min", self.min, "Minimum allowed value of the statistic.");
    visit("max", self.max, "Maximum allowed value of the statistic.");
  }
};

struct Scene {
  std::string format;
  std::string name;
  std::string cell;
  std::optional<cell::Effects> effects;
  Eigen::VectorXd start;              ///< [rad or m]
  std::optional<Pose> start_pose;     ///< T_base_tool.
  double duration = 1.0;              ///< [s]
  double step = 0.0;                  ///< [s]
  double cycle = robot::usual_cycle;  ///< [s]
  ContactBy contact = ContactBy::ClosedForm;
  bool frictionless = false;
  Controller controller;
  Objects objects;
  std::optional<ScenePictures> camera;
  std::optional<SceneScan> scanner;
  std::vector<SceneEvent> events;
  std::vector<Expectation> expect;
  std::filesystem::path file;  ///< It was read from; no field of it.

  static constexpr std::array<std::string_view, 5> required = {"format", "cell", "duration", "controller", "expect"};
  static void each_field(auto& self, auto&& visit) {
    visit("format", self.format, "kr5-scene/1.");
    visit("name", self.name, "Name of the scene.");
    visit("cell", self.cell, "File of the cell, beside the scene or from its folder.");
    visit("effects", self.effects, "Effects of the cell, in place of those in its file.");
    visit("start", self.start, "Joint values at the start, in place of a pose [rad or m].");
    visit("start_pose", self.start_pose, "Tool tip in B at the start [m, rad].");
    visit("duration", self.duration, "Duration of the scene [s].");
    visit("step", self.step, "Step of the integration; 0: automatic [s].");
    visit("cycle", self.cycle, "Period of the rows of a cell without servo; with a servo, its servo.cycle [s].");
    visit("contact", self.contact, "Search of the contacts of peg and tube: closed_form | mesh (ODE, slower).");
    visit("frictionless", self.frictionless, "Joints without dry and viscous friction.");
    visit("controller", self.controller, "Controller that drives the arm.");
    visit("objects", self.objects, "Objects that the arm can touch or see.");
    visit("camera", self.camera, "Pictures that the camera of the cell takes.");
    visit("scanner", self.scanner, "Profiles that the line scanner of the cell takes.");
    visit("events", self.events, "Changes of the effects during the scene.");
    visit("expect", self.expect, "Expectations by which the scene passes or fails.");
  }
};

struct SceneCheck {
  Expectation expected;
  double value = 0.0;
  bool passed = false;

  static void each_field(auto& self, auto&& visit) {
    visit("expected", self.expected, "Expectation.");
    visit("value", self.value, "Value of the statistic.");
    visit("passed", self.passed, "Whether the value lies within least and most.");
  }
};

struct SceneResult {
  bool passed = false;
  std::vector<SceneCheck> checks;
  int steps = 0;
  io::Table rows;                          ///< A row every cycle of the controller.
  cell::Cell cell;                         ///< With the effects it carried in the end.
  std::vector<cell::PlacedObject> solids;  ///< Those of the scene, its bench too.
  std::optional<ScenePictures> camera;
  std::vector<ScenePicture> pictures;
  io::Table profiles;  ///< Of the scanner, columns of the kind `scan`; points without a range are left out.
};

/// Period of the rows of a scene [s]: that of the cell's controller, or without one that of the scene.
double scene_cycle(const Scene& scene, const cell::Cell& cell);

/// @throws IoError with file, line and field of everything that is wrong in form, or a cell that cannot be read.
Scene load_scene(const std::filesystem::path& file);

/// Columns of an arm: t, q1..n (motor side), link1..n, i1..n (with drives), fx..tz, x y z of the tool tip (with tool),
/// energy, limited, range (with a scanner: the least of the last profile, NaN when there is none). Of a push: t, z (peg
/// bottom over the top face), fx..tz, depth of the contact, push, x y of the peg bottom in T, tilt, alpha.
/// @throws InvalidArgument naming file and field: a start or way point that is not reachable or beyond the limits, a
///         column that is not there, a picture on which there is nothing, a scanner that never met anything within its
///         range, and for every error of DrivenArm.
SceneResult run_scene(const Scene& scene);
SceneResult run_scene(const std::filesystem::path& file);

}  // namespace kr5::sim
