#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/uncertainty/confidence.hpp>

namespace confidence_test {

using namespace kr5;
using namespace kr5::uncertainty;

TEST_CASE("factors of the confidence ellipsoid agree with the book's table") {
  // Hayat et al. 2022, eq. 3.15: C for K = 1, 2, 3 at 95 % and 99 %.
  const double table[3][2] = {{1.960, 2.576}, {2.448, 3.035}, {2.796, 3.368}};
  for (int k = 1; k <= 3; ++k) {
    CHECK(std::sqrt(chi_square_quantile(0.95, k)) == Approx(table[k - 1][0]).margin(6e-4));
    CHECK(std::sqrt(chi_square_quantile(0.99, k)) == Approx(table[k - 1][1]).margin(6e-4));
  }
  CHECK(chi_square_cdf(chi_square_quantile(0.37, 5), 5) == Approx(0.37));
}

TEST_CASE("the inflation of an estimated covariance agrees with the tables of Fisher's F and of chi-square") {
  CHECK(covariance_inflation(1, 9) == Approx(2.262 * 2.262 / 3.841).epsilon(1e-3));  // Student's t, squared
  CHECK(covariance_inflation(3, 8) == Approx(3 * 4.066 / 7.815).epsilon(1e-3));
  CHECK(covariance_inflation(6, 4) == Approx(6 * 6.163 / 12.592).epsilon(1e-3));
  CHECK(covariance_inflation(6, known_noise) == Approx(1).epsilon(1e-4));
  CHECK_THROWS_AS(covariance_inflation(6, 0), InvalidArgument);
}

TEST_CASE("binomial interval is exact at its ends") {
  CHECK(binomial_interval(0, 10).low == 0.0);
  CHECK(binomial_interval(0, 10).high == Approx(1 - std::pow(0.025, 0.1)));
  CHECK(binomial_interval(10, 10).low == Approx(std::pow(0.025, 0.1)));
  CHECK(binomial_interval(10, 10).high == 1.0);
  CHECK_THROWS_AS(binomial_interval(3, 2), InvalidArgument);
  CHECK_THROWS_AS(binomial_interval(0, 0), InvalidArgument);
}

TEST_CASE("ellipsoid holds a normal vector as often as it says") {
  Eigen::Matrix3d L;
  L << 2, 0, 0, 0.5, 1, 0, -1, 0.3, 0.2;
  const Ellipsoid e = confidence_ellipsoid(L * L.transpose(), 0.9);
  CHECK(e.semi_axes[0] >= e.semi_axes[1]);
  CHECK(e.semi_axes[1] >= e.semi_axes[2]);
  Random random(11);
  int inside = 0;
  const int trials = 4000;
  for (int i = 0; i < trials; ++i) {
    const Eigen::Vector3d x = L * random.normal_vector(3);
    inside += (e.directions.transpose() * x).cwiseQuotient(e.semi_axes).norm() < 1;
  }
  CHECK(binomial_interval(inside, trials, 0.999).contains(0.9));
}

TEST_CASE("a matrix that is no covariance is refused") {
  Eigen::Matrix2d m;
  m << 1, 2, 2, 1;
  CHECK_THROWS_AS(confidence_ellipsoid(m), InvalidArgument);
  CHECK_THROWS_AS(confidence_ellipsoid(Eigen::MatrixXd::Zero(2, 3)), InvalidArgument);
}

TEST_CASE("Fisher's F agrees with its tables, and becomes the chi-square for many degrees of freedom") {
  using namespace kr5::uncertainty;
  CHECK(fisher_quantile(0.95, 3, 6) == Approx(4.757).epsilon(1e-3));
  CHECK(fisher_cdf(fisher_quantile(0.9, 2, 7), 2, 7) == Approx(0.9));
  CHECK(3 * fisher_quantile(0.95, 3, 1e7) == Approx(chi_square_quantile(0.95, 3)).epsilon(1e-4));
}

TEST_CASE("arguments that are no finite numbers are refused in words, and infinity is certain") {
  const double infinite = std::numeric_limits<double>::infinity(), none = std::nan("");
  CHECK(chi_square_cdf(infinite, 3) == 1.0);
  CHECK(fisher_cdf(infinite, 3, 4) == 1.0);
  CHECK(chi_square_cdf(-infinite, 3) == 0.0);
  for (const double bad : {infinite, none, 0.0, -1.0}) {
    CAPTURE(bad);
    CHECK_THROWS_AS(chi_square_quantile(0.9, bad), InvalidArgument);
    CHECK_THROWS_AS(student_factor(bad), InvalidArgument);
    CHECK_THROWS_AS(fisher_quantile(0.9, 3, bad), InvalidArgument);
  }
  CHECK_THROWS_AS(chi_square_cdf(none, 3), InvalidArgument);
  CHECK_THROWS_AS(fisher_cdf(none, 3, 4), InvalidArgument);
}

}  // namespace confidence_test
