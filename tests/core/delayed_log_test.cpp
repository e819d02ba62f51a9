// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/delayed_log.hpp>

#include <algorithm>

#include <catch2/catch.hpp>

namespace delayed_log_test {

using namespace kr5;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST_CASE("a delayed log of a straight line is the line, that much later or earlier, and held at its ends") {
  const VectorXd t = VectorXd::LinSpaced(101, 2.0, 3.0);
  const MatrixXd values = 3.0 * t;
  for (const double delay : {0.037, -0.037, 5.0, -5.0}) {
    const MatrixXd shown = delayed_log(t, values, delay);
    for (Eigen::Index k = 0; k < t.size(); ++k)
      CHECK(shown(k, 0) == Approx(3.0 * std::clamp(t[k] - delay, 2.0, 3.0)).epsilon(1e-12));
  }
  CHECK(delayed_log(t, values, 0.0) == values);
}

TEST_CASE("a delayed log of rows at the same time, or none, has no division by zero") {
  const VectorXd t = (VectorXd(4) << 0.0, 1.0, 1.0, 2.0).finished();
  const MatrixXd shown = delayed_log(t, MatrixXd((MatrixXd(4, 1) << 0.0, 1.0, 5.0, 6.0).finished()), 0.5);
  CHECK(shown.isApprox((MatrixXd(4, 1) << 0.0, 0.5, 0.5, 5.5).finished(), 1e-14));
  CHECK(delayed_log(VectorXd(0), MatrixXd(0, 2), 0.5).rows() == 0);
}

}  // namespace delayed_log_test
