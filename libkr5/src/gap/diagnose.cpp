// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/diagnose.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iterator>
#include <limits>
#include <mutex>
#include <optional>
#include <set>

#include <kr5/core/error.hpp>

#include "gap/fitting/model_pool.hpp"
#include "gap/fitting/search.hpp"
#include "gap/planning/next_experiment.hpp"
#include "gap/recording_scope.hpp"
#include "gap/reporting/gap_figures.hpp"
#include "gap/reporting/untried_effects.hpp"
#include "gap/screening/geometry_prior.hpp"
#include "gap/screening/noise.hpp"
#include "gap/screening/pose_noise.hpp"
#include "gap/screening/recording_faults.hpp"

namespace kr5::gap {
namespace {

/// Sizes of scatter that are tried: none, and what separates a careful identification from a rough one.
constexpr double scatter_sizes[] = {0.0, 0.002, 0.004, 0.008};
/// Evidence that scatter must bring, in natural logarithms: odds of twenty.
constexpr double scatter_pays = 3.0;

/// Prior odds of a shape that no catalogue names against an effect of the catalogue.
constexpr double free_shape_odds = 0.1;
/// Most likely models whose scatter is looked at.
constexpr std::size_t models_with_scatter = 3;
/// Iterations that refit a model beside scatter.
constexpr int scatter_iterations = 3;
/// Effects that are named as nearest to what remains.
constexpr std::size_t most_nearest = 3;
/// Sets of effects about as likely as the best whose effects are exchanged for others, at most.
constexpr std::size_t most_examined = 20;
/// An effect that is trusted less than evenly is not blamed.
constexpr double least_trust = 0.5;

/// Part of the whole that a step takes, about.
struct Stage {
  const char* name;
  double from, to;
};
constexpr Stage simulating{"simulating the nominal cell", 0.0, 0.02}, screening{"screening effects", 0.02, 0.4},
    refitting{"refitting effects", 0.4, 0.85}, with_scatter{"refitting effects with nuisance parameters", 0.85, 0.9},
    checking{"checking which effects are needed", 0.9, 0.95}, judging{"analysing the residuals", 0.95, 1.0};

class Diagnoser {
 public:
  Diagnoser(const cell::Recording& recording, const cell::Simulator& simulator, const DiagnoseOptions& options)
      : options_(options), start_(std::chrono::steady_clock::now()), data_(compare_columns(recording, simulator)) {}

  Diagnosis run() {
    simulate_nominal();
    judge_noise();
    Screen screen = make_screen();
    judge_pose_noise(screen);
    groups_ = make_groups(data_);
    scatter_ = make_nuisance_model(data_, base_, options_.threads);
    out_.not_tried = untried_effects(data_.recording->cell, screen.unseen());
    out_.seconds_screening = seconds();
    find_models(screen);
    keep_needed_effects(screen);
    conclude();
    out_.seconds = seconds();
    return std::move(out_);
  }

 private:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }
  /// Tells how much of the whole is done, which never falls, whichever thread comes last.
  void progress(const Stage& stage, double fraction) const {
    if (!options_.progress) return;
    const std::lock_guard lock(telling_);
    done_ = std::max(done_, stage.from + (stage.to - stage.from) * fraction);
    options_.progress(stage.name, done_);
  }

  void simulate_nominal() {
    progress(simulating, 0.0);
    base_ = compare_nominal(data_);
    out_.joint_names = data_.recording->cell.robot.joint_names;
    out_.left_out = data_.left_out;
    out_.missing_splits = missing_splits(data_);
    out_.scope = scope_limits(*data_.recording);
  }

  /// Takes the noise that was seen where it is not as declared.
  void take_noise(std::vector<NoiseScale> scales) {
    std::erase_if(scales, [](const NoiseScale& scale) { return !wrong(scale); });
    for (const NoiseScale& scale : scales) out_.noise.push_back({scale.key, scale.kind, scale.ratio, scale.std});
    correct(data_, scales, base_);
  }

  void judge_noise() {
    if (options_.simulator_errors.empty()) {
      spikes_ = mark_spikes(data_, base_) + mark_stray_corners(data_, base_);
      take_noise(noise_scales(data_, base_, out_.coarse));
    } else {  // a spike is what stands out of noise and known errors together
      take_noise(noise_scales(data_, base_, out_.coarse));
      add_known_errors();
      spikes_ = mark_spikes(data_, base_) + mark_stray_corners(data_, base_);
    }
  }

