#include "gap/reporting/structure.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Tests of a residual against noise.

namespace structure_test {

using namespace kr5;
using namespace linear_world;

namespace {

std::vector<cell::Experiment> recorded(std::uint64_t seed, const std::function<double(double t)>& beside) {
  Random random(seed);
  std::vector<cell::Experiment> out = {motion("motion-1", cell::Split::Fit, 600),
                                       motion("motion-2", cell::Split::Check, 600)};
  for (cell::Experiment& e : out) add_column(e, "i1", random.normal_vector(600) + at_times(e, beside));
  return out;
}

gap::Structure structure_of(const World& world, double discrepancy = 0.0, double scale = 1.0) {
  return gap::structure(world.data, gap::make_groups(world.data).front(), world.base, discrepancy, 0.005, scale);
}

}  // namespace

TEST_CASE("blocks of one column are a group, judged by its check experiments where there are some") {
  std::vector<cell::Experiment> all = recorded(71, [](double) { return 0.0; });
  add_column(all[0], "i2", Eigen::VectorXd::Zero(600));
  const World world(all);
  const std::vector<gap::Group> groups = gap::make_groups(world.data);
  REQUIRE(groups.size() == 2);
  CHECK(groups[0].name() == "motion.i1");
  CHECK(groups[0].all == std::vector<int>{0, 2});
  CHECK(groups[0].judged == std::vector<int>{2});
  CHECK(groups[1].all == std::vector<int>{1});
  CHECK(groups[1].judged == std::vector<int>{1});
}

TEST_CASE("bins hold equal numbers of samples, fewer bins where many share a value") {
  Eigen::VectorXd values(120);
  for (Eigen::Index i = 0; i < 120; ++i) values(i) = static_cast<double>((i * 37) % 120);
  CHECK(gap::quantile_edges(values, 4) == std::vector<double>{30, 60, 90});
  values.head(100).setConstant(-1.0);
  for (Eigen::Index i = 100; i < 120; ++i) values(i) = static_cast<double>(i);
  CHECK(gap::quantile_edges(values, 12) == std::vector<double>{-1.0, 100.0, 110.0});
}

TEST_CASE("the gap of a group is its RMS, without what is NaN and without spikes") {
  World world(recorded(72, [](double) { return 0.0; }));
  world.base.setConstant(2.0);
  world.base(3) = std::numeric_limits<double>::quiet_NaN();
  world.base(5) = 0.0;  // a spike counts as nothing
  world.data.use(5) = 0.0;
  const gap::Gap gap = gap::gap_of(world.data, {0}, world.base);
  CHECK(gap.samples == 598.0);
  CHECK(gap.rms == Approx(2.0));
  CHECK(gap::gap_of(world.data, {}, world.base).rms == 0.0);
}

TEST_CASE("a p-value is that of chi-square, as wide as a discrepancy makes it") {
  // Quantiles of chi-square from tables.
  CHECK(gap::p_value({{}, 3.841459, 1.0}, 0.0) == Approx(0.05).epsilon(1e-4));
  CHECK(gap::p_value({{}, 18.307038, 10.0}, 0.0) == Approx(0.05).epsilon(1e-4));
  CHECK(gap::p_value({{}, 2 * 18.307038, 10.0}, 10.0) == Approx(0.05).epsilon(1e-4));
}

TEST_CASE("noise has structure no more often than the false-alarm rate") {
  constexpr int trials = 150;
  int alarms = 0;
  for (int k = 0; k < trials; ++k) {
    const World world(recorded(1000 + static_cast<std::uint64_t>(k), [](double) { return 0.0; }));
    alarms += structure_of(world).p < 0.05;
  }
  CHECK(alarms <= 16);  // binomial, 150 trials of 0.05 (corrected, so at most): beyond with probability 0.002
}

TEST_CASE("a structure is found with what it depends on, its sign and its share") {
  // Against the direction of motion, as dry friction: joint 1 swings as sin(pi t).
  const World dry(recorded(73, [](double t) { return 1.5 * (std::cos(M_PI * t) > 0 ? 1.0 : -1.0); }));
  const gap::Structure found = structure_of(dry);
  CHECK(found.p < 1e-6);
  REQUIRE_FALSE(found.dependences.empty());
  const gap::Dependence& first = found.dependences.front();
  CHECK(first.variable.joint == 1);
  CHECK(first.share > 0.8);
  CHECK(std::ranges::any_of(found.dependences, [](const gap::Dependence& d) { return d.sign_joint == 1; }));
  // The strongest test sees all of the excess: 1200 times 1.5^2.
  CHECK(found.strength == Approx(1200 * 2.25).epsilon(0.15));
  // Nothing of it stands out of a discrepancy as large; all of it counts where the noise is smaller.
  CHECK(structure_of(dry, 2 * 1200 * 2.25).p > 0.005);
  CHECK(structure_of(dry, 0.0, 2.0).strength > 3.5 * found.strength);
}

TEST_CASE("that a residual drifts is told only where nothing tells what it depends on") {
  Random random(74);
  cell::Experiment e = experiment("profile-1", cell::Kind::Profile, cell::Split::Fit);
  const Eigen::Index rows = 1200;
  Eigen::VectorXd slow(rows);
  for (Eigen::Index i = 0; i < rows; ++i)
    slow(i) = 1.5 * (((i / 64) * 7919 % 13) > 5 ? 1.0 : -1.0);  // no function of time
  for (const char* column : {"run", "t", "tilt", "alpha", "cx", "cy", "fc"})
    add_column(e, column, Eigen::VectorXd::Zero(rows));
  add_column(e, "z", random.normal_vector(rows) + slow);
  const World world({e});
  const gap::Structure drift = structure_of(world);
  REQUIRE_FALSE(drift.dependences.empty());
  CHECK(drift.dependences.front().shape == gap::Shape::Drifts);
  const World told(recorded(75, [](double t) { return 2.0 * std::sin(M_PI * t); }));
  for (const gap::Dependence& d : structure_of(told).dependences) CHECK(d.shape != gap::Shape::Drifts);
}

TEST_CASE("the best free shape takes what a constant or a line takes, less the price of its size") {
  World world(recorded(76, [](double) { return 0.0; }));
  const std::vector<gap::Group> groups = gap::make_groups(world.data);
  world.base.setConstant(0.8);
  const double n = 1200, width = 3.0;
  const double expected = n * 0.64 - std::log1p(width * width * n) - 2 * std::log1p(std::pow(0.8 / width, 2));
  CHECK(gap::best_free_shape(world.data, groups, world.base, width) == Approx(expected));
  world.base.setZero();
  CHECK(gap::best_free_shape(world.data, groups, world.base, width) == 0.0);
}

}  // namespace structure_test
