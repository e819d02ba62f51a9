#include <cmath>
#include <fstream>

#include <catch2/catch.hpp>

#include <kr5/cell/arm_links.hpp>
#include <kr5/cell/check.hpp>
#include <kr5/cell/export_urdf.hpp>
#include <kr5/cell/import_urdf.hpp>
#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>
#include <kr5/kinematics/inverse.hpp>
#include <kr5/kinematics/newton_euler.hpp>

#include "cell/urdf_arms.hpp"
#include "support/reference.hpp"

namespace urdf_test {

using namespace kr5;
using namespace kr5::cell;
using namespace kr5::test;
using Catch::Matchers::Contains;
using Eigen::VectorXd;

TEST_CASE("any cell goes to a URDF and back with the same poses and torques") {
  for (unsigned seed = 0; seed < 60; ++seed) {
    const Cell cell = random_cell(seed);
    const UrdfImport back = parse_urdf(to_urdf(cell), "text");
    CHECK(difference(cell, back.cell) < 1e-12);
    CHECK(back.tip == "tool_tip");
    const Cell again = parse_urdf(to_urdf(back.cell), "text").cell;
    CHECK(difference(back.cell, again) < 1e-12);
    REQUIRE(back.cell.robot.limits.has_value());
    CHECK(back.cell.robot.limits->upper == cell.robot.limits->upper);
    CHECK(back.cell.robot.limits->velocity == cell.robot.limits->velocity);
    CHECK(back.cell.robot.limits->effort.size() == 0);
  }
}

TEST_CASE("the table of the KR5 comes back from its URDF") {
  const Cell cell = load_cell(std::string(KR5_SHARE_DIR) + "/cells/kr5_arc.yaml");
  const Cell back = parse_urdf(to_urdf(cell), "text", {.tip = "flange"}).cell;
  REQUIRE(back.robot.joints() == 6);
  REQUIRE(back.tool.has_value());
  CHECK(back.tool->T_flange_tool.isApprox(Pose::Identity(), 1e-14));
  CHECK(back.tool->T_flange_sensor.isApprox(cell.tool->T_flange_sensor, 1e-14));
  CHECK(back.tool->mass == cell.tool->mass);
  CHECK(back.tool->com.isApprox(cell.tool->com, 1e-14));
  CHECK(back.tool->inertia.isApprox(cell.tool->inertia, 1e-14));
  CHECK(back.robot.T_base_0.isApprox(Pose::Identity(), 1e-15));
  for (std::size_t i = 0; i < 6; ++i) {
    const kinematics::DhJoint &a = cell.robot.dh[i], &b = back.robot.dh[i];
    CHECK(a.b == Approx(b.b).margin(1e-14));
    CHECK(a.a == Approx(b.a).margin(1e-14));
    CHECK(std::remainder(a.theta_offset - b.theta_offset, 2 * M_PI) == Approx(0).margin(1e-14));
    CHECK(std::remainder(a.alpha - b.alpha, 2 * M_PI) == Approx(0).margin(1e-14));
    CHECK(b.beta == 0.0);
    CHECK((cell.robot.links[i].inertia - back.robot.links[i].inertia).norm() < 1e-14);
  }
}

TEST_CASE("axes, fixed links, limits and notes are read as the file has them") {
  const UrdfImport two = parse_urdf(two_joints, "two.urdf");
  CHECK(two.base == "world");
  CHECK(two.tip == "tip");
  CHECK(two.joints == std::vector<std::string>{"j1", "j2"});
  CHECK(two.cell.robot.joint_names == two.joints);
  const Eigen::Vector2d q(0.4, 0.7);
  const Pose T = T_base_tool(two.cell, q);
  Pose expected = Pose(Eigen::Translation3d(0, 0, 0.3)) * Pose(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY())) *
                  Pose(Eigen::Translation3d(0.5, 0, 0)) * Pose(Eigen::AngleAxisd(-0.7, Eigen::Vector3d::UnitZ())) *
                  Pose(Eigen::Translation3d(0, 0, 0.1));
  CHECK(T.isApprox(expected, 1e-14));
  CHECK(two.cell.robot.limits->upper[0] == 2.0);
  CHECK(two.cell.robot.limits->upper[1] == INFINITY);
  CHECK(two.cell.robot.limits->velocity[1] == INFINITY);
  CHECK(two.cell.robot.limits->effort.size() == 0);
  REQUIRE(two.notes.size() == 1);
  CHECK_THAT(two.notes[0], Contains("damping") && Contains("j2") && Contains("joint torque"));
  REQUIRE(two.cell.drives.has_value());
  CHECK(two.cell.drives->friction.viscous == Eigen::Vector2d(0.0, 0.1));
  CHECK(two.cell.drives->friction.coulomb == Eigen::Vector2d::Zero());
  CHECK_THROWS_WITH(parse_urdf(replaced(two_joints, "damping=\"0.1\"", "friction=\"-2\""), "two.urdf"),
                    Contains("j2") && Contains("friction: found a negative value"));
  // Torque of joint 1 at rest: the weights at their levers.
  const VectorXd still = VectorXd::Zero(2);
  CHECK(torques(two.cell, still, still, still)[0] == Approx(-9.81 * (2 * 0.1 + 1 * 0.5)));
}

