#pragma once

#include <catch2/catch.hpp>

#include <kr5/fit/problem.hpp>

/// @file
/// Derivatives of any measurement against finite differences of its residuals.

namespace kr5::test {

/// Checks a measurement of a problem of which nothing is held; `blocks` in the order in which they were added. What a
/// block's numbers are multiplied by is `step`.
inline void check_derivatives(fit::Problem& problem, fit::FitMeasurement measurement,
                              const std::vector<fit::FitBlock>& blocks, double step = 1e-6) {
  const auto at = problem.derivatives(measurement);
  REQUIRE(at);
  CHECK(at->residuals == problem.residuals(measurement));
  Eigen::MatrixXd J(at->by_coordinate.rows(), at->by_coordinate.cols());
  Eigen::Index column = 0;
  for (const fit::FitBlock block : blocks) {
    const Eigen::VectorXd values = problem.values(block);
    const Eigen::Index coordinates = problem.change(block).size();
    for (Eigen::Index k = 0; k < coordinates; ++k) {
      const auto moved = [&](double by) {
        if (values.size() == coordinates) {
          problem.begin_at(block, Eigen::VectorXd(values + by * Eigen::VectorXd::Unit(coordinates, k)));
        } else {
          const Pose T = problem.pose(block);
          problem.begin_at(block, T * to_pose(Vector6(by * Vector6::Unit(k))));
        }
        const Eigen::VectorXd r = problem.residuals(measurement);
        problem.begin_at(block, values);
        return r;
      };
      J.col(column++) = (moved(step) - moved(-step)) / (2 * step);
    }
  }
  REQUIRE(column == J.cols());
  CAPTURE(J, at->by_coordinate);
  CHECK((at->by_coordinate - J).norm() < 1e-6 * J.norm());
}

}  // namespace kr5::test
