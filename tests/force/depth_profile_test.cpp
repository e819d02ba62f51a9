#include <kr5/force/depth_profile.hpp>

#include <cmath>
#include <limits>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/force/fit_tube.hpp>
#include <support/trials.hpp>

#include "book_peg.hpp"

namespace depth_profile_test {

using namespace kr5;
using namespace kr5::force;
using namespace kr5::test;

namespace {

const Eigen::Vector2d book_centre(-7.53e-3, -7.2e-3);
constexpr double book_tilt = 7.5 * degree, mm = 1e-3;

PegTube drawn_bodies(Random& random) {
  const double bore = random.uniform(5e-3, 30e-3);
  return {.peg_radius = bore - random.uniform(0.02e-3, 1e-3),
          .inner_radius = bore,
          .outer_radius = bore + random.uniform(1e-3, 5e-3)};
}

struct Rows {
  std::vector<double> azimuth, height;
};

Rows profile(const PegTube& bodies, double tilt, const Eigen::Vector2d& centre, int count, double face, double noise,
             Random& random) {
  Rows out;
  for (int k = 0; k < count; ++k) {
    out.azimuth.push_back(2 * M_PI * k / count);
    out.height.push_back(face + rest_peg_on_tube(bodies, tilt, out.azimuth.back(), centre).height +
                         noise * random.normal());
  }
  return out;
}

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * M_PI)); }

}  // namespace

TEST_CASE("the example of the book: the cusp towards the hole, the smooth minimum away from it") {
  const auto minima = depth_minima(radii, book_tilt, book_centre);
  REQUIRE(minima.size() == 2);
  CHECK(minima[0].azimuth / degree + 90 == Approx(133.72).margin(0.005));
  CHECK(minima[1].azimuth / degree + 90 == Approx(313.72).margin(0.005));
  CHECK(minima[0].cusp);
  CHECK_FALSE(minima[1].cusp);
  CHECK(minima[0].bend > 0);
  CHECK(minima[1].bend == 0);
  CHECK(minima[0].height / mm == Approx(0.6493).margin(5e-5));
  CHECK(minima[1].height / mm == Approx(0.2938).margin(5e-5));
  CHECK(minima[1].height < minima[0].height);  // the lowest place leads away from the hole
}

TEST_CASE("minima are those of the exact profile, for any bodies, tilt and place") {
  Random random(41);
  int cusps = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const PegTube bodies = drawn_bodies(random);
    const double tilt = random.uniform(2, 25) * degree;
    const double reach = random.uniform(0.05, 1.2) * bodies.outer_radius, towards = random.uniform(0, 2 * M_PI);
    const Eigen::Vector2d centre = reach * Eigen::Vector2d(std::cos(towards), std::sin(towards));
    for (const DepthMinimum& m : depth_minima(bodies, tilt, centre)) {
      cusps += m.cusp;
      double least = std::numeric_limits<double>::infinity(), at = 0.0;
      for (int k = -4000; k <= 4000; ++k) {  // 0.001 of a degree about it, and the point itself
        const double azimuth = m.azimuth + k * 1e-3 * degree;
        const double height = rest_peg_on_tube(bodies, tilt, azimuth, centre).height;
        if (height < least) least = height, at = azimuth;
      }
      CHECK(std::abs(m.height - least) < 1e-10);  // 1e-7 mm
      CHECK(angle_between(at, m.azimuth) < 1.1e-3 * degree);
      CHECK(m.azimuth >= 0);
      CHECK(m.azimuth < 2 * M_PI);
    }
  }
  CHECK(cusps > 200);
}

TEST_CASE("closed forms of the depths on the line of symmetry") {
  const double c = book_centre.norm(), t = std::tan(book_tilt), r = radii.peg_radius;
  const auto minima = depth_minima(radii, book_tilt, book_centre);
  const double inner = -c / t + std::sqrt(c * c / t / t + r * r + c * c - std::pow(radii.inner_radius, 2));  // (5.38)
  CHECK(std::abs(minima[0].height - inner) < 1e-10);
  CHECK(std::abs(minima[1].height - t * (radii.outer_radius - c)) < 1e-10);  // (5.35)
}

