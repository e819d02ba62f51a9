#include <kr5/rsi/programmed_path.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

using namespace kr5;
using namespace kr5::rsi;

namespace programmed_path_test {

Eigen::VectorXd place(double a, double b) { return Eigen::Vector2d(a, b); }

TEST_CASE("a path goes through its places at its speed, all joints at once, and rests at the last") {
  ProgrammedPath path({place(1, 0.5), place(1, 0)}, 0.5, 2);
  path.begin(place(0, 0));
  path.advance(1.0, 1.0);
  CHECK((path.joints() - place(0.5, 0.25)).norm() < 1e-12);
  path.advance(1.5, 1.0);  // around the corner
  CHECK((path.joints() - place(1, 0.25)).norm() < 1e-12);
  CHECK_FALSE(path.finished());
  path.advance(10.0, 1.0);
  CHECK((path.finished() && path.joints() == place(1, 0)));
}

TEST_CASE("the override makes a path slower, 0 stops it") {
  ProgrammedPath path({place(1, 0)}, 0.5, 2);
  path.begin(place(0, 0));
  path.advance(1.0, 0.2);
  CHECK(path.joints()[0] == Approx(0.1));
  path.advance(1.0, 0.0);
  CHECK(path.joints()[0] == Approx(0.1));
}

TEST_CASE("places of another arm, and a speed that is none, are refused") {
  CHECK_THROWS_WITH(ProgrammedPath({place(1, 0), Eigen::VectorXd::Zero(3)}, 1, 2), Catch::StartsWith("path[1]"));
  CHECK_THROWS_WITH(ProgrammedPath({}, 0, 2), Catch::StartsWith("path_speed"));
}

}  // namespace programmed_path_test
