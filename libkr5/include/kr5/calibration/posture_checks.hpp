// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include <kr5/calibration/kinematics.hpp>

/// @file
/// Faults of measured postures that leave their mark on all rows together: joints that hardly moved, a wrong unit, a
/// mirrored axis, rows that are one off or in another order.

namespace kr5::calibration {

struct PostureCheckOptions {
  double max_standing = 1e-3;               ///< [rad or m]
  double min_turn = std::numbers::pi / 36;  ///< [rad]
  double min_misfit = 2e-3;                 ///< [m]
  double max_left = 0.4;                    ///< [-]
  double min_unrelated = 0.2;               ///< [-]
  double max_left_reordered = 0.05;         ///< [-]
  double scale_difference = 1e-3;           ///< [-]
  int max_matched = 500;

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("max_standing", self.max_standing, "Range of the values of a joint below which it stood still [rad or m].");
    visit("min_turn", self.min_turn,
          "Range below which the parameters of a revolute joint are poorly determined [rad].");
    visit("min_misfit", self.min_misfit,
          "Median distance of the measured places from the nominal arm below which nothing needs an explanation [m].");
    visit("max_left", self.max_left, "Part of the misfit that an explanation may leave at most [-].");
    visit("min_unrelated", self.min_unrelated,
          "Misfit over the spread of the places from which on these have nothing to do with the joint values [-].");
    visit("max_left_reordered", self.max_left_reordered,
          "Part of the misfit that another order may leave; an order that is searched for explains something by chance "
          "[-].");
    visit("scale_difference", self.scale_difference, "Difference of a scale from 1 that is none [-].");
    visit("max_matched", self.max_matched, "Number of postures up to which another order is searched for.");
  }
};

/// A joint that stood still, or hardly moved.
struct StillJoint {
  int joint = 0;
  double range = 0.0;  ///< [rad or m]
  bool moved = false;

  static void each_field(auto& self, auto&& visit) {
    visit("joint", self.joint, "Joint, from 0.");
    visit("range", self.range, "Range of its values [rad or m].");
    visit("moved", self.moved, "Whether it moved at all.");
  }
};

/// Units that a factor of all lengths is known for.
enum class DeviceUnit { Unknown, Millimetre, Centimetre, Inch };
constexpr auto enum_names(DeviceUnit) {
  return names<DeviceUnit>({{DeviceUnit::Unknown, "unknown"},
                            {DeviceUnit::Millimetre, "millimetre"},
                            {DeviceUnit::Centimetre, "centimetre"},
                            {DeviceUnit::Inch, "inch"}});
}

/// Measured places that are farther apart, or nearer, than the arm's.
struct ScaledPlaces {
  double scale = 1.0;  ///< [-]
  double std = 0.0;    ///< [-]
  DeviceUnit unit = DeviceUnit::Unknown;
  double misfit = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("scale", self.scale, "Distances of the measured places over those of the nominal arm [-].");
    visit("std", self.std, "Its standard deviation, for residuals that are noise [-].");
    visit("unit", self.unit,
          "Unit that the places would be in, read as metres: unknown | millimetre | centimetre | inch.");
    visit("misfit", self.misfit, "Median distance that the scale leaves [m].");
  }
};

/// Measured places of the other handedness.
struct MirroredPlaces {
  double misfit = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("misfit", self.misfit, "Median distance that mirroring leaves [m].");
  }
};

/// Measured places that belong to the joint values of the row before (or after) their own.
struct ShiftedPlaces {
  int shift = 0;
  int first = 0;
  int last = 0;
  double misfit = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("shift", self.shift, "Rows from the measured place back to its joint values: 1 (before) or -1 (after).");
    visit("first", self.first, "First posture that was compared, from 0.");
    visit("last", self.last, "Last posture that was compared, from 0.");
    visit("misfit", self.misfit, "Median distance that the shift leaves [m].");
  }
};

/// Measured places that stand beside the joint values of another row.
struct ReorderedRows {
  std::vector<int> rows;
  std::vector<int> belongs_to;
  double misfit = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("rows", self.rows, "Postures whose measured place is that of another, from 0.");
    visit("belongs_to", self.belongs_to, "The posture that each of them belongs to, from 0.");
    visit("misfit", self.misfit, "Median distance that the order leaves [m].");
  }
};

/// Measured places that have nothing to do with the joint values, in any order.
struct UnrelatedPlaces {
  int first = 0;
  int last = 0;
  double spread = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("first", self.first, "First posture that was compared, from 0.");
    visit("last", self.last, "Last posture that was compared, from 0.");
    visit("spread", self.spread, "RMS distance of the measured places from their median [m].");
  }
};

/// What speaks against measured postures. Of scale, mirror, shift, order and no relation at most one is there: the one
/// that explains most.
struct PostureFindings {
  std::vector<StillJoint> still_joints;
  double misfit = 0.0;  ///< [m]
  std::optional<ScaledPlaces> scaled;
  std::optional<MirroredPlaces> mirrored;
  std::optional<ShiftedPlaces> shifted;
  std::optional<ReorderedRows> reordered;
  std::optional<UnrelatedPlaces> unrelated;

  static void each_field(auto& self, auto&& visit) {
    visit("still_joints", self.still_joints, "Joints that stood still, or hardly moved.");
    visit("misfit", self.misfit,
          "Median distance of the measured places from the nominal arm, device and tip as well placed as can be; 0 of "
          "fewer than eight places [m].");
    visit("scaled", self.scaled, "The places are farther apart, or nearer, than the arm's.");
    visit("mirrored", self.mirrored, "The places are mirrored: an axis of the device is reversed, or two changed.");
    visit("shifted", self.shifted, "The places are one row off the joint values.");
    visit("reordered", self.reordered, "The places stand in another order than the joint values.");
    visit("unrelated", self.unrelated, "The places have nothing to do with the joint values.");
  }
};

/// Joints that stood still or hardly moved over all postures.
/// @throws InvalidArgument for joint values that do not fit the arm, or are not finite.
std::vector<StillJoint> find_still_joints(const kinematics::DhChain& nominal, std::span<const ArmPosture> postures,
                                          const PostureCheckOptions& options = {});

/// Compares the measured places (the tool, or the first point that was seen; other postures are passed over) with the
/// nominal arm, for device and tip as well placed as can be: whether a scale, a mirror, a shift of the rows or another
/// order agrees much better. Outliers do not hide them. Fewer than eight places tell nothing.
/// @throws InvalidArgument for joint values that do not fit the arm or are not finite, or invalid options.
PostureFindings check_postures(const kinematics::DhChain& nominal, std::span<const ArmPosture> postures,
                               const PostureCheckOptions& options = {});

}  // namespace kr5::calibration
