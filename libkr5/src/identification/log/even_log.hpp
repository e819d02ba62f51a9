// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "identification/log/log_checks.hpp"

namespace kr5::identification {

/// Values at `grid` by cubic pieces whose slopes are those of the chords between neighbours (Catmull and Rom), which
/// close stamps do not make steep.
MatrixXd resampled_log(const VectorXd& t, const MatrixXd& y, const VectorXd& grid);

/// Signals of a run at even steps.
struct EvenRun {
  VectorXd t;
  MatrixXd q, qd, tau, temperature;
  double step = 0.0;
};

/// A run at even steps; resampled only when its clock is uneven. `even_clock` becomes true when the samples are even
/// although the stamps are not.
EvenRun even_run(const OrderedLog& data, const RowRange& run, ClockModel model, bool& even_clock);

}  // namespace kr5::identification
