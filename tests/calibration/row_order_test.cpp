#include "calibration/postures/row_order.hpp"

#include <algorithm>
#include <numeric>

#include <catch2/catch.hpp>

#include <calibration/arm_world.hpp>
#include <support/rates.hpp>

namespace row_order_test {

using namespace kr5;
using namespace kr5::calibration;
using namespace kr5::test;

TEST_CASE("each place finds its posture, in order or shuffled, few rows or many") {
  Random random(1);
  constexpr int all = 200;
  int right = 0;
  for (int trial = 0; trial < all; ++trial) {
    const ArmWorld w = make_arm_world({.seed = static_cast<unsigned>(trial + 1), .postures = trial % 2 ? 30 : 80});
    std::vector<int> order(w.postures.size());
    std::iota(order.begin(), order.end(), 0);
    if (trial % 4) std::shuffle(order.begin(), order.end(), random.engine());
    std::vector<Pose> flanges;
    Eigen::Matrix3Xd places(3, static_cast<Eigen::Index>(order.size()));
    for (std::size_t k = 0; k < order.size(); ++k) {
      flanges.push_back(w.nominal.flange(w.postures[k].q));
      places.col(static_cast<Eigen::Index>(k)) = w.postures[static_cast<std::size_t>(order[k])].points.col(0);
    }
    const RowOrder found = match_rows(flanges, places);
    right += found.posture == order && found.misfit < 0.01;
  }
  check_rate(right, all, 0.9, 0.86);  // the search may end at another order
}

TEST_CASE("places alike keep some order and a finite misfit") {
  const ArmWorld w = make_arm_world({.seed = 1, .postures = 10});
  std::vector<Pose> flanges;
  for (const ArmPosture& p : w.postures) flanges.push_back(w.nominal.flange(p.q));
  const RowOrder found = match_rows(flanges, Eigen::Vector3d(1, 2, 3).replicate(1, 10));
  std::vector<int> order = found.posture;
  std::sort(order.begin(), order.end());
  for (int k = 0; k < 10; ++k) CHECK(order[static_cast<std::size_t>(k)] == k);
  CHECK(std::isfinite(found.misfit));
}

}  // namespace row_order_test
