// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/target.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <sstream>

#include <kr5/core/error.hpp>
#include <kr5/geometry/marker_family.hpp>

namespace kr5 {
namespace {

constexpr const char* forms =
    "expected one of\n"
    "  chessboard:ROWSxCOLS:SQUARE            inner corners, e.g. chessboard:6x9:0.0236\n"
    "  circles:ROWSxCOLS:DISTANCE             e.g. circles:10x10:0.0254\n"
    "  tag:FAMILY:ID:SIDE                     e.g. tag:36h11:10:0.048\n"
    "  grid:FAMILY:ROWSxCOLS:SIDE:GAP[:FIRST] e.g. grid:36h11:5x7:0.03:0.01\n"
    "  charuco:FAMILY:ROWSxCOLS:SQUARE:MARKER e.g. charuco:aruco_6x6_250:7x5:0.036195:0.018256\n"
    "with lengths in metres";

[[noreturn]] void bad_form(const std::string& text, const std::string& why) {
  throw InvalidArgument("target '" + text + "': " + why + "; " + forms);
}

/// Reads one short form piece by piece and complains with the whole of it.
class Reader {
 public:
  explicit Reader(const std::string& text) : text_(text) {
    std::istringstream stream(text);
    for (std::string part; std::getline(stream, part, ':');) parts_.push_back(part);
  }
  bool more() const { return next_ < parts_.size(); }
  std::string word(const char* what) {
    if (!more() || parts_[next_].empty()) bad_form(text_, std::string(what) + " is missing");
    return parts_[next_++];
  }
  template <class T>
  T number(const char* what) {
    return convert<T>(word(what), what);
  }
  void size(Target& target) {
    const std::string s = word("ROWSxCOLS");
    const auto x = s.find('x');
    if (x == std::string::npos) bad_form(text_, "'" + s + "' is not a size such as 6x9");
    target.rows = convert<int>(s.substr(0, x), "the number of rows");
    target.cols = convert<int>(s.substr(x + 1), "the number of columns");
  }
  void finish() const {
    if (more()) bad_form(text_, "'" + parts_[next_] + "' is one part too many");
  }

 private:
  template <class T>
  T convert(const std::string& s, const char* what) const {
    T value{};
    const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
    if (error != std::errc() || end != s.data() + s.size())
      bad_form(text_, "'" + s + "' is not a number (" + what + ")");
    return value;
  }
  std::string text_;
  std::vector<std::string> parts_;
  std::size_t next_ = 0;
};

Pose at(double x, double y) {
  Pose T = Pose::Identity();
  T.translation() = Eigen::Vector3d(x, y, 0);
  return T;
}

/// Points of a regular grid with `rows` x `cols` points `pitch` apart, the first one at (offset, offset).
TargetPoints grid_points(int rows, int cols, double pitch, double offset) {
  TargetPoints out{Eigen::Matrix3Xd(3, rows * cols), {}};
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < cols; ++c) {
      out.points.col(r * cols + c) = Eigen::Vector3d(offset + c * pitch, offset + r * pitch, 0);
      out.ids.push_back(r * cols + c);
    }
  return out;
}

std::vector<MapMarker> charuco_markers(const Target& t) {
  std::vector<MapMarker> markers;
  const int white = t.legacy && t.rows % 2 == 0 ? 0 : 1;  // parity of row + column of the squares with a marker
  for (int r = 0; r < t.rows; ++r)
    for (int c = 0; c < t.cols; ++c)
      if ((r + c) % 2 == white)
        markers.push_back(
            {t.first_id + static_cast<int>(markers.size()), t.marker, at((c + 0.5) * t.size, (r + 0.5) * t.size)});
  return markers;
}

bool has_markers(TargetKind kind) { return kind != TargetKind::Chessboard && kind != TargetKind::CircleGrid; }

/// Collects what is wrong with a target.
class Problems {
 public:
  void expect(bool condition, const std::string& field, const std::string& expected, const std::string& found) {
    if (!condition) list_.push_back({field, expected, found});
  }
  void expect(bool condition, const std::string& field, const std::string& expected, double found) {
    std::ostringstream text;
    text << found;
    expect(condition, field, expected, text.str());
  }
  void length(double value, const std::string& field) {
    expect(std::isfinite(value) && value > 0, field, "a positive length [m]", value);
  }
  bool none() const { return list_.empty(); }
  std::vector<TargetProblem> take() { return std::move(list_); }

