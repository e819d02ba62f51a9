#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pinhole.hpp>

namespace pinhole_test {

using namespace kr5;

namespace {
Pinhole camera() {
  Pinhole c{.width = 2448, .height = 2050, .fx = 2328.556745, .fy = 2334.311366, .cx = 1254.058997, .cy = 1012.07259};
  c.k1 = -0.201788, c.k2 = 0.05, c.p1 = 3e-4, c.p2 = -2e-4, c.k3 = 0.01, c.k4 = 0.02, c.k5 = -0.01, c.k6 = 0.003;
  return c;
}
}  // namespace

TEST_CASE("projection follows the book's lens equation") {
  const Pinhole c = camera();
  const double x = 0.21, y = -0.17, rho = x * x + y * y;
  const double g = (1 + c.k1 * rho + c.k2 * rho * rho + c.k3 * rho * rho * rho) /
                   (1 + c.k4 * rho + c.k5 * rho * rho + c.k6 * rho * rho * rho);
  const Eigen::Vector2d expected(c.fx * (x * g + 2 * c.p1 * x * y + c.p2 * (rho + 2 * x * x)) + c.cx,
                                 c.fy * (y * g + c.p1 * (rho + 2 * y * y) + 2 * c.p2 * x * y) + c.cy);
  CHECK((c.project({2 * x, 2 * y, 2}) - expected).norm() < 1e-10);
}

TEST_CASE("derivatives of the projection agree with differences") {
  const Pinhole c = camera();
  Random random(5);
  for (int i = 0; i < 20; ++i) {
    const Eigen::Vector3d p(random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(0.4, 1.0));
    Eigen::Matrix<double, 2, 3> J;
    Eigen::Matrix<double, 2, Pinhole::parameter_count> K;
    c.project(p, &J, &K);
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d h = 1e-6 * Eigen::Vector3d::Unit(k);
      CHECK((J.col(k) - (c.project(p + h) - c.project(p - h)) / 2e-6).norm() < 1e-4);
    }
    for (int k = 0; k < Pinhole::parameter_count; ++k) {
      Pinhole a = c, b = c;
      Pinhole::Parameters h = Pinhole::Parameters::Zero();
      h[k] = 1e-6;
      a.set_parameters(c.parameters() + h);
      b.set_parameters(c.parameters() - h);
      CHECK((K.col(k) - (a.project(p) - b.project(p)) / 2e-6).norm() < 1e-4);
    }
  }
}

TEST_CASE("ray inverts the projection over the whole image") {
  const Pinhole c = camera();
  for (double u = 0; u < c.width; u += 204)
    for (double v = 0; v < c.height; v += 205) {
      const auto ray = c.ray({u, v});
      REQUIRE(ray.has_value());
      CHECK((c.project(*ray) - Eigen::Vector2d(u, v)).norm() < 1e-8);
    }
}

TEST_CASE("a pixel beyond the fold of the lens model has no ray") {
  Pinhole c{.width = 640, .height = 480, .fx = 300, .fy = 300, .cx = 320, .cy = 240};
  c.k1 = -0.5;
  CHECK_FALSE(c.ray({5000, 240}).has_value());
  CHECK_FALSE(c.ray({std::nan(""), 240}).has_value());
}

TEST_CASE("a camera without focal length is refused") {
  Pinhole c{.width = 640, .height = 480};
  c.fx = -1;
  CHECK_THROWS_AS(c.validate(), InvalidArgument);
  CHECK_THROWS_AS(Pinhole{}.validate(), InvalidArgument);
}

}  // namespace pinhole_test
