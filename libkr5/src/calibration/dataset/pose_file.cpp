// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/pose_file.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>

#include <kr5/calibration/pose_columns.hpp>
#include <kr5/io/csv.hpp>
#include <kr5/io/fields.hpp>

namespace kr5::calibration {
namespace {

using io::Node;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

std::string names_of(RotationForm rotation) {
  std::string out;
  for (const auto& spellings : pose_column_names(rotation)) out += (out.empty() ? "" : " ") + spellings.front();
  return rotation == RotationForm::Matrix ? "12 or 16 numbers of a matrix" : out;
}

bool right_length(std::size_t n, RotationForm rotation) {
  return static_cast<int>(n) == row_length(rotation) || (rotation == RotationForm::Matrix && n == 16);
}

[[noreturn]] void wrong_length(const std::string& where, std::size_t found, RotationForm rotation) {
  throw IoError(where + ": found " + std::to_string(found) + " numbers, expected " +
                std::to_string(row_length(rotation)) + (rotation == RotationForm::Matrix ? " or 16" : "") + " for '" +
                std::string(name_of(rotation)) + "' (" + names_of(rotation) +
                "); correct the row, or convention.rotation");
}

void add_row(PoseFile& out, const std::vector<double>& row, int line, const std::string& where, RotationForm rotation) {
  if (!right_length(row.size(), rotation)) wrong_length(where, row.size(), rotation);
  const Eigen::Index at = out.rows.rows();
  out.rows.conservativeResize(at + 1, static_cast<Eigen::Index>(row.size()));
  out.rows.row(at) = Eigen::Map<const Eigen::RowVectorXd>(row.data(), static_cast<Eigen::Index>(row.size()));
  out.lines.push_back(line);
}

/// Every number below a node, in order.
void flatten(io::Reader& reader, const Node& node, const std::string& field, std::vector<double>& out) {
  if (node.kind == Node::Kind::Sequence) {
    for (std::size_t i = 0; i < node.items.size(); ++i)
      flatten(reader, node.items[i], field + "[" + std::to_string(i) + "]", out);
    return;
  }
  if (double value = 0; reader.read(node, field, value)) out.push_back(value);
}

/// Scalars of a map and of the maps in it, by lower-case name; `orientation: {x: ...}` becomes qx.
void collect(const Node& node, const std::string& prefix, std::vector<std::pair<std::string, const Node*>>& out) {
  for (const auto& [key, entry] : node.entries) {
    const std::string name = lower(key);
    const bool quaternion = name == "orientation" || name == "rotation" || name == "quaternion";
    if (entry.kind == Node::Kind::Map)
      collect(entry, quaternion ? "q" : "", out);
    else
      out.emplace_back(prefix == "q" && name.size() == 1 ? "q" + name : name, &entry);
  }
}

void read_map(io::Reader& reader, const Node& root, RotationForm rotation, PoseFile& out) {
  const std::string& file = reader.file();
  if (const Node* data = root.find("data"); data && root.find("rows") && root.find("cols")) {
    std::vector<double> row;
    flatten(reader, *data, "data", row);
    reader.finish();
    return add_row(out, row, root.line, file, rotation);
  }
  std::vector<std::pair<std::string, const Node*>> found;
  collect(root, "", found);
  std::vector<double> row;
  std::string missing;
  for (const auto& spellings : pose_column_names(rotation)) {
    const auto at = std::find_if(found.begin(), found.end(), [&](const auto& f) {
      return std::find(spellings.begin(), spellings.end(), f.first) != spellings.end();
    });
    if (at == found.end())
      missing += (missing.empty() ? "" : ", ") + spellings.front();
    else if (double value = 0; reader.read(*at->second, at->first, value))
      row.push_back(value);
  }
  reader.finish();
  if (!missing.empty() || rotation == RotationForm::Matrix)
    throw IoError(file + ": found no " + (missing.empty() ? "list of numbers" : missing) + ", expected " +
                  names_of(rotation) + " for '" + std::string(name_of(rotation)) +
                  "'; add them, or correct convention.rotation");
  add_row(out, row, root.line, file, rotation);
}

void read_list(io::Reader& reader, const Node& root, RotationForm rotation, PoseFile& out) {
  std::vector<double> all;
  const bool nested = !root.items.empty() && root.items[0].kind != Node::Kind::Scalar;
  // A matrix of its own, or a list of rows?
  const bool one = !nested || (rotation == RotationForm::Matrix && root.items.size() <= 4 &&
                               root.items[0].items.size() == 4 && root.items[0].items[0].kind == Node::Kind::Scalar);
  if (one) {
    flatten(reader, root, "", all);
    reader.finish();
    return add_row(out, all, root.line, reader.file(), rotation);
  }
  for (const Node& item : root.items) {
    if (item.kind == Node::Kind::Map) {
      read_map(reader, item, rotation, out);
      continue;
    }
    std::vector<double> row;
    flatten(reader, item, "", row);
    reader.finish();
    add_row(out, row, item.line, reader.file() + ":" + std::to_string(item.line), rotation);
  }
}

PoseFile read_tree(const std::filesystem::path& file, RotationForm rotation) {
  const Node root = io::load_yaml(file);
  io::Reader reader(file.string());
  PoseFile out;
  if (root.kind == Node::Kind::Map)
    read_map(reader, root, rotation, out);
  else if (root.kind == Node::Kind::Sequence)
    read_list(reader, root, rotation, out);
  else
    throw IoError(file.string() + ": found no pose, expected " + names_of(rotation));
  return out;
}

PoseFile read_csv(const std::filesystem::path& file, RotationForm rotation) {
  const io::Table table = io::load_csv(file);
  const std::vector<int> columns = find_pose_columns(table.columns, rotation);
  PoseFile out;
  if (columns.empty() || std::find(columns.begin(), columns.end(), -1) != columns.end()) {
    if (!right_length(table.columns.size(), rotation)) {
      std::string all;
      for (const std::string& c : table.columns) all += " " + c;
      throw IoError(file.string() + ":1: found the columns" + all + ", expected " + names_of(rotation) + " for '" +
                    std::string(name_of(rotation)) + "'; rename them, or correct convention.rotation");
    }
    out.rows = table.values;
  } else {
    out.rows = table.values(Eigen::all, columns);
  }
  for (int i = 0; i < out.rows.rows(); ++i) out.lines.push_back(i + 2);
  for (std::size_t c = 0; c < table.columns.size(); ++c)
    if (const std::string name = lower(table.columns[c]); name == "t" || name == "time" || name == "stamp")
      out.times.assign(table.values.col(static_cast<Eigen::Index>(c)).begin(),
                       table.values.col(static_cast<Eigen::Index>(c)).end());
  return out;
}

/// Whether commas are decimal ones: semicolons or tabs part single numbers, of which some have one comma.
bool has_decimal_commas(const std::string& line) {
  if (line.find_first_of(";\t") == std::string::npos) return false;
  std::string part;
  std::istringstream words(line);
  while (std::getline(words, part, line.find(';') != std::string::npos ? ';' : '\t')) {
    part.erase(0, part.find_first_not_of(" \t"));
    part.erase(part.find_last_not_of(" \t\r") + 1);
    if (std::count(part.begin(), part.end(), ',') > 1 || part.find_first_of(" \t") != std::string::npos) return false;
  }
  return true;
}

/// Numbers of one line of text; commas, semicolons and brackets count as blanks.
std::vector<double> numbers(std::string line, const std::string& where) {
  if (has_decimal_commas(line)) std::replace(line.begin(), line.end(), ',', '.');
  for (char& c : line)
    if (std::string_view(",;[]()\t\r").find(c) != std::string_view::npos) c = ' ';
  std::istringstream words(line.substr(0, line.find('#')));
  std::vector<double> out;
  for (std::string word; words >> word;) {
    double value = 0;
    const char* begin = word.data() + (word[0] == '+');
    const auto [end, error] = std::from_chars(begin, word.data() + word.size(), value);
    if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value))
      throw IoError(where + ": found '" + word + "', expected a finite number");
    out.push_back(value);
  }
  return out;
}

