// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/nearest_effects.hpp"

#include <algorithm>
#include <limits>

#include "gap/fitting/posterior.hpp"
#include "gap/reporting/gap_figures.hpp"

namespace kr5::gap {
namespace {

constexpr std::size_t most_nearest = 3;

/// The one effect that a model has beside those of another; -1: it is not such a model.
int added_part(const Model& smaller, const Model& model) {
  if (model.parts.size() != smaller.parts.size() + 1) return -1;
  for (std::size_t k = 0; k < model.parts.size(); ++k)
    if (!model.parts[k].candidate->hypothesis.of_recording && same_effects(without(model.parts, k), smaller.parts))
      return static_cast<int>(k);
  return -1;
}

/// The reason why the effect that a model adds to the judged one is not blamed; `rest`: what it leaves.
NearestEffect why_not(const ScreenOutput& screened, const JudgeOutput& judged, const Model& model,
                      const ResidualAnalysis& rest, const DiagnoseOptions& options) {
  const FitProblem problem = judged.found.problem(judged.data, screened.nuisance);
  NearestEffect out;
  const auto worst = std::ranges::max_element(rest.strength);
  if (worsens_check(judged.data, screened.groups, model, judged.model)) {
    out.reason = NotBlamed::FitsCheckWorse;
  } else if (within_discrepancy(problem, screened.groups, model, judged.model, screened.base, options)) {
    out.reason = NotBlamed::WithinSimulatorError;
  } else if (rest.any() && worst != rest.strength.end()) {
    const auto at = static_cast<std::size_t>(worst - rest.strength.begin());
    out.reason = NotBlamed::StructureRemains;
    out.column = screened.groups[at].name();
    if (!rest.structure[at].dependences.empty()) out.variable = rest.structure[at].dependences.front().variable;
  }
  return out;
}

}  // namespace

std::vector<NearestEffect> nearest_effects(const ScreenOutput& screened, const JudgeOutput& judged,
                                           const DiagnoseOptions& options) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const FitProblem problem = judged.found.problem(judged.data, screened.nuisance);
  std::vector<NearestEffect> out;
  for (const Model& model : judged.found.models.kept) {
    const int added = added_part(judged.model, model);
    if (added < 0) continue;
    const EffectName name = name_of(model.parts[static_cast<std::size_t>(added)]);
    if (std::ranges::find(out, name) != out.end()) continue;
    const ResidualAnalysis rest = analyze_residual(problem, screened.groups, model, screened.base, options);
    // Small errors of the cell are not taken out.
    const Eigen::VectorXd left =
        model.residual.array().isNaN().select(nan, counted_residual(judged.data, model.residual).array());
    NearestEffect& nearest = out.emplace_back(why_not(screened, judged, model, rest, options));
    static_cast<EffectName&>(nearest) = name;
    nearest.gap = gap_reduction(judged.data, screened.groups, judged.above, judged.before.shown, left).after;
  }
  std::stable_sort(out.begin(), out.end(),
                   [](const NearestEffect& a, const NearestEffect& b) { return a.gap < b.gap; });
  if (out.size() > most_nearest) out.resize(most_nearest);
  return out;
}

}  // namespace kr5::gap
