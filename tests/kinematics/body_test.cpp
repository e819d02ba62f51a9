#include <kr5/kinematics/body.hpp>

#include <catch2/catch.hpp>

#include "kinematics/random_chain.hpp"

namespace body_test {

using namespace kr5;
using namespace kr5::test;
using kinematics::Body;

TEST_CASE("a part taken away from a body leaves the rest of it") {
  Random random(8);
  for (int k = 0; k < 50; ++k) {
    const Body a = random_body(random), b = random_body(random);
    const auto rest = body_without(merged_body(a, b), b);
    REQUIRE(rest.has_value());
    CHECK(rest->mass == Approx(a.mass).epsilon(1e-12));
    CHECK((rest->com - a.com).norm() < 1e-12);
    CHECK((rest->inertia - a.inertia).norm() < 1e-12 * (1 + a.inertia.norm()));
  }
  const Body alone = random_body(random);
  CHECK(body_without(alone, Body{})->inertia == alone.inertia);
}

TEST_CASE("what could be no real body is not left") {
  const Body whole{2.0, Eigen::Vector3d::Zero(), (Vector6() << 0.1, 0.1, 0.1, 0, 0, 0).finished()};
  Body part = whole;
  CHECK_FALSE(body_without(whole, part).has_value());  // no mass
  part.mass = 2.0 - 1e-12;
  CHECK_FALSE(body_without(whole, part).has_value());  // rounding
  part.mass = 1.0;
  part.inertia[2] = 0.2;
  CHECK_FALSE(body_without(whole, part).has_value());  // a negative moment
  part.inertia << 0.08, 0.08, 0.02, 0, 0, 0;
  CHECK_FALSE(body_without(whole, part).has_value());  // 0.02 + 0.02 < 0.08
  part.inertia << 0.05, 0.06, 0.07, 0, 0, 0;
  CHECK(body_without(whole, part).has_value());
}

}  // namespace body_test
