// SPDX-License-Identifier: BSD-3-Clause
#include "gap/fitting/posterior.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <Eigen/Cholesky>

#include <kr5/cell/effect.hpp>

namespace kr5::gap {
namespace {

/// Mean square of the residuals of all blocks that the parts of a model touch, small errors of the cell taken out; at
/// least 1.
double misfit(const FitProblem& problem, const Model& model) {
  const ComparisonData& data = problem.data;
  const Eigen::VectorXd r =
      without_nuisance(data, problem.nuisance, problem.prior, counted_residual(data, model.residual));
  std::set<int> blocks;
  for (const Signature& s : model.jacobian)
    for (const auto& part : s.parts) blocks.insert(part.first);
  double chi2 = 0.0, samples = 0.0;
  for (const int b : blocks) {
    chi2 += data.blocks[b].rows_of(r).squaredNorm();
    samples += data.use.segment(data.blocks[b].first, data.blocks[b].rows).sum();
  }
  return samples > 0 ? std::max(1.0, chi2 / samples) : 1.0;
}

std::vector<EffectName> names_of(const Model& model) {
  std::vector<EffectName> out;
  for (const Part& part : model.parts) out.push_back(name_of(part));
  return out;
}

/// A value as a list of numbers; of a pose the matrix.
std::vector<double> numbers(const cell::EffectValue& value) {
  if (const auto* x = std::get_if<double>(&value)) return {*x};
  if (const auto* v = std::get_if<Eigen::VectorXd>(&value)) return {v->begin(), v->end()};
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T = std::get<Pose>(value).matrix();
  return {T.data(), T.data() + 16};
}

/// Change from one value to another, as it is counted in standard deviations.
Eigen::VectorXd change(const cell::EffectValue& from, const cell::EffectValue& to) {
  if (const auto* T = std::get_if<Pose>(&from)) return pose_difference(*T, std::get<Pose>(to));
  const std::vector<double> a = numbers(from), b = numbers(to);
  Eigen::VectorXd out(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) out(static_cast<Eigen::Index>(i)) = b[i] - a[i];
  return out;
}

/// Whether a cell has a parameter of an effect set on a target.
bool is_set(const cell::Cell& cell, const EffectName& name, const std::string& parameter) {
  const std::vector<std::string> targets = cell::effect_targets(cell::find_effect(name.effect), cell);
  const auto index = std::ranges::find(targets, name.target) - targets.begin();
  return cell.effects.find(name.effect, parameter, static_cast<int>(index)) != nullptr;
}

/// Parameters a part sets: those with a value once it is applied, without one that its hypothesis leaves out.
std::vector<std::pair<const cell::EffectParameter*, cell::EffectValue>> values(const ComparisonData& data,
                                                                               const Hypothesis& h,
                                                                               const Eigen::VectorXd& x) {
  cell::Cell cell = data.recording->cell;
  if (h.apply) h.apply(cell, x);
  std::vector<std::pair<const cell::EffectParameter*, cell::EffectValue>> out;
  for (const cell::EffectParameter& p : cell::find_effect(h.effect).parameters)
    if (const auto value = cell::get_effect(cell.effects, h.effect, h.target, p.name))
      if (!p.with_and_without || is_set(cell, h, p.name)) out.emplace_back(&p, *value);
  return out;
}

/// Parameters of an effect that no catalogue names: its coordinates.
std::vector<ParameterEstimate> own_parameters(const Hypothesis& h, const Eigen::VectorXd& x,
                                              const Eigen::MatrixXd& covariance) {
  std::vector<ParameterEstimate> out;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const Coordinate& c = h.coordinates[static_cast<std::size_t>(i)];
    const double off = 0.5 * h.inaccuracy * h.inaccuracy * x(i);
    out.push_back(
        {c.name, {c.size * x(i)}, {c.size * std::hypot(std::sqrt(std::max(covariance(i, i), 0.0)), off)}, c.unit});
  }
  return out;
}

std::string unit_text(std::string unit) {
  std::replace(unit.begin(), unit.end(), ' ', '.');
  for (std::size_t at; (at = unit.find(",.")) != std::string::npos;) unit.replace(at, 2, ", ");
  for (std::size_t at; (at = unit.find(".or.")) != std::string::npos;) unit.replace(at, 4, " or ");
  return unit;
}

/// A unit of loads and speeds in the catalogue, which is that of a joint that turns, on the joint of an effect.
std::string unit_at(const cell::Robot& robot, const std::string& target, const std::string& unit) {
  static const std::map<std::string, std::string> slides = {
      {"N m", "N"}, {"N m s/rad", "N s/m"}, {"N m/rad", "N/m"}, {"rad/s", "m/s"}, {"N m/A", "N/A"}};
  for (std::size_t j = 0; j < robot.dh.size(); ++j)
    if (target == "joint" + std::to_string(j + 1) && robot.dh[j].type == kinematics::JointType::Prismatic)
      if (const auto found = slides.find(unit); found != slides.end()) return unit_text(found->second);
  return unit_text(unit);
}

}  // namespace

