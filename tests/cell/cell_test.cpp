#include <chrono>
#include <filesystem>

#include <catch2/catch.hpp>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/io/format.hpp>

#include "support/reference.hpp"

namespace cell_test {

using namespace kr5;
using namespace kr5::cell;
using Catch::Matchers::Contains;

namespace {

const std::string arc_file = KR5_SHARE_DIR "/cells/kr5_arc.yaml";
const std::string general_file = KR5_SHARE_DIR "/cells/gantry_rrp.yaml";

/// All numbers of a cell, each to its last bit.
std::string exact(Cell cell) {
  cell.source.reset();
  return to_yaml(cell);
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  REQUIRE(at != std::string::npos);
  return text.replace(at, what.size(), by);
}

std::string complaint(const std::string& yaml) {
  try {
    parse_cell(yaml, "cell.yaml");
  } catch (const IoError& e) {
    return e.what();
  }
  return "none";
}

}  // namespace

TEST_CASE("the short form is read into SI numbers") {
  const Cell cell = load_cell(arc_file);
  CHECK(cell.name == "kr5_arc");
  CHECK(cell.robot.joints() == 6);
  CHECK(cell.robot.dh[3].b == 0.62);
  CHECK(cell.robot.links[2].inertia_matrix()(0, 2) == -0.008);
  CHECK(cell.robot.links[2].inertia_matrix()(2, 0) == -0.008);
  CHECK(cell.drives->structure(5, 4) == 1.0);
  CHECK(cell.servo->of_joint(4).natural_frequency == 45.0);
  CHECK(cell.servo->tool->damping_ratio == 0.7492);
  CHECK(cell.camera->pinhole().k1 == -0.201788);
  CHECK(cell.camera->pinhole().width == 2448);
  CHECK(cell.board->target().size == 0.03);
  CHECK(cell.noise.position == 2e-5);
  CHECK_FALSE(cell.robot.limits->effort.size());
}

TEST_CASE("the general form is read: other joints, per-joint servo, lens, mounts, targets, chamfers and effects") {
  const Cell cell = load_cell(general_file);
  REQUIRE(cell.robot.joints() == 4);
  CHECK(cell.robot.dh[3].type == kinematics::JointType::Prismatic);
  CHECK(cell.robot.dh[1].beta == 0.001);
  CHECK(cell.robot.T_base_0.translation().z() == 0.8);
  CHECK(cell.robot.limits->effort[3] == 300.0);
  CHECK(cell.servo->of_joint(0).natural_frequency == 60.0);
  CHECK(cell.servo->of_joint(3).natural_frequency == 80.0);
  CHECK(cell.servo->of_joint(3).damping_ratio == 0.9);
  CHECK(cell.camera->mount == Mount::EyeToHand);
  CHECK(cell.camera->pinhole().k6 == 0.002);
  CHECK(cell.camera->pinhole().p2 == 0.0002);
  REQUIRE(cell.targets.size() == 3);
  CHECK(cell.targets[1].kind == TargetKind::MarkerMap);
  CHECK(cell.targets[1].map.at(1).T_target_marker.translation().x() == 0.1);
  CHECK(cell.laser->T_flange_scanner.has_value());
  CHECK(cell.tube->chamfer == 0.0005);
  CHECK(cell.effects.number("backlash", "gap", 3) == 2e-5);
  CHECK(cell.effects.replaced_number("lens_distortion", "k1") == -0.11);
  CHECK_FALSE(T_flange_camera(cell));
  CHECK(T_flange_scanner(cell)->matrix() == cell.laser->T_flange_scanner->matrix());
}

TEST_CASE("a cell is written in the form it was read, and reads back bit for bit") {
  for (const std::string& file : {arc_file, general_file}) {
    const Cell cell = load_cell(file);
    CHECK(io::parse_yaml(to_yaml(cell), "t") == *cell.source);
    CHECK(exact(parse_cell(to_yaml(cell), "t")) == exact(cell));
    CHECK(exact(parse_cell(exact(cell), "t")) == exact(cell));
  }
}

TEST_CASE("what changed is written, what did not keeps its text") {
  Cell cell = load_cell(arc_file);
  cell.robot.dh[1].a = 0.6000123456789;
  cell.tube.reset();
  cell.camera->T_tool_camera = to_pose((Vector6() << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6).finished());
  cell.noise.laser = 1.0 / 3.0;
  const std::string text = to_yaml(cell);
  CHECK_THAT(text, Contains("a: 0.6000123456789") && !Contains("tube:") && Contains("alpha: 3.141592653589793"));
  CHECK_THAT(text, Contains("position: 2.0e-05") && Contains("laser: 0.3333333333333333"));
  const Cell back = parse_cell(text, "t");
  CHECK(exact(back) == exact(cell));
  CHECK(back.camera->T_tool_camera->matrix() == cell.camera->T_tool_camera->matrix());
}

TEST_CASE("any numbers at all go through the file unchanged") {
  Random random(4);
  Cell cell = load_cell(general_file);
  for (int trial = 0; trial < 50; ++trial) {
    for (auto& row : cell.robot.dh)
      row = {row.type, random.normal(), random.normal(), random.normal(), random.normal(), random.normal()};
    for (auto& link : cell.robot.links) {
      Vector6 inertia = 0.02 * random.normal_vector(6);
      inertia.head<3>().array() += 1.0;  // of a body that can be
      link = {random.uniform(), random.normal_vector(3), inertia};
    }
    cell.tool->T_flange_tool = to_pose(random.normal_vector(6));
    cell.drives->structure = Eigen::MatrixXd(random.normal_vector(16)).reshaped(4, 4);
    cell.servo->joint.resize(trial % 2 ? 1 : 4, {random.uniform(), random.uniform(), random.uniform()});
    CHECK(exact(parse_cell(to_yaml(cell), "t")) == exact(cell));
  }
}

TEST_CASE("all cells of the reference cases load and round trip exactly") {
  const auto cases = test::reference("cases");
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(cases)) {
    if (!entry.is_directory()) continue;
    const Cell cell = load_cell(entry.path() / "cell.yaml");
    CHECK(io::parse_yaml(to_yaml(cell), "t") == *cell.source);
    CHECK(exact(parse_cell(exact(cell), "t")) == exact(cell));
    ++count;
  }
  CHECK(count == 14);
}

