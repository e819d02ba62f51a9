// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/experiment_input.hpp>

#include <cmath>

namespace kr5::predict {

using Eigen::Index;

ExperimentInput::ExperimentInput(const cell::Experiment& experiment, int joints)
    : experiment_(experiment), joints_(joints) {
  if (rows() == 0) fail("has no rows");
  for (const cell::Column& column : cell::columns(experiment.kind, joints)) {
    if (column.role != cell::Role::Given || (!column.group.empty() && !has(column.name))) continue;
    const auto values = (*this)[column.name];
    for (Index i = 0; i < rows(); ++i)
      if (!std::isfinite(values[i]))
        fail("column '" + column.name + "', row " + std::to_string(i + 1) + ": found " + std::to_string(values[i]) +
             ", expected a finite number");
  }
}

Eigen::MatrixXd::ConstColXpr ExperimentInput::operator[](const std::string& column) const {
  const int at = experiment_.data.find(column);
  if (at < 0) fail("has no column '" + column + "', which is given in this kind of experiment");
  return experiment_.data.values.col(at);
}

Eigen::MatrixXd ExperimentInput::joints(const std::string& name) const {
  Eigen::MatrixXd out(rows(), joints_);
  for (int i = 0; i < joints_; ++i) out.col(i) = (*this)[name + std::to_string(i + 1)];
  return out;
}

std::vector<physics::RowRange> ExperimentInput::runs() const {
  const std::string name = cell::run_column(experiment_.kind);
  if (name.empty()) return {{0, rows()}};
  const auto run = (*this)[name];
  std::vector<physics::RowRange> out = {{0, 1}};
  for (Index i = 1; i < rows(); ++i) {
    if (run[i] != run[i - 1]) out.push_back({i, i});
    out.back().last = i + 1;
  }
  return out;
}

void ExperimentInput::need(bool there, const std::string& part) const {
  if (!there)
    fail("needs '" + part + "', which the cell does not have; add it to the cell, or leave out this " +
         std::string(name_of(experiment_.kind)) + " experiment");
}

void ExperimentInput::fail(const std::string& what) const {
  throw InvalidArgument("experiment '" + experiment_.name + "' (" + std::string(name_of(experiment_.kind)) +
                        "): " + what);
}

}  // namespace kr5::predict
