// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/residual_analysis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <set>

#include <kr5/core/parallel.hpp>

#include "gap/reporting/consistency.hpp"
#include "gap/reporting/gap_figures.hpp"
#include "gap/reporting/oscillation.hpp"
#include "gap/reporting/variables.hpp"

namespace kr5::gap {
namespace {

constexpr double elsewhere = 2.0;  // times the error where it is known, on other rows

double sum_of_squares(const ComparisonData& data, const Group& group, const Eigen::VectorXd& stacked) {
  double sum = 0.0;
  for (const int b : group.all) sum += data.blocks[b].rows_of(stacked).squaredNorm();
  return sum;
}

/// What the simulator may be off without any effect, as a sum of squares of a column.
double floor_of(const ComparisonData& data, const Group& group, const DiagnoseOptions& options) {
  const double error = elsewhere * known_error(options, group.name());
  double sum = 0.0;
  for (const int b : group.all) {
    const Block& block = data.blocks[b];
    const double floor = std::max(options.simulator_floor, error / block.sigma);
    sum += static_cast<double>(block.rows) * floor * floor;
  }
  return sum;
}

/// By which part of an effect the simulator may be off.
double inaccuracy(const Part& part, const DiagnoseOptions& options) {
  return options.simulator_accuracy + part.candidate->hypothesis.inaccuracy;
}

/// Residuals of a model without one of its parts, nothing refitted.
Eigen::VectorXd residual_without(const ComparisonData& data, const Model& model, std::size_t part,
                                 const Eigen::VectorXd& base) {
  const std::vector<Part> parts = without(model.parts, part);
  const std::vector<int>& own = model.parts[part].candidate->experiments;
  if (!parts.empty()) return residuals(data, setup_of(data, parts), own, model.residual);
  Eigen::VectorXd out = model.residual;
  for (const int e : own)
    for (const int b : data.blocks_of[e]) data.blocks[b].rows_of(out) = data.blocks[b].rows_of(base);
  return out;
}

/// Residuals of a model without one of its parts, by its slopes.
Eigen::VectorXd residual_without_by_slopes(const ComparisonData& data, const Model& model, std::size_t part) {
  Eigen::VectorXd out = counted_residual(data, model.residual);
  const Eigen::Index first = model.first_coordinate(part);
  const Eigen::VectorXd& x = model.parts[part].x;
  for (Eigen::Index k = 0; k < x.size(); ++k) add_slope(data, x(k), model, first + k, out);
  return out;
}

/// Counted residuals of a model without each of its parts; by its slopes where, without one of many, there is no such
/// cell.
std::vector<Eigen::VectorXd> all_without(const ComparisonData& data, const Model& model, const Eigen::VectorXd& base,
                                         int threads) {
  std::vector<Eigen::VectorXd> out(model.parts.size());
  parallel_for(static_cast<int>(out.size()), threads, [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    const auto residual = where_possible([&] { return residual_without(data, model, k, base); });
    out[k] = residual ? counted_residual(data, *residual) : residual_without_by_slopes(data, model, k);
  });
  return out;
}

/// What the simulator may be off with the effects of a model, as a sum of squares of each column. `without`: the
/// counted residuals without each of its parts. Where the nominal cell is far off, how much an effect changes it says
/// nothing of that, and they are not looked at.
std::vector<double> discrepancies(const FitProblem& problem, const std::vector<Group>& groups, const Model& model,
                                  const std::vector<Eigen::VectorXd>& without, const DiagnoseOptions& options) {
  const ComparisonData& data = problem.data;
  std::vector<double> out(groups.size(), 0.0);
  for (std::size_t g = 0; g < groups.size(); ++g) out[g] = floor_of(data, groups[g], options);
  if (problem.far) return out;
  const Eigen::VectorXd with = counted_residual(data, model.residual);
  for (std::size_t k = 0; k < model.parts.size(); ++k) {
    const double off = inaccuracy(model.parts[k], options);
    const Eigen::VectorXd change = with - without[k];
    for (std::size_t g = 0; g < groups.size(); ++g) out[g] += off * off * sum_of_squares(data, groups[g], change);
  }
  return out;
}

/// Effects whose size is not the same everywhere: marks the columns that show it most.
void add_inconsistencies(const ComparisonData& data, const std::vector<Group>& groups, const Model& model,
                         const DiagnoseOptions& options, ResidualAnalysis& out) {
  for (std::size_t k = 0; k < model.parts.size(); ++k) {
    const double off = inaccuracy(model.parts[k], options);
    const Eigen::VectorXd change = out.whole - out.without[k];
    const double effect = change.squaredNorm();
    double floor = 0.0;  // errors of one column are none of another's: each counts as the effect is seen there
    for (const Group& group : groups)
      floor += sum_of_squares(data, group, change) / std::max(effect, 1e-9) * floor_of(data, group, options);
    const Inconsistency found = inconsistency(data, groups, model, k, out.counted, off * off * effect + floor);
    const bool sure = found.p < options.false_alarms;
    out.strayed.push_back(sure ? found.strength : 0.0);
    if (!sure) continue;
    out.structured[found.group] = true;
    Structure& s = out.structure[found.group];
    Dependence differs{found.variable, Shape::EffectDiffers};
    differs.effect = name_of(model.parts[k]);
    differs.evidence = 1 - found.p;
    differs.share = 1.0;
    s.dependences.insert(s.dependences.begin(), std::move(differs));
  }
}

/// Whether small errors of the cell would take the place of an effect only by being small no more: by some three
/// standard deviations each beyond those beside it.
bool strains_nuisance(const FitProblem& problem, const Model& with, const Model& without) {
  constexpr double square = 9.0;
  const auto cost = [&](const Model& model) {
    return nuisance_cost(problem.data, problem.nuisance, problem.prior, counted_residual(problem.data, model.residual));
  };
  return cost(without) - cost(with) > square * static_cast<double>(problem.nuisance.signatures.size());
}

/// What a column shows while its joint moves, on the data to judge by. At rest the friction of a real joint is anything
/// up to its level on either side, which no model of a motion tells.
struct Moving {
  std::vector<double> squares;  ///< Of the residuals, in units of sigma.
  double recorded = 0.0;        ///< Standard deviation of what was recorded, in the unit of the column.
};

Moving while_moving(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted) {
  constexpr double resting = 0.05;  // of the highest speed
  const int joint = cell::find_column(group.kind, group.column).joint;
  Moving out;
  double rows = 0.0, sum = 0.0, square = 0.0;
  for (const int b : group.judged) {
    const Block& block = data.blocks[b];
    const cell::Experiment& e = data.experiment(block);
    const Eigen::VectorXd values = e.data.column(block.column);
    Eigen::VectorXd speed = joint < 0 ? Eigen::VectorXd() : velocity(e, joint).cwiseAbs();
    if (speed.size() == 0) speed.setOnes(block.rows);
    const double slowest = resting * speed.maxCoeff();
    for (Eigen::Index i = 0; i < block.rows; ++i) {
      if (speed(i) < slowest) continue;
      rows += 1.0;
      sum += values(i);
      square += values(i) * values(i);
      const double r = counted(block.first + i);
      if (data.use(block.first + i) != 0.0 && !std::isnan(r)) out.squares.push_back(r * r);
    }
  }
  if (rows > 0.0) out.recorded = std::sqrt(std::max(square / rows - std::pow(sum / rows, 2), 0.0));
  return out;
}

/// RMS of all but the largest two in a hundred: where a speed jumps, single rows are far off in any smoothed motion.
double rms_of_most(std::vector<double> squares) {
  constexpr double single = 0.02;
  const auto most = static_cast<std::ptrdiff_t>((1.0 - single) * static_cast<double>(squares.size()));
  if (most == 0) return 0.0;
  std::nth_element(squares.begin(), squares.begin() + most - 1, squares.end());
  return std::sqrt(std::accumulate(squares.begin(), squares.begin() + most, 0.0) / static_cast<double>(most));
}

/// Whether a column stays off by clearly more than noise and what a simulator may be off, whatever an estimate from
/// the recording excuses: in that, a disturbance that no catalogue names counts as an error of the best model.
bool beyond_noise(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted,
                  const DiagnoseOptions& options) {
  const Moving moving = while_moving(data, group, counted);
  const double left = rms_of_most(moving.squares);
  return left > min_judged && left * inflation_of(data, group) > elsewhere &&
         left * data.blocks[group.judged.front()].sigma > elsewhere * options.simulator_accuracy * moving.recorded;
}

/// Whether a column is further off on the data to check by than what the simulator is known to be off allows for.
bool beyond_known_error(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted,
                        const DiagnoseOptions& options) {
  const double error = known_error(options, group.name());
  if (error == 0.0 || group.judged.empty()) return false;
  if (options.errors_of_recording) return beyond_noise(data, group, counted, options);
  const double floor = elsewhere * error / data.blocks[group.judged.front()].sigma,
               gap = gap_of(data, group.judged, counted).rms;
  return gap * gap > 1 + floor * floor;
}

/// Full trust when an effect leaves no more than the simulator may be off with it, none when it leaves a twentieth of
/// what it explains; by the logarithm in between.
double trust_of(double left, double accuracy) {
  constexpr double none = 0.05;
  const double full = std::min(accuracy * accuracy, none / 10);
  return std::clamp(std::log(none / std::max(left, 1e-9)) / std::log(none / std::max(full, 1e-9)), 0.0, 1.0);
}

}  // namespace

double known_error(const DiagnoseOptions& options, const std::string& column) {
  for (const ColumnError& own : options.simulator_errors)
    if (own.column == column) return own.error;
  return 0.0;
}

bool ResidualAnalysis::any_structure() const { return std::ranges::count(structured, true) > 0; }

bool ResidualAnalysis::any() const { return any_structure() || std::ranges::count(beyond, true) > 0; }

ResidualAnalysis analyze_residual(const FitProblem& problem, const std::vector<Group>& groups, const Model& model,
                                  const Eigen::VectorXd& base, const DiagnoseOptions& options) {
  const ComparisonData& data = problem.data;
  ResidualAnalysis out;
  out.whole = counted_residual(data, model.residual);
  out.without = all_without(data, model, base, options.threads);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  out.shown = model.residual.array().isNaN().select(
      nan, without_nuisance(data, problem.nuisance, problem.prior, out.whole).array());
  out.counted = updated(problem, model);
  const std::vector<double> discrepancy = discrepancies(problem, groups, model, out.without, options);
  out.structure.resize(groups.size());
  const double level = options.false_alarms / static_cast<double>(groups.size());
  parallel_for(static_cast<int>(groups.size()), options.threads,
               [&](int g) { out.structure[g] = structure(data, groups[g], out.counted, discrepancy[g], level); });
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const bool seen = !options.errors_of_recording || above_noise(data, groups[g], out.shown);
    out.structured.push_back(seen && out.structure[g].p < level);
    out.beyond.push_back(beyond_known_error(data, groups[g], out.shown, options));
    out.strength.push_back(out.structure[g].strength);
  }
  add_inconsistencies(data, groups, model, options, out);
  return out;
}

