// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/effect_fit.hpp>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/parallel.hpp>

#include "gap/fitting/posterior.hpp"
#include "gap/reporting/gap_breakdown.hpp"
#include "gap/reporting/gap_figures.hpp"
#include "gap/reporting/residual_owner.hpp"
#include "gap/screening/pose_noise.hpp"
#include "gap/screening/screen.hpp"

namespace kr5::gap {
namespace {

constexpr double changed = 0.02;  ///< A gap that moves by less stays the same.

/// A recording with the cell that is asked about in the place of its own.
cell::Recording asked(const cell::Recording& recording, const cell::Cell& cell) {
  cell.validate();
  require_joints(recording, cell);
  cell::Recording out = recording;
  out.cell = cell;
  out.cell.noise = recording.cell.noise;
  if (auto reset = from_zero(out)) return std::move(*reset);
  return out;
}

/// A recording that is compared with its cell, by the noise that was seen.
class Compared {
 public:
  Compared(const cell::Recording& recording, const cell::Simulator& simulator, const std::vector<NoiseOverride>& noise)
      : data(compare_columns(recording, simulator)), base(compare_nominal(data)) {
    std::vector<NoiseScale> scales;
    for (const NoiseOverride& seen : noise) {
      seen.validate();
      scales.push_back({seen.key, seen.kind, seen.ratio});
    }
    correct(data, scales, base);
    mark_spikes(data, base);
    mark_stray_corners(data, base);
    mark_stray_poses();
  }

  ComparisonData data;
  Eigen::VectorXd base;

 private:
  void mark_stray_poses() {
    const std::vector<Hypothesis> all = hypotheses(data.recording->cell, span_of(*data.recording));
    std::vector<const Hypothesis*> each;
    for (const Hypothesis& h : all) each.push_back(&h);
    int stray = 0;
    pose_noise_scales(data, base, each, stray);
  }
};

std::vector<Hypothesis> chosen(const cell::Recording& recording, const std::function<bool(const EffectName&)>& wanted) {
  std::vector<Hypothesis> out = hypotheses(recording.cell, span_of(recording));
  std::erase_if(out, [&](const Hypothesis& h) { return !wanted(h); });
  return out;
}

/// Fits effects, each alone, and judges them.
class EffectFitter {
 public:
  EffectFitter(const cell::Recording& recording, const cell::Simulator& simulator,
               const std::function<bool(const EffectName&)>& wanted, const EffectFitOptions& options)
      : compared_(recording, simulator, options.noise),
        threads_(options.threads),
        wanted_(wanted),
        groups_(make_groups(compared_.data)),
        empty_(empty_model(problem_, compared_.base)),
        screen_(compared_.data, chosen(recording, wanted), recording.cell, compared_.base, options.threads, {}),
        ranked_(screen_.rank(problem_, empty_)) {
    add_the_others();
  }

  /// Names that act, the best of the linear signatures first.
  std::vector<EffectName> names() const {
    std::vector<EffectName> out;
    for (const Suggestion& s : ranked_)
      if (wanted_(name_of(s.part)) && !contains(out, name_of(s.part))) out.push_back(name_of(s.part));
    return out;
  }

  std::vector<EffectFit> fitted(const std::vector<EffectName>& names) const {
    std::vector<EffectFit> out(names.size());
    parallel_for(static_cast<int>(names.size()), threads_, [&](int i) {
      out[static_cast<std::size_t>(i)] = judged(best_of(names[static_cast<std::size_t>(i)]));
    });
    std::stable_sort(out.begin(), out.end(), [](const EffectFit& a, const EffectFit& b) {
      return a.explained_fraction > b.explained_fraction;
    });
    return out;
  }

 private:
  /// Effects that could only do harm, by their signatures.
  void add_the_others() {
    for (const auto& candidate : screen_.candidates())
      if (std::none_of(ranked_.begin(), ranked_.end(),
                       [&](const Suggestion& s) { return s.part.candidate == candidate.get(); }))
        ranked_.push_back({{candidate.get(), nearly_off(candidate->hypothesis)}, -1e300});
  }

  /// The likeliest choices of an effect, each fitted; the one that takes most from the fit experiments.
  Model best_of(const EffectName& name) const {
    constexpr int choices = 3;
    std::optional<Model> best;
    int tried = 0;
    for (const Suggestion& s : ranked_) {
      if (!(name_of(s.part) == name)) continue;
      Model model = fit(problem_, empty_, {s.part});
      if (!best || model.chi2_fit < best->chi2_fit) best = std::move(model);
      if (++tried == choices) break;
    }
    return std::move(best).value();
  }

