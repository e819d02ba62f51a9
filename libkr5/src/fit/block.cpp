// SPDX-License-Identifier: BSD-3-Clause
#include "fit/block.hpp"

#include <numeric>
#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/geometry/pose_derivatives.hpp>

namespace kr5::fit {
namespace {

/// Of a name as callers write it, "q3 [rad]".
FitCoordinate coordinate_of(const std::string& block, const std::string& written) {
  const std::size_t space = written.find(" [");
  if (space == std::string::npos || !written.ends_with("]")) return {block, written, ""};
  return {block, written.substr(0, space), written.substr(space + 2, written.size() - space - 3)};
}

Block with(BlockKind kind, const std::string& name, const Eigen::VectorXd& values,
           const std::vector<std::string>& coordinates) {
  require(values.allFinite(), name + ": start must be finite");
  Block block;
  block.kind = kind;
  block.name = name;
  for (const std::string& coordinate : coordinates) block.coordinates.push_back(coordinate_of(name, coordinate));
  block.values = block.start = values;
  block.held.assign(coordinates.size(), false);
  block.leader.resize(coordinates.size());
  std::iota(block.leader.begin(), block.leader.end(), 0);
  block.ratio = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(coordinates.size()));
  return block;
}

}  // namespace

std::vector<int> Block::free() const {
  std::vector<int> out;
  for (int i = 0; i < size(); ++i)
    if (!held[static_cast<std::size_t>(i)] && leader[static_cast<std::size_t>(i)] == i) out.push_back(i);
  return out;
}

void Block::hold(int coordinate) {
  for (std::size_t i = 0; i < held.size(); ++i)
    if (leader[i] == leader[static_cast<std::size_t>(coordinate)]) held[i] = true;
}

const Block& block_of(const std::vector<Block>& blocks, FitBlock handle, const char* what) {
  require(handle.index >= 0 && handle.index < static_cast<int>(blocks.size()),
          std::string("Problem: there is no such ") + what);
  return blocks[static_cast<std::size_t>(handle.index)];
}

Block& block_of(std::vector<Block>& blocks, FitBlock handle, const char* what) {
  return const_cast<Block&>(block_of(std::as_const(blocks), handle, what));
}

const Block& block_of(const std::vector<Block>& blocks, FitBlock handle, BlockKind kind, const char* what) {
  const Block& out = block_of(blocks, handle, what);
  require(out.kind == kind, out.name + " is no " + what);
  return out;
}

Block& block_of(std::vector<Block>& blocks, FitBlock handle, BlockKind kind, const char* what) {
  return const_cast<Block&>(block_of(std::as_const(blocks), handle, kind, what));
}

Pose to_pose_block(const double* values) {
  Pose T = Pose::Identity();
  T.translation() = Eigen::Map<const Eigen::Vector3d>(values);
  T.linear() = Eigen::Map<const Eigen::Quaterniond>(values + 3).normalized().toRotationMatrix();
  return T;
}

void from_pose(const Pose& T, double* values) {
  Eigen::Map<Eigen::Vector3d>(values, 3) = T.translation();
  Eigen::Map<Eigen::Quaterniond>(values + 3) = Eigen::Quaterniond(T.linear()).normalized();
}

Pose Block::pose() const { return to_pose_block(values.data()); }

kinematics::DhChain to_arm(const kinematics::DhChain& form, const double* values) {
  kinematics::DhChain out = form;
  for (kinematics::DhJoint& joint : out.joints) {
    joint.b = values[0], joint.theta_offset = values[1], joint.a = values[2];
    joint.alpha = values[3], joint.beta = values[4];
    values += 5;
  }
  return out;
}

kinematics::DhChain Block::arm() const { return to_arm(chain, values.data()); }

Pinhole Block::camera() const {
  Pinhole out;
  out.width = width, out.height = height;
  out.set_parameters(values);
  return out;
}

Eigen::VectorXd Block::change(const double* at) const {
  if (kind != BlockKind::Pose) return Eigen::Map<const Eigen::VectorXd>(at, start.size()) - start;
  return pose_difference(to_pose_block(start.data()), to_pose_block(at));
}

Eigen::MatrixXd Block::change_by_coordinates(const double* at) const {
  if (kind != BlockKind::Pose) return Eigen::MatrixXd::Identity(size(), size());
  return vector_by_perturbation(change(at));
}

Block pose_block(const std::string& name, const Pose& start) {
  require(is_rotation(start.linear(), 1e-3), name + ": start has no proper rotation");
  Eigen::VectorXd values(7);
  from_pose(start, values.data());
  return with(BlockKind::Pose, name, values, {"x [m]", "y [m]", "z [m]", "rx [rad]", "ry [rad]", "rz [rad]"});
}

Block arm_block(const std::string& name, const kinematics::DhChain& start) {
  require(!start.joints.empty(), name + ": an arm needs at least one joint");
  Eigen::VectorXd values(static_cast<Eigen::Index>(5 * start.joints.size()));
  std::vector<std::string> coordinates;
  for (std::size_t i = 0; i < start.joints.size(); ++i) {
    const kinematics::DhJoint& joint = start.joints[i];
    values.segment<5>(static_cast<Eigen::Index>(5 * i)) << joint.b, joint.theta_offset, joint.a, joint.alpha,
        joint.beta;
    for (const char* parameter : {"b [m]", "theta_offset [rad]", "a [m]", "alpha [rad]", "beta [rad]"})
      coordinates.push_back("joint" + std::to_string(i + 1) + "." + parameter);
  }
  Block block = with(BlockKind::Arm, name, values, coordinates);
  block.chain = start;
  return block;
}

Block point_block(const std::string& name, const Eigen::Vector3d& start) {
  return with(BlockKind::Point, name, start, {"x [m]", "y [m]", "z [m]"});
}

Block vector_block(const std::string& name, const Eigen::VectorXd& start, const std::vector<std::string>& coordinates) {
  require(static_cast<std::size_t>(start.size()) == coordinates.size(),
          name + ": " + std::to_string(start.size()) + " values, but " + std::to_string(coordinates.size()) + " names");
  return with(BlockKind::Vector, name, start, coordinates);
}

Block camera_block(const std::string& name, const Pinhole& start) {
  start.validate();
  std::vector<std::string> coordinates;
  for (std::size_t i = 0; i < Pinhole::parameter_names.size(); ++i)
    coordinates.push_back(std::string(Pinhole::parameter_names[i]) + (i < 4 ? " [px]" : " [-]"));
  Block block = with(BlockKind::Camera, name, start.parameters(), coordinates);
  block.width = start.width, block.height = start.height;
  return block;
}

}  // namespace kr5::fit
