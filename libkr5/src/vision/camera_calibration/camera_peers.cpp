// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/camera_peers.hpp>

#include <cmath>

#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include <kr5/core/error.hpp>

#include "vision/camera_calibration/camera_model.hpp"
#include "vision/camera_calibration/check_views.hpp"

namespace kr5::vision {
namespace {

using namespace detail;

int opencv_flags(LensModel lens) {
  switch (lens) {
    case LensModel::None:
      return cv::CALIB_FIX_K1 | cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3 | cv::CALIB_ZERO_TANGENT_DIST;
    case LensModel::K1:
      return cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3 | cv::CALIB_ZERO_TANGENT_DIST;
    case LensModel::K1K2:
      return cv::CALIB_FIX_K3 | cv::CALIB_ZERO_TANGENT_DIST;
    case LensModel::Brown4:
      return cv::CALIB_FIX_K3;
    case LensModel::Brown5:
      return 0;
    case LensModel::Rational8:
      return cv::CALIB_RATIONAL_MODEL;
    case LensModel::Radial6:
      break;
  }
  throw InvalidArgument("calibrate_camera_opencv: OpenCV has no radial6; use rational8");
}

/// Residuals, RMS and names of the views at the peer's answer.
void report_views(std::span<const View> views, std::vector<Pose> poses, CameraCalibration& result) {
  const CameraProblem problem{views, common_plane(views)};
  const CameraState state{result.camera, Shape::Zero(), std::move(poses)};
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    CameraViewReport v;
    v.name = views[i].name;
    v.T_camera_target = state.poses[i];
    v.residuals = residuals(problem, state, i);
    v.rms_px = v.residuals.cols() ? std::sqrt(v.residuals.colwise().squaredNorm().mean()) : std::nan("");
    sum += v.residuals.squaredNorm(), count += double(v.residuals.cols());
    result.views.push_back(v);
  }
  result.rms_px = std::sqrt(sum / count);
  const double freedom = 2 * count - 6 * double(views.size()) - double(result.free.size());
  result.sigma_pixel = freedom > 0 ? std::sqrt(sum / freedom) : 0;
  result.fit.status = std::isfinite(result.rms_px) ? FitStatus::Converged : FitStatus::Degenerate;
  result.fit.message = result.fit.usable() ? "converged" : "the result has points behind the camera";
}

CameraCalibration empty_result(std::span<const View> views, int width, int height, LensModel lens) {
  check_views(views, width, height);
  CameraCalibration result;
  result.camera.width = width, result.camera.height = height;
  result.lens = lens;
  result.free = free_names({lens});
  return result;
}

/// Lens coefficients in OpenCV's order (k1 k2 p1 p2 k3 k4 k5 k6) follow fx fy cx cy, as ours do.
void take_camera(const cv::Mat& K, const cv::Mat& lens, const cv::Mat& deviations, CameraCalibration& result) {
  Pinhole::Parameters p = Pinhole::Parameters::Zero();
  p.head<4>() << K.at<double>(0, 0), K.at<double>(1, 1), K.at<double>(0, 2), K.at<double>(1, 2);
  for (int k = 0; k < 8 && k < int(lens.total()); ++k) p[4 + k] = lens.at<double>(k);
  result.camera.set_parameters(p);
  for (int k = 0; k < Pinhole::parameter_count && k < int(deviations.total()); ++k)
    result.covariance(k, k) = std::pow(deviations.at<double>(k), 2);
}

void add_view(const View& view, std::vector<std::vector<cv::Point3f>>& points,
              std::vector<std::vector<cv::Point2f>>& pixels) {
  points.emplace_back();
  pixels.emplace_back();
  for (Eigen::Index i = 0; i < view.points.cols(); ++i) {
    const Eigen::Vector3f p = view.points.col(i).cast<float>();
    const Eigen::Vector2f q = view.pixels.col(i).cast<float>();
    points.back().emplace_back(p.x(), p.y(), p.z());
    pixels.back().emplace_back(q.x(), q.y());
  }
}

}  // namespace

CameraCalibration calibrate_camera_opencv(std::span<const View> views, int width, int height, LensModel lens) {
  const int flags = opencv_flags(lens);
  CameraCalibration result = empty_result(views, width, height, lens);
  std::vector<std::vector<cv::Point3f>> points;
  std::vector<std::vector<cv::Point2f>> pixels;
  for (const View& v : views) add_view(v, points, pixels);
  try {
    cv::Mat K, coefficients, deviations, extrinsic_deviations, errors;
    std::vector<cv::Mat> rotations, translations;
    cv::calibrateCamera(points, pixels, {width, height}, K, coefficients, rotations, translations, deviations,
                        extrinsic_deviations, errors, flags,
                        {cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 200, 1e-12});
    take_camera(K, coefficients, deviations, result);
    // OpenCV divides the squared error by its points less its parameters; every point gave two coordinates.
    double seen = 0;
    for (const View& v : views) seen += static_cast<double>(v.points.cols());
    const double free = static_cast<double>(result.free.size() + 6 * views.size());
    if (seen > free) result.covariance *= (seen - free) / (2 * seen - free);
    std::vector<Pose> poses(views.size(), Pose::Identity());
    for (std::size_t i = 0; i < views.size(); ++i) {
      Eigen::Vector3d w, t;
      cv::cv2eigen(rotations[i], w);
      cv::cv2eigen(translations[i], t);
      poses[i].linear() = exp_rotation(w);
      poses[i].translation() = t;
    }
    report_views(views, std::move(poses), result);
  } catch (const cv::Exception& e) {
    result.fit.message = "OpenCV: " + e.err;
  }
  return result;
}

}  // namespace kr5::vision
