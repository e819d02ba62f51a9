// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/joint_fit.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <utility>

#include <Eigen/Cholesky>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/parallel.hpp>

#include "gap/fitting/fit.hpp"
#include "gap/fitting/posterior.hpp"
#include "gap/fitting/start.hpp"
#include "gap/screening/noise.hpp"

namespace kr5::gap {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Residuals nearer than this count as dependent [s].
constexpr double dependent_time = 2.0;
/// Width of the prior of an effect about its value in the cell where the fit begins: tenfold, for a usual size of a
/// fifth.
constexpr double weak_prior = 50.0;
/// Rounds of a fit with the noise that the one before left, and the factor from which that is the same.
constexpr int most_rounds = 3;
constexpr double same_noise = 0.8;
/// Part of the squares of a residual that is no noise, of which a step that takes away less leads nowhere.
constexpr double worthless_part = 5e-4;
/// Rows of a residual that is no noise which say about the same, at most.
constexpr double most_rows_alike = 50.0;

/// Data with the residuals of its cell. What even the fitted cell leaves counts as noise.
struct JointData {
  explicit JointData(const cell::Recording& recording, const cell::Simulator& simulator)
      : data(compare_columns(recording, simulator)), base(compare_nominal(data)) {
    mark_repeats(data);
  }

  /// Makes the RMS of residuals the noise of a column in each experiment to fit, at least that of its sensor: what the
  /// model cannot show of one motion does not outweigh the others. In those to check, it is that of all to fit.
  /// @returns The smallest factor by which a noise changed.
  double set_noise(const VectorXd& residual) {
    const VectorXd counted = counted_residual(data, residual);
    std::map<std::string, Sum> fitted;  // of each column
    for (const Block& block : data.blocks)
      if (block.split == cell::Split::Fit)
        fitted[column_name(block.kind, block.column)] += sum_of(data, counted, block);
    double least = 1.0;
    for (Block& block : data.blocks) {
      const bool to_fit = block.split == cell::Split::Fit;
      const Sum sum = to_fit ? sum_of(data, counted, block) : fitted[column_name(block.kind, block.column)];
      const double rms = std::max(sum.samples > 0 ? std::sqrt(sum.chi2 / sum.samples) : 1.0, 1.0 / block.inflation);
      block.rows_of(base) /= rms;
      block.sigma *= rms;
      block.inflation *= rms;
      least = std::min(least, rms);
    }
    return least;
  }

  /// Gain at which a fit ends. Where the residuals are not noise but what the model cannot show, which is the same over
  /// many rows, a row is worth less; of a coarse fit a small part of them is worth nothing.
  double least_gain(bool coarse) const {
    double alike = 0.0, unshown = 0.0;
    for (const Block& block : data.blocks) {
      const double square = block.inflation * block.inflation;
      alike += std::clamp(square, 1.0, most_rows_alike) / static_cast<double>(data.blocks.size());
      if (block.split == cell::Split::Fit)
        unshown += std::clamp((square - 1.0) / most_rows_alike, 0.0, 1.0) * static_cast<double>(block.rows);
    }
    return FitOptions{}.least_gain * alike + (coarse ? worthless_part * unshown : 0.0);
  }

