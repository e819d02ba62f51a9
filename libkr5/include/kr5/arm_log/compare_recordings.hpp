// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/gap/diagnose.hpp>

/// @file
/// Two recordings of one robot, or of two robots of one model: what they have in common, and what differs between them.

namespace kr5::arm_log {

/// A parameter of an effect in both recordings.
struct ParameterChange {
  std::string name;
  std::vector<double> first;   ///< Empty where neither model nor recording gives it a value.
  std::vector<double> second;  ///< As in gap::ParameterEstimate.
  std::vector<double> std;     ///< Of the difference.
  std::string unit;

  static void each_field(auto& self, auto&& visit) {
    visit("name", self.name, "Name in the catalogue.");
    visit("first", self.first, "Value in the first recording; empty: stated neither by the model nor by its causes.");
    visit("second", self.second, "Value in the second recording: a number, a vector, or a 4x4 matrix row by row.");
    visit("std", self.std,
          "Standard deviation of the difference, of each number; of a pose x y z [m] and rotation "
          "vector [rad].");
    visit("unit", self.unit, "Unit.");
  }
};

/// An effect that differs between the recordings.
struct EffectChange : gap::EffectName {
  double probability = 0.0;
  double explained_fraction = 0.0;
  std::vector<ParameterChange> parameters = {};
  std::vector<gap::EffectName> tied_with = {};

  static void each_field(auto& self, auto&& visit) {
    EffectName::each_field(self, visit);
    visit("probability", self.probability, "Probability that the effect differs.");
    visit("explained_fraction", self.explained_fraction, "Fraction of the excess of the difference that it explains.");
    visit("parameters", self.parameters, "Parameters in both recordings, in absolute values.");
    visit("tied_with", self.tied_with, "Effects that these recordings cannot distinguish from it.");
  }
};

struct RecordingComparison {
  /// Why the model and the first recording disagree.
  gap::Diagnosis first;
  /// Why the first and the second recording disagree. Of `reversed` recordings: the second and the first.
  gap::Diagnosis difference;
  /// Whether the difference is told better from the second recording to the first: a load that was taken off.
  bool reversed = false;
  /// Whether the freely fitted arm of one recording was the reference of the other, so that errors of the model which
  /// both have are no change.
  bool by_arm = false;
  std::vector<EffectChange> changes;    ///< Most probable first.
  std::vector<gap::EffectName> common;  ///< Causes of `first` that did not change.
  double gap_with_model = 0.0;          ///< Of the second recording, over all its columns [-].
  double gap_with_first = 0.0;          ///< The same with the causes of the first in the model [-].
};

/// What differs between two recordings of the same model.
///
/// The model is tuned by the diagnosis of the first recording. Where both are motions on measured positions, what the
/// freely fitted arm of the first (base parameters, friction, rotors) leaves of the second is the difference, so that
/// errors of the model which both have are not told as a change; what that arm leaves of its own motions, and its
/// uncertainty in the motions of the second, count as an error of each column. The uncertainty of a change holds that
/// of both recordings.
/// @param second Its cell gives the noise of its sensors alone.
/// @throws InvalidArgument for robots that differ, and as gap::diagnose.
RecordingComparison compare_recordings(const cell::Recording& first, const cell::Recording& second,
                                       const cell::Simulator& simulator, const gap::DiagnoseOptions& options = {});

}  // namespace kr5::arm_log