  void require_compared(const std::vector<ColumnError>& errors) const {
    std::set<std::string> compared;
    for (const Block& block : data_.blocks) compared.insert(column_name(block.kind, block.column));
    for (const ColumnError& own : errors) {
      if (compared.contains(own.column)) continue;
      std::string names;
      for (const std::string& name : compared) names += (names.empty() ? "" : ", ") + name;
      throw InvalidArgument("simulator_errors: found column '" + own.column + "', expected one of " + names);
    }
  }

  /// Takes what the simulator is known to be off in a column as noise beside that of the sensor.
  void add_known_errors() {
    require_compared(options_.simulator_errors);
    for (Block& block : data_.blocks) {
      const double error = known_error(options_, column_name(block.kind, block.column));
      if (error == 0.0) continue;
      const double sigma = std::hypot(block.sigma, error);
      block.widening = sigma / block.sigma;
      block.rows_of(base_) /= block.widening;
      block.sigma = sigma;
    }
    for (const ColumnError& own : options_.simulator_errors)
      if (own.error > 0.0) out_.excused.push_back(own);
  }

  Screen make_screen() const {
    const TimeSpan span = span_of(*data_.recording);
    std::vector<Hypothesis> all = hypotheses(data_.recording->cell, span);
    if (only_loads(*data_.recording)) doubt_geometry(all);
    all.insert(all.end(), options_.own_hypotheses.begin(), options_.own_hypotheses.end());
    std::vector<Hypothesis> faults = recording_faults(*data_.recording);
    all.insert(all.end(), std::make_move_iterator(faults.begin()), std::make_move_iterator(faults.end()));
    return Screen(data_, std::move(all), base_, options_.threads,
                  [&](double fraction) { progress(screening, fraction); });
  }

  void judge_pose_noise(const Screen& screen) {
    std::vector<const Hypothesis*> acting;
    for (const auto& candidate : screen.candidates())
      if (std::any_of(candidate->experiments.begin(), candidate->experiments.end(),
                      [&](int e) { return data_.recording->experiments[e].kind == cell::Kind::Poses; }))
        acting.push_back(&candidate->hypothesis);
    const std::vector<NoiseScale> scales = pose_noise_scales(data_, base_, acting, spikes_);
    out_.spikes = spikes_;
    take_noise(scales);
  }

  SearchOptions search_options() const {
    return {options_.max_effects, options_.refits, options_.beam, options_.threads};
  }

  std::vector<Model> search_with(Screen& screen, double scatter) {
    problem_.prior = NuisancePrior(scatter_, scatter);
    problem_.log_prior_effect = -std::log(static_cast<double>(std::max(screen.effects(), 1)));
    return search(problem_, screen, base_, search_options(),
                  [&](double fraction) { progress(scatter > 0 ? with_scatter : refitting, fraction); });
  }

  /// The size of scatter under which a fitted model is most likely.
  double best_scatter(const Model& model) {
    double best = 0.0, most = 0.0;
    for (const double size : scatter_sizes) {
      FitProblem problem{data_, scatter_, NuisancePrior(scatter_, size), problem_.log_prior_effect};
      const Model fitted =
          model.parts.empty() ? empty_model(problem, base_) : fit(problem, model, model.parts, scatter_iterations);
      const double evidence = fitted.log_evidence - (size > 0 ? scatter_pays : 0.0);
      if (size == 0.0 || evidence > most) {
        most = evidence;
        best = size;
      }
    }
    return best;
  }

  /// Whether what scatter takes from the residual of a model is as small as its size says, in every parameter. One that
  /// is far off is no scatter but an effect, for which the scatter must not stand.
  bool is_scatter(const Model& model) const {
    constexpr double greatest = 4.0;  // of some thirty parameters one in 500 times
    if (problem_.prior.size() == 0.0) return true;
    const Eigen::VectorXd off =
        problem_.prior.estimate(project(data_, scatter_, counted_residual(data_, model.residual)));
    return off.cwiseAbs().maxCoeff() < greatest * problem_.prior.size();
  }

  /// Searches without scatter, and again with it when the data ask for it: then a single cause with small errors
  /// everywhere may stand against the many causes found without.
  void find_models(Screen& screen) {
    models_.replace(search_with(screen, 0.0));
    double size = 0.0;
    const std::size_t tried = std::min(models_.all().size(), models_with_scatter);
    for (std::size_t i = 0; i < tried && size == 0.0; ++i) size = best_scatter(models_.all()[i]);
    if (size == 0.0) return;
    std::vector<Model> with = search_with(screen, size);
    if (with.front().log_evidence - scatter_pays > models_.best().log_evidence && is_scatter(with.front())) {
      models_.replace(std::move(with));
      out_.scatter = size;
      return;
    }
    problem_.prior = NuisancePrior();
  }

