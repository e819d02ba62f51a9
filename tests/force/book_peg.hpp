#pragma once

#include <cmath>

#include <kr5/force/peg_on_tube.hpp>
#include <kr5/force/peg_tube_contact.hpp>

/// @file
/// The peg and the tube of the book, in both descriptions, and how the peg stands on it.

namespace kr5::test {

constexpr double degree = M_PI / 180, micron = 1e-6;
const force::PegTube radii{.peg_radius = 9.42e-3, .inner_radius = 9.7e-3, .outer_radius = 12.65e-3};
const force::PegTubeShape book{.peg_radius = radii.peg_radius,
                               .peg_length = 50e-3,
                               .inner_radius = radii.inner_radius,
                               .outer_radius = radii.outer_radius,
                               .tube_depth = 60e-3};

/// Leaning towards alpha without a turn about its own axis.
inline Pose leaning(double tilt, double alpha, const Eigen::Vector3d& centre) {
  return Eigen::Translation3d(centre) * Eigen::AngleAxisd(alpha, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(tilt, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(-alpha, Eigen::Vector3d::UnitZ()) *
         Eigen::Isometry3d::Identity();
}

}  // namespace kr5::test