TEST_CASE("the difference of the minima for the two pegs of the book") {
  const auto difference = [](double r, double wall) {
    const PegTube bodies{.peg_radius = r, .inner_radius = r + 0.28e-3, .outer_radius = r + 0.28e-3 + wall};
    const auto minima = depth_minima(bodies, book_tilt, {0.0, (bodies.inner_radius + bodies.outer_radius) / 2});
    return minima.at(0).height - minima.at(1).height;
  };
  CHECK(difference(9.42e-3, 2.95e-3) / mm == Approx(0.507).margin(5e-4));
  CHECK(difference(24e-3, 2.95e-3) / mm == Approx(1.460).margin(5e-4));
}

TEST_CASE("below the critical offset the lowest minimum is the hole's, above it the other") {
  CHECK(critical_offset(radii, book_tilt) / mm == Approx(8.650).margin(5e-4));
  Random random(42);
  int both = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const PegTube bodies = drawn_bodies(random);
    const double tilt = random.uniform(3, 20) * degree, critical = critical_offset(bodies, tilt);
    for (const double part : {0.98, 1.0, 1.02}) {
      const auto minima = depth_minima(bodies, tilt, {part * critical, 0.0});
      if (minima.size() < 2 || !minima[0].cusp || minima[1].kind != RestContact::FaceOnOuterEdge) continue;
      ++both;
      const double above = minima[0].height - minima[1].height;
      if (part == 1.0) CHECK(std::abs(above) < 1e-10);
      if (part != 1.0) CHECK((above > 0) == (part > 1));
    }
  }
  CHECK(both > 100);
}

TEST_CASE("a tenth of a millimetre turns the hole's direction by six degrees, of a large peg by two") {
  const auto over_the_wall = [](const PegTube& bodies) {
    const Eigen::Vector2d centre(0.0, (bodies.inner_radius + bodies.outer_radius) / 2);
    return azimuth_error(bodies, book_tilt, centre, 0.1e-3) / degree;
  };
  // The reference was read off a grid of a quarter of a degree.
  CHECK(over_the_wall(radii) == Approx(6.0).margin(0.25));
  CHECK(over_the_wall({.peg_radius = 24e-3, .inner_radius = 24.28e-3, .outer_radius = 27.23e-3}) ==
        Approx(2.125).margin(0.25));
  CHECK(azimuth_error(radii, book_tilt, book_centre, 0.0) < 1e-12);
  CHECK(azimuth_error(radii, book_tilt, book_centre, 1.0) == Approx(M_PI));
}

TEST_CASE("a depth map holds the resting height of every centre") {
  const std::vector<double> x = {-12e-3, -6e-3, 0.0, 6e-3}, y = {-9e-3, 0.0, 5e-3};
  const Eigen::MatrixXd map = depth_map(radii, 10 * degree, 0.3, x, y);
  REQUIRE(map.rows() == 3);
  REQUIRE(map.cols() == 4);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) {
      const double height = rest_peg_on_tube(radii, 10 * degree, 0.3, {x[j], y[i]}).height;
      CHECK((map(i, j) == height || (std::isnan(map(i, j)) && std::isnan(height))));
    }
}

TEST_CASE("a fit of the whole profile finds the tube, near and far, for any bodies") {
  Random random(43);
  int tried = 0;
  for (int trial = 0; trial < 120; ++trial) {
    const PegTube bodies = drawn_bodies(random);
    const double tilt = random.uniform(4, 20) * degree, towards = random.uniform(0, 2 * M_PI);
    const Eigen::Vector2d centre =
        random.uniform(0.1, 1.0) * bodies.outer_radius * Eigen::Vector2d(std::cos(towards), std::sin(towards));
    const Rows rows = profile(bodies, tilt, centre, 180, 0.2, 0.0, random);
    if (std::isnan(*std::min_element(rows.height.begin(), rows.height.end()))) continue;
    const auto minima = depth_minima(bodies, tilt, centre);
    if (minima.empty() || !minima[0].cusp) continue;
    const TubeFit fit = fit_tube(bodies, tilt, rows.azimuth, rows.height);
    ++tried;
    INFO(trial << " offset " << centre.norm() / bodies.outer_radius << " rms " << fit.rms);
    CHECK(fit.report.usable());
    CHECK((fit.centre - centre).norm() < 1e-8);
    CHECK(fit.face == Approx(0.2).margin(1e-8));
    CHECK(angle_between(fit.azimuth, minima[0].azimuth) < 1e-5);
  }
  CHECK(tried > 60);
}

