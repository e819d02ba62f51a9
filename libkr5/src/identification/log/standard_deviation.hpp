// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace kr5::identification {

/// Of the values about their mean.
inline double standard_deviation(const Eigen::VectorXd& x) { return std::sqrt((x.array() - x.mean()).square().mean()); }

}  // namespace kr5::identification
