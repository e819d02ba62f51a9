// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/predict/prediction_table.hpp>

namespace kr5::predict {

using Eigen::Index;

void PredictionTable::add_each(const std::string& name, const Eigen::MatrixXd& values) {
  for (Index i = 0; i < values.cols(); ++i) add(name + std::to_string(i + 1), values.col(i));
}

void PredictionTable::add_wrench(const Eigen::MatrixXd& wrench) {
  Index i = 0;
  for (const char* name : {"fx", "fy", "fz", "tx", "ty", "tz"}) add(name, wrench.col(i++));
}

io::Table PredictionTable::table() const {
  io::Table out;
  out.values.resize(rows_, static_cast<Index>(columns_.size()));
  for (const auto& [name, values] : columns_) {
    out.values.col(static_cast<Index>(out.columns.size())) = values;
    out.columns.push_back(name);
  }
  return out;
}

}  // namespace kr5::predict
