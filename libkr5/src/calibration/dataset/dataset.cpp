// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/dataset.hpp>

#include <kr5/calibration/pose_file.hpp>

#include <algorithm>
#include <cctype>
#include <map>

#include <fnmatch.h>

#include <kr5/io/fields.hpp>
#include <kr5/io/json.hpp>

namespace kr5::calibration {
namespace {

namespace fs = std::filesystem;
using io::Node;

constexpr const char* format_name = "kr5-dataset/1";

/// Compares texts with their numbers as numbers.
bool before(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  std::size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (digit(a[i]) && digit(b[j])) {
      std::size_t i_end = i, j_end = j;
      while (i_end < a.size() && digit(a[i_end])) ++i_end;
      while (j_end < b.size() && digit(b[j_end])) ++j_end;
      while (i < i_end && a[i] == '0') ++i;
      while (j < j_end && b[j] == '0') ++j;
      if (i_end - i != j_end - j) return i_end - i < j_end - j;
      if (const int c = a.compare(i, i_end - i, b, j, j_end - j); c != 0) return c < 0;
      i = i_end, j = j_end;
    } else if (a[i] != b[j]) {
      return a[i] < b[j];
    } else {
      ++i, ++j;
    }
  }
  return a.size() - i < b.size() - j;
}

/// What the file says, before anything it names is looked at.
struct Description {
  Node images, poses;
  bool has_pairing = false;
  Dataset set;
};

std::string text_or_json(io::Reader& reader, const Node& node, const std::string& field) {
  std::string out;
  if (node.kind == Node::Kind::Map) return io::to_json(node, 0);
  reader.read(node, field, out);
  return out;
}

/// With `seen` also what a camera has to do with it is wanted.
Description read_description(io::Reader& reader, const Node& root, bool seen) {
  Description d;
  if (root.kind != Node::Kind::Map) {
    reader.report(root, "",
                  seen ? "a map with images, poses, convention, mount and target" : "a map with poses and convention");
    reader.finish();
  }
  reader.report_unknown(
      root, "",
      {"format", "images", "poses", "pairing", "convention", "mount", "target", "camera", "times", "T_flange_tool"});
  const auto wanted = [&](const char* key, const char* expected) {
    const Node* node = root.find(key);
    if (!node || node->kind == Node::Kind::Null) reader.report(root, key, expected);
    return node && node->kind != Node::Kind::Null ? *node : Node{};
  };
  std::string format = format_name;
  if (const Node* node = root.find("format"); node && reader.read(*node, "format", format) && format != format_name)
    reader.report(*node, "format", format_name);
  if (seen) d.images = wanted("images", "a pattern such as images/*.png, or a list of files");
  d.poses = wanted("poses", "a pattern such as poses/*.yaml, a list of files, or one file of rows");
  const Node convention = wanted("convention", "{position, rotation, angle, meaning}: how the robot writes its poses");
  if (convention.kind != Node::Kind::Null) reader.read(convention, "convention", d.set.convention);
  const Node mount = seen ? wanted("mount", "eye_in_hand or eye_to_hand") : Node{};
  if (mount.kind != Node::Kind::Null) reader.read(mount, "mount", d.set.mount);
  if (const Node* node = root.find("pairing")) d.has_pairing = reader.read(*node, "pairing", d.set.pairing);
  if (const Node* node = root.find("target")) d.set.target = text_or_json(reader, *node, "target");
  if (const Node* node = root.find("camera")) d.set.camera = text_or_json(reader, *node, "camera");
  if (const Node* node = root.find("times")) reader.read(*node, "times", d.set.times);
  if (const Node* node = root.find("T_flange_tool")) reader.read(*node, "T_flange_tool", d.set.T_flange_tool);
  reader.finish();
  return d;
}

/// Files that a pattern or a list names.
std::vector<fs::path> files_of(io::Reader& reader, const Node& node, const std::string& field, const fs::path& folder) {
  std::vector<std::string> names;
  std::vector<fs::path> out;
  if (node.kind == Node::Kind::Sequence) {
    if (!reader.read(node, field, names)) reader.finish();
    for (std::size_t i = 0; i < names.size(); ++i) {
      out.push_back(folder / names[i]);
      if (!fs::exists(out.back()))
        reader.report(node.items[i], field + "[" + std::to_string(i) + "]", "a file below " + folder.string());
    }
  } else {
    std::string pattern;
    if (reader.read(node, field, pattern)) out = matching_files(folder, pattern);
    if (out.empty())
      reader.report(node, field,
                    "files below " + folder.string() + "; none matches, correct the pattern or the folder");
  }
  reader.finish();
  return out;
}

std::map<long long, fs::path> by_number(const std::vector<fs::path>& files) {
  std::map<long long, fs::path> out;
  for (const fs::path& file : files) out.emplace(number_in_name(file), file);
  return out;
}

bool numbered(const std::vector<fs::path>& files) {
  const auto map = by_number(files);
  return map.size() == files.size() && !map.contains(-1);
}

std::string file_names(const std::vector<fs::path>& files) {
  std::string out;
  for (std::size_t i = 0; i < files.size() && i < 5; ++i) out += (i ? ", " : "") + files[i].filename().string();
  return out + (files.size() > 5 ? ", ..." : "");
}

/// Brings both lists into the order of their common numbers.
void pair_by_number(const std::string& source, std::vector<fs::path>& images, std::vector<fs::path>& poses) {
  const auto image_of = by_number(images), pose_of = by_number(poses);
  std::vector<fs::path> lonely_images, lonely_poses;
  for (const auto& [number, file] : image_of)
    if (!pose_of.contains(number)) lonely_images.push_back(file);
  for (const auto& [number, file] : pose_of)
    if (!image_of.contains(number)) lonely_poses.push_back(file);
  if (!lonely_images.empty())
    throw IoError(source + ": poses: " + std::to_string(lonely_images.size()) +
                  (lonely_images.size() == 1 ? " image" : " images") + " without a pose of the same number: " +
                  file_names(lonely_images) + "; add the pose, remove the image, or set 'pairing: order'");
  if (!lonely_poses.empty())
    throw IoError(source + ": images: " + std::to_string(lonely_poses.size()) +
                  (lonely_poses.size() == 1 ? " pose" : " poses") + " without an image of the same number: " +
                  file_names(lonely_poses) + "; add the image, remove the pose, or set 'pairing: order'");
  images.clear(), poses.clear();
  for (const auto& [number, file] : image_of) images.push_back(file);
  for (const auto& [number, file] : pose_of) poses.push_back(file);
}

void add_poses(const fs::path& file, const PoseFile& read, Dataset& set) {
  const Eigen::Index at = set.rows.rows();
  if (at > 0 && set.rows.cols() != read.rows.cols())
    throw IoError(file.string() + ": found " + std::to_string(read.rows.cols()) + " numbers, expected " +
                  std::to_string(set.rows.cols()) + " as in the other poses");
  set.rows.conservativeResize(at + read.rows.rows(), read.rows.cols());
  set.rows.bottomRows(read.rows.rows()) = read.rows;
  for (const int line : read.lines)
    set.pose_sources.push_back(file.string() + (read.lines.size() > 1 ? ":" + std::to_string(line) : ""));
  set.times.insert(set.times.end(), read.times.begin(), read.times.end());
}

void check_counts(const std::string& source, const Dataset& set) {
  const std::string images = std::to_string(set.images.size()), poses = std::to_string(set.rows.rows());
  if (set.images.size() != set.pose_sources.size())
    throw IoError(source + ": poses: found " + poses + " poses for " + images +
                  " images, expected one for each; add what is missing, or list the files that belong together");
  if (!set.times.empty() && set.times.size() != set.images.size())
    throw IoError(source + ": times: found " + std::to_string(set.times.size()) + " for " + images +
                  " images, expected one for each or none");
}

void check_convention(const std::string& source, const Dataset& set) {
  try {
    to_poses(set.rows, set.convention);
  } catch (const InvalidArgument& e) {
    throw IoError(source + ": convention: " + e.what());
  }
}

}  // namespace

