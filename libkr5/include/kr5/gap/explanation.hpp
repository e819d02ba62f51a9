// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/gap/cause_evidence.hpp>
#include <kr5/gap/diagnosis.hpp>
#include <kr5/gap/effect_fit.hpp>

/// @file
/// A diagnosis held against its recording: residuals with and without each cause, other effects in the place of one,
/// and any effect fitted. Sentences are made of it in explanation_text.hpp.

namespace kr5::gap {

/// The noise that a diagnosis measured, for residuals and fits in its units.
std::vector<NoiseOverride> measured_noise(const Diagnosis& found);

/// The cell with these causes added, but those that the catalogue does not name, which a cell cannot hold.
/// @throws InvalidArgument for a parameter of the wrong form, and for a target that the cell does not have.
cell::Cell with_causes(const cell::Cell& cell, const std::vector<Cause>& causes);

/// What a recording says of its diagnosis.
struct DiagnosisEvidence {
  std::vector<ResidualColumn> residuals;
  std::vector<JudgedColumn> columns;
  std::vector<CauseEvidence> causes;
  bool held_out = false;

  /// Column of the residuals at the cell with all causes but one (from 0).
  int cell_without(std::size_t cause) const { return causes.size() > 1 ? 2 + static_cast<int>(cause) : 0; }

  static void each_field(auto& self, auto&& visit) {
    visit("residuals", self.residuals,
          "Residuals of every column; their columns are of the cell of the recording, then of that with the causes, "
          "then, of several causes, of that without each.");
    visit("columns", self.columns, "Gap of every column at the cell of the recording.");
    visit("causes", self.causes, "Evidence of each cause; empty where there is none, or a cell cannot hold them all.");
    visit("held_out", self.held_out, "Whether experiments judge that were not used for the fit.");
  }
};

/// @throws InvalidArgument for a recording of another robot, and when nothing can be compared.
DiagnosisEvidence diagnosis_evidence(const Diagnosis& found, const cell::Recording& recording,
                                     const cell::Simulator& simulator);

/// The effects that explain most of what a cause (from 0) explains, in its place; at most three, the best first.
/// @throws InvalidArgument for evidence without the cause.
std::vector<EffectFit> rival_effects(const Diagnosis& found, const DiagnosisEvidence& evidence, std::size_t cause,
                                     const cell::Recording& recording, const cell::Simulator& simulator);

/// An effect on a target, fitted to what the other causes of a diagnosis leave.
struct EffectTrial : EffectName {
  std::optional<EffectFit> fit;
  std::optional<EffectName> replaced;

  static void each_field(auto& self, auto&& visit) {
    EffectName::each_field(self, visit);
    visit("fit", self.fit, "What it explains; none where it changes no recorded column.");
    visit("replaced", self.replaced,
          "Cause in whose place it explains most; none without causes, and where it is one.");
  }
};

/// An effect on each of these targets in place of the cause where it explains most, or as the cause that it is; the
/// best first.
/// @throws InvalidArgument for an effect that is not in the catalogue.
std::vector<EffectTrial> try_effect(const Diagnosis& found, const std::string& effect,
                                    const std::vector<std::string>& targets, const cell::Recording& recording,
                                    const cell::Simulator& simulator);

}  // namespace kr5::gap
