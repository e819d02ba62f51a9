// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <kr5/force/peg_on_tube.hpp>

#include <kr5/predict/contact.hpp>
#include <kr5/predict/wrench.hpp>
#include "predict/kinds.hpp"

namespace kr5::predict {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

std::span<const double> span(const VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }

}  // namespace

Shown profile(const cell::Cell& cell, const Given& given) {
  given.need(cell.contact.has_value(), "contact");
  given.need(cell.peg.has_value(), "peg");
  given.need(cell.tube.has_value(), "tube");
  const RealContact contact(cell);
  const VectorXd tilt = given["tilt"], alpha = given["alpha"], held = given["fc"];
  Eigen::MatrixX3d friction(given.rows(), 3);  // on the peg, in T
  friction << (contact.friction() * held.array() * alpha.array().sin()).matrix(),
      (-contact.friction() * held.array() * alpha.array().cos()).matrix(), VectorXd::Zero(given.rows());
  const double lateral = cell.effects.task.lateral;
  const VectorXd cx = given["cx"] + lateral * friction.col(0), cy = given["cy"] + lateral * friction.col(1);
  VectorXd z(given.rows());
  const force::PegTube bodies{cell.peg->radius, real_inner_radius(cell), cell.tube->outer_radius};
  force::resting_heights(bodies, real_tube(cell.effects.task), span(tilt), span(alpha), span(cx), span(cy),
                         {z.data(), static_cast<std::size_t>(z.size())});
  for (Index k = 0; k < z.size(); ++k) z[k] -= contact.depth(held[k]);
  Shown out(given.rows());
  out.add("z", z);
  if (!cell.tool) return out;
  const Eigen::MatrixX3d on_peg = friction * cell.tube->T_B_T.linear().transpose();
  Eigen::MatrixXd wrench = tool_weight(cell, given.rows());
  wrench.col(0) += on_peg.col(0);
  wrench.col(1) -= on_peg.col(1);
  wrench.col(2) -= held;
  sense(cell.effects, given["t"], given.runs(), wrench);
  out.add_wrench(wrench);
  return out;
}

}  // namespace kr5::predict
