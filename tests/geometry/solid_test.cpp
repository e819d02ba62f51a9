#include <catch2/catch.hpp>

#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/solid.hpp>

namespace solid_test {

using namespace kr5;
using Eigen::Vector3d;

namespace {

Solid ball(double radius) {
  Solid out{.kind = SolidKind::Ball};
  out.radius = radius;
  return out;
}

Solid tube(double inner, double outer, double depth) {
  Solid out{.kind = SolidKind::Tube};
  out.radius = outer, out.inner_radius = inner, out.depth = depth;
  return out;
}

/// Distance of a point to the material of a tube: negative inside, by its definition.
bool inside_material(const Solid& t, const Vector3d& p) {
  const double r = p.head<2>().norm();
  return p.z() < 0.0 && p.z() > -t.depth && r < t.radius && r > t.inner_radius;
}

}  // namespace

TEST_CASE("a ray meets a ball first on the near side, with the normal out of it") {
  const RayHit met = ball(0.02).intersect({Vector3d(0.012, 0.0, -1.0), Vector3d(0.0, 0.0, 2.0)});
  REQUIRE(met.hit());
  CHECK(2.0 * met.distance == Approx(1.0 - 0.016).epsilon(1e-14));
  CHECK((met.normal - Vector3d(0.6, 0.0, -0.8)).norm() < 1e-12);
  CHECK_FALSE(ball(0.02).intersect({Vector3d(0.021, 0.0, -1.0), Vector3d::UnitZ()}).hit());
  CHECK_FALSE(ball(0.02).intersect({Vector3d(0.0, 0.0, 1.0), Vector3d::UnitZ()}).hit());
}

TEST_CASE("rays from above meet the rim of a tube, its bore wall, or its bottom") {
  const Solid t = tube(0.0097, 0.01265, 0.06);
  const auto down = [&](double x) { return t.intersect({Vector3d(x, 0.0, 0.2), -Vector3d::UnitZ()}); };
  CHECK(down(0.0).face == SolidFace::Bottom);
  CHECK(down(0.0).distance == Approx(0.26));
  CHECK(down(0.0098).face == SolidFace::Top);
  CHECK(down(0.0126).distance == Approx(0.2));
  CHECK_FALSE(down(0.0127).hit());
  const RayHit wall = t.intersect({Vector3d(0.0, 0.0, 0.1), Vector3d(0.0097, 0.0, -0.11)});
  CHECK(wall.face == SolidFace::Bore);
  CHECK(wall.distance == Approx(1.0));
  CHECK((wall.normal + Vector3d::UnitX()).norm() < 1e-12);
  CHECK(t.intersect({Vector3d(1.0, 0.0, -0.03), -Vector3d::UnitX()}).face == SolidFace::Outside);
}

TEST_CASE("a ray enters the material of a tube where it meets it, and not before") {
  const Solid t = tube(0.6, 1.0, 1.5);
  Random random(7);
  int met = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    CAPTURE(trial);
    const Vector3d origin = 3.0 * random.direction(), aim = 1.5 * random.uniform() * random.direction();
    const Ray ray{origin, (aim - origin).normalized()};
    const RayHit m = t.intersect(ray);
    const double end = m.hit() ? m.distance : 8.0;
    for (double s = 0.0; s < end - 1e-6; s += 0.01) REQUIRE_FALSE(inside_material(t, ray.at(s)));
    if (!m.hit() || m.face == SolidFace::Bottom) continue;
    ++met;
    CHECK(inside_material(t, ray.at(end) - 1e-9 * m.normal));
    CHECK(m.normal.dot(ray.direction) < 0.0);
  }
  CHECK(met > 100);
}

TEST_CASE("a plate is met from both sides within its edges") {
  Solid plate{.kind = SolidKind::Plate};
  plate.width = 0.2, plate.height = 0.1;
  CHECK(plate.intersect({Vector3d(0.09, 0.04, 1.0), -Vector3d::UnitZ()}).distance == Approx(1.0));
  CHECK(plate.intersect({Vector3d(0.09, 0.04, -1.0), Vector3d::UnitZ()}).normal.z() == -1.0);
  CHECK_FALSE(plate.intersect({Vector3d(0.0, 0.051, 1.0), -Vector3d::UnitZ()}).hit());
  CHECK_FALSE(plate.intersect({Vector3d(0.0, 0.0, 1.0), Vector3d::UnitX()}).hit());
}

TEST_CASE("solids without a size are refused by field") {
  CHECK_THROWS_WITH(ball(0.0).validate(), Catch::Contains("radius"));
  CHECK_THROWS_WITH(tube(0.02, 0.01, 0.1).validate(), Catch::Contains("inner_radius"));
  CHECK_THROWS_WITH(tube(0.0, 0.01, 0.0).validate(), Catch::Contains("depth"));
  CHECK_THROWS_WITH(Solid{.kind = SolidKind::Plate}.validate(), Catch::Contains("width"));
}

}  // namespace solid_test