std::vector<Pose> Dataset::poses() const {
  std::vector<Pose> out = to_poses(rows, convention);
  if (T_flange_tool)
    for (Pose& T : out) T = T * T_flange_tool->inverse();
  return out;
}

long long number_in_name(const fs::path& file) {
  const std::string stem = file.stem().string();
  std::size_t end = stem.size();
  const auto digit = [&](std::size_t i) { return std::isdigit(static_cast<unsigned char>(stem[i])) != 0; };
  while (end > 0 && !digit(end - 1)) --end;
  std::size_t begin = end;
  while (begin > 0 && digit(begin - 1)) --begin;
  return end == 0 || end - begin > 17 ? -1 : std::stoll(stem.substr(begin, end - begin));
}

std::vector<fs::path> matching_files(const fs::path& folder, const std::string& pattern) {
  const fs::path full = folder / pattern;
  std::vector<fs::path> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(full.parent_path(), error))
    if (entry.is_regular_file(error) && fnmatch(full.filename().c_str(), entry.path().filename().c_str(), 0) == 0)
      out.push_back(entry.path());
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return before(a.string(), b.string()); });
  return out;
}

Dataset load_dataset(const fs::path& file, const fs::path& folder) {
  const fs::path base = folder.empty() ? file.parent_path() : folder;
  io::Reader reader(file.string());
  Description d = read_description(reader, io::load_yaml(file), true);
  Dataset& set = d.set;
  std::vector<fs::path> images = files_of(reader, d.images, "images", base);
  std::vector<fs::path> poses = files_of(reader, d.poses, "poses", base);
  const bool one_file = poses.size() == 1 && images.size() > 1;
  if (!d.has_pairing) set.pairing = !one_file && numbered(images) && numbered(poses) ? Pairing::Number : Pairing::Order;
  if (set.pairing == Pairing::Number && !one_file) {
    if (!numbered(images) || !numbered(poses))
      throw IoError(file.string() +
                    ": pairing: found file names without a number, or two of one number, expected one "
                    "number in each; set 'pairing: order'");
    pair_by_number(file.string(), images, poses);
  }
  for (const fs::path& pose : poses) add_poses(pose, load_poses(pose, set.convention.rotation), set);
  for (const fs::path& image : images) set.images.push_back(image.string());
  check_counts(file.string(), set);
  check_convention(file.string(), set);
  if (!set.camera.empty() && set.camera.front() != '{' && fs::path(set.camera).is_relative())
    set.camera = (base / set.camera).string();
  return std::move(d.set);
}

Dataset load_pose_set(const fs::path& file, const fs::path& folder) {
  io::Reader reader(file.string());
  Description d = read_description(reader, io::load_yaml(file), false);
  for (const fs::path& pose : files_of(reader, d.poses, "poses", folder.empty() ? file.parent_path() : folder))
    add_poses(pose, load_poses(pose, d.set.convention.rotation), d.set);
  check_convention(file.string(), d.set);
  return std::move(d.set);
}

}  // namespace kr5::calibration
