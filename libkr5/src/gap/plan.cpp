// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/plan.hpp>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>
#include <numeric>

#include <kr5/core/error.hpp>
#include <kr5/core/parallel.hpp>

#include "gap/planning/experiment_scorer.hpp"

namespace kr5::gap {
namespace {

constexpr double shows = 25.0;     // of chi-square: what an effect takes that stands out of the noise by five
constexpr double exact_tie = 2.0;  // a separation below which, after most repeats, nothing is decided

std::string text_of(const Alternative& names) {
  std::string out;
  for (const EffectName& name : names) out += (out.empty() ? "" : " with ") + name.effect + " on " + name.target;
  return out;
}

std::string text_of(const std::vector<Alternative>& all) {
  std::string out;
  for (const Alternative& names : all) out += (out.empty() ? "" : " from ") + text_of(names);
  return out;
}

struct ScoredProposal {
  Proposal proposal;
  Score score;
};

/// Probability that noise makes the wrong one of two alternatives the likelier one.
double wrong_of(double separation) { return 0.5 * std::erfc(separation / (2 * std::sqrt(2.0))); }

class Planner {
 public:
  Planner(const cell::Recording& recording, const cell::Simulator& simulator,
          const std::vector<Alternative>& alternatives, const PlanOptions& options)
      : recording_(recording), simulator_(simulator), options_(options) {
    out_.alternatives = alternatives;
  }

  Plan run() {
    progress("fitting the alternatives", 0.0);
    synthesize_likeliest();
    const FitContext context(synthesized_, simulator_);
    std::vector<Fitted> fitted = look_alikes(context);
    const ExperimentScorer scorer{context.data, fitted, options_.nuisance_std, options_.simulator_accuracy,
                                  highest_current(recording_)};
    for (const Fitted& f : fitted) {
      out_.already = std::max(out_.already, std::sqrt(std::max(f.chi2, 0.0)));
      out_.cells.push_back(setup_of(context.data, f.parts()).cell);
    }
    std::vector<cell::Kind> done, left;
    for (const auto& [kind, name] : enum_names(cell::Kind{}))
      (recorded_experiment(recording_, kind) ? done : left).push_back(kind);
    std::vector<ScoredProposal> entries = judged(scorer, done);
    if (entries.empty() || entries.front().score.separation[0] < options_.separation) {
      std::vector<ScoredProposal> more = judged(scorer, left);
      std::move(more.begin(), more.end(), std::back_inserter(entries));
      rank(entries);
    }
    confirm(scorer, context, entries);
    report(entries);
    return std::move(out_);
  }

 private:
  void progress(const std::string& stage, double fraction) const {
    if (options_.progress) options_.progress(stage, fraction);
  }

  /// What the cell would have recorded with the likeliest alternative; with the first at a usual size, when the
  /// recording shows none.
  void synthesize_likeliest() {
    const FitContext seen(recording_, simulator_);
    std::vector<Fitted> fitted = fit_alternatives(seen, out_.alternatives, options_);
    const auto best = std::max_element(
        fitted.begin(), fitted.end(), [](const Fitted& a, const Fitted& b) { return a.log_evidence < b.log_evidence; });
    truth_ = static_cast<std::size_t>(best - fitted.begin());
    out_.assumed = seen.chi2() - best->chi2 < shows;
    if (out_.assumed) {
      truth_ = 0;
      assume_usual_size(fitted.front());
    }
    true_one_ = fitted[truth_];
    synthesized_ = synthesize_recording(seen, true_one_);
  }

  /// The alternatives as they look most alike: all fitted to what one of them shows.
  std::vector<Fitted> look_alikes(const FitContext& context) {
    std::vector<Fitted> fitted = fit_alternatives(context, out_.alternatives, options_);
    Fitted own = refit(context, true_one_, 0);
    fitted[truth_] = std::move(own);
    return fitted;
  }

  std::vector<ScoredProposal> judged(const ExperimentScorer& scorer, const std::vector<cell::Kind>& kinds) {
    constexpr std::size_t closer = 10;
    const Family family{
        recording_, joints_of(out_.alternatives), options_.speed, options_.load, options_.wait, options_.seed, false};
    std::vector<Proposal> all;
    for (const cell::Kind kind : kinds) {
      std::vector<Proposal> more = proposals(family, kind);
      std::move(more.begin(), more.end(), std::back_inserter(all));
    }
    std::vector<ScoredProposal> out = scored(scorer, std::move(all), false, "trying experiments");
    if (out.size() > closer) out.resize(closer);
    std::vector<Proposal> best;
    for (ScoredProposal& e : out) best.push_back(std::move(e.proposal));
    return scored(scorer, std::move(best), true, "including nuisance parameters");
  }

