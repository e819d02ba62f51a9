#include "gap/reporting/consistency.hpp"

#include <array>
#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Whether an effect has one size everywhere.

namespace consistency_test {

using namespace kr5;
using namespace linear_world;

namespace {

double wave(double t) { return std::sin(5.0 * t); }

/// Three motions with an effect in i1, of a size of its own in each, and one in which its size follows the speed.
struct Fitted {
  Fitted(const std::array<double, 3>& sizes, double with_speed, std::uint64_t seed = 91)
      : world(recorded(sizes, with_speed, seed)), candidate(acting_in(adding("wave", "i1", wave), {0, 1, 2})) {
    model = gap::fit(problem, gap::empty_model(problem, world.base), {part(candidate, 1.0)});
    counted = gap::updated(problem, model);
  }
  static std::vector<cell::Experiment> recorded(const std::array<double, 3>& sizes, double with_speed,
                                                std::uint64_t seed) {
    Random random(seed);
    std::vector<cell::Experiment> out;
    for (std::size_t k = 0; k < 3; ++k) {
      cell::Experiment e =
          motion("motion-" + std::to_string(k + 1), k < 2 ? cell::Split::Fit : cell::Split::Check, 500);
      const Eigen::ArrayXd t = e.data.column("t");
      const Eigen::VectorXd size = sizes[k] + with_speed * (M_PI * t).cos();
      add_column(e, "i1", random.normal_vector(500) + size.cwiseProduct(at_times(e, wave)));
      out.push_back(e);
    }
    return out;
  }
  gap::Inconsistency inconsistency(double discrepancy = 0.0) const {
    return gap::inconsistency(world.data, gap::make_groups(world.data), model, 0, counted, discrepancy);
  }
  World world;
  gap::Candidate candidate;
  gap::NuisanceModel none;
  gap::FitProblem problem{world.data, none, {}, 0.0};
  gap::Model model;
  Eigen::VectorXd counted;
};

}  // namespace

TEST_CASE("an effect of one size everywhere is consistent") {
  int alarms = 0;
  for (std::uint64_t seed = 0; seed < 30; ++seed) alarms += Fitted({2, 2, 2}, 0.0, 200 + seed).inconsistency().p < 0.01;
  CHECK(alarms <= 2);  // 30 trials of at most 0.01: beyond with probability 0.003
}

TEST_CASE("sizes that differ between experiments are found, and how much they would explain") {
  const Fitted fitted({1.0, 2.0, 3.0}, 0.0);
  const gap::Inconsistency found = fitted.inconsistency();
  CHECK(found.p < 1e-6);
  CHECK(found.variable.kind == gap::VariableKind::Experiment);
  CHECK(found.group == 0);
  // Sums of squares about the common size: a wave of 500 rows has about 250, sizes are off by -1, 0, 1.
  CHECK(found.strength == Approx(2 * 250.0).epsilon(0.25));
  CHECK(fitted.inconsistency(1e5).p > 0.05);  // within what the simulator may be off
}

TEST_CASE("a size that follows the speed is told by the variable") {
  const gap::Inconsistency found = Fitted({2, 2, 2}, 1.2).inconsistency();
  CHECK(found.p < 1e-6);
  CHECK(found.variable == gap::Variable{gap::VariableKind::JointVelocity, 1, "", "motion"});
}

}  // namespace consistency_test
