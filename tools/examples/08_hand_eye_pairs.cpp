// SPDX-License-Identifier: BSD-3-Clause
// Where the camera sits on the arm, from pairs of poses without images.  08_hand_eye_pairs SHARE
#include <cmath>
#include <cstdio>
#include <string>

#include <kr5/calibration/hand_eye_pairs.hpp>
#include <kr5/calibration/pair_readings.hpp>
#include <kr5/calibration/pose_format.hpp>
#include <kr5/io/csv.hpp>

using namespace kr5;

int main(int, char** argv) {
  const io::Table table = io::load_csv(std::string(argv[1]) + "/data/pairs/pairs.csv");
  const auto robot = calibration::to_poses(table.values.leftCols(7), {}),
             seen = calibration::to_poses(table.values.rightCols(7), {});
  std::vector<calibration::PosePair> pairs;
  for (std::size_t i = 0; i < robot.size(); ++i) pairs.push_back({"pair " + std::to_string(i + 1), robot[i], seen[i]});
  const auto readings = calibration::compare_pair_readings(pairs, Mount::EyeInHand);
  std::printf("as written: %s\n", readings.certain && !readings.readings[0].robot_inverted ? "yes" : "no");
  const auto result = calibration::calibrate_hand_eye_pairs(pairs);
  const Eigen::Vector3d t = 1e3 * result.T_mount_camera.translation();
  const double sigma = 1e3 * std::sqrt(result.covariance.diagonal().head<3>().sum());
  std::printf("camera on flange at %.1f %.1f %.1f mm, known to %.1f mm\n", t.x(), t.y(), t.z(), sigma);
  for (const auto& view : result.views)
    if (view.outlier) std::printf("left out: %s\n", view.name.c_str());
}
