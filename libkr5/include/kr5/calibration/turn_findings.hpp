// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <kr5/calibration/circle_point.hpp>
#include <kr5/kinematics/dh_chain.hpp>

/// @file
/// Reasons to doubt the turns of several joints together: what no single arc shows.

namespace kr5::calibration {

struct TurnFindingOptions {
  double min_noise_ratio = 5.0;        ///< [-]
  double min_jump = 8.0;               ///< [-]
  double min_length = 0.01;            ///< [m]
  double max_length = 20.0;            ///< [m]
  double max_scale_difference = 0.02;  ///< [-]

  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("min_noise_ratio", self.min_noise_ratio,
          "Noise of one turn over the median of the others from which it is uneven [-].");
    visit("min_jump", self.min_jump,
          "Distance of the home points of two turns, in standard deviations, from which the device moved [-].");
    visit("min_length", self.min_length, "Sum of all lengths below which no arm is meant [m].");
    visit("max_length", self.max_length, "Sum of all lengths above which no arm is meant [m].");
    visit("max_scale_difference", self.max_scale_difference,
          "Relative difference of all lengths from the nominal ones that is a tolerance [-].");
  }
};

/// A turn whose samples scatter much more than those of the others.
struct UnevenNoise {
  int joint = 0;
  double sigma = 0.0;         ///< [m]
  double sigma_others = 0.0;  ///< [m]
  std::optional<int> after_step;

  static void each_field(auto& self, auto&& visit) {
    visit("joint", self.joint, "Joint, from 0.");
    visit("sigma", self.sigma, "Noise of a measured position per axis in its turn [m].");
    visit("sigma_others", self.sigma_others, "Median of that noise in the turns of the others [m].");
    visit("after_step", self.after_step,
          "Sample, from 0, before which the places leave their course the most; none where it cannot be told.");
  }
};

enum class TurnEnd { First, Last };
constexpr auto enum_names(TurnEnd) { return names<TurnEnd>({{TurnEnd::First, "first"}, {TurnEnd::Last, "last"}}); }

/// Measurements that are shifted by a row against the joint values: of nearly every joint the first, or the last,
/// sample belongs to another joint's turn.
struct ShiftedRows {
  TurnEnd end = TurnEnd::First;
  std::vector<int> joints;

  static void each_field(auto& self, auto&& visit) {
    visit("end", self.end, "Which sample of the turns it is: first | last.");
    visit("joints", self.joints, "Joints whose turns show it, from 0.");
  }
};

/// A measured point that is elsewhere with every joint at home by the turn of one joint than by that of the one before.
struct HomeJump {
  int joint = 0;
  double distance = 0.0;  ///< [m]
  double std = 0.0;       ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("joint", self.joint, "Joint before whose turn it jumped, from 0.");
    visit("distance", self.distance, "Distance of the point by both turns [m].");
    visit("std", self.std, "About the standard deviation of that distance without a jump [m].");
  }
};

/// An arm that is too long or too short for one: of a wrong unit.
struct ImplausibleLength {
  double length = 0.0;  ///< [m]
  bool too_long = false;

  static void each_field(auto& self, auto&& visit) {
    visit("length", self.length, "Sum of all lengths of the arm [m].");
    visit("too_long", self.too_long, "Whether it is too long, else too short.");
  }
};

enum class NominalMismatchKind { JointCount, Mirrored, Scaled };
constexpr auto enum_names(NominalMismatchKind) {
  return names<NominalMismatchKind>({{NominalMismatchKind::JointCount, "joint_count"},
                                     {NominalMismatchKind::Mirrored, "mirrored"},
                                     {NominalMismatchKind::Scaled, "scaled"}});
}

/// What contradicts the nominal arm as a whole.
struct NominalMismatch {
  NominalMismatchKind kind = NominalMismatchKind::JointCount;
  int nominal_joints = 0;
  double scale = 1.0;     ///< [-]
  double residual = 0.0;  ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "What contradicts: joint_count | mirrored | scaled.");
    visit("nominal_joints", self.nominal_joints, "Joints of the nominal arm.");
    visit("scale", self.scale, "Factor of all lengths against the nominal ones; negative of a mirrored arm [-].");
    visit("residual", self.residual, "Relative RMS difference of the lengths that the factor leaves [-].");
  }
};

struct TurnFindings {
  std::optional<ShiftedRows> shifted_rows;
  std::vector<UnevenNoise> uneven_noise;
  std::vector<HomeJump> home_jumps;
  std::optional<ImplausibleLength> implausible_length;
  std::optional<NominalMismatch> nominal_mismatch;

  bool empty() const {
    return !shifted_rows && uneven_noise.empty() && home_jumps.empty() && !implausible_length && !nominal_mismatch;
  }

  static void each_field(auto& self, auto&& visit) {
    visit("shifted_rows", self.shifted_rows, "Measurements shifted by a row against the joint values.");
    visit("uneven_noise", self.uneven_noise, "Turns whose samples scatter much more than those of the others.");
    visit("home_jumps", self.home_jumps,
          "Joints before whose turns the device moved; only of turns with joint values, without which nothing says "
          "where the others stood.");
    visit("implausible_length", self.implausible_length, "An arm that is too long or too short for one.");
    visit("nominal_mismatch", self.nominal_mismatch, "What contradicts the nominal arm, where one is given.");
  }
};

/// Findings of the turns of an arm whose axes were identified.
/// @param arm     The arm that has these axes.
/// @param nominal The nominal arm, or null.
/// @throws InvalidArgument for sizes that differ or invalid options.
TurnFindings find_in_turns(std::span<const std::vector<JointSample>> turns, std::span<const JointAxisResult> axes,
                           const kinematics::DhChain& arm, const Eigen::VectorXd& home,
                           const kinematics::DhChain* nominal = nullptr, const TurnFindingOptions& options = {});

}  // namespace kr5::calibration
