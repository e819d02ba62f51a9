// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/gap/diagnosis.hpp>

/// @file
/// A diagnosis in sentences, for terminal, page, JSON and Python alike: made last, from its fields, and read back by
/// nothing. @see notes.hpp, words.hpp

namespace kr5::gap {

/// The diagnosis for one who did not run it: the causes, how far they reduce the gap, where it is, and the limits
/// within which this holds.
std::string verdict_text(const Diagnosis& diagnosis);
/// Its beginning, the cause first, in at most 40 words.
std::string headline_text(const Diagnosis& diagnosis);
/// The rest of it; empty where the headline says all.
std::string details_text(const Diagnosis& diagnosis);
/// The causes, most probable first; empty where none is named.
std::string causes_text(const Diagnosis& diagnosis);
/// Where the gap is, as a sentence; empty where there is none.
std::string location_text(const std::vector<ColumnExcess>& where);
/// Name, value and probability of a cause.
std::string cause_text(const Cause& cause, const std::vector<std::string>& joint_names = {});
/// A dependence in a kind of experiment, as the end of `the gap ...`.
std::string dependence_text(const Dependence& dependence, const std::string& kind = "");
/// Why an effect that comes near is not blamed.
std::string reason_text(const NearestEffect& nearest);
/// Why an effect was not tried.
std::string reason_text(const UntriedEffect& untried);
/// The experiment that would distinguish tied effects; empty where none is known.
std::string experiment_text(const NextExperiment& next);
}  // namespace kr5::gap
