// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/parameters/parameter_report.hpp"

#include <cmath>
#include <set>

#include <kr5/uncertainty/confidence.hpp>

namespace kr5::calibration::parameters {
namespace {

void report_block(const fit::Problem& fit, const fit::Solution& result, fit::FitBlock block, bool from_nominal,
                  std::vector<EstimatedParameter>& parameters) {
  if (!block.exists()) return;
  const std::vector<int> places = result.places(block);
  const Eigen::VectorXd change = fit.change(block), values = fit.values(block);
  const bool pose = values.size() != change.size();
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (places[k] < 0) continue;
    const auto at = static_cast<Eigen::Index>(k);
    EstimatedParameter& out = parameters[static_cast<std::size_t>(places[k])];
    out.value = pose ? change[at] : values[at];
    out.nominal = from_nominal && !pose ? values[at] - change[at] : 0.0;
  }
}

}  // namespace

ParameterReport report_parameters(const fit::Problem& fit, const fit::Solution& result,
                                  std::span<const fit::FitBlock> nominal, std::span<const fit::FitBlock> others,
                                  const Eigen::VectorXd& inflation) {
  ParameterReport out;
  const Eigen::VectorXd wider = inflation.cwiseSqrt();
  out.covariance = wider.asDiagonal() * result.covariance * wider.asDiagonal();
  out.parameters.resize(result.coordinates.size());
  for (const fit::FitBlock block : nominal) report_block(fit, result, block, true, out.parameters);
  for (const fit::FitBlock block : others) report_block(fit, result, block, false, out.parameters);
  std::set<std::string> unknown;
  for (const fit::UnidentifiableDirection& direction : result.unidentifiable)
    unknown.insert(direction.coordinates.begin(), direction.coordinates.end());
  for (std::size_t k = 0; k < out.parameters.size(); ++k) {
    EstimatedParameter& parameter = out.parameters[k];
    const fit::FitCoordinate& coordinate = result.free_coordinates()[k];
    const auto at = static_cast<Eigen::Index>(k);
    parameter.name = coordinate.full_name();
    parameter.unit = coordinate.unit;
    parameter.std = std::sqrt(out.covariance(at, at));
    parameter.identifiable = !unknown.contains(result.coordinates[k]);
  }
  return out;
}

Eigen::VectorXd same_inflation(const fit::Solution& result, double numbers, double dof) {
  return Eigen::VectorXd::Constant(static_cast<Eigen::Index>(result.coordinates.size()),
                                   uncertainty::covariance_inflation(numbers, dof));
}

Matrix6 covariance_of_pose(const fit::Solution& solution, fit::FitBlock pose, const Eigen::MatrixXd& covariance) {
  const std::vector<int> places = solution.places(pose);
  Matrix6 out = Matrix6::Zero();
  for (std::size_t r = 0; r < 6; ++r)
    for (std::size_t c = 0; c < 6; ++c)
      if (places[r] >= 0 && places[c] >= 0)
        out(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(c)) = covariance(places[r], places[c]);
  return out;
}

}  // namespace kr5::calibration::parameters
