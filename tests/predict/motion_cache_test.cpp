#include <kr5/predict/fast_simulator.hpp>

#include <thread>
#include <vector>

#include <Eigen/Core>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/core/random.hpp>

#include "gap/protocol.hpp"
#include "predict/lru_cache.hpp"

namespace motion_cache_test {

using namespace kr5;

TEST_CASE("what a simulator has cached is what it would compute, for any order of cells and from many threads") {
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
        worn.validate();
      } catch (const std::exception&) {
        continue;  // out of its bounds: not what is asked here
      }
      cells.push_back(worn);
    }
  const auto changed = [&](auto&& change) {
    cells.push_back(protocol::nominal());
    change(cells.back());
  };
  changed([](cell::Cell& c) { c.robot.gravity.x() = 0.4; });
  changed([](cell::Cell& c) { c.robot.links[2].mass += 0.5; });
  changed([](cell::Cell& c) { c.robot.links[1].inertia[2] *= 1.1; });
  changed([](cell::Cell& c) { c.tool->com.x() += 0.01; });
  changed([](cell::Cell& c) { c.tool->T_flange_sensor.translation().z() += 0.02; });
  changed([](cell::Cell& c) { c.robot.dh[3].beta += 0.01; });
  changed([](cell::Cell& c) { c.robot.T_base_0 = from_xyzrpy(Vector6::Constant(0.05)); });
  changed([](cell::Cell& c) { c.servo->joint[0].damping_ratio *= 1.1; });
  REQUIRE(cells.size() > 40);
  const predict::FastSimulator shared;
  std::vector<int> wrong(2, 0);
  std::vector<std::thread> threads;
  for (int k = 0; k < 2; ++k)
    threads.emplace_back([&, k] {
      Random own(static_cast<std::uint64_t>(k) + 1);
      for (int i = 0; i < 300; ++i) {
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

TEST_CASE("a cache makes what it does not know, once, and forgets what was asked for longest ago") {
  int made = 0;
  predict::LruCache<Eigen::VectorXd> cache(25,
                                           [](const Eigen::VectorXd& v) { return static_cast<std::size_t>(v.size()); });
  const auto ask = [&](double number, Eigen::Index size = 7) {
    predict::CacheKey key;
    key.add(number).add(Eigen::Vector2d(number, -number));
    return *cache.find_or_make(std::move(key), [&] {
      ++made;
      return Eigen::VectorXd(Eigen::VectorXd::Constant(size, number));
    });
  };
  CHECK(ask(1.0)[0] == 1.0);
  CHECK(ask(1.0)[0] == 1.0);
  CHECK(made == 1);
  ask(2.0);  // 20 of 25 numbers
  ask(1.0);
  CHECK(made == 2);
  ask(3.0);  // no room for 2.0, which was asked for longest ago
  ask(1.0);
  CHECK(made == 3);
  ask(2.0);
  CHECK(made == 4);
  CHECK(ask(0.0).isZero());
  CHECK(ask(-0.0).isZero());
  CHECK(made == 6);  // to the bit
  ask(9.0, 40);
  ask(9.0, 40);
  CHECK(made == 8);  // too large to be kept
}

}  // namespace motion_cache_test
