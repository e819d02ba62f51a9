#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/cell/check.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/core/error.hpp>

#include "cell/sample_recording.hpp"
#include "support/reference.hpp"

namespace check_test {

using namespace kr5;
using namespace kr5::cell;
using Catch::Matchers::Contains;
namespace fs = std::filesystem;

namespace {

const std::string arc_file = KR5_SHARE_DIR "/cells/kr5_arc.yaml";

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

std::string told(const std::vector<io::Diagnostic>& diagnostics) {
  std::string text;
  for (const io::Diagnostic& p : diagnostics) text += p.text() + "\n";
  return text;
}

/// What `check` says of the sample cell with one piece of its text changed.
std::string told(const std::string& what, const std::string& by) {
  const test::Folder folder("check");
  io::write_text(folder.path / "cell.yaml", replaced(io::read_text(arc_file), what, by));
  const auto diagnostics = check(folder.path / "cell.yaml");
  for (const io::Diagnostic& p : diagnostics) {
    CHECK(p.line > 0);
    CHECK_FALSE(p.field.empty());
  }
  return told(diagnostics);
}

/// What `check` says of the sample recording with one column changed.
std::string told(const std::string& experiment, const std::string& column, const auto& change) {
  Recording recording = test::sample_recording();
  for (Experiment& e : recording.experiments)
    if (e.name == experiment) {
      auto values = e.data.values.col(e.data.find(column));
      for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = change(values[i], i);
    }
  const test::Folder folder("check_recording");
  save_recording(recording, folder.path);
  const std::string from_file = told(check(folder.path));
  recording.folder = folder.path;
  CHECK(told(check(recording)) == from_file);
  return from_file;
}

}  // namespace

TEST_CASE("the cells and the recording that ship with the library are clean") {
  CHECK(told(check(KR5_SHARE_DIR "/cells")) == "");
  CHECK(told(check(load_cell(arc_file))) == "");
  CHECK(find_documents(KR5_SHARE_DIR "/cells").size() == 4);
  const test::Folder folder("clean");
  save_recording(test::sample_recording(), folder.path / "a" / "b");
  CHECK(told(check(folder.path)) == "");
  CHECK(told(check(folder.path / "a" / "b" / "recording.yaml")) == "");
  CHECK(find_documents(folder.path) == std::vector<fs::path>{folder.path / "a" / "b" / "recording.yaml"});
}

TEST_CASE("every reference case is clean, alone and below the folder of them all") {
  const auto cases = test::reference("cases");
  CHECK(find_documents(cases).size() == 14);
  CHECK(told(check(cases)) == "");
}

TEST_CASE("angles in degrees are suspected, with the value found and the line") {
  CHECK_THAT(
      told("a: 0.18, alpha: 1.5707963267948966", "a: 0.18, alpha: 90.0"),
      Contains(
          "cell.yaml:5: robot.dh[0].alpha: found 90.0, expected an angle within a full turn [rad]; is it in degrees?"));
  CHECK_THAT(told("theta_offset: 3.141592653589793", "theta_offset: 180"),
             Contains("robot.dh[3].theta_offset: found 180,"));
  CHECK_THAT(told("lower: [-2.705260340591211", "lower: [-155"),
             Contains("robot.limits.lower[0]: found -155,") && Contains("degrees"));
  CHECK_THAT(told("velocity: [2.6878070480712677", "velocity: [154"),
             Contains("robot.limits.velocity[0]: found 154,") && Contains("deg/s"));
  CHECK_THAT(told("0.02, -0.015, 1.57]", "0.02, -0.015, 90]"), Contains("camera.T_E_C[5]: found 90,"));
  CHECK_THAT(told("pose_rotation: 8.0e-05", "pose_rotation: 0.05"), Contains("noise.pose_rotation: found 0.05,"));
}

TEST_CASE("millimetres, grams, milliseconds and newtons per millimetre are suspected") {
  CHECK_THAT(told("a: 0.6, alpha", "a: 600, alpha"), Contains("robot.dh[1].a: found 600,") && Contains("millimetres"));
  CHECK_THAT(told("b: 0.4,", "b: 400,"), Contains("robot.dh[0].b: found 400,"));
  CHECK_THAT(told("com: [-0.09, -0.06, 0.02]", "com: [-90, -60, 20]"),
             Contains("robot.links[0].com: found [-90, -60, 20],"));
  CHECK_THAT(told("mass: 38.0", "mass: 38000"),
             Contains("robot.links[0].mass: found 38000, expected a mass in kilograms; is it in grams?"));
  CHECK_THAT(told("mass: 2.4", "mass: 2400"), Contains("tool.mass: found 2400,"));
  CHECK_THAT(told("inertia: [0.75, 0.8, 0.62", "inertia: [750000, 800000, 620000"),
             Contains("robot.links[0].inertia:") && Contains("kg mm^2"));
  CHECK_THAT(told("gravity: [0.0, 0.0, -9.81]", "gravity: [0.0, 0.0, -9810]"),
             Contains("robot.gravity: found [0.0, 0.0, -9810],"));
  CHECK_THAT(told("cycle: 0.012", "cycle: 12"),
             Contains("servo.cycle: found 12, expected a period in seconds; is it in milliseconds?"));
  CHECK_THAT(told("delay: 0.024", "delay: 24"), Contains("servo.tool.delay: found 24,"));
  CHECK_THAT(told("T_F_S: [0.0, 0.0, 0.045", "T_F_S: [0.0, 0.0, 45"), Contains("tool.T_F_S[2]: found 45,"));
  CHECK_THAT(told("marker: 0.03", "marker: 30"), Contains("board.marker: found 30,"));
  CHECK_THAT(told("fx: 2328.556745", "fx: 8.0"), Contains("camera.fx: found 8.0,") && Contains("pixels"));
  CHECK_THAT(told("radius: 0.025", "radius: 25"), Contains("laser.target.radius: found 25,"));
  CHECK_THAT(told("stiffness: 23380.0", "stiffness: 23.38"),
             Contains("contact.stiffness: found 23.38,") && Contains("N/mm"));
  CHECK_THAT(told("outer_radius: 0.01265", "outer_radius: 12.65"), Contains("tube.outer_radius: found 12.65,"));
  CHECK_THAT(told("laser: 4.0e-05", "laser: 0.04"), Contains("noise.laser: found 0.04,"));
}

TEST_CASE("values no real cell has are named") {
  CHECK_THAT(told("mass: 38.0", "mass: -1"), Contains("robot.links[0].mass: found -1"));
  CHECK_THAT(told("mass: 2.4", "mass: -2.4"), Contains("tool.mass: found -2.4,"));
  CHECK_THAT(told("inertia: [0.0016, 0.0016, 0.0012, 0.0", "inertia: [0.0016, 0.0016, 0.0012, 0.002"),
             Contains("robot.links[5].inertia: found [0.0016, 0.0016, 0.0012, 0.002, 0.0, 0.0], expected a matrix "
                      "without negative principal moments"));
  CHECK_THAT(told("inertia: [0.0016, 0.0016, 0.0012", "inertia: [0.0016, 0.0016, 0.0042"),
             Contains("add up to no less than the third"));
  CHECK_THAT(told("upper: [2.705260340591211, 2.705", "upper: [-2.9, 2.705"),
             Contains("robot.limits.lower[0]:") && Contains("are lower and upper swapped?"));
  CHECK_THAT(told("velocity: [2.6878070480712677", "velocity: [-2.7"),
             Contains("robot.limits.velocity[0]: found -2.7, expected a positive speed"));
  CHECK_THAT(told("[0.0, 125.05, 0.0", "[0.0, 0.0, 0.0"), Contains("drives.structure: found a singular matrix"));
  CHECK_THAT(told("torque_constant: [0.82", "torque_constant: [0.0"),
             Contains("drives.torque_constant[0]: found 0.0,"));
  CHECK_THAT(told("rotor_inertia: [0.00052", "rotor_inertia: [-0.00052"), Contains("drives.rotor_inertia[0]:"));
  CHECK_THAT(told("coulomb: [34.0", "coulomb: [-34.0"), Contains("drives.friction.coulomb[0]: found -34.0,"));
  CHECK_THAT(told("viscous: [60.0", "viscous: [-60.0"), Contains("drives.friction.viscous[0]:"));
  CHECK_THAT(told("natural_frequency: 45.0", "natural_frequency: 0"),
             Contains("servo.joint.natural_frequency: found 0,"));
  CHECK_THAT(told("damping_ratio: 0.7492", "damping_ratio: -1"), Contains("servo.tool.damping_ratio: found -1,"));
  CHECK_THAT(told("cx: 1254.058997", "cx: 12540"),
             Contains("camera.cx: found 12540, expected a principal point inside the image"));
  CHECK_THAT(told("fy: 2334.311366", "fy: -2334"), Contains("camera.fy: found -2334,"));
  CHECK_THAT(told("rows: 5", "rows: 0"), Contains("board.rows: found 0, expected 1 to 1000 rows"));
  CHECK_THAT(told("radius: 0.00942", "radius: 0.0099"),
             Contains("peg.radius: found 0.0099,") && Contains("a wider peg does not fit"));
  CHECK_THAT(told("outer_radius: 0.01265", "outer_radius: 0.009"),
             Contains("tube.outer_radius: found 0.009, expected more than the inner radius"));
  CHECK_THAT(told("friction: 0.18", "friction: -0.18"), Contains("contact.friction: found -0.18,"));
  CHECK_THAT(told("force: 0.15", "force: -0.15"), Contains("noise.force: found -0.15,"));
  CHECK_THAT(told("damping: 40.0", "damping: .inf"), Contains("contact.damping: found .inf, expected a finite number"));
}

TEST_CASE("gears and scanner that cannot be are named") {
  const std::string before = "robot:\n";
  const auto with = [&](const std::string& text) { return told(before, before + "  gears: {" + text + "}\n"); };
  CHECK_THAT(with("stiffness: []"),
             Contains("robot.gears.stiffness: found an empty list, expected at least one value"));
  CHECK_THAT(with("stiffness: [8e5, 0]"), Contains("robot.gears.stiffness[1]: found 0, expected a positive stiffness"));
  CHECK_THAT(with("backlash_damping: -0.3"), Contains("robot.gears.backlash_damping: found -0.3,"));
  CHECK_THAT(with("side_torque: -1"), Contains("robot.gears.side_torque: found -1,"));
  CHECK_THAT(told("laser:\n", "laser:\n  bias_distance: 0\n"), Contains("laser.bias_distance: found 0,"));
  CHECK_THAT(told("laser:\n", "laser:\n  stand_off: -0.19\n"), Contains("laser.stand_off: found -0.19,"));
}

TEST_CASE("what was changed in memory is checked as it is now, in order of lines") {
  Cell cell = load_cell(arc_file);
  cell.board->T_base_target.translation().x() = 620.0;
  cell.robot.links[1].mass = std::nan("");
  cell.robot.dh[0].b = 400.0;
  const auto diagnostics = check(cell);
  REQUIRE(diagnostics.size() == 3);
  CHECK(std::is_sorted(diagnostics.begin(), diagnostics.end(),
                       [](const auto& a, const auto& b) { return a.line < b.line; }));
  CHECK_THAT(told(diagnostics), Contains("robot.dh[0].b: found 400.0") && Contains("robot.links[1].mass: found .nan") &&
                                    Contains("board.T_B_W[0]: found 620.0, expected a length in metres"));
}

TEST_CASE("effects out of bounds are named with the bounds") {
  const std::string with = "noise: {current: 0.03";
  CHECK_THAT(told(with, "effects: {backlash: {joint2: {gap: 2.5}}}\n" + with),
             Contains("effects.backlash.joint2.gap: found 2.5, expected 0 to 0.2 rad"));
  CHECK_THAT(told(with, "effects: {tube_tilt: {tube: {tilt: [0.1, 10.0]}}}\n" + with),
             Contains("effects.tube_tilt.tube.tilt: found [0.1, 10.0], expected -0.8 to 0.8 rad"));
  CHECK_THAT(told(with, "effects: {joint_elasticity: {joint2: {stiffness: -5}}}\n" + with),
             Contains("found -5, expected 1 to inf N m/rad"));
}

TEST_CASE("targets of the general form are checked like the board") {
  const test::Folder folder("targets");
  const auto told_of = [&](const std::string& what, const std::string& by) {
    io::write_text(folder.path / "c.yaml", replaced(io::read_text(KR5_SHARE_DIR "/cells/gantry_rrp.yaml"), what, by));
    return told(check(folder.path / "c.yaml"));
  };
  CHECK_THAT(told_of("marker: 0.018", "marker: 0.18"),
             Contains("targets[0].marker: found 0.18, expected a marker smaller than its square"));
  CHECK_THAT(told_of("id: 8", "id: 3"),
             Contains("targets[1].map[1].id: found 3, expected an id that occurs only once in the map"));
  CHECK_THAT(told_of("size: 0.0236", "size: 23.6"), Contains("targets[2].size: found 23.6,"));
  CHECK_THAT(told_of("upper: [2.5, 2.6, 6.2, 0.25]", "upper: [2.5, 2.6, 6.2, 250]"),
             Contains("robot.limits.upper[3]: found 250, expected a length in metres"));
}

TEST_CASE("diagnostics of form and YAML are told too, and a stray file among good ones does not hide them") {
  const test::Folder folder("form");
  io::write_text(folder.path / "a.yaml", "format: kr5-cell/1\nrobot: {dh: []}\n");
  io::write_text(folder.path / "b.yaml", "format: kr5-cell/1\nrobot: [\n");
  io::write_text(folder.path / "dataset.yaml", "images: 3\n");
  const std::string text = told(check(folder.path));
  CHECK_THAT(text, Contains("a.yaml:2: robot.dh: found an empty list, expected one row a joint"));
  CHECK_THAT(text, Contains("b.yaml: found") && Contains("not valid YAML"));
  CHECK_FALSE(text.find("dataset.yaml") != std::string::npos);
  CHECK_THAT(told(check(folder.path / "dataset.yaml")),
             Contains("dataset.yaml:1: format: found nothing, expected kr5-cell/1"));
}

TEST_CASE("a folder without cells says so, and a path that is not there is an error") {
  const test::Folder folder("nothing");
  CHECK_THAT(told(check(folder.path)), Contains("found no cell and no recording"));
  CHECK_THROWS_WITH(check(folder.path / "nowhere"), Contains("nowhere: no such file or folder"));
}

TEST_CASE("time that goes back, stands still or skips rows is found in its run") {
  CHECK_THAT(told("motion-1", "t", [](double t, auto i) { return i == 5 ? t - 0.05 : t; }),
             Contains("motion-1.csv:7: t: found 0.01, expected") && Contains("time that increases within a run"));
  CHECK_THAT(told("step-1", "t", [](double t, auto i) { return i == 9 ? t - 0.012 : t; }),
             Contains("step-1.csv:11: t: found") && Contains("out of order or duplicated"));
  CHECK_THAT(told("press-1", "t", [](double t, auto i) { return i > 9 ? t + 0.012 : t; }),
             Contains("press-1.csv:12: t:") && Contains("are rows missing"));
  CHECK_THAT(told("motion-2", "t", [](double t, auto) { return 1000 * t; }),
             Contains("motion-2.csv:3: t: found 12, and 18 more rows") && Contains("other units"));
  CHECK_THAT(told("poses-1", "t", [](double t, auto) { return -t; }),
             Contains("poses-1.csv:3: t: found") && Contains("time that does not decrease"));
  CHECK(told("press-1", "run", [](double, auto i) { return i < 10 ? 0.0 : 1.0; }) == "");
}

TEST_CASE("joints out of limits, in degrees, swapped or not following are found") {
  CHECK_THAT(told("poses-1", "q3", [](double, auto i) { return i == 4 ? 1.0 : -2.6; }),
             Contains("poses-1.csv:6: q3: found 1, expected a value within the limits -4.62512 to -1.6057 rad"));
  CHECK_THAT(told("views-1", "q1", [](double q, auto) { return q * 57.3; }),
             Contains("q1: found 11.46") && Contains("and 19 more rows") && Contains("degrees"));
  CHECK_THAT(told("scan-1", "q6", [](double, auto) { return 9.0; }), Contains("q6: found 9, and 19 more rows"));
  CHECK_THAT(told("motion-1", "q5", [](double q, auto) { return q + 0.3; }),
             Contains("motion-1.csv:2: q5: found a median distance of 0.3"));

  Recording recording = test::sample_recording();
  std::vector<std::string>& names = recording.experiments[0].data.columns;
  std::iter_swap(std::find(names.begin(), names.end(), "q2"), std::find(names.begin(), names.end(), "q6"));
  const test::Folder folder("swapped");
  save_recording(recording, folder.path);
  CHECK_THAT(told(check(folder.path)), Contains("motion-1.csv:2: q2: found a median distance of 0.2") &&
                                           Contains("it follows qc6, are columns swapped?"));
}

TEST_CASE("poses that the arm cannot have, and quaternions that are none, are found") {
  CHECK_THAT(told("poses-1", "qw", [](double, auto i) { return i == 3 ? 0.9 : 0.5; }),
             Contains("poses-1.csv:5: qw: found 0.9, expected a unit quaternion"));
  CHECK_THAT(told("poses-1", "x", [](double x, auto) { return 1000 * x; }),
             Contains("poses-1.csv:2: x: found a tool") && Contains("lengths in mm"));
}

TEST_CASE("views of markers that the board does not have, or outside the image, are found") {
  CHECK_THAT(told("views-1", "marker", [](double m, auto i) { return i == 2 ? 35 : m; }),
             Contains("views-1.csv:4: marker: found 35, expected a marker of the board, 0 to 34"));
  CHECK_THAT(told("views-1", "marker", [](double m, auto i) { return i == 2 ? 1.5 : m; }),
             Contains("marker: found 1.5, expected a whole number from 0"));
  CHECK_THAT(told("views-1", "corner", [](double, auto i) { return i == 2 ? 4 : 0; }),
             Contains("corner: found 4, expected 0, 1, 2 or 3"));
  CHECK_THAT(told("views-1", "u", [](double, auto) { return 2600.0; }),
             Contains("views-1.csv:2: u: found 2600, and 19 more rows, expected a pixel of the image, 0 to 2448"));
  CHECK_THAT(told("views-1", "v", [](double, auto) { return 2300.0; }), Contains("are u and v swapped?"));
}

TEST_CASE("scans, lengths, angles and forces out of range are found") {
  CHECK_THAT(told("scan-1", "sphere", [](double, auto i) { return i == 0 ? 0.5 : 1.0; }),
             Contains("scan-1.csv:2: sphere: found 0.5, expected 0 or 1"));
  CHECK_THAT(told("scan-1", "z", [](double z, auto) { return 1000 * z; }),
             Contains("z: found 180, and 19 more rows, expected a length in metres"));
  CHECK_THAT(told("scan-1", "z", [](double z, auto) { return -z; }),
             Contains("z: found -0.18, and 19 more rows, expected a positive range"));
  CHECK_THAT(told("press-1", "zc", [](double, auto) { return -5.0; }), Contains("zc: found -5,"));
  CHECK_THAT(told("profile-1", "tilt", [](double, auto) { return 7.5; }),
             Contains("tilt: found 7.5, and 19 more rows") && Contains("degrees"));
  CHECK_THAT(told("profile-1", "alpha", [](double, auto i) { return 18.0 * static_cast<double>(i); }),
             Contains("alpha: found 18,"));
  CHECK_THAT(told("profile-1", "fc", [](double, auto) { return -10.0; }), Contains("fc: found -10,"));
}

TEST_CASE("parts and noise that a recording needs and its cell lacks are named") {
  const test::Folder folder("lacks");
  Recording recording = test::sample_recording();
  recording.cell.camera.reset();
  recording.cell.tube.reset();
  recording.cell.noise.current = 0.0;
  save_recording(recording, folder.path);
  const std::string text = told(check(folder.path));
  CHECK_THAT(text, Contains("camera: found nothing, expected what the experiment 'views-1' (views) was made with"));
  CHECK_THAT(text, Contains("tube: found nothing") &&
                       Contains("noise.current: found nothing, expected the standard deviation of column i1"));
}

namespace {

/// Every scalar of a document that is a number, by its place.
void collect_numbers(io::Node& node, const std::string& path, std::vector<std::pair<std::string, io::Node*>>& out) {
  char* end = nullptr;
  if (node.kind == io::Node::Kind::Scalar && !node.quoted) {
    std::strtod(node.scalar.c_str(), &end);
    if (end && *end == '\0' && !node.scalar.empty()) out.emplace_back(path, &node);
  }
  for (std::size_t i = 0; i < node.items.size(); ++i)
    collect_numbers(node.items[i], path + "[" + std::to_string(i) + "]", out);
  for (auto& [key, entry] : node.entries) collect_numbers(entry, path + "." + key, out);
}

bool loads(const io::Node& root) {
  try {
    parse_cell(io::to_yaml(root), "cell.yaml").validate();  // what loads is valid
    return true;
  } catch (const IoError& e) {
    CHECK_THAT(e.what(), Contains("cell.yaml:") && Contains("expected"));
    return false;
  }
}

}  // namespace

TEST_CASE("no number of a cell loads when it is infinite, huge or no number, and every one that loads is valid") {
  for (const char* file : {"kr5_arc.yaml", "gantry_rrp.yaml"}) {
    io::Node root = io::load_yaml(std::string(KR5_SHARE_DIR "/cells/") + file);
    std::vector<std::pair<std::string, io::Node*>> numbers;
    collect_numbers(root, "", numbers);
    REQUIRE(numbers.size() > 100);
    for (const auto& [path, node] : numbers) {
      CAPTURE(file, path);
      const std::string before = node->scalar;
      const bool may_be_infinite = path.find("limits.velocity") != path.npos || path.find("limits.effort") != path.npos;
      for (const char* value : {".inf", "-.inf", "1.0e+308", "-1.0e+308", ".nan"}) {
        CAPTURE(value);
        node->scalar = value;
        if (may_be_infinite && node->scalar == ".inf") continue;  // no limit
        CHECK_FALSE(loads(root));
      }
      for (const char* value : {"0.0", "-1.0", "1.0e-300", "-1.0e-300"}) {
        CAPTURE(value);
        node->scalar = value;
        loads(root);
      }
      node->scalar = before;
    }
  }
}

TEST_CASE("what cannot be simulated is an error, what looks like another unit a warning") {
  const std::string text = io::read_text(arc_file);
  const auto error = [&](const std::string& what, const std::string& by) {
    try {
      parse_cell(replaced(text, what, by), "cell.yaml");
    } catch (const IoError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  CHECK_THAT(error("natural_frequency: 45.0", "natural_frequency: 1e308"), Contains("servo.joint.natural_frequency"));
  CHECK_THAT(error("damping: 40.0", "damping: .inf"),
             Contains("contact.damping: found .inf, expected a finite number"));
  CHECK_THAT(error("friction: 0.18", "friction: -0.18"), Contains("contact.friction"));
  CHECK(error("T_F_S: [0.0, 0.0, 0.045", "T_F_S: [0.0, 0.0, 45").empty());
  CHECK_THAT(told("T_F_S: [0.0, 0.0, 0.045", "T_F_S: [0.0, 0.0, 45"), Contains("is it in millimetres"));
}

TEST_CASE("a cell changed in memory is refused by validate, with field and remedy") {
  Cell cell = load_cell(arc_file);
  CHECK_NOTHROW(cell.validate());
  cell.robot.links[1].mass = std::numeric_limits<double>::infinity();
  CHECK_THROWS_AS(cell.validate(), InvalidArgument);
  CHECK_THROWS_WITH(cell.validate(), Contains("robot.links[1].mass: found .inf, expected a finite number"));
  cell = load_cell(arc_file);
  cell.noise.current = std::numeric_limits<double>::infinity();
  CHECK_THROWS_WITH(cell.validate(), Contains("noise.current"));
  cell = load_cell(arc_file);
  cell.robot.limits->upper.resize(2);
  CHECK_THROWS_WITH(cell.validate(), Contains("robot.limits.upper: found 2 values"));
}

TEST_CASE("loading a recording checks it, and warnings do not keep it from being loaded") {
  const auto error = [](const auto& change) {
    Recording recording = test::sample_recording();
    change(recording);
    const test::Folder folder("load_checks");
    save_recording(recording, folder.path);
    try {
      load_recording(folder.path);
    } catch (const IoError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const auto column = [](Recording& r, std::size_t e, const std::string& name) {
    return r.experiments[e].data.values.col(r.experiments[e].data.find(name));
  };
  CHECK(error([](Recording&) {}).empty());
  CHECK_THAT(error([&](Recording& r) { column(r, 0, "t").reverseInPlace(); }), Contains("motion-1.csv:3: t: found"));
  CHECK_THAT(error([&](Recording& r) { column(r, 0, "i1")[3] = 1e200; }), Contains("i1: found 1e+200"));
  CHECK_THAT(error([&](Recording& r) { column(r, 2, "qw").setConstant(0.9); }), Contains("unit quaternion"));
  CHECK_THAT(error([](Recording& r) { r.cell.tube.reset(); }), Contains("tube: found nothing"));
  CHECK_THAT(error([](Recording& r) { r.experiments[1].data = r.experiments[0].data; }),
             Contains("motion-2.csv: found the rows of 'motion-1' again"));
  CHECK(error([&](Recording& r) { column(r, 3, "u").setConstant(9000.0); }).empty());  // a warning
}

TEST_CASE("currents in milliamperes, torques in newton millimetres and data that show nothing are warned of") {
  CHECK_THAT(told("motion-1", "i2", [](double, auto) { return 2500.0; }), Contains("is it in mA?"));
  CHECK_THAT(told("press-1", "ty", [](double, auto) { return 4200.0; }), Contains("is it in N mm?"));
  Recording recording = test::sample_recording();
  Experiment& e = recording.experiments[0];
  e.data.values = e.data.values.topRows(1).eval();
  CHECK_THAT(told(check(recording)), Contains("found 1 row, expected at least 10 rows"));
  recording = test::sample_recording();
  for (int j = 1; j <= 6; ++j) {
    auto& data = recording.experiments[0].data;
    data.values.col(data.find("qc" + std::to_string(j)))
        .setConstant(data.values(0, data.find("qc" + std::to_string(j))));
  }
  CHECK_THAT(told(check(recording)), Contains("the same value in every row, for every joint"));
}

TEST_CASE("links that lead nowhere or in a circle are passed over in a folder, and an error when named") {
  const test::Folder folder("links");
  fs::copy_file(arc_file, folder.path / "cell.yaml");
  fs::create_symlink("b.yaml", folder.path / "a.yaml");
  fs::create_symlink("a.yaml", folder.path / "b.yaml");
  fs::create_symlink(folder.path, folder.path / "again");
  CHECK(find_documents(folder.path).size() == 1);
  CHECK_THROWS_AS(find_documents(folder.path / "a.yaml"), IoError);
  CHECK_THROWS_AS(load_cell(folder.path / "a.yaml"), IoError);
  CHECK_THROWS_AS(load_recording(folder.path / "a.yaml"), IoError);
}

}  // namespace check_test
