// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <kr5/io/diagnostic.hpp>

namespace kr5::io {

/// A table of numbers with named columns.
struct Table {
  std::vector<std::string> columns;
  Eigen::MatrixXd values;  ///< One row a line, one column a name.

  /// Position of a column, or -1.
  int find(std::string_view name) const;
  /// @throws InvalidArgument naming the column and those there are.
  Eigen::VectorXd column(std::string_view name) const;
};

/// A table with the line each row stood on, and all that was wrong. Rows with a problem are left out.
struct ParsedCsv {
  Table table;
  std::vector<int> lines;
  std::vector<Diagnostic> diagnostics;
};
ParsedCsv try_parse_csv(std::string_view text, const std::string& source);

/// Reads numbers under a header line, parted by commas, semicolons, tabs or bars. Blank lines are passed over.
/// @throws IoError with file, line and remedy of everything that is wrong: missing or empty file, no header, a
/// duplicate or empty column name,
///         a row with too few or too many values, a value that is no finite number (NaN and inf are refused).
Table load_csv(const std::filesystem::path& file);
Table parse_csv(std::string_view text, const std::string& source);
/// Writes numbers so that they read back exactly.
void save_csv(const Table& table, const std::filesystem::path& file);

}  // namespace kr5::io
