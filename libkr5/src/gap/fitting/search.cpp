// SPDX-License-Identifier: BSD-3-Clause
#include "gap/fitting/search.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <iterator>
#include <memory>
#include <set>
#include <string>

#include <kr5/core/parallel.hpp>

#include "gap/fitting/start.hpp"

namespace kr5::gap {
namespace {

/// A set of effects to fit: from which model, with which parts, near which model.
struct Task {
  const Model* from = nullptr;
  std::vector<Part> parts;
  const Model* near = from;
};

using EffectNames = std::set<std::string>;

/// Gain of log evidence, by its linear signature, below which a suggestion is not refitted.
constexpr double hopeless = -2.0;
/// A suggestion is near the best one at this part of its gain, less `near_margin`.
constexpr double near_part = 0.9, near_margin = 5.0;
/// Pairs that are refitted at most, and what each must gain on the best single effect (log evidence).
constexpr std::size_t most_pairs = 24;
constexpr double pair_gain = 3.0;
/// Sizes of sets that are tried even when one that is smaller by one is likelier.
constexpr int always_tried = 3;
/// Standard deviations of chi-square within which a residual is noise.
constexpr double floor_deviations = 3.0;

EffectNames names_of(const std::vector<Part>& parts) {
  EffectNames out;
  for (const Part& p : parts)
    out.insert(p.candidate->hypothesis.effect + "." + p.candidate->hypothesis.target + "." +
               p.candidate->hypothesis.choice);
  return out;
}

/// Suggestions worth a refit: the best, and whatever is likely beside them. A signature is linear and an effect is not,
/// so that a tenth of what the best one takes may be its error.
std::vector<Suggestion> worth(const std::vector<Suggestion>& all, int least) {
  std::vector<Suggestion> out;
  for (const Suggestion& s : all) {
    if (s.score < hopeless) break;
    const bool near = s.score > near_part * all.front().score - near_margin;
    if (static_cast<int>(out.size()) >= (near ? 2 * least : least)) break;
    out.push_back(s);
  }
  return out;
}

int effects_of(const Model& model) {
  return static_cast<int>(std::count_if(model.parts.begin(), model.parts.end(),
                                        [](const Part& part) { return !part.candidate->hypothesis.of_recording; }));
}

/// Suggestions beside the effects of a model; faults of the recording alone where it has as many as asked for.
std::vector<Suggestion> rank_beside(const FitProblem& problem, Screen& screen, const Model& model,
                                    const SearchOptions& options) {
  std::vector<Suggestion> out = screen.rank(problem, model);
  if (effects_of(model) >= options.max_effects)
    std::erase_if(out, [](const Suggestion& s) { return !s.part.candidate->hypothesis.of_recording; });
  return out;
}

/// Gain from which a suggestion could stand in the place of a part: near that of the part itself. 0: any.
double gain_in_place_of(const Part* part, const std::vector<Suggestion>& all) {
  if (part == nullptr) return 0.0;
  const Hypothesis& h = part->candidate->hypothesis;
  const auto own =
      std::ranges::find_if(all, [&](const Suggestion& s) { return s.part.candidate->hypothesis.name() == h.name(); });
  return own == all.end() ? 0.0 : std::max(0.0, near_part * own->score - near_margin);
}

/// A set with each of the suggestions that gain enough, and with each fault of the recording: there are few of
/// these, and what is late in the signature of a nominal cell says little of what is late once the cell has friction.
std::vector<std::vector<Part>> extended(const Model& model, const std::vector<Suggestion>& all, double gain,
                                        const SearchOptions& options, bool with_faults = true) {
  const auto is_fault = [](const Suggestion& s) { return s.part.candidate->hypothesis.of_recording; };
  std::vector<Suggestion> tried;
  for (const Suggestion& s : worth(all, options.refits / 2))
    if (s.score > gain && !is_fault(s)) tried.push_back(s);
  if (with_faults) std::ranges::copy_if(all, std::back_inserter(tried), is_fault);
  for (Suggestion& s : tried)  // the signature may have led to none of it at all
    if (is_fault(s) && s.part.x.isZero()) s.part.x = s.part.candidate->hypothesis.probes.front().points.front();
  std::vector<std::vector<Part>> out;
  for (const Suggestion& s : tried) {
    out.push_back(model.parts);
    out.back().push_back(s.part);
  }
  return out;
}

class Searcher {
 public:
  Searcher(const FitProblem& problem, Screen& screen, const SearchOptions& options,
           const std::function<void(double)>& progress)
      : problem_(problem), screen_(screen), options_(options), progress_(progress) {}

  std::vector<Model> run(const Eigen::VectorXd& base) {
    models_.push_back(std::make_unique<Model>(empty_model(problem_, base)));
    const Model& empty = *models_.front();
    const std::vector<Suggestion> singles = screen_.rank(problem_, empty);
    if (singles.empty()) return result();
    for (const Suggestion& s : worth(singles, options_.refits)) add({&empty, {s.part}});
    fit_all(0.0, 0.35);
    add_pairs(empty, singles.front().score);
    // Beside as many effects as asked for, one fault of the recording.
    for (int size = 2; size <= options_.max_effects + 1; ++size) {
      extend(size - 1);
      const bool any = !tasks_.empty();
      fit_all(0.35 + 0.6 * (size - 2) / options_.max_effects, 0.35 + 0.6 * (size - 1) / options_.max_effects);
      if (!any || (size > always_tried && !improved_at(size))) break;
    }
    drop_needless();
    fit_all(0.95, 1.0);
    return result();
  }

