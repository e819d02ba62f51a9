#include "gap/screening/geometry_prior.hpp"

#include <cmath>
#include <set>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

namespace geometry_prior_test {

using namespace kr5;

TEST_CASE("lengths and twists of links are doubted a hundred times less than masses, and nothing else is") {
  const cell::Cell cell = linear_world::unit_noise();
  const std::vector<gap::Hypothesis> before = gap::hypotheses(cell, {});
  std::vector<gap::Hypothesis> after = before;
  gap::apply_geometry_prior(after);
  REQUIRE(after.size() == before.size());
  std::set<std::string> doubted;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (after[i].log_prior == before[i].log_prior) continue;
    doubted.insert(after[i].effect);
    CHECK(after[i].log_prior == Approx(before[i].log_prior - std::log(100.0)));
  }
  CHECK(doubted == std::set<std::string>{"link_length", "link_twist"});
}

}  // namespace geometry_prior_test
