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

  /// @param experiment Its kind, and in `data` the given columns; columns to be predicted may be there and are not
  /// read.
  /// @returns one row for each row of the experiment, and the columns to be predicted, in the order of `columns()`;
  ///          those the cell has no part for (currents without drives ...) are left out. Units of `columns()`.
  /// @throws InvalidArgument naming the part of the cell, or the given column, that is not there.
  virtual io::Table predict(const Cell& cell, const Experiment& experiment) const = 0;

 protected:
  Simulator() = default;
  Simulator(const Simulator&) = default;
  Simulator& operator=(const Simulator&) = default;
};

}  // namespace kr5::cell
