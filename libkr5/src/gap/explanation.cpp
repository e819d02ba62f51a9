// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/explanation.hpp>

#include <algorithm>
#include <functional>
#include <set>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/gap/estimated_effect.hpp>

#include "gap/known_row.hpp"

namespace kr5::gap {
namespace {

constexpr double noticeable_change = 0.02;  // of the gap of a column [-]
constexpr int most_tried = 6, max_rivals = 3;

bool in_catalogue(const Cause& cause) { return known_row(cause.effect) != nullptr; }

std::vector<Cause> without_cause(std::vector<Cause> causes, std::size_t cause) {
  causes.erase(causes.begin() + static_cast<std::ptrdiff_t>(cause));
  return causes;
}

EffectFitOptions options_of(const Diagnosis& found) { return {.noise = measured_noise(found)}; }

/// What a better fit of the same effect on the same target replaces.
void keep_better(std::vector<EffectTrial>& trials, const EffectFit& fit, const Cause* replaced) {
  const auto at = std::ranges::find(trials, static_cast<const EffectName&>(fit));
  if (at == trials.end() || (at->fit && at->fit->explained_fraction >= fit.explained_fraction)) return;
  at->fit = fit;
  at->replaced.reset();
  if (replaced && !(*replaced == fit)) at->replaced = *replaced;
}

}  // namespace

std::vector<NoiseOverride> measured_noise(const Diagnosis& found) {
  std::vector<NoiseOverride> out;
  for (const NoiseRatio& noise : found.noise) out.push_back({noise.key, noise.kind, noise.ratio});
  return out;
}

cell::Cell with_causes(const cell::Cell& cell, const std::vector<Cause>& causes) {
  cell::Cell out = cell;
  for (const Cause& cause : causes)
    if (in_catalogue(cause)) set_estimates(out, cause, cause.parameters);
  return out;
}

DiagnosisEvidence diagnosis_evidence(const Diagnosis& found, const cell::Recording& recording,
                                     const cell::Simulator& simulator) {
  DiagnosisEvidence out;
  std::vector<cell::Cell> cells;
  if (std::ranges::all_of(found.causes, in_catalogue)) out.causes.resize(found.causes.size());
  if (!out.causes.empty()) cells.push_back(with_causes(recording.cell, found.causes));
  for (std::size_t k = 0; k < out.causes.size() && out.causes.size() > 1; ++k)
    cells.push_back(with_causes(recording.cell, without_cause(found.causes, k)));
  out.residuals = residual_columns(recording, simulator, cells, measured_noise(found));
  out.columns = judged_columns(recording, out.residuals);
  for (std::size_t k = 0; k < out.causes.size(); ++k) {
    out.causes[k] = cause_evidence(recording, out.residuals, out.cell_without(k), 1);
    out.causes[k].deviations = deviations_from_off(recording.cell, found.causes[k], found.causes[k].parameters);
  }
  out.held_out = std::ranges::any_of(recording.experiments,
                                     [](const cell::Experiment& e) { return e.split == cell::Split::Check; });
  return out;
}

std::vector<EffectFit> rival_effects(const Diagnosis& found, const DiagnosisEvidence& evidence, std::size_t cause,
                                     const cell::Recording& recording, const cell::Simulator& simulator) {
  require(cause < evidence.causes.size() && evidence.causes.size() == found.causes.size(),
          "cause: the evidence has none of this number");
  std::set<std::string> explained;
  for (const ColumnEvidence& c : evidence.causes[cause].columns)
    if (c.without > c.with_all + noticeable_change) explained.insert(c.column);
  const std::vector<EffectName> taken(found.causes.begin(), found.causes.end());
  const cell::Cell cell = with_causes(recording.cell, without_cause(found.causes, cause));
  std::vector<EffectFit> out = fit_best_effects(recording, cell, simulator, taken, most_tried, options_of(found));
  std::erase_if(out, [&](const EffectFit& fit) {
    return std::ranges::none_of(
        fit.columns, [&](const ColumnReduction& c) { return explained.contains(c.column) && c.after < c.before; });
  });
  if (out.size() > max_rivals) out.resize(max_rivals);
  return out;
}

std::vector<EffectTrial> try_effect(const Diagnosis& found, const std::string& effect,
                                    const std::vector<std::string>& targets, const cell::Recording& recording,
                                    const cell::Simulator& simulator) {
  const std::vector<std::string> known = cell::effect_targets(cell::find_effect(effect), recording.cell);
  std::vector<EffectTrial> out;
  for (const std::string& target : targets) {
    require(std::ranges::find(known, target) != known.end(),
            "targets: found '" + target + "', which the cell does not have for " + effect +
                (known.empty() ? "" : "; expected such as " + known.front()));
    if (std::ranges::find(out, target, &EffectTrial::target) == out.end()) out.push_back({{effect, target}, {}, {}});
  }
  const auto is_cause = [&](const EffectName& name) { return std::ranges::count(found.causes, name) > 0; };
  const auto fit_all = [&](const Cause* replaced, const std::vector<Cause>& others) {
    std::vector<EffectName> names;
    for (const EffectTrial& trial : out)
      if (!is_cause(trial) || (replaced && *replaced == trial)) names.push_back(trial);
    for (const EffectFit& fit :
         fit_effects(recording, with_causes(recording.cell, others), simulator, names, options_of(found)))
      keep_better(out, fit, replaced);
  };
  if (found.causes.empty()) fit_all(nullptr, {});
  for (std::size_t k = 0; k < found.causes.size(); ++k) fit_all(&found.causes[k], without_cause(found.causes, k));
  std::ranges::stable_sort(out, std::greater<>(),
                           [](const EffectTrial& trial) { return trial.fit ? trial.fit->explained_fraction : -1.0; });
  return out;
}

}  // namespace kr5::gap
