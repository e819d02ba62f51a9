// SPDX-License-Identifier: BSD-3-Clause
// Time to find the tags of a rendered 5 Mpx image, ours beside OpenCV's and ViSP's, each with its defaults on one
// thread. Runs of the methods alternate, and processor time is counted, so that other work on the machine is no bias.
//
//   cmake -G Ninja -B build -DKR5_MODULES=vision -DKR5_BUILD_BENCH=ON && ninja -C build detect_speed
//   build/tools/benchmarks/detect_speed [repetitions]
//
// Needs libvisp-dev and libopencv-contrib-dev. The last line is the same as JSON.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include <opencv2/aruco.hpp>
#include <opencv2/core.hpp>

#include <kr5/vision/find_target.hpp>
#include <kr5/vision/render.hpp>

#include "visp_tags.hpp"

namespace {

using namespace kr5;

constexpr int tags_shown = 35;

vision::Image scene() {
  const Pinhole camera{.width = 2592, .height = 1944, .fx = 2600, .fy = 2600, .cx = 1295.5, .cy = 971.5};
  vision::PlacedTarget board{parse_target("grid:36h11:5x7:0.03:0.01"), Pose::Identity()};
  board.T_camera_target.linear() = exp_rotation(Eigen::Vector3d(0.3, 0.2, 0.0));
  board.T_camera_target.translation() << -0.13, -0.1, 0.45;
  return vision::render(std::span(&board, 1), camera, {.clutter = 10, .blur = 0.8, .noise = 2});
}

struct Method {
  std::string name;
  std::function<std::vector<int>()> find;
  std::vector<double> ms = {};
  std::size_t right = 0, wrong = 0;
};

std::function<std::vector<int>()> ours(const vision::Image& image, vision::TagOptions options = {}) {
  return [&image, options] {
    std::vector<int> ids;
    for (const vision::TagDetection& tag : vision::find_tags(image, options)) ids.push_back(tag.id);
    return ids;
  };
}

std::function<std::vector<int>()> opencv(const cv::Mat& picture) {
  return [picture, dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_APRILTAG_36h11)] {
    std::vector<std::vector<cv::Point2f>> corners;
    std::vector<int> ids;
    cv::aruco::detectMarkers(picture, dictionary, corners, ids);
    return ids;
  };
}

void run(Method& method) {
  const std::clock_t start = std::clock();
  const std::vector<int> ids = method.find();
  method.ms.push_back(1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  std::set<int> right;
  for (const int id : ids)
    if (id >= 0 && id < tags_shown) right.insert(id);
  method.right = right.size();
  method.wrong = ids.size() - right.size();
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

void print(const std::vector<Method>& methods) {
  const double own = median(methods.front().ms);
  std::printf("%-22s %12s %6s %16s %10s\n", "detector", "found of 35", "false", "median [cpu ms]", "over ours");
  std::string json;
  for (const Method& m : methods) {
    const double ms = median(m.ms);
    std::printf("%-22s %12zu %6zu %16.1f %10.2f\n", m.name.c_str(), m.right, m.wrong, ms, ms / own);
    char entry[200];
    std::snprintf(entry, sizeof entry,
                  R"(%s{"name": "%s", "found": %zu, "false": %zu, "median_ms": %.2f, "ratio": %.3f})",
                  json.empty() ? "" : ", ", m.name.c_str(), m.right, m.wrong, ms, ms / own);
    json += entry;
  }
  std::printf(R"({"bench": "detect_speed", "tags": %d, "repetitions": %zu, "methods": [%s]})"
              "\n",
              tags_shown, methods.front().ms.size(), json.c_str());
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 15;
  cv::setNumThreads(1);
  const vision::Image image = scene();
  const cv::Mat picture(image.height, image.width, CV_8UC1, const_cast<unsigned char*>(image.pixels.data()));
  std::vector<Method> methods = {{"kr5", ours(image)},
                                 {"kr5, search only", ours(image, {.refine = vision::Refinement::None})},
                                 {"OpenCV", opencv(picture)},
                                 {"ViSP", visp_tags(image.pixels.data(), image.width, image.height)}};
  for (Method& m : methods) m.find();  // tables are built on first use
  for (int i = 0; i < repetitions; ++i)
    for (Method& m : methods) run(m);
  print(methods);
}
