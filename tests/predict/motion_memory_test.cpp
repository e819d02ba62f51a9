#include <kr5/predict/fast_simulator.hpp>

#include <thread>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/core/random.hpp>

#include "gap/protocol.hpp"

using namespace kr5;

TEST_CASE("what a simulator remembers is what it would compute, for any order of cells and from many threads") {
  Random random(31);
  const cell::Recording r = protocol::record(protocol::nominal(), random);
  std::vector<cell::Cell> cells = {protocol::nominal()};
  for (const cell::Effect& effect : cell::effect_catalogue())
    for (const std::string& target : cell::effect_targets(effect, cells.front())) {
      const auto& first = effect.parameters.front();
      if (first.kind != cell::EffectValueKind::Number) continue;
      cell::Cell worn = protocol::nominal();
      const double size = first.unit == "N m/rad" ? 1e5 : 0.01;
      try {
        cell::set_effect(worn, effect.id, target, first.name, cell::EffectValue(size));
      } catch (const std::exception&) {
        continue;  // out of its bounds: not what is asked here
      }
      cells.push_back(worn);
    }
  REQUIRE(cells.size() > 40);
  const predict::FastSimulator shared;
  std::vector<int> wrong(2, 0);
  std::vector<std::thread> threads;
  for (int k = 0; k < 2; ++k)
    threads.emplace_back([&, k] {
      Random own(static_cast<std::uint64_t>(k) + 1);
      for (int i = 0; i < 120; ++i) {
        const cell::Cell& at = cells[static_cast<std::size_t>(own.integer(static_cast<int>(cells.size())))];
        const cell::Experiment& e = r.experiments[static_cast<std::size_t>(own.integer(3))];  // the motions
        const Eigen::MatrixXd told = shared.predict(at, e).values,
                              anew = predict::FastSimulator().predict(at, e).values;
        if (!((told.array() == anew.array()) || (told.array().isNaN() && anew.array().isNaN())).all())
          ++wrong[static_cast<std::size_t>(k)];
      }
    });
  for (std::thread& thread : threads) thread.join();
  CHECK(wrong == std::vector<int>{0, 0});
}
