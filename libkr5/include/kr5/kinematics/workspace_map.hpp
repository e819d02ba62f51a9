// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <kr5/core/fields.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Where an arm can put a point, and how well it moves it there (Hayat et al. 2022, section 3.3).

namespace kr5::kinematics {

struct WorkspaceOptions {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< [m]
  double characteristic_length = 0.0;               ///< [m]
  int samples = 60'000;
  int cells = 60;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("point", self.point, "Point in the flange frame whose places are mapped [m].");
    visit("characteristic_length", self.characteristic_length,
          "Length that makes linear and angular speeds comparable in the Jacobian; 0: the reach [m].");
    visit("samples", self.samples, "Number of postures, spread evenly over the limits.");
    visit("cells", self.cells, "Number of cells of the map, along the radius and along the height.");
  }
};

/// Maps over radius and height about the axis of the first joint. Rows go with the height, columns with the radius;
/// cells without a posture hold NaN. Values are the best of all postures whose point lies in the cell.
struct WorkspaceMap {
  double reach = 0.0;                  ///< [m]
  Eigen::VectorXd q_reach;             ///< [rad or m]
  double inner = 0.0;                  ///< [m]
  double lowest = 0.0;                 ///< [m]
  double highest = 0.0;                ///< [m]
  double length = 0.0;                 ///< [m]
  Eigen::VectorXd radius;              ///< [m]
  Eigen::VectorXd height;              ///< [m]
  Eigen::MatrixXd counts;              ///< [-]
  Eigen::MatrixXd dexterity;           ///< [m^k/rad^k]
  Eigen::MatrixXd volume;              ///< [-]
  Eigen::MatrixXd min_singular_value;  ///< [-]
  Eigen::MatrixXd condition;           ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("reach", self.reach,
          "Maximum distance of the point from the axis of the first joint, within the limits [m].");
    visit("q_reach", self.q_reach, "Joint values of that posture [rad or m].");
    visit("inner", self.inner, "Minimum distance from that axis [m].");
    visit("lowest", self.lowest, "Minimum height of the point along that axis, from the base [m].");
    visit("highest", self.highest, "Maximum height [m].");
    visit("length", self.length, "Length by which linear rows of the Jacobian were divided [m].");
    visit("radius", self.radius, "Radii of the middles of the cells [m].");
    visit("height", self.height, "Heights of the middles of the cells [m].");
    visit("counts", self.counts, "Number of postures in each cell.");
    visit("dexterity", self.dexterity,
          "Manipulability of the point, sqrt(det(J J^T)) of the linear rows (Yoshikawa), greatest in the cell.");
    visit("volume", self.volume, "Manipulability of all rows, linear ones over `length`, greatest in the cell [-].");
    visit("min_singular_value", self.min_singular_value,
          "Minimum singular value of the same Jacobian, greatest in the cell [-].");
    visit("condition", self.condition, "Condition number of the same Jacobian, least in the cell [-].");
  }
};

/// Maps the places of a point of the flange for all postures within the limits. Postures come from a sequence of low
/// discrepancy, so the same arm gives the same map; the reach is then found exactly. Unlimited revolute joints
/// (infinite limits) turn once.
/// @throws InvalidArgument for a chain without joints, limits of another number or in the wrong order, a prismatic
/// joint
///         without limits, or invalid options.
WorkspaceMap workspace_map(const DhChain& chain, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                           const WorkspaceOptions& options = {});

/// Centre of a spherical wrist, in which the last three axes meet, in the flange frame [m]: the point to which makers
/// state the reach. Empty for other arms.
std::optional<Eigen::Vector3d> wrist_centre(const DhChain& chain);

}  // namespace kr5::kinematics
