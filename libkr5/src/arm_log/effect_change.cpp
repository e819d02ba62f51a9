// SPDX-License-Identifier: BSD-3-Clause
#include "effect_change.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <kr5/cell/effect.hpp>

namespace kr5::arm_log {

namespace {

using gap::ParameterEstimate;

const cell::EffectParameter& row_of(const gap::EffectName& effect, const std::string& parameter) {
  return *std::ranges::find(cell::find_effect(effect.effect).parameters, parameter, &cell::EffectParameter::name);
}

bool is_strength(const gap::EffectName& effect, const std::string& parameter) {
  return cell::find_effect(effect.effect).parameters.front().name == parameter;
}

/// What the model states; empty where it states nothing.
std::vector<double> nominal(const cell::Cell& cell, const gap::EffectName& effect, const ParameterEstimate& p) {
  const auto value = cell::nominal_value(cell, effect.effect, effect.target, p.name);
  if (!value) return {};
  if (const auto* number = std::get_if<double>(&*value)) return {*number};
  if (const auto* vector = std::get_if<Eigen::VectorXd>(&*value)) return {vector->begin(), vector->end()};
  return {};
}

const ParameterEstimate* parameter_of(const gap::Cause& cause, const std::string& name) {
  const auto found = std::ranges::find(cause.parameters, name, &ParameterEstimate::name);
  return found == cause.parameters.end() ? nullptr : &*found;
}

/// Whether two effects in one are one with the sum of their values, or the common centre.
bool adds_up(const cell::EffectParameter& row) {
  return row.coordinate == cell::CoordinateKind::Linear || row.coordinate == cell::CoordinateKind::Quotient;
}

/// Sum of what was there and what was added; of a centre, that of both masses.
std::vector<double> combined(const gap::Cause& before, const gap::Cause& added, const std::vector<double>& was,
                             const ParameterEstimate& p) {
  double weight = 1.0, share = 1.0;
  if (row_of(added, p.name).coordinate == cell::CoordinateKind::Quotient) {
    const double a = before.parameters.front().value.at(0), b = added.parameters.front().value.at(0);
    weight = a / (a + b), share = b / (a + b);
  }
  std::vector<double> out = p.value;
  for (std::size_t k = 0; k < out.size(); ++k) out[k] = weight * was.at(k) + share * p.value[k];
  return out;
}

/// An effect replaces what the model states, or is added to what is there. Of one that was not there the first
/// parameter was 0, and the others had no value: a payload without mass has no centre of mass.
ParameterChange change_of(const gap::Cause& cause, const gap::Cause* before, const cell::Cell& tuned,
                          const ParameterEstimate& p) {
  ParameterChange out{p.name, nominal(tuned, cause, p), p.value, p.std, p.unit};
  if (!out.first.empty()) return out;
  const ParameterEstimate* was = before ? parameter_of(*before, p.name) : nullptr;
  if (was && was->value.size() == p.value.size() && adds_up(row_of(cause, p.name))) {
    out.first = was->value;
    out.second = combined(*before, cause, was->value, p);
  } else if (!before && is_strength(cause, p.name)) {
    out.first.assign(p.value.size(), 0.0);
  }
  return out;
}

}  // namespace

std::vector<EffectChange> changes_of(const gap::Diagnosis& difference, const gap::Diagnosis& reference,
                                     const cell::Cell& tuned, const Eigen::VectorXd& own) {
  std::vector<EffectChange> out;
  Eigen::Index at = 0;
  for (const gap::Cause& cause : difference.causes) {
    const auto before = std::ranges::find(reference.causes, gap::EffectName(cause));
    EffectChange change{{cause.effect, cause.target}, cause.probability, cause.explained_fraction, {}, cause.tied_with};
    for (const ParameterEstimate& p : cause.parameters) {
      ParameterChange one = change_of(cause, before == reference.causes.end() ? nullptr : &*before, tuned, p);
      for (double& std : one.std) std = std::hypot(std, own[at++]);
      change.parameters.push_back(std::move(one));
    }
    out.push_back(std::move(change));
  }
  return out;
}

void reverse(std::vector<EffectChange>& changes) {
  for (EffectChange& change : changes)
    for (ParameterChange& p : change.parameters) std::swap(p.first, p.second);
}

}  // namespace kr5::arm_log
