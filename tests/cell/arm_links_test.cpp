#include <kr5/cell/arm_links.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "cell/urdf_arms.hpp"

namespace arm_links_test {

using namespace kr5;
using namespace kr5::cell;
using namespace kr5::test;
using Eigen::VectorXd;

TEST_CASE("links stand on the axes of their joints, with the masses of the cell") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Cell cell = random_cell(seed);
    cell.tool.reset();
    const ArmLinks arm = arm_links(cell);
    const VectorXd zero = VectorXd::Zero(cell.robot.joints());
    const std::vector<Pose> T = nominal_chain(cell).link_poses(zero);
    CHECK(arm.T_base_tip.isApprox(T.back(), 1e-14));
    double mass = 0.0, expected = 0.0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero(), wanted = first;
    for (std::size_t i = 0; i < arm.links.size(); ++i) {
      const kinematics::Body in_base = transformed_body(arm.links[i].T_base_link, arm.links[i].body);
      mass += in_base.mass, first += in_base.mass * in_base.com;
      expected += cell.robot.links[i].mass, wanted += cell.robot.links[i].mass * (T[i] * cell.robot.links[i].com);
      // A joint moves what is behind it about, or along, the Z axis of its link.
      VectorXd q = zero;
      q[static_cast<Eigen::Index>(i)] = 0.3;
      Pose step = Pose::Identity();
      if (arm.links[i].type == kinematics::JointType::Revolute)
        step.linear() = Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()).toRotationMatrix();
      else
        step.translation().z() = 0.3;
      const Pose& L = arm.links[i].T_base_link;
      CHECK(nominal_chain(cell).flange(q).isApprox(L * step * L.inverse() * arm.T_base_tip, 1e-12));
    }
    CHECK(mass == Approx(expected).epsilon(1e-14));
    CHECK((first - wanted).norm() < 1e-12 * (1 + wanted.norm()));
  }
}

TEST_CASE("a cell of the links of a cell moves and weighs the same") {
  for (unsigned seed = 0; seed < 40; ++seed) {
    Cell cell = random_cell(seed);
    cell.tool.reset();
    cell.robot.joint_names.clear();
    for (int i = 0; i < cell.robot.joints(); ++i) cell.robot.joint_names.push_back("axis " + std::to_string(i));
    cell.drives = unit_drives(cell.robot.joints());
    cell.drives->friction.coulomb.setConstant(0.5);
    cell.drives->rotor_inertia.setConstant(0.02);
    const Cell back = cell_of_links(arm_links(cell));
    CHECK(difference(cell, back) < 1e-12);
    CHECK(back.robot.joint_names == cell.robot.joint_names);
    CHECK(back.robot.limits->upper == cell.robot.limits->upper);
    CHECK(back.drives->friction.coulomb == cell.drives->friction.coulomb);
    CHECK(back.drives->rotor_inertia == cell.drives->rotor_inertia);
  }
}

TEST_CASE("the inertia of a drive at its joint is that of all motors that turn with it") {
  const Cell cell = load_cell(std::string(KR5_SHARE_DIR) + "/cells/kr5_arc.yaml");
  const Drives& d = *cell.drives;
  const Eigen::MatrixXd M = d.structure.transpose() * d.rotor_inertia.asDiagonal() * d.structure;
  const ArmLinks arm = arm_links(cell);
  for (Eigen::Index i = 0; i < 6; ++i)
    CHECK(arm.links[static_cast<std::size_t>(i)].armature == Approx(M(i, i)).epsilon(1e-14));
  CHECK(arm.links[2].joint == "joint_3");
}

TEST_CASE("links go with the frames on their axes, unless these are those of another description") {
  const Cell cell = load_cell(std::string(KR5_SHARE_DIR) + "/cells/kr5_arc.yaml");
  const ArmLinks before = arm_links(cell);
  Cell turned = cell;
  turned.robot.dh[2].theta_offset += 0.01;
  const std::vector<Pose> moved = link_displacements(before, arm_links(turned));
  CHECK(moved[1].isApprox(Pose::Identity(), 1e-14));
  const Pose& L = before.links[2].T_base_link;
  CHECK(moved[2].isApprox(L * Eigen::AngleAxisd(0.01, Eigen::Vector3d::UnitZ()) * L.inverse(), 1e-13));
  CHECK(moved[5].isApprox(moved[2], 1e-13));  // all behind turns with it

  ArmLinks other = before;  // the same arm, described by frames elsewhere on the axes
  for (ArmLink& link : other.links)
    link.T_base_link =
        link.T_base_link * Eigen::Translation3d(0, 0, 0.3) * Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitZ());
  for (const Pose& T : link_displacements(before, other)) CHECK(T.isApprox(Pose::Identity(), 1e-13));

  turned.robot.dh[2].alpha += 0.3;
  CHECK_THROWS_WITH(link_displacements(before, arm_links(turned)),
                    Catch::Contains("the axis of joint_4") && Catch::Contains("turned against it by 0.3 rad"));
  other.links.pop_back();
  CHECK_THROWS_WITH(link_displacements(before, other), Catch::Contains("found 6 joints, and the cell has 5"));
}

TEST_CASE("an arm without links is none") {
  CHECK_THROWS_AS(cell_of_links({}), InvalidArgument);
  CHECK_FALSE(cell_of_links({{ArmLink{.joint = "only"}}, Pose::Identity()}).drives.has_value());
}

}  // namespace arm_links_test
