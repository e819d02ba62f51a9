// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/io/csv.hpp>

#include "conversion.hpp"

/// @file
/// Tables of columns as dicts of arrays, for functions of Python that change them.

namespace kr5::python {

/// Columns as a dict of arrays.
inline py::dict columns_to_dict(const io::Table& table) {
  py::dict out;
  for (std::size_t i = 0; i < table.columns.size(); ++i)
    out[py::str(table.columns[i])] = Eigen::VectorXd(table.values.col(static_cast<Eigen::Index>(i)));
  return out;
}

/// Puts changed columns back.
inline void put_back_columns(io::Table& table, const py::dict& columns) {
  for (const auto& [name, values] : columns) {
    const std::string key = py::str(name), where = "change: column '" + key + "'";
    const int at = table.find(key);
    if (at < 0) throw py::value_error(where + " is none that the simulator predicts");
    const auto numbers = cast_or_complain<Eigen::VectorXd>(values, where);
    if (numbers.size() != table.values.rows())
      throw py::value_error(where + ": found " + std::to_string(numbers.size()) + " rows, expected " +
                            std::to_string(table.values.rows()));
    table.values.col(at) = numbers;
  }
}

}  // namespace kr5::python