  /// From a fitted set: less what does not pay, then one effect more as long as that does.
  std::vector<Model> run_from(const Eigen::VectorXd& base, const Model& start) {
    models_.push_back(std::make_unique<Model>(empty_model(problem_, base)));
    keep(start);
    keep(without_idle(problem_, base, start, options_.threads));
    for (int round = 0; round < options_.max_effects; ++round) {
      const Model best = *ranked(-1).front();
      for (std::vector<Part>& parts : extended(best, rank_beside(problem_, screen_, best, options_), 0.0, options_))
        add({&best, std::move(parts)});
      const double from = 0.1 + 0.9 * round / options_.max_effects, to = from + 0.9 / options_.max_effects;
      fit_all(from, to);
      const Model& found = *ranked(-1).front();
      if (same_effects(found.parts, best.parts)) break;
      keep(without_idle(problem_, base, found, options_.threads));
    }
    drop_needless();
    fit_all(1.0, 1.0);
    return result();
  }

 private:
  void keep(Model model) {
    if (!known_.insert(names_of(model.parts)).second) return;
    model.log_evidence = log_evidence(problem_, model);
    models_.push_back(std::make_unique<Model>(std::move(model)));
  }

  void add(Task task) {
    if (known_.insert(names_of(task.parts)).second) tasks_.push_back(std::move(task));
  }

  void fit_all(double from, double to) {
    std::vector<std::unique_ptr<Model>> fitted(tasks_.size());
    std::atomic<int> done{0};
    parallel_for(static_cast<int>(tasks_.size()), options_.threads, [&](int i) {
      fitted[i] = std::make_unique<Model>(fit(problem_, *tasks_[i].from, tasks_[i].parts, {.near = tasks_[i].near}));
      if (progress_) progress_(from + (to - from) * ++done / static_cast<double>(tasks_.size()));
    });
    for (auto& model : fitted) models_.push_back(std::move(model));
    tasks_.clear();
  }

  /// Pairs that explain the nominal gap better than any single effect: a wrong single one may stand for two right ones.
  void add_pairs(const Model& empty, double best_single) {
    for (const PairSuggestion& p : screen_.rank_pairs(problem_, empty, most_pairs))
      if (p.score > best_single + pair_gain) add({&empty, {p.first, p.second}});
  }

  /// Whether noise alone (three standard deviations of chi-square) would leave as much as a model does.
  bool at_floor(const Model& model) const {
    const double n = problem_.data.use.sum();
    return counted_residual(problem_.data, model.residual).squaredNorm() < n + floor_deviations * std::sqrt(2 * n);
  }

  /// The best sets of a size, each with one more effect that could explain what it leaves. When the best one leaves
  /// noise that no effect could lessen, its rivals with one effect more can only be less likely.
  void extend(int size) {
    std::vector<const Model*> best = ranked(size);
    if (best.size() > static_cast<std::size_t>(options_.beam)) best.resize(static_cast<std::size_t>(options_.beam));
    for (std::size_t k = 0; k < best.size(); ++k) {
      const std::vector<Suggestion> all = rank_beside(problem_, screen_, *best[k], options_);
      const bool gain = !all.empty() && all.front().score > 0.0;
      if (k == 0 && !gain && at_floor(*best[k])) return;
      for (std::vector<Part>& parts : extended(*best[k], all, 0.0, options_)) add({best[k], std::move(parts)});
    }
  }

  /// The best set without each of its effects.
  void drop_needless() {
    const Model* best = ranked(-1).front();
    if (best->parts.size() < 2) return;
    for (std::size_t k = 0; k < best->parts.size(); ++k)
      if (!problem_.far || !surely_worse(linear_without(problem_, *best, k), *best))
        add({models_.front().get(), without(best->parts, k), best});
  }

  /// Whether a set of this size is likelier than every smaller one.
  bool improved_at(int size) const {
    const std::vector<const Model*> all = ranked(-1);
    return static_cast<int>(all.front()->parts.size()) >= size;
  }

  /// Models with so many effects (any number: -1), most likely first.
  std::vector<const Model*> ranked(int size) const {
    std::vector<const Model*> out;
    for (const auto& m : models_)
      if (size < 0 || static_cast<int>(m->parts.size()) == size) out.push_back(m.get());
    std::stable_sort(out.begin(), out.end(),
                     [](const Model* a, const Model* b) { return a->log_evidence > b->log_evidence; });
    return out;
  }

  std::vector<Model> result() {
    std::vector<Model> out;
    for (const Model* m : ranked(-1)) out.push_back(*m);
    return out;
  }

  const FitProblem& problem_;
  Screen& screen_;
  const SearchOptions& options_;
  const std::function<void(double)>& progress_;
  std::vector<std::unique_ptr<Model>> models_;
  std::vector<Task> tasks_;
  std::set<EffectNames> known_;
};

}  // namespace

std::vector<Model> search(const FitProblem& problem, Screen& screen, const Eigen::VectorXd& base,
                          const SearchOptions& options, const std::function<void(double)>& progress) {
  return Searcher(problem, screen, options, progress).run(base);
}

std::vector<Model> search_from(const FitProblem& problem, Screen& screen, const Eigen::VectorXd& base,
                               const Model& start, const SearchOptions& options,
                               const std::function<void(double)>& progress) {
  return Searcher(problem, screen, options, progress).run_from(base, start);
}

std::vector<std::vector<Part>> extensions(const FitProblem& problem, Screen& screen, const Model& model,
                                          const SearchOptions& options, const Part* replaced, double lost) {
  const std::vector<Suggestion> all = rank_beside(problem, screen, model, options);
  const double least = std::max(gain_in_place_of(replaced, all), near_part * lost - near_margin);
  return extended(model, all, least, options, !problem.far || !replaced);
}

}  // namespace kr5::gap
