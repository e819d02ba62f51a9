#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/uncertainty/sobol.hpp>

#include "support/coverage.hpp"
#include "support/trials.hpp"

namespace sobol_test {

using namespace kr5;
using namespace kr5::uncertainty;
using Catch::Matchers::Contains;

namespace {

std::vector<UncertainInput> uniform_inputs(int count, double low, double high) {
  std::vector<UncertainInput> out;
  for (int i = 0; i < count; ++i)
    out.push_back({.name = std::string(1, 'x').append(std::to_string(i + 1)),
                   .law = InputLaw::Uniform,
                   .low = low,
                   .high = high});
  return out;
}

/// Ishigami's function, whose indices are known.
Eigen::MatrixXd ishigami(const Eigen::MatrixXd& x) {
  const auto a = x.array();
  return (a.col(0).sin() + 7 * a.col(1).sin().square() + 0.1 * a.col(2).pow(4) * a.col(0).sin()).matrix();
}

/// First-order and total indices of Ishigami's function (Ishigami and Homma 1990).
struct Indices {
  double variance;
  Eigen::VectorXd first, total;
};
Indices ishigami_indices() {
  const double V = 49.0 / 8 + 0.1 * std::pow(M_PI, 4) / 5 + 0.01 * std::pow(M_PI, 8) / 18 + 0.5;
  const double both = 0.01 * std::pow(M_PI, 8) * (1.0 / 18 - 1.0 / 50) / V;
  const Eigen::Vector3d first(0.5 * std::pow(1 + 0.1 * std::pow(M_PI, 4) / 5, 2) / V, 49.0 / 8 / V, 0.0);
  return {V, first, first + Eigen::Vector3d(both, 0, both)};
}

/// Sobol's g-function on the unit cube, prod (|4 x - 2| + a) / (1 + a), whose parts have variances 1 / 3 (1 + a)^2.
const Eigen::VectorXd g_weights = (Eigen::VectorXd(6) << 0, 0.5, 3, 9, 99, 99).finished();
Eigen::MatrixXd g_function(const Eigen::MatrixXd& x) {
  Eigen::MatrixXd out = Eigen::MatrixXd::Ones(x.rows(), 1);
  for (Eigen::Index k = 0; k < x.cols(); ++k)
    out.array() *= ((4 * x.col(k).array() - 2).abs() + g_weights[k]) / (1 + g_weights[k]);
  return out;
}
Indices g_indices() {
  const Eigen::ArrayXd part = 1 / (3 * (1 + g_weights.array()).square());
  const double all = (1 + part).prod(), V = all - 1;
  return {V, part / V, part * all / (1 + part) / V};
}

}  // namespace

TEST_CASE("indices of Ishigami's function lie in their intervals, total ones and interactions included") {
  const SobolResult r = sobol_indices(ishigami, uniform_inputs(3, -M_PI, M_PI), {.samples = 8192});
  const auto [V, first, total] = ishigami_indices();
  for (int k = 0; k < 3; ++k) {
    CAPTURE(k);
    CHECK(r.first(k, 0) == Approx(first[k]).margin(0.02));
    CHECK(r.total(k, 0) == Approx(total[k]).margin(0.02));
    CHECK(r.first_low(k, 0) <= r.first(k, 0));
    CHECK(r.total_high(k, 0) >= r.total(k, 0));
    CHECK(r.total_high(k, 0) - r.total_low(k, 0) < 0.1);
  }
  CHECK(r.evaluations == 8192 * 5);
}

TEST_CASE("of a sum of normal inputs each has its share of the variance, alone and in all") {
  std::vector<UncertainInput> inputs;
  for (const double sigma : {1.0, 2.0, 3.0}) inputs.push_back({.name = "x", .sigma = sigma, .truncation = 8.0});
  const SobolResult r = sobol_indices([](const Eigen::MatrixXd& x) { return Eigen::MatrixXd(x.rowwise().sum()); },
                                      inputs, {.samples = 1 << 14});
  for (int k = 0; k < 3; ++k) {
    const double share = std::pow(k + 1.0, 2) / 14;
    // Random rows would have a standard error of sqrt(2 share / N) <= 0.009.
    CHECK(r.first(k, 0) == Approx(share).margin(0.02));
    CHECK(r.total(k, 0) == Approx(share).margin(0.02));
  }
  CHECK(r.first.sum() == Approx(1.0).margin(0.03));
}

TEST_CASE("a normal input is cut off at its truncation and has its quantiles") {
  const UncertainInput x{.name = "x", .mean = 2, .sigma = 0.5};
  CHECK(x.quantile(0.5) == Approx(2.0));
  CHECK(x.quantile(1e-12) == Approx(0.5).margin(1e-6));
  CHECK(x.quantile(1 - 1e-12) == Approx(3.5).margin(1e-6));
}

TEST_CASE("samples are doubled until the intervals are narrow enough, or no further") {
  const auto inputs = uniform_inputs(3, -M_PI, M_PI);
  const SobolResult enough =
      sobol_indices(ishigami, inputs, {.samples = 64, .max_samples = 1 << 15, .tolerance = 0.05});
  CHECK(enough.converged);
  CHECK(enough.samples > 64);
  CHECK((enough.total_high - enough.total_low).maxCoeff() <= 0.1);
  const SobolResult not_enough =
      sobol_indices(ishigami, inputs, {.samples = 64, .max_samples = 128, .tolerance = 0.01});
  CHECK_FALSE(not_enough.converged);
  CHECK(not_enough.samples == 128);
}

TEST_CASE("negative estimates are explained, and an output that does not vary has indices 0") {
  const auto model = [](const Eigen::MatrixXd& x) {
    Eigen::MatrixXd y(x.rows(), 2);
    y << x.col(0), Eigen::VectorXd::Constant(x.rows(), 3.0);
    return y;
  };
  const SobolResult r = sobol_indices(model, uniform_inputs(6, 0, 1), {.samples = 64});
  CHECK(r.total.col(1).isZero());
  std::string notes;
  for (const std::string& note : r.notes) notes += note + "\n";
  CHECK_THAT(notes, Contains("output 2 does not vary"));
}

TEST_CASE("a negative estimate is explained, with the input and the output it is of") {
  // Six inputs act alike on a product: their first-order indices are 0, so half of the estimates are negative.
  const auto product = [](const Eigen::MatrixXd& x) { return Eigen::MatrixXd(x.rowwise().prod()); };
  const SobolResult r = sobol_indices(product, uniform_inputs(6, -1, 1), {.samples = 64});
  REQUIRE((r.first.array() < 0).any());
  REQUIRE(r.notes.size() == 1);
  CHECK_THAT(r.notes[0], Contains("negative, the least -") && Contains("output 1") && Contains("(x"));
  CHECK_THAT(r.notes[0], Contains("no index is below zero"));
}

TEST_CASE("an output that varies by rounding alone is constant") {
  const auto model = [](const Eigen::MatrixXd& x) { return Eigen::MatrixXd(1000 + 1e-13 * x.col(0).array()); };
  CHECK(sobol_indices(model, uniform_inputs(2, 0, 1), {.samples = 64}).variance[0] == 0);
  const auto small = [](const Eigen::MatrixXd& x) { return Eigen::MatrixXd(1e-9 * x.col(0)); };
  CHECK(sobol_indices(small, uniform_inputs(2, 0, 1), {.samples = 64}).total(0, 0) > 0.8);
  CHECK(sobol_indices(small, uniform_inputs(2, 0, 1), {.samples = 64, .resolution = 1e-8}).total(0, 0) == 0);
}

TEST_CASE("indices are averages over an input that is set aside") {
  // x1 z and x2 (1 - z), z uniform: of the variance at a given z, averaged over z, each has half, alone.
  const auto model = [](const Eigen::MatrixXd& x) {
    return Eigen::MatrixXd(x.col(0).array() * x.col(2).array() + x.col(1).array() * (1 - x.col(2).array()) +
                           50 * x.col(2).array());
  };
  auto inputs = uniform_inputs(3, -1, 1);
  inputs[2] = {.name = "z", .law = InputLaw::Uniform, .low = 0, .high = 1, .averaged = true};
  const SobolResult r = sobol_indices(model, inputs, {.samples = 1 << 14});
  CHECK(r.inputs == std::vector<std::string>{"x1", "x2"});
  CHECK(r.evaluations == (1 << 14) * 4);
  CHECK(r.variance[0] == Approx(2.0 / 9).epsilon(0.03));
  for (int k = 0; k < 2; ++k) {
    CHECK(r.total(k, 0) == Approx(0.5).margin(0.02));
    CHECK(std::abs(r.first(k, 0) - 0.5) < 2 * (r.first_high(k, 0) - r.first(k, 0)));
  }
}

TEST_CASE("rows of a design do not depend on how many are asked for at a time") {
  const auto inputs = uniform_inputs(4, -1, 1);
  const Rows all = sobol_design(inputs, 0, 128);
  Rows parts(all.rows(), all.cols());
  for (int first = 0; first < 128; first += first == 0 ? 5 : 41)
    parts.middleRows(first * 6, first == 0 ? 5 * 6 : 41 * 6) = sobol_design(inputs, first, first == 0 ? 5 : 41);
  CHECK(parts == all);
  // Row of A, that with one value of B after the other, row of B; each replicate fills its halves and quarters evenly.
  for (Eigen::Index k = 0; k < 4; ++k) CHECK(all(1 + k, k) == all(5, k));
  CHECK((all.row(1).tail(3) - all.row(0).tail(3)).norm() == 0);
  for (Eigen::Index column = 0; column < 4; ++column) {
    int count[4] = {};
    for (int p = 0; p < 8; ++p) ++count[static_cast<int>(2 * (all((16 * p + 3) * 6, column) + 1))];
    CHECK((count[0] == 2 && count[1] == 2 && count[2] == 2 && count[3] == 2));
  }
  CHECK(sobol_design(inputs, 0, 16, {.seed = 2}) != all.topRows(96));
}

TEST_CASE("intervals of the indices hold the truth as often as they say", "[statistics]") {
  struct Case {
    const char* name;
    BatchModel model;
    std::vector<UncertainInput> inputs;
    Indices truth;
  };
  const Case cases[] = {{"Ishigami", ishigami, uniform_inputs(3, -M_PI, M_PI), ishigami_indices()},
                        {"g-function", g_function, uniform_inputs(6, 0, 1), g_indices()}};
  const double factor = 1 / student_factor(15, 0.95);
  for (const auto& [name, model, inputs, truth] : cases) {
    test::Coverage first(std::string("Sobol, first order, ") + name, 1), total(std::string("Sobol, total, ") + name, 1);
    for (int t = 0; t < test::trials(2000, 120); ++t) {
      const SobolResult r =
          sobol_indices(model, inputs, {.samples = 1024, .resamples = 200, .seed = 1 + static_cast<unsigned>(t)});
      const auto add = [&](test::Coverage& to, const auto& found, const auto& high, const Eigen::VectorXd& right) {
        const Eigen::Index k = t % right.size();  // one of them each time, since those of one run are not independent
        const double sigma = factor * (high(k, 0) - found(k, 0));
        to.add(Eigen::VectorXd::Constant(1, found(k, 0) - right[k]),
               Eigen::MatrixXd::Constant(1, 1, std::pow(sigma, 2) * covariance_inflation(1, 15)), 15);
      };
      add(first, r.first, r.first_high, truth.first);
      add(total, r.total, r.total_high, truth.total);
    }
    first.check_rate(), total.check_rate();
  }
}

TEST_CASE("one input changed at a time moves the outputs by its own part alone") {
  const auto model = [](const Eigen::MatrixXd& x) {
    Eigen::MatrixXd y(x.rows(), 2);
    y << 2 * x.col(0) + x.col(1).cwiseAbs2(), 3 * x.col(0);
    return y;
  };
  const OneAtATime r = one_at_a_time(
      model, {{.name = "n", .mean = 5, .sigma = 0.5}, {.name = "u", .law = InputLaw::Uniform, .low = -1, .high = 3}});
  CHECK((r.centre - Eigen::Vector2d(11, 15)).norm() < 1e-12);
  CHECK(r.plus(0, 0) == Approx(1.0));
  CHECK(r.minus(0, 1) == Approx(-1.5));
  const double sigma = 4 / std::sqrt(12.0);  // of the uniform input, about 1
  CHECK(r.minus(1, 0) == Approx(std::pow(1 - sigma, 2) - 1));
  CHECK(r.plus(1, 0) == Approx(std::pow(1 + sigma, 2) - 1));
  CHECK(r.minus(1, 1) == 0);
  CHECK(r.highest(0, 0) == Approx(3.0));
  CHECK(r.highest(1, 0) == Approx(8.0));
  CHECK(r.lowest(1, 0) == Approx(-1.0));
  CHECK(r.highest(1, 1) == 0);
}

TEST_CASE("a model or inputs that cannot be sampled are refused") {
  const auto inputs = uniform_inputs(2, 0, 1);
  const auto bad = [](const Eigen::MatrixXd& x) {
    return Eigen::MatrixXd(Eigen::MatrixXd::Constant(x.rows(), 1, NAN));
  };
  CHECK_THROWS_WITH(sobol_indices(bad, inputs), Contains("not finite"));
  const auto few = [](const Eigen::MatrixXd&) { return Eigen::MatrixXd(Eigen::MatrixXd::Zero(3, 1)); };
  CHECK_THROWS_WITH(sobol_indices(few, inputs), Contains("3 rows of outputs"));
  CHECK_THROWS_WITH(sobol_indices(ishigami, {}), Contains("no inputs"));
  CHECK_THROWS_WITH(sobol_indices(ishigami, inputs, {.samples = 100}), Contains("power of two"));
  CHECK_THROWS_WITH(sobol_indices(ishigami, inputs, {.samples = 16}), Contains("two for each of the 16 replicates"));
  auto averaged = inputs;
  for (UncertainInput& input : averaged) input.averaged = true;
  CHECK_THROWS_WITH(sobol_indices(ishigami, averaged), Contains("every input is averaged over"));
  CHECK_THROWS_WITH(sobol_estimate(Rows::Zero(50, 1), inputs), Contains("50 rows of outputs are not 4 for each row"));
  CHECK_THROWS_WITH(sobol_indices(ishigami, {{.name = "b", .sigma = -1}}), Contains("input b: sigma must be positive"));
}

}  // namespace sobol_test