TEST_CASE("a tip beside the last axis is reached by the tool") {
  const std::string beside =
      replaced(two_joints, "0 0 0.1\"/><parent link=\"b\"", "0.1 0.2 0.1\" rpy=\"1 2 3\"/><parent link=\"b\"");
  const UrdfImport two = parse_urdf(beside, "two.urdf");
  REQUIRE(two.cell.tool.has_value());
  const Pose expected =
      Pose(Eigen::Translation3d(0.5, 0, 0.3)) * from_xyzrpy((Vector6() << 0.1, 0.2, 0.1, 1, 2, 3).finished());
  CHECK(T_base_tool(two.cell, VectorXd::Zero(2)).isApprox(expected, 1e-14));
  CHECK(nominal_chain(two.cell).flange(VectorXd::Zero(2)).linear().isApprox(expected.linear(), 1e-14));
}

TEST_CASE("an arm that branches needs a tip, joints beside it are held, and their mass rides on it") {
  const auto finger = [](const std::string& name) {
    return "<link name='" + name + "'><inertial><mass value='3'/></inertial></link><joint name='grip_" + name +
           "' type='prismatic'><parent link='b'/><child link='" + name +
           "'/><limit lower='0' upper='1' effort='1' velocity='1'/></joint>";
  };
  const std::string gripper = replaced(two_joints, "</robot>", finger("left") + finger("right") + "</robot>");
  CHECK_THROWS_WITH(parse_urdf(gripper, "x.urdf"),
                    "x.urdf: behind link b the robot branches to left, right; name the link that is the tip (--tip)");
  const UrdfImport held = parse_urdf(gripper, "x.urdf", {.tip = "tip"});
  CHECK(held.cell.robot.links[1].mass == 7.0);
  REQUIRE(!held.notes.empty());
  CHECK_THAT(held.notes[0], Contains("held at 0") && Contains("grip_left, grip_right"));
  CHECK(parse_urdf(gripper, "x.urdf", {.tip = "left"}).joints.back() == "grip_left");
}

