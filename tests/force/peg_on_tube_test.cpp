#include <cmath>
#include <functional>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

#include "book_peg.hpp"

namespace peg_on_tube_test {

using namespace kr5;
using namespace kr5::force;
using namespace kr5::test;

namespace {

double golden_maximum(const std::function<double(double)>& f, double low, double high) {
  const double g = 0.5 * (std::sqrt(5.0) - 1);
  for (int i = 0; i < 90; ++i) {
    const double a = high - g * (high - low), b = low + g * (high - low);
    (f(a) > f(b) ? high : low) = f(a) > f(b) ? b : a;
  }
  return 0.5 * (low + high);
}

/// Greatest value on the parts of a closed curve where margin >= 0: samples, refined at the ends of every part, at
/// every best sample, and where a part might hide between samples.
double curve_maximum(const std::function<double(double)>& value, const std::function<double(double)>& margin) {
  constexpr int n = 720;
  constexpr double h = 2 * M_PI / n;
  double best = -1e300;
  const auto try_at = [&](double t) {
    if (margin(t) >= 0) best = std::max(best, value(t));
  };
  const auto end_of_part = [&](double inside, double outside) {
    for (int i = 0; i < 80; ++i) {
      const double middle = 0.5 * (inside + outside);
      (margin(middle) >= 0 ? inside : outside) = middle;
    }
    try_at(inside);
  };
  for (int i = 0; i < n; ++i) {
    const double t = i * h;
    const bool in = margin(t) >= 0, next = margin(t + h) >= 0;
    try_at(t);
    if (in != next) end_of_part(in ? t : t + h, in ? t + h : t);
    if (in && value(t) >= value(t - h) && value(t) >= value(t + h)) try_at(golden_maximum(value, t - h, t + h));
    if (!in && margin(t) >= margin(t - h) && margin(t) >= margin(t + h)) {
      const double peak = golden_maximum(margin, t - h, t + h);
      if (margin(peak) >= 0 && margin(t - h) < 0) end_of_part(peak, t - h);
      if (margin(peak) >= 0 && margin(t + h) < 0) end_of_part(peak, t + h);
    }
  }
  return best;
}

/// rim_height of the reference program, refined; -1e300 when nothing touches.
double brute_height(const PegTube& b, double tilt, double alpha, const Eigen::Vector2d& c) {
  const Eigen::Vector3d n(std::sin(tilt) * std::cos(alpha), std::sin(tilt) * std::sin(alpha), std::cos(tilt));
  const Eigen::Vector3d u = Eigen::Vector3d::UnitZ().cross(n).normalized(), w = n.cross(u);
  Eigen::Matrix2d A;
  A << u.head<2>(), w.head<2>();
  const Eigen::Matrix2d A_inv = A.inverse();
  const auto rise = [&](const Eigen::Vector2d& p) { return n.head<2>().dot(p - c) / n.z(); };
  const auto rim = [&](double t) -> Eigen::Vector2d {
    return c + b.peg_radius * (A * Eigen::Vector2d(std::cos(t), std::sin(t)));
  };
  double best = curve_maximum([&](double t) { return rise(rim(t)); },
                              [&](double t) {
                                const double rho = rim(t).norm();
                                return std::min(rho - b.inner_radius, b.outer_radius - rho);
                              });
  for (const double R : {b.inner_radius, b.outer_radius}) {
    const auto circle = [&](double t) { return Eigen::Vector2d(R * std::cos(t), R * std::sin(t)); };
    best = std::max(best, curve_maximum([&](double t) { return rise(circle(t)); },
                                        [&](double t) { return b.peg_radius - (A_inv * (circle(t) - c)).norm(); }));
  }
  return best;
}

struct Pose2 {
  PegTube bodies;
  double tilt, alpha;
  Eigen::Vector2d centre;
};

/// Pegs thinner and wider than bore and tube, over the bore, the wall, the edge and beside it.
Pose2 random_pose(Random& random) {
  Pose2 p;
  p.bodies.inner_radius = random.uniform(5e-3, 15e-3);
  p.bodies.outer_radius = p.bodies.inner_radius + random.uniform(0.3e-3, 6e-3);
  p.bodies.peg_radius = p.bodies.inner_radius * random.uniform(0.3, 2.0);
  p.tilt = random.uniform(-30, 30) * degree;
  p.alpha = random.uniform(-4, 8);
  const double reach = p.bodies.outer_radius + p.bodies.peg_radius;
  p.centre = Eigen::Vector2d(random.uniform(-reach, reach), random.uniform(-reach, reach));
  return p;
}

}  // namespace

TEST_CASE("the closed form is the maximum over all arcs to 1e-10 m") {
  Random random(1);
  int met[6] = {};
  double worst = 0;
  for (int i = 0; i < 3000; ++i) {
    const Pose2 p = random_pose(random);
    const PegRest rest = rest_peg_on_tube(p.bodies, p.tilt, p.alpha, p.centre);
    const double brute = brute_height(p.bodies, p.tilt, p.alpha, p.centre);
    ++met[static_cast<int>(rest.kind)];
    REQUIRE((rest.kind == RestContact::None) == (brute < -1e299));
    if (rest.kind != RestContact::None) worst = std::max(worst, std::abs(rest.height - brute));
  }
  CHECK(worst < 1e-10);
  for (const RestContact kind : {RestContact::None, RestContact::RimOnFace, RestContact::RimOnInnerEdge,
                                 RestContact::RimOnOuterEdge, RestContact::FaceOnOuterEdge})
    CHECK(met[static_cast<int>(kind)] > 20);
}

TEST_CASE("the height is continuous as the tilt goes to zero") {
  Random random(2);
  for (int i = 0; i < 500; ++i) {
    Pose2 p = random_pose(random);
    for (const double tilt : {1e-3, 1e-6, 1e-9, 1e-12}) {
      const PegRest upright = rest_peg_on_tube(p.bodies, 0, p.alpha, p.centre);
      const PegRest rest = rest_peg_on_tube(p.bodies, tilt, p.alpha, p.centre);
      const double gap = std::min(std::abs(p.centre.norm() + p.bodies.peg_radius - p.bodies.inner_radius),
                                  std::abs(p.centre.norm() - p.bodies.peg_radius - p.bodies.outer_radius));
      if (gap < p.bodies.peg_radius * tilt) continue;  // whether it touches at all depends on the tilt
      CAPTURE(tilt, i);
      REQUIRE((rest.kind == RestContact::None) == (upright.kind == RestContact::None));
      if (rest.kind == RestContact::None) continue;
      CHECK(upright.height == 0);
      CHECK(std::abs(rest.height) <= p.bodies.peg_radius * tilt * (1 + 1e-9));
    }
  }
}

TEST_CASE("derivatives of the height match differences") {
  Random random(3);
  int compared = 0;
  for (int i = 0; i < 2000; ++i) {
    const Pose2 p = random_pose(random);
    if (std::abs(p.tilt) < 1e-3) continue;
    const auto at = [&](double tilt, double alpha, double x, double y) {
      return rest_peg_on_tube(p.bodies, p.tilt + tilt, p.alpha + alpha, p.centre + Eigen::Vector2d(x, y));
    };
    constexpr double h = 1e-7;
    const PegRest rest = at(0, 0, 0, 0);
    if (rest.kind == RestContact::None || rest.by_centre.norm() > 3)
      continue;  // beside a tangent point the curvature is large
    const auto difference = [&](double tilt, double alpha, double step) {
      return (at(tilt * h, alpha * h, 0, 0).height - at(-tilt * h, -alpha * h, 0, 0).height) / (2 * step);
    };
    bool same = true;
    for (const int s : {-1, 1})
      same = same && at(s * h, 0, 0, 0).kind == rest.kind && at(0, s * h, 0, 0).kind == rest.kind &&
             at(0, 0, s * h, 0).kind == rest.kind && at(0, 0, 0, s * h).kind == rest.kind;
    if (!same) continue;
    ++compared;
    CAPTURE(i, name_of(rest.kind));
    CHECK(rest.by_tilt == Approx(difference(1, 0, h)).margin(1e-6).epsilon(1e-3));
    CHECK(rest.by_alpha == Approx(difference(0, 1, h)).margin(1e-6).epsilon(1e-3));
    CHECK(rest.by_centre.x() == Approx((at(0, 0, h, 0).height - at(0, 0, -h, 0).height) / (2 * h)).margin(1e-3));
    CHECK(rest.by_centre.y() == Approx((at(0, 0, 0, h).height - at(0, 0, 0, -h).height) / (2 * h)).margin(1e-3));
  }
  CHECK(compared > 800);
}

TEST_CASE("turning and mirroring the scene leaves the height") {
  Random random(4);
  for (int i = 0; i < 300; ++i) {
    const Pose2 p = random_pose(random);
    const double turn = random.uniform(-7, 7), height = rest_peg_on_tube(p.bodies, p.tilt, p.alpha, p.centre).height;
    const Eigen::Vector2d turned = Eigen::Rotation2Dd(turn) * p.centre, mirrored(p.centre.x(), -p.centre.y());
    if (std::isnan(height)) continue;
    CHECK(rest_peg_on_tube(p.bodies, p.tilt, p.alpha + turn, turned).height == Approx(height).margin(1e-12));
    CHECK(rest_peg_on_tube(p.bodies, p.tilt, -p.alpha, mirrored).height == Approx(height).margin(1e-12));
    CHECK(rest_peg_on_tube(p.bodies, -p.tilt, p.alpha + M_PI, p.centre).height == Approx(height).margin(1e-12));
  }
}

TEST_CASE("the book's example has its cusp at 133.7 and its smooth minimum at 313.7 degrees") {
  // The book counts the azimuth of the tilt axis, which is that of the lowest point plus 90 degrees.
  const Eigen::Vector2d centre(-7.53e-3, -7.2e-3);
  const auto height = [&](double azimuth) {
    return rest_peg_on_tube(radii, 7.5 * degree, (azimuth - 90) * degree, centre).height;
  };
  const double cusp = golden_maximum([&](double a) { return -height(a); }, 100, 170);
  const double smooth = golden_maximum([&](double a) { return -height(a); }, 280, 350);
  CHECK(cusp == Approx(133.72).margin(0.01));
  CHECK(smooth == Approx(313.72).margin(0.01));
  CHECK(height(cusp) == Approx(0.6493e-3).margin(1e-7));
  CHECK(height(smooth) == Approx(0.2938e-3).margin(1e-7));
  const auto bend = [&](double a) { return height(a + 0.1) + height(a - 0.1) - 2 * height(a); };
  CHECK(bend(cusp) > 50 * bend(smooth));
  const double direction = std::atan2(7.2, 7.53);
  CHECK(direction / degree == Approx(cusp - 90).margin(0.01));
  const PegRest rest = rest_peg_on_tube(radii, 7.5 * degree, 0, Eigen::Vector2d(-10.418e-3, 0));
  CHECK(rest.kind == RestContact::RimOnInnerEdge);
  CHECK((rest.mirrored - Eigen::Vector2d(rest.point.x(), -rest.point.y())).norm() < 1e-15);
  CHECK(rest.by_centre.x() < 0);  // towards the bore the peg sinks
}

TEST_CASE("the plateau is the radius times the sine of the tilt") {
  const PegRest rest = rest_peg_on_tube(radii, 7.5 * degree, 0, Eigen::Vector2d(1.5e-3, 0));
  CHECK(rest.kind == RestContact::RimOnFace);
  CHECK(rest.height == Approx(1.2296e-3).margin(1e-7));
}

TEST_CASE("a peg that nothing carries has no height") {
  CHECK(rest_peg_on_tube(radii, 0, 0, Eigen::Vector2d::Zero()).kind == RestContact::None);
  CHECK(rest_peg_on_tube(radii, 0.1, 0, Eigen::Vector2d(0.03, 0)).kind == RestContact::None);
  CHECK(rest_peg_on_tube(radii, 0, 0, Eigen::Vector2d(0.3e-3, 0)).kind == RestContact::Flat);
  CHECK(std::isnan(rest_peg_on_tube(radii, 0, 0, Eigen::Vector2d::Zero()).height));
  for (const double wrong : {std::nan(""), 2.0})
    CHECK(rest_peg_on_tube(radii, wrong, 0, {0.01, 0}).kind == RestContact::None);
  CHECK(rest_peg_on_tube({.peg_radius = 1, .inner_radius = 2, .outer_radius = 1}, 0.1, 0, {0, 0}).kind ==
        RestContact::None);
}

TEST_CASE("a tube that stands elsewhere and tilted carries the peg at its own face") {
  Random random(5);
  int resting = 0;
  for (int i = 0; i < 200; ++i) {
    const Pose2 p = random_pose(random);
    const Pose straight(Eigen::Translation3d(1e-3, -2e-3, 3e-3));
    const double here = rest_peg_on_tube(p.bodies, p.tilt, p.alpha, p.centre - Eigen::Vector2d(1e-3, -2e-3)).height;
    const double height = resting_height(p.bodies, straight, p.tilt, p.alpha, p.centre);
    REQUIRE(std::isnan(height) == std::isnan(here));
    if (!std::isnan(here)) CHECK(height == Approx(here + 3e-3).margin(1e-12));
    resting += !std::isnan(here);

    // On a tilted one the bottom centre found must lie at the resting height seen from that tube.
    const Pose tilted = from_xyzrpy({1e-3, 0, 0, random.normal(0.05), random.normal(0.05), 0});
    const double found = resting_height(p.bodies, tilted, p.tilt, p.alpha, p.centre);
    if (std::isnan(found)) continue;
    const Eigen::Vector3d seen = tilted.inverse() * Eigen::Vector3d(p.centre.x(), p.centre.y(), found);
    const Eigen::Vector3d axis =
        tilted.linear().transpose() * (Eigen::AngleAxisd(p.alpha, Eigen::Vector3d::UnitZ()) *
                                       Eigen::AngleAxisd(p.tilt, Eigen::Vector3d::UnitY()) * Eigen::Vector3d::UnitZ());
    const PegRest rest =
        rest_peg_on_tube(p.bodies, std::acos(axis.z()), std::atan2(axis.y(), axis.x()), seen.head<2>());
    CHECK(rest.height == Approx(seen.z()).margin(1e-11));
  }
  CHECK(resting > 50);
}

TEST_CASE("many rows are the single ones, and unequal columns are refused") {
  const std::vector<double> tilt = {0.1, 0.2}, alpha = {0, 1}, cx = {0.01, 0.011}, cy = {0, 0.001};
  std::vector<double> height(2);
  resting_heights(radii, Pose::Identity(), tilt, alpha, cx, cy, height);
  for (int i = 0; i < 2; ++i) CHECK(height[i] == rest_peg_on_tube(radii, tilt[i], alpha[i], {cx[i], cy[i]}).height);
  CHECK_THROWS_AS(resting_heights(radii, Pose::Identity(), tilt, alpha, cx, std::vector<double>{0}, height),
                  InvalidArgument);
  CHECK_THROWS_WITH(resting_heights({}, Pose::Identity(), tilt, alpha, cx, cy, height), Catch::Contains("peg_radius"));
}

}  // namespace peg_on_tube_test
