// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/io/csv.hpp>

namespace kr5::sim {

/// Table of named columns that grows by a row at a time.
class RowTable {
 public:
  explicit RowTable(std::vector<std::string> columns) : columns_(std::move(columns)) {}
  void add(std::vector<double> row) { rows_.push_back(std::move(row)); }
  io::Table table() const;

 private:
  std::vector<std::string> columns_;
  std::vector<std::vector<double>> rows_;
};

}  // namespace kr5::sim
