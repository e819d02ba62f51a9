// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/core/error.hpp>
#include <kr5/physics/row_range.hpp>

namespace kr5::predict {

/// The given columns of an experiment, which are what a simulator starts from: all there and finite.
class ExperimentInput {
 public:
  /// Keeps a reference to the experiment. @throws InvalidArgument naming the column that is not there or not finite.
  ExperimentInput(const cell::Experiment& experiment, int joints);

  Eigen::Index rows() const { return experiment_.data.values.rows(); }
  Eigen::MatrixXd::ConstColXpr operator[](const std::string& column) const;
  /// Columns name1 .. namen, one row a sample.
  Eigen::MatrixXd joints(const std::string& name) const;
  /// Whether the experiment has a column, also one to be predicted.
  bool has(const std::string& column) const { return experiment_.data.find(column) >= 0; }
  cell::JointReference joint_reference() const { return experiment_.joint_reference; }
  /// Consecutive rows of one run, line, view or pose.
  std::vector<physics::RowRange> runs() const;
  /// @throws InvalidArgument naming a part of the cell that this experiment needs, when it is not there.
  void need(bool there, const std::string& part) const;
  /// @throws InvalidArgument naming the experiment.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  const cell::Experiment& experiment_;
  int joints_;
};

}  // namespace kr5::predict