  /// Leaves as the best a model of needed effects that neither a further one betters nor another in the place of one:
  /// the search went on from sets with effects that turned out needless, or that stood for two others. What is about as
  /// likely as the best is looked at, too: it may lead on, and is told as a tie.
  void keep_needed_effects(Screen& screen) {
    std::vector<std::vector<Part>> seen;
    drop_needless_effects();
    while (const std::optional<Model> model = next_to_look_at(seen)) {
      if (seen.size() == most_examined) {
        out_.sets_limit = static_cast<int>(most_examined);
        return;
      }
      seen.push_back(model->parts);
      extend(screen, *model);
      models_.fit_without_each(*model, options_.threads);
      for (std::size_t k = 0; k < model->parts.size(); ++k)
        if (const Part& part = model->parts[k]; !part.candidate->hypothesis.of_recording)
          extend(screen, models_.without(*model, k), &part);
      drop_needless_effects();
    }
  }

  /// The most likely model that is not among those seen, if it is tied with the best and has no more effects.
  std::optional<Model> next_to_look_at(const std::vector<std::vector<Part>>& seen) const {
    const auto is_new = [&](const Model& m) {
      return std::ranges::none_of(seen, [&](const std::vector<Part>& parts) { return same_effects(parts, m.parts); });
    };
    for (const Model& m : models_.all()) {
      if (m.log_evidence < models_.best().log_evidence + std::log(least_tied_odds)) break;
      if (m.parts.size() <= models_.best().parts.size() && is_new(m)) return m;
    }
    return std::nullopt;
  }

  void extend(Screen& screen, const Model& model, const Part* replaced = nullptr) {
    progress(checking, 1.0 - 1.0 / (1.0 + 0.05 * ++checked_));  // how many will be looked at is not known
    models_.extend(model, extensions(problem_, screen, model, search_options(), replaced), options_.threads);
  }

  /// Takes away models with an effect that makes the check experiments fit worse, or that explains no more than the
  /// simulator may be off, until the best has none.
  void drop_needless_effects() {
    for (bool dropped = true; dropped;) {
      dropped = false;
      progress(checking, 1.0 - 1.0 / (1.0 + 0.05 * ++checked_));  // how many will be looked at is not known
      const Model best = models_.best();
      for (std::size_t k = 0; k < best.parts.size() && !dropped; ++k) dropped = is_needless(best, k);
      if (dropped) models_.drop(best.parts);
    }
  }

  bool is_needless(const Model& best, std::size_t part) {
    const Model without = models_.without(best, part);
    const bool cause = !best.parts[part].candidate->hypothesis.of_recording;
    return (cause && worsens_check(data_, groups_, best, without)) ||
           (is_scatter(without) && within_discrepancy(problem_, groups_, best, without, base_, options_));
  }

  void conclude() {
    progress(judging, 0.0);
    const FitProblem plain{data_, scatter_, {}, 0.0};
    mark_late_spikes();
    ResidualAnalysis before = analyze_residual(plain, groups_, empty_model(plain, base_), base_, options_);
    above_ = above_noise(data_, groups_, before.shown);
    Model best = free_shape_is_likelier(models_.best()) ? models_.nominal() : models_.best();
    ResidualAnalysis rest = analyze_residual(problem_, groups_, best, base_, options_);
    std::vector<double> trusts = trusts_of(best, rest);
    for (int worst = unfounded(best, rest, trusts); worst >= 0; worst = unfounded(best, rest, trusts)) {
      // The others must explain without it, too: what only made up for its errors is then seen.
      best = models_.without(best, static_cast<std::size_t>(worst));
      rest = analyze_residual(problem_, groups_, best, base_, options_);
      trusts = trusts_of(best, rest);
    }
    models_.admit(best.parts);
    add_causes(best, posterior(problem_, models_.all()), rest, trusts);
    if (out_.causes.empty() && !best.parts.empty()) {  // faults of the recording alone explain nothing of the cell
      best = models_.nominal();
      rest = analyze_residual(problem_, groups_, best, base_, options_);
    }
    if (out_.causes.empty() && !before.any()) rest = before;  // small errors of the cell need explain nothing
    set_verdict(rest);
    for (ResidualAnalysis* found : {&before, &rest}) describe_beyond(data_, groups_, options_, *found);
    fill(best, before, rest);
    if (rest.any()) add_nearest(best, before);
    if (static_cast<int>(out_.causes.size()) >= options_.max_effects) out_.effects_limit = options_.max_effects;
    progress(judging, 1.0);
  }

  /// What stands out once the best set of effects is known, also where any effect would make the residual jump.
  void mark_late_spikes() { out_.outliers = mark_spikes(data_, models_.best().residual, true); }

