// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/gap/explanation.hpp>
#include <kr5/gap/model_warnings.hpp>

/// @file
/// What a recording says for and against causes and other effects, in sentences with numbers: made last, of fields.
/// @see sentences.hpp for the diagnosis itself

namespace kr5::gap {

/// Sentences about an effect.
struct Reasons {
  std::vector<std::string> in_favour;
  std::vector<std::string> against;

  static void each_field(auto& self, auto&& visit) {
    visit("in_favour", self.in_favour, "Sentences that speak for it.");
    visit("against", self.against, "Sentences that speak against it.");
  }
};

/// What speaks for and against a cause (from 0) of a diagnosis; says so where nothing speaks against it.
/// @param evidence Of its recording; null where that is not known.
/// @throws InvalidArgument for a number that no cause has.
Reasons cause_reasons(const Diagnosis& found, std::size_t cause, const DiagnosisEvidence* evidence = nullptr);

/// What other effects do in the place of a cause; says so where none does.
/// @param rivals Of rival_effects.
std::vector<std::string> rival_texts(const std::vector<EffectFit>& rivals, const DiagnosisEvidence& evidence);

/// What speaks for and against an effect that was fitted.
Reasons trial_reasons(const EffectTrial& trial, const Diagnosis& found, const DiagnosisEvidence& evidence);

/// Of a recording without gap: how near the floor its columns are.
std::string floor_text(const std::vector<JudgedColumn>& columns);

/// What speaks against the model, and against the zeros of the log, with causes of unusual size.
/// @param described What describes the robot: a file, the cell.
std::vector<std::string> model_warning_texts(const std::vector<ModelWarning>& warnings,
                                             const std::vector<std::string>& joint_names,
                                             const std::string& described = "the cell");

}  // namespace kr5::gap
