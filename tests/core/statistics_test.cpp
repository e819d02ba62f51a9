// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/statistics.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/random.hpp>

namespace statistics_test {

namespace {

using Eigen::VectorXd;

TEST_CASE("the middle of an even number of values is the upper one, or the mean of both") {
  CHECK(kr5::median({4.0, 1.0, 3.0, 2.0}) == 3.0);
  CHECK(kr5::midpoint_median({4.0, 1.0, 3.0, 2.0}) == 2.5);
  CHECK(kr5::midpoint_median({9.0, 1.0, 3.0}) == 3.0);
  CHECK(kr5::midpoint_median({7.0}) == 7.0);
  CHECK(kr5::midpoint_median({}) == 0.0);
}

TEST_CASE("noise of a series: beside motion, a step and outliers", "[core]") {
  constexpr double sigma = 0.02;
  constexpr Eigen::Index n = 20000;
  const VectorXd t = VectorXd::LinSpaced(n, 0.0, 80.0);
  VectorXd x = 3.0 * (2.0 * t).array().sin() + sigma * kr5::Random(4).normal_vector(n).array();
  x.tail(n / 2).array() += 5.0;
  for (Eigen::Index i = 7; i < n; i += 100) x[i] += 2.0;
  // A hundredth of outliers, four differences each, moves the median by some 4 %; the estimate itself scatters by 1 %.
  CHECK(kr5::difference_noise(x) == Approx(sigma).epsilon(0.08));
}

TEST_CASE("noise of readings: of coarse ones that of their step", "[core]") {
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(1000, 0, 0.5);
  const Eigen::VectorXd coarse = (t / 0.01).array().round() * 0.01;
  CHECK(kr5::reading_noise(coarse) == Approx(0.01 / std::sqrt(12.0)));
  const Eigen::VectorXd fine = t + 1e-3 * kr5::Random(2).normal_vector(t.size());
  CHECK(kr5::reading_noise(fine) == kr5::difference_noise(fine));
  CHECK(kr5::reading_noise(Eigen::VectorXd::Constant(10, 2.0)) == 0.0);
}

TEST_CASE("signs of values are known from two standard deviations on, unless hardly any is", "[core]") {
  const Eigen::ArrayXd values = (Eigen::ArrayXd(4) << 1.0, -3.0, 2.0, 0.0).finished();
  CHECK((kr5::known_signs(values, 1.0) == (Eigen::ArrayXd(4) << 0, 1, 1, 0).finished()).all());
  CHECK((kr5::known_signs(values, 0.0) == 1.0).all());
  CHECK((kr5::known_signs(values, 100.0) == 1.0).all());
}

TEST_CASE("noise of a series: none of a few values, and none between coarse steps", "[core]") {
  CHECK(kr5::difference_noise(VectorXd()) == 0.0);
  CHECK(kr5::difference_noise(VectorXd::Random(3)) == 0.0);
  const VectorXd coarse = VectorXd::LinSpaced(100, 0.0, 4.0).array().floor();
  CHECK(kr5::difference_noise(coarse) == 0.0);
}

}  // namespace

}  // namespace statistics_test
