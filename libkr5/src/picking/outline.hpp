// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <Eigen/Core>

#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/pose.hpp>

#include "solid_cylinder.hpp"

namespace kr5::picking {

/// A line or an arc of the outline of a cylinder.
enum class OutlinePart {
  Left,     ///< Line where the line of sight touches the side.
  Right,    ///< The other one.
  Near,     ///< Of the rim of the end that is seen: between side and end face.
  Far,      ///< The rest of that rim.
  Away,     ///< Visible half of the rim of an end that is not seen; of the upper end where neither is.
  AwayToo,  ///< Of the lower end, where neither is seen.
};
constexpr int outline_parts = 6;

/// A place on the outline. It is bound to the cylinder: on a line by the share of the half height, on an arc by end and
/// angle.
struct OutlinePoint {
  OutlinePart part = OutlinePart::Left;
  double end = 0.0;    ///< z over half the height; 1 or -1 on an arc [-].
  double angle = 0.0;  ///< On an arc [rad].
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  Eigen::Vector2d normal = Eigen::Vector2d::UnitX();  ///< Square to the outline in the image.
};

/// Steps of a cylinder and a camera: centre in the frame of the cylinder, tilts about its first two axes, radius,
/// height; perturbation of T_camera_base.
constexpr int outline_steps = 13;
using OutlineRow = Eigen::Matrix<double, 1, outline_steps>;

/// A cylinder before a camera.
struct OutlineView {
  SolidCylinder cylinder;
  Pose T_camera_base = Pose::Identity();

  OutlineView moved(const Eigen::Matrix<double, outline_steps, 1>& step) const;
};

/// Places `spacing` [px] apart on the visible outline, where it lies in front of the camera. Those nearer than that to
/// another part are left out: there edges run together.
std::vector<OutlinePoint> outline(const OutlineView& view, const Pinhole& camera, double spacing);

/// The place on the surface in the base [m]; on a line, where the line of sight touches now.
Eigen::Vector3d outline_place(const OutlineView& view, const OutlinePoint& point);

/// Where it shows, along its normal [px], from `pixel`; and the derivative by the steps. How the place wanders along
/// the surface does not matter: along the line of sight, to first order.
double outline_offset(const OutlineView& view, const Pinhole& camera, const OutlinePoint& point, OutlineRow* by_steps);

}  // namespace kr5::picking
