#include <kr5/cell/update_urdf.hpp>

#include <catch2/catch.hpp>

#include <kr5/cell/export_urdf.hpp>
#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>

#include "cell/urdf_arms.hpp"
#include "support/reference.hpp"

namespace update_urdf_test {

using namespace kr5;
using namespace kr5::cell;
using namespace kr5::test;
using Catch::Matchers::Contains;
using Eigen::VectorXd;

namespace {

/// A cell that a calibration and an identification have changed: geometry, masses, tool, friction.
Cell tuned(Cell cell, Random& random) {
  constexpr double size = 3e-3;  // [m, rad]
  const int n = cell.robot.joints();
  cell.robot.T_base_0 = cell.robot.T_base_0 * to_pose(Vector6(random_vector(random, 6, size)));
  for (kinematics::DhJoint& row : cell.robot.dh) {
    const VectorXd d = random_vector(random, 5, size);
    row.b += d[0], row.theta_offset += d[1], row.a += d[2], row.alpha += d[3], row.beta += d[4];
  }
  for (Link& link : cell.robot.links) {
    link.mass *= 1.05;
    link.com += random_vector(random, 3, 0.01);
    link.inertia *= 1.1;
  }
  if (!cell.tool) cell.tool.emplace();
  cell.tool->T_flange_tool = cell.tool->T_flange_tool * to_pose(Vector6(random_vector(random, 6, size)));
  if (!cell.robot.links.empty()) {
    cell.tool->mass += 0.7;
    cell.tool->com += Eigen::Vector3d(0.01, 0.02, 0.03);
  }
  cell.drives = unit_drives(n);
  cell.drives->friction = {VectorXd::LinSpaced(n, 1.0, 2.0), VectorXd::LinSpaced(n, 0.1, 0.3)};
  return cell;
}

void check_update(const std::string& xml, const Cell& cell, const UrdfOptions& options) {
  const UrdfUpdate update = update_urdf(xml, "x.urdf", cell, options);
  UrdfOptions again = options;
  for (const std::string& change : update.changes)
    if (change.starts_with("link tool_tip: added")) again.tip = "tool_tip";
  const Cell back = parse_urdf(update.xml, "updated", again).cell;
  CHECK(difference(cell, back) < 1e-12);
  REQUIRE(back.drives.has_value());
  CHECK(back.drives->friction.coulomb == cell.drives->friction.coulomb);
  CHECK(back.drives->friction.viscous == cell.drives->friction.viscous);
  CHECK(difference(cell, parse_urdf(update_urdf(update.xml, "updated", cell, again).xml, "twice", again).cell) < 1e-12);
}

const std::string described = R"(<?xml version="1.0"?>
<!-- by the maker -->
<robot name="two">
  <link name="world"/>
  <link name="a">
    <visual><geometry><mesh filename="package://maker/a.stl"/></geometry></visual>  <!-- grey -->
    <inertial><origin xyz="0.1 0 0" rpy="0 0 1"/><mass value="2"/>
      <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.2"/></inertial>
  </link>
  <link name="b">
    <inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial>
  </link>
  <link name="plate"><inertial><mass value="0.5"/></inertial></link>
  <link name="tip"/>
  <joint name="j1" type="revolute">
    <origin xyz="0 0 0.3"/>
    <parent link="world"/><child link="a"/>
    <axis xyz="0 2 0"/>
    <limit lower="-1" upper="2" effort="0" velocity="3"/>
  </joint>
  <joint name="j2" type="continuous">
    <parent link="a"/><child link="b"/>
    <axis xyz="0 0 -1"/>
    <dynamics damping="0.1"/>
  </joint>
  <joint name="j3" type="fixed"><origin xyz="0 0 0.1"/><parent link="b"/><child link="plate"/></joint>
  <joint name="j4" type="fixed"><origin xyz="0 0.2 0.1"/><parent link="plate"/><child link="tip"/></joint>
  <gazebo reference="b"><material>Gazebo/Grey</material></gazebo>
</robot>
)";

Cell described_cell() { return parse_urdf(described, "two.urdf").cell; }

}  // namespace

TEST_CASE("a URDF with a changed arm in it gives the poses, torques and friction of the cell") {
  Random random(3);
  for (unsigned seed = 0; seed < 40; ++seed) {
    INFO(seed);
    const Cell cell = random_cell(seed);
    const std::string xml = to_urdf(cell);
    check_update(xml, tuned(cell, random), {});  // whose frames lie elsewhere on the axes than those of the import
    check_update(xml, tuned(parse_urdf(xml, "text").cell, random), {});
  }
}

