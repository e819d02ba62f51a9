// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/judge_stage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "gap/fitting/posterior.hpp"
#include "gap/reporting/gap_figures.hpp"
#include "gap/screening/noise.hpp"
#include "gap/screening/recording_faults.hpp"
#include "gap/stages/needed_effects.hpp"
#include "gap/stages/stage_progress.hpp"

namespace kr5::gap {
namespace {

/// Prior odds of a shape that no catalogue names against an effect of the catalogue.
constexpr double free_shape_odds = 0.1;
/// An effect that is trusted less than evenly is not blamed.
constexpr double min_trust = 0.5;

bool of_recording(const Part& part) { return part.candidate->hypothesis.of_recording; }

/// A model with what it leaves, and how far each of its parts may be trusted.
struct Judged {
  Model model;
  ResidualAnalysis rest;
  std::vector<double> trusts;
};

/// Takes away what must not be blamed.
class Judge {
 public:
  Judge(ModelPool& models, const std::vector<Group>& groups, const DiagnoseOptions& options)
      : models_(models), problem_(models.problem()), data_(problem_.data), groups_(groups), options_(options) {}

  /// The best model less what is unfounded, part by part: the others must explain without it, too, so that what only
  /// made up for its errors is seen. None of its causes, where they fit what judges worse than without them.
  Judged founded() {
    Judged out =
        without_cancelling(analysed(free_shape_is_likelier(models_.best()) ? models_.nominal() : models_.best()));
    if (!out.model.parts.empty()) gapped_ = gapped_groups();
    for (int worst = unfounded(out); worst >= 0; worst = unfounded(out))
      out = analysed(models_.without(out.model, static_cast<std::size_t>(worst)));
    const Model faults = faults_of(out.model);
    const bool blames = faults.parts.size() < out.model.parts.size();
    return blames && judging_gap(out.rest) > judging_gap(analysis(faults)) ? analysed(faults) : out;
  }

  /// The best model as it is.
  Judged given() const {
    return {models_.best(), analysis(models_.best()), std::vector<double>(models_.best().parts.size(), 1.0)};
  }

  ResidualAnalysis analysis(const Model& model) const {
    return analyze_residual(problem_, groups_, model, models_.base(), options_);
  }

 private:
  /// Columns with a gap at the nominal cell.
  std::vector<Group> gapped_groups() const {
    const ResidualAnalysis nominal = analysis(models_.nominal());
    std::vector<Group> out;
    for (std::size_t g = 0; g < groups_.size(); ++g)
      if (nominal.structured[g] || nominal.beyond[g]) out.push_back(groups_[g]);
    return out;
  }

  /// The model without its causes: faults of the recording stay.
  Model faults_of(Model model) {
    for (std::size_t k = model.parts.size(); k-- > 0;)
      if (!of_recording(model.parts[k])) model = models_.without(model, k);
    return model;
  }

  /// RMS of all that judges, over the noise.
  double judging_gap(const ResidualAnalysis& rest) const {
    std::vector<int> blocks;
    for (const Group& group : groups_) blocks.insert(blocks.end(), group.judged.begin(), group.judged.end());
    return gap_of(data_, blocks, rest.shown).rms;
  }

  Judged analysed(const Model& model) const {
    Judged out{model, analysis(model), std::vector<double>(model.parts.size(), 1.0)};
    if (out.rest.any_structure())
      for (std::size_t k = 0; k < out.trusts.size(); ++k)
        out.trusts[k] = trust(data_, groups_, model, out.rest, k, options_);
    return out;
  }

  /// An effect and a fault of the recording that cancel each other tell nothing of the cell: currents that are logged
  /// late and stamped early are only smoothed. Without both.
  Judged without_cancelling(const Judged& judged) {
    constexpr double opposite = -0.95;  // cosine
    const auto change = [&](std::size_t part) {
      return Eigen::VectorXd(judged.rest.whole - judged.rest.without[part]);
    };
    const std::vector<Part>& parts = judged.model.parts;
    for (std::size_t cause = 0; cause < parts.size(); ++cause)
      for (std::size_t fault = 0; fault < parts.size(); ++fault) {
        if (of_recording(parts[cause]) || !of_recording(parts[fault])) continue;
        const Eigen::VectorXd a = change(cause), b = change(fault);
        if (!(a.dot(b) < opposite * a.norm() * b.norm())) continue;
        const auto [first, last] = std::minmax(cause, fault);
        return without_cancelling(analysed(models_.without(models_.without(judged.model, last), first)));
      }
    return judged;
  }

  /// The part that is least trusted, when that is less than even; faults of the recording stay. -1: none.
  static int distrusted(const Judged& judged) {
    int out = -1;
    for (std::size_t k = 0; k < judged.trusts.size(); ++k)
      if (!of_recording(judged.model.parts[k]) && judged.trusts[k] < min_trust &&
          (out < 0 || judged.trusts[k] < judged.trusts[static_cast<std::size_t>(out)]))
        out = static_cast<int>(k);
    return out;
  }

  /// Whether an effect clearly lessens a column, in one of its experiments at least, that is unexplained without it. In
  /// columns that need no explanation, an effect may only fit the residual that smoothing leaves at reversals.
  bool mends_a_column(const Judged& judged, std::size_t part) {
    constexpr double clearly = 0.95;
    const ResidualAnalysis left = analysis(models_.without(judged.model, part));
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const auto lessened = [&](int block) {
        return gap_of(data_, {block}, judged.rest.shown).rms < clearly * gap_of(data_, {block}, left.shown).rms;
      };
      if ((left.structured[g] || left.beyond[g]) && std::ranges::any_of(groups_[g].judged, lessened)) return true;
    }
    return false;
  }

