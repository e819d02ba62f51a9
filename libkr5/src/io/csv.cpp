// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/csv.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include <kr5/core/error.hpp>
#include <kr5/io/node.hpp>

#include "io/utf8.hpp"

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

/// Collects rows and complaints.
class CsvParser {
 public:
  explicit CsvParser(const std::string& source) : source_(source) {}

  ParsedCsv parse(std::string_view text) {
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);  // byte-order mark of some spreadsheets
    if (!is_utf8(text)) {
      report(0, "", "bytes that are not UTF-8 text", "a text file saved as UTF-8");
      return std::move(out_);
    }
    std::vector<double> values;
    while (!text.empty()) {
      const std::string_view line = trim(take(text, '\n'));
      ++line_;
      if (line.empty()) continue;
      if (out_.table.columns.empty()) {
        if (!header(line)) return std::move(out_);
      } else if (row(line, text.empty())) {
        values.insert(values.end(), row_.begin(), row_.end());
        out_.lines.push_back(line_);
      }
    }
    finish(values);
    return std::move(out_);
  }

 private:
  void report(int line, const std::string& field, const std::string& found, const std::string& expected) {
    out_.diagnostics.push_back({source_, line, field, found, expected});
  }

  bool header(std::string_view line) {
    const std::size_t first = line.find_first_of(";\t|");
    if (first != std::string_view::npos) separator_ = line[first];
    std::vector<std::string>& columns = out_.table.columns;
    std::set<std::string> known;
    const auto count = static_cast<std::size_t>(std::count(line.begin(), line.end(), separator_)) + 1;
    for (std::size_t i = 1; i <= count; ++i) {
      std::string name(trim(take(line, separator_)));
      double value = 0;
      const std::string field = "column " + std::to_string(i);
      if (name.empty())
        report(line_, field, "no name", "a name for every column of the header");
      else if (std::from_chars(name.data(), name.data() + name.size(), value).ptr == name.data() + name.size())
        report(line_, field, "the number '" + shortened(name) + "'", "a header line of column names");
      else if (!known.insert(name).second)
        report(line_, field, "'" + shortened(name) + "' a second time", "every column once");
      columns.push_back(std::move(name));
    }
    return out_.diagnostics.empty();  // without names the rows mean nothing
  }

  bool row(std::string_view line, bool last) {
    const std::vector<std::string>& columns = out_.table.columns;
    const auto count = static_cast<std::size_t>(std::count(line.begin(), line.end(), separator_)) + 1;
    if (count != columns.size()) {
      report(line_, "", std::to_string(count) + (count == 1 ? " value" : " values"),
             std::to_string(columns.size()) + " as in the header" + (last ? "; is the file cut off?" : ""));
      return false;
    }
    row_.clear();
    for (const std::string& column : columns) {
      const std::string_view text = trim(take(line, separator_));
      double value = 0;
      if (!(separator_ == ',' ? parse_number(text, value) : parse_number(with_decimal_point(text), value))) {
        report(line_, column, "'" + shortened(text) + "'", "a finite number");
        return false;
      }
      row_.push_back(value);
    }
    return true;
  }

  void finish(const std::vector<double>& values) {
    if (out_.table.columns.empty())
      report(0, "", "an empty file", "a header line of column names and rows of numbers");
    else if (out_.lines.empty() && out_.diagnostics.empty())
      report(line_, "", "a header without rows", "rows of numbers");
    out_.table.values = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(
        values.data(), static_cast<Eigen::Index>(out_.lines.size()),
        static_cast<Eigen::Index>(out_.table.columns.size()));
  }

  /// Spreadsheets of many countries write decimal commas, and then another separator.
  static std::string with_decimal_point(std::string_view text) {
    std::string out(text);
    if (std::count(out.begin(), out.end(), ',') == 1) out[out.find(',')] = '.';
    return out;
  }

  static bool parse_number(std::string_view text, double& value) {
    if (text.starts_with('+')) text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    return !text.empty() && error == std::errc{} && end == text.data() + text.size() && std::isfinite(value);
  }

  std::string source_;
  char separator_ = ',';
  int line_ = 0;
  std::vector<double> row_;
  ParsedCsv out_;
};

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

ParsedCsv try_parse_csv(std::string_view text, const std::string& source) { return CsvParser(source).parse(text); }

Table parse_csv(std::string_view text, const std::string& source) {
  ParsedCsv parsed = try_parse_csv(text, source);
  throw_diagnostics(parsed.diagnostics);
  return std::move(parsed.table);
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
