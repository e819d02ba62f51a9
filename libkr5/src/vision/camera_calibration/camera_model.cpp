// SPDX-License-Identifier: BSD-3-Clause
#include "vision/camera_calibration/camera_model.hpp"

namespace kr5::vision::detail {

std::vector<int> free_parameters(const CameraModel& m) {
  std::vector<int> out;
  for (int k = 0; k < 4; ++k)
    if (!(k == 1 && m.square_pixels) && !(k >= 2 && m.centred)) out.push_back(k);
  for (const int k : lens_parameters(m.lens)) out.push_back(k);
  for (int k = 0; m.bent_target && k < shape_count; ++k) out.push_back(Pinhole::parameter_count + k);
  return out;
}

Eigen::MatrixXd free_basis(const CameraModel& model) {
  const std::vector<int> free = free_parameters(model);
  Eigen::MatrixXd B = Eigen::MatrixXd::Zero(shared_count, Eigen::Index(free.size()));
  for (std::size_t k = 0; k < free.size(); ++k) B(free[k], Eigen::Index(k)) = 1;
  if (model.square_pixels) B(1, 0) = 1;
  return B;
}

std::vector<std::string> free_names(const CameraModel& model) {
  std::vector<std::string> out;
  for (const int k : free_parameters(model))
    out.emplace_back(k < Pinhole::parameter_count ? Pinhole::parameter_names[std::size_t(k)]
                                                  : shape_names[std::size_t(k - Pinhole::parameter_count)]);
  return out;
}

void apply_model(const CameraModel& model, Pinhole& camera, Shape& shape) {
  Pinhole::Parameters p = camera.parameters(), kept = Pinhole::Parameters::Zero();
  kept.head<4>() = p.head<4>();
  for (const int k : lens_parameters(model.lens)) kept[k] = p[k];
  if (model.square_pixels) kept[0] = kept[1] = 0.5 * (p[0] + p[1]);
  camera.set_parameters(kept);
  if (!model.bent_target) shape.setZero();
}

}  // namespace kr5::vision::detail