TEST_CASE("an unknown, missing or mistyped key is named with file, line and field") {
  const std::string text = io::read_text(arc_file);
  CHECK_THAT(complaint(replaced(text, "rotor_inertia", "rotor_inerta")),
             Contains("cell.yaml:46: drives.rotor_inerta: found an unknown key, expected no such key; did you mean "
                      "'rotor_inertia'?") &&
                 Contains("drives.rotor_inertia: found nothing, expected this key"));
  CHECK_THAT(complaint(replaced(text, "mass: 38.0", "mass: heavy")),
             Contains("robot.links[0].mass: found 'heavy', expected a number"));
  CHECK_THAT(complaint(replaced(text, "com: [-0.09, -0.06, 0.02]", "com: [-0.09, -0.06]")),
             Contains("robot.links[0].com: found a list of 2, expected a list of 3 numbers"));
  CHECK_THAT(complaint(replaced(text, "a: 0.18", "a: .nan")), Contains("cell.yaml:5: robot.dh[0].a: found '.nan'"));
  CHECK_THAT(complaint(replaced(text, "format: kr5-cell/1", "format: kr5-cell/2")),
             Contains("cell.yaml:1: format: found 'kr5-cell/2', expected kr5-cell/1"));
  CHECK_THAT(complaint(replaced(text, "format: kr5-cell/1", "")),
             Contains("format: found nothing, expected kr5-cell/1"));
  CHECK_THAT(complaint("<?xml version=\"1.0\"?>\n<robot name=\"arm\"/>\n"),
             Contains("cell.yaml:1: found XML, expected a map with format: kr5-cell/1; kr5 cell import makes"));
  CHECK_THAT(complaint("- 1\n"), Contains("cell.yaml:1: found a list of 1, expected a map with format: kr5-cell/1"));
  CHECK_THAT(complaint("format: kr5-cell/1\n"), Contains("robot: found nothing"));
}

TEST_CASE("sizes that do not fit the number of joints are refused, all at once") {
  std::string text = io::read_text(arc_file);
  text = replaced(text, "  - {b: 0.115, theta_offset: 1.5707963267948966, a: 0.0, alpha: 0.0}\n", "");
  const std::string told = complaint(text);
  for (const char* field : {"robot.limits.lower", "robot.limits.velocity", "robot.links", "drives.torque_constant",
                            "drives.friction.viscous"})
    CHECK_THAT(told, Contains(std::string(field) + ": found 6 values, expected 5 values, one a joint"));
  CHECK_THAT(told, Contains("drives.structure: found 6 x 6, expected a 5 x 5 matrix"));
  text = io::read_text(general_file);
  CHECK_THAT(
      complaint(replaced(text, "natural_frequency: [60.0, 60.0, 60.0, 80.0]", "natural_frequency: [60.0, 60.0]")),
      Contains("servo.joint: found 2 values, expected 4 values"));
}