TEST_CASE("what a fit says of its uncertainty holds the truth as often as it says", "[statistics]") {
  constexpr double noise = 0.03e-3, chi_square_95 = 7.815;
  const int trials = test::trials(2000, 300);
  Random random(44);
  int inside = 0, near = 0, by_least = 0;
  double sum = 0.0;
  for (int trial = 0; trial < trials; ++trial) {
    const double towards = random.uniform(0, 2 * M_PI);
    const Eigen::Vector2d centre = random.uniform(5e-3, 11e-3) * Eigen::Vector2d(std::cos(towards), std::sin(towards));
    const Rows rows = profile(radii, book_tilt, centre, 120, 0.0, noise, random);
    const TubeFit fit = fit_tube(radii, book_tilt, rows.azimuth, rows.height, {.noise = noise});
    const Eigen::Vector3d error(fit.centre.x() - centre.x(), fit.centre.y() - centre.y(), fit.face);
    const double d2 = error.dot(fit.covariance.inverse() * error);
    inside += d2 <= chi_square_95;
    sum += std::min(d2, 30.0);
    const double hole = std::atan2(-centre.y(), -centre.x());
    near += angle_between(fit.azimuth, hole) < 3 * degree;
    const auto least = std::min_element(rows.height.begin(), rows.height.end()) - rows.height.begin();
    by_least += angle_between(rows.azimuth[static_cast<std::size_t>(least)], hole) < 3 * degree;
  }
  const double spread = 4 * std::sqrt(0.05 * 0.95 / trials);
  CHECK(inside / static_cast<double>(trials) > 0.95 - spread);
  CHECK(inside / static_cast<double>(trials) < 0.95 + spread);
  CHECK(sum / trials == Approx(3.0).margin(4 * std::sqrt(6.0 / trials)));
  INFO(near << " by the fit, " << by_least << " by the least height, of " << trials);
  CHECK(near > 0.99 * trials);
  CHECK(near > by_least);
}

TEST_CASE("profiles that tell nothing are said to, and bad input is refused") {
  Random random(45);
  const Rows rows = profile(radii, book_tilt, book_centre, 90, 0.0, 0.0, random);
  const std::vector<double> few(rows.azimuth.begin(), rows.azimuth.begin() + 5), h5(few.size(), 0.0);
  CHECK(fit_tube(radii, book_tilt, few, h5).report.message.find("6") != std::string::npos);
  const std::vector<double> part(rows.azimuth.begin(), rows.azimuth.begin() + 20);
  const std::vector<double> low(rows.height.begin(), rows.height.begin() + 20);
  CHECK(fit_tube(radii, book_tilt, part, low).report.status == FitStatus::Degenerate);
  const PegTube wide{.peg_radius = 2e-3, .inner_radius = 1e-3, .outer_radius = 80e-3};
  const std::vector<double> flat(rows.azimuth.size(), 2e-3 * std::sin(book_tilt));
  CHECK_FALSE(fit_tube(wide, book_tilt, rows.azimuth, flat).report.usable());

  std::vector<double> bad = rows.height;
  bad[7] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH(fit_tube(radii, book_tilt, rows.azimuth, bad), Catch::Contains("row 8"));
  bad.pop_back();
  CHECK_THROWS_WITH(fit_tube(radii, book_tilt, rows.azimuth, bad), Catch::Contains("89"));
  CHECK_THROWS_WITH(depth_minima(radii, 0.0, book_centre), Catch::Contains("tilt"));
  CHECK_THROWS_WITH(depth_minima({.peg_radius = -1.0}, 0.1, book_centre), Catch::Contains("peg_radius"));
  CHECK_THROWS_WITH(azimuth_error(radii, book_tilt, {0.0, 30e-3}, 1e-4), Catch::Contains("cusp"));
  CHECK_THROWS_AS(fit_tube(radii, book_tilt, rows.azimuth, rows.height, {.noise = -1.0}), InvalidArgument);
  CHECK(depth_minima(radii, book_tilt, {0.0, 0.0}).empty());
}

}  // namespace depth_profile_test
