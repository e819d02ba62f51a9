// SPDX-License-Identifier: BSD-3-Clause
#include "neighbour_correlation.hpp"

#include <algorithm>

namespace kr5::arm_log {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double neighbour_correlation(const Eigen::Ref<const VectorXd>& x) {
  const double power = x.squaredNorm();
  const Index n = x.size();
  return power > 0 ? std::clamp(x.tail(n - 1).dot(x.head(n - 1)) / power, 0.0, 0.999) : 0.0;
}

MatrixXd stacked_rows(const std::vector<MatrixXd>& parts) {
  Index rows = 0;
  for (const MatrixXd& part : parts) rows += part.rows();
  MatrixXd out(rows, parts.empty() ? 0 : parts.front().cols());
  Index at = 0;
  for (const MatrixXd& part : parts) {
    out.middleRows(at, part.rows()) = part;
    at += part.rows();
  }
  return out;
}

}  // namespace kr5::arm_log
