// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/cell.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/io/csv.hpp>

namespace kr5::cell {

/// What the sensors of a cell would show in an experiment, noise apart.
class Simulator {
 public:
  virtual ~Simulator() = default;

  /// The prediction with every effect that the cell carries: those of the library as the simulator knows them, those
  /// that were registered (kr5/cell/effect_registry.hpp) by their own laws.
  /// @param experiment Its kind, and in `data` the given columns; columns to be predicted may be there and are not
  /// read.
  /// @returns one row for each row of `data` (the lead-in is simulated before, and left out), and the columns to be
  /// predicted, in the order of `columns()`;
  ///          those the cell has no part for (currents without drives ...) are left out. Units of `columns()`.
  /// @throws InvalidArgument with every error of the cell (Cell::validate), or naming the part of it, or the given
  ///         column, that is not there.
  io::Table predict(const Cell& cell, const Experiment& experiment) const;
  /// The same of a cell that is known to be valid, or that a fit tries with an effect beyond its bounds.
  io::Table predict_unchecked(const Cell& cell, const Experiment& experiment) const;

 protected:
  Simulator() = default;
  Simulator(const Simulator&) = default;
  Simulator& operator=(const Simulator&) = default;

  /// The same of a cell without registered effects; it is valid but for effects that a fit tries beyond their bounds.
  virtual io::Table simulate(const Cell& cell, const Experiment& experiment) const = 0;

 private:
  /// With registered effects; the experiment has no lead-in.
  io::Table predict_rows(const Cell& cell, const Experiment& experiment) const;
};

}  // namespace kr5::cell
