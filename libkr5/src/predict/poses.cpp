// SPDX-License-Identifier: BSD-3-Clause
#include "predict/real_arm.hpp"

namespace kr5::predict {

using Eigen::Index;

Shown poses(const cell::Cell& cell, const Given& given, const FlangeAt& flange) {
  Pose T_F_E = cell.tool ? cell.tool->T_F_E : Pose::Identity();
  T_F_E.translate(cell.effects.tool.offset);
  Postures postures(given, flange);
  Eigen::MatrixXd shown(given.rows(), 7);
  for (Index k = 0; k < given.rows(); ++k) {
    const Pose T_B_E = postures.flange(k) * T_F_E;
    Eigen::Quaterniond r(T_B_E.linear());
    if (r.w() < 0) r.coeffs() *= -1;
    shown.row(k) << T_B_E.translation().transpose(), r.w(), r.x(), r.y(), r.z();
  }
  Shown out(given.rows());
  Index column = 0;
  for (const char* name : {"x", "y", "z", "qw", "qx", "qy", "qz"}) out.add(name, shown.col(column++));
  return out;
}

}  // namespace kr5::predict