TEST_CASE("joint names are optional, one a joint, each of its own") {
  const std::string text = io::read_text(arc_file);
  const auto named = [&](const std::string& list) {
    return replaced(text, "  gravity:", "  joint_names: " + list + "\n  gravity:");
  };
  CHECK(load_cell(arc_file).robot.joint_names.empty());
  const Cell cell = parse_cell(named("[a1, a2, a3, a4, a5, '6']"), "t");
  CHECK(cell.robot.joint_names == std::vector<std::string>{"a1", "a2", "a3", "a4", "a5", "6"});
  CHECK(io::parse_yaml(to_yaml(cell), "t") == *cell.source);
  CHECK(parse_cell(exact(cell), "t").robot.joint_names == cell.robot.joint_names);
  CHECK_THAT(complaint(named("[a1, a2]")), Contains("robot.joint_names: found 2 names, expected 6 names, one a joint"));
  CHECK_THAT(complaint(named("[a1, a2, a1, a4, a5, a6]")),
             Contains("robot.joint_names[2]: found a1, expected a name of its own; joint 1 has this one"));
  CHECK_THAT(complaint(named("[a1, '', a3, a4, a5, a6]")),
             Contains("robot.joint_names[1]: found an empty text, expected a name"));
  CHECK_THAT(complaint(named("a1")), Contains("robot.joint_names: found 'a1', expected a list"));
}

TEST_CASE("mounts that are missing, double or contradictory are refused") {
  const std::string text = io::read_text(arc_file);
  CHECK_THAT(complaint(replaced(text, "T_E_C:", "T_F_C: [0, 0, 0, 0, 0, 0]\n  T_E_C:")),
             Contains("camera: found 2 of them, expected exactly one of T_E_C, T_F_C"));
  CHECK_THAT(complaint(replaced(text, "T_E_C:", "mount: base\n  T_E_C:")), Contains("T_B_C (mount: base)"));
  CHECK_THAT(complaint(replaced(text, "T_E_C:", "mount: roof\n  T_E_C:")),
             Contains("camera.mount: found 'roof', expected one of flange | base"));
  CHECK_THAT(complaint(replaced(text, "distortion: [-0.201788, 0.0, 0.0, 0.0, 0.0]", "distortion: [-0.2, 0.1]")),
             Contains("camera.distortion: found a list of 2, expected k1 k2 p1 p2 k3"));
  CHECK_THAT(complaint(replaced(text, "distortion: [-0.201788, 0.0, 0.0, 0.0, 0.0]",
                                "distortion: {model: brown4, values: [1]}")),
             Contains("camera.distortion.values: found a list of 1, expected the 4 values of brown4: k1 k2 p1 p2"));
}

TEST_CASE("the chain, the tool and the mounts are where the cell puts them") {
  const Cell cell = load_cell(arc_file);
  const Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(6, -0.5, 0.7);
  const Pose T_base_flange = nominal_chain(cell).flange(q);
  CHECK((T_base_tool(cell, q).translation() - T_base_flange * Eigen::Vector3d(0, 0, 0.19)).norm() < 1e-15);
  CHECK((T_flange_camera(cell)->translation() - Eigen::Vector3d(0.01, 0.065, 0.13)).norm() < 1e-15);
  CHECK((T_flange_scanner(cell)->translation() - Eigen::Vector3d(0.11, 0.045, 0.1)).norm() < 1e-15);
  Cell bare = cell;
  bare.tool.reset();
  CHECK(T_base_tool(bare, q).matrix() == T_base_flange.matrix());
}

