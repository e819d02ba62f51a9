#include "gap/screening/screen.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/LU>
#include <catch2/catch.hpp>

#include "gap/two_shapes.hpp"

/// @file
/// Effects ranked by their linear signatures, against the evidence of Gaussian regression.

namespace screen_test {

using namespace kr5;
using namespace two_shapes;

namespace {

double near_ramp(double t) { return 0.05 * t + 0.06 * std::cos(5.0 * t); }

const std::vector<std::pair<std::string, Shape>> shapes = {{"wave", wave}, {"ramp", ramp}, {"near_ramp", near_ramp}};

gap::Screen screen_of(const World& world, double lower = -1e9) {
  std::vector<gap::Hypothesis> all;
  for (const auto& [name, shape] : shapes) all.push_back(adding(name, "i1", shape, lower));
  return gap::Screen(world.data, all, world.recording.cell, world.base, 2, {});
}

/// Log evidence gained by adding columns J with a Gaussian prior, the Cauchy prior counted in its place.
double gain(const Eigen::MatrixXd& J, const Eigen::VectorXd& r) {
  const double width2 = gap::prior_width * gap::prior_width;
  const Eigen::Index n = J.cols();
  const Eigen::MatrixXd A = J.transpose() * J + Eigen::MatrixXd::Identity(n, n) / width2;
  const Eigen::VectorXd x = A.inverse() * J.transpose() * r;
  double out = 0.5 * (r.squaredNorm() - (r - J * x).squaredNorm()) - 0.5 * std::log((A * width2).determinant());
  for (const double c : x) out -= std::log1p(c * c / width2);
  return out;
}

Eigen::MatrixXd columns(const World& world, const std::vector<std::size_t>& which) {
  const cell::Experiment& e = world.recording.experiments[0];
  Eigen::MatrixXd out(e.data.values.rows(), static_cast<Eigen::Index>(which.size()));
  for (std::size_t k = 0; k < which.size(); ++k)
    out.col(static_cast<Eigen::Index>(k)) = at_times(e, shapes[which[k]].second);
  return out;
}

const gap::Suggestion& of(const std::vector<gap::Suggestion>& all, const std::string& effect) {
  return *std::ranges::find_if(all,
                               [&](const gap::Suggestion& s) { return s.part.candidate->hypothesis.effect == effect; });
}

}  // namespace

TEST_CASE("a suggestion scores the evidence that its signature gains, and starts at its estimate") {
  const World world(recorded(6.0, 3.0, 11));
  gap::Screen screen = screen_of(world);
  CHECK(screen.effects() == 3);
  REQUIRE(screen.candidates().size() == 3);
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, -1.5};
  const std::vector<gap::Suggestion> found = screen.rank(problem, gap::empty_model(problem, world.base));
  REQUIRE(found.size() == 3);
  CHECK(std::ranges::is_sorted(found, std::greater<>(), &gap::Suggestion::score));
  const Eigen::VectorXd r = world.data.blocks[0].rows_of(world.base);
  for (std::size_t k = 0; k < 3; ++k) {
    const gap::Suggestion& s = of(found, shapes[k].first);
    const Eigen::MatrixXd J = columns(world, {k});
    CHECK(s.score == Approx(gain(J, r) - 1.5).epsilon(1e-3));
    CHECK(s.part.x(0) == Approx(J.col(0).dot(r) / (J.squaredNorm() + 1.0 / 9)).epsilon(1e-3));
  }
}

TEST_CASE("beside a model, a suggestion explains only what the effects of the model cannot") {
  const World world(recorded(0.0, 6.0, 12));
  gap::Screen screen = screen_of(world);
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, 0.0};
  const gap::Model empty = gap::empty_model(problem, world.base);
  const double alone = of(screen.rank(problem, empty), "near_ramp").score;
  const gap::Model with = gap::fit(problem, empty, {{screen.candidates()[1].get(), Eigen::VectorXd::Constant(1, 6.0)}});
  const std::vector<gap::Suggestion> found = screen.rank(problem, with);
  REQUIRE(found.size() == 2);  // not the effect that the model has
  CHECK(alone > 50.0);
  CHECK(of(found, "near_ramp").score < 5.0);
}

TEST_CASE("an effect on the wrong side of its bound is not suggested") {
  const World world(recorded(-6.0, 0.0, 13));
  gap::Screen screen = screen_of(world, 0.0);
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, 0.0};
  for (const gap::Suggestion& s : screen.rank(problem, gap::empty_model(problem, world.base)))
    CHECK(s.part.candidate->hypothesis.effect != "wave");
}

TEST_CASE("pairs are scored together: two that each explain little may explain much") {
  const World world(recorded(6.0, 6.0, 14));
  const gap::Screen screen = screen_of(world);
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, -1.0};
  const std::vector<gap::PairSuggestion> found = screen.rank_pairs(problem, gap::empty_model(problem, world.base), 2);
  REQUIRE(found.size() == 2);
  CHECK(found[0].score >= found[1].score);
  CHECK(found[0].first.candidate->hypothesis.effect == "wave");
  CHECK(found[0].second.candidate->hypothesis.effect == "ramp");
  const Eigen::VectorXd r = world.data.blocks[0].rows_of(world.base);
  CHECK(found[0].score == Approx(gain(columns(world, {0, 1}), r) - 2.0).epsilon(1e-3));
  CHECK(found[0].second.x(0) == Approx(6.0).margin(1.0));
}

TEST_CASE("what no column shows is told as unseen, but for faults of the recording") {
  const World world(recorded(0.0, 0.0, 15));
  gap::Hypothesis fault = adding("clock", "i3", wave);  // of a column that was not recorded
  fault.of_recording = true;
  const gap::Screen screen(world.data, {adding("wave", "i1", wave), adding("wave", "i2", wave), fault},
                           world.recording.cell, world.base, 1, {});
  CHECK(screen.candidates().size() == 1);
  CHECK(std::ranges::count(screen.unseen(), gap::EffectName{"wave", "i2"}) == 1);
  CHECK(std::ranges::count(screen.unseen(), gap::EffectName{"wave", "i1"}) == 0);
  CHECK(std::ranges::count(screen.unseen(), gap::EffectName{"clock", "i3"}) == 0);
}

TEST_CASE("a copy of a screen shares its candidates, and outlives it") {
  const World world(recorded(6.0, 0.0, 16));
  const gap::NuisanceModel none;
  const gap::FitProblem problem{world.data, none, {}, 0.0};
  std::optional<gap::Screen> first = screen_of(world);
  gap::Screen second = *first;
  REQUIRE(second.candidates()[0].get() == first->candidates()[0].get());
  first.reset();
  CHECK(second.rank(problem, gap::empty_model(problem, world.base)).front().part.candidate->hypothesis.effect ==
        "wave");
}

TEST_CASE("a hundredth of a usual size is nearly off, whatever the shape") {
  gap::OwnEffect own{{"e", "i1"}, {{"size", "A", 2.0, -9, 9, {}}, {"time", "s", 1.0, 0.1, 9, {0.5, 2.0}}}, {}, {}};
  own.apply = [](cell::Cell&, const Eigen::VectorXd&) {};
  const Eigen::VectorXd x = gap::nearly_off(gap::own_hypothesis(own));
  CHECK(x(0) == Approx(0.01));
  CHECK(x(1) == Approx(0.5));
}

}  // namespace screen_test
