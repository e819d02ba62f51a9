// SPDX-License-Identifier: BSD-3-Clause
#include "gap/reporting/residual_analysis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "gap/parallel.hpp"
#include "gap/reporting/consistency.hpp"
#include "gap/reporting/gap_figures.hpp"

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

/// Counted residuals of a model without each of its parts.
std::vector<Eigen::VectorXd> all_without(const ComparisonData& data, const Model& model, const Eigen::VectorXd& base) {
  std::vector<Eigen::VectorXd> out;
  for (std::size_t k = 0; k < model.parts.size(); ++k)
    out.push_back(counted_residual(data, residual_without(data, model, k, base)));
  return out;
}

/// What the simulator may be off with the effects of a model, as a sum of squares of each column. `without`: the
/// counted residuals without each of its parts.
std::vector<double> discrepancies(const ComparisonData& data, const std::vector<Group>& groups, const Model& model,
                                  const std::vector<Eigen::VectorXd>& without, const DiagnoseOptions& options) {
  std::vector<double> out(groups.size(), 0.0);
  for (std::size_t g = 0; g < groups.size(); ++g) out[g] = floor_of(data, groups[g], options);
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
    const EffectName name = name_of(model.parts[k]);
    s.dependences.insert(s.dependences.begin(),
                         {found.variable, name.effect + " of " + name.target + " differs with it", 1 - found.p, 1.0});
  }
}

/// Whether small errors of the cell would take the place of an effect only by being small no more: by some three
/// standard deviations each beyond those beside it.
bool strains_nuisance(const FitProblem& problem, const Model& with, const Model& without) {
  constexpr double square = 9.0;
  const auto cost = [&](const Model& model) {
    return nuisance_cost(problem.data, problem.scatter, problem.prior, counted_residual(problem.data, model.residual));
  };
  return cost(without) - cost(with) > square * static_cast<double>(problem.scatter.signatures.size());
}

/// Standard deviation of what was recorded in the judged blocks of a group.
double recorded_deviation(const ComparisonData& data, const Group& group) {
  double sum = 0.0, rows = 0.0;
  for (const int b : group.judged) {
    const Eigen::VectorXd values = data.experiment(data.blocks[b]).data.column(data.blocks[b].column);
    sum += (values.array() - values.mean()).square().sum();
    rows += static_cast<double>(values.size());
  }
  return rows > 0 ? std::sqrt(sum / rows) : 0.0;
}

/// Whether a column stays off by more than noise and a good part of what it shows. Smoothed positions and rough masses
/// of a description leave less. An error that is stated as far above what is seen says that the column is not judged.
bool beyond_good_part(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted) {
  constexpr double part = 1.0 / 3, judged = 0.5;  // of the deviation; of sigma
  const double gap = gap_of(data, group.judged, counted).rms;
  const double left = gap * data.blocks[group.judged.front()].sigma;
  return gap > judged && gap_over_noise(data, group, counted) > elsewhere &&
         left > part * recorded_deviation(data, group);
}

/// Whether a column is further off on the data to check by than what the simulator is known to be off allows for.
bool beyond_known_error(const ComparisonData& data, const Group& group, const Eigen::VectorXd& counted,
                        const DiagnoseOptions& options) {
  const double error = known_error(options, group.name());
  if (error == 0.0 || group.judged.empty()) return false;
  if (options.errors_of_recording) return beyond_good_part(data, group, counted);
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
  out.without = all_without(data, model, base);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  out.shown = model.residual.array().isNaN().select(
      nan, without_nuisance(data, problem.scatter, problem.prior, out.whole).array());
  out.counted = updated(problem, model);
  const std::vector<double> discrepancy = discrepancies(data, groups, model, out.without, options);
  out.structure.resize(groups.size());
  const double level = options.false_alarms / static_cast<double>(groups.size());
  parallel_for(static_cast<int>(groups.size()), options.threads,
               [&](int g) { out.structure[g] = structure(data, groups[g], out.counted, discrepancy[g], level); });
  for (std::size_t g = 0; g < groups.size(); ++g) {
    out.structured.push_back(out.structure[g].p < level);
    out.beyond.push_back(beyond_known_error(data, groups[g], out.shown, options));
    out.strength.push_back(out.structure[g].strength);
  }
  add_inconsistencies(data, groups, model, options, out);
  return out;
}

bool within_discrepancy(const FitProblem& problem, const std::vector<Group>& groups, const Model& with,
                        const Model& without, const Eigen::VectorXd& base, const DiagnoseOptions& options) {
  constexpr double shapes = 12.0;
  const ComparisonData& data = problem.data;
  if (strains_nuisance(problem, with, without)) return false;
  const std::vector<double> discrepancy =
      discrepancies(data, groups, without, all_without(data, without, base), options);
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
