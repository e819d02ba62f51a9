// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

namespace kr5::physics {

/// Rows [first, last) of a table that belong together: one run, line, view or pose.
struct RowRange {
  Eigen::Index first = 0;
  Eigen::Index last = 0;

  Eigen::Index size() const { return last - first; }
};

}  // namespace kr5::physics
