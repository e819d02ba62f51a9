// SPDX-License-Identifier: BSD-3-Clause
#include "load_scale.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/core/statistics.hpp>

#include "joint_columns.hpp"

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double near_factor = 1.6;    // within which a scale is taken for one that a wrong unit gives
constexpr double factor_spread = 4.0;  // between the scales of the joints, above which they are no one unit
constexpr double recognised = 0.8;     // correlation of a column with its simulation
constexpr double far_factor = 3.0;     // which no usual error of a model makes
constexpr double nothing_alike = 0.3;  // correlation
constexpr double visible_load = 5.0;   // standard deviations of noise that a load must make to be missed

MatrixXd about_mean(const MatrixXd& x) { return x.rowwise() - x.colwise().mean(); }

VectorXd own_correlations(const ComparedLoads& loads) {
  return load_correlations(loads.measured, loads.simulated).diagonal();
}

/// Slopes of the recorded columns over their simulation.
VectorXd load_slopes(const ComparedLoads& loads) {
  const MatrixXd a = about_mean(loads.measured), b = about_mean(loads.simulated);
  const VectorXd power = b.cwiseAbs2().colwise().sum().transpose().cwiseMax(1e-30);
  return a.cwiseProduct(b).colwise().sum().transpose().cwiseQuotient(power);
}

struct KnownFactor {
  LogRemedy remedy;
  VectorXd factor;
};

/// The factors that a wrong unit or side of the gears gives.
std::vector<KnownFactor> known_factors(const cell::Cell& cell, const ComparedLoads& loads) {
  const auto n = static_cast<Index>(loads.columns.size());
  const std::string& channel = loads.columns.front().channel;
  const bool current = channel == "motor current", torque = channel == "joint torque";
  std::vector<KnownFactor> out = {{LogRemedy::Thousandth, VectorXd::Constant(n, 1e3)},
                                  {LogRemedy::Thousand, VectorXd::Constant(n, 1e-3)}};
  if (torque && cell.robot.limits && cell.robot.limits->effort.size() == n && cell.robot.limits->effort.allFinite())
    out.push_back({LogRemedy::PercentOfEffort, 100 * cell.robot.limits->effort.cwiseInverse()});
  if (!cell.drives || !(current || torque)) return out;
  const VectorXd ratio = cell.drives->structure.diagonal().cwiseAbs();
  const VectorXd& constant = cell.drives->torque_constant;
  if (current) {
    out.push_back({LogRemedy::MotorTorques, constant});
    out.push_back({LogRemedy::JointTorques, constant.cwiseProduct(ratio)});
  } else {
    out.push_back({LogRemedy::MotorSide, ratio.cwiseInverse()});
    out.push_back({LogRemedy::Currents, ratio.cwiseProduct(constant).cwiseInverse()});
  }
  return out;
}

/// Share of values within a factor of 1.
double share_near_one(const VectorXd& values) {
  return (values.array().log().abs() < std::log(near_factor)).cast<double>().mean();
}

double middle_value(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return 0.5 * (values[(values.size() - 1) / 2] + values[values.size() / 2]);
}

/// A factor of recognised columns, their slopes above zero.
std::optional<LogProblem> check_factor(const cell::Cell& cell, const ComparedLoads& loads,
                                       const std::vector<Index>& known, const VectorXd& slopes, bool by_joint) {
  const VectorXd slope = slopes(known);
  LogProblem out{.columns = loads.names(), .expected = 1.0};
  const double middle = middle_value({slope.begin(), slope.end()});
  for (const KnownFactor& candidate : known_factors(cell, loads)) {
    const VectorXd beside = slope.cwiseQuotient(VectorXd(candidate.factor(known)));
    if (!(share_near_one(beside) > 0.7 && share_near_one(slope) < 0.5)) continue;
    out.kind = LogProblemKind::Factor;
    out.remedy = candidate.remedy;
    out.found = middle;
    return out;
  }
  const double least = slope.minCoeff(), most = slope.maxCoeff();
  if (by_joint && slope.size() >= 3 && share_near_one(slope) < 0.5 && most > factor_spread * least) {
    out.kind = LogProblemKind::FactorOfJoint;
    out.found = least, out.found_to = most;
    return out;
  }
  const VectorXd logs = slope.array().log();
  const double off = std::exp(middle_value({logs.begin(), logs.end()}));
  if (off <= far_factor && off >= 1 / far_factor) return std::nullopt;
  out.kind = LogProblemKind::UnknownFactor;
  out.found = off;
  return out;
}

}  // namespace

