// SPDX-License-Identifier: BSD-3-Clause
#include "scene_sensors.hpp"

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>

#include <kr5/physics/camera.hpp>
#include <kr5/predict/cell_objects.hpp>

#include "scene_rows.hpp"

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

constexpr double rounding = 1e-9;  ///< Of times [s].

std::string seconds(double t) {
  std::string out = std::to_string(t);
  return out.substr(0, out.find('.') + 4) + " s";
}

/// Objects of cell and scene that the scanner may meet.
std::vector<cell::PlacedObject> all_objects(const Scene& scene, const cell::Cell& cell) {
  std::vector<cell::PlacedObject> out = predict::scanner_objects(cell);
  out.insert(out.end(), scene.objects.solids.begin(), scene.objects.solids.end());
  if (scene.objects.bench) out.push_back(predict::wide_plate("bench", *scene.objects.bench));
  return out;
}

enum class ImagePlace { Inside, Beside, Behind };

ImagePlace image_place(const Pinhole& lens, const Vector3d& p) {
  if (p.z() <= 0.0) return ImagePlace::Behind;
  const Eigen::Vector2d pixel = lens.project(p);
  const auto ray = lens.ray(pixel);  // a point beyond the fold of the lens model is not where `project` says
  const bool inside = pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() <= lens.width - 1.0 &&
                      pixel.y() <= lens.height - 1.0 && ray && (*ray - p / p.z()).norm() < 1e-6;
  return inside ? ImagePlace::Inside : ImagePlace::Beside;
}

/// Empty when something is on the picture; else where what there is lies.
std::string reason_of_empty_picture(const predict::CameraScene& view) {
  std::string out;
  for (std::size_t i = 0; i < view.targets.size(); ++i) {
    const Eigen::Matrix3Xd points = view.targets[i].T_camera_target * target_points(view.targets[i].target).points;
    const Pose& T = view.targets[i].T_camera_target;
    const bool flat = view.targets[i].target.kind != TargetKind::MarkerMap;
    if (flat && T.linear().col(2).dot(T.translation()) <= 0.0) {
      out += ", only the back of '" + view.names[i] + "' is visible (Z of a target points into it)";
      continue;
    }
    bool behind = true;
    for (const auto& p : points.colwise()) {
      const ImagePlace where = image_place(view.lens, p);
      if (where == ImagePlace::Inside) return "";
      behind &= where == ImagePlace::Behind;
    }
    out += ", '" + view.names[i] + "' lies " + (behind ? "behind the camera" : "beside the image");
  }
  for (const PlacedSolid& solid : view.solids)
    if (image_place(view.lens, solid.T_camera_solid.translation()) == ImagePlace::Inside) return "";
  return out.empty() ? ", the cell has no targets" : out;
}

}  // namespace

SceneSensors::SceneSensors(const Scene& scene, const cell::Cell& cell, const std::vector<double>& rests)
    : scene_(scene), cell_(cell), cycle_(scene_cycle(scene, cell)), at_(rests) {
  if (scene.camera) {
    const physics::EffectiveCamera camera(cell);  // complains of what is not there
    const Eigen::VectorXd& at = scene.camera->at;
    if (at.size() > 0) at_.assign(at.begin(), at.end());
    require(!at_.empty(), "camera.at: expected times, which are required without way points");
    require(std::is_sorted(at_.begin(), at_.end()), "camera.at: must be in order of time");
    require(at_.front() >= 0.0 && at_.back() <= scene.duration + rounding,
            "camera.at: must lie within the duration of the scene");
  } else {
    at_.clear();
  }
  for (std::size_t i = 0; i < scene.objects.solids.size(); ++i) try {
      scene.objects.solids[i].validate();
    } catch (const InvalidArgument& e) {
      throw InvalidArgument("objects.solids[" + std::to_string(i) + "]." + e.what());
    }
  set_cell(cell);
}