TEST_CASE("what is no serial arm is refused with what to do") {
  const auto fails = [](const std::string& xml, const std::string& word, const UrdfOptions& options = {}) {
    CHECK_THROWS_WITH(parse_urdf(xml, "x.urdf", options), Catch::Matchers::StartsWith("x.urdf") && Contains(word));
    CHECK_THROWS_AS(parse_urdf(xml, "x.urdf", options), IoError);
  };
  fails(two_joints, "no link \"tap\" for the tip; is it tip?", {.tip = "tap"});
  fails(two_joints, "is not connected to the base b", {.base = "b", .tip = "a"});
  fails(two_joints, "no joint moves", {.base = "b", .tip = "tip"});
  fails(replaced(two_joints, "value=\"2\"", "value=\"-2\""), "link a: found a mass of -2 kg");
  fails(replaced(two_joints, "iyy=\"0.2\"", "iyy=\"-0.2\""), "link a: the inertia is not positive");
  fails(replaced(two_joints, "0.5 0 0", "0.5 ${pi} 0"), "<joint name=\"j2\"> xyz: found \"${pi}\"");
  fails(replaced(two_joints, "0.5 0 0", "0.5 0"), "expected three numbers");
  fails(replaced(two_joints, "0.5 0 0", "0.5 nan 0"), "expected a number");
  fails(replaced(two_joints, "<link name=\"tip\"/>", "<link name=\"tip\"/><xacro:arm/>"), "xacro FILE > robot.urdf");
  fails(replaced(two_joints, "continuous", "floating"), "joint j2 is floating");
  fails(replaced(two_joints, "continuous", "hinge"), "found type \"hinge\"");
  fails(replaced(two_joints, "0 0 -1", "0 0 0"), "axis of length 0");
  fails(replaced(two_joints, "<dynamics", "<mimic joint='j1'/><dynamics"), "remove its <mimic>");
  fails(replaced(two_joints, "continuous", "spherical"),
        "name a base behind it (--base b) or a tip before it (--tip a)");
  fails(replaced(two_joints, "<link name=\"tip\"/>", "<link name=\"tip\"/><link name=\"tip\"/>"), "occurs twice");
  fails(replaced(two_joints, "name=\"j3\"", "name=\"j1\""), "<joint name=\"j1\"> occurs twice");
  fails(replaced(two_joints, "child link=\"tip\"", "child link=\"top\""), "refers to the link \"top\"");
  fails(replaced(two_joints, "child link=\"tip\"", "child link=\"a\""), "is the child of joints j1 and j3");
  fails(replaced(two_joints, "</robot>", ""), "is not valid XML");
  fails(
      "<robot><link name='a'/><link name='b'/><link name='c'/><joint name='f' type='fixed'><parent link='a'/>"
      "<child link='b'/></joint><joint name='g' type='fixed'><parent link='a'/><child link='c'/></joint></robot>",
      "no joint moves");
  fails("<sdf/>", "expected a URDF's <robot>");
  fails("<robot/>", "no links");
  CHECK_THROWS_WITH(import_urdf("nowhere.urdf"), Contains("nowhere.urdf"));
}

TEST_CASE("limits that are no range are none, and named") {
  const auto limits = [](const std::string& lower, const std::string& upper) {
    return parse_urdf(replaced(replaced(two_joints, "lower=\"-1\"", "lower=\"" + lower + "\""), "upper=\"2\"",
                               "upper=\"" + upper + "\""),
                      "x.urdf");
  };
  for (const auto& [lower, upper] : {std::pair{"0", "0"},
                                     {"1", "1"},
                                     {"5", "2"},
                                     {"-1e16", "1e16"},
                                     {"-1e6", "1e6"},
                                     {"0", "1e6"},
                                     {"-180", "180"}}) {
    INFO(lower << " to " << upper);
    const UrdfImport open = limits(lower, upper);
    CHECK(open.cell.robot.limits->lower[0] == -INFINITY);
    CHECK(open.cell.robot.limits->upper[0] == INFINITY);
    REQUIRE(!open.notes.empty());
    CHECK_THAT(open.notes[0], Contains("the limits of j1 are no range"));
    CHECK(check(open.cell).empty());
  }
  const UrdfImport kept = limits("-40", "40");
  CHECK(kept.cell.robot.limits->upper[0] == 40.0);
  CHECK_THAT(kept.notes[0], !Contains("no range"));
}

