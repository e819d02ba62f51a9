// SPDX-License-Identifier: BSD-3-Clause
#include "fit/problem_data.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::fit {

const StoredMeasurement& ProblemData::entry(FitMeasurement handle) const {
  require(handle.index >= 0 && handle.index < static_cast<int>(entries.size()),
          "Problem: there is no such measurement");
  return entries[static_cast<std::size_t>(handle.index)];
}

FitBlock ProblemData::keep(Block block) {
  forget();
  blocks.push_back(std::move(block));
  return {static_cast<int>(blocks.size()) - 1};
}

FitMeasurement ProblemData::keep(std::unique_ptr<Measurement> measurement) {
  require(measurement != nullptr, "Problem: there is no measurement");
  forget();
  BlockUse use(blocks);
  measurement->declare(use);
  StoredMeasurement entry{.measurement = nullptr, .rows = measurement->rows(), .blocks = use.blocks()};
  for (const int b : entry.blocks) {
    if (!blocks[static_cast<std::size_t>(b)].nuisance) continue;
    require(entry.nuisance < 0, "Problem: a measurement may have one nuisance pose");
    entry.nuisance = b;
  }
  entry.measurement = std::move(measurement);
  entries.push_back(std::move(entry));
  return {static_cast<int>(entries.size()) - 1};
}

std::vector<const double*> ProblemData::values(const StoredMeasurement& entry) const {
  std::vector<const double*> out;
  for (const int b : entry.blocks) out.push_back(blocks[static_cast<std::size_t>(b)].values.data());
  return out;
}

int ProblemData::condensed_rows(const StoredMeasurement& entry) const {
  return entry.measurement->condensed_rows(
      [&](FitBlock block) { return blocks[static_cast<std::size_t>(block.index)].any_free(); });
}

bool ProblemData::evaluate(const StoredMeasurement& entry, const double* const* values, int rows, double weight,
                           double* residuals, double* const* jacobians) const {
  const auto stored = [&](std::size_t k) {
    return rows * blocks[static_cast<std::size_t>(entry.blocks[k])].values.size();
  };
  for (std::size_t k = 0; jacobians && k < entry.blocks.size(); ++k)
    if (jacobians[k]) std::fill_n(jacobians[k], stored(k), 0.0);
  if (!entry.measurement->evaluate(Evaluation(blocks, entry.blocks, rows, values, residuals, jacobians))) return false;
  const double scale = std::sqrt(weight);
  if (scale == 1.0) return true;
  Eigen::Map<Eigen::VectorXd>(residuals, rows) *= scale;
  for (std::size_t k = 0; jacobians && k < entry.blocks.size(); ++k)
    if (jacobians[k]) Eigen::Map<Eigen::VectorXd>(jacobians[k], stored(k)) *= scale;
  return true;
}

bool ProblemData::exists() const {
  Eigen::VectorXd r;
  for (const StoredMeasurement& e : entries) {
    if (!(e.weight > 0)) continue;
    r.resize(e.rows);
    if (!evaluate(e, values(e).data(), e.rows, 1.0, r.data(), nullptr)) return false;
  }
  return true;
}

FreeCoordinates ProblemData::number_coordinates() const {
  std::vector<bool> used(blocks.size(), false);
  for (const StoredMeasurement& e : entries)
    for (const int b : e.blocks) used[static_cast<std::size_t>(b)] = used[static_cast<std::size_t>(b)] || e.weight > 0;
  FreeCoordinates out;
  out.places.assign(blocks.size(), {});
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Block& block = blocks[b];
    std::vector<int>& places = out.places[b];
    places.assign(static_cast<std::size_t>(block.size()), -1);
    if (block.nuisance || !(used[b] || block.prior.size())) continue;
    for (const int i : block.free()) {
      places[static_cast<std::size_t>(i)] = static_cast<int>(out.list.size());
      out.list.push_back(block.coordinates[static_cast<std::size_t>(i)]);
    }
    for (std::size_t i = 0; i < places.size(); ++i) places[i] = places[static_cast<std::size_t>(block.leader[i])];
  }
  require(!out.list.empty(), "Problem: no parameter is free");
  out.of_nuisance.assign(blocks.size(), {});
  for (std::size_t i = 0; i < entries.size(); ++i)
    if (entries[i].weight > 0 && entries[i].nuisance >= 0)
      out.of_nuisance[static_cast<std::size_t>(entries[i].nuisance)].push_back(static_cast<int>(i));
  return out;
}

}  // namespace kr5::fit
