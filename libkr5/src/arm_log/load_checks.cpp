// SPDX-License-Identifier: BSD-3-Clause
#include "load_checks.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/identification/log_conditioning.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "joint_columns.hpp"
#include "load_scale.hpp"

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double weightless_share = 0.3;  // of what gravity makes, that loads without gravity show
constexpr double no_gravity = 1e-9;       // [m/s^2]
constexpr double like_gravity = 0.8;      // correlation of a load with its simulation, from which its shape is right
constexpr double copied = 1e-6;           // of the spread of a load, by which a copy differs from it
constexpr double wrapped_share = 0.02;    // of the rows, on each side of zero, of numbers that are read as unsigned
constexpr double notable_load = 0.2;      // of the largest load, above which its sign counts
constexpr double one_side = 0.1;          // of the rows, in which the simulation has such a sign
constexpr double clearly_more = 0.1;      // by which that is above the correlation with the simulation
constexpr Index fewest_values = 20;       // different ones, of a load that another may copy
constexpr Index fewest_counted = 5;       // of one that may have been read as unsigned numbers
constexpr double whole = 1e-6;            // of a step, to which numbers are whole ones
constexpr double like_size = 0.5;         // correlation of a load with the size of its simulation
const std::set<std::string> load_channels = {"motor current", "joint torque", "force", "moment"};

std::vector<std::string> load_names(const std::string& family, int joints) {
  std::vector<std::string> out;
  for (int k = 1; k <= joints; ++k) out.push_back(family + std::to_string(k));
  return out;
}

/// The prediction of an experiment; nothing where the cell cannot show it.
std::optional<io::Table> shown(const cell::Cell& cell, const cell::Experiment& experiment) {
  try {
    return predict::FastSimulator().predict(cell, experiment);
  } catch (const Error&) {
    return std::nullopt;
  }
}

MatrixXd table_columns(const io::Table& table, const std::vector<std::string>& names) {
  MatrixXd out(table.values.rows(), static_cast<Index>(names.size()));
  for (std::size_t k = 0; k < names.size(); ++k) out.col(static_cast<Index>(k)) = table.column(names[k]);
  return out;
}

double spread(const VectorXd& x) { return std::sqrt((x.array() - x.mean()).square().mean()); }

/// The loads of each channel beside their simulation, those that both have.
std::vector<ComparedLoads> compared_loads(const cell::Cell& cell, const cell::Experiment& experiment,
                                          const io::Table& prediction) {
  std::vector<ComparedLoads> out;
  for (const cell::Column& column : cell::compared_columns(experiment.kind, cell.robot.joints())) {
    if (load_channels.count(column.channel) == 0) continue;
    const auto same = std::find_if(out.begin(), out.end(), [&](const ComparedLoads& loads) {
      return loads.columns.front().channel == column.channel;
    });
    (same == out.end() ? out.emplace_back() : *same).columns.push_back(column);
  }
  std::erase_if(out, [&](const ComparedLoads& loads) {
    const std::vector<std::string> names = loads.names();
    return !std::all_of(names.begin(), names.end(), [&](const std::string& name) {
      return has_column(experiment, name) && prediction.find(name) >= 0;
    });
  });
  for (ComparedLoads& loads : out) {
    loads.measured = table_columns(experiment.data, loads.names());
    loads.simulated = table_columns(prediction, loads.names());
  }
  return out;
}

/// The numbers of a load in steps of its resolution; empty where they are no whole steps, or few different ones.
VectorXd in_steps(const VectorXd& x) {
  std::vector<double> sorted(x.begin(), x.end());
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  if (std::ssize(sorted) < fewest_counted) return {};
  double step = sorted.back() - sorted.front();
  for (std::size_t i = 1; i < sorted.size(); ++i) step = std::min(step, sorted[i] - sorted[i - 1]);
  const VectorXd out = x / step;
  return ((out.array() - out.array().round()).abs() > whole).any() ? VectorXd() : VectorXd(out.array().round());
}

/// By how much negative numbers were read too large, a power of two of their steps, of which none lies in the middle
/// half; 0 where they were not, as those are not of which the simulation is more like the numbers as they are.
double wrapped_at(const VectorXd& x, const VectorXd& simulated) {
  const VectorXd counts = in_steps(x);
  if (counts.size() == 0 || counts.minCoeff() < 0) return 0.0;
  for (const int bits : {8, 10, 12, 16, 32}) {
    const double modulus = std::ldexp(1.0, bits);
    if (counts.maxCoeff() >= modulus) continue;
    const auto high = counts.array() >= 3 * modulus / 4;
    const double below = static_cast<double>((counts.array() < modulus / 4).count()) / static_cast<double>(x.size()),
                 above = static_cast<double>(high.count()) / static_cast<double>(x.size());
    if (!(below > wrapped_share && above > wrapped_share && below + above == 1.0)) return 0.0;
    const VectorXd unwrapped = high.select(counts.array() - modulus, counts.array());
    const bool alike =
        std::abs(load_correlations(unwrapped, simulated)(0, 0)) > std::abs(load_correlations(counts, simulated)(0, 0));
    return alike ? modulus * (x.maxCoeff() / counts.maxCoeff()) : 0.0;
  }
  return 0.0;
}