TEST_CASE("frames that are fixed behind the last joint leave the arm one end") {
  const std::string frames =
      "<link name='tool0'/><link name='ee'/><joint name='f1' type='fixed'><parent link='b'/><child "
      "link='tool0'/></joint>"
      "<joint name='f2' type='fixed'><origin xyz='0 0 0.5'/><parent link='b'/><child link='ee'/></joint></robot>";
  const UrdfImport arm = parse_urdf(replaced(two_joints, "</robot>", frames), "x.urdf");
  CHECK(arm.tip == "b");
  CHECK(arm.joints == std::vector<std::string>{"j1", "j2"});
  REQUIRE(!arm.notes.empty());
  CHECK(arm.notes[0] ==
        "the arm ends at b, behind which several links follow (tip, tool0, ee); another end is named by --tip");
  CHECK(parse_urdf(replaced(two_joints, "</robot>", frames), "x.urdf", {.tip = "ee"}).tip == "ee");
}

TEST_CASE("a hand of fewer joints than its arm is behind the end of the arm, arms of a torso are not") {
  CHECK(arm_ends_before(2, 0));
  CHECK(arm_ends_before(6, 4));
  CHECK(arm_ends_before(4, 1));
  CHECK_FALSE(arm_ends_before(0, 0));
  CHECK_FALSE(arm_ends_before(3, 1));
  CHECK_FALSE(arm_ends_before(4, 4));
  CHECK_FALSE(arm_ends_before(3, 7));
}

TEST_CASE("inertias of round-off are none, and those beside the chain do not matter") {
  const auto with_head = [](const std::string& inertia) {
    return replaced(two_joints, "</robot>",
                    "<link name='head'><inertial><mass value='0.5'/><inertia " + inertia +
                        "/></inertial></link><joint name='neck' type='revolute'><parent link='a'/><child link='head'/>"
                        "<limit lower='-1' upper='1' effort='1' velocity='1'/></joint></robot>");
  };
  const UrdfOptions tip{.tip = "tip"};
  const UrdfImport none = parse_urdf(with_head("ixx='0'"), "x.urdf", tip);
  const UrdfImport rounded = parse_urdf(with_head("ixx='2e-35' ixy='1e-35' iyy='-2e-35'"), "x.urdf", tip);
  CHECK(difference(none.cell, rounded.cell) == 0.0);
  CHECK(none.notes == rounded.notes);
  const UrdfImport wrong = parse_urdf(with_head("ixx='0.1' iyy='-0.1'"), "x.urdf", tip);
  CHECK(difference(none.cell, wrong.cell) == 0.0);
  CHECK_THAT(wrong.notes[0], Contains("the inertia of head, beside the chain of joints"));
  const UrdfImport in_chain = parse_urdf(replaced(two_joints, "iyy=\"0.2\"", "iyy=\"-1e-14\""), "x.urdf");
  CHECK(in_chain.cell.robot.links.size() == 2);
}

TEST_CASE("faults of joints beside the arm are no faults of the arm") {
  const auto beside = [](const std::string& joint) {
    return replaced(two_joints, "</robot>",
                    "<link name='x'/>" + joint + "<parent link='a'/><child link='x'/></joint></robot>");
  };
  for (const char* joint :
       {"<joint name='jx' type='spherical'>", "<joint name='jx' type='revolute'><axis xyz='0 0 0'/>",
        "<joint name='jx' type='revolute'><limit lower='1' upper='-1'/>",
        "<joint name='jx' type='revolute'><mimic joint='j1'/>"})
    CHECK(parse_urdf(beside(joint), "x.urdf", {.tip = "tip"}).joints.size() == 2);
}