void SceneSensors::set_cell(const cell::Cell& cell) {
  cell_ = cell;
  if (!scene_.scanner) return;
  try {
    scene_.scanner->validate();
  } catch (const InvalidArgument& e) {
    throw InvalidArgument(std::string("scanner.") + e.what());
  }
  LineScannerOptions options = *scene_.scanner;
  options.seed += lines_;  // other noise than that before an event
  scanner_.emplace(cell_, all_objects(scene_, cell_), options);
}

void SceneSensors::sample(double t, DrivenArm& arm) {
  // In the cycle in which it is due, so that one due at the end is taken too.
  while (pictures_.size() < at_.size() && at_[pictures_.size()] < t + cycle_ - rounding) take_picture(t, arm);
  if (scanner_ && t >= scene_.scanner->begin - rounding && t <= scene_.scanner->end.value_or(t) + rounding)
    take_profile(t, arm);
}

void SceneSensors::take_picture(double t, DrivenArm& arm) {
  const Pose T_base_flange = arm.arm().T_base_flange();
  ScenePicture picture{t, arm.read().position, T_base_flange,
                       predict::camera_scene(cell_, T_base_flange, scene_.objects.solids)};
  const std::string why = reason_of_empty_picture(picture.scene);
  require(why.empty(), "camera.at[" + std::to_string(pictures_.size()) + "]: at " + seconds(t) +
                           " nothing is in the picture" + why + "; move the arm, or choose another time");
  pictures_.push_back(std::move(picture));
}

void SceneSensors::take_profile(double t, DrivenArm& arm) {
  const ArmReading& now = arm.read();
  const Pose T_base_flange = arm.arm().T_base_flange(), T_base_scanner = T_base_flange * scanner_->T_flange_scanner();
  const Vector6 v = arm.arm().sensor_velocity();
  const Vector3d lever = T_base_scanner.translation() - arm.arm().T_base_sensor().translation();
  const double speed = (v.head<3>() + v.tail<3>().cross(lever)).dot(T_base_scanner.linear().col(1));
  const Profile& profile = scanner_->read(T_base_flange, speed);
  range_ = std::numeric_limits<double>::quiet_NaN();
  for (Eigen::Index k = 0; k < profile.x.size(); ++k) {
    const int object = profile.object[static_cast<std::size_t>(k)];
    if (object < 0) continue;
    if (!(profile.z[k] >= range_)) range_ = profile.z[k];
    std::vector<double> row = {static_cast<double>(lines_), t, speed};
    row.insert(row.end(), now.position.begin(), now.position.end());
    const bool ball = scanner_->objects()[static_cast<std::size_t>(object)].kind == SolidKind::Ball;
    row.insert(row.end(), {profile.x[k], profile.z[k], ball ? 1.0 : 0.0});
    profiles_.push_back(std::move(row));
  }
  ++lines_;
}

void SceneSensors::report(SceneResult& out) const {
  out.pictures = pictures_;
  if (!scanner_) return;
  require(lines_ > 0, "scanner.begin: no profile between begin and end");
  const auto centimetres = [](double z) { return std::to_string(static_cast<int>(std::lround(100.0 * z))) + " cm"; };
  require(
      !profiles_.empty(),
      "scanner: of " + std::to_string(lines_) + " profiles none meets an object from scanner.near to scanner.far, " +
          centimetres(scene_.scanner->near) + " to " + centimetres(scene_.scanner->far) + " away; " +
          (std::isfinite(scanner_->nearest()) ? "the nearest object is " + centimetres(scanner_->nearest()) + " away"
                                              : std::string("no object lies in its plane")));
  std::vector<std::string> names = {"line", "t", "speed"};
  for (int i = 1; i <= cell_.robot.joints(); ++i) names.push_back("q" + std::to_string(i));
  names.insert(names.end(), {"x", "z", "sphere"});
  RowTable rows(names);
  for (const auto& row : profiles_) rows.add(row);
  out.profiles = rows.table();
}

}  // namespace kr5::sim