TEST_CASE("the public robots are updated in place") {
  struct Robot {
    const char *file, *base, *tip;
  };
  Random random(4);
  for (const Robot& robot : {Robot{"kr5_arc_description/kr5_arc.urdf", "base_link", "tool0"},
                             Robot{"geo_socket_panda_iiwa/panda.urdf", "", "panda_hand"},
                             Robot{"geo_socket_panda_iiwa/iiwa14.urdf", "base_link", "tool0"},
                             Robot{"geo_ur10_figaroh/ur10_robot.urdf", "base_link", "tool0"},
                             Robot{"dyn_tx40_figaroh/tx40_mdh_modified.urdf", "", ""},
                             Robot{"dyn_tiago_figaroh/tiago_no_hand.urdf", "torso_lift_link", "arm_tool_link"},
                             Robot{"dyn_tiago_figaroh/tiago_no_hand.urdf", "base_link", "arm_tool_link"},
                             Robot{"dyn_lbr_med7_kcl/med7dock.urdf", "", ""},
                             Robot{"simreal_kinova_mico/m1n6s300.urdf", "", "m1n6s300_link_6"}}) {
    const std::filesystem::path file = test::reference(std::string("data/") + robot.file);
    INFO(robot.file);
    const UrdfOptions options{robot.base, robot.tip};
    const std::string xml = io::read_text(file);
    const Cell cell = parse_urdf(xml, "text", options).cell;
    CHECK(update_urdf(xml, "text", cell, options).changes.empty());
    check_update(xml, tuned(cell, random), options);
  }
}

TEST_CASE("a cell that has not changed leaves the text as it is") {
  const UrdfUpdate update = update_urdf(described, "two.urdf", described_cell());
  CHECK(update.xml == described);
  CHECK(update.changes.empty());
}

TEST_CASE("friction alone changes one element, and a new one gets a line of its own") {
  Cell cell = described_cell();
  cell.drives->friction.coulomb = Eigen::Vector2d(0.25, 1.5);
  const UrdfUpdate update = update_urdf(described, "two.urdf", cell);
  CHECK(update.changes == std::vector<std::string>{"joint j1: friction", "joint j2: friction"});
  CHECK(update.xml ==
        replaced(replaced(described, "<dynamics damping=\"0.1\"/>", "<dynamics damping=\"0.1\" friction=\"1.5\"/>"),
                 "effort=\"0\" velocity=\"3\"/>\n",
                 "effort=\"0\" velocity=\"3\"/>\n    <dynamics friction=\"0.25\"/>\n"));
}

TEST_CASE("a zero of a joint turns the origin of that joint alone") {
  Cell cell = described_cell();
  cell.robot.dh[0].theta_offset += 0.01;
  const UrdfUpdate update = update_urdf(described, "two.urdf", cell);
  CHECK(update.changes == std::vector<std::string>{"joint j1: origin"});
  CHECK_THAT(update.xml, Contains("<origin xyz=\"0 0 0.3\" rpy=\"0 0.01") && Contains("<!-- by the maker -->") &&
                             Contains("package://maker/a.stl") && Contains("<!-- grey -->") && Contains("Gazebo/Grey"));
  CHECK(difference(parse_urdf(update.xml, "t").cell, cell) < 1e-13);
}

TEST_CASE("a payload becomes a link on the tip, which is the tool of the cell again") {
  Cell cell = described_cell();
  REQUIRE(cell.robot.links[1].mass == 1.5);
  REQUIRE(cell.tool.has_value());
  cell.tool->mass = 0.7;
  cell.tool->com = {0.02, 0.0, 0.05};
  cell.tool->T_flange_sensor.translation().z() = 0.04;
  const UrdfUpdate update = update_urdf(described, "two.urdf", cell);
  const UrdfImport back = parse_urdf(update.xml, "t");
  CHECK(update.changes == std::vector<std::string>{"link payload: added, fixed to " + back.tip});
  CHECK(back.tip == parse_urdf(described, "t").tip);
  CHECK(back.cell.robot.links[1].mass == 1.5);
  CHECK(difference(back.cell, cell) < 1e-13);
  REQUIRE(back.cell.tool.has_value());
  CHECK(back.cell.tool->mass == 0.7);
  CHECK(back.cell.tool->com.isApprox(cell.tool->com, 1e-14));
  CHECK(back.cell.tool->T_flange_sensor.isApprox(cell.tool->T_flange_sensor, 1e-14));

  cell.tool->mass = 0.9;
  const UrdfUpdate again = update_urdf(update.xml, "t", cell);
  CHECK(again.changes == std::vector<std::string>{"link payload: inertial"});
  CHECK(parse_urdf(again.xml, "t").cell.tool->mass == 0.9);
  CHECK_THROWS_WITH(update_urdf(replaced(described, "name=\"world\"/>", "name=\"world\"/><link name=\"payload\"/>"),
                                "two.urdf", cell, {.base = "world", .tip = back.tip}),
                    Contains("there is a link payload already"));
}