TEST_CASE("friction of the joints goes to a URDF and back, motors do not") {
  Cell cell = load_cell(std::string(KR5_SHARE_DIR) + "/cells/kr5_arc.yaml");
  const UrdfImport back = parse_urdf(to_urdf(cell), "text");
  REQUIRE(back.cell.drives.has_value());
  CHECK(back.cell.drives->friction.coulomb == cell.drives->friction.coulomb);
  CHECK(back.cell.drives->friction.viscous == cell.drives->friction.viscous);
  CHECK(back.cell.drives->structure.isIdentity(0.0));
  CHECK(back.cell.drives->rotor_inertia.isZero(0.0));
  CHECK(check(back.cell).empty());
  cell.drives.reset();
  const UrdfImport bare = parse_urdf(to_urdf(cell), "text");
  CHECK_FALSE(bare.cell.drives.has_value());
  CHECK(bare.notes.empty());
}

TEST_CASE("joints keep their names in a URDF, and have numbers where the cell has none") {
  Cell cell = random_cell(3);
  CHECK(parse_urdf(to_urdf(cell), "text").joints ==
        std::vector<std::string>{"joint_1", "joint_2", "joint_3", "joint_4"});
  cell.robot.joint_names = {"shoulder_pan_joint", "lift", "elbow", "wrist/1"};
  const UrdfImport back = parse_urdf(to_urdf(cell), "text");
  CHECK(back.joints == cell.robot.joint_names);
  CHECK(back.cell.robot.joint_names == cell.robot.joint_names);
  CHECK(parse_cell(to_yaml(back.cell), "text").robot.joint_names == cell.robot.joint_names);
}

TEST_CASE("a slide without limits cannot go to a URDF") {
  Cell cell;
  cell.robot.dh = {{kinematics::JointType::Prismatic, 0, 0, 0, 0, 0}};
  CHECK_THROWS_WITH(to_urdf(cell), Contains("joint 1 is prismatic without limits"));
}

TEST_CASE("the public robots import, and come back from a URDF") {
  struct Robot {
    const char *file, *base, *tip;
    int joints;
  };
  for (const Robot& robot : {Robot{"kr5_arc_description/kr5_arc.urdf", "base_link", "tool0", 6},
                             Robot{"geo_socket_panda_iiwa/panda.urdf", "", "panda_hand", 7},
                             Robot{"geo_socket_panda_iiwa/iiwa14.urdf", "base_link", "tool0", 7},
                             Robot{"geo_ur10_figaroh/ur10_robot.urdf", "base_link", "tool0", 6},
                             Robot{"dyn_tx40_figaroh/tx40_mdh_modified.urdf", "", "", 6},
                             Robot{"dyn_tiago_figaroh/tiago_no_hand.urdf", "torso_lift_link", "arm_tool_link", 7},
                             Robot{"dyn_tiago_figaroh/tiago_no_hand.urdf", "base_link", "arm_tool_link", 8},
                             Robot{"dyn_lbr_med7_kcl/med7dock.urdf", "", "", 7},
                             Robot{"simreal_kinova_mico/m1n6s300.urdf", "", "m1n6s300_link_6", 6},
                             Robot{"geo_hydra_cmm/za.urdf", "base_link", "tool0", 6}}) {
    const std::filesystem::path file = test::reference(std::string("data/") + robot.file);
    INFO(robot.file);
    const UrdfImport urdf = import_urdf(file, {robot.base, robot.tip});
    CHECK(urdf.cell.robot.joints() == robot.joints);
    CHECK(difference(urdf.cell, parse_urdf(to_urdf(urdf.cell), "text").cell) < 1e-12);
    CHECK(difference(urdf.cell, parse_cell(to_yaml(urdf.cell), "text")) == 0.0);
  }
}

