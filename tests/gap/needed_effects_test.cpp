#include "gap/stages/needed_effects.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include "gap/staged.hpp"

/// @file
/// Effects that a model could do without.

namespace needed_effects_test {

using namespace kr5;
using namespace staged;

namespace {

/// A single nuisance parameter with the signature of the wave.
gap::NuisanceModel of_wave(const gap::ComparisonData& data) {
  gap::NuisanceModel out;
  gap::Signature s;
  double square = 0.0;
  for (int b = 0; b < static_cast<int>(data.blocks.size()); ++b) {
    const gap::Block& block = data.blocks[static_cast<std::size_t>(b)];
    if (block.column != "i1") continue;
    const Eigen::VectorXd shape = at_times(data.experiment(block), wave);
    s.parts.emplace_back(b, shape.cast<float>());
    if (block.split == cell::Split::Fit) square += shape.squaredNorm();
  }
  out.signatures = {s};
  out.gram = Eigen::MatrixXd::Constant(1, 1, square);
  return out;
}

}  // namespace

TEST_CASE("small errors of the cell must be small in every parameter") {
  const Stages s(Recorded{.of_wave = 5.0}.recording());
  const gap::NuisanceModel nuisance = of_wave(s.screened.data);
  const auto within = [&](double size) {
    const gap::FitProblem problem{s.screened.data, nuisance, gap::NuisancePrior(nuisance, size), 0.0};
    return gap::within_nuisance(problem, gap::empty_model(problem, s.screened.base));
  };
  CHECK(within(0.0));        // there are none
  CHECK(within(1.5));        // 5 is 3.3 times as far
  CHECK_FALSE(within(0.8));  // more than 5 times as far, as the data and not the prior say
}

TEST_CASE("an effect is needless where it explains no more than the simulator may be off, or fits the check worse") {
  const Stages s(Recorded{.of_wave = 8.0}.recording());
  const gap::FitProblem problem{s.screened.data, s.screened.nuisance, {}, 0.0};
  gap::ModelPool pool(problem, s.screened.base, {{gap::empty_model(problem, s.screened.base)}, {}});
  const gap::Candidate& candidate = *s.screened.screen.candidates()[0];
  gap::Model model = gap::fit(problem, pool.nominal(), {part(candidate, 1.0)});
  const auto needless = [&](double floor) {
    gap::DiagnoseOptions with = s.options;
    with.simulator_floor = floor;
    return gap::is_needless(pool, s.screened.groups, model, 0, with);
  };
  CHECK_FALSE(needless(0.05));
  CHECK(needless(5.0));
  // The same effect, off on the check experiment by more than it explains there.
  const gap::Block& check = s.screened.data.blocks[2];
  REQUIRE(check.split == cell::Split::Check);
  check.rows_of(model.residual) = 1.1 * check.rows_of(s.screened.base);
  CHECK(needless(0.05));
}

}  // namespace needed_effects_test