bool contains(const std::vector<EffectName>& names, const EffectName& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

EffectName name_of(const Part& part) { return part.candidate->hypothesis.name(); }

Posterior posterior(const FitProblem& problem, const std::vector<Model>& models) {
  Posterior out;
  out.temperature = misfit(problem, models.front());
  double sum = 0.0;
  for (const Model& m : models) {
    out.weights.push_back(std::exp((m.log_evidence - models.front().log_evidence) / out.temperature));
    sum += out.weights.back();
  }
  for (double& w : out.weights) w /= sum;
  return out;
}

double probability(const std::vector<Model>& models, const Posterior& posterior, const EffectName& name) {
  double sum = 0.0;
  for (std::size_t i = 0; i < models.size(); ++i)
    if (models[i].has(name)) sum += posterior.weights[i];
  return std::min(sum, 1.0);
}

std::vector<EffectName> ties(const std::vector<Model>& models, const Posterior& posterior, const Model& best,
                             std::size_t part) {
  const std::vector<EffectName> blamed = names_of(best);
  std::vector<EffectName> out;
  for (const Model& model : models) {
    const std::vector<EffectName> other = names_of(model);
    const double odds = std::exp((model.log_evidence - best.log_evidence) / posterior.temperature);
    if (odds < min_tied_odds || other.size() > blamed.size() || contains(other, blamed[part])) continue;
    for (const Part& p : model.parts) {
      const EffectName name = name_of(p);
      if (!p.candidate->hypothesis.of_recording && !contains(blamed, name) && !contains(out, name)) out.push_back(name);
    }
  }
  return out;
}

Eigen::MatrixXd coordinate_covariance(const Model& model, std::size_t part, double temperature) {
  const Hypothesis& h = model.parts[part].candidate->hypothesis;
  const Eigen::VectorXd& x = model.parts[part].x;
  Eigen::MatrixXd information = model.information / temperature;
  information.diagonal().array() += 1e-9;
  const Eigen::MatrixXd all =
      information.ldlt().solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  const Eigen::Index first = model.first_coordinate(part);
  Eigen::MatrixXd covariance = all.block(first, first, x.size(), x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i)  // between two whole numbers every value is as likely
    if (h.coordinates[static_cast<std::size_t>(i)].whole) covariance(i, i) += 1.0 / 12;
  return covariance;
}

bool is_significant(const Model& model, std::size_t part, double temperature) {
  constexpr double least = 2.0;  // standard deviations
  const Eigen::VectorXd& x = model.parts[part].x;
  const Eigen::MatrixXd covariance = coordinate_covariance(model, part, temperature);
  for (Eigen::Index i = 0; i < x.size(); ++i)
    if (std::abs(x(i)) > least * std::sqrt(std::max(covariance(i, i), 0.0))) return true;
  return false;
}

std::vector<ParameterEstimate> parameters(const ComparisonData& data, const Model& model, std::size_t part,
                                          double temperature) {
  const Hypothesis& h = model.parts[part].candidate->hypothesis;
  const Eigen::VectorXd& x = model.parts[part].x;
  const Eigen::MatrixXd covariance = coordinate_covariance(model, part, temperature);
  if (!h.coordinates.front().name.empty()) return own_parameters(h, x, covariance);
  const auto at = values(data, h, x);
  std::vector<ParameterEstimate> out;
  std::vector<Eigen::MatrixXd> jacobians;
  for (const auto& [parameter, value] : at) {
    out.push_back(
        {parameter->name, numbers(value), {}, unit_at(data.recording->cell.robot, h.target, parameter->unit)});
    jacobians.push_back(Eigen::MatrixXd::Zero(change(value, value).size(), x.size()));
  }
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const Coordinate& c = h.coordinates[static_cast<std::size_t>(i)];
    const double step = c.whole ? 1.0 : 1e-4 * std::max(1.0, std::abs(x(i)));
    Eigen::VectorXd moved = x;
    moved(i) += x(i) + step <= c.upper ? step : -step;
    const auto there = values(data, h, moved);
    for (std::size_t p = 0; p < at.size(); ++p)
      jacobians[p].col(i) = change(at[p].second, there[p].second) / (moved(i) - x(i));
  }
  for (std::size_t p = 0; p < out.size(); ++p) {
    const Eigen::VectorXd variance = (jacobians[p] * covariance * jacobians[p].transpose()).diagonal();
    // What a simulator is off in shape moves the answer in second order.
    const double off = 0.5 * h.inaccuracy * h.inaccuracy;
    for (Eigen::Index k = 0; k < variance.size(); ++k)
      out[p].std.push_back(
          std::hypot(std::sqrt(std::max(variance(k), 0.0)), off * out[p].value[static_cast<std::size_t>(k)]));
  }
  return out;
}

}  // namespace kr5::gap