TEST_CASE("what a force sensor of an exported cell bears is its tool again") {
  Random random(5);
  Cell cell = tuned(described_cell(), random);
  cell.tool->T_flange_sensor = to_pose(Vector6(random_vector(random, 6, 0.1)));
  cell.tool->inertia << 0.01, 0.02, 0.015, 0.001, 0.0, -0.001;
  const Cell back = parse_urdf(to_urdf(cell), "t").cell;
  CHECK(difference(back, cell) < 1e-12);
  REQUIRE(back.tool.has_value());
  CHECK(back.tool->mass == Approx(cell.tool->mass).epsilon(1e-12));
  CHECK(back.tool->com.isApprox(cell.tool->com, 1e-10));
  CHECK(back.tool->inertia.isApprox(cell.tool->inertia, 1e-10));
}

TEST_CASE("a link that is lighter than what is fixed to it takes over all of its mass") {
  Cell cell = described_cell();
  cell.robot.links[1].mass = 0.4;
  cell.robot.links[1].com = {0.05, 0.02, 0.01};
  const UrdfUpdate update = update_urdf(described, "two.urdf", cell);
  CHECK(update.changes ==
        std::vector<std::string>{"link b: inertial", "link plate: inertial removed, its mass is in that of b"});
  CHECK_THAT(update.xml, Contains("<link name=\"plate\"/>"));
  CHECK(difference(parse_urdf(update.xml, "t").cell, cell) < 1e-13);
}

TEST_CASE("a tool elsewhere moves the fixed joint of the tip, or gets a link where there is none") {
  Cell cell = described_cell();
  REQUIRE(cell.tool.has_value());
  cell.tool->T_flange_tool.translate(Eigen::Vector3d(0.003, 0.002, 0.001));
  const UrdfUpdate moved = update_urdf(described, "two.urdf", cell);
  CHECK(moved.changes == std::vector<std::string>{"joint j4: origin"});
  CHECK(difference(parse_urdf(moved.xml, "t").cell, cell) < 1e-13);

  Cell bare = parse_urdf(described, "two.urdf", {.tip = "b"}).cell;
  bare.tool.emplace();
  bare.tool->T_flange_tool.translation().z() = 0.12;
  const UrdfUpdate added = update_urdf(described, "two.urdf", bare, {.tip = "b"});
  CHECK(added.changes == std::vector<std::string>{"link tool_tip: added, fixed to b"});
  CHECK(difference(parse_urdf(added.xml, "t", {.tip = "tool_tip"}).cell, bare) < 1e-13);
  CHECK_THROWS_WITH(update_urdf(replaced(described, "name=\"world\"/>", "name=\"world\"/><link name=\"tool_tip\"/>"),
                                "two.urdf", bare, {.base = "world", .tip = "b"}),
                    Contains("there is a tool_tip already"));
}

TEST_CASE("a URDF of another robot is refused, and one that is none") {
  const Cell cell = described_cell();
  const auto fails = [&](const std::string& xml, const std::string& word, const UrdfOptions& options = {}) {
    CHECK_THROWS_WITH(update_urdf(xml, "x.urdf", cell, options), Catch::StartsWith("x.urdf") && Contains(word));
    CHECK_THROWS_AS(update_urdf(xml, "x.urdf", cell, options), IoError);
  };
  fails(
      replaced(described, "name=\"j1\"", "name=\"shoulder\""),
      "the joints from world to tip are shoulder, j2, those of the cell are j1, j2; give the URDF from which the cell "
      "was imported");
  fails(described, "are j1, those of the cell are j1, j2", {.tip = "a"});
  fails(
      replaced(described, "<axis xyz=\"0 2 0\"/>", "<axis xyz=\"1 1 0\"/>"),
      "the axis of j1 lies 0 m beside that of the cell and is turned against it by 0.79 rad; give the URDF from which");
  fails(replaced(described, "0 0 0.3", "0 0 1.3"), "lies 1 m beside");
  fails(replaced(described, "<gazebo ", "<xacro:arm/><gazebo "), "xacro FILE > robot.urdf");
  fails("<mujoco/>", "expected a URDF's <robot>");
  Cell unnamed = cell;
  unnamed.robot.joint_names.clear();
  CHECK_THROWS_WITH(update_urdf(described, "x.urdf", unnamed, {.tip = "a"}),
                    Contains("x.urdf: found 1 joint, and the cell has 2; give the URDF from which"));
  CHECK(update_urdf(described, "x.urdf", unnamed).changes.empty());
}

}  // namespace update_urdf_test
