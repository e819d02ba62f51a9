#include "gap/fitting/search.hpp"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Sets of effects that explain a recording, where it is known which they are.

namespace search_test {

using namespace kr5;
using namespace linear_world;

namespace {

const std::vector<std::pair<std::string, Shape>> shapes = {{"slow", [](double t) { return 0.1 * std::sin(2.0 * t); }},
                                                           {"fast", [](double t) { return 0.1 * std::sin(7.0 * t); }},
                                                           {"ramp", [](double t) { return 0.05 * t; }},
                                                           {"dip", [](double t) { return 0.2 * std::exp(-t); }}};

std::vector<cell::Experiment> recorded(const std::vector<double>& sizes, std::uint64_t seed) {
  Random random(seed);
  std::vector<cell::Experiment> out = {motion("motion-1", cell::Split::Fit, 500),
                                       motion("motion-2", cell::Split::Check, 400)};
  for (cell::Experiment& e : out) {
    Eigen::VectorXd i1 = random.normal_vector(e.data.values.rows());
    for (std::size_t k = 0; k < sizes.size(); ++k) i1 += sizes[k] * at_times(e, shapes[k].second);
    add_column(e, "i1", i1);
  }
  return out;
}

std::vector<std::string> names(const std::vector<gap::Part>& parts) {
  std::vector<std::string> out;
  for (const gap::Part& p : parts) out.push_back(p.candidate->hypothesis.effect);
  std::ranges::sort(out);
  return out;
}

struct Searched {
  explicit Searched(const std::vector<double>& sizes, gap::SearchOptions options = {4, 8, 3, 1},
                    const std::string& fault = "")
      : world(recorded(sizes, 21)), screen(world.data, hypotheses(fault), world.recording.cell, world.base, 1, {}) {
    found = gap::search(problem, screen, world.base, options, [&](double part) { told.push_back(part); });
  }
  static std::vector<gap::Hypothesis> hypotheses(const std::string& fault) {
    std::vector<gap::Hypothesis> out;
    for (const auto& [name, shape] : shapes) {
      out.push_back(adding(name, "i1", shape));
      out.back().of_recording = name == fault;
    }
    return out;
  }
  World world;
  gap::Screen screen;
  gap::NuisanceModel none;
  gap::FitProblem problem{world.data, none, {}, -std::log(4.0)};
  std::vector<gap::Model> found;
  std::vector<double> told;
};

}  // namespace

TEST_CASE("the search finds the set of effects that is there, and keeps the nominal cell beside it") {
  using Names = std::vector<std::string>;
  const std::vector<std::pair<std::vector<double>, Names>> truths = {{{0, 0, 0, 0}, {}},
                                                                     {{0, 6, 0, 0}, {"fast"}},
                                                                     {{6, 0, -5, 0}, {"ramp", "slow"}},
                                                                     {{5, -6, 5, 0}, {"fast", "ramp", "slow"}}};
  for (const auto& [sizes, expected] : truths) {
    const Searched s(sizes);
    CHECK(names(s.found.front().parts) == expected);
    CHECK(std::ranges::is_sorted(s.found, std::greater<>(), &gap::Model::log_evidence));
    CHECK(std::ranges::count_if(s.found, [](const gap::Model& m) { return m.parts.empty(); }) == 1);
    CHECK(s.told.size() + 1 == s.found.size());  // of every set that is fitted
    CHECK(std::ranges::all_of(s.told, [](double part) { return part > 0.0 && part <= 1.0; }));
    for (const gap::Part& p : s.found.front().parts) {
      const auto k = static_cast<std::size_t>(
          std::ranges::find(shapes, p.candidate->hypothesis.effect, [](const auto& s) { return s.first; }) -
          shapes.begin());
      CHECK(p.x(0) == Approx(sizes[k]).margin(2.5));
    }
  }
}

TEST_CASE("no set has more effects than are asked for; one fault of the recording may stand beside them") {
  const Searched two({5, -6, 5, 0}, {2, 8, 3, 1});
  for (const gap::Model& m : two.found) CHECK(m.parts.size() <= 2);
  CHECK(two.found.front().parts.size() == 2);
  const Searched beside({5, -6, 0, 0}, {1, 8, 3, 1}, "fast");
  CHECK(names(beside.found.front().parts) == std::vector<std::string>{"fast", "slow"});
}

TEST_CASE("extensions are the effects that could explain what a model leaves") {
  Searched s({6, 0, -5, 0});
  const gap::Model empty = gap::empty_model(s.problem, s.world.base);
  const gap::Candidate *slow = s.screen.candidates()[0].get(), *dip = s.screen.candidates()[3].get();
  const gap::Model half = gap::fit(s.problem, empty, {part(*slow, 1.0)});
  const auto sets = gap::extensions(s.problem, s.screen, half, {4, 8, 3, 1});
  CHECK(std::ranges::any_of(sets, [](const auto& set) {
    return names(set) == std::vector<std::string>{"ramp", "slow"};
  }));
  for (const auto& set : sets) {
    CHECK(set.size() == 2);
    CHECK(set.front().candidate == slow);
  }
  // Nothing is left to explain beside the true set, and no place for more than are asked for.
  const gap::Model whole = gap::fit(s.problem, half, {half.parts[0], part(*s.screen.candidates()[2], -1.0)});
  CHECK(gap::extensions(s.problem, s.screen, whole, {4, 8, 3, 1}).empty());
  CHECK(gap::extensions(s.problem, s.screen, half, {1, 8, 3, 1}).empty());
  // In the place of an effect only one that explains about as much.
  const gap::Part removed = part(*slow, 6.0);
  for (const auto& set : gap::extensions(s.problem, s.screen, empty, {4, 8, 3, 1}, &removed))
    CHECK(set.front().candidate != dip);
}

}  // namespace search_test
