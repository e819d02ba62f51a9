// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>

#include <Eigen/Core>

namespace kr5::vision {

/// Homography of least squared distances that takes points `from` to `to` (2 x n each, at least four); nothing where
/// the points do not determine it.
std::optional<Eigen::Matrix3d> fit_homography(const Eigen::Matrix2Xd& from, const Eigen::Matrix2Xd& to);

}  // namespace kr5::vision
