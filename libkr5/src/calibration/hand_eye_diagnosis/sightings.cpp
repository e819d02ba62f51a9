// SPDX-License-Identifier: BSD-3-Clause
#include "calibration/hand_eye_diagnosis/sightings.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include <kr5/geometry/resection.hpp>

namespace kr5::calibration::evidence {

double Sightings::score() const { return freedom * std::log(std::max(squared_sum, 1e-12) / freedom); }

Sightings find_sightings(std::span<const View> views, const Pinhole& camera) {
  Sightings out;
  std::vector<std::vector<Resection>> found;
  for (std::size_t i = 0; i < views.size(); ++i) {
    std::vector<Resection> poses = resect(views[i].points, views[i].pixels, camera);
    if (poses.empty()) continue;
    out.squared_sum += poses.front().cost;
    out.freedom += 2.0 * static_cast<double>(views[i].points.cols()) - 6.0;
    out.index.push_back(static_cast<int>(i));
    found.push_back(std::move(poses));
  }
  out.sigma_pixel = std::max(std::sqrt(out.squared_sum / std::max(out.freedom, 1.0)), 1e-3);
  const double variance = out.sigma_pixel * out.sigma_pixel;
  for (const auto& poses : found) {
    Sighting sighting;
    for (const Resection& p : poses)
      sighting.solutions.push_back(
          {p.T_camera_points, Matrix6(variance * p.information.inverse()), (p.cost - poses.front().cost) / variance});
    out.views.push_back(std::move(sighting));
  }
  return out;
}

}  // namespace kr5::calibration::evidence
