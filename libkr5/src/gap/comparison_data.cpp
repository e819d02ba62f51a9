// SPDX-License-Identifier: BSD-3-Clause
#include "gap/comparison_data.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include <Eigen/Geometry>

#include <kr5/cell/known_directions.hpp>
#include <kr5/core/error.hpp>
#include <kr5/gap/notes.hpp>

namespace kr5::gap {
namespace {

constexpr const char* quaternion_columns[] = {"qw", "qx", "qy", "qz"};
constexpr double long_ago = 1e6;     // of the begin of a clock [s]
constexpr double least_known = 0.1;  // of the rows, in which the directions of all joints of a motor are known

/// Adds a column that is not compared, to those of the same kind and reason: an arm has many joints.
void leave_out(std::vector<LeftOut>& all, cell::Kind kind, const std::string& column, LeftOutReason reason,
               const std::string& detail = "") {
  auto entry = std::ranges::find_if(all, [&](const LeftOut& e) {
    return e.kind == kind && e.reason == reason && e.detail == detail && e.experiment.empty();
  });
  if (entry == all.end()) entry = all.insert(all.end(), {kind, "", {}, reason, detail});
  if (std::ranges::find(entry->columns, column) == entry->columns.end()) entry->columns.push_back(column);
}

void add_block(ComparisonData& data, int experiment, const cell::Column& column) {
  const cell::Experiment& e = data.recording->experiments[experiment];
  const cell::Noise& noise = data.recording->cell.noise;
  const double sigma = noise.of(column.noise, column.joint);
  if (sigma <= 0.0) return leave_out(data.left_out, e.kind, column.name, LeftOutReason::NoiseNotStated, column.noise);
  data.blocks_of[experiment].push_back(static_cast<int>(data.blocks.size()));
  data.blocks.push_back({experiment, e.kind, e.split, column.name, noise.field_of(column.noise, column.joint),
                         column.target, sigma, data.size, e.data.values.rows(),
                         column.group == cell::orientation_group});
  data.size += e.data.values.rows();
}

/// Log(R_simulated^T R_recorded) of each row, one column an axis.
Eigen::MatrixXd rotation_residuals(const io::Table& recorded, const io::Table& predicted) {
  const auto rotation = [](const io::Table& table, Eigen::Index row) {
    double q[4];
    for (int k = 0; k < 4; ++k) q[k] = table.values(row, table.find(quaternion_columns[k]));
    return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
  };
  Eigen::MatrixXd out(recorded.values.rows(), 3);
  for (Eigen::Index row = 0; row < out.rows(); ++row)
    out.row(row) = log_rotation(rotation(predicted, row).transpose() * rotation(recorded, row)).transpose();
  return out;
}

bool has_orientation(const io::Table& table) {
  return std::all_of(std::begin(quaternion_columns), std::end(quaternion_columns),
                     [&](const char* name) { return table.find(name) >= 0; });
}

/// Removes all other blocks.
void keep_blocks(ComparisonData& data, const std::vector<bool>& kept) {
  std::vector<Block> blocks;
  data.size = 0;
  for (auto& of : data.blocks_of) of.clear();
  for (std::size_t b = 0; b < data.blocks.size(); ++b) {
    if (!kept[b]) continue;
    blocks.push_back(data.blocks[b]);
    blocks.back().first = data.size;
    data.size += blocks.back().rows;
    data.blocks_of[blocks.back().experiment].push_back(static_cast<int>(blocks.size()) - 1);
  }
  data.blocks = std::move(blocks);
  data.use = Eigen::ArrayXd::Ones(data.size);
}

}  // namespace

std::vector<int> compared_experiments(const ComparisonData& data) {
  std::vector<int> out;
  for (std::size_t e = 0; e < data.blocks_of.size(); ++e)
    if (!data.blocks_of[e].empty()) out.push_back(static_cast<int>(e));
  return out;
}

Eigen::VectorXd runs(const cell::Experiment& experiment) {
  const std::string name = cell::run_column(experiment.kind);
  const int at = name.empty() ? -1 : experiment.data.find(name);
  if (at < 0) return Eigen::VectorXd::Zero(experiment.data.values.rows());
  return experiment.data.values.col(at);
}

std::optional<cell::Recording> from_zero(const cell::Recording& recording) {
  std::map<cell::Kind, double> first;
  for (const cell::Experiment& e : recording.experiments)
    for (const io::Table* part : {&e.data, &e.lead_in})
      if (const int t = part->find("t"); t >= 0 && part->values.rows() > 0) {
        const double least = part->values.col(t).minCoeff();
        first[e.kind] = first.contains(e.kind) ? std::min(first[e.kind], least) : least;
      }
  std::erase_if(first, [](const auto& of_kind) { return std::abs(of_kind.second) < long_ago; });
  if (first.empty()) return std::nullopt;
  cell::Recording out = recording;
  for (cell::Experiment& e : out.experiments)
    if (first.contains(e.kind))
      for (io::Table* part : {&e.data, &e.lead_in})
        if (const int t = part->find("t"); t >= 0) part->values.col(t).array() -= first[e.kind];
  return out;
}

void require_joints(const cell::Recording& recording, const cell::Cell& cell) {
  const int found = cell.robot.joints(), expected = recording.cell.robot.joints();
  require(found == expected,
          "the cell has " + std::to_string(found) + " joints, the recorded cell " + std::to_string(expected));
}

std::vector<MissingSplit> missing_splits(const ComparisonData& data) {
  std::map<cell::Kind, std::set<cell::Split>> splits;
  for (const Block& block : data.blocks) splits[block.kind].insert(block.split);
  std::vector<MissingSplit> out;
  for (const auto& [kind, of_kind] : splits)
    for (const cell::Split split : {cell::Split::Fit, cell::Split::Check})
      if (!of_kind.contains(split)) out.push_back({kind, split});
  return out;
}

std::optional<io::Table> try_predict(const ComparisonData& data, const cell::Cell& cell, int experiment,
                                     std::vector<LeftOut>& refused) {
  const cell::Experiment& e = data.recording->experiments[experiment];
  try {
    return data.simulator->predict_unchecked(cell, e);
  } catch (const InvalidArgument& error) {
    refused.push_back({e.kind, e.name, {}, LeftOutReason::Refused, error.what()});
    return std::nullopt;
  }
}

bool has_column_of(const io::Table& predicted, const Block& block) {
  return block.orientation ? has_orientation(predicted) : predicted.find(block.column) >= 0;
}

void mark_unknown_directions(ComparisonData& data) {
  const int joints = data.recording->cell.robot.joints();
  const Eigen::MatrixXd structure =
      data.recording->cell.drives ? data.recording->cell.drives->structure : Eigen::MatrixXd::Identity(joints, joints);
  for (std::size_t e = 0; e < data.blocks_of.size(); ++e) {
    const cell::Experiment& experiment = data.recording->experiments[e];
    if (experiment.speed_noise.size() == 0 || experiment.kind != cell::Kind::Motion) continue;
    const Eigen::ArrayXXd known = cell::known_directions(experiment, joints);
    for (const int b : data.blocks_of[e]) {
      const Block& block = data.blocks[b];
      const int joint = cell::find_column(block.kind, block.column).joint;
      if (joint < 0 || joint >= joints || block.noise == "position") continue;
      Eigen::ArrayXd all = Eigen::ArrayXd::Ones(block.rows);
      for (int k = 0; k < joints; ++k)
        if (structure(joint, k) != 0.0 || structure(k, joint) != 0.0) all *= known.col(k);
      const bool enough = all.sum() >= least_known * static_cast<double>(block.rows);
      data.use.segment(block.first, block.rows) *= enough ? all : Eigen::ArrayXd(known.col(joint));
    }
  }
}

Eigen::VectorXd compare_nominal(ComparisonData& data) {
  std::vector<std::optional<io::Table>> tables(data.blocks_of.size());
  std::vector<bool> kept(data.blocks.size(), false);
  std::vector<LeftOut> not_predicted;  // after what is refused
  for (std::size_t e = 0; e < tables.size(); ++e) {
    if (data.blocks_of[e].empty()) continue;
    tables[e] = try_predict(data, data.recording->cell, static_cast<int>(e), data.left_out);
    for (const int b : data.blocks_of[e]) {
      const Block& block = data.blocks[b];
      kept[b] = tables[e] && has_column_of(*tables[e], block);
      if (tables[e] && !kept[b]) leave_out(not_predicted, block.kind, block.column, LeftOutReason::NotPredicted);
    }
  }
  std::ranges::move(not_predicted, std::back_inserter(data.left_out));
  keep_blocks(data, kept);
  require(!data.blocks.empty(), "the recording has no column that can be compared" +
                                    (data.left_out.empty() ? "" : ": " + left_out_text(data.left_out.front())));
  Eigen::VectorXd out = Eigen::VectorXd::Zero(data.size);
  for (std::size_t e = 0; e < tables.size(); ++e)
    if (!data.blocks_of[e].empty())
      write_residuals(data, static_cast<int>(e), compare(data, static_cast<int>(e), *tables[e]), out);
  mark_unknown_directions(data);
  return out;
}

io::Table predict(const cell::Simulator& simulator, const Setup& setup, const cell::Experiment& experiment) {
  io::Table out = simulator.predict_unchecked(setup.cell, experiment);
  for (const auto& change : setup.changes) change(out, experiment);
  return out;
}

ComparisonData compare_columns(const cell::Recording& recording, const cell::Simulator& simulator) {
  ComparisonData data;
  data.recording = &recording;
  data.simulator = &simulator;
  data.blocks_of.resize(recording.experiments.size());
  for (int e = 0; e < static_cast<int>(recording.experiments.size()); ++e) {
    const cell::Experiment& experiment = recording.experiments[e];
    for (const cell::Column& column : cell::compared_columns(experiment.kind, recording.cell.robot.joints())) {
      const bool there = column.group == cell::orientation_group ? has_orientation(experiment.data)
                                                                 : experiment.data.find(column.name) >= 0;
      if (there) add_block(data, e, column);
    }
  }
  data.use = Eigen::ArrayXd::Ones(data.size);
  return data;
}

std::vector<Eigen::VectorXd> compare(const ComparisonData& data, int experiment, const io::Table& predicted) {
  const io::Table& recorded = data.recording->experiments[experiment].data;
  require(predicted.values.rows() == recorded.values.rows(), "a simulator must return one row for each recorded row");
  std::vector<Eigen::VectorXd> out;
  Eigen::MatrixXd rotation;
  Eigen::Index axis = 0;
  const int sphere_recorded = recorded.find("sphere"), sphere_predicted = predicted.find("sphere");
  for (const int b : data.blocks_of[experiment]) {
    const Block& block = data.blocks[b];
    if (!has_column_of(predicted, block)) {
      out.emplace_back(Eigen::VectorXd::Constant(block.rows, std::numeric_limits<double>::quiet_NaN()));
      continue;
    }
    if (block.orientation) {
      if (rotation.size() == 0) rotation = rotation_residuals(recorded, predicted);
      out.emplace_back(rotation.col(axis++) / block.sigma);
      continue;
    }
    out.emplace_back(
        (recorded.values.col(recorded.find(block.column)) - predicted.values.col(predicted.find(block.column))) /
        block.sigma);
    if (block.kind == cell::Kind::Scan && sphere_recorded >= 0 && sphere_predicted >= 0)
      for (Eigen::Index row = 0; row < block.rows; ++row)
        if ((recorded.values(row, sphere_recorded) > 0.5) != (predicted.values(row, sphere_predicted) > 0.5))
          out.back()(row) = std::numeric_limits<double>::quiet_NaN();
  }
  return out;
}

std::vector<Eigen::VectorXd> compare(const ComparisonData& data, int experiment, const Setup& setup) {
  return compare(data, experiment, predict(*data.simulator, setup, data.recording->experiments[experiment]));
}

void write_residuals(const ComparisonData& data, int experiment, const std::vector<Eigen::VectorXd>& residuals,
                     Eigen::VectorXd& stacked) {
  const auto& blocks = data.blocks_of[experiment];
  for (std::size_t k = 0; k < blocks.size(); ++k) data.blocks[blocks[k]].rows_of(stacked) = residuals[k];
}

Eigen::VectorXd used_rows(const ComparisonData& data, const Block& block, const Eigen::VectorXd& residual_of_block) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  return (data.use.segment(block.first, block.rows) > 0).select(residual_of_block.array(), nan);
}

Eigen::VectorXd counted_residual(const ComparisonData& data, const Eigen::VectorXd& residual) {
  return residual.array().isNaN().select(missing_residual, residual.array()) * data.use;
}

Sum sum_of(const ComparisonData& data, const Eigen::VectorXd& counted, const Block& block) {
  return {block.rows_of(counted).squaredNorm(), data.use.segment(block.first, block.rows).sum()};
}

Sum sum_of(const ComparisonData& data, const Eigen::VectorXd& counted, cell::Split split) {
  Sum sum;
  for (const Block& block : data.blocks)
    if (block.split == split) sum += sum_of(data, counted, block);
  return sum;
}

}  // namespace kr5::gap