TEST_CASE("inverse kinematics agrees with the ortho-parallel formulas of the KR5") {
  const std::filesystem::path folder = test::reference("data/kr5_arc_description");
  const io::Node yaml = io::load_yaml(folder / "opw_kinematics_kr5.yaml");
  const auto length = [&](const char* key) {
    return std::stod(yaml.find("opw_kinematics_geometric_parameters")->find(key)->scalar);
  };
  const auto item = [&](const char* key, std::size_t i) { return std::stod(yaml.find(key)->items[i].scalar); };
  const double a1 = length("a1"), a2 = length("a2"), c1 = length("c1"), c2 = length("c2"), c3 = length("c3"),
               c4 = length("c4"), b = length("b");
  // Forward kinematics of Brandstoetter et al. 2014, eq. 1-7.
  const auto opw = [&](const VectorXd& q) {
    Eigen::Matrix<double, 6, 1> t;
    for (std::size_t i = 0; i < 6; ++i)
      t[static_cast<Eigen::Index>(i)] =
          q[static_cast<Eigen::Index>(i)] * item("opw_kinematics_joint_sign_corrections", i) -
          item("opw_kinematics_joint_offsets", i);
    const double psi = std::atan2(a2, c3), k = std::hypot(a2, c3);
    const double x = c2 * std::sin(t[1]) + k * std::sin(t[1] + t[2] + psi) + a1;
    const double z = c2 * std::cos(t[1]) + k * std::cos(t[1] + t[2] + psi) + c1;
    const auto Z = [](double a) { return Eigen::AngleAxisd(a, Eigen::Vector3d::UnitZ()); };
    const auto Y = [](double a) { return Eigen::AngleAxisd(a, Eigen::Vector3d::UnitY()); };
    Pose T = Pose::Identity();
    T.linear() = (Z(t[0]) * Y(t[1] + t[2]) * Z(t[3]) * Y(t[4]) * Z(t[5])).toRotationMatrix();
    T.translation() = Z(t[0]) * Eigen::Vector3d(x, b, z) + c4 * T.linear().col(2);
    return T;
  };
  const Cell cell = import_urdf(folder / "kr5_arc.urdf", {"base_link", "tool0"}).cell;
  REQUIRE(kinematics::has_closed_form(nominal_chain(cell)));
  Random random(4);
  for (int k = 0; k < 200; ++k) {
    VectorXd q = test::random_vector(random, 6, 3);
    const Pose T = T_base_tool(cell, q);
    // The frames of tool0 differ by a constant turn only.
    const Eigen::Matrix3d turn =
        opw(VectorXd::Zero(6)).linear().transpose() * T_base_tool(cell, VectorXd::Zero(6)).linear();
    CHECK((opw(q).translation() - T.translation()).norm() < 1e-10);
    CHECK((opw(q).linear() * turn - T.linear()).norm() < 1e-10);
    const kinematics::InverseResult inverse = kinematics::inverse_kinematics(nominal_chain(cell), T);
    CHECK((inverse.postures.size() == 4 || inverse.postures.size() == 8));
    for (const kinematics::Posture& p : inverse.postures)
      CHECK((opw(p.q).translation() - T.translation()).norm() < 1e-10);
  }
}

TEST_CASE("an arm of which a link has no mass or no inertia keeps the masses of the others") {
  const std::string b =
      "<link name=\"b\"><inertial><mass value=\"1\"/>\n    <inertia ixx=\"0.1\" ixy=\"0\" ixz=\"0\" "
      "iyy=\"0.1\" iyz=\"0\" izz=\"0.1\"/></inertial></link>";
  const auto masses = [&](const std::string& by) {
    const UrdfImport found = parse_urdf(replaced(two_joints, b, by), "x.urdf");
    CHECK_NOTHROW(found.cell.validate());
    std::vector<double> out;
    for (const Link& link : found.cell.robot.links) out.push_back(link.mass);
    return out;
  };
  const std::vector<double> whole = masses(b), bare = masses("<link name=\"b\"/>"),
                            point = masses("<link name=\"b\"><inertial><mass value=\"1\"/></inertial></link>");
  REQUIRE(whole.size() == 2);
  CHECK(whole[1] == 1.0);
  CHECK(bare == std::vector<double>{whole[0], 0.0});
  CHECK(point == whole);
}

}  // namespace urdf_test
