#include <kr5/job/tube_stack.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace tube_stack_test {

using namespace kr5;
using namespace kr5::job;

namespace {

constexpr TubeStack stack{.depth = 0.06, .min_height = 0.014, .max_height = 0.017};

TubeFinding at_depth(double depth, int inserted, bool lost_in_bore = false) {
  return judge_tube({.seen = true, .depth = depth}, inserted, stack, lost_in_bore);
}

}  // namespace

TEST_CASE("the depth of a tube tells whether one more pellet is in it") {
  CHECK(at_depth(0.06, 0) == TubeFinding::Same);
  CHECK(at_depth(0.045, 0) == TubeFinding::OneMore);
  CHECK(at_depth(0.045, 1, true) == TubeFinding::Same);
  CHECK(at_depth(0.030, 1) == TubeFinding::OneMore);
}

TEST_CASE("what is neither on the ground nor on the others is stuck, as is what stands out of the tube") {
  CHECK(at_depth(0.005, 0) == TubeFinding::Stuck);
  CHECK(at_depth(0.052, 0) == TubeFinding::Stuck);
  CHECK(judge_tube({.seen = true, .occupied = true, .depth = 0.045}, 0, stack, false) == TubeFinding::Stuck);
  CHECK(judge_tube({.seen = false, .depth = 0.045}, 0, stack, true) == TubeFinding::Unseen);
}

TEST_CASE("where the depth does not tell, it is where the pellet was lost that does") {
  const TubeStack deep{.depth = 0.3, .min_height = 0.014, .max_height = 0.017};
  for (const bool in_bore : {false, true}) {
    const TubeFinding wanted = in_bore ? TubeFinding::OneMore : TubeFinding::Same;
    CHECK(judge_tube({.seen = true}, 3, deep, in_bore) == wanted);                  // no ground is seen
    CHECK(judge_tube({.seen = true, .depth = 0.11}, 12, deep, in_bore) == wanted);  // 12 high ones, or 13 low ones
  }
}

TEST_CASE("a tube that is none is refused by name") {
  const auto refused = [](const char* field, auto spoil) {
    TubeStack tube;
    spoil(tube);
    CHECK_THROWS_WITH(tube.validate(), Catch::Contains(field));
  };
  refused("depth", [](TubeStack& t) { t.depth = 0.0; });
  refused("max_height", [](TubeStack& t) { t.max_height = 0.001; });
  refused("tolerance", [](TubeStack& t) { t.tolerance = -1.0; });
}

}  // namespace tube_stack_test
