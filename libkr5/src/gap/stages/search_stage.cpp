// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/search_stage.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "gap/fitting/posterior.hpp"
#include "gap/fitting/search.hpp"
#include "gap/stages/needed_effects.hpp"
#include "gap/stages/stage_progress.hpp"

namespace kr5::gap {
namespace {

/// Sizes of nuisance parameters that are tried: none, and what separates a careful identification from a rough one.
constexpr double nuisance_sizes[] = {0.0, 0.002, 0.004, 0.008};
/// Evidence that nuisance parameters must bring, in natural logarithms: odds of twenty.
constexpr double nuisance_pays = 3.0;
/// Most likely models beside which nuisance parameters are looked at.
constexpr std::size_t models_with_nuisance = 3;
/// Iterations that refit a model beside nuisance parameters.
constexpr int nuisance_iterations = 3;

/// Effects with which a search begins are beside as many as asked for.
SearchOptions search_options(const DiagnoseOptions& options, const ScreenOutput& screened) {
  const int begun = screened.start ? static_cast<int>(screened.start->model.parts.size()) : 0;
  return {options.max_effects + begun, options.refits, options.beam, options.threads};
}

double log_prior_of_effect(const Screen& screen) {
  return -std::log(static_cast<double>(std::max(screen.effects(), 1)));
}

std::vector<Model> search_with(const FitProblem& problem, Screen& screen, const ScreenOutput& screened,
                               const DiagnoseOptions& options) {
  const Step& step = problem.prior.size() > 0 ? nuisance_step : refitting_step;
  const auto progress = [&](double fraction) { tell(options, step, fraction); };
  const SearchOptions how = search_options(options, screened);
  return screened.start ? search_from(problem, screen, screened.base, screened.start->model, how, progress)
                        : search(problem, screen, screened.base, how, progress);
}

/// The size of nuisance parameters under which a fitted model is most likely.
double best_nuisance_size(const ScreenOutput& screened, double log_prior_effect, const Model& model) {
  double best = 0.0, most = 0.0;
  for (const double size : nuisance_sizes) {
    const FitProblem problem{screened.data, screened.nuisance, NuisancePrior(screened.nuisance, size),
                             log_prior_effect};
    const Model fitted = model.parts.empty()
                             ? empty_model(problem, screened.base)
                             : fit(problem, model, model.parts, {.max_iterations = nuisance_iterations});
    const double evidence = fitted.log_evidence - (size > 0 ? nuisance_pays : 0.0);
    if (size == 0.0 || evidence > most) {
      most = evidence;
      best = size;
    }
  }
  return best;
}

/// Searches without nuisance parameters, and again with them when the data ask for it: then a single cause with small
/// errors everywhere may stand against the many causes found without.
SearchOutput find_models(const ScreenOutput& screened, Screen& screen, const DiagnoseOptions& options) {
  SearchOutput out;
  out.log_prior_effect = log_prior_of_effect(screen);
  out.far = screened.start.has_value();
  out.models.kept = search_with(out.problem(screened.data, screened.nuisance), screen, screened, options);
  if (screened.start) return out;
  double size = 0.0;
  const std::size_t tried = std::min(out.models.kept.size(), models_with_nuisance);
  for (std::size_t i = 0; i < tried && size == 0.0; ++i)
    size = best_nuisance_size(screened, out.log_prior_effect, out.models.kept[i]);
  if (size == 0.0) return out;
  const FitProblem wider{screened.data, screened.nuisance, NuisancePrior(screened.nuisance, size),
                         out.log_prior_effect};
  std::vector<Model> with = search_with(wider, screen, screened, options);
  if (with.front().log_evidence - nuisance_pays > out.models.kept.front().log_evidence &&
      within_nuisance(wider, with.front())) {
    out.models.kept = std::move(with);
    out.prior = wider.prior;
  }
  return out;
}

/// Looks at what is about as likely as the best model: it may lead on, and is told as a tie. The search went on from
/// sets with effects that turned out needless, or that stood for two others.
class NeededEffects {
 public:
  NeededEffects(ModelPool& models, Screen& screen, const ScreenOutput& screened, const DiagnoseOptions& options)
      : models_(models),
        screen_(screen),
        groups_(screened.groups),
        options_(options),
        search_(search_options(options, screened)) {}