std::vector<std::string> ComparedLoads::names() const {
  std::vector<std::string> out;
  for (const cell::Column& column : columns) out.push_back(column.name);
  return out;
}

MatrixXd load_correlations(const MatrixXd& measured, const MatrixXd& simulated) {
  const MatrixXd a = about_mean(measured), b = about_mean(simulated);
  const VectorXd of_a = a.colwise().norm(), of_b = b.colwise().norm();
  return (a.transpose() * b).cwiseQuotient((of_a * of_b.transpose()).cwiseMax(1e-30));
}

bool are_recognised(const ComparedLoads& loads) {
  const VectorXd own = own_correlations(loads);
  return (own.array().abs() > recognised).count() >= std::max<Index>(1, own.size() / 3);
}

std::optional<LogProblem> check_scale(const cell::Cell& cell, const ComparedLoads& loads, bool by_joint) {
  if (!are_recognised(loads)) return std::nullopt;
  const VectorXd own = own_correlations(loads), slopes = load_slopes(loads);
  const std::vector<std::string> names = loads.names();
  std::vector<Index> known;
  std::vector<std::string> backward;
  for (Index k = 0; k < own.size(); ++k) {
    if (!(std::abs(own[k]) > recognised)) continue;
    known.push_back(k);
    if (slopes[k] < 0) backward.push_back(names[static_cast<std::size_t>(k)]);
  }
  if (backward.size() == known.size())
    return LogProblem{.kind = LogProblemKind::OppositeSign, .remedy = LogRemedy::Reverse, .columns = names};
  if (!backward.empty())
    return LogProblem{.kind = LogProblemKind::SomeOpposite, .remedy = LogRemedy::ReverseSome, .columns = backward};
  return check_factor(cell, loads, known, slopes, by_joint);
}

std::optional<LogProblem> check_exchange(const ComparedLoads& loads) {
  constexpr double clearly = 0.3;  // correlation above the own one
  const MatrixXd c = load_correlations(loads.measured, loads.simulated);
  const std::vector<std::string> names = loads.names();
  for (Index j = 0; j < c.rows(); ++j)
    for (Index k = j + 1; k < c.rows(); ++k) {
      const double own = std::min(c(j, j), c(k, k)), other = std::min(c(j, k), c(k, j));
      if (other > recognised && other > own + clearly)
        return LogProblem{.kind = LogProblemKind::Swapped,
                          .remedy = LogRemedy::Exchange,
                          .columns = {names[static_cast<std::size_t>(j)], names[static_cast<std::size_t>(k)]},
                          .found = other,
                          .found_to = own};
    }
  return std::nullopt;
}

std::optional<LogProblem> check_likeness(const ComparedLoads& loads) {
  const VectorXd own = own_correlations(loads);
  const VectorXd spread = about_mean(loads.simulated).cwiseAbs2().colwise().mean().cwiseSqrt().transpose();
  Index j = 0;
  spread.maxCoeff(&j);
  const auto x = loads.measured.col(j);
  std::vector<double> second;
  for (Index i = 2; i < x.size(); ++i) second.push_back(std::abs(x[i] - 2 * x[i - 1] + x[i - 2]));
  const double noise = median(std::move(second)) / 1.65 + 1e-12;  // median over the deviation of a second difference
  if (!(own[j] < nothing_alike && spread[j] > visible_load * noise)) return std::nullopt;
  return LogProblem{
      .kind = LogProblemKind::Unlike, .columns = {loads.columns[static_cast<std::size_t>(j)].name}, .found = own[j]};
}

}  // namespace kr5::arm_log