void describe_beyond(const ComparisonData& data, const std::vector<Group>& groups, const DiagnoseOptions& options,
                     ResidualAnalysis& rest) {
  const double level = options.false_alarms / static_cast<double>(groups.size());
  const Eigen::VectorXd shown = rest.shown.array().isNaN().select(0.0, rest.shown.array());
  parallel_for(static_cast<int>(groups.size()), options.threads, [&](int g) {
    const Group& group = groups[g];
    if (!rest.beyond[g] || group.judged.empty()) return;
    const double inflation = inflation_of(data, group);
    std::vector<Dependence> depends = structure(data, group, shown, 0.0, level, inflation).dependences;
    if (const auto found = main_oscillation(data, group, inflation * shown, level)) {
      const auto lesser = [&](const Dependence& d) { return d.share < found->share; };
      depends.insert(std::find_if(depends.begin(), depends.end(), lesser), *found);
    }
    std::vector<Dependence>& all =
        rest.structure[g].dependences;  // effects that are not the same everywhere stay first
    all.insert(all.end(), depends.begin(), depends.end());
  });
}

bool within_discrepancy(const FitProblem& problem, const std::vector<Group>& groups, const Model& with,
                        const Model& without, const Eigen::VectorXd& base, const DiagnoseOptions& options) {
  constexpr double shapes = 12.0;
  const ComparisonData& data = problem.data;
  if (strains_nuisance(problem, with, without)) return false;
  std::vector<Eigen::VectorXd> apart;
  if (!problem.far) apart = all_without(data, without, base, options.threads);
  const std::vector<double> discrepancy = discrepancies(problem, groups, without, apart, options);
  const Eigen::VectorXd before = updated(problem, without), after = updated(problem, with);
  double gain = 0.0, weighted = 0.0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const double part = sum_of_squares(data, groups[g], before) - sum_of_squares(data, groups[g], after);
    gain += part;
    weighted += std::max(part, 0.0) * discrepancy[g];
  }
  return gain <= 0 || gain < 2 * weighted / gain / shapes;
}

bool worsens_check(const ComparisonData& data, const std::vector<Group>& groups, const Model& with,
                   const Model& without) {
  const Eigen::VectorXd before = counted_residual(data, without.residual),
                        after = counted_residual(data, with.residual);
  double change = 0.0;
  for (const Group& group : groups)
    for (const int b : group.judged)
      change += data.blocks[b].rows_of(after).squaredNorm() - data.blocks[b].rows_of(before).squaredNorm();
  return change > 0.0;
}

double trust(const ComparisonData& data, const std::vector<Group>& groups, const Model& model,
             const ResidualAnalysis& rest, std::size_t part, const DiagnoseOptions& options) {
  const double off = inaccuracy(model.parts[part], options);
  double total = 0.0, trusted = 0.0;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    const double explained =
        sum_of_squares(data, groups[g], rest.without[part]) - sum_of_squares(data, groups[g], rest.whole);
    if (explained <= 0.0) continue;
    total += explained;
    const double bent = trust_of(rest.strength[g] / explained, off);
    trusted += explained * (rest.structured[g] ? bent : 1.0);
  }
  return total > 0 ? std::min(trusted / total, trust_of(rest.strayed[part] / total, off)) : 0.0;
}

}  // namespace kr5::gap
