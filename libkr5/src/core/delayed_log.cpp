// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/delayed_log.hpp>

#include <algorithm>

namespace kr5 {

Eigen::MatrixXd delayed_log(const Eigen::Ref<const Eigen::VectorXd>& t, const Eigen::Ref<const Eigen::MatrixXd>& values,
                            double delay) {
  Eigen::MatrixXd out = values;
  if (delay == 0.0) return out;
  Eigen::Index before = 0;
  for (Eigen::Index row = 0; row < t.size(); ++row) {
    const double then = t[row] - delay;
    while (before > 0 && t[before] > then) --before;
    while (before + 1 < t.size() && t[before + 1] <= then) ++before;
    const bool inside = before + 1 < t.size() && then > t[before];
    const double part = inside ? (then - t[before]) / (t[before + 1] - t[before]) : 0.0;
    if (part > 0.0)
      out.row(row) = (1.0 - part) * values.row(before) + part * values.row(before + 1);
    else
      out.row(row) = values.row(before);  // what is at that very time counts, whatever comes after
  }
  return out;
}

}  // namespace kr5
