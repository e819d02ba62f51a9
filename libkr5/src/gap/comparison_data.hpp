// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/gap/findings.hpp>

/// @file
/// All that was recorded and can be compared, as one stacked vector.

namespace kr5::gap {

/// One compared column of one experiment: samples [first, first + rows) of every stacked vector.
struct Block {
  int experiment = 0;
  cell::Kind kind = cell::Kind::Motion;
  cell::Split split = cell::Split::Fit;
  std::string column;  ///< As in the recording; `rx ry rz` for orientation.
  std::string noise;   ///< Key of `noise` in the cell.
  std::string target;  ///< Nearest target of the catalogue, e.g. joint3.
  double sigma = 1.0;  ///< Of one sample, in the unit of the column.
  Eigen::Index first = 0;
  Eigen::Index rows = 0;
  bool orientation = false;  ///< One of rx ry rz.
  /// Sigma over the noise of the sensor alone: above 1 where what the simulator is known to be off counts beside it,
  /// and where neighbouring rows say about the same.
  double inflation = 1.0;
  double correlation = 0.0;  ///< Of the noise of neighbouring rows.

  auto rows_of(const Eigen::VectorXd& stacked) const { return stacked.segment(first, rows); }
  auto rows_of(Eigen::VectorXd& stacked) const { return stacked.segment(first, rows); }
};

/// `motion.i3`
inline std::string column_name(cell::Kind kind, const std::string& column) {
  return std::string(kr5::name_of(kind)) + "." + column;
}

/// What is simulated: a cell, and what effects that a cell cannot hold do to the columns it shows.
struct Setup {
  Setup(cell::Cell c) : cell(std::move(c)) {}  // NOLINT: most setups are a cell alone

  cell::Cell cell;
  std::vector<std::function<void(io::Table&, const cell::Experiment&)>> changes;
};
io::Table predict(const cell::Simulator& simulator, const Setup& setup, const cell::Experiment& experiment);

/// What every step of the diagnosis looks at.
struct ComparisonData {
  const cell::Recording* recording = nullptr;
  const cell::Simulator* simulator = nullptr;
  std::vector<Block> blocks;
  std::vector<std::vector<int>> blocks_of;  ///< Of each experiment.
  Eigen::ArrayXd use;                       ///< 1 for samples that count, 0 for spikes.
  Eigen::Index size = 0;
  std::vector<LeftOut> left_out;  ///< What was recorded and could not be compared, and why.

  const cell::Experiment& experiment(const Block& b) const { return recording->experiments[b.experiment]; }
};

/// Residual of what cannot be compared, in units of noise: a ray that met the sphere only in the recording or only in
/// the simulation, a point the simulated sensor does not see. The least that a sample must be off so that it is no
/// chance.
constexpr double missing_residual = 3.0;

/// Lists what can be compared. Columns whose noise the cell does not state are left out.
ComparisonData compare_columns(const cell::Recording& recording, const cell::Simulator& simulator);

/// The recording with clocks that begin at the first row of a kind, when they count from an epoch long ago: warming and
/// drift would be over. Nothing, when they do not.
std::optional<cell::Recording> from_zero(const cell::Recording& recording);

/// @throws InvalidArgument for a cell whose robot has not as many joints as the recorded one.
void require_joints(const cell::Recording& recording, const cell::Cell& cell);

/// Kinds of which nothing can be fitted, or nothing is left to check by.
std::vector<MissingSplit> missing_splits(const ComparisonData& data);

/// Marks the loads of a joint as not to be used in rows in which it is not known which way it moves
/// (cell::known_directions), and with them those of motors that turn it together with others.
void mark_unknown_directions(ComparisonData& data);

/// Residuals of the nominal cell, stacked, with such rows marked. Experiments and columns that the simulator cannot
/// show are taken out.
/// @throws InvalidArgument when none is left.
Eigen::VectorXd compare_nominal(ComparisonData& data);

/// All experiments of which something is compared.
std::vector<int> compared_experiments(const ComparisonData& data);

/// The run that each row belongs to; 0 where there are none.
Eigen::VectorXd runs(const cell::Experiment& experiment);

/// What the simulator shows of an experiment; nothing, and why among `refused`, when it cannot.
std::optional<io::Table> try_predict(const ComparisonData& data, const cell::Cell& cell, int experiment,
                                     std::vector<LeftOut>& refused);

/// Whether a table of predictions has what a block is compared with.
bool has_column_of(const io::Table& predicted, const Block& block);

/// Residuals (recorded less simulated, over sigma) of one experiment, one vector a block; NaN where they cannot be
/// compared.
std::vector<Eigen::VectorXd> compare(const ComparisonData& data, int experiment, const Setup& setup);

/// The same, as it comes from a table of predictions.
std::vector<Eigen::VectorXd> compare(const ComparisonData& data, int experiment, const io::Table& predicted);

/// Writes the residuals of an experiment into a stacked vector.
void write_residuals(const ComparisonData& data, int experiment, const std::vector<Eigen::VectorXd>& residuals,
                     Eigen::VectorXd& stacked);

/// Residuals of a block; NaN in rows that do not count.
Eigen::VectorXd used_rows(const ComparisonData& data, const Block& block, const Eigen::VectorXd& residual_of_block);

/// What is squared and summed: spikes at 0, what cannot be compared at `missing_residual`.
Eigen::VectorXd counted_residual(const ComparisonData& data, const Eigen::VectorXd& residual);

/// Sum of squares, and number of samples.
struct Sum {
  double chi2 = 0.0;
  double samples = 0.0;

  Sum& operator+=(const Sum& more) {
    chi2 += more.chi2;
    samples += more.samples;
    return *this;
  }
};
Sum sum_of(const ComparisonData& data, const Eigen::VectorXd& counted, const Block& block);
/// Over the blocks of a split.
Sum sum_of(const ComparisonData& data, const Eigen::VectorXd& counted, cell::Split split);

}  // namespace kr5::gap