 private:
  std::vector<TargetProblem> list_;
};

void check_sizes(const Target& t, Problems& p) {
  p.length(t.size, "size");
  if (t.kind == TargetKind::Tag) return;
  const int least = t.kind == TargetKind::TagGrid ? 1 : 2, most = 1000;
  const std::string range = std::to_string(least) + " to " + std::to_string(most);
  p.expect(t.rows >= least && t.rows <= most, "rows", range + " rows", t.rows);
  p.expect(t.cols >= least && t.cols <= most, "cols", range + " columns", t.cols);
  if (t.kind == TargetKind::TagGrid)
    p.expect(std::isfinite(t.gap) && t.gap >= 0, "gap", "a distance, not negative [m]", t.gap);
  if (t.kind == TargetKind::Charuco)
    p.expect(t.marker > 0 && t.marker < t.size, "marker", "a marker smaller than its square [m]", t.marker);
}

void check_map(const Target& t, Problems& p) {
  p.expect(!t.map.empty(), "map", "at least one marker", "none");
  std::set<int> seen;
  for (std::size_t i = 0; i < t.map.size(); ++i) {
    const MapMarker& m = t.map[i];
    const std::string field = "map[" + std::to_string(i) + "].";
    p.length(m.size, field + "size");
    p.expect(seen.insert(m.id).second, field + "id", "an id that occurs only once in the map", m.id);
    p.expect(is_rotation(m.T_target_marker.linear()), field + "T_target_marker", "a rigid motion",
             "a pose that is mirrored or stretched");
  }
}

/// The family is there, and has every id the target shows.
void check_ids(const Target& t, Problems& p) {
  const auto& families = marker_families();
  if (std::find(families.begin(), families.end(), t.family) == families.end()) {
    std::string names;
    for (const std::string& name : families) names += " " + name;
    return p.expect(false, "family", "one of" + names, t.family);
  }
  const int count = marker_count(t.family);
  const std::string ids = "family " + t.family + ", 0 to " + std::to_string(count - 1);
  if (t.kind != TargetKind::MarkerMap) {
    const int markers = t.kind == TargetKind::Tag ? 1 : t.rows * t.cols / (t.kind == TargetKind::Charuco ? 2 : 1);
    return p.expect(t.first_id >= 0 && t.first_id <= count - markers, "first_id",
                    "ids of " + ids + ", for " + std::to_string(markers) + (markers == 1 ? " marker" : " markers"),
                    t.first_id);
  }
  for (std::size_t i = 0; i < t.map.size(); ++i)
    p.expect(t.map[i].id >= 0 && t.map[i].id < count, "map[" + std::to_string(i) + "].id", "an id of " + ids,
             t.map[i].id);
}

}  // namespace

std::vector<TargetProblem> Target::problems() const {
  Problems p;
  if (kind == TargetKind::MarkerMap)
    check_map(*this, p);
  else
    check_sizes(*this, p);
  if (has_markers(kind) && p.none()) check_ids(*this, p);
  return p.take();
}

void Target::validate() const {
  const std::vector<TargetProblem> all = problems();
  if (!all.empty())
    throw InvalidArgument("target." + all[0].field + ": found " + all[0].found + ", expected " + all[0].expected);
}

Eigen::Matrix<double, 3, 4> square_corners(double size) {
  const double h = size / 2;
  Eigen::Matrix<double, 3, 4> corners;
  corners << -h, h, h, -h, -h, -h, h, h, 0, 0, 0, 0;
  return corners;
}

std::vector<MapMarker> target_markers(const Target& t) {
  switch (t.kind) {
    case TargetKind::Tag:
      return {{t.first_id, t.size, Pose::Identity()}};
    case TargetKind::TagGrid: {
      std::vector<MapMarker> markers;
      for (int i = 0; i < t.rows * t.cols; ++i) {
        const int row = i / t.cols, col = i % t.cols;
        markers.push_back(
            {t.first_id + i, t.size, at(t.size / 2 + col * (t.size + t.gap), t.size / 2 + row * (t.size + t.gap))});
      }
      return markers;
    }
    case TargetKind::Charuco:
      return charuco_markers(t);
    case TargetKind::MarkerMap:
      return t.map;
    default:
      return {};
  }
}

TargetPoints target_points(const Target& t) {
  t.validate();
  if (t.kind == TargetKind::Chessboard || t.kind == TargetKind::CircleGrid)
    return grid_points(t.rows, t.cols, t.size, 0);
  if (t.kind == TargetKind::Charuco) return grid_points(t.rows - 1, t.cols - 1, t.size, t.size);
  const std::vector<MapMarker> markers = target_markers(t);
  TargetPoints out{Eigen::Matrix3Xd(3, 4 * static_cast<Eigen::Index>(markers.size())), {}};
  for (const MapMarker& m : markers) {
    const auto first = static_cast<Eigen::Index>(out.ids.size());
    out.points.middleCols<4>(first) = m.T_target_marker * square_corners(m.size);
    for (int corner = 0; corner < 4; ++corner) out.ids.push_back(4 * m.id + corner);
  }
  return out;
}

Target parse_target(const std::string& text) {
  Reader read(text);
  Target t;
  const std::string kind = read.word("the kind");
  if (kind == "chessboard" || kind == "circles") {
    t.kind = kind == "circles" ? TargetKind::CircleGrid : TargetKind::Chessboard;
    read.size(t);
    t.size = read.number<double>("the length");
  } else if (kind == "tag") {
    t.kind = TargetKind::Tag;
    t.family = marker_family(read.word("FAMILY"));
    t.first_id = read.number<int>("the id");
    t.size = read.number<double>("the side");
  } else if (kind == "grid") {
    t.kind = TargetKind::TagGrid;
    t.family = marker_family(read.word("FAMILY"));
    read.size(t);
    t.size = read.number<double>("the side");
    t.gap = read.number<double>("the gap");
    if (read.more()) t.first_id = read.number<int>("the first id");
  } else if (kind == "charuco" || kind == "charuco_legacy") {
    t.kind = TargetKind::Charuco;
    t.legacy = kind == "charuco_legacy";
    t.family = marker_family(read.word("FAMILY"));
    read.size(t);
    t.size = read.number<double>("the square");
    t.marker = read.number<double>("the marker");
  } else {
    bad_form(text, "'" + kind + "' is not a kind of target");
  }
  read.finish();
  t.validate();
  return t;
}

}  // namespace kr5
