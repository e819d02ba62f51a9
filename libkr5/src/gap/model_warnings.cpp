// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/gap/model_warnings.hpp>

#include <cmath>
#include <optional>

#include "gap/known_row.hpp"
#include "gap/nominal_parameter.hpp"

namespace kr5::gap {
namespace {

constexpr double surely = 2.0;         // standard deviations by which a size must be beyond what is usual
constexpr double usual_factor = 1.5;   // of a mass
constexpr double usual_centre = 0.1;   // of a centre of mass [m]
constexpr double usual_length = 0.01;  // [m]
constexpr double usual_angle = 0.05;   // of a link [rad]
constexpr double usual_zero = 0.1;     // [rad]

Eigen::VectorXd as_numbers(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), std::ssize(values));
}

/// What the cell says of a parameter in as many numbers; none where it says nothing, or a pose.
std::optional<Eigen::VectorXd> stated_numbers(const cell::Cell& cell, const Cause& cause, const ParameterEstimate& p) {
  const auto value = nominal_parameter(cell, cause, cause.parameters, p.name);
  if (!value) return std::nullopt;
  Eigen::VectorXd out;
  if (const double* number = std::get_if<double>(&*value)) out = Eigen::VectorXd::Constant(1, *number);
  if (const auto* vector = std::get_if<Eigen::VectorXd>(&*value)) out = *vector;
  if (out.size() == 0 || out.size() != std::ssize(p.value) || p.std.size() != p.value.size()) return std::nullopt;
  return out;
}

std::optional<ModelWarning> warning_of_mass(const Cause& cause, const ParameterEstimate& p, double stated) {
  const double low = p.value[0] - surely * p.std[0], high = p.value[0] + surely * p.std[0];
  if (high >= stated / usual_factor && low <= stated * usual_factor) return std::nullopt;
  return ModelWarning{cause, ModelWarningKind::Mass, p.value[0] / stated, p.std[0] / stated, "-"};
}

std::optional<ModelWarning> warning_of_size(const Cause& cause, const ParameterEstimate& p,
                                            const Eigen::VectorXd& stated) {
  if (p.unit != "m" && p.unit != "rad") return std::nullopt;
  const double usual = stated.size() == 3 ? usual_centre : p.unit == "m" ? usual_length : usual_angle;
  const double off = (as_numbers(p.value) - stated).norm(), error = as_numbers(p.std).norm();
  if (!(off - surely * error > usual)) return std::nullopt;
  return ModelWarning{cause, ModelWarningKind::Size, off, error, p.unit};
}

/// The first of its parameters that is far from what the cell says.
std::optional<ModelWarning> warning_of_model(const Cause& cause, const cell::Cell& cell) {
  for (const ParameterEstimate& p : cause.parameters) {
    const auto stated = stated_numbers(cell, cause, p);
    if (!stated) continue;
    const bool mass = p.unit == "kg" && (*stated)[0] > 0;
    if (auto warning = mass ? warning_of_mass(cause, p, (*stated)[0]) : warning_of_size(cause, p, *stated))
      return warning;
  }
  return std::nullopt;
}

std::optional<ModelWarning> warning_of_zero(const Cause& cause, const cell::Effect& row) {
  if (!row.moves_tool || cause.parameters.size() != 1) return std::nullopt;
  const ParameterEstimate& zero = cause.parameters[0];
  if (zero.unit != "rad" || row.parameters.at(0).nominal_when_off || zero.value.empty() || zero.std.empty())
    return std::nullopt;
  if (!(std::abs(zero.value[0]) - surely * zero.std[0] > usual_zero)) return std::nullopt;
  return ModelWarning{cause, ModelWarningKind::Zero, zero.value[0], zero.std[0], zero.unit};
}

}  // namespace

std::vector<ModelWarning> model_warnings(const Diagnosis& found, const cell::Cell& cell) {
  std::vector<ModelWarning> out;
  for (const Cause& cause : found.causes) {
    const cell::Effect* row = known_row(cause.effect);
    if (!row || !cause.target.starts_with("joint")) continue;
    if (auto warning = warning_of_model(cause, cell)) out.push_back(std::move(*warning));
    if (auto warning = warning_of_zero(cause, *row)) out.push_back(std::move(*warning));
  }
  return out;
}

}  // namespace kr5::gap
