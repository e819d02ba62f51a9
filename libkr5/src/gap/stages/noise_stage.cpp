// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/noise_stage.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <kr5/core/error.hpp>

#include "gap/reporting/residual_analysis.hpp"

namespace kr5::gap {
namespace {

/// Part of the noise of a column, from which an error is worth a word: less is what chance makes of it.
constexpr double notable_error = 0.5;

/// @param field Whose entries name a column.
template <class Entries>
void require_compared(const ComparisonData& data, const std::string& field, const Entries& entries) {
  std::set<std::string> compared;
  for (const Block& block : data.blocks) compared.insert(column_name(block.kind, block.column));
  for (const auto& own : entries) {
    if (compared.contains(own.column)) continue;
    std::string names;
    for (const std::string& name : compared) names += (names.empty() ? "" : ", ") + name;
    throw InvalidArgument(field + ": found column '" + own.column + "', expected one of " + names);
  }
}

void set_correlations(ComparisonData& data, const DiagnoseOptions& options) {
  require_compared(data, "noise_correlations", options.noise_correlations);
  for (Block& block : data.blocks)
    for (const ColumnCorrelation& own : options.noise_correlations)
      if (own.column == column_name(block.kind, block.column)) block.correlation = own.correlation;
}

/// Takes what the simulator is known to be off in a column as noise beside that of the sensor, and this as large as it
/// is in a mean.
void add_known_errors(NoiseOutput& out, const DiagnoseOptions& options) {
  require_compared(out.data, "simulator_errors", options.simulator_errors);
  for (Block& block : out.data.blocks) {
    const double error = known_error(options, column_name(block.kind, block.column));
    if (error == 0.0 && block.correlation == 0.0) continue;
    const double sigma = std::hypot(std::sqrt(colour_factor(block.correlation)) * block.sigma, error);
    block.inflation = sigma / block.sigma;
    block.rows_of(out.base) /= block.inflation;
    block.sigma = sigma;
  }
  for (const ColumnError& own : options.simulator_errors)
    if (std::ranges::any_of(out.data.blocks, [&](const Block& block) {
          return column_name(block.kind, block.column) == own.column &&
                 own.error >= notable_error * block.sigma / block.inflation;
        }))
      out.excused.push_back(own);
}

int mark_all_spikes(NoiseOutput& out) {
  const int spikes = mark_spikes(out.data, out.base);
  return spikes + mark_stray_corners(out.data, out.base);
}

void take_noise_seen(NoiseOutput& out) {
  out.corrected = correct_wrong(out.data, noise_scales(out.data, out.base, out.coarse), out.base);
}

}  // namespace

NoiseOutput noise_stage(const CompareOutput& compared, const DiagnoseOptions& options) {
  NoiseOutput out{compared.data, compared.base, {}, {}, {}, 0};
  mark_repeats(out.data);
  set_correlations(out.data, options);
  if (options.simulator_errors.empty() && options.noise_correlations.empty()) {
    out.spikes = mark_all_spikes(out);
    take_noise_seen(out);
  } else {  // a spike is what stands out of noise and known errors together
    take_noise_seen(out);
    add_known_errors(out, options);
    out.spikes = mark_all_spikes(out);
  }
  return out;
}

}  // namespace kr5::gap
