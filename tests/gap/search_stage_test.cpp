#include "gap/stages/search_stage.hpp"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include "gap/staged.hpp"
#include "gap/stages/needed_effects.hpp"

/// @file
/// Sets of effects that are fitted and looked at, as a function of what was screened.

namespace search_stage_test {

using namespace kr5;
using namespace staged;

TEST_CASE("the best set is the true one, and the same input gives the same output") {
  const Stages s(Recorded{.of_wave = 5.0, .of_ramp = 4.0}.recording());
  const gap::SearchOutput first = s.searched(), second = s.searched();
  std::vector<std::string> best = names(first.models.kept.front().parts);
  std::ranges::sort(best);
  CHECK(best == std::vector<std::string>{"ramp", "wave"});
  CHECK(first.log_prior_effect == Approx(-std::log(2.0)));
  CHECK(first.prior.size() == 0.0);
  CHECK_FALSE(first.cut_short);
  REQUIRE(first.models.kept.size() == second.models.kept.size());
  for (std::size_t k = 0; k < first.models.kept.size(); ++k)
    CHECK(first.models.kept[k].log_evidence == second.models.kept[k].log_evidence);
  // The output owns what its models are made of.
  for (const gap::Model& m : first.models.kept)
    for (const gap::Part& p : m.parts)
      CHECK(std::ranges::any_of(first.candidates, [&](const auto& c) { return c.get() == p.candidate; }));
}

TEST_CASE("the best set has needed effects only; what could be in the place of one is fitted") {
  gap::DiagnoseOptions with = options();
  with.own_hypotheses.push_back(adding("near_wave", "i1", near_wave));
  const Stages s(Recorded{.of_wave = 5.0}.recording(), with);
  const gap::SearchOutput out = s.searched();
  const gap::Model& best = out.models.kept.front();
  REQUIRE(best.parts.size() == 1);
  const std::string name = names(best.parts).front();
  CHECK((name == "wave" || name == "near_wave"));
  const gap::FitProblem problem = out.problem(s.screened.data, s.screened.nuisance);
  gap::ModelPool pool(problem, s.screened.base, out.models);
  CHECK_FALSE(gap::is_needless(pool, s.screened.groups, best, 0, s.options));
  for (const char* alone : {"wave", "near_wave"})
    CHECK(std::ranges::any_of(out.models.kept,
                              [&](const gap::Model& m) { return names(m.parts) == std::vector<std::string>{alone}; }));
}

TEST_CASE("noise is explained by no effect") {
  const Stages s(Recorded{}.recording());
  const gap::SearchOutput out = s.searched();
  CHECK(out.models.kept.front().parts.empty());
  CHECK(std::ranges::is_sorted(out.models.kept, std::greater<>(), &gap::Model::log_evidence));
}

TEST_CASE("small errors of the cell stand beside effects where the data ask for them") {
  // Nuisance parameters with strong signatures: sines of their own rates. Errors are a few thousandths in size.
  const auto signature = [](int k, const std::string& column) {
    return [k, phase = column == "i1" ? 0.0 : 1.3 * k](double t) {
      return 300.0 * std::sin((0.7 + 0.45 * k) * t + phase);
    };
  };
  constexpr int count = 12;
  Random random(171);
  cell::Recording r = Recorded{}.recording();
  for (int k = 0; k < count; ++k) {
    const double error = random.normal(0.004);
    for (cell::Experiment& e : r.experiments)
      for (const std::string column : {"i1", "i2"})
        e.data.values.col(e.data.find(column)) += error * at_times(e, signature(k, column));
  }
  Stages s(std::move(r));
  gap::NuisanceModel& nuisance = s.screened.nuisance;
  std::vector<gap::Signature> fit;
  for (int k = 0; k < count; ++k) {
    gap::Signature one;
    int number = 0;
    for (const gap::Block& block : s.screened.data.blocks) {
      const cell::Experiment& e = s.screened.data.recording->experiments[block.experiment];
      one.parts.emplace_back(number++, (at_times(e, signature(k, block.column)) / block.sigma).cast<float>());
    }
    nuisance.signatures.push_back(one);
    std::erase_if(one.parts, [&](const auto& p) { return s.screened.data.blocks[p.first].split != cell::Split::Fit; });
    fit.push_back(one);
  }
  nuisance.gram = gap::gram(fit, fit);
  const gap::SearchOutput out = s.searched();
  CHECK(out.prior.size() >= 0.002);
  CHECK(out.prior.size() <= 0.008);
  CHECK(out.models.kept.front().parts.empty());
}

}  // namespace search_stage_test
