// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <map>

#include <opencv2/imgproc.hpp>

#include <kr5/core/error.hpp>
#include <kr5/geometry/marker_family.hpp>
#include <kr5/vision/family.hpp>
#include <kr5/vision/find_target.hpp>

#include "vision/cv_view.hpp"
#include "vision/markers/family_impl.hpp"
#include "vision/markers/refine_marker.hpp"

namespace kr5::vision {
namespace {

/// The AprilTag detector with its families. Its tables of codes take longer to build than an image to search, so one
/// per thread and choice of families is kept.
class AprilTagDetector {
 public:
  AprilTagDetector(const std::vector<std::string>& families, int max_hamming) : detector_(apriltag_detector_create()) {
    for (const std::string& name : families) {
      families_.push_back(apriltag_family_of(name));
      const int bits = name == "36h11" || name == "41h12" ? max_hamming : std::min(max_hamming, name == "25h9" ? 2 : 1);
      apriltag_detector_add_family_bits(detector_, families_.back().get(), bits);
      names_[families_.back()->name] = name;
    }
  }
  ~AprilTagDetector() { apriltag_detector_destroy(detector_); }
  AprilTagDetector(const AprilTagDetector&) = delete;
  AprilTagDetector& operator=(const AprilTagDetector&) = delete;

  std::vector<TagDetection> operator()(ImageView image, double decimate, const TagOptions& options) {
    // The library takes every so many-th pixel: other broken numbers than 1.5 would put tags in the wrong place.
    detector_->quad_decimate = decimate == 1.5 ? 1.5f : static_cast<float>(std::max(std::floor(decimate), 1.0));
    detector_->nthreads = options.threads;
    // Snapping edges to gradients loses small tags and our own fit does better,
    // but it is needed to make up for a shrunk search, and when nothing comes after it.
    detector_->refine_edges = decimate > 1 || options.refine == Refinement::None;
    image_u8_t picture{image.width, image.height, static_cast<int32_t>(image.stride), const_cast<uint8_t*>(image.data)};
    zarray_t* found = apriltag_detector_detect(detector_, &picture);
    std::vector<TagDetection> tags;
    for (int i = 0; i < zarray_size(found); ++i) {
      apriltag_detection_t* d = nullptr;
      zarray_get(found, i, &d);
      if (d->decision_margin < options.min_margin) continue;
      TagDetection tag{.family = names_.at(d->family->name),
                       .id = d->id,
                       .corners = {},
                       .sigma = Eigen::Vector4d::Zero(),
                       .correlation = 1.0,
                       .refined = false,
                       .hamming = d->hamming,
                       .margin = d->decision_margin};
      // The library goes from the lower left corner counter-clockwise, with the first pixel's centre at (0.5, 0.5).
      for (int k = 0; k < 4; ++k) tag.corners.col(k) << d->p[3 - k][0] - 0.5, d->p[3 - k][1] - 0.5;
      tags.push_back(std::move(tag));
    }
    apriltag_detections_destroy(found);
    return tags;
  }

