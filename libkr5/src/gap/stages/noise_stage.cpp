// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/noise_stage.hpp"

#include <cmath>
#include <set>
#include <string>

#include <kr5/core/error.hpp>

#include "gap/reporting/residual_analysis.hpp"

namespace kr5::gap {
namespace {

void require_compared(const ComparisonData& data, const std::vector<ColumnError>& errors) {
  std::set<std::string> compared;
  for (const Block& block : data.blocks) compared.insert(column_name(block.kind, block.column));
  for (const ColumnError& own : errors) {
    if (compared.contains(own.column)) continue;
    std::string names;
    for (const std::string& name : compared) names += (names.empty() ? "" : ", ") + name;
    throw InvalidArgument("simulator_errors: found column '" + own.column + "', expected one of " + names);
  }
}

/// Takes what the simulator is known to be off in a column as noise beside that of the sensor.
void add_known_errors(NoiseOutput& out, const DiagnoseOptions& options) {
  require_compared(out.data, options.simulator_errors);
  for (Block& block : out.data.blocks) {
    const double error = known_error(options, column_name(block.kind, block.column));
    if (error == 0.0) continue;
    const double sigma = std::hypot(block.sigma, error);
    block.inflation = sigma / block.sigma;
    block.rows_of(out.base) /= block.inflation;
    block.sigma = sigma;
  }
  for (const ColumnError& own : options.simulator_errors)
    if (own.error > 0.0) out.excused.push_back(own);
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
  if (options.simulator_errors.empty()) {
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
