// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include <kr5/gap/diagnose.hpp>

/// @file
/// How far a diagnosis is.

namespace kr5::gap {

/// What is being done, and which part of the whole it takes, about.
struct Step {
  const char* name;
  double from, to;
};
constexpr Step simulating_step{"simulating the nominal cell", 0.0, 0.02},
    screening_step{"screening effects", 0.02, 0.4}, refitting_step{"refitting effects", 0.4, 0.85},
    nuisance_step{"refitting effects with nuisance parameters", 0.85, 0.9},
    checking_step{"checking which effects are needed", 0.9, 0.95}, judging_step{"analysing the residuals", 0.95, 1.0};

/// Tells that a fraction of a step is done, where someone listens.
void tell(const DiagnoseOptions& options, const Step& step, double fraction);

/// A listener that is called by one thread at a time with a fraction that never falls, whichever thread comes last.
/// Nothing for nothing.
std::function<void(const std::string&, double)> never_falling(std::function<void(const std::string&, double)> listener);

}  // namespace kr5::gap
