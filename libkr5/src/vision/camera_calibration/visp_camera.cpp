// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/visp_camera.hpp"

#include <visp3/core/vpCameraParameters.h>
#include <visp3/core/vpException.h>
#include <visp3/vision/vpCalibration.h>

namespace kr5::vision::detail {
namespace {

Eigen::Isometry3d to_eigen(const vpHomogeneousMatrix& M) {
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 4; ++c) T.matrix()(r, c) = M[r][c];
  return T;
}

}  // namespace

VispCamera visp_camera(const std::vector<Eigen::Matrix3Xd>& points, const std::vector<Eigen::Matrix2Xd>& pixels,
                       const VispCamera& start, bool distorted) {
  VispCamera out;
  try {
    std::vector<vpCalibration> tables(points.size());
    for (std::size_t i = 0; i < points.size(); ++i)
      for (Eigen::Index k = 0; k < points[i].cols(); ++k) {
        vpImagePoint pixel(pixels[i](1, k), pixels[i](0, k));  // ViSP: row, column
        tables[i].addPoint(points[i](0, k), points[i](1, k), points[i](2, k), pixel);
      }
    vpCameraParameters camera;
    camera.initPersProjWithoutDistortion(start.px, start.py, start.u0, start.v0);
    const auto method = distorted ? vpCalibration::CALIB_VIRTUAL_VS_DIST : vpCalibration::CALIB_VIRTUAL_VS;
    double error = 0;
    if (vpCalibration::computeCalibrationMulti(method, tables, camera, error, false) != 0)
      out.failure = "ViSP: did not converge";
    out.px = camera.get_px(), out.py = camera.get_py(), out.u0 = camera.get_u0(), out.v0 = camera.get_v0();
    out.kud = distorted ? camera.get_kud() : 0.0;
    for (const vpCalibration& table : tables) out.poses.push_back(to_eigen(distorted ? table.cMo_dist : table.cMo));
  } catch (const vpException& e) {
    out.failure = std::string("ViSP: ") + e.getMessage();
  }
  return out;
}

}  // namespace kr5::vision::detail