/// Whether a load never changes its sign, is like the size of its simulation, and that has both signs.
bool lacks_sign(const VectorXd& x, const VectorXd& simulated) {
  if (x.minCoeff() < 0 && x.maxCoeff() > 0) return false;
  const double most = simulated.cwiseAbs().maxCoeff();
  const auto share = [&](double side) {
    return static_cast<double>((side * simulated.array() > notable_load * most).count()) /
           static_cast<double>(simulated.size());
  };
  if (std::min(share(1.0), share(-1.0)) < one_side) return false;
  const double sign = x.maxCoeff() > 0 ? 1.0 : -1.0;
  const double as_size = sign * load_correlations(x, simulated.cwiseAbs())(0, 0);
  return as_size > like_size && as_size > clearly_more + std::abs(load_correlations(x, simulated)(0, 0));
}

struct Objections {
  std::vector<LogProblem> problems;
  bool recognised = true;  // the columns of every channel are like their simulation
};

Objections compare_loads(const cell::Cell& cell, const cell::Cell& simulated, const cell::Experiment& experiment,
                         bool by_joint) {
  const std::optional<io::Table> prediction = shown(simulated, experiment);
  if (!prediction) return {{}, false};
  Objections out;
  for (const ComparedLoads& loads : compared_loads(cell, experiment, *prediction)) {
    out.recognised = out.recognised && are_recognised(loads);
    std::optional<LogProblem> found = check_scale(cell, loads, by_joint);
    if (!found) found = check_exchange(loads);
    if (!found) found = check_likeness(loads);
    if (found) out.problems.push_back(*found);
  }
  return out;
}

/// The cell without friction of its joints; nothing where it states none.
std::optional<cell::Cell> without_friction(const cell::Cell& cell) {
  if (!cell.drives) return std::nullopt;
  const cell::Friction& friction = cell.drives->friction;
  if (friction.coulomb.isZero(0) && friction.viscous.isZero(0)) return std::nullopt;
  cell::Cell out = cell;
  out.drives->friction.coulomb.setZero();
  out.drives->friction.viscous.setZero();
  return out;
}

std::vector<LogProblem> find_load_problems(const cell::Cell& cell, const cell::Experiment& experiment) {
  if (const auto found = check_constant(cell, experiment)) return {*found};
  if (auto found = check_copies(cell, experiment); !found.empty()) return found;
  if (const auto found = check_signs(cell, experiment)) return {*found};
  if (auto found = check_saturated(cell, experiment); !found.empty()) return found;
  if (const auto found = check_reading(cell, experiment)) return {*found};
  if (const auto found = check_weight(cell, experiment)) return {*found};
  const std::optional<cell::Cell> bare = without_friction(cell);
  const Objections as_stated = compare_loads(cell, cell, experiment, !bare);  // stated friction may be off by joint
  if (as_stated.problems.empty() || !bare) return as_stated.problems;
  const Objections without = compare_loads(cell, *bare, experiment, true);
  return !without.problems.empty() || !without.recognised ? as_stated.problems : std::vector<LogProblem>{};
}

}  // namespace

std::optional<LogProblem> check_constant(const cell::Cell& cell, const cell::Experiment& experiment) {
  const std::string family = load_family(experiment);
  if (family.empty()) return std::nullopt;
  const MatrixXd loads = joint_columns(experiment, family, cell.robot.joints());
  if ((loads.rowwise() - loads.row(0)).cwiseAbs().maxCoeff() > 0) return std::nullopt;
  return LogProblem{
      .kind = LogProblemKind::Constant, .columns = load_names(family, cell.robot.joints()), .found = loads(0, 0)};
}

std::vector<LogProblem> check_copies(const cell::Cell& cell, const cell::Experiment& experiment) {
  const std::string family = load_family(experiment);
  if (family.empty()) return {};
  const MatrixXd loads = joint_columns(experiment, family, cell.robot.joints());
  std::vector<LogProblem> out;
  for (Index k = 1; k < loads.cols(); ++k)
    for (Index j = 0; j < k; ++j) {
      const VectorXd a = loads.col(j).array() - loads.col(j).mean(), b = loads.col(k).array() - loads.col(k).mean();
      if (!(a.norm() > 0 && b.norm() > 0)) continue;
      if ((b - a * (a.dot(b) / a.squaredNorm())).norm() > copied * b.norm()) continue;
      if (std::set<double>(a.begin(), a.end()).size() < fewest_values) continue;
      out.push_back({.kind = LogProblemKind::Copy,
                     .columns = {family + std::to_string(k + 1)},
                     .joint = static_cast<int>(k),
                     .other = static_cast<int>(j)});
      break;
    }
  return out;
}