PoseFile read_plain(const std::filesystem::path& file, RotationForm rotation) {
  std::istringstream text(io::read_text(file));
  std::vector<std::pair<int, std::vector<double>>> rows;
  int number = 0;
  std::vector<double> all;
  for (std::string line; std::getline(text, line);) {
    ++number;
    std::vector<double> row = numbers(line, file.string() + ":" + std::to_string(number));
    if (row.empty()) continue;
    all.insert(all.end(), row.begin(), row.end());
    rows.emplace_back(number, std::move(row));
  }
  if (rows.empty()) throw IoError(file.string() + ": found no numbers, expected " + names_of(rotation));
  PoseFile out;
  // One pose over several lines, such as a 4x4 matrix or one number a line.
  if (!right_length(rows[0].second.size(), rotation) && right_length(all.size(), rotation)) {
    add_row(out, all, 1, file.string(), rotation);
    return out;
  }
  for (const auto& [line, row] : rows) {
    if (row.size() != rows[0].second.size())
      wrong_length(file.string() + ":" + std::to_string(line), row.size(), rotation);
    add_row(out, row, line, file.string() + ":" + std::to_string(line), rotation);
  }
  return out;
}

/// Whether a table has no names of columns.
bool begins_with_number(const std::filesystem::path& file) {
  std::istringstream text(io::read_text(file));
  for (std::string line; std::getline(text, line);) {
    const std::size_t first = line.find_first_not_of(" \t\r\xEF\xBB\xBF");
    if (first == std::string::npos || line[first] == '#') continue;
    return std::string_view("+-.0123456789").find(line[first]) != std::string_view::npos;
  }
  return false;
}

}  // namespace

PoseFile load_poses(const std::filesystem::path& file, RotationForm rotation) {
  const std::string ending = lower(file.extension().string());
  if (ending == ".csv") return begins_with_number(file) ? read_plain(file, rotation) : read_csv(file, rotation);
  if (ending == ".yaml" || ending == ".yml" || ending == ".json") return read_tree(file, rotation);
  return read_plain(file, rotation);
}

}  // namespace kr5::calibration
