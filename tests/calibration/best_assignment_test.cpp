#include "calibration/best_assignment.hpp"

#include <algorithm>
#include <limits>
#include <numeric>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

namespace best_assignment_test {

using namespace kr5;
using namespace kr5::calibration;

namespace {

double sum_of(const Eigen::MatrixXd& cost, const std::vector<int>& column) {
  double out = 0.0;
  for (std::size_t i = 0; i < column.size(); ++i) out += cost(static_cast<Eigen::Index>(i), column[i]);
  return out;
}

}  // namespace

TEST_CASE("no permutation costs less, negative costs and ties included") {
  Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 1 + random.integer(6);
    Eigen::MatrixXd cost = Eigen::MatrixXd::NullaryExpr(n, n, [&] { return random.normal(); });
    if (trial % 3 == 0) cost = cost.array().round();
    const std::vector<int> found = best_assignment(cost);
    std::vector<int> order(static_cast<std::size_t>(n));
    std::iota(order.begin(), order.end(), 0);
    CHECK(std::is_permutation(order.begin(), order.end(), found.begin(), found.end()));
    double least = std::numeric_limits<double>::infinity();
    do least = std::min(least, sum_of(cost, order));
    while (std::next_permutation(order.begin(), order.end()));
    CHECK(sum_of(cost, found) == Approx(least).margin(1e-12));
  }
}

TEST_CASE("nothing is assigned to nothing; NaN and matrices that are not square are refused") {
  CHECK(best_assignment(Eigen::MatrixXd(0, 0)).empty());
  CHECK_THROWS_AS(best_assignment(Eigen::MatrixXd::Zero(2, 3)), InvalidArgument);
  CHECK_THROWS_AS(best_assignment(Eigen::MatrixXd::Constant(2, 2, std::numeric_limits<double>::quiet_NaN())),
                  InvalidArgument);
}

}  // namespace best_assignment_test