std::optional<LogProblem> check_signs(const cell::Cell& cell, const cell::Experiment& experiment) {
  const std::string family = load_family(experiment);
  const auto simulated = family.empty() ? std::nullopt : shown(cell, experiment);
  if (!simulated || simulated->find(family + "1") < 0) return std::nullopt;
  const int n = cell.robot.joints();
  const MatrixXd loads = joint_columns(experiment, family, n);
  LogProblem wrapped{.kind = LogProblemKind::Wrapped}, without{.kind = LogProblemKind::Unsigned};
  bool signs = false;  // of any load: a driver that logs sizes does so for all
  for (int k = 0; k < n; ++k) {
    const std::string name = family + std::to_string(k + 1);
    signs = signs || (loads.col(k).minCoeff() < 0 && loads.col(k).maxCoeff() > 0);
    if (const double excess = wrapped_at(loads.col(k), simulated->column(name)); excess > 0) {
      wrapped.columns.push_back(name);
      wrapped.found = std::max(wrapped.found, excess);
    } else if (lacks_sign(loads.col(k), simulated->column(name))) {
      without.columns.push_back(name);
    }
  }
  if (!wrapped.columns.empty()) return wrapped;
  return without.columns.empty() || signs ? std::nullopt : std::optional(without);
}

std::vector<LogProblem> check_saturated(const cell::Cell& cell, const cell::Experiment& experiment) {
  const std::string family = load_family(experiment);
  if (family.empty() || !has_column(experiment, "qc1") || experiment.data.values.rows() < 10) return {};
  identification::JointLog log;
  log.t = experiment.data.column("t");
  log.q = joint_columns(experiment, "qc", cell.robot.joints());
  log.tau = joint_columns(experiment, family, cell.robot.joints());
  std::vector<LogProblem> out;
  for (const identification::LogFinding& finding : identification::check_log(log)) {
    if (finding.fault != identification::LogFault::Saturated || finding.column.rfind("tau", 0) != 0) continue;
    const int joint = std::stoi(finding.column.substr(3)) - 1;
    out.push_back({.kind = LogProblemKind::Saturated,
                   .columns = {family + std::to_string(joint + 1)},
                   .joint = joint,
                   .found = finding.begin,
                   .found_to = finding.end});
  }
  return out;
}

std::optional<LogProblem> check_weight(const cell::Cell& cell, const cell::Experiment& experiment) {
  const std::string family = load_family(experiment);
  if (family.empty()) return std::nullopt;
  cell::Cell weightless = cell;
  weightless.robot.gravity.setConstant(no_gravity);
  const auto heavy = shown(cell, experiment), light = shown(weightless, experiment);
  const std::vector<std::string> names = load_names(family, cell.robot.joints());
  if (!heavy || !light || heavy->find(names.front()) < 0) return std::nullopt;
  const MatrixXd got = joint_columns(experiment, family, cell.robot.joints()), with = table_columns(*heavy, names),
                 without = table_columns(*light, names), gravity = with - without;
  Index j = 0;
  for (Index k = 1; k < gravity.cols(); ++k)
    if (spread(gravity.col(k)) > spread(gravity.col(j))) j = k;
  // Of loads in another unit the size says nothing, and the shape all.
  const double alike = std::abs(load_correlations(got, with)(j, j)),
               alike_lighter = std::abs(load_correlations(got, without)(j, j));
  if (alike > std::max(like_gravity, alike_lighter)) return std::nullopt;
  const double left = spread(got.col(j) - with.col(j)), lighter = spread(got.col(j) - without.col(j));
  const VectorXd a = got.col(j).array() - got.col(j).mean(), b = gravity.col(j).array() - gravity.col(j).mean();
  const double share = std::abs(a.dot(b)) / std::max(b.squaredNorm(), 1e-30);
  if (!(lighter < weightless_share * left && share < weightless_share)) return std::nullopt;
  return LogProblem{.kind = LogProblemKind::Weightless, .columns = {names[static_cast<std::size_t>(j)]}};
}

std::optional<LogProblem> check_reading(const cell::Cell& cell, const cell::Experiment& experiment) {
  const std::string family = load_family(experiment);
  if (family.empty()) return std::nullopt;
  LogProblem out{.columns = {"q", family}};
  if (const auto order = fitting_order(cell, experiment)) {
    out.kind = LogProblemKind::Order;
    out.remedy = LogRemedy::Rearrange;
    out.reading.order = *order;
    return out;
  }
  const auto reading = fitting_convention(cell, experiment);
  if (!reading) return std::nullopt;
  out.kind = LogProblemKind::Convention;
  out.remedy = LogRemedy::Recount;
  out.reading = *reading;
  return out;
}

std::vector<LogProblem> check_loads(const cell::Cell& cell, const cell::Experiment& experiment) {
  if (experiment.kind != cell::Kind::Motion) return {};
  std::vector<LogProblem> out = find_load_problems(cell, experiment);
  for (LogProblem& problem : out) problem.experiment = experiment.name;
  return out;
}

}  // namespace kr5::arm_log