TEST_CASE("a camera takes intrinsics in its lens model, or in the least that holds them") {
  Cell cell = load_cell(general_file);
  Pinhole lens = cell.camera->pinhole();
  lens.fx += 1.0, lens.k1 -= 0.01;
  cell.camera->set_pinhole(lens);
  CHECK(cell.camera->distortion.model == LensModel::Rational8);
  CHECK(cell.camera->pinhole().parameters() == lens.parameters());
  Camera bare;
  bare.set_pinhole({.width = 640, .height = 480, .fx = 500, .fy = 501, .cx = 320, .cy = 240});
  CHECK(bare.distortion.model == LensModel::None);
  Pinhole bent = bare.pinhole();
  bent.k2 = 0.1;
  bare.set_pinhole(bent);
  CHECK(bare.distortion.model == LensModel::K1K2);
  bent.p1 = 1e-3;
  bare.set_pinhole(bent);
  CHECK(bare.distortion.model == LensModel::Brown4);
  CHECK(bare.pinhole().parameters() == bent.parameters());
}

TEST_CASE("a cell that could not be read back is not written over the old file") {
  const auto file = std::filesystem::temp_directory_path() / "kr5_cell_kept.yaml";
  Cell cell = load_cell(arc_file);
  save_cell(cell, file);
  const std::string old = io::read_text(file);
  cell.robot.links.pop_back();
  CHECK_THROWS_AS(save_cell(cell, file), IoError);
  CHECK(io::read_text(file) == old);
  std::filesystem::remove(file);
}

TEST_CASE("a servo per joint is read as a list, as lists in a map, and as one for all") {
  const std::string text = io::read_text(general_file);
  const std::string columns = "joint: {natural_frequency: [60.0, 60.0, 60.0, 80.0], damping_ratio: 0.9, delay: 0.004}";
  const std::string one = "{natural_frequency: 60.0, damping_ratio: 0.9, delay: 0.004}",
                    last = "{natural_frequency: 80.0, damping_ratio: 0.9, delay: 0.004}";
  const Cell listed =
      parse_cell(replaced(text, columns, "joint: [" + one + ", " + one + ", " + one + ", " + last + "]"), "t");
  CHECK(exact(listed) == exact(load_cell(general_file)));
  CHECK(parse_cell(replaced(text, columns, "joint: " + one), "t").servo->of_joint(3).natural_frequency == 60.0);
  CHECK_THAT(complaint(replaced(text, "damping_ratio: 0.9, delay", "damping_ratio: [0.9, 1.0], delay")),
             Contains("servo.joint.damping_ratio: found a list of 2, expected one number, or a list of 4"));
}

TEST_CASE("torque servos are one for all joints, a list, or lists in a map, and come back from the file") {
  const std::string arm =
      "format: kr5-cell/1\nname: two\nrobot: {dh: [{a: 1, b: 0, alpha: 0, theta_offset: 0}, {a: 1, b: 0, alpha: 0, "
      "theta_offset: 0}]}\nservo: {cycle: 0.02, ";
  const Cell all = parse_cell(arm + "torque: {stiffness: 20, damping: 1, torque_limit: 3}}\n", "t");
  CHECK(all.has_torque_servos());
  CHECK(all.servo->torque_of(1).stiffness == 20.0);
  CHECK(all.servo->torque_of(1).torque_limit == 3.0);
  CHECK(all.servo->torque_of(1).hold == CommandHold::ZeroOrderHold);
  const Cell each = parse_cell(arm + "torque: {stiffness: [20, 12], damping: 1, hold: straight, delay: 0.01}}\n", "t");
  CHECK(each.servo->torque_of(1).stiffness == 12.0);
  CHECK(each.servo->torque_of(0).hold == CommandHold::FirstOrderHold);
  for (const Cell& cell : {all, each}) CHECK(exact(parse_cell(exact(cell), "back")) == exact(cell));
  const auto wrong = [&](const std::string& servo) { return complaint(arm + servo + "}\n"); };
  CHECK_THAT(wrong("torque: {stiffness: -1, damping: 1}"), Contains("servo.torque.stiffness: found -1"));
  CHECK_THAT(wrong("torque: [{stiffness: 1, damping: 1}, {stiffness: 1, damping: 1, dead_band: -1}]"),
             Contains("servo.torque[1].dead_band"));
  CHECK_THAT(wrong("torque: {stiffness: [1, 2, 3], damping: 1}"), Contains("servo.torque: found 3 values"));
  CHECK_THAT(wrong("torque: {stiffness: 1, damping: 1, stall_torque: 2}"), Contains("no_load_speed"));
  CHECK_THAT(wrong("torque: {stiffness: 1}"), Contains("damping"));
  CHECK_THAT(wrong("torque: {stiffness: 1, damping: 1}, joint: {natural_frequency: 40, damping_ratio: 1, delay: 0}"),
             Contains("servo.torque: found both"));
}

}  // namespace cell_test
