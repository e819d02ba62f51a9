// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/single_image_calibration.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/geometry/resection.hpp>

namespace kr5 {
namespace {

constexpr double ambiguous = 0.8;  // RMS ratio above which the second pose cannot be ruled out

struct Points {
  Eigen::Matrix3Xd points;
  Eigen::Matrix2Xd pixels;
};

Points gather(std::span<const View> views) {
  Eigen::Index count = 0;
  for (const View& view : views) {
    require(view.points.cols() == view.pixels.cols(),
            "calibrate_single_image: view '" + view.name + "': found " + std::to_string(view.points.cols()) +
                " points and " + std::to_string(view.pixels.cols()) + " pixels, expected as many");
    count += view.points.cols();
  }
  require(count >= 6, "calibrate_single_image: found " + std::to_string(count) + " points, expected at least 6");
  Points all{Eigen::Matrix3Xd(3, count), Eigen::Matrix2Xd(2, count)};
  Eigen::Index at = 0;
  for (const View& view : views) {
    all.points.middleCols(at, view.points.cols()) = view.points;
    all.pixels.middleCols(at, view.pixels.cols()) = view.pixels;
    at += view.points.cols();
  }
  return all;
}

double depth_ratio(const Eigen::Matrix3Xd& points) {
  const Eigen::Matrix3Xd centred = points.colwise() - points.rowwise().mean();
  const Eigen::VectorXd sizes = symmetric_eigen(centred * centred.transpose()).values;
  return std::sqrt(std::max(0.0, sizes[0]) / std::max(sizes[1], 1e-300));
}

/// RMS error of the pose with the plane's depth turned over, the one that a distant camera cannot tell from `T`. As a
/// start it need not lie in the same valley as any optimum that was found.
double mirrored_rms(const Eigen::Matrix3Xd& centred, const Eigen::Matrix2Xd& pixels, const Pinhole& camera,
                    const Pose& T) {
  const SymmetricEigen eigen = symmetric_eigen(centred * centred.transpose());
  const Eigen::Vector3d sight = T.translation().normalized(), normal = eigen.vectors.col(0);
  Pose M = T;
  M.linear() = (Eigen::Matrix3d::Identity() - 2 * sight * sight.transpose()) * T.linear() *
               (Eigen::Matrix3d::Identity() - 2 * normal * normal.transpose());
  double sum = 0;
  for (Eigen::Index i = 0; i < centred.cols(); ++i) {
    const Eigen::Vector3d point = M * Eigen::Vector3d(centred.col(i));
    if (point.z() <= 0) return 1e300;
    sum += (camera.project(point) - pixels.col(i)).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(centred.cols()));
}

void judge(const SingleImageOptions& options, SingleImageResult& result) {
  result.fit.status = FitStatus::Converged;
  result.fit.message = "camera from one image";
  if (result.depth_ratio >= options.min_depth_ratio) return;
  result.fit.message =
      "the points lie on one plane, so that the rotation out of it is poorly determined; add points on a second plane";
  if (result.error_ratio < ambiguous) return;
  result.fit.status = FitStatus::Degenerate;
  result.fit.message =
      "the points lie on one plane and two poses explain them almost equally well; add points on a second plane";
}

}  // namespace

void SingleImageOptions::validate() const {
  require(sigma_pixel >= 0, "sigma_pixel must not be negative [px]; 0 means estimated");
  require(std::isfinite(correlation) && correlation >= 1, "correlation must be at least 1 [-]");
  require(min_depth_ratio >= 0 && min_depth_ratio < 1, "min_depth_ratio must lie between 0 and 1 [-]");
}

SingleImageResult calibrate_single_image(std::span<const View> views, const Pinhole& camera,
                                         const SingleImageOptions& options) {
  options.validate();
  const Points all = gather(views);
  SingleImageResult result;
  result.depth_ratio = depth_ratio(all.points);
  const Eigen::Vector3d centre = all.points.rowwise().mean();  // the flange may be far off; turns are about the grid
  const Eigen::Matrix3Xd centred = all.points.colwise() - centre;
  const auto found = resect(centred, all.pixels, camera);
  if (found.empty()) {
    result.fit.message = "no pose puts the points in front of the camera, or they lie on a line";
    return result;
  }
  const Resection& best = found.front();
  result.T_flange_camera = Eigen::Translation3d(centre) * best.T_camera_points.inverse();
  result.rms_px = best.rms_px;
  if (result.depth_ratio < options.min_depth_ratio)
    result.error_ratio = std::min(1.0, best.rms_px / mirrored_rms(centred, all.pixels, camera, best.T_camera_points));
  const double dof = std::max(1.0, 2 * best.weights.sum() - 6);
  result.sigma_pixel = options.sigma_pixel > 0 ? options.sigma_pixel : std::sqrt(best.cost / dof);
  // A right perturbation of the inverse is the negative one moved across the pose.
  const Matrix6 A = adjoint(best.T_camera_points);
  result.covariance =
      options.correlation * std::pow(result.sigma_pixel, 2) * A * best.information.inverse() * A.transpose();
  result.fit.final_rms = best.rms_px / (std::sqrt(2.0) * std::max(result.sigma_pixel, 1e-12));
  judge(options, result);
  return result;
}

}  // namespace kr5
