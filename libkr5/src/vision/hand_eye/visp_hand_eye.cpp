// SPDX-License-Identifier: BSD-3-Clause
#include "vision/hand_eye/visp_hand_eye.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>

#include <visp3/vision/vpHandEyeCalibration.h>

namespace kr5::vision {
namespace {

std::vector<vpHomogeneousMatrix> to_visp(const std::vector<Eigen::Matrix4d>& poses) {
  std::vector<vpHomogeneousMatrix> out(poses.size());
  for (std::size_t i = 0; i < poses.size(); ++i)
    for (unsigned r = 0; r < 3; ++r)
      for (unsigned c = 0; c < 4; ++c) out[i][r][c] = poses[i](r, c);
  return out;
}

/// ViSP prints what it finds, by printf and by std::cout; a library of ours does not.
class Quiet {
 public:
  Quiet() {
    flush();
    const int nowhere = open("/dev/null", O_WRONLY);
    if (nowhere < 0) return;
    before_ = dup(STDOUT_FILENO);
    dup2(nowhere, STDOUT_FILENO);
    close(nowhere);
  }
  ~Quiet() {
    if (before_ < 0) return;
    flush();
    dup2(before_, STDOUT_FILENO);
    close(before_);
  }
  Quiet(const Quiet&) = delete;
  Quiet& operator=(const Quiet&) = delete;

 private:
  static void flush() {
    std::cout.flush();
    std::fflush(stdout);
  }
  int before_ = -1;
};

}  // namespace

Eigen::Matrix4d visp_hand_eye(const std::vector<Eigen::Matrix4d>& T_camera_target,
                              const std::vector<Eigen::Matrix4d>& T_base_flange) {
  vpHomogeneousMatrix T_flange_camera;
  const Quiet quiet;
  vpHandEyeCalibration::calibrate(to_visp(T_camera_target), to_visp(T_base_flange), T_flange_camera);
  Eigen::Matrix4d out = Eigen::Matrix4d::Identity();
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 4; ++c) out(r, c) = T_flange_camera[r][c];
  return out;
}

}  // namespace kr5::vision
