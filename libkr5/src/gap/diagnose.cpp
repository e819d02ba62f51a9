// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/diagnose.hpp>

#include <chrono>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include <kr5/core/error.hpp>

#include "gap/stages/report_stage.hpp"
#include "gap/stages/stage_progress.hpp"

namespace kr5::gap {

void DiagnoseOptions::validate() const {
  require(max_effects >= 1, "max_effects must be at least 1");
  require(refits >= 1, "refits must be at least 1");
  require(beam >= 1, "beam must be at least 1");
  require(false_alarms > 0 && false_alarms < 1, "false_alarms must lie between 0 and 1");
  require(simulator_accuracy >= 0 && simulator_accuracy < 1, "simulator_accuracy must lie between 0 and 1");
  require(simulator_floor >= 0, "simulator_floor must not be negative");
  require(threads >= 0, "threads must not be negative");
  std::set<std::string> named;
  for (const ColumnError& own : simulator_errors) {
    require(own.error >= 0 && std::isfinite(own.error),
            "simulator_errors: " + own.column + " must be finite and not negative");
    require(named.insert(own.column).second, "simulator_errors: " + own.column + " is stated twice");
  }
  named.clear();
  for (const ColumnCorrelation& own : noise_correlations) {
    require(own.correlation >= 0 && own.correlation < 1, "noise_correlations: " + own.column + ": found " +
                                                             std::to_string(own.correlation) +
                                                             ", expected at least 0 and less than 1");
    require(named.insert(own.column).second, "noise_correlations: " + own.column + " is stated twice");
  }
}

namespace {

Diagnosis diagnosis_of(const cell::Recording& recording, const cell::Simulator& simulator, const DiagnoseOptions& asked,
                       bool chosen) {
  asked.validate();
  recording.cell.validate();
  const auto start = std::chrono::steady_clock::now();
  const auto seconds = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(); };
  DiagnoseOptions options = asked;
  options.progress = never_falling(asked.progress);
  const std::optional<cell::Recording> reset = from_zero(recording);

  const CompareOutput compared = compare_stage(reset ? *reset : recording, simulator, options);
  const NoiseOutput noise = noise_stage(compared, options);
  const ScreenOutput screened = chosen ? start_stage(noise, options) : screen_stage(noise, options);
  const double seconds_screening = seconds();
  const JudgeOutput judged = chosen ? judge_stage(screened, start_search(screened), options, Blame::All)
                                    : judge_stage(screened, search_stage(screened, options), options);
  Diagnosis out = report_stage(compared, noise, screened, judged, options);

  out.clock_reset = reset.has_value();
  out.seconds_screening = seconds_screening;
  out.seconds = seconds();
  return out;
}

}  // namespace

Diagnosis diagnose(const cell::Recording& recording, const cell::Simulator& simulator, const DiagnoseOptions& options) {
  return diagnosis_of(recording, simulator, options, false);
}

Diagnosis diagnose_start(const cell::Recording& recording, const cell::Simulator& simulator,
                         const DiagnoseOptions& options) {
  require(!options.start.empty(), "start: found no effect, expected those that are blamed");
  return diagnosis_of(recording, simulator, options, true);
}

}  // namespace kr5::gap
