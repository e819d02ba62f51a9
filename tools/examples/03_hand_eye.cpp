// SPDX-License-Identifier: BSD-3-Clause
// Where the camera sits on the arm, and whether to trust it.  03_hand_eye SHARE
#include <cmath>
#include <cstdio>

#include <kr5/calibration/dataset.hpp>
#include <kr5/calibration/hand_eye_diagnosis.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/vision/find_target.hpp>
#include <kr5/vision/image.hpp>

using namespace kr5;

int main(int, char** argv) {
  const auto data = calibration::load_dataset(std::string(argv[1]) + "/data/demo/dataset.yaml");
  const Target board = parse_target(data.target);
  const Pinhole camera{.width = 960,
                       .height = 720,
                       .fx = 913.2,
                       .fy = 915.4,
                       .cx = 491.8,
                       .cy = 354.9,
                       .k1 = -0.2018,
                       .k2 = 0.0904,
                       .p1 = 0.0002,
                       .p2 = -0.0001};
  const std::vector<Pose> poses = data.poses();
  std::vector<calibration::HandEyeView> stops;
  std::vector<View> views;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    views.push_back(vision::find_target(vision::load_image(data.images[i]), board).view);
    stops.push_back({.T_base_flange = poses[i], .view = views.back()});
  }
  const auto result = calibration::calibrate_hand_eye(stops, camera, {.mount = data.mount});
  const auto diagnosis =
      calibration::diagnose_hand_eye({data.rows, data.convention, views, {}, camera, data.mount}, result);
  const Eigen::Vector3d t = 1e3 * result.T_mount_camera.translation();
  std::printf("camera on flange at %.1f %.1f %.1f mm\n", t.x(), t.y(), t.z());
  std::printf("%s\n", std::string(name_of(diagnosis.verdict)).c_str());
  for (const auto& cause : diagnosis.causes) std::printf("cause: %s\n", std::string(name_of(cause.cause)).c_str());
}
