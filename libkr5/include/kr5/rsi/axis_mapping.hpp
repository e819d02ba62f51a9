// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/kinematics/dh_chain.hpp>
#include <kr5/robot/sensing.hpp>
#include <kr5/rsi/controller_axes.hpp>
#include <kr5/rsi/link_observations.hpp>
#include <kr5/rsi/telegram_layout.hpp>

/// @file
/// Directions and zeros of a controller's axes, from what it tells: axis values and the pose of its tool in the same
/// cycle.

namespace kr5::rsi {

/// What a controller tells of one cycle.
struct AxisPoseRow {
  Vector6 axes = Vector6::Zero();  ///< A1 to A6 as the controller counts them [rad].
  Pose pose = Pose::Identity();    ///< Its active tool in its active base [m].

  static void each_field(auto& self, auto&& visit) {
    visit("axes", self.axes, "A1 to A6 as the controller counts them [rad].");
    visit("pose", self.pose, "Its active tool in its active base [m].");
  }
};

/// Rows of the telegrams that hold axis values and a pose; empty where the layout lacks one of them.
std::vector<AxisPoseRow> axis_pose_rows(const LinkObservations& observations, const TelegramLayout& layout);

/// Whether the active base and tool of the controller are those of the cell.
enum class MappingFrames {
  Known,    ///< The base of the arm, and the tool of the model.
  Unknown,  ///< Any, which do not change between the rows; they are estimated.
  Either,   ///< Known, and where no mapping fits with those, unknown.
};
constexpr auto enum_names(MappingFrames) {
  using enum MappingFrames;
  return names<MappingFrames>({{Known, "known"}, {Unknown, "unknown"}, {Either, "either"}});
}

struct AxisMappingOptions {
  MappingFrames frames = MappingFrames::Either;
  double position_tolerance = 0.02;  ///< [m]
  double rotation_tolerance = 0.05;  ///< [rad]
  double min_motion = 0.1;           ///< [rad]
  int min_rows = 4;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("frames", self.frames,
          "Active base and tool of the controller: known (those of the cell) | unknown | either.");
    visit("position_tolerance", self.position_tolerance, "Misfit of a position up to which a mapping fits [m].");
    visit("rotation_tolerance", self.rotation_tolerance, "Misfit of an orientation up to which it fits [rad].");
    visit("min_motion", self.min_motion, "Range below which an axis counts as one that did not move [rad].");
    visit("min_rows", self.min_rows, "Least number of different postures.");
  }
};

/// Directions and zeros by which the arm gives the poses: pose = T_active_base flange(q) T_flange_active.
struct AxisMapping {
  ControllerAxes axes;
  double position_misfit = 0.0;             ///< [m]
  double rotation_misfit = 0.0;             ///< [rad]
  Pose T_active_base = Pose::Identity();    ///< [m]
  Pose T_flange_active = Pose::Identity();  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("axes", self.axes, "Directions, and zeros that are multiples of a quarter turn.");
    visit("position_misfit", self.position_misfit, "Greatest distance from a pose that was told [m].");
    visit("rotation_misfit", self.rotation_misfit, "Greatest angle to an orientation that was told [rad].");
    visit("T_active_base", self.T_active_base, "Base of the arm in the active base of the controller [m].");
    visit("T_flange_active", self.T_flange_active, "Active tool of the controller in the flange [m].");
  }
};

enum class MappingStatus {
  Found,        ///< The mappings give equal poses in every posture: with a spherical wrist there are two.
  Ambiguous,    ///< The rows do not tell which of the mappings it is.
  NotMoved,     ///< Nor do they, for axes that did not move: `unmoved`.
  NothingFits,  ///< The arm is another one, or its zeros are no multiples of a quarter turn.
  TooFewRows,
};
constexpr auto enum_names(MappingStatus) {
  using enum MappingStatus;
  return names<MappingStatus>({{Found, "found"},
                               {Ambiguous, "ambiguous"},
                               {NotMoved, "not_moved"},
                               {NothingFits, "nothing_fits"},
                               {TooFewRows, "too_few_rows"}});
}

struct AxisMappingResult {
  MappingStatus status = MappingStatus::TooFewRows;
  std::vector<AxisMapping> mappings;
  std::vector<std::string> unmoved;
  std::vector<std::string> free_zeros;
  bool frames_known = true;
  int postures = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("status", self.status, "Status: found | ambiguous | not_moved | nothing_fits | too_few_rows.");
    visit("mappings", self.mappings, "Mappings that fit; those that are nearest to the joints of the cell first.");
    visit("unmoved", self.unmoved, "Axes that did not move.");
    visit("free_zeros", self.free_zeros,
          "Axes whose zeros the poses do not tell, because a turn of the active base or tool is the same; 0 is given.");
    visit("frames_known", self.frames_known, "True where active base and tool are those of the cell.");
    visit("postures", self.postures, "Different postures that were compared.");
  }
};

/// Mappings of a controller's axes that fit what it tells. Takes a few milliseconds, however many rows there are.
/// @param model Arm of six revolute joints, and the tool of known frames.
/// @throws InvalidArgument for options, or for another arm.
AxisMappingResult find_axis_mapping(const std::vector<AxisPoseRow>& rows, const robot::SensorModel& model,
                                    const AxisMappingOptions& options = {});

}  // namespace kr5::rsi
