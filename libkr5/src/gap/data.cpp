// SPDX-License-Identifier: BSD-3-Clause
#include "gap/data.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Geometry>

#include <kr5/core/error.hpp>

namespace kr5::gap {
namespace {

constexpr const char* rotation_columns[] = {"rx", "ry", "rz"};
constexpr const char* quaternion_columns[] = {"qw", "qx", "qy", "qz"};

double declared(const cell::Noise& noise, const std::string& key) {
  double value = 0.0;
  cell::Noise::each_field(noise, [&](const char* name, const double& sigma, const char*) {
    if (key == name) value = sigma;
  });
  return value;
}

void add_block(Data& data, int experiment, const std::string& column, const std::string& noise) {
  const cell::Experiment& e = data.recording->experiments[experiment];
  const double sigma = declared(data.recording->cell.noise, noise);
  if (sigma <= 0.0) return;
  data.blocks_of[experiment].push_back(static_cast<int>(data.blocks.size()));
  data.blocks.push_back({experiment, e.kind, e.split, column, noise, sigma, data.size, e.data.values.rows()});
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

}  // namespace

io::Table predict(const cell::Simulator& simulator, const Setup& setup, const cell::Experiment& experiment) {
  io::Table out = simulator.predict(setup.cell, experiment);
  for (const auto& change : setup.changes) change(out, experiment);
  return out;
}

Data make_data(const cell::Recording& recording, const cell::Simulator& simulator) {
  Data data;
  data.recording = &recording;
  data.simulator = &simulator;
  data.blocks_of.resize(recording.experiments.size());
  for (int e = 0; e < static_cast<int>(recording.experiments.size()); ++e) {
    const cell::Experiment& experiment = recording.experiments[e];
    for (const cell::Column& column : cell::columns(experiment.kind, recording.cell.robot.joints())) {
      if (column.role != cell::Role::Predicted || column.noise.empty() || experiment.data.find(column.name) < 0)
        continue;
      if (column.group != "orientation")
        add_block(data, e, column.name, column.noise);
      else if (column.name == quaternion_columns[0])
        for (const char* name : rotation_columns) add_block(data, e, name, column.noise);
    }
  }
  data.use = Eigen::ArrayXd::Ones(data.size);
  return data;
}

std::vector<Eigen::VectorXd> compare(const Data& data, int experiment, const io::Table& predicted) {
  const io::Table& recorded = data.recording->experiments[experiment].data;
  require(predicted.values.rows() == recorded.values.rows(), "a simulator must return a row for each row recorded");
  std::vector<Eigen::VectorXd> out;
  Eigen::MatrixXd rotation;
  const int sphere_recorded = recorded.find("sphere"), sphere_predicted = predicted.find("sphere");
  for (const int b : data.blocks_of[experiment]) {
    const Block& block = data.blocks[b];
    if (block.kind == cell::Kind::Poses && block.column.size() == 2 && block.column[0] == 'r') {
      if (rotation.size() == 0) rotation = rotation_residuals(recorded, predicted);
      out.emplace_back(rotation.col(block.column[1] - 'x') / block.sigma);
      continue;
    }
    const int at = predicted.find(block.column);
    if (at < 0) {
      out.emplace_back(Eigen::VectorXd::Zero(block.rows));  // nothing to compare with
      continue;
    }
    out.emplace_back((recorded.values.col(recorded.find(block.column)) - predicted.values.col(at)) / block.sigma);
    if (block.kind == cell::Kind::Scan && sphere_recorded >= 0 && sphere_predicted >= 0)
      for (Eigen::Index row = 0; row < block.rows; ++row)
        if ((recorded.values(row, sphere_recorded) > 0.5) != (predicted.values(row, sphere_predicted) > 0.5))
          out.back()(row) = std::numeric_limits<double>::quiet_NaN();
  }
  return out;
}

std::vector<Eigen::VectorXd> compare(const Data& data, int experiment, const Setup& setup) {
  return compare(data, experiment, predict(*data.simulator, setup, data.recording->experiments[experiment]));
}

void put(const Data& data, int experiment, const std::vector<Eigen::VectorXd>& residuals, Eigen::VectorXd& stacked) {
  const auto& blocks = data.blocks_of[experiment];
  for (std::size_t k = 0; k < blocks.size(); ++k) data.blocks[blocks[k]].of(stacked) = residuals[k];
}

Eigen::VectorXd counted(const Data& data, const Eigen::VectorXd& residual) {
  return residual.array().isNaN().select(missed, residual.array()) * data.use;
}

Sum sum_of(const Data& data, const Eigen::VectorXd& counted, cell::Split split) {
  Sum sum;
  for (const Block& block : data.blocks) {
    if (block.split != split) continue;
    sum.chi2 += block.of(counted).squaredNorm();
    sum.samples += data.use.segment(block.first, block.rows).sum();
  }
  return sum;
}

}  // namespace kr5::gap
