#include "gap/planning/experiment_scorer.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// What an experiment would tell, where alternatives are linear.

namespace experiment_scorer_test {

using namespace kr5;
using namespace linear_world;

namespace {

/// Alike in what was recorded, and different later.
double one(double t) { return 0.1 * t; }
double two(double t) { return t < 5.0 ? 0.1 * t : 0.5; }

struct Plan {
  Plan() : context(recorded(), simulator) {
    gap::PlanOptions options;
    options.own_hypotheses = {adding("one", "i1", one), adding("two", "i1", two)};
    options.threads = 1;
    fitted = gap::fit_alternatives(context, {{{"one", "i1"}}, {{"two", "i1"}}}, options);
  }
  static cell::Recording recorded() {
    Random random(141);
    cell::Recording r;
    r.cell = unit_noise();
    r.experiments = {motion("motion-1", cell::Split::Fit, 400)};
    add_column(r.experiments[0], "i1", random.normal_vector(400) + 8.0 * at_times(r.experiments[0], one));
    for (int j = 2; j <= 6; ++j) add_column(r.experiments[0], "i" + std::to_string(j), random.normal_vector(400));
    return r;
  }
  gap::ExperimentScorer scorer(double accuracy = 0.0) const { return {context.data, fitted, 0.0, accuracy, {}}; }
  static gap::Proposal proposal(double start, int rows = 300) {
    return {motion("next", cell::Split::Fit, rows, start), "move", 0.0, 10.0};
  }
  Zeros simulator;
  gap::FitContext context;
  std::vector<gap::Fitted> fitted;
};

}  // namespace

TEST_CASE("an experiment separates alternatives by what the one leaves of the other, and more so when repeated") {
  const Plan plan;
  gap::Proposal alike = Plan::proposal(0.0), different = Plan::proposal(6.0);
  const auto of_alike = plan.scorer().score(alike, false), of_different = plan.scorer().score(different, false);
  REQUIRE(of_alike);
  REQUIRE(of_different);
  CHECK(of_alike->separation[0] < 0.1);
  CHECK(of_different->separation[0] > 3.0);
  // Independently: of two alternatives, the less distance; each coordinate as far open as the context leaves it.
  double least = 1e9;
  for (int i = 0; i < 2; ++i) {
    const Shape shown = i == 0 ? one : two, other = i == 0 ? two : one;
    const auto k = static_cast<std::size_t>(i);
    const Eigen::VectorXd a = plan.fitted[k].x[0](0) * at_times(different.experiment, shown),
                          J = at_times(different.experiment, other);
    const Eigen::VectorXd r = a - plan.fitted[1 - k].x[0](0) * J;
    const double information = J.squaredNorm() + plan.fitted[1 - k].information(0, 0) + 1.0 / 9;
    least = std::min(least, std::sqrt(r.squaredNorm() - std::pow(J.dot(r), 2) / information));
  }
  CHECK(of_different->separation[0] == Approx(least).epsilon(0.01));
  for (std::size_t k = 1; k < gap::repeats.size(); ++k)
    CHECK(of_different->separation[k] > of_different->separation[k - 1]);
  // What the model may be off does not average out.
  gap::Proposal again = Plan::proposal(6.0);
  const auto careful = plan.scorer(0.2).score(again, false);
  REQUIRE(careful);
  CHECK(careful->separation[0] < of_different->separation[0]);
  CHECK(careful->separation.back() / careful->separation[0] <
        of_different->separation.back() / of_different->separation[0]);
}

TEST_CASE("the forecast names the columns that differ, and how far the alternatives move them") {
  const Plan plan;
  gap::Proposal p = Plan::proposal(6.0);
  const auto score = plan.scorer().score(p, false);
  REQUIRE(score);
  REQUIRE(score->columns.size() == 6);  // as recorded before; what differs most is first
  CHECK(score->columns[1].difference == 0.0);
  const gap::ForecastColumn& c = score->columns[0];
  CHECK(c.column == "i1");
  REQUIRE(c.change.size() == 2);
  const auto rms = [](const Eigen::VectorXd& v) { return std::sqrt(v.squaredNorm() / static_cast<double>(v.size())); };
  const Eigen::VectorXd a = plan.fitted[0].x[0](0) * at_times(p.experiment, one),
                        b = plan.fitted[1].x[0](0) * at_times(p.experiment, two);
  CHECK(c.change[0] == Approx(rms(a)).epsilon(1e-6));
  CHECK(c.change[1] == Approx(rms(b)).epsilon(1e-6));
  CHECK(c.difference == Approx(rms(a - b)).epsilon(1e-6));
}

TEST_CASE("a separation is confirmed by fitting the wrong alternative to recording and proposal together") {
  const Plan plan;
  gap::Proposal alike = Plan::proposal(0.0), different = Plan::proposal(6.0);
  const double score = plan.scorer().score(different, false)->separation[0];
  CHECK(plan.scorer().confirmed(plan.context, alike) < 0.2);
  CHECK(plan.scorer().confirmed(plan.context, different) == Approx(score).epsilon(0.05));
}

TEST_CASE("the highest current of each motor is that of all motions") {
  cell::Recording r = Plan::recorded();
  r.experiments[0].data.values.col(r.experiments[0].data.find("i2"))(7) = -30.5;
  const Eigen::VectorXd most = gap::highest_current(r);
  REQUIRE(most.size() == 6);
  CHECK(most(0) == r.experiments[0].data.column("i1").cwiseAbs().maxCoeff());
  CHECK(most(1) == 30.5);
  r.experiments.clear();
  CHECK(gap::highest_current(r).size() == 0);
}

}  // namespace experiment_scorer_test
