#include "gap/planning/next_experiment.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// The experiment that would tell tied effects apart.

namespace next_experiment_test {

using namespace kr5;
using namespace linear_world;

namespace {

double wave(double t) { return std::sin(3 * t); }
double late_wave(double t) { return std::cos(3 * t); }

gap::Model with(const gap::Candidate& candidate, double x) {
  gap::Model out;
  out.parts = {part(candidate, x)};
  out.information = Eigen::MatrixXd::Constant(1, 1, 100.0);
  return out;
}

gap::Cause cause(const std::string& effect, const std::vector<gap::EffectName>& tied) {
  gap::Cause out;
  out.effect = effect;
  out.target = "i1";
  out.tied_with = tied;
  return out;
}

}  // namespace

TEST_CASE("nothing is proposed where nothing is tied; ties are told apart by what they differ in") {
  cell::Experiment e = motion("motion-1", cell::Split::Fit, 300);
  const double middle[] = {0.02, -2.75, 0.0, -0.3, 1.571};  // a posture that the arm can take
  for (int j = 2; j <= 6; ++j) e.data.values.col(e.data.find("qc" + std::to_string(j))).setConstant(middle[j - 2]);
  add_column(e, "i1", 3.0 * at_times(e, wave));
  for (int j = 2; j <= 6; ++j) add_column(e, "i" + std::to_string(j), Eigen::VectorXd::Zero(300));
  const World world({e});
  const gap::Candidate a = acting_in(adding("a", "i1", wave), {0}), b = acting_in(adding("b", "i1", late_wave), {0}),
                       twin = acting_in(adding("twin", "i1", wave), {0});
  const gap::Model best = with(a, 3.0);
  const std::vector<gap::Model> models = {best, with(b, 3.0), with(twin, 3.0)};
  const gap::NextExperiment none = gap::next_experiment(world.data, best, models, {cause("a", {})}, 1);
  CHECK(none.separates.empty());
  CHECK(none.what.empty());
  const gap::NextExperiment found = gap::next_experiment(world.data, best, models, {cause("a", {{"b", "i1"}})}, 1);
  CHECK(found.separates == std::vector<gap::EffectName>{{"a", "i1"}, {"b", "i1"}});
  CHECK(found.kind == cell::Kind::Motion);
  CHECK(found.separation > 5.0);
  CHECK_FALSE(found.repeat);
  CHECK(found.seconds > 30.0);
  CHECK(found.what.starts_with("move all joints at once"));
  // What is small against the noise needs more than one of them.
  const std::vector<gap::Model> small = {with(a, 0.05), with(b, 0.05)};
  const gap::NextExperiment again = gap::next_experiment(world.data, small[0], small, {cause("a", {{"b", "i1"}})}, 1);
  CHECK(again.separation > 0.0);
  CHECK(again.separation < 5.0);
  CHECK(again.repeat);
  // What no experiment tells apart is left to the plan, as is a rival without a model.
  for (const char* rival : {"twin", "other"}) {
    const gap::NextExperiment unknown =
        gap::next_experiment(world.data, best, models, {cause("a", {{rival, "i1"}})}, 1);
    CHECK(unknown.separates.size() == 2);
    CHECK(unknown.what.empty());
    CHECK_FALSE(unknown.kind);
  }
}

}  // namespace next_experiment_test
