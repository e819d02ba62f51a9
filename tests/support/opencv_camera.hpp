// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>
#include <span>
#include <vector>

#include <opencv2/calib3d.hpp>

#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/view.hpp>

/// @file
/// OpenCV's calibrateCamera on the same views, to stand beside ours.

namespace kr5::test {

struct OpencvCamera {
  Pinhole camera;
  double rms_px = 0.0;  ///< [px]
  double fx_std = 0.0;  ///< [px]
};

/// With so many free lens coefficients, in the order k1 k2 p1 p2 k3: 0, 1 or 5.
inline OpencvCamera opencv_camera(std::span<const View> views, int width, int height, int coefficients) {
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> pixels;
  double seen = 0;
  for (const View& v : views) {
    points.emplace_back(), pixels.emplace_back();
    for (Eigen::Index i = 0; i < v.points.cols(); ++i) {
      const Eigen::Vector3f p = v.points.col(i).cast<float>();
      const Eigen::Vector2f q = v.pixels.col(i).cast<float>();
      points.back().emplace_back(p.x(), p.y(), p.z()), pixels.back().emplace_back(q.x(), q.y());
    }
    seen += static_cast<double>(v.points.cols());
  }
  int flags = 0;
  if (coefficients < 5) flags |= cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3 | cv::CALIB_ZERO_TANGENT_DIST;
  if (coefficients < 1) flags |= cv::CALIB_FIX_K1;
  cv::Mat K, lens, deviations, pose_deviations, errors;
  std::vector<cv::Mat> rotations, translations;
  OpencvCamera out;
  out.rms_px = cv::calibrateCamera(points, pixels, {width, height}, K, lens, rotations, translations, deviations,
                                   pose_deviations, errors, flags,
                                   {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-12});
  Pinhole::Parameters p = Pinhole::Parameters::Zero();
  p.head<4>() << K.at<double>(0, 0), K.at<double>(1, 1), K.at<double>(0, 2), K.at<double>(1, 2);
  for (int k = 0; k < 5; ++k) p[4 + k] = lens.at<double>(k);
  out.camera = {.width = width, .height = height};
  out.camera.set_parameters(p);
  // OpenCV divides the squared error by its points less its parameters; every point gave two coordinates.
  const double free = 4 + coefficients + 6.0 * static_cast<double>(views.size());
  out.fx_std = deviations.at<double>(0) * std::sqrt((seen - free) / (2 * seen - free));
  return out;
}

}  // namespace kr5::test