  std::vector<double> trusts_of(const Model& model, const ResidualAnalysis& rest) const {
    std::vector<double> out(model.parts.size(), 1.0);
    if (rest.any_structure())
      for (std::size_t k = 0; k < out.size(); ++k) out[k] = trust(data_, groups_, model, rest, k, options_);
    return out;
  }

  /// The part that is least trusted, when that is less than even; faults of the recording stay. -1: none.
  static int distrusted(const Model& model, const std::vector<double>& trusts) {
    int out = -1;
    for (std::size_t k = 0; k < trusts.size(); ++k)
      if (!model.parts[k].candidate->hypothesis.of_recording && trusts[k] < least_trust &&
          (out < 0 || trusts[k] < trusts[static_cast<std::size_t>(out)]))
        out = static_cast<int>(k);
    return out;
  }

  /// Whether an effect clearly lessens a column, in one of its experiments at least, that is unexplained without it. In
  /// columns that need no explanation, an effect may only fit the residual that smoothing leaves at reversals.
  bool mends_a_column(const Model& model, const ResidualAnalysis& with, std::size_t part) {
    constexpr double clearly = 0.95;
    const ResidualAnalysis left = analyze_residual(problem_, groups_, models_.without(model, part), base_, options_);
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      const auto lessened = [&](int block) {
        return gap_of(data_, {block}, with.shown).rms < clearly * gap_of(data_, {block}, left.shown).rms;
      };
      if ((left.structured[g] || left.beyond[g]) && std::ranges::any_of(groups_[g].judged, lessened)) return true;
    }
    return false;
  }

  /// The part that must not be blamed: the least trusted one, else a needless one, also of a smaller set. -1: none.
  int unfounded(const Model& model, const ResidualAnalysis& rest, const std::vector<double>& trusts) {
    if (const int worst = distrusted(model, trusts); worst >= 0) return worst;
    const bool of_real_arm = options_.errors_of_recording;
    const double temperature = of_real_arm ? posterior(problem_, {model}).temperature : 1.0;  // else not asked for
    for (std::size_t k = 0; k < model.parts.size(); ++k) {
      if (model.parts[k].candidate->hypothesis.of_recording) continue;
      const bool seen = !of_real_arm || !is_scatter(models_.without(model, k)) ||
                        (is_significant(model, k, temperature) && mends_a_column(model, rest, k));
      if (!seen || is_needless(model, k)) return static_cast<int>(k);
    }
    return -1;
  }

  /// Whether one shape in one column, which no catalogue names, says as much as several effects that act together.
  bool free_shape_is_likelier(const Model& best) const {
    if (best.parts.size() < 2) return false;
    const auto with_shape = [&](const FitProblem& problem) {
      const Eigen::VectorXd left = without_nuisance(data_, scatter_, problem.prior, counted_residual(data_, base_));
      return empty_model(problem, base_).log_evidence + best_free_shape(data_, groups_, left, prior_width) / 2;
    };
    const FitProblem plain{data_, scatter_, {}, 0.0};
    const double likelier = std::max(with_shape(plain), with_shape(problem_));
    return likelier + problem_.log_prior_effect + std::log(free_shape_odds) > best.log_evidence;
  }

  void add_causes(const Model& best, const Posterior& weights, const ResidualAnalysis& rest,
                  const std::vector<double>& trusts) {
    for (std::size_t k = 0; k < best.parts.size(); ++k) {
      if (best.parts[k].candidate->hypothesis.of_recording) {
        const ParameterEstimate delay = parameters(data_, best, k, weights.temperature).front();
        ClockFault& fault = out_.clock_faults.emplace_back(clock_fault(name_of(best.parts[k]).target));
        fault.delay = delay.value[0];
        fault.std = delay.std[0];
        continue;
      }
      Cause cause;
      const EffectName name = name_of(best.parts[k]);
      cause.effect = name.effect;
      cause.target = name.target;
      cause.probability = trusts[k] * probability(models_.all(), weights, name);
      cause.tied_with = ties(models_.all(), weights, best, k);
      cause.parameters = parameters(data_, best, k, weights.temperature);
      cause.explained_fraction = explained_fraction(data_, groups_, above_, rest.without[k], rest.whole);
      out_.causes.push_back(std::move(cause));
    }
  }

  void set_verdict(const ResidualAnalysis& rest) {
    if (!out_.causes.empty())
      out_.verdict = rest.any() ? Verdict::PartlyExplained : Verdict::Explained;
    else
      out_.verdict = rest.any() ? Verdict::Unknown : Verdict::NoGap;
  }

