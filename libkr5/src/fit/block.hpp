// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <kr5/fit/pose_chain.hpp>
#include <kr5/fit/solution.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Private: a block of parameters of a problem. Stored numbers: a pose as x y z and a quaternion, x y z w; everything
/// else as its coordinates.

namespace kr5::fit {

enum class BlockKind { Pose, Arm, Point, Vector, Camera };

struct Block {
  BlockKind kind = BlockKind::Vector;
  std::string name;
  std::vector<FitCoordinate> coordinates;
  Eigen::VectorXd values;
  Eigen::VectorXd start;    ///< Values when the block was added.
  std::vector<bool> held;   ///< By coordinate.
  std::vector<int> leader;  ///< By coordinate: the one that it follows, or itself.
  Eigen::VectorXd ratio;    ///< By coordinate: its change over that of its leader [-].
  Eigen::VectorXd prior;    ///< Standard deviation by coordinate; empty: no prior.
  bool nuisance = false;
  kinematics::DhChain chain;  ///< Of an arm: types of the joints and T_base_0.
  int width = 0, height = 0;  ///< Of a camera [px].

  int size() const { return static_cast<int>(coordinates.size()); }
  /// Coordinates that are neither held nor follow another one.
  std::vector<int> free() const;
  bool any_free() const { return std::find(held.begin(), held.end(), false) != held.end(); }
  /// Holds a coordinate, and those tied to it.
  void hold(int coordinate);
  Pose pose() const;
  kinematics::DhChain arm() const;
  Pinhole camera() const;
  /// Difference of values, as they are stored, from the start, by coordinate.
  Eigen::VectorXd change(const double* at) const;
  Eigen::VectorXd change() const { return change(values.data()); }
  /// Derivative of the change by the coordinates, which perturb a pose from the right.
  Eigen::MatrixXd change_by_coordinates(const double* at) const;
};

/// @throws InvalidArgument when there is no such block.
const Block& block_of(const std::vector<Block>& blocks, FitBlock handle, const char* what = "block");
Block& block_of(std::vector<Block>& blocks, FitBlock handle, const char* what = "block");
/// The same when it is of another kind, in words: "base is no point".
const Block& block_of(const std::vector<Block>& blocks, FitBlock handle, BlockKind kind, const char* what);
Block& block_of(std::vector<Block>& blocks, FitBlock handle, BlockKind kind, const char* what);

Pose to_pose_block(const double* values);
kinematics::DhChain to_arm(const kinematics::DhChain& form, const double* values);
void from_pose(const Pose& T, double* values);

Block pose_block(const std::string& name, const Pose& start);
Block arm_block(const std::string& name, const kinematics::DhChain& start);
Block point_block(const std::string& name, const Eigen::Vector3d& start);
/// Coordinates are named with their units: "q3 [rad]".
Block vector_block(const std::string& name, const Eigen::VectorXd& start, const std::vector<std::string>& coordinates);
Block camera_block(const std::string& name, const Pinhole& start);

}  // namespace kr5::fit