  /// The part that must not be blamed: the least trusted one, else a needless one, also of a smaller set. -1: none.
  int unfounded(const Judged& judged) {
    if (const int worst = distrusted(judged); worst >= 0) return worst;
    const Model& model = judged.model;
    if (problem_.far) models_.fit_without_each(model, options_.threads);
    const bool of_real_arm = options_.errors_of_recording;
    const double temperature = of_real_arm ? posterior(problem_, {model}).temperature : 1.0;  // else not asked for
    for (std::size_t k = 0; k < model.parts.size(); ++k) {
      if (of_recording(model.parts[k])) continue;
      const Model without = models_.without(model, k);
      const bool seen = !of_real_arm || !within_nuisance(problem_, without) ||
                        (is_significant(model, k, temperature) && mends_a_column(judged, k));
      if (!seen || is_needless(models_, groups_, model, k, options_) || worsens_check(data_, gapped_, model, without))
        return static_cast<int>(k);
    }
    return -1;
  }

  /// Whether one shape in one column, which no catalogue names, says as much as several effects that act together.
  bool free_shape_is_likelier(const Model& best) const {
    if (best.parts.size() < 2) return false;
    const auto with_shape = [&](const FitProblem& problem) {
      const Eigen::VectorXd left =
          without_nuisance(data_, problem.nuisance, problem.prior, counted_residual(data_, models_.base()));
      return empty_model(problem, models_.base()).log_evidence + best_free_shape(data_, groups_, left, prior_width) / 2;
    };
    const FitProblem plain{data_, problem_.nuisance, {}, 0.0};
    const double likelier = std::max(with_shape(plain), with_shape(problem_));
    return likelier + problem_.log_prior_effect + std::log(free_shape_odds) > best.log_evidence;
  }

  ModelPool& models_;
  const FitProblem& problem_;
  const ComparisonData& data_;
  const std::vector<Group>& groups_;
  const DiagnoseOptions& options_;
  std::vector<Group> gapped_;  ///< With a gap at the nominal cell: a cause lessens it where it judges, or is none.
};

/// Blames the parts of a model: effects are causes, faults of the recording are not.
void blame(const Judged& judged, const ModelPool& models, const std::vector<Group>& groups, JudgeOutput& out) {
  const Posterior weights = posterior(models.problem(), models.all());
  for (std::size_t k = 0; k < judged.model.parts.size(); ++k) {
    const EffectName name = name_of(judged.model.parts[k]);
    std::vector<ParameterEstimate> estimates = parameters(out.data, judged.model, k, weights.temperature);
    if (of_recording(judged.model.parts[k])) {
      ClockFault& fault = out.clock_faults.emplace_back(clock_fault(name.target));
      fault.delay = estimates.front().value[0];
      fault.std = estimates.front().std[0];
      continue;
    }
    Cause cause;
    static_cast<EffectName&>(cause) = name;
    cause.probability = judged.trusts[k] * probability(models.all(), weights, name);
    cause.tied_with = ties(models.all(), weights, judged.model, k);
    cause.parameters = std::move(estimates);
    cause.explained_fraction =
        explained_fraction(out.data, groups, out.above, judged.rest.without[k], judged.rest.whole);
    out.causes.push_back(std::move(cause));
  }
  std::stable_sort(out.causes.begin(), out.causes.end(),
                   [](const Cause& a, const Cause& b) { return a.probability > b.probability; });
}

Verdict verdict_of(bool any_cause, bool any_rest) {
  if (any_cause) return any_rest ? Verdict::PartlyExplained : Verdict::Explained;
  return any_rest ? Verdict::Unknown : Verdict::NoGap;
}

}  // namespace

JudgeOutput judge_stage(const ScreenOutput& screened, SearchOutput found, const DiagnoseOptions& options,
                        Blame blames) {
  tell(options, judging_step, 0.0);
  const std::vector<Group>& groups = screened.groups;
  JudgeOutput out;
  out.data = screened.data;
  out.found = std::move(found);
  // What stands out once the best set of effects is known, also where any effect would make the residual jump.
  out.late_spikes = mark_spikes(out.data, out.found.models.kept.front().residual, true);
  const FitProblem plain{out.data, screened.nuisance, {}, 0.0},
      problem = out.found.problem(out.data, screened.nuisance);
  ModelPool models(problem, screened.base, std::move(out.found.models));
  out.before = analyze_residual(plain, groups, empty_model(plain, screened.base), screened.base, options);
  out.above = above_noise(out.data, groups, out.before.shown);
  Judge judge(models, groups, options);
  Judged judged = blames == Blame::All ? judge.given() : judge.founded();
  models.admit(judged.model.parts);
  blame(judged, models, groups, out);
  if (out.causes.empty() && !judged.model.parts.empty()) {  // faults of the recording explain nothing of the cell
    judged.model = models.nominal();
    judged.rest = judge.analysis(judged.model);
  }
  if (out.causes.empty() && !out.before.any())
    judged.rest = out.before;  // small errors of the cell need explain nothing
  out.model = std::move(judged.model);
  out.after = std::move(judged.rest);
  out.verdict = verdict_of(!out.causes.empty(), out.after.any());
  for (ResidualAnalysis* analysis : {&out.before, &out.after}) describe_beyond(out.data, groups, options, *analysis);
  out.found.models = std::move(models).take();
  return out;
}

}  // namespace kr5::gap
