// SPDX-License-Identifier: BSD-3-Clause
#include "vision/targets/explain_not_found.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <opencv2/imgproc.hpp>

#include <kr5/geometry/marker_family.hpp>
#include <kr5/vision/family.hpp>

#include "vision/boards/find_chessboard.hpp"
#include "vision/boards/find_circles.hpp"
#include "vision/cv_view.hpp"

namespace kr5::vision {
namespace {

void say(Detection& result, DetectStatus status, const std::string& text) {
  result.status = status;
  result.message = text;
}

std::string listed_words(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

std::string list(const std::set<int>& ids) {
  std::string text;
  int count = 0;
  for (const int id : ids) {
    if (++count > 12) return text + ", ...";
    text += (text.empty() ? "" : ", ") + std::to_string(id);
  }
  return text;
}

/// Markers of other families than the wanted ones; one dictionary of each size holds the smaller ones of that size.
bool wrong_family(ImageView image, const std::vector<std::string>& wanted, Detection& result) {
  TagOptions options{.families = {"36h11", "25h9", "41h12", "16h5", "aruco_4x4_1000", "aruco_5x5_1000",
                                  "aruco_6x6_1000", "aruco_7x7_1000", "aruco_original"}};
  options.refine = Refinement::None;
  options.max_hamming = 0;
  options.min_margin = 50;
  std::map<std::string, std::set<int>> seen;
  for (const TagDetection& tag : find_tags(image, options)) seen[tag.family].insert(tag.id);
  for (const std::string& family : wanted) seen.erase(family);
  for (const char* weak : {"aruco_4x4_1000", "16h5", "aruco_original"})  // these turn up by chance
    if (seen.contains(weak) && seen[weak].size() < 2) seen.erase(weak);
  const std::map<std::string, std::set<int>>::value_type* most = nullptr;
  for (const auto& entry : seen)
    if (!most || entry.second.size() > most->second.size()) most = &entry;
  if (!most) return false;
  std::string family = most->first;
  if (family.starts_with("aruco") && family.ends_with("_1000")) family = family.substr(0, 9) + "_*";
  say(result, DetectStatus::WrongFamily,
      "no marker of family " + listed_words(wanted) + ", but of " + family + ": ids " + list(most->second) +
          "; specify that family");
  return true;
}

bool wrong_marker(const Target& target, Detection& result) {
  std::set<int> ids, wanted;
  for (const TagDetection& tag : result.tags) ids.insert(tag.id);
  for (const MapMarker& m : target_markers(target)) wanted.insert(m.id);
  if (ids.empty()) return false;
  bool ours = false;
  for (const int id : ids) ours = ours || wanted.contains(id);
  if (ours) {
    say(result, DetectStatus::NotFound,
        "markers of the target are seen (ids " + list(ids) +
            "), but not at the positions described; check rows, columns, sizes and, for an older ChArUco board, "
            "charuco_legacy");
  } else {
    say(result, DetectStatus::WrongMarker,
        "markers of family " + target.family + " are seen, but with ids " + list(ids) + " where " + list(wanted) +
            " belong to the target; correct the id");
  }
  return true;
}

bool wrong_size(ImageView image, const Target& target, Detection& result) {
  const std::string expected = std::to_string(target.rows) + "x" + std::to_string(target.cols);
  if (target.kind == TargetKind::Chessboard) {
    const auto size = seen_chessboard(image);
    if (!size || *size == std::pair(target.rows, target.cols)) return false;
    say(result, DetectStatus::WrongSize,
        "a chessboard of " + std::to_string(size->first) + "x" + std::to_string(size->second) +
            " inner corners is seen, where " + expected + " was expected; specify that size, or show the whole board");
    return true;
  }
  if (shows_shifted_rows(image, target.rows, target.cols)) {
    say(result, DetectStatus::WrongSize,
        "the dots are those of an asymmetric grid, of which every other row is shifted by half a step, and " +
            expected +
            " is one of straight rows and columns; print such a one with kr5 target print circles:ROWSxCOLS:SPACING");
    return true;
  }
  const int dots = seen_dots(image), wanted = target.rows * target.cols;
  if (dots < 4 || dots == wanted || dots > 3 * wanted || 3 * dots < wanted) return false;
  say(result, DetectStatus::WrongSize,
      std::to_string(dots) + " dots are seen, where " + expected + " = " + std::to_string(wanted) +
          " were expected; correct the size, or show the whole grid");
  return true;
}

/// Sharpest edge in the image: the steepest one per cent of gradients over the contrast [1/px].
double sharpness(const cv::Mat& picture, double contrast) {
  cv::Mat dx, dy, steep;
  cv::Sobel(picture, dx, CV_32F, 1, 0, 3, 0.125);
  cv::Sobel(picture, dy, CV_32F, 0, 1, 3, 0.125);
  cv::magnitude(dx, dy, steep);
  std::vector<float> values(steep.begin<float>(), steep.end<float>());
  const auto k = static_cast<std::ptrdiff_t>(0.999 * static_cast<double>(values.size()));
  std::nth_element(values.begin(), values.begin() + k, values.end());
  return values[static_cast<std::size_t>(k)] / std::max(contrast, 1.0);
}

void bad_picture(ImageView image, Detection& result) {
  const cv::Mat picture = cv_view(image);
  cv::Mat histogram;
  const int channel = 0, bins = 256;
  const float range[] = {0, 256}, *ranges = range;
  cv::calcHist(&picture, 1, &channel, {}, histogram, 1, &bins, &ranges);
  double below = 0, low = -1, high = 255;
  const double total = static_cast<double>(picture.total());
  const double white = (histogram.at<float>(254) + histogram.at<float>(255)) / total;
  for (int i = 0; i < 256; ++i) {
    below += histogram.at<float>(i) / total;
    if (low < 0 && below > 0.005) low = i;
    if (below < 0.995) high = i + 1;
  }
  if (high < 40)
    return say(result, DetectStatus::TooDark,
               "the image is too dark: 99.5 % of it is below grey " + std::to_string(static_cast<int>(high)) +
                   " of 255; add light, or expose longer");
  if (white > 0.5)
    return say(result, DetectStatus::Overexposed,
               "the image is overexposed: " + std::to_string(static_cast<int>(100 * white)) +
                   " % of it is white; expose less");
  if (high - low > 20 && sharpness(picture, high - low) < 0.12)
    return say(result, DetectStatus::Blurred,
               "the image is blurred: no sharp edge in it; focus, hold still, or expose less");
  say(result, DetectStatus::NotFound,
      "nothing similar to the target is seen; is the whole target in the image, large enough, and with a white border "
      "around it?");
}

}  // namespace

void say_mirrored(Detection& result) {
  say(result, DetectStatus::Mirrored,
      "the image is mirrored: the target is found in it when left and right are exchanged; switch off mirroring in the "
      "camera driver, or check for a mirror in the light path");
}

void say_inverted(Detection& result) {
  say(result, DetectStatus::Inverted,
      "the target is inverted: it is found when black and white are exchanged; print it black on white, or switch off "
      "the negative in the camera driver");
}

Image mirrored_image(ImageView image) {
  Image out(image.width, image.height);
  cv::Mat picture(image.height, image.width, CV_8UC1, out.pixels.data());
  cv::flip(cv_view(image), picture, 1);
  return out;
}

Image inverted_image(ImageView image) {
  Image out(image.width, image.height);
  cv::Mat picture(image.height, image.width, CV_8UC1, out.pixels.data());
  cv::bitwise_not(cv_view(image), picture);
  return out;
}

Detection explain_no_tags(ImageView image, const TagOptions& options) {
  Detection result;
  TagOptions plain = options;
  plain.refine = Refinement::None;
  plain.max_hamming = 0;
  std::vector<std::string> wanted;
  for (const std::string& family : options.families) wanted.push_back(marker_family(family));
  if (!find_tags(mirrored_image(image), plain).empty())
    say_mirrored(result);
  else if (!find_tags(inverted_image(image), plain).empty())
    say_inverted(result);
  else if (!wrong_family(image, wanted, result))
    bad_picture(image, result);
  return result;
}

void say_other_layout(const Target& target, const Target& other, Detection& result) {
  say(result, DetectStatus::WrongSize,
      "the markers lie as on a grid of " + std::to_string(other.rows) + "x" + std::to_string(other.cols) +
          " (rows x columns), where " + std::to_string(target.rows) + "x" + std::to_string(target.cols) +
          " was expected; specify that size");
}

void explain_not_found(ImageView image, const Target& target, Detection& result) {
  const bool markers = target.kind != TargetKind::Chessboard && target.kind != TargetKind::CircleGrid;
  if (markers ? wrong_marker(target, result) || wrong_family(image, {target.family}, result)
              : wrong_size(image, target, result))
    return;
  bad_picture(image, result);
}

}  // namespace kr5::vision
