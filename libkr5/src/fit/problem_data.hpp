// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <kr5/fit/problem.hpp>

#include "fit/block.hpp"

/// @file
/// Private: the blocks and measurements of a problem.

namespace kr5::fit {

struct StoredMeasurement {
  std::unique_ptr<Measurement> measurement;
  double weight = 1.0;
  int rows = 0;
  std::vector<int> blocks;  ///< Of the problem, each once.
  int nuisance = -1;        ///< The one of them that is a nuisance.
};

struct ProblemData {
  std::vector<Block> blocks;
  std::vector<StoredMeasurement> entries;
  FreeCoordinates free;  ///< Of the last solve; empty when blocks or measurements were added since.

  Block& block(FitBlock handle) { return block_of(blocks, handle); }
  const Block& block(FitBlock handle) const { return block_of(blocks, handle); }
  const StoredMeasurement& entry(FitMeasurement handle) const;
  StoredMeasurement& entry(FitMeasurement handle) {
    return const_cast<StoredMeasurement&>(std::as_const(*this).entry(handle));
  }

  /// What is added changes what solve() found out.
  void forget() { free = {}; }
  FitBlock keep(Block block);
  FitMeasurement keep(std::unique_ptr<Measurement> measurement);

  std::vector<const double*> values(const StoredMeasurement& entry) const;
  int condensed_rows(const StoredMeasurement& entry) const;
  /// Residuals of an entry, times the root of `weight`, and their derivatives unless null; see Evaluation.
  bool evaluate(const StoredMeasurement& entry, const double* const* values, int rows, double weight, double* residuals,
                double* const* jacobians) const;
  /// Whether every measurement in use has residuals at the present values.
  bool exists() const;
  /// @throws InvalidArgument when nothing is free.
  FreeCoordinates number_coordinates() const;
};

}  // namespace kr5::fit
