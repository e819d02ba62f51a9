// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

/// @file
/// Turns of single joints in one table of joint values: where each joint stands while the others turn, and which rows
/// are of its own turn.

namespace kr5::calibration {

struct TurnSplitOptions {
  double max_standing = 1e-3;  ///< [rad]

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("max_standing", self.max_standing, "Maximum distance from home of a joint that stands still [rad].");
  }
};

/// Joints that are away from home in one row together.
struct JointsAway {
  int row = 0;
  std::vector<int> joints;

  static void each_field(auto& self, auto&& visit) {
    visit("row", self.row, "Row, from 0.");
    visit("joints", self.joints, "Joints that are away from home in it, from 0.");
  }
};

struct TurnSplit {
  Eigen::VectorXd home;  ///< [rad]
  std::vector<std::vector<int>> rows;
  std::vector<JointsAway> several;
  std::vector<int> still;

  /// Whether each joint turned, and always alone.
  bool usable() const { return !rows.empty() && several.empty() && still.empty(); }

  static void each_field(auto& self, auto&& visit) {
    visit("home", self.home, "Joint values at which the others stand while one joint turns [rad].");
    visit("rows", self.rows, "Rows of each joint's turn, from 0; rows with every joint at home belong to each joint.");
    visit("several", self.several, "Rows in which several joints are away from home.");
    visit("still", self.still, "Joints that never left home, from 0.");
  }
};

/// Splits joint values, a row a sample and a column a joint, into the turns of single joints. A joint is at home where
/// it stands most often: at the value near which most of its others lie, of equals the one in the earliest row.
/// @throws InvalidArgument for no row or no joint, values that are not finite, or invalid options.
TurnSplit split_turns(const Eigen::Ref<const Eigen::MatrixXd>& q, const TurnSplitOptions& options = {});

}  // namespace kr5::calibration
