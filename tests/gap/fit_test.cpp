#include "gap/fitting/fit.hpp"

#include <cmath>

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "gap/two_shapes.hpp"

/// @file
/// Fits of effects that are linear in their coordinates, against the formulas of Gaussian regression.

namespace fit_test {

using namespace kr5;
using namespace two_shapes;

namespace {

struct Regression {
  Eigen::MatrixXd J;  ///< A column a coordinate.
  Eigen::VectorXd r;
};

Regression regression(const World& world, int experiment, const std::vector<Shape>& shapes) {
  const gap::Block& block = world.data.blocks[static_cast<std::size_t>(experiment)];
  Regression out{Eigen::MatrixXd(block.rows, static_cast<Eigen::Index>(shapes.size())), block.rows_of(world.base)};
  for (std::size_t i = 0; i < shapes.size(); ++i)
    out.J.col(static_cast<Eigen::Index>(i)) = at_times(world.data.experiment(block), shapes[i]);
  return out;
}

}  // namespace

TEST_CASE("a fit of linear effects is least squares on the fit experiments") {
  const World world(recorded(8.0, -6.0, 3));
  const gap::Candidate a = acting_in(adding("wave", "i1", wave), {0, 1}),
                       b = acting_in(adding("ramp", "i1", ramp), {0, 1});
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, 0.0};
  const gap::Model model = gap::fit(problem, gap::empty_model(problem, world.base), {part(a, 0.0), part(b, 0.0)});
  const Regression fit = regression(world, 0, {wave, ramp});
  const Eigen::MatrixXd H = fit.J.transpose() * fit.J;
  const Eigen::VectorXd expected = H.ldlt().solve(fit.J.transpose() * fit.r);
  const Eigen::Vector2d found(model.parts[0].x(0), model.parts[1].x(0));
  // The fit ends when a step gains less than 0.02 of chi-square.
  CHECK((found - expected).dot(H * (found - expected)) < 0.02);
  CHECK((model.information - H).norm() < 1e-4 * H.norm());
  const double least = (fit.r - fit.J * expected).squaredNorm();
  CHECK(model.chi2_fit >= least - 1e-6);
  CHECK(model.chi2_fit < least + 0.02);
  const Regression check = regression(world, 1, {wave, ramp});
  const Eigen::VectorXd left = check.r - check.J * found;
  CHECK((world.data.blocks[1].rows_of(model.residual) - left).norm() < 1e-9);
}

TEST_CASE("the evidence counts the check experiments as the fit predicts them, and every coordinate by its prior") {
  const World world(recorded(8.0, 0.0, 4));
  gap::Hypothesis h = adding("wave", "i1", wave);
  h.log_prior = -0.7;
  const gap::Candidate a = acting_in(h, {0, 1});
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, -4.0};
  const gap::Model model = gap::fit(problem, gap::empty_model(problem, world.base), {part(a, 0.0)});
  const double x = model.parts[0].x(0), width2 = gap::prior_width * gap::prior_width;
  const Regression fit = regression(world, 0, {wave}), check = regression(world, 1, {wave});
  const double H = fit.J.squaredNorm(), C = check.J.squaredNorm();
  // Check residuals have the covariance I + J P J', P that of the coordinate after the fit and its prior.
  const Eigen::VectorXd r = check.r - x * check.J.col(0);
  const Eigen::MatrixXd S =
      Eigen::MatrixXd::Identity(r.size(), r.size()) + check.J * check.J.transpose() / (H + 1 / width2);
  CHECK(model.chi2_check == Approx(r.dot(S.llt().solve(r))).epsilon(1e-4));
  const double expected = -0.5 * (model.chi2_fit + model.chi2_check) - 0.5 * std::log(1 + width2 * (H + C)) - 4.0 -
                          0.7 - std::log1p(x * x / width2);
  CHECK(model.log_evidence == Approx(expected).epsilon(1e-5));
  CHECK(gap::log_evidence(problem, model) == model.log_evidence);
  // A model without effects is its misfit alone.
  const gap::Model empty = gap::empty_model(problem, world.base);
  CHECK(empty.log_evidence == Approx(-0.5 * world.base.squaredNorm()));
  CHECK(model.log_evidence > empty.log_evidence);
}

TEST_CASE("what the check experiments could still move a coordinate by is taken out of what is counted") {
  const World world(recorded(8.0, 0.0, 5));
  const gap::Candidate a = acting_in(adding("wave", "i1", wave), {0, 1});
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, 0.0};
  const gap::Model model = gap::fit(problem, gap::empty_model(problem, world.base), {part(a, 0.0)});
  const Regression fit = regression(world, 0, {wave}), check = regression(world, 1, {wave});
  const double x = model.parts[0].x(0);
  const double moved = check.J.col(0).dot(check.r - x * check.J.col(0)) /
                       (fit.J.squaredNorm() + check.J.squaredNorm() + 1 / (gap::prior_width * gap::prior_width));
  const Eigen::VectorXd counted = gap::updated(problem, model);
  CHECK((world.data.blocks[0].rows_of(counted) - (fit.r - (x + moved) * fit.J.col(0))).norm() < 1e-4);
  CHECK((world.data.blocks[1].rows_of(counted) - (check.r - (x + moved) * check.J.col(0))).norm() < 1e-4);
}