  /// Effects that come nearest to explaining what a model leaves, of those that were fitted beside it.
  void add_nearest(const Model& best, const ResidualAnalysis& before) {
    for (const Model& model : std::vector<Model>(models_.all())) {
      const int added = added_part(best, model);
      if (added < 0) continue;
      const EffectName name = name_of(model.parts[static_cast<std::size_t>(added)]);
      const auto same = [&](const NearestEffect& e) { return e.effect == name.effect && e.target == name.target; };
      if (std::any_of(out_.nearest.begin(), out_.nearest.end(), same)) continue;
      const ResidualAnalysis rest = analyze_residual(problem_, groups_, model, base_, options_);
      constexpr double nan = std::numeric_limits<double>::quiet_NaN();  // small errors of the cell are not taken out
      const Eigen::VectorXd left =
          model.residual.array().isNaN().select(nan, counted_residual(data_, model.residual).array());
      NearestEffect& nearest = out_.nearest.emplace_back(why_not(best, model, rest));
      nearest.effect = name.effect;
      nearest.target = name.target;
      nearest.gap = gap_reduction(data_, groups_, above_, before.shown, left).after;
    }
    std::stable_sort(out_.nearest.begin(), out_.nearest.end(),
                     [](const NearestEffect& a, const NearestEffect& b) { return a.gap < b.gap; });
    if (out_.nearest.size() > most_nearest) out_.nearest.resize(most_nearest);
  }

  /// The one effect that a model has beside those of another; -1: it is not such a model.
  static int added_part(const Model& smaller, const Model& model) {
    if (model.parts.size() != smaller.parts.size() + 1) return -1;
    for (std::size_t k = 0; k < model.parts.size(); ++k)
      if (!model.parts[k].candidate->hypothesis.of_recording && same_effects(without(model.parts, k), smaller.parts))
        return static_cast<int>(k);
    return -1;
  }

  /// Why the effect that a model adds to the best one is not blamed.
  NearestEffect why_not(const Model& best, const Model& model, const ResidualAnalysis& rest) const {
    NearestEffect out;
    const auto worst = std::max_element(rest.strength.begin(), rest.strength.end());
    if (worsens_check(data_, groups_, model, best)) {
      out.reason = NotBlamed::FitsCheckWorse;
    } else if (within_discrepancy(problem_, groups_, model, best, base_, options_)) {
      out.reason = NotBlamed::WithinSimulatorError;
    } else if (rest.any() && worst != rest.strength.end()) {
      const auto at = static_cast<std::size_t>(worst - rest.strength.begin());
      out.reason = NotBlamed::StructureRemains;
      out.column = groups_[at].name();
      if (!rest.structure[at].dependences.empty()) out.variable = rest.structure[at].dependences.front().variable;
    }
    return out;
  }

  void fill(const Model& judged, const ResidualAnalysis& before, const ResidualAnalysis& rest) {
    std::stable_sort(out_.causes.begin(), out_.causes.end(),
                     [](const Cause& a, const Cause& b) { return a.probability > b.probability; });
    out_.where = column_excesses(data_, groups_, before);
    if (out_.verdict == Verdict::NoGap) out_.where.clear();
    if (rest.any()) out_.unexplained = column_excesses(data_, groups_, rest);
    // Small errors of the nominal parameters alone are no cause, so that nothing is said to fall by them.
    out_.reduction =
        gap_reduction(data_, groups_, above_, before.shown, out_.causes.empty() ? before.shown : rest.shown);
    out_.cell = setup_of(data_, judged.parts).cell;
    out_.next_experiment = next_experiment(data_, judged, models_.all(), out_.causes, options_.threads);
  }

  const DiagnoseOptions& options_;
  std::chrono::steady_clock::time_point start_;
  ComparisonData data_;
  Eigen::VectorXd base_;
  std::vector<Group> groups_;
  std::vector<bool> above_;  ///< Of the groups: above the floor at the nominal cell.
  NuisanceModel scatter_;
  int spikes_ = 0, checked_ = 0;
  mutable std::mutex telling_;
  mutable double done_ = 0.0;
  FitProblem problem_{data_, scatter_, {}, 0.0};
  ModelPool models_{problem_, base_};
  Diagnosis out_;
};

}  // namespace

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
}

Diagnosis diagnose(const cell::Recording& recording, const cell::Simulator& simulator, const DiagnoseOptions& options) {
  options.validate();
  recording.cell.validate();
  const std::optional<cell::Recording> reset = from_zero(recording);
  Diagnosis out = Diagnoser(reset ? *reset : recording, simulator, options).run();
  out.clock_reset = reset.has_value();
  return out;
}

}  // namespace kr5::gap
