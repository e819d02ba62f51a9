// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/core/error.hpp>

namespace kr5::predict {

/// Rows [first, last) of one run.
struct Run {
  Eigen::Index first = 0;
  Eigen::Index last = 0;
};

/// The given columns of an experiment, all there and finite.
class Given {
 public:
  Given(const cell::Experiment& experiment, int joints);

  Eigen::Index rows() const { return experiment_.data.values.rows(); }
  Eigen::MatrixXd::ConstColXpr operator[](const std::string& column) const;
  /// Columns name1 .. namen, one row a sample.
  Eigen::MatrixXd joints(const std::string& name) const;
  /// Consecutive rows of one run, line, view or pose.
  std::vector<Run> runs() const;
  /// A complaint about a part of the cell that this experiment needs.
  void need(bool there, const std::string& part) const;
  /// Throws InvalidArgument naming the experiment.
  [[noreturn]] void fail(const std::string& what) const;

 private:
  const cell::Experiment& experiment_;
  int joints_;
};

/// Predicted columns, in the order of the file.
class Shown {
 public:
  explicit Shown(Eigen::Index rows) : rows_(rows) {}
  void add(const std::string& name, Eigen::VectorXd values) { columns_.emplace_back(name, std::move(values)); }
  void add_each(const std::string& name, const Eigen::MatrixXd& values);
  void add_wrench(const Eigen::MatrixXd& wrench);
  io::Table table() const;

 private:
  Eigen::Index rows_;
  std::vector<std::pair<std::string, Eigen::VectorXd>> columns_;
};

}  // namespace kr5::predict
