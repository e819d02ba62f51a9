// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <kr5/io/csv.hpp>

namespace kr5::predict {

/// Predicted columns, in the order of the file.
class PredictionTable {
 public:
  explicit PredictionTable(Eigen::Index rows) : rows_(rows) {}
  void add(const std::string& name, Eigen::VectorXd values) { columns_.emplace_back(name, std::move(values)); }
  void add_each(const std::string& name, const Eigen::MatrixXd& values);
  void add_wrench(const Eigen::MatrixXd& wrench);
  io::Table table() const;

 private:
  Eigen::Index rows_;
  std::vector<std::pair<std::string, Eigen::VectorXd>> columns_;
};

}  // namespace kr5::predict
