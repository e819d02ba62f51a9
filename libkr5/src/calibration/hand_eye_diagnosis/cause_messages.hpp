// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include "calibration/hand_eye_diagnosis/hypotheses.hpp"

/// @file
/// What a diagnosis says to people.

namespace kr5::calibration::evidence {

/// Fills text, evidence, remedy, value and unit of `named` from the hypothesis that found it.
void describe(const Case& c, const SetupHypothesis& h, NamedCause& named);
/// The same when the wrist did not turn enough.
void describe_rotation(const HandEyeDiagnosis& d, const HandEyeDiagnosisOptions& options, NamedCause& named);
std::string verdict_text(const HandEyeResult& result, const HandEyeDiagnosisOptions& options,
                         const HandEyeDiagnosis& d);

}  // namespace kr5::calibration::evidence
