// SPDX-License-Identifier: BSD-3-Clause
#include "gap/planning/next_experiment.hpp"

#include <algorithm>
#include <chrono>

#include <kr5/core/parallel.hpp>

#include "gap/fitting/posterior.hpp"
#include "gap/planning/experiment_scorer.hpp"

namespace kr5::gap {
namespace {

constexpr double enough = 5.0;          // standard deviations that settle a question
constexpr double slow_simulator = 0.5;  // for one short experiment, from which on a plan is no by-work [s]

const Model* model_with(const std::vector<Model>& models, const EffectName& name) {
  for (const Model& m : models)
    for (const Part& part : m.parts)
      if (name_of(part) == name) return &m;
  return nullptr;
}

/// A few short experiments of the kinds that were recorded.
std::vector<Proposal> brief_proposals(const ComparisonData& data, const std::vector<EffectName>& names) {
  const Family family{*data.recording, joints_of({names}), 0.7, 0.0, 0.0, 1, true};
  std::vector<Proposal> out;
  for (const auto& [kind, name] : enum_names(cell::Kind{})) {
    if (!recorded_experiment(*data.recording, kind)) continue;
    std::vector<Proposal> more = proposals(family, kind);
    std::move(more.begin(), more.end(), std::back_inserter(out));
  }
  return out;
}

/// The clearest of them; of no kind, when the simulator is too slow to try.
NextExperiment clearest(const ComparisonData& data, const std::vector<Fitted>& alternatives, std::vector<Proposal> all,
                        int threads) {
  const ExperimentScorer scorer{data, alternatives, 0.0, 0.02, highest_current(*data.recording)};
  if (all.empty()) return {};
  std::vector<double> separation(all.size(), 0.0);
  const auto rate = [&](int i) {
    if (const auto score = scorer.score(all[static_cast<std::size_t>(i)], false))
      separation[static_cast<std::size_t>(i)] = score->separation[0];
  };
  const auto start = std::chrono::steady_clock::now();
  rate(0);
  if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > slow_simulator) return {};
  parallel_for(static_cast<int>(all.size()) - 1, threads, [&](int i) { rate(i + 1); });
  const auto best = std::max_element(separation.begin(), separation.end());
  if (*best <= 0.0) return {};
  const Proposal& found = all[static_cast<std::size_t>(best - separation.begin())];
  return {{}, found.experiment.kind, found.what, found.seconds, *best, *best < enough};
}

}  // namespace

NextExperiment next_experiment(const ComparisonData& data, const Model& best, const std::vector<Model>& models,
                               const std::vector<Cause>& causes, int threads) {
  std::vector<EffectName> names;
  std::vector<Fitted> alternatives = {Fitted(best)};
  const auto add = [&](const EffectName& name) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  };
  for (const Cause& cause : causes)
    for (const EffectName& tied : cause.tied_with) {
      add(cause);
      add(tied);
      const Model* rival = model_with(models, tied);
      if (rival && alternatives.size() < 3) alternatives.emplace_back(*rival);
    }
  NextExperiment out;
  if (alternatives.size() > 1) out = clearest(data, alternatives, brief_proposals(data, names), threads);
  out.separates = std::move(names);
  return out;
}

}  // namespace kr5::gap