  ComparisonData data;
  VectorXd base;
};

/// The effects asked for on each target of the cell, in the order asked for.
std::vector<std::unique_ptr<Candidate>> candidates_of(const cell::Recording& recording,
                                                      const JointFitOptions& options) {
  std::vector<std::unique_ptr<Candidate>> out;
  const std::vector<Hypothesis> all = hypotheses(recording.cell, span_of(recording));
  for (const std::string& id : options.effects)
    for (const Hypothesis& h : all) {
      if (h.effect != id || (!options.only.empty() && std::ranges::find(options.only, h.name()) == options.only.end()))
        continue;
      require(h.size() == 1 && !h.coordinates.front().whole,
              "effects: " + id + " has several parameters, or whole ones; expected effects of one number a joint");
      out.push_back(std::make_unique<Candidate>(Candidate{h, {}, {}}));
    }
  require(!out.empty(), "effects: the cell can carry none of them");
  return out;
}

/// Parts at the values of the cell, which act in the experiments to fit: those to check are simulated once, at the end.
std::vector<Part> parts_of(const ComparisonData& data, const std::vector<std::unique_ptr<Candidate>>& candidates) {
  const std::vector<int> experiments = experiments_of_split(data, compared_experiments(data), cell::Split::Fit);
  std::vector<Part> out;
  for (const std::unique_ptr<Candidate>& candidate : candidates) {
    candidate->experiments = experiments;
    out.push_back({candidate.get(), VectorXd::Zero(1)});
  }
  return out;
}

/// Fits until the noise that it leaves is the one it was fitted by; in units of that noise.
Model fitted(JointData& compared, std::vector<Part> parts, const JointFitOptions& how) {
  const int threads = how.threads;
  const NuisanceModel nuisance;
  const auto fit_from = [&](std::vector<Part> from, const FitOptions& options) {
    Model start;
    start.residual = compared.base;
    return fit(FitProblem{compared.data, nuisance, {}, 0.0, Slopes::WhereNeeded, weak_prior}, start, std::move(from),
               options);
  };
  compared.set_noise(compared.base);
  for (int round = 0; round < most_rounds; ++round) {
    Model found = fit_from(std::move(parts), {.threads = threads, .least_gain = compared.least_gain(how.coarse)});
    parts = std::move(found.parts);
    if (compared.set_noise(found.residual) > same_noise) break;
  }
  Model out = fit_from(std::move(parts), {.max_iterations = 1, .threads = threads});
  const std::vector<int> check =
      experiments_of_split(compared.data, compared_experiments(compared.data), cell::Split::Check);
  out.residual = residuals(compared.data, setup_of(compared.data, out.parts), check, out.residual);
  return out;
}

/// Covariance of the coordinates for residuals that depend on each other within `dependent_time`: gradients of pieces
/// of that length are independent, whatever the residuals in them are.
MatrixXd covariance_of(const ComparisonData& data, const Model& model) {
  const auto n = static_cast<Index>(model.jacobian.size());
  MatrixXd information = model.information;
  information.diagonal().array() += 1e-9;
  const MatrixXd inverse = information.ldlt().solve(MatrixXd::Identity(n, n));
  const VectorXd counted = counted_residual(data, model.residual);
  std::map<std::pair<int, long>, VectorXd> gradients;  // by experiment and piece
  for (Index i = 0; i < n; ++i)
    for (const auto& [b, slope] : model.jacobian[static_cast<std::size_t>(i)].parts) {
      const Block& block = data.blocks[static_cast<std::size_t>(b)];
      const VectorXd t = data.experiment(block).data.column("t");
      for (Index row = 0; row < slope.size(); ++row) {
        const auto piece = static_cast<long>(std::floor((t[row] - t[0]) / dependent_time));
        auto [at, fresh] = gradients.try_emplace({block.experiment, piece});
        if (fresh) at->second = VectorXd::Zero(n);
        at->second[i] += static_cast<double>(slope[row]) * counted[block.first + row];
      }
    }
  MatrixXd spread = MatrixXd::Zero(n, n);
  for (const auto& [piece, gradient] : gradients) spread += gradient * gradient.transpose();
  const double pieces = static_cast<double>(gradients.size());
  const double freedom = pieces / std::max(1.0, pieces - static_cast<double>(n));  // of few pieces
  const MatrixXd robust = freedom * inverse * spread * inverse;
  // Never below what independent residuals would give.
  MatrixXd out = robust;
  for (Index i = 0; i < n; ++i)
    if (const double ratio = std::sqrt(inverse(i, i) / std::max(robust(i, i), 1e-300)); ratio > 1.0) {
      out.row(i) *= ratio;
      out.col(i) *= ratio;
    }
  return out;
}

double rms_of(const ComparisonData& data, const VectorXd& counted, const std::string& column, cell::Split split) {
  double squares = 0.0, samples = 0.0;
  for (const Block& block : data.blocks) {
    if (block.split != split || column_name(block.kind, block.column) != column) continue;
    const Sum own = sum_of(data, counted, block);
    squares += block.sigma * block.sigma * own.chi2;
    samples += own.samples;
  }
  return samples > 0 ? std::sqrt(squares / samples) : 0.0;
}

std::vector<ColumnFit> column_fits(const JointData& nominal, const JointData& compared, const VectorXd& residual) {
  const ComparisonData &data = compared.data, &model = nominal.data;
  const VectorXd before = counted_residual(model, nominal.base), after = counted_residual(data, residual);
  std::vector<ColumnFit> out;
  for (const Block& block : data.blocks) {
    const std::string name = column_name(block.kind, block.column);
    if (std::ranges::any_of(out, [&](const ColumnFit& c) { return c.column == name; })) continue;
    out.push_back({name, block.sigma / block.inflation, rms_of(model, before, name, cell::Split::Fit),
                   rms_of(data, after, name, cell::Split::Fit), rms_of(model, before, name, cell::Split::Check),
                   rms_of(data, after, name, cell::Split::Check)});
  }
  return out;
}

/// What the model states of the first parameter of an effect, or the value at which the effect is off.
double stated_value(const cell::Cell& cell, const EffectName& name) {
  const cell::Effect& effect = cell::find_effect(name.effect);
  const cell::EffectParameter& parameter = effect.parameters.front();
  const std::vector<std::string> targets = cell::effect_targets(effect, cell);
  const auto index = static_cast<int>(std::ranges::find(targets, name.target) - targets.begin());
  if (parameter.nominal)
    if (const auto value = parameter.nominal({.cell = cell, .index = index}))
      if (const auto* number = std::get_if<double>(&*value)) return *number;
  return parameter.off.empty() ? 0.0 : parameter.off.front();
}

/// @param stated The cell from whose values effects depart.
void write_effects(const cell::Cell& stated, const ComparisonData& data, const Model& model, JointFit& out) {
  const MatrixXd covariance = covariance_of(data, model);
  VectorXd slope(covariance.rows());
  for (std::size_t k = 0; k < model.parts.size(); ++k) {
    const auto i = static_cast<Index>(k);
    const Hypothesis& h = model.parts[k].candidate->hypothesis;
    std::vector<ParameterEstimate> estimates = parameters(data, model, k, 1.0);
    const double plain = std::sqrt(std::max(coordinate_covariance(model, k, 1.0)(0, 0), 1e-300));
    const double std = std::sqrt(covariance(i, i));
    slope[i] = estimates.front().std.front() / plain;
    for (ParameterEstimate& estimate : estimates)
      for (double& value : estimate.std) value *= std / plain;
    const double off = std::abs(estimates.front().value.front() - stated_value(stated, h.name()));
    const double departure = off > 0.0 ? off / std::max(estimates.front().std.front(), 1e-12 * off) : 0.0;
    out.effects.push_back({h.name(), std::move(estimates), std < prior_width, departure});
  }
  out.covariance = slope.asDiagonal() * covariance * slope.asDiagonal();
}

}  // namespace

void JointFitOptions::validate() const {
  require(!effects.empty(), "effects: expected at least one id of the catalogue");
  for (const std::string& id : effects) cell::find_effect(id);
  require(threads >= 0, "threads must not be negative");
}

JointFit fit_joint_effects(const cell::Recording& recording, const cell::Simulator& simulator,
                           const JointFitOptions& options) {
  options.validate();
  recording.cell.validate();
  const auto start = std::chrono::steady_clock::now();
  const auto tell = [&](double fraction) {
    if (options.progress) options.progress(fraction);
  };
  const JointData nominal(recording, simulator);
  cell::Recording begun = recording;
  if (options.from) begun.cell = *options.from;
  JointData compared(begun, simulator);
  const std::vector<std::unique_ptr<Candidate>> candidates = candidates_of(begun, options);
  const std::vector<Part> parts = parts_of(compared.data, candidates);
  tell(0.1);
  const Model model = fitted(compared, parts, options);
  JointFit out;
  out.columns = column_fits(nominal, compared, model.residual);
  write_effects(recording.cell, compared.data, model, out);
  out.cell = cell_with(recording.cell, out.effects);
  out.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  tell(1.0);
  return out;
}

}  // namespace kr5::gap