  std::vector<ScoredProposal> scored(const ExperimentScorer& scorer, std::vector<Proposal> all, bool with_nuisance,
                                     const std::string& stage) {
    std::vector<std::optional<Score>> scores(all.size());
    std::atomic<int> done{0};
    parallel_for(static_cast<int>(all.size()), options_.threads, [&](int i) {
      scores[i] = scorer.score(all[i], with_nuisance);
      progress(stage, static_cast<double>(++done) / static_cast<double>(all.size()));
    });
    std::vector<ScoredProposal> out;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (scores[i]) out.push_back({std::move(all[i]), std::move(*scores[i])});
    simulated_ = simulated_ || !out.empty();
    rank(out);
    return out;
  }

  /// Index in `repeats` at which the separation is reached; the last, where it is not.
  std::size_t reached(const Score& score) const {
    std::size_t k = 0;
    while (k + 1 < repeats.size() && score.separation[k] < options_.separation) ++k;
    return k;
  }

  /// Time until the separation is reached, by repeating; longer still, where it is not.
  double time(const ScoredProposal& e) const {
    const std::size_t k = reached(e.score);
    const double part = options_.separation / std::max(e.score.separation[k], 1e-3);
    return e.proposal.seconds * repeats[k] * std::max(1.0, part * part);
  }

  /// First the clearest of those that take hardly longer than the quickest, then by time.
  void rank(std::vector<ScoredProposal>& entries) const {
    std::stable_sort(entries.begin(), entries.end(),
                     [&](const ScoredProposal& a, const ScoredProposal& b) { return time(a) < time(b); });
    if (entries.empty()) return;
    const double longest = 1.5 * time(entries.front()) + 60.0;
    const auto end =
        std::find_if(entries.begin(), entries.end(), [&](const ScoredProposal& e) { return time(e) > longest; });
    std::stable_sort(entries.begin(), end, [](const ScoredProposal& a, const ScoredProposal& b) {
      return a.score.separation[0] > b.score.separation[0];
    });
  }

  /// Fits the best through the simulator until one stands; those that do not are ranked by what is left of them.
  void confirm(const ExperimentScorer& scorer, const FitContext& context, std::vector<ScoredProposal>& entries) {
    constexpr int tries = 4;
    for (int i = 0; i < tries && !entries.empty() && entries.front().score.separation.back() > exact_tie; ++i) {
      progress("confirming the best experiment", static_cast<double>(i) / tries);
      Score& best = entries.front().score;
      const double kept = scorer.confirmed(context, entries.front().proposal) / std::max(best.separation[0], 1e-9);
      if (kept > 0.8) return;
      for (double& separation : best.separation) separation *= kept;
      rank(entries);
    }
  }

  void report(std::vector<ScoredProposal>& entries) {
    for (ScoredProposal& e : entries) {
      if (static_cast<int>(out_.experiments.size()) >= options_.keep || e.score.separation.back() < exact_tie) continue;
      const std::size_t k = reached(e.score);
      PlannedExperiment p;
      p.separation = e.score.separation[0];
      p.separation_repeated = e.score.separation[k];
      p.log_bayes = p.separation * p.separation / 2;
      p.repeats = repeats[k];
      p.wrong = wrong_of(p.separation_repeated);
      p.what = std::move(e.proposal.what);
      p.load = e.proposal.load;
      p.seconds = e.proposal.seconds;
      p.experiment = std::move(e.proposal.experiment);
      p.experiment.name = "next-" + std::string(kr5::name_of(p.experiment.kind));
      p.experiment.file = p.experiment.name + ".csv";
      p.columns = std::move(e.score.columns);
      out_.experiments.push_back(std::move(p));
    }
    out_.exact_tie = simulated_ && out_.experiments.empty();
    out_.text = text();
  }