  /// Of a search that began with many effects: takes away at once what is needless, and looks at what may stand in the
  /// place of the rest. Combinations of such exchanges are too many to look at.
  void keep_of_many() {
    drop_all_needless();
    const Model best = models_.refit(models_.best(), options_.threads);
    extend(best);
    for (std::size_t k = 0; k < best.parts.size(); ++k)
      if (const Part& part = best.parts[k]; !part.candidate->hypothesis.of_recording)
        extend_in_place_of(part, best, models_.without(best, k));
    drop_all_needless();
    models_.refit(models_.best(), options_.threads);
  }

  /// Leaves the best model without needless effects; false: there were too many sets to look at.
  bool keep() {
    drop_needless();
    while (const std::optional<Model> model = next()) {
      if (seen_.size() == most_examined) return false;
      seen_.push_back(model->parts);
      extend(*model);
      models_.fit_without_each(*model, options_.threads);
      for (std::size_t k = 0; k < model->parts.size(); ++k)
        if (const Part& part = model->parts[k]; !part.candidate->hypothesis.of_recording)
          extend(models_.without(*model, k), &part);
      drop_needless();
    }
    return true;
  }

 private:
  void tell_step() {  // how many will be looked at is not known
    tell(options_, checking_step, 1.0 - 1.0 / (1.0 + 0.05 * ++checked_));
  }

  /// The most likely model that was not looked at, if it is tied with the best and has no more effects.
  std::optional<Model> next() const {
    const auto is_new = [&](const Model& m) {
      return std::ranges::none_of(seen_, [&](const std::vector<Part>& parts) { return same_effects(parts, m.parts); });
    };
    for (const Model& m : models_.all()) {
      if (m.log_evidence < models_.best().log_evidence + std::log(min_tied_odds)) break;
      if (m.parts.size() <= models_.best().parts.size() && is_new(m)) return m;
    }
    return std::nullopt;
  }

  void extend(const Model& model, const Part* replaced = nullptr) {
    tell_step();
    models_.extend(model, extensions(models_.problem(), screen_, model, search_, replaced), options_.threads);
  }

  /// Exchanges a part of a model for what gains about as much as was lost without it.
  void extend_in_place_of(const Part& part, const Model& model, const Model& without) {
    const double lost = model.log_evidence - without.log_evidence;
    models_.extend(without, extensions(models_.problem(), screen_, without, search_, &part, lost), options_.threads);
  }

  /// Takes the needless effects from the best model until it has none, and away what was likelier.
  void drop_all_needless() {
    for (Model model = models_.best();;) {
      tell_step();
      models_.fit_without_each(model, options_.threads);
      std::vector<Part> needed;
      for (std::size_t k = 0; k < model.parts.size(); ++k)
        if (!is_needless(models_, groups_, model, k, options_)) needed.push_back(model.parts[k]);
      models_.admit(model.parts);
      while (!same_effects(models_.best().parts, model.parts)) models_.drop(models_.best().parts);
      if (needed.size() == model.parts.size()) return;
      models_.drop(model.parts);
      if (!needed.empty()) models_.extend(model, {needed}, options_.threads);
      model = models_.fitted(needed);
    }
  }

  /// Takes away models with a needless effect, until the best has none.
  void drop_needless() {
    for (bool dropped = true; dropped;) {
      dropped = false;
      tell_step();
      const Model best = models_.best();
      for (std::size_t k = 0; k < best.parts.size() && !dropped; ++k)
        dropped = is_needless(models_, groups_, best, k, options_);
      if (dropped) models_.drop(best.parts);
    }
  }

  ModelPool& models_;
  Screen& screen_;
  const std::vector<Group>& groups_;
  const DiagnoseOptions& options_;
  SearchOptions search_;
  std::vector<std::vector<Part>> seen_;
  int checked_ = 0;
};

}  // namespace

SearchOutput search_stage(const ScreenOutput& screened, const DiagnoseOptions& options) {
  Screen screen = screened.screen;
  SearchOutput out = find_models(screened, screen, options);
  const FitProblem problem = out.problem(screened.data, screened.nuisance);
  ModelPool models(problem, screened.base, std::move(out.models));
  NeededEffects needed(models, screen, screened, options);
  if (screened.start)
    needed.keep_of_many();
  else
    out.cut_short = !needed.keep();
  out.models = std::move(models).take();
  out.candidates = screen.candidates();
  return out;
}

SearchOutput start_search(const ScreenOutput& screened) {
  SearchOutput out;
  out.log_prior_effect = log_prior_of_effect(screened.screen);
  out.far = true;
  out.models.kept = {screened.start->model};
  out.candidates = screened.screen.candidates();
  return out;
}

}  // namespace kr5::gap
