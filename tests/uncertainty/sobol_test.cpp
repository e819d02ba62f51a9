#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/uncertainty/sobol.hpp>

using namespace kr5;
using namespace kr5::uncertainty;
using Catch::Matchers::Contains;

namespace {

std::vector<UncertainInput> uniform_inputs(int count, double low, double high) {
  std::vector<UncertainInput> out;
  for (int i = 0; i < count; ++i)
    out.push_back({.name = "x" + std::to_string(i + 1), .law = InputLaw::Uniform, .low = low, .high = high});
  return out;
}

/// Ishigami's function, whose indices are known.
Eigen::MatrixXd ishigami(const Eigen::MatrixXd& x) {
  const auto a = x.array();
  return (a.col(0).sin() + 7 * a.col(1).sin().square() + 0.1 * a.col(2).pow(4) * a.col(0).sin()).matrix();
}

}  // namespace

TEST_CASE("indices of Ishigami's function lie in their intervals, total ones and interactions included") {
  const SobolResult r = sobol_indices(ishigami, uniform_inputs(3, -M_PI, M_PI), {.samples = 8192});
  const double V = 49.0 / 8 + 0.1 * std::pow(M_PI, 4) / 5 + 0.01 * std::pow(M_PI, 8) / 18 + 0.5;
  const double first[] = {(0.5 * std::pow(1 + 0.1 * std::pow(M_PI, 4) / 5, 2)) / V, (49.0 / 8) / V, 0.0};
  const double both = 0.01 * std::pow(M_PI, 8) * (1.0 / 18 - 1.0 / 50) / V;
  const double total[] = {first[0] + both, first[1], both};
  CHECK(r.variance[0] == Approx(V).epsilon(0.02));
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
  const SobolResult r =
      sobol_indices([](const Eigen::MatrixXd& x) { return Eigen::MatrixXd(x.rowwise().sum()); }, inputs);
  for (int k = 0; k < 3; ++k) {
    const double share = std::pow(k + 1.0, 2) / 14;
    CHECK(r.first(k, 0) == Approx(share).margin(0.01));
    CHECK(r.total(k, 0) == Approx(share).margin(0.01));
  }
  CHECK(r.first.sum() == Approx(1.0).margin(0.02));
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
  if ((r.first.array() < 0).any()) CHECK_THAT(notes, Contains("zero within their intervals"));
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
  CHECK_THROWS_WITH(sobol_indices(ishigami, {{.name = "b", .sigma = -1}}), Contains("input b: sigma must be positive"));
}