TEST_CASE("bounds hold a coordinate, and whole ones are counted") {
  const World world(recorded(8.0, 0.0, 6));
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, 0.0};
  const gap::Model empty = gap::empty_model(problem, world.base);
  const gap::Candidate bounded = acting_in(adding("wave", "i1", wave, -1.0, 2.0), {0, 1});
  CHECK(gap::fit(problem, empty, {part(bounded, 0.5)}).parts[0].x(0) == 2.0);
  gap::Hypothesis cycles = adding("wave", "i1", wave);
  cycles.coordinates[0].whole = true;
  cycles.coordinates[0].step = 1.0;
  const gap::Candidate whole = acting_in(cycles, {0, 1});
  const Regression fit = regression(world, 0, {wave});
  const double best = fit.J.col(0).dot(fit.r) / fit.J.squaredNorm();
  CHECK(gap::fit(problem, empty, {part(whole, 0.4)}).parts[0].x(0) == std::round(best));
}

TEST_CASE("slopes that follow the steps lead to the same minimum as slopes at each point") {
  gap::OwnEffect own{{"bent", "i1"}, {{"size", "A", 1.0, -5.0, 5.0, {}}}, {}, {}};
  own.change = [](io::Table& table, const cell::Experiment& e, const Eigen::VectorXd& x) {
    if (const int at = table.find("i1"); e.kind == cell::Kind::Motion && at >= 0)
      table.values.col(at) += std::expm1(x(0)) * at_times(e, wave);
  };
  const World world(recorded(8.0, -6.0, 8));
  const gap::Candidate a = acting_in(gap::own_hypothesis(own), {0, 1}),
                       b = acting_in(adding("ramp", "i1", ramp), {0, 1});
  const gap::NuisanceModel none;
  const gap::FitProblem at_each{world.data, none, {}, 0.0},
      where_needed{world.data, none, {}, 0.0, gap::Slopes::WhereNeeded};
  const gap::Model empty = gap::empty_model(at_each, world.base);
  const gap::Model one = gap::fit(at_each, empty, {part(a, 0.1), part(b, 0.0)});
  const gap::Model other = gap::fit(where_needed, empty, {part(a, 0.1), part(b, 0.0)});
  CHECK(other.chi2_fit == Approx(one.chi2_fit).margin(0.05));
  CHECK((other.information - one.information).norm() < 0.02 * one.information.norm());
  // Without one part, by the slopes of both.
  const gap::Model alone = gap::fit(at_each, empty, {part(b, 0.0)});
  const gap::Model near = gap::fit(where_needed, empty, {part(b, 0.0)}, {.near = &other});
  CHECK(near.chi2_fit == Approx(alone.chi2_fit).margin(0.05));
}

TEST_CASE("a step to where there is no such cell is shortened, and a fit that begins there begins nearer") {
  gap::OwnEffect own{{"wave", "i1"}, {{"size", "A", 1.0, -1e3, 1e3, {}}}, {}, {}};
  own.apply = [](cell::Cell&, const Eigen::VectorXd& x) { require(x(0) < 12.0, "no such cell"); };
  own.change = [](io::Table& table, const cell::Experiment& e, const Eigen::VectorXd& x) {
    if (const int at = table.find("i1"); e.kind == cell::Kind::Motion && at >= 0)
      table.values.col(at) += (x(0) < 10.0 ? 0.1 * x(0) : x(0) - 9.0) * at_times(e, wave);
  };
  const World world(recorded(2.5, 0.0, 9));  // near 11.5, to which the first slope leads too far
  const gap::Candidate bent = acting_in(gap::own_hypothesis(own), {0, 1});
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, 0.0};
  const gap::Model empty = gap::empty_model(problem, world.base);
  for (const double begin : {0.0, 40.0}) {
    const gap::Model found = gap::fit(problem, empty, {part(bent, begin)});
    CHECK(found.parts[0].x(0) > 10.0);
    CHECK(found.parts[0].x(0) < 12.0);
  }
}

TEST_CASE("small errors of the cell take from a model what they may") {
  const World world(recorded(0.0, 4.0, 7));
  const gap::Signature signature = gap::difference(world.data, {0, 1}, world.base, [&] {
    gap::Setup setup = world.recording.cell;
    gap::apply(setup, adding("ramp", "i1", ramp), Eigen::VectorXd::Ones(1));
    return gap::residuals(world.data, setup, {0, 1}, world.base);
  }());
  const Regression fit = regression(world, 0, {ramp});
  gap::NuisanceModel nuisance{{signature}, Eigen::MatrixXd::Constant(1, 1, fit.J.squaredNorm())};
  const double size = 2.0;
  const gap::FitProblem problem{world.data, nuisance, gap::NuisancePrior(nuisance, size), 0.0};
  const gap::Model empty = gap::empty_model(problem, world.base);
  const Eigen::MatrixXd S =
      Eigen::MatrixXd::Identity(fit.r.size(), fit.r.size()) + size * size * fit.J * fit.J.transpose();
  CHECK(empty.chi2_fit == Approx(fit.r.dot(S.llt().solve(fit.r))).epsilon(1e-4));
  const double log_det = std::log(1 + size * size * fit.J.squaredNorm());
  CHECK(empty.log_evidence == Approx(-0.5 * (empty.chi2_fit + empty.chi2_check + log_det)));
}

TEST_CASE("sets of effects are the same in any order and at any value") {
  const gap::Candidate a = acting_in(adding("wave", "i1", wave), {}), b = acting_in(adding("ramp", "i1", ramp), {});
  const std::vector<gap::Part> both = {part(a, 1.0), part(b, 2.0)};
  CHECK(gap::same_effects(both, {part(b, 0.0), part(a, -3.0)}));
  CHECK_FALSE(gap::same_effects(both, {part(a, 1.0)}));
  CHECK_FALSE(gap::same_effects(both, {part(a, 1.0), part(a, 2.0)}));
  CHECK(gap::same_effects(gap::without(both, 0), {part(b, 2.0)}));
}

}  // namespace fit_test
