// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <map>
#include <set>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include <kr5/core/error.hpp>
#include <kr5/vision/family.hpp>

#include "vision/boards/find_charuco.hpp"
#include "vision/boards/find_chessboard.hpp"
#include "vision/boards/find_circles.hpp"
#include "vision/cv_view.hpp"
#include "vision/targets/explain_not_found.hpp"

namespace kr5::vision {
namespace {

/// Markers of a flat target that lie where the others say; a misread one, or a second board with the same ids, falls
/// out. Lens distortion is let pass.
std::vector<TagDetection> consistent(const std::vector<TagDetection>& tags, const std::map<int, MapMarker>& wanted) {
  if (tags.size() < 3) return tags;
  std::vector<cv::Point2d> plane, image;
  double side = 0;
  for (const TagDetection& tag : tags) {
    const MapMarker& m = wanted.at(tag.id);
    const Eigen::Matrix<double, 3, 4> corners = m.T_target_marker * square_corners(m.size);
    for (int k = 0; k < 4; ++k) {
      plane.emplace_back(corners(0, k), corners(1, k));
      image.emplace_back(tag.corners(0, k), tag.corners(1, k));
    }
    side += (tag.corners.col(1) - tag.corners.col(0)).norm() / static_cast<double>(tags.size());
  }
  std::vector<uchar> inlier;
  cv::findHomography(plane, image, cv::RANSAC, std::max(3.0, 0.4 * side), inlier, 2000, 0.999);
  if (inlier.size() != plane.size()) return tags;
  std::vector<TagDetection> kept;
  for (std::size_t i = 0; i < tags.size(); ++i)
    if (inlier[4 * i] && inlier[4 * i + 1] && inlier[4 * i + 2] && inlier[4 * i + 3]) kept.push_back(tags[i]);
  return kept;
}

std::map<int, MapMarker> places_of(const Target& target) {
  std::map<int, MapMarker> places;
  for (const MapMarker& m : target_markers(target)) places[m.id] = m;
  return places;
}

/// Whether the markers lie as on the ChArUco board of the other kind. There every other row is shifted by a square:
/// half the markers would agree with the wrong board and number its corners wrongly.
bool other_kind(const Target& target, const std::vector<TagDetection>& tags, std::size_t agreed) {
  if (target.kind != TargetKind::Charuco || target.rows % 2 != 0) return false;
  Target other = target;
  other.legacy = !target.legacy;
  return consistent(tags, places_of(other)).size() > agreed;
}

std::vector<TagDetection> with_ids_of(const Target& target, const std::vector<TagDetection>& tags) {
  const std::map<int, MapMarker> wanted = places_of(target);
  std::vector<TagDetection> out;
  for (const TagDetection& tag : tags)
    if (wanted.contains(tag.id)) out.push_back(tag);
  return out;
}

/// Rows and columns other than the stated ones as which nearly all markers lie, such as the stated ones exchanged.
/// Markers that are numbered along the rows tell them; few markers, and those of one row, do not.
std::optional<Target> other_layout(const Target& target, const std::vector<TagDetection>& tags) {
  constexpr std::size_t least = 4;
  constexpr double most_agree = 0.9, stated_agree = 0.8;  // of the markers, and of those that agree with the other
  if (target.kind != TargetKind::TagGrid || tags.size() < least) return std::nullopt;
  const std::size_t stated = consistent(tags, places_of(target)).size();
  if (stated == tags.size()) return std::nullopt;
  std::optional<Target> best;
  std::size_t agreed = stated;
  const int count = target.rows * target.cols;
  for (int cols = 1; cols <= count; ++cols) {
    Target other = target;
    other.cols = cols;
    other.rows = (count + cols - 1) / cols;
    const std::size_t agreeing = consistent(tags, places_of(other)).size();
    if (agreeing <= agreed) continue;
    agreed = agreeing;
    best = other;
  }
  const auto all = static_cast<double>(tags.size()), with_best = static_cast<double>(agreed);
  const bool clear = with_best >= most_agree * all && static_cast<double>(stated) < stated_agree * with_best;
  return clear ? best : std::nullopt;
}

/// The markers of the target among those seen, one of each id: the larger.
std::vector<TagDetection> markers_of(const Target& target, const std::vector<TagDetection>& tags, int* doubles) {
  const std::map<int, MapMarker> wanted = places_of(target);
  std::vector<TagDetection> ours = with_ids_of(target, tags);
  if (target.kind == TargetKind::TagGrid || target.kind == TargetKind::Charuco) {
    const std::vector<TagDetection> agreeing = consistent(ours, wanted);
    ours = other_kind(target, ours, agreeing.size()) ? std::vector<TagDetection>() : agreeing;
  }
  std::set<int> seen;
  std::vector<TagDetection> single;
  for (const TagDetection& tag : ours)
    if (seen.insert(tag.id).second) single.push_back(tag);
  *doubles = static_cast<int>(ours.size() - single.size());
  return single;
}

std::optional<SeenPoints> corners_of(const Target& target, const std::vector<TagDetection>& tags) {
  std::map<int, int> first;
  const TargetPoints points = target_points(target);
  for (std::size_t i = 0; i < points.ids.size(); ++i) first[points.ids[i]] = static_cast<int>(i);
  SeenPoints seen;
  for (const TagDetection& tag : tags)
    for (int k = 0; k < 4; ++k) seen.add(first.at(4 * tag.id + k), tag.corners.col(k), tag.sigma[k]);
  if (seen.index.empty()) return std::nullopt;
  return seen;
}

bool has_markers(const Target& target) {
  return target.kind != TargetKind::Chessboard && target.kind != TargetKind::CircleGrid;
}

void fill(Detection& result, const Target& target, const SeenPoints& seen) {
  const TargetPoints all = target_points(target);
  const auto n = static_cast<Eigen::Index>(seen.index.size());
  result.view.points.resize(3, n);
  result.view.pixels.resize(2, n);
  result.sigma.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    result.view.points.col(i) = all.points.col(seen.index[k]);
    result.view.pixels.col(i) = seen.pixel[k];
    result.view.ids.push_back(all.ids[static_cast<std::size_t>(seen.index[k])]);
    result.sigma[i] = seen.sigma[k];
  }
  result.status = DetectStatus::Found;
  result.message = std::to_string(n) + " of " + std::to_string(all.ids.size()) + " points seen" + result.message;
}

/// Looks for the target as it is, without asking why not.
Detection search_once(ImageView image, const Target& target, const DetectOptions& options) {
  Detection result;
  std::optional<SeenPoints> seen;
  if (has_markers(target)) {
    TagOptions tag_options{.families = {target.family}, .decimate = options.decimate, .threads = options.threads};
    tag_options.refine = options.refine;
    result.tags = find_tags(image, tag_options);
    if (const auto other = other_layout(target, with_ids_of(target, result.tags))) {
      say_other_layout(target, *other, result);
      return result;
    }
    int doubles = 0;
    std::vector<TagDetection> ours = markers_of(target, result.tags, &doubles);
    // A marker that its model does not fit, say cut off by the image, may be pixels off: others make up for it.
    if (std::any_of(ours.begin(), ours.end(), [](const TagDetection& tag) { return tag.refined; }))
      std::erase_if(ours, [](const TagDetection& tag) { return !tag.refined; });
    if (doubles > 0)
      result.message = "; " + std::to_string(doubles) + " smaller markers with the same ids were left out";
    seen = target.kind == TargetKind::Charuco ? find_charuco(image, target, ours, options.refine)
                                              : corners_of(target, ours);
    if (target.kind != TargetKind::Charuco)
      for (const TagDetection& tag : ours) result.correlation = std::max(result.correlation, tag.correlation);
  } else {
    seen = target.kind == TargetKind::Chessboard ? find_chessboard(image, target, options.refine)
                                                 : find_circles(image, target, options.refine);
  }
  if (seen) fill(result, target, *seen);
  return result;
}

/// With nothing found in the shrunk image, a finer search is worth its time: small markers need it.
Detection search(ImageView image, const Target& target, const DetectOptions& options) {
  Detection result = search_once(image, target, options);
  if (result.found() || result.status == DetectStatus::WrongSize || options.decimate > 0 || !has_markers(target))
    return result;
  DetectOptions finer = options;
  for (const double decimate : {1.0, 0.5}) {
    finer.decimate = decimate;
    Detection again = search_once(image, target, finer);
    if (again.found()) return again;
    if (again.tags.size() > result.tags.size()) result.tags = again.tags;
  }
  return result;
}

}  // namespace

void DetectOptions::validate() const {
  TagOptions tags;
  tags.decimate = decimate;
  tags.threads = threads;
  tags.validate();
}

Detection find_target(ImageView image, const Target& target, const DetectOptions& options) {
  require_image(image);
  options.validate();
  target.validate();
  Detection result = search(image, target, options);
  if (result.found() || result.status == DetectStatus::WrongSize) return result;
  result.message = "not found";
  if (!options.explain) return result;
  if (has_markers(target)) {
    DetectOptions plain = options;
    plain.refine = Refinement::None;
    if (search(mirrored_image(image), target, plain).found())
      say_mirrored(result);
    else if (search(inverted_image(image), target, plain).found())
      say_inverted(result);
    if (result.status != DetectStatus::NotFound) return result;
  }
  explain_not_found(image, target, result);
  return result;
}

}  // namespace kr5::vision
