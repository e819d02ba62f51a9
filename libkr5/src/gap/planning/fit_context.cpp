// SPDX-License-Identifier: BSD-3-Clause
#include "gap/planning/fit_context.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

#include "gap/fitting/posterior.hpp"
#include "gap/screening/screen.hpp"

namespace kr5::gap {
namespace {

bool wanted(const Hypothesis& h, const std::vector<Alternative>& alternatives) {
  return std::any_of(alternatives.begin(), alternatives.end(),
                     [&](const Alternative& names) { return contains(names, h.name()); });
}

/// The hypotheses of all alternatives; complains of effects that the cell cannot have.
std::vector<Hypothesis> hypotheses_of(const FitContext& context, const std::vector<Alternative>& alternatives,
                                      const PlanOptions& options) {
  std::vector<Hypothesis> out = hypotheses(context.recording.cell, span_of(context.recording));
  out.insert(out.end(), options.own_hypotheses.begin(), options.own_hypotheses.end());
  std::erase_if(out, [&](const Hypothesis& h) { return !wanted(h, alternatives); });
  for (const Alternative& names : alternatives)
    for (const EffectName& name : names) {
      if (std::any_of(out.begin(), out.end(), [&](const Hypothesis& h) { return h.name() == name; })) continue;
      const cell::Effect& effect = cell::find_effect(name.effect);
      if (effect.periodic() && cell::effect_possible(effect, context.recording.cell, name.target)) continue;
      const std::vector<std::string> targets = cell::effect_targets(effect, context.recording.cell);
      const std::string all = std::accumulate(targets.begin(), targets.end(), std::string(),
                                              [](const std::string& a, const std::string& b) { return a + " " + b; });
      throw InvalidArgument("effect " + name.effect + " has no target '" + name.target +
                            "' in this cell, expected one of" + (all.empty() ? " none" : all));
    }
  return out;
}

/// Where to start a fit of one more effect of an alternative: its likeliest choices, or near nothing, when the data
/// would rather have it below its bound.
std::vector<Part> starts(const FitProblem& problem, Screen& screen, const Model& model, const Alternative& names) {
  constexpr std::size_t choices = 3;
  const auto missing = [&](const Hypothesis& h) { return contains(names, h.name()) && !model.has(h.name()); };
  std::vector<Part> out;
  for (const Suggestion& s : screen.rank(problem, model))
    if (out.size() < choices && missing(s.part.candidate->hypothesis)) out.push_back(s.part);
  if (!out.empty()) return out;
  for (const auto& candidate : screen.candidates())
    if (missing(candidate->hypothesis)) out.push_back({candidate.get(), nearly_off(candidate->hypothesis)});
  return out;
}

/// Adds the effects of an alternative one after the other.
Model fit_one(const FitProblem& problem, Screen& screen, const Model& empty, const Alternative& names) {
  Model model = empty;
  for (std::size_t done = 0; done < names.size(); ++done) {
    std::optional<Model> best;
    for (const Part& start : starts(problem, screen, model, names)) {
      std::vector<Part> parts = model.parts;
      parts.push_back(start);
      Model fitted = fit(problem, model, std::move(parts));
      if (!best || fitted.log_evidence > best->log_evidence) best = std::move(fitted);
    }
    if (!best)
      throw InvalidArgument("effect " + names[done].effect + " on " + names[done].target +
                            " does not show in this recording: record a kind of experiment that it changes");
    model = std::move(*best);
  }
  return model;
}

}  // namespace

io::Table ToolSimulator::simulate(const cell::Cell& cell, const cell::Experiment& experiment) const {
  const auto tool = tools_.find(experiment.name);
  if (tool == tools_.end()) return inner_.predict_unchecked(cell, experiment);
  cell::Cell other = cell;
  other.tool = tool->second;
  return inner_.predict_unchecked(other, experiment);
}

FitContext::FitContext(cell::Recording all, const cell::Simulator& with, ToolSimulator::Tools tools)
    : recording(std::move(all)), simulator(with, std::move(tools)) {
  for (cell::Experiment& e : recording.experiments) e.split = cell::Split::Fit;
  data = compare_columns(recording, simulator);
  base = compare_nominal(data);
}

Fitted::Fitted(const Model& model)
    : information(model.information), chi2(model.chi2_fit), log_evidence(model.log_evidence) {
  for (const Part& part : model.parts) {
    candidates.push_back(*part.candidate);
    x.push_back(part.x);
  }
}

std::vector<Part> Fitted::parts() const {
  std::vector<Part> out;
  for (std::size_t i = 0; i < candidates.size(); ++i) out.push_back({&candidates[i], x[i]});
  return out;
}

std::vector<Fitted> fit_alternatives(const FitContext& context, const std::vector<Alternative>& alternatives,
                                     const PlanOptions& options) {
  Screen screen(context.data, hypotheses_of(context, alternatives, options), context.data.recording->cell, context.base,
                options.threads, {});
  const NuisanceModel none;
  const FitProblem problem{context.data, none, {}, 0.0};
  const Model empty = empty_model(problem, context.base);
  std::vector<Fitted> out;
  for (const Alternative& names : alternatives) {
    require(!names.empty(), "an alternative must name an effect");
    out.emplace_back(fit_one(problem, screen, empty, names));
  }
  return out;
}

Fitted refit(const FitContext& context, const Fitted& from, int max_iterations) {
  Fitted everywhere = from;
  for (Candidate& c : everywhere.candidates) {
    c.experiments.resize(context.recording.experiments.size());
    std::iota(c.experiments.begin(), c.experiments.end(), 0);
  }
  const NuisanceModel none;
  const FitProblem problem{context.data, none, {}, 0.0};
  return Fitted(
      fit(problem, empty_model(problem, context.base), everywhere.parts(), {.max_iterations = max_iterations}));
}

void assume_usual_size(Fitted& fitted) {
  for (std::size_t i = 0; i < fitted.x.size(); ++i) fitted.x[i] = typical_point(fitted.candidates[i].hypothesis);
}

void show(cell::Experiment& experiment, const io::Table& predicted, const std::vector<std::string>& also) {
  io::Table& table = experiment.data;
  for (std::size_t c = 0; c < predicted.columns.size(); ++c) {
    const std::string& name = predicted.columns[c];
    int at = table.find(name);
    if (at < 0 && std::find(also.begin(), also.end(), name) != also.end()) {
      at = static_cast<int>(table.columns.size());
      table.columns.push_back(name);
      table.values.conservativeResize(Eigen::NoChange, at + 1);
      table.values.col(at).setZero();
    }
    if (at < 0) continue;
    // What the sensor would not see stays as it was.
    const auto shown = predicted.values.col(static_cast<Eigen::Index>(c)).array();
    table.values.col(at) = shown.isFinite().select(shown, table.values.col(at).array());
  }
}

cell::Recording synthesize_recording(const FitContext& context, const Fitted& truth) {
  cell::Recording out = context.recording;
  const Setup setup = setup_of(context.data, truth.parts());
  for (cell::Experiment& e : out.experiments) show(e, predict(context.simulator, setup, e));
  return out;
}

}  // namespace kr5::gap
