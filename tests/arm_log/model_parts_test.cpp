#include <kr5/arm_log/model_parts.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "arm_log/logged_arm.hpp"

namespace model_parts_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;

TEST_CASE("a description gets drives and a tool, and says so") {
  cell::Cell cell = described_arm();
  const auto notes = arm_log::add_parts_to_try(cell);
  REQUIRE(notes.size() == 2);
  CHECK(notes[0].kind == arm_log::LogNoteKind::NoDrives);
  CHECK(notes[1].kind == arm_log::LogNoteKind::NoTool);
  REQUIRE((cell.drives && cell.tool));
  CHECK(cell.drives->structure.isIdentity());
  CHECK(cell.drives->friction.coulomb.isZero());
  CHECK(cell.valid());
  CHECK(arm_log::add_parts_to_try(cell).empty());
}

TEST_CASE("a description without masses gets no drives") {
  cell::Cell cell = described_arm();
  cell.robot.links.clear();
  arm_log::add_parts_to_try(cell);
  CHECK_FALSE(cell.drives);
}

TEST_CASE("a description keeps what the cell of a recording has besides its robot") {
  const cell::Cell recorded = arm_cell({"rrr"});
  cell::Cell description = described_arm();
  description.robot.links[0].mass += 1.0;
  description.drives = cell::unit_drives(3);
  description.drives->friction.coulomb = Eigen::Vector3d(1, 2, 3);
  const cell::Cell out = arm_log::described_cell(description, recorded);
  CHECK(out.robot.links[0].mass == description.robot.links[0].mass);
  CHECK(out.noise.current == recorded.noise.current);
  CHECK(out.drives->structure == recorded.drives->structure);
  CHECK(out.drives->torque_constant == recorded.drives->torque_constant);
  CHECK(out.drives->friction.coulomb == description.drives->friction.coulomb);
  CHECK(out.drives->rotor_inertia == recorded.drives->rotor_inertia);
  CHECK(out.servo->cycle == recorded.servo->cycle);
  CHECK(out.tool->mass == recorded.tool->mass);
}

TEST_CASE("rotors that a description states on the side of the joints pass the gears of the recording") {
  cell::Cell recorded = arm_cell({"rrr"});
  recorded.drives->structure = Eigen::Vector3d(100, 80, 50).asDiagonal();
  cell::Cell description = described_arm();
  description.drives = cell::unit_drives(3);
  description.drives->rotor_inertia = Eigen::Vector3d(2.0, 1.6, 0.5);
  const cell::Cell out = arm_log::described_cell(description, recorded, true);
  CHECK(out.drives->rotor_inertia.isApprox(Eigen::Vector3d(2.0 / 1e4, 1.6 / 6400, 0.5 / 2500), 1e-12));
}

TEST_CASE("a description whose arm ends at the tip of the recording has its tool as a link") {
  const cell::Cell recorded = arm_cell({"rrr"});
  cell::Cell description = described_arm();
  description.tool = cell::Tool{};
  description.robot.dh.back().a += (recorded.tool->T_flange_tool.translation()).norm() * 1.0;
  const Eigen::Vector3d tip = cell::T_base_tool(recorded, Eigen::VectorXd::Zero(3)).translation();
  const Eigen::Vector3d end = cell::T_base_tool(description, Eigen::VectorXd::Zero(3)).translation();
  const Eigen::Vector3d flange =
      (cell::T_base_tool(recorded, Eigen::VectorXd::Zero(3)) * recorded.tool->T_flange_tool.inverse()).translation();
  const bool nearer_tip = (end - tip).norm() < (end - flange).norm();
  const cell::Cell out = arm_log::described_cell(description, recorded);
  CHECK(out.tool->mass == (nearer_tip ? 0.0 : recorded.tool->mass));
}

TEST_CASE("the model of another robot is refused by its joints") {
  cell::Cell recorded = arm_cell({"rrr"});
  CHECK_THROWS_WITH(arm_log::described_cell(arm_cell({"rrrr"}), recorded), Contains("found 4 joints, expected 3"));
  recorded.robot.joint_names = {"a", "b", "c"};
  CHECK_THROWS_WITH(arm_log::described_cell(described_arm(), recorded),
                    Contains("found the joints shoulder, elbow, wrist, expected a, b, c"));
}

}  // namespace model_parts_test
