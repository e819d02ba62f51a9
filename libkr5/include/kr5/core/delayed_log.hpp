// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace kr5 {

/// What a log shows of columns that are written `delay` [s] late, or early if it is negative: each row as it was that
/// much earlier, linear between rows, held before the first and behind the last.
Eigen::MatrixXd delayed_log(const Eigen::Ref<const Eigen::VectorXd>& t, const Eigen::Ref<const Eigen::MatrixXd>& values,
                            double delay);

}  // namespace kr5
