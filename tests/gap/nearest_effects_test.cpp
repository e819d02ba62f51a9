#include "gap/stages/nearest_effects.hpp"

#include <algorithm>

#include <catch2/catch.hpp>

#include "gap/staged.hpp"

/// @file
/// Effects that come near to what no effect explains.

namespace nearest_effects_test {

using namespace kr5;
using namespace staged;

TEST_CASE(
    "the nearest effects are told with the gap that each leaves, the smallest first, and why they are not blamed") {
  cell::Recording r = Recorded{}.recording();
  for (cell::Experiment& e : r.experiments)
    e.data.values.col(e.data.find("i1")) +=
        4.0 * at_times(e, [](double t) { return std::sin(3.0 * t) > 0 ? 1.0 : -1.0; });
  gap::DiagnoseOptions with = options();
  with.own_hypotheses.push_back(adding("other_wave", "i1", [](double t) { return 0.2 * std::sin(3.0 * t + 0.8); }));
  const Stages s(r, with);
  const gap::JudgeOutput judged = s.judged();
  REQUIRE(judged.causes.empty());
  REQUIRE(judged.after.any());
  const std::vector<gap::NearestEffect> found = gap::nearest_effects(s.screened, judged, s.options);
  REQUIRE(found.size() >= 2);
  CHECK(found.size() <= 3);
  CHECK(found[0].effect == "wave");
  CHECK(std::ranges::is_sorted(found, {}, &gap::NearestEffect::gap));
  // A sine takes 8 / pi^2 of a square wave: of a gap of 17 on 1 of noise it leaves that of the rest.
  CHECK(found[0].gap == Approx(std::sqrt(1 + 16 * (1 - 8 / (M_PI * M_PI)))).epsilon(0.1));
  CHECK(found[0].reason == gap::NotBlamed::StructureRemains);
  CHECK(found[0].column == "motion.i1");
}

}  // namespace nearest_effects_test
