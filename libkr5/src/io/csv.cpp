// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/csv.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>

namespace kr5::io {
namespace {

std::string_view trim(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

/// Takes everything up to the next `separator` off the front of `rest`.
std::string_view take(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view part = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view{} : rest.substr(end + 1);
  return part;
}

[[noreturn]] void fail(const std::string& source, std::size_t line, const std::string& what) {
  throw IoError(source + ":" + std::to_string(line) + ": " + what);
}

std::vector<std::string> parse_header(std::string_view line, const std::string& source, std::size_t number) {
  std::vector<std::string> columns;
  const auto count = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
  for (std::size_t i = 0; i < count; ++i) {
    std::string name(trim(take(line, ',')));
    double value = 0;
    if (name.empty()) fail(source, number, "column " + std::to_string(i + 1) + " of the header has no name");
    if (std::from_chars(name.data(), name.data() + name.size(), value).ptr == name.data() + name.size())
      fail(source, number, "found the number '" + name + "' in the header, expected a line of column names");
    if (std::find(columns.begin(), columns.end(), name) != columns.end())
      fail(source, number, "the column '" + name + "' stands in the header twice");
    columns.push_back(std::move(name));
  }
  return columns;
}

double parse_value(std::string_view text, const std::string& column, const std::string& source, std::size_t line) {
  text = trim(text);
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value))
    fail(source, line, column + ": found '" + std::string(text) + "', expected a finite number");
  return value;
}

}  // namespace

int Table::find(std::string_view name) const {
  const auto found = std::find(columns.begin(), columns.end(), name);
  return found == columns.end() ? -1 : static_cast<int>(found - columns.begin());
}

Eigen::VectorXd Table::column(std::string_view name) const {
  const int index = find(name);
  if (index >= 0) return values.col(index);
  std::string all;
  for (const std::string& c : columns) all += (all.empty() ? "" : ", ") + c;
  throw InvalidArgument("no column '" + std::string(name) + "'; there are " + all);
}

Table parse_csv(std::string_view text, const std::string& source) {
  Table table;
  std::vector<double> values;
  std::size_t line_number = 0, rows = 0;
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte-order mark of some spreadsheets
  while (!text.empty()) {
    std::string_view line = trim(take(text, '\n'));
    ++line_number;
    if (line.empty()) continue;
    if (table.columns.empty()) {
      table.columns = parse_header(line, source, line_number);
      continue;
    }
    const auto found = static_cast<std::size_t>(std::count(line.begin(), line.end(), ',')) + 1;
    if (found != table.columns.size())
      fail(source, line_number, "found " + std::to_string(found) + " values, expected " +
                                    std::to_string(table.columns.size()) + " as in the header" +
                                    (text.empty() ? "; is the file cut off?" : ""));
    for (const std::string& column : table.columns)
      values.push_back(parse_value(take(line, ','), column, source, line_number));
    ++rows;
  }
  if (table.columns.empty()) throw IoError(source + ": the file is empty, expected a header line and rows of numbers");
  if (rows == 0) throw IoError(source + ": a header without rows");
  table.values = Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
      values.data(), static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(table.columns.size()));
  return table;
}

Table load_csv(const std::filesystem::path& file) { return parse_csv(read_text(file), file.string()); }

void save_csv(const Table& table, const std::filesystem::path& file) {
  require(table.values.cols() == static_cast<Eigen::Index>(table.columns.size()),
          "save_csv: the table has " + std::to_string(table.values.cols()) + " columns of values and " +
              std::to_string(table.columns.size()) + " names");
  std::string text;
  for (const std::string& name : table.columns) text += (text.empty() ? "" : ",") + name;
  text += '\n';
  char buffer[64];
  for (Eigen::Index r = 0; r < table.values.rows(); ++r)
    for (Eigen::Index c = 0; c < table.values.cols(); ++c) {
      text.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, table.values(r, c)).ptr);
      text += c + 1 == table.values.cols() ? '\n' : ',';
    }
  write_text(file, text);
}

}  // namespace kr5::io