  std::string text() const {
    char numbers[160];
    std::string out;
    if (out_.already > options_.separation) {
      std::snprintf(numbers, sizeof numbers, "This recording already distinguishes them by %.1f standard deviations. ",
                    out_.already);
      out = numbers;
    }
    if (!simulated_)
      return out +
             "No experiment could be tried: this cell cannot simulate a motion of its own choice. State its servos "
             "(servo.joint, or servo.torque), or record more of the kinds that it has";
    if (out_.exact_tie) {
      out += "No experiment that was tried distinguishes " + text_of(out_.alternatives) +
             ", even with 100 repeats: they look the same to the sensors of this cell, or differ by less than the "
             "error of its model. Measure one of the parts separately";
      return options_.load > 0 ? out : out + ", or allow a known weight on the tool (load)";
    }
    const PlannedExperiment& best = out_.experiments.front();
    std::string what = best.what;
    what.front() = static_cast<char>(std::toupper(what.front()));
    std::snprintf(numbers, sizeof numbers, " by %.1f standard deviations in %.0f s", best.separation, best.seconds);
    out += what + ": distinguishes " + text_of(out_.alternatives) + numbers;
    if (best.repeats == 1) return out;
    std::snprintf(numbers, sizeof numbers, ", with %d repeats by %.1f", best.repeats, best.separation_repeated);
    return out + numbers;
  }

  const cell::Recording& recording_;
  const cell::Simulator& simulator_;
  const PlanOptions& options_;
  bool simulated_ = false;  ///< Any proposal.
  std::size_t truth_ = 0;
  Fitted true_one_;
  cell::Recording synthesized_;
  Plan out_;
};

}  // namespace

void PlanOptions::validate() const {
  require(separation > 0, "separation must be positive");
  require(speed > 0 && speed <= 1, "speed must lie between 0 and 1");
  require(load >= 0, "load must not be negative");
  require(wait >= 0, "wait must not be negative");
  require(nuisance_std >= 0 && nuisance_std < 1, "nuisance_std must lie between 0 and 1");
  require(simulator_accuracy >= 0 && simulator_accuracy < 1, "simulator_accuracy must lie between 0 and 1");
  require(keep >= 1, "keep must be at least 1");
  require(threads >= 0, "threads must not be negative");
}

Plan plan(const cell::Recording& recording, const cell::Simulator& simulator,
          const std::vector<Alternative>& alternatives, const PlanOptions& options) {
  options.validate();
  recording.cell.validate();
  require(alternatives.size() >= 2, "alternatives: expected at least two");
  return Planner(recording, simulator, alternatives, options).run();
}

std::vector<Alternative> tied_alternatives(const Diagnosis& diagnosis) {
  Alternative blamed;
  for (const Cause& cause : diagnosis.causes) blamed.push_back(cause);
  std::vector<Alternative> out;
  for (std::size_t k = 0; k < diagnosis.causes.size(); ++k)
    for (const EffectName& other : diagnosis.causes[k].tied_with) {
      if (out.empty()) out.push_back(blamed);
      out.push_back(blamed);
      out.back()[k] = other;
    }
  return out;
}

ModelComparison compare_models(const std::vector<cell::Recording>& recordings, const cell::Simulator& simulator,
                               const std::vector<Alternative>& alternatives, const PlanOptions& options) {
  options.validate();
  require(!recordings.empty(), "recordings: expected at least one");
  for (const cell::Recording& recording : recordings) recording.cell.validate();
  require(alternatives.size() >= 2, "alternatives: expected at least two");
  cell::Recording all;
  all.cell = recordings.front().cell;
  ToolSimulator::Tools tools;
  for (std::size_t i = 0; i < recordings.size(); ++i)
    for (cell::Experiment e : recordings[i].experiments) {
      e.name = std::to_string(i + 1) + "." + e.name;
      if (recordings[i].cell.tool) tools[e.name] = *recordings[i].cell.tool;
      all.experiments.push_back(std::move(e));
    }
  const FitContext context(std::move(all), simulator, std::move(tools));
  ModelComparison out;
  for (const Fitted& f : fit_alternatives(context, alternatives, options)) out.log_evidence.push_back(f.log_evidence);
  const auto best = std::max_element(out.log_evidence.begin(), out.log_evidence.end());
  out.best = static_cast<int>(best - out.log_evidence.begin());
  double sum = 0.0;
  for (const double e : out.log_evidence) sum += std::exp(e - *best);
  for (const double e : out.log_evidence) out.probability.push_back(std::exp(e - *best) / sum);
  return out;
}

cell::Cell with_load(const cell::Cell& cell, double mass) {
  require(cell.tool.has_value(), "a known weight (load) needs a tool, which the cell does not have");
  require(mass >= 0, "load must not be negative");
  cell::Cell out = cell;
  out.tool->mass += mass;
  return out;
}

}  // namespace kr5::gap
