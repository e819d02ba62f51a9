#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/statistics.hpp>
#include <kr5/fit/pipeline/pipeline.hpp>
#include <kr5/fit/pipeline/second_minimum.hpp>

namespace pipeline_test {

using namespace kr5;
using namespace kr5::fit::pipeline;

namespace {

/// A number x measured as x^2 with an unknown sign and as x itself: two valleys, of which one is right. What a first
/// look says of them may mislead.
struct Valleys {
  using Place = double;

  std::vector<double> squares;  // of x
  double itself = 0.0;          // a measurement of x with the noise `sigma`
  double sigma = 0.1;
  bool misled = false;  // the first look takes the wrong valley for the better
  std::vector<double> begin_at = {2.0, -2.0};
  std::vector<double> weights = std::vector<double>(squares.size() + 1, 1.0);
  double x = 0.0, noise = 0.0;
  int begun = 0;

  double cost(double at) const {
    double out = std::pow((at - itself) / sigma, 2);
    for (const double square : squares) out += std::pow((at * at - square) / 0.01, 2);
    return out;
  }
  /// By Gauss and Newton's method.
  double descended(double from) const {
    for (int step = 0; step < 100; ++step) {
      double slope = (from - itself) / (sigma * sigma), curvature = 1 / (sigma * sigma);
      for (const double square : squares)
        slope += 2 * from * (from * from - square) / 1e-4, curvature += 4 * from * from / 1e-4;
      from -= slope / curvature;
    }
    return from;
  }
  std::vector<double> starts() const { return begin_at; }
  Minimum<double> descend(double from) const {
    const double at = descended(from);
    return {at, misled ? -cost(at) : cost(at)};
  }
  void begin(double place) { x = place, ++begun; }
  void find_noise() { x = descended(x), noise = std::sqrt(cost(x)); }
  std::vector<double> probabilities() const { return std::vector<double>(weights.size(), 1.0); }
  std::size_t fewest() const { return 1; }
  double false_alarm() const { return 0.01; }
  double place() const { return x; }
  Minimum<double> revisit(double from) const {
    const double at = descended(from);
    return {at, cost(at)};
  }
  bool same(double one, double other) const { return std::abs(one - other) < 0.1; }
};

}  // namespace

TEST_CASE("of two minima the better is taken, and the other told with its cost") {
  Valleys valleys{.squares = {4.0, 4.001, 3.999}, .itself = -1.95};
  const auto rival = run(valleys);
  CHECK(valleys.x == Approx(-2.0).epsilon(1e-3));
  REQUIRE(rival);
  CHECK(rival->at == Approx(2.0).epsilon(1e-3));
  CHECK(rival->cost > rival->best_cost);
  CHECK(rival->best_cost == Approx(valleys.cost(valleys.x)).epsilon(1e-6));
}

TEST_CASE("a first look that takes the wrong minimum is corrected with the noise that was found") {
  Valleys valleys{.squares = {4.0, 4.001, 3.999}, .itself = 1.95, .misled = true};
  const auto rival = run(valleys);
  CHECK(valleys.begun == 2);  // at -2, and then where the cost is lower
  CHECK(valleys.x == Approx(2.0).epsilon(1e-3));
  REQUIRE(rival);
  CHECK(rival->at == Approx(-2.0).epsilon(1e-3));
}

TEST_CASE("starts that end at one place leave no rival") {
  Valleys valleys{.squares = {4.0, 4.001, 3.999}, .itself = 1.95, .begin_at = {1.5, 2.5, 2.1}};
  CHECK_FALSE(run(valleys));
  CHECK(valleys.begun == 1);
}

TEST_CASE("a second minimum is told where it is near, with the probability of being the right one") {
  Pose other = Pose::Identity();
  other.translation().x() = 0.01;
  const auto even = second_minimum(Pose::Identity(), other, 20.0, 20.0, 30.0);
  REQUIRE(even);
  CHECK(even->probability == Approx(0.5));
  CHECK(even->cost_ratio == Approx(1.0));
  CHECK(even->position == Approx(0.01));
  CHECK(even->rotation == Approx(0.0).margin(1e-12));
  // Known noise: the likelihoods are exp(-10) apart.
  const auto known = second_minimum(Pose::Identity(), other, 20.0, 40.0, 1e6);
  REQUIRE(known);
  CHECK(known->probability == Approx(std::exp(-10.0)).epsilon(1e-3));
  CHECK(second_minimum(Pose::Identity(), other, 20.0, 40.0, 5.0)->probability > known->probability);
  CHECK_FALSE(second_minimum(Pose::Identity(), other, 20.0, 200.0, 30.0));
  CHECK(second_text(*even) == "the other, 10.0 mm and 0.0 deg away, has 1.00 times the squared residuals");
}

TEST_CASE("a result is refused where two minima cannot be told apart, but an earlier reason stays the message") {
  Pose other = Pose::Identity();
  other.translation().x() = 0.01;
  const auto even = second_minimum(Pose::Identity(), other, 20.0, 20.0, 30.0);
  FitReport fit{.status = FitStatus::Converged, .message = "12 views"};
  refuse_undecided(second_minimum(Pose::Identity(), other, 20.0, 60.0, 1e6), "two poses explain them", "take more",
                   fit);
  CHECK(fit.message == "12 views");
  refuse_undecided(std::nullopt, "two poses explain them", "take more", fit);
  CHECK(fit.usable());
  refuse_undecided(even, "two poses explain them", "take more", fit);
  CHECK(fit.status == FitStatus::Degenerate);
  CHECK(fit.message == "two poses explain them: " + second_text(*even) + "; take more");
  fit.message = "one axis only";
  refuse_undecided(even, "two poses explain them", "take more", fit);
  CHECK(fit.message == "one axis only");
}

}  // namespace pipeline_test
