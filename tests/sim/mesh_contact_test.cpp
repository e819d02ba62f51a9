// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/force/peg_on_tube.hpp>
#include <kr5/sim/mesh_contact.hpp>

namespace mesh_contact_test {

using namespace kr5;
using sim::MeshContact;

namespace {

const force::PegTubeShape shape{9.42e-3, 0.05, 0.0, 9.7e-3, 12.65e-3, 0.06, 0.0};

Pose leaning(double tilt, double alpha, const Eigen::Vector2d& centre, double z) {
  Pose T = Pose::Identity();
  T.translation() << centre, z;
  T.linear() = Eigen::AngleAxisd(tilt, Eigen::Vector3d(-std::sin(alpha), std::cos(alpha), 0.0)).toRotationMatrix();
  return T;
}

/// Height at which the peg, let down, begins to touch, sought between two heights and a little beyond them.
double first_touch(MeshContact& mesh, double tilt, double alpha, const Eigen::Vector2d& centre, double low,
                   double high) {
  low -= 1e-4, high += 1e-4;
  REQUIRE(mesh.contacts(leaning(tilt, alpha, centre, low)).count > 0);
  REQUIRE(mesh.contacts(leaning(tilt, alpha, centre, high)).count == 0);
  while (high - low > 1e-9) {
    const double middle = 0.5 * (low + high);
    (mesh.contacts(leaning(tilt, alpha, centre, middle)).count > 0 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace

TEST_CASE("a tilted peg meets the mesh where the closed form says, but for what the corners of the mesh cut off") {
  for (const int segments : {64, 256}) {
    MeshContact mesh(shape, {segments});
    // The mesh holds a tube whose outer radius is cut, and lies in one whose inner radius is: so do the heights.
    const double cut = 1.0 - mesh.sagitta() / shape.outer_radius;
    const force::PegTube least{shape.peg_radius, shape.inner_radius, cut * shape.outer_radius};
    const force::PegTube most{shape.peg_radius, cut * shape.inner_radius, shape.outer_radius};
    constexpr double rounding = 2e-8;  // single precision of the mesh [m]
    Random random(3);
    int rows = 0;
    double width = 0.0;
    for (int trial = 0; trial < 300; ++trial) {
      const double tilt = random.uniform(0.05, 0.3), alpha = random.uniform(0.0, 2 * M_PI);
      const Eigen::Vector2d centre(random.uniform(-0.009, 0.009), random.uniform(-0.009, 0.009));
      const force::PegRest low = force::rest_peg_on_tube(least, tilt, alpha, centre);
      const force::PegRest high = force::rest_peg_on_tube(most, tilt, alpha, centre);
      if (low.kind == force::RestContact::None) continue;
      ++rows;
      width += high.height - low.height;
      const double found = first_touch(mesh, tilt, alpha, centre, low.height, high.height);
      CHECK(found > low.height - rounding);
      CHECK(found < high.height + rounding);
    }
    INFO(segments << " segments, " << rows << " rows");
    CHECK(rows > 150);
    CHECK(width / rows < 2 * mesh.sagitta());  // the bounds do bind
  }
}

TEST_CASE("a rim on the flat top is pushed straight up by as much as it has sunk, by mesh and by closed form") {
  MeshContact mesh(shape);
  const force::PegTube bodies{shape.peg_radius, shape.inner_radius, shape.outer_radius};
  Random random(4);
  int rows = 0;
  for (int trial = 0; trial < 2000; ++trial) {
    const double tilt = random.uniform(0.05, 0.3), alpha = random.uniform(0.0, 2 * M_PI), sunk = 2e-5;
    const Eigen::Vector2d centre(random.uniform(-0.009, 0.009), random.uniform(-0.009, 0.009));
    const force::PegRest rest = force::rest_peg_on_tube(bodies, tilt, alpha, centre);
    const double rho = rest.point.norm(), margin = 4e-4;
    if (rest.kind != force::RestContact::RimOnFace) continue;
    if (rho < shape.inner_radius + margin || rho > shape.outer_radius - margin) continue;
    ++rows;
    const Pose T = leaning(tilt, alpha, centre, rest.height - sunk);
    for (const force::Contacts& found : {mesh.contacts(T), force::peg_tube_contacts(shape, T)}) {
      REQUIRE(found.count > 0);
      const force::ContactPoint& deepest =
          *std::max_element(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.depth < b.depth; });
      CHECK(deepest.normal.z() > 0.999);
      CHECK(deepest.depth == Approx(sunk).epsilon(0.01));
    }
  }
  CHECK(rows > 50);
}

TEST_CASE("what a mesh cannot stand for is refused by name") {
  CHECK_THROWS_WITH(MeshContact(shape, {2}), Catch::StartsWith("segments"));
  force::PegTubeShape chamfered = shape;
  chamfered.peg_chamfer = 5e-4;
  CHECK_THROWS_WITH(MeshContact(chamfered), Catch::StartsWith("peg.chamfer"));
  force::PegTubeShape wrong = shape;
  wrong.inner_radius = 0.02;
  CHECK_THROWS_AS(MeshContact(wrong), InvalidArgument);
}

}  // namespace mesh_contact_test
