#include "gap/fitting/posterior.hpp"

#include <cmath>

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>

#include "gap/linear_world.hpp"
#include "gap/screening/row_hypothesis.hpp"

/// @file
/// Probabilities of effects from the evidence of models, and parameters with their uncertainty.

namespace posterior_test {

using namespace kr5;
using namespace linear_world;

namespace {

gap::Candidate named(const std::string& effect, const std::string& target, bool of_recording = false) {
  gap::Candidate out = acting_in(adding(effect, target, [](double) { return 1.0; }), {0});
  out.hypothesis.of_recording = of_recording;
  return out;
}

/// A model of these effects with an evidence, which touches the only block.
gap::Model model(const World& world, const std::vector<gap::Part>& parts, double log_evidence) {
  gap::Model out;
  out.parts = parts;
  out.residual = world.base;
  out.log_evidence = log_evidence;
  const Eigen::Index n = static_cast<Eigen::Index>(parts.size());
  out.information = Eigen::MatrixXd::Identity(n, n);
  if (n > 0) out.jacobian = {{{{0, Eigen::VectorXf::Ones(world.data.blocks[0].rows)}}}};
  return out;
}

/// One current with residuals of one size.
std::vector<cell::Experiment> constant_residual(double size) {
  cell::Experiment e = motion("motion-1", cell::Split::Fit, 100);
  add_column(e, "i1", Eigen::VectorXd::Constant(100, size));
  return {e};
}

}  // namespace

TEST_CASE("weights are ratios of evidence, softened by the misfit of the best model") {
  const gap::Candidate a = named("a", "i1"), b = named("b", "i1");
  const gap::NuisanceModel none;
  for (const double size : {0.5, 1.0, 3.0}) {
    const World world(constant_residual(size));
    const gap::FitProblem problem{world.data, none, {}, 0.0};
    const std::vector<gap::Model> models = {model(world, {part(a, 1)}, -10.0), model(world, {part(b, 1)}, -12.0),
                                            model(world, {part(a, 1), part(b, 1)}, -13.0)};
    const gap::Posterior found = gap::posterior(problem, models);
    const double temperature = std::max(1.0, size * size);
    CHECK(found.temperature == Approx(temperature));
    const double sum = 1 + std::exp(-2 / temperature) + std::exp(-3 / temperature);
    CHECK(found.weights[0] == Approx(1 / sum));
    CHECK(found.weights[2] == Approx(std::exp(-3 / temperature) / sum));
    CHECK(gap::probability(models, found, {"a", "i1"}) == Approx(found.weights[0] + found.weights[2]));
    CHECK(gap::probability(models, found, {"b", "i1"}) == Approx(found.weights[1] + found.weights[2]));
    CHECK(gap::probability(models, found, {"c", "i1"}) == 0.0);
  }
}

TEST_CASE("effects are tied that stand in the place of another in a model about as likely") {
  const World world(constant_residual(1.0));
  const gap::Candidate a = named("a", "i1"), b = named("b", "i1"), c = named("c", "i1"),
                       late = named("clock", "i1", true);
  const gap::Posterior even{{}, 1.0};
  const gap::Model best = model(world, {part(a, 1)}, 0.0);
  const double near = std::log(0.06), far = std::log(0.04);
  CHECK(gap::ties({best, model(world, {part(b, 1)}, near)}, even, best, 0) ==
        std::vector<gap::EffectName>{{"b", "i1"}});
  CHECK(gap::ties({best, model(world, {part(b, 1)}, far)}, even, best, 0).empty());
  CHECK(gap::ties({best, model(world, {part(b, 1)}, far)}, {{}, 4.0}, best, 0).size() ==
        1);  // where the misfit is large
  CHECK(gap::ties({best, model(world, {part(b, 1), part(c, 1)}, near)}, even, best, 0).empty());  // of more effects
  CHECK(gap::ties({best, model(world, {part(late, 1)}, near)}, even, best, 0).empty());  // a fault of the recording
  // Beside the same companion, only the exchanged effect is tied.
  const gap::Model pair = model(world, {part(a, 1), part(c, 1)}, 0.0);
  const std::vector<gap::Model> models = {pair, model(world, {part(b, 1), part(c, 1)}, near)};
  CHECK(gap::ties(models, even, pair, 0) == std::vector<gap::EffectName>{{"b", "i1"}});
  CHECK(gap::ties(models, even, pair, 1).empty());
}

TEST_CASE("coordinates are as uncertain as their information says, times the misfit") {
  const World world(constant_residual(1.0));
  gap::Candidate a = named("a", "i1"), b = named("b", "i1");
  b.hypothesis.coordinates[0].whole = true;
  gap::Model m = model(world, {part(a, 0.9), part(b, 3.0)}, 0.0);
  m.information << 6.0, 2.0, 2.0, 4.0;
  const Eigen::Matrix2d covariance = Eigen::Matrix2d(m.information).inverse();
  CHECK(gap::coordinate_covariance(m, 0, 1.0)(0, 0) == Approx(covariance(0, 0)));
  CHECK(gap::coordinate_covariance(m, 0, 9.0)(0, 0) == Approx(9 * covariance(0, 0)));
  CHECK(gap::coordinate_covariance(m, 1, 1.0)(0, 0) == Approx(covariance(1, 1) + 1.0 / 12));
  const double sigma = std::sqrt(covariance(0, 0));
  m.parts[0].x(0) = 2.01 * sigma;
  CHECK(gap::is_significant(m, 0, 1.0));
  m.parts[0].x(0) = -2.01 * sigma;
  CHECK(gap::is_significant(m, 0, 1.0));
  m.parts[0].x(0) = 1.99 * sigma;
  CHECK_FALSE(gap::is_significant(m, 0, 1.0));
}

TEST_CASE("parameters are in their own units, and as uncertain as their slope over the coordinate says") {
  const World world(constant_residual(1.0));
  const cell::Cell& cell = world.recording.cell;
  const auto estimate = [&](const std::string& effect, const std::string& target, int index, double x) {
    const gap::Candidate c =
        acting_in(gap::row_hypotheses(cell::find_effect(effect), {cell, index}, target).front(), {0});
    gap::Model m = model(world, {part(c, x)}, 0.0);
    m.information(0, 0) = 25.0;  // a standard deviation of 0.2
    return gap::parameters(world.data, m, 0, 1.0).front();
  };
  // Each value by the kind of coordinate of its row, and its derivative.
  const gap::ParameterEstimate mass = estimate("encoder_offset", "joint2", 1, 0.5);
  const double unit = estimate("encoder_offset", "joint2", 1, 1.0).value[0];
  CHECK(mass.name == "offset");
  CHECK(mass.unit == "rad");
  CHECK(mass.value[0] == Approx(0.5 * unit));
  CHECK(mass.std[0] == Approx(0.2 * unit).epsilon(1e-3));
  const gap::ParameterEstimate spring = estimate("joint_elasticity", "joint2", 1, 0.5);
  const double stiffness = estimate("joint_elasticity", "joint2", 1, 1.0).value[0];  // 1 / (size x)
  CHECK(spring.value[0] == Approx(2 * stiffness));
  CHECK(spring.std[0] == Approx(0.2 * stiffness / 0.25).epsilon(1e-3));
  CHECK(spring.unit == "N.m/rad");
  // An effect of the caller: its own size and unit.
  gap::OwnEffect own{
      {"bend", "i1"}, {{"bend", "1/A", 0.01, -1, 1, {}}}, [](cell::Cell&, const Eigen::VectorXd&) {}, {}};
  own.inaccuracy = 0.4;
  const gap::Candidate c = acting_in(gap::own_hypothesis(own), {0});
  gap::Model m = model(world, {part(c, 3.0)}, 0.0);
  m.information(0, 0) = 25.0;
  const gap::ParameterEstimate bend = gap::parameters(world.data, m, 0, 1.0).front();
  CHECK(bend.value[0] == Approx(0.03));
  CHECK(bend.std[0] == Approx(0.01 * std::hypot(0.2, 0.5 * 0.4 * 0.4 * 3.0)));
  CHECK(bend.unit == "1/A");
}

}  // namespace posterior_test
