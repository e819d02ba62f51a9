// SPDX-License-Identifier: BSD-3-Clause
// Calibrates a camera from images of a board, and says how well it is known.  02_camera SHARE
#include <cmath>
#include <cstdio>

#include <kr5/calibration/dataset.hpp>
#include <kr5/vision/camera_calibration.hpp>
#include <kr5/vision/find_target.hpp>
#include <kr5/vision/image.hpp>

using namespace kr5;

int main(int, char** argv) {
  const auto data = calibration::load_dataset(std::string(argv[1]) + "/data/demo/dataset.yaml");
  const Target board = parse_target(data.target);
  std::vector<View> views;
  for (const std::string& file : data.images) {
    const auto found = vision::find_target(vision::load_image(file), board);
    if (found.found()) views.push_back(found.view);
  }
  const auto result = vision::calibrate_camera(views, 960, 720);
  std::printf("%zu views, %s\n", views.size(), result.fit.usable() ? "usable" : result.fit.message.c_str());
  std::printf("fx %.3f +- %.3f px\n", result.camera.fx, std::sqrt(result.covariance(0, 0)));
  std::printf("cx %.3f +- %.3f px\n", result.camera.cx, std::sqrt(result.covariance(2, 2)));
}
