#include "gap/reporting/gap_figures.hpp"

#include <array>
#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// The figures of a diagnosis, from residuals of known size.

namespace gap_figures_test {

using namespace kr5;
using namespace linear_world;

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// Two currents in a fit and a check motion, each with a residual of one size in each of them.
std::vector<cell::Experiment> recorded(const std::array<double, 2>& fit, const std::array<double, 2>& check) {
  std::vector<cell::Experiment> out = {motion("motion-1", cell::Split::Fit, 200),
                                       motion("motion-2", cell::Split::Check, 100)};
  for (std::size_t k = 0; k < 2; ++k) {
    add_column(out[0], "i" + std::to_string(k + 1), Eigen::VectorXd::Constant(200, fit[k]));
    add_column(out[1], "i" + std::to_string(k + 1), Eigen::VectorXd::Constant(100, check[k]));
  }
  return out;
}

gap::ResidualAnalysis nothing_found(const Eigen::VectorXd& shown, std::size_t groups) {
  gap::ResidualAnalysis out;
  out.shown = shown;
  out.structure.resize(groups);
  out.structured.assign(groups, false);
  out.beyond.assign(groups, false);
  return out;
}

}  // namespace

TEST_CASE("the floor is the gap of noise alone, once in a thousand columns") {
  // 99.9 % quantiles of chi-square from tables: 10.828 with 1 sample, 149.449 with 100.
  CHECK_FALSE(gap::above_floor({std::sqrt(10.82), 1}));
  CHECK(gap::above_floor({std::sqrt(10.84), 1}));
  CHECK_FALSE(gap::above_floor({std::sqrt(1.4944), 100}));
  CHECK(gap::above_floor({std::sqrt(1.4946), 100}));
  CHECK_FALSE(gap::above_floor({9.0, 0}));
}

TEST_CASE("where an error is known, a column is above the noise of its sensor by more than that is uncertain") {
  World world(recorded({0, 0}, {1.0, 1.0}));
  const std::vector<gap::Group> groups = gap::make_groups(world.data);
  const auto above = [&](double inflation, double rms) {
    for (gap::Block& block : world.data.blocks) block.inflation = inflation;
    return gap::above_noise(world.data, groups[0], rms * world.base);
  };
  CHECK(gap::inflation_of(world.data, groups[0]) == 1.0);
  CHECK_FALSE(above(1.0, 1.2));
  CHECK(above(1.0, 1.3));         // sqrt of 1.494
  CHECK_FALSE(above(2.0, 0.49));  // an error stated far above what is seen: not judged
  CHECK_FALSE(above(2.0, 0.6));   // 1.2 of the noise
  CHECK(above(2.0, 0.65));        // 1.3 of the noise, above 1.25
  CHECK(gap::gap_over_noise(world.data, groups[0], 0.65 * world.base) == Approx(1.3));
  CHECK(gap::above_noise(world.data, groups, 0.65 * world.base) == std::vector<bool>{true, true});
}

TEST_CASE("columns above the floor are told with their share of the excess, the largest first") {
  const World world(recorded({9, 9}, {2.0, 3.0}));
  const std::vector<gap::Group> groups = gap::make_groups(world.data);
  gap::ResidualAnalysis rest = nothing_found(world.base, 2);
  rest.structure[1].dependences.resize(4);
  const std::vector<gap::ColumnExcess> found = gap::column_excesses(world.data, groups, rest);
  REQUIRE(found.size() == 2);
  CHECK(found[0].column == "i2");
  CHECK(found[0].target == "joint2");
  CHECK(found[0].experiment == "motion");
  CHECK(found[0].gap == Approx(3.0));  // of the check experiments alone
  CHECK(found[0].share == Approx(8.0 / 11.0));
  CHECK(found[0].depends_on.size() == 3);
  CHECK(found[1].share == Approx(3.0 / 11.0));
  // A column at the floor is told only with a structure, or beyond a known error.
  const World floor(recorded({0, 0}, {1.0, 1.0}));
  gap::ResidualAnalysis quiet = nothing_found(floor.base, 2);
  CHECK(gap::column_excesses(floor.data, groups, quiet).empty());
  quiet.structured[0] = true;
  quiet.beyond[1] = true;
  CHECK(gap::column_excesses(floor.data, groups, quiet).size() == 2);
}

TEST_CASE("the reduction is of the RMS gap over the columns above the floor before") {
  const World world(recorded({9, 9}, {3.0, 4.0}));
  const std::vector<gap::Group> groups = gap::make_groups(world.data);
  const Eigen::VectorXd after = 0.5 * world.base;
  const gap::GapReduction both = gap::gap_reduction(world.data, groups, {true, true}, world.base, after);
  CHECK(both.before == Approx(std::sqrt((9.0 + 16.0) / 2)));
  CHECK(both.after == Approx(both.before / 2));
  CHECK(both.before_ci.low == Approx(both.before));  // residuals of one size leave nothing to chance
  CHECK(both.before_ci.high == Approx(both.before));
  REQUIRE(both.columns.size() == 2);
  CHECK(both.columns[1].column == "motion.i2");
  CHECK(both.columns[1].before == Approx(4.0));
  CHECK(both.columns[1].after == Approx(2.0));
  const gap::GapReduction one = gap::gap_reduction(world.data, groups, {true, false}, world.base, after);
  CHECK(one.before == Approx(3.0));
  const gap::GapReduction none = gap::gap_reduction(world.data, groups, {false, false}, world.base, after);
  CHECK(none.before == 1.0);
  CHECK(none.after == 1.0);
}

TEST_CASE("intervals of the gap hold the gap of noise of the same size in nineteen of twenty recordings") {
  const World world(recorded({0, 0}, {1.0, 1.0}));
  const std::vector<gap::Group> groups = gap::make_groups(world.data);
  Random random(101);
  int held = 0;
  constexpr int trials = 200;
  for (int k = 0; k < trials; ++k) {
    const Eigen::VectorXd noise = random.normal_vector(world.data.size, 2.0);
    const gap::GapReduction r = gap::gap_reduction(world.data, groups, {true, true}, noise, noise);
    held += r.before_ci.low <= 2.0 && 2.0 <= r.before_ci.high;
  }
  CHECK(held >= 174);  // of 0.93, which 20 pieces a column allow: below with probability 0.003
}

TEST_CASE("the explained fraction is the part of the excess that goes, within 0 and 1") {
  const World world(recorded({9, 9}, {3.0, 4.0}));
  const std::vector<gap::Group> groups = gap::make_groups(world.data);
  const auto fraction = [&](double with) {
    return gap::explained_fraction(world.data, groups, {true, true}, world.base, with * world.base);
  };
  CHECK(fraction(0.5) == Approx((25.0 - 25.0 / 4) / 23.0));
  CHECK(fraction(0.0) == 1.0);
  CHECK(fraction(1.5) == 0.0);
  CHECK(gap::explained_fraction(world.data, groups, {false, false}, world.base, 0.0 * world.base) == 0.0);
  Eigen::VectorXd unknown = world.base;
  unknown.setConstant(nan);  // nothing is left to compare
  CHECK(gap::gap_over_noise(world.data, groups[0], unknown) == 0.0);
}

}  // namespace gap_figures_test
