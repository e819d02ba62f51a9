// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>

#include <kr5/core/error.hpp>

#include "camera_calibration_detail.hpp"

namespace kr5::vision {

void CameraOptions::validate() const {
  require(false_alarm > 0 && false_alarm < 0.5, "false_alarm must lie between 0 and 0.5 [-]");
  require(std::isfinite(correlation) && correlation >= 1, "correlation must be at least 1 [-]");
  require(folds == 0 || folds >= 2, "folds must be 0 or at least 2");
  require(folds != 0 || lens, "folds = 0 compares no models: name the lens");
  require(max_iterations >= 5, "max_iterations must be at least 5");
}

namespace detail {
namespace {

constexpr std::array<const char*, shape_count> shape_names = {"bow_xx", "bow_xy", "bow_yy", "stretch", "shear"};

/// Shared parameters that the model frees; fy is not listed when it follows fx.
std::vector<int> free_parameters(const Model& m) {
  std::vector<int> out;
  for (int k = 0; k < 4; ++k)
    if (!(k == 1 && m.square_pixels) && !(k >= 2 && m.centred)) out.push_back(k);
  for (const int k : lens_parameters(m.lens)) out.push_back(k);
  for (int k = 0; m.bent_target && k < shape_count; ++k) out.push_back(Pinhole::parameter_count + k);
  return out;
}

}  // namespace

Eigen::MatrixXd free_basis(const Model& model) {
  const std::vector<int> free = free_parameters(model);
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(shared_count, Eigen::Index(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k) B(free[k], Eigen::Index(k)) = 1;
  if (model.square_pixels) B(1, 0) = 1;
  return B;
}

std::vector<std::string> free_names(const Model& model) {
  std::vector<std::string> out;
  for (const int k : free_parameters(model))
    out.emplace_back(k < Pinhole::parameter_count ? Pinhole::parameter_names[std::size_t(k)]
                                                  : shape_names[std::size_t(k - Pinhole::parameter_count)]);
  return out;
}

void impose(const Model& model, Pinhole& camera, Shape& shape) {
  Pinhole::Parameters p = camera.parameters(), kept = Pinhole::Parameters::Zero();
  kept.head<4>() = p.head<4>();
  for (const int k : lens_parameters(model.lens)) kept[k] = p[k];
  if (model.square_pixels) kept[0] = kept[1] = 0.5 * (p[0] + p[1]);
  camera.set_parameters(kept);
  if (!model.bent_target) shape.setZero();
}

Eigen::Vector3d bend(const TargetPlane& plane, const Shape& s, const Eigen::Vector3d& point,
                     Eigen::Matrix<double, 3, shape_count>* by_shape) {
  const Eigen::Vector3d q = plane.basis.transpose() * (point - plane.centre) / plane.half;
  const double x = q.x(), y = q.y();
  Eigen::Matrix<double, 3, shape_count> D;
  D << 0, 0, 0, x, y, 0, 0, 0, -y, x, x * x, x * y, y * y, 0, 0;
  D = plane.half * plane.basis * D;
  if (by_shape) *by_shape = D;
  return point + D * s;
}

}  // namespace detail
}  // namespace kr5::vision