  EffectFit judged(const Model& model) const {
    const Hypothesis& h = model.parts.front().candidate->hypothesis;
    const Eigen::VectorXd before = counted_residual(compared_.data, compared_.base);
    const Eigen::VectorXd after = counted_residual(compared_.data, model.residual);
    EffectFit out{
        h.name(),
        h.choice,
        {},
        explained_fraction(compared_.data, groups_, above_noise(compared_.data, groups_, before), before, after),
        {}};
    out.parameters = parameters(compared_.data, model, 0, posterior(problem_, {model}).temperature);
    for (const Group& group : groups_) {
      const Gap from = gap_of(compared_.data, group.judged, before), to = gap_of(compared_.data, group.judged, after);
      if (above_floor(from) || std::abs(from.rms - to.rms) > changed)
        out.columns.push_back({group.name(), from.rms, to.rms});
    }
    const auto change = [](const ColumnReduction& c) { return std::abs(c.before * c.before - c.after * c.after); };
    std::stable_sort(out.columns.begin(), out.columns.end(),
                     [&](const ColumnReduction& a, const ColumnReduction& b) { return change(a) > change(b); });
    return out;
  }

  Compared compared_;
  int threads_ = 0;
  std::function<bool(const EffectName&)> wanted_;
  NuisanceModel nuisance_;
  FitProblem problem_{compared_.data, nuisance_, {}, 0.0};
  std::vector<Group> groups_;
  Model empty_;
  Screen screen_;
  std::vector<Suggestion> ranked_;
};

}  // namespace

void NoiseOverride::validate() const {
  require(ratio > 0 && std::isfinite(ratio), "noise: ratio of " + key + " must be positive");
  bool known = false;
  const cell::Noise any;
  cell::Noise::each_field(any, [&](const char* name, const auto&, const char*) { known |= key == name; });
  require(known, "noise: unknown key noise." + key);
}

void EffectFitOptions::validate() const {
  for (const NoiseOverride& seen : noise) seen.validate();
  require(threads >= 0, "threads must not be negative");
}

std::vector<ResidualColumn> residual_columns(const cell::Recording& recording, const cell::Simulator& simulator,
                                             const std::vector<cell::Cell>& cells,
                                             const std::vector<NoiseOverride>& noise) {
  const cell::Recording own = asked(recording, recording.cell);
  Compared compared(own, simulator, noise);
  ComparisonData& data = compared.data;
  std::vector<int> all(own.experiments.size());
  std::iota(all.begin(), all.end(), 0);
  std::erase_if(all, [&](int e) { return data.blocks_of[static_cast<std::size_t>(e)].empty(); });
  std::vector<Eigen::VectorXd> stacked = {compared.base};
  for (const cell::Cell& cell : cells) {
    cell.validate();
    require_joints(own, cell);
    stacked.push_back(residuals(data, cell, all, compared.base));
  }
  mark_spikes(data, stacked[cells.empty() ? 0 : 1], true);
  std::vector<ResidualColumn> out;
  for (const Block& block : data.blocks) {
    Eigen::MatrixXd rows(block.rows, static_cast<Eigen::Index>(stacked.size()));
    for (std::size_t k = 0; k < stacked.size(); ++k)
      rows.col(static_cast<Eigen::Index>(k)) = used_rows(data, block, block.rows_of(stacked[k]));
    out.push_back({data.experiment(block).name, block.column, block.sigma, std::move(rows)});
  }
  return out;
}

std::vector<GapPart> gap_parts(const cell::Recording& recording, const std::vector<ResidualColumn>& columns,
                               int which) {
  GapBreakdown parts(recording);
  for (const ResidualColumn& c : columns) {
    const auto experiment = static_cast<int>(experiment_of(recording, c));
    require_cell(c, "which", which);
    parts.add(experiment, c.column, c.noise, c.residuals.col(which));
  }
  return parts.all();
}

std::vector<EffectFit> fit_effects(const cell::Recording& recording, const cell::Cell& cell,
                                   const cell::Simulator& simulator, const std::vector<EffectName>& effects,
                                   const EffectFitOptions& options) {
  options.validate();
  for (const EffectName& name : effects) cell::find_effect(name.effect);
  if (effects.empty()) return {};
  const cell::Recording at = asked(recording, cell);
  const EffectFitter trials(
      at, simulator, [&](const EffectName& name) { return contains(effects, name); }, options);
  return trials.fitted(trials.names());
}

std::vector<EffectFit> fit_best_effects(const cell::Recording& recording, const cell::Cell& cell,
                                        const cell::Simulator& simulator, const std::vector<EffectName>& except,
                                        int most, const EffectFitOptions& options) {
  options.validate();
  require(most >= 1, "most must be at least 1");
  for (const EffectName& name : except) cell::find_effect(name.effect);
  const cell::Recording at = asked(recording, cell);
  const EffectFitter trials(
      at, simulator, [&](const EffectName& name) { return !contains(except, name); }, options);
  std::vector<EffectName> names = trials.names();
  if (names.size() > static_cast<std::size_t>(most)) names.resize(static_cast<std::size_t>(most));
  return trials.fitted(names);
}

}  // namespace kr5::gap
