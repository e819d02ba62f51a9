#include "gap/screening/effect_prior.hpp"

#include <cmath>
#include <set>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

namespace effect_prior_test {

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

TEST_CASE("friction and rotors that a description leaves out are ten times likelier, and nothing else is") {
  cell::Cell cell = linear_world::unit_noise();
  const std::vector<gap::Hypothesis> before = gap::hypotheses(cell, {});
  std::vector<gap::Hypothesis> stated = before;
  gap::apply_omission_prior(cell, stated);
  for (std::size_t i = 0; i < before.size(); ++i) CHECK(stated[i].log_prior == before[i].log_prior);
  cell.drives->friction.coulomb.setZero();
  cell.drives->rotor_inertia.tail(5).setZero();  // of one joint it is stated
  gap::apply_omission_prior(cell, stated);
  std::set<std::string> raised;
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (stated[i].log_prior == before[i].log_prior) continue;
    raised.insert(stated[i].effect);
    CHECK(stated[i].log_prior == Approx(before[i].log_prior + std::log(10.0)));
  }
  CHECK(raised == std::set<std::string>{"coulomb_friction"});
}

}  // namespace effect_prior_test