 private:
  apriltag_detector_t* detector_;
  std::vector<FamilyPointer> families_;
  std::map<std::string, std::string> names_;
};

std::vector<TagDetection> find_apriltags(ImageView image, const std::vector<std::string>& families, double decimate,
                                         const TagOptions& options) {
  static thread_local std::map<std::pair<std::vector<std::string>, int>, std::unique_ptr<AprilTagDetector>> kept;
  auto& detector = kept[{families, options.max_hamming}];
  if (!detector) detector = std::make_unique<AprilTagDetector>(families, options.max_hamming);
  return (*detector)(image, decimate, options);
}

std::vector<TagDetection> find_aruco(ImageView image, const std::string& family, double decimate) {
  cv::Mat picture = cv_view(image), small;
  if (decimate != 1)
    cv::resize(picture, small, {}, 1 / decimate, 1 / decimate, decimate > 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(decimate != 1 ? small : picture, aruco_dictionary_of(family), corners, ids);
  std::vector<TagDetection> tags;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    TagDetection tag;
    tag.family = family;
    tag.id = ids[i];
    for (int k = 0; k < 4; ++k) {
      const cv::Point2f p = corners[i][static_cast<std::size_t>(k)];
      tag.corners.col(k) = decimate * (Eigen::Vector2d(p.x, p.y).array() + 0.5) - 0.5;
    }
    tags.push_back(std::move(tag));
  }
  return tags;
}

double area(const TagDetection& tag) {
  const Eigen::Vector2d a = tag.corners.col(2) - tag.corners.col(0), b = tag.corners.col(3) - tag.corners.col(1);
  return std::abs(a.x() * b.y() - a.y() * b.x()) / 2;
}

double usual_decimate(ImageView image) { return static_cast<double>(image.width) * image.height > 1.5e6 ? 2.0 : 1.0; }

/// Shortest side of any tag [px]; 0 without tags.
double smallest_side(const std::vector<TagDetection>& tags) {
  double side = tags.empty() ? 0.0 : 1e9;
  for (const TagDetection& tag : tags)
    for (int k = 0; k < 4; ++k) side = std::min(side, (tag.corners.col(k) - tag.corners.col((k + 1) % 4)).norm());
  return side;
}

/// A large image is shrunk by twice as much at first, which takes a fifth of the time. Codes are read in the full
/// image, so only small tags can be missed by that: finding none, or one not much bigger than what can be missed, asks
/// for the thorough search.
std::vector<TagDetection> find_apriltags_quickly(ImageView image, const std::vector<std::string>& families,
                                                 double decimate, const TagOptions& options) {
  constexpr double safe_side = 15;  // [px of the shrunk image]; measured: all are found from 11
  if (static_cast<double>(image.width) * image.height > 3e6) {
    const auto tags = find_apriltags(image, families, 2 * decimate, options);
    if (smallest_side(tags) >= safe_side * 2 * decimate) return tags;
  }
  return find_apriltags(image, families, decimate, options);
}

void refine(ImageView image, TagDetection& tag) {
  const auto better = refine_marker(image, marker_pattern(tag.family, tag.id), tag.corners);
  if (!better) return;
  tag.corners = better->corners;
  tag.sigma = better->sigma;
  tag.correlation = better->correlation;
  tag.refined = true;
}

}  // namespace

void TagOptions::validate() const {
  require(!families.empty(), "families: at least one marker family is needed");
  for (const std::string& family : families) marker_family(family);
  require(decimate == 0 || (decimate >= 0.5 && decimate <= 8), "decimate must be 0 (chosen by image size) or 0.5 to 8");
  require(threads >= 1 && threads <= 64, "threads must lie between 1 and 64");
  require(max_hamming >= 0 && max_hamming <= 2, "max_hamming must be 0, 1 or 2");
  require(min_margin >= 0, "min_margin must not be negative [grey]");
}

std::vector<TagDetection> find_tags(ImageView image, const TagOptions& options) {
  require_image(image);
  options.validate();
  const double decimate = options.decimate > 0 ? options.decimate : usual_decimate(image);
  std::vector<std::string> april;
  std::vector<TagDetection> tags;
  for (const std::string& name : options.families) {
    const std::string family = marker_family(name);
    if (is_apriltag(family)) {
      april.push_back(family);
    } else {
      const auto more = find_aruco(image, family, decimate);
      tags.insert(tags.end(), more.begin(), more.end());
    }
  }
  if (!april.empty()) {
    const auto more = options.decimate > 0 ? find_apriltags(image, april, decimate, options)
                                           : find_apriltags_quickly(image, april, decimate, options);
    tags.insert(tags.end(), more.begin(), more.end());
  }
  if (options.refine == Refinement::Model)
    for (TagDetection& tag : tags) refine(image, tag);
  std::stable_sort(tags.begin(), tags.end(), [](const TagDetection& a, const TagDetection& b) {
    return a.id != b.id ? a.id < b.id : area(a) > area(b);
  });
  return tags;
}

}  // namespace kr5::vision
