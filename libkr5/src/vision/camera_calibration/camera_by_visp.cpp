// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/camera_by_visp.hpp"

#include "vision/camera_calibration/visp_camera.hpp"

namespace kr5::vision::detail {

CameraByVisp camera_by_visp(const CameraProblem& problem, const CameraState& guess, const std::vector<bool>& used,
                            LensModel lens) {
  std::vector<Eigen::Matrix3Xd> points;
  std::vector<Eigen::Matrix2Xd> pixels;
  for (std::size_t i = 0; i < used.size(); ++i)
    if (used[i]) points.push_back(problem.views[i].points), pixels.push_back(problem.views[i].pixels);
  CameraByVisp out{guess, {}};
  Pinhole& c = out.state.camera;
  const VispCamera answer = visp_camera(points, pixels, {c.fx, c.fy, c.cx, c.cy, 0, {}, {}}, lens == LensModel::K1);
  out.failure = answer.failure;
  if (!out.failure.empty()) return out;
  c.fx = answer.px, c.fy = answer.py, c.cx = answer.u0, c.cy = answer.v0, c.k1 = answer.kud;
  std::size_t next = 0;
  for (std::size_t i = 0; i < used.size(); ++i)
    if (used[i]) out.state.poses[i] = answer.poses[next++];
  return out;
}

}  // namespace kr5::vision::detail
