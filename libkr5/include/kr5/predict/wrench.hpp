// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/effects.hpp>

#include <kr5/predict/given.hpp>

namespace kr5::predict {

/// What the force sensor shows of a wrench (N x 6, changed in place): scale, crosstalk, bias and drift, then the lag of
/// its filter, which starts anew with each run.
void sense(const cell::Effects& effects, const Eigen::VectorXd& t, const std::vector<Run>& runs,
           Eigen::Ref<Eigen::MatrixXd> wrench);

}  // namespace kr5::predict
