#include "gap/stages/stage_progress.hpp"

#include <algorithm>
#include <thread>
#include <utility>
#include <vector>

#include <catch2/catch.hpp>

namespace stage_progress_test {

using namespace kr5;

TEST_CASE("a step tells its part of the whole, to whoever listens") {
  gap::DiagnoseOptions options;
  gap::tell(options, gap::screening_step, 0.5);  // to nobody
  std::vector<std::pair<std::string, double>> told;
  options.progress = [&](const std::string& stage, double done) { told.emplace_back(stage, done); };
  gap::tell(options, {"half", 0.2, 0.6}, 0.5);
  REQUIRE(told.size() == 1);
  CHECK(told[0].first == "half");
  CHECK(told[0].second == Approx(0.4));
}

TEST_CASE("steps follow each other from 0 to 1") {
  double end = 0.0;
  for (const gap::Step& step : {gap::simulating_step, gap::screening_step, gap::refitting_step, gap::nuisance_step,
                                gap::checking_step, gap::judging_step}) {
    CHECK(step.from == end);
    CHECK(step.to > step.from);
    end = step.to;
  }
  CHECK(end == 1.0);
}

TEST_CASE("what is told never falls, and comes from one thread at a time") {
  CHECK_FALSE(gap::never_falling({}));
  std::vector<double> told;
  const auto listener = gap::never_falling([&](const std::string&, double done) { told.push_back(done); });
  listener("", 0.5);
  listener("", 0.2);
  listener("", 0.7);
  CHECK(told == std::vector<double>{0.5, 0.5, 0.7});
  told.clear();
  constexpr int calls = 2000;
  std::vector<std::thread> threads;
  for (int k = 0; k < 4; ++k)
    threads.emplace_back([&listener, k] {
      for (int i = 0; i < calls; ++i) listener("", 0.7 + 1e-5 * (4.0 * i + k));
    });
  for (std::thread& t : threads) t.join();
  CHECK(told.size() == 4 * calls);  // none lost where two push at once
  CHECK(std::is_sorted(told.begin(), told.end()));
}

}  // namespace stage_progress_test
