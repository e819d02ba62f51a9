#include <kr5/cell/known_directions.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace known_directions_test {

using namespace kr5;

TEST_CASE("the direction of a joint is known beside the noise of its speeds") {
  cell::Experiment e;
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(101, 0, 1);
  e.data.columns = {"t", "qc1", "qc2", "qc3"};
  e.data.values.resize(t.size(), 4);
  const Eigen::VectorXd turn = 0.5 * t.array().square();  // speed t
  const Eigen::VectorXd slow = 1e-3 * t;
  e.data.values << t, turn, turn, slow;
  CHECK((cell::known_directions(e, 3) == 1.0).all());
  e.speed_noise = Eigen::Vector3d(0.25, 0.0, 0.25);
  const Eigen::ArrayXXd known = cell::known_directions(e, 3);
  for (Eigen::Index i = 1; i < 100; ++i) CHECK(known(i, 0) == (i < 50 ? 0.0 : 1.0));
  CHECK((known.col(1) == 1.0).all());  // exact
  CHECK((known.col(2) == 1.0).all());  // never known, and nothing else tells of it
  CHECK_THROWS_WITH(cell::known_directions(e, 4), Catch::Contains("speed_noise"));
}

}  // namespace known_directions_test
