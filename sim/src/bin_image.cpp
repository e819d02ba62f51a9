// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/bin_image.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/sim/bin_rays.hpp>

namespace kr5::sim {
namespace {

using Brightness = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Eigen::Index;
using Eigen::Vector3d;

/// Light that a hit sends to the eye, over that of a white surface that faces the lamp.
double shade(const BinRays& rays, const BinImageOptions& options, const Vector3d& point, const BinHit& hit,
             const Vector3d& to_eye, const Vector3d& lamp) {
  const double albedo = hit.surface >= 0 ? options.pellet_albedo : options.bin_albedo;
  const double ambient = options.ambient * albedo;
  const Vector3d back = lamp - point;
  const double distance = back.norm();
  const Vector3d to_lamp = back / distance;
  const double facing = hit.normal.dot(to_lamp);
  if (facing <= 0.0 || rays.blocked(point + 1e-7 * hit.normal, to_lamp, distance)) return ambient;
  const double half = std::max(0.0, hit.normal.dot((to_lamp + to_eye).normalized()));
  return ambient + albedo * facing + options.gloss * std::pow(half, options.shininess);
}

/// Gaussian blur along the rows, then the columns; edges repeat.
Brightness blurred(const Brightness& sharp, double sigma) {
  const int reach = static_cast<int>(std::ceil(3.0 * sigma));
  if (reach == 0) return sharp;
  Eigen::VectorXd weights = Eigen::VectorXd::LinSpaced(2 * reach + 1, -reach, reach);
  weights = (-0.5 * weights.array().square() / (sigma * sigma)).exp();
  weights /= weights.sum();
  Brightness along = Brightness::Zero(sharp.rows(), sharp.cols()), out = along;
  for (Index c = 0; c < sharp.cols(); ++c)
    for (int k = -reach; k <= reach; ++k)
      along.col(c) += weights[k + reach] * sharp.col(std::clamp<Index>(c + k, 0, sharp.cols() - 1));
  for (Index r = 0; r < sharp.rows(); ++r)
    for (int k = -reach; k <= reach; ++k)
      out.row(r) += weights[k + reach] * along.row(std::clamp<Index>(r + k, 0, sharp.rows() - 1));
  return out;
}

}  // namespace

void BinImageOptions::validate() const {
  const auto share = [](double value, const char* field) {
    require(value >= 0.0 && value <= 1.0, std::string(field) + ": must be 0 to 1");
  };
  const auto not_negative = [](double value, const char* field) {
    require(std::isfinite(value) && value >= 0.0, std::string(field) + ": must not be negative");
  };
  share(pellet_albedo, "pellet_albedo"), share(bin_albedo, "bin_albedo"), share(gloss, "gloss");
  not_negative(ambient, "ambient"), not_negative(shininess, "shininess"), not_negative(noise, "noise");
  require(std::isfinite(gain) && gain > 0.0, "gain: must be positive");
  require(light.allFinite(), "light: must be three lengths");
  require(blur >= 0.0 && blur <= 50.0, "blur: must be 0 to 50 px");
}

Pose camera_above(const BinShape& bin, double height) {
  bin.validate();
  require(std::isfinite(height) && height > 0.0, "height: must be positive");
  return bin.T_base_bin * from_xyzrpy((Vector6() << 0.0, 0.0, height, M_PI, 0.0, 0.0).finished());
}

BinImage render_bin(const PelletScene& scene, const Pinhole& camera, const Pose& T_base_camera,
                    const BinImageOptions& options) {
  options.validate(), camera.validate();
  require(camera.width > 0 && camera.height > 0, "width: an image needs a width and a height");
  const BinRays rays(scene);
  const Pose T_bin_camera = scene.bin.T_base_bin.inverse() * T_base_camera;
  const Vector3d eye = T_bin_camera.translation(), lamp = T_bin_camera * options.light;
  Brightness light = Brightness::Zero(camera.height, camera.width);
  BinImage out;
  out.surface = decltype(out.surface)::Constant(camera.height, camera.width, BinNothing);
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const auto ray = camera.ray({u, v});
      if (!ray) continue;
      const Vector3d direction = (T_bin_camera.linear() * *ray).normalized();
      const BinHit hit = rays.first_hit(eye, direction);
      if (hit.surface == BinNothing) continue;
      out.surface(v, u) = hit.surface;
      light(v, u) = shade(rays, options, eye + hit.distance * direction, hit, -direction, lamp);
    }
  light = blurred(light.cwiseMin(1.0 / options.gain), options.blur);  // a sensor saturates
  Random random(static_cast<std::uint64_t>(options.seed));
  out.grey.resize(camera.height, camera.width);
  for (Index k = 0; k < light.size(); ++k)
    out.grey.data()[k] = static_cast<std::uint8_t>(
        std::lround(std::clamp(255.0 * options.gain * light.data()[k] + random.normal(options.noise), 0.0, 255.0)));
  return out;
}

}  // namespace kr5::sim
