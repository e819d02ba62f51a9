#include <kr5/gap/trial.hpp>

#include <cmath>
#include <map>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/gap/measure.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/protocol.hpp"

using namespace kr5;

namespace {

const predict::FastSimulator simulator;

cell::Recording worn(Random& random) {
  cell::Cell real = protocol::carrying("coulomb_friction", "joint2", "coulomb",
                                       1.4 * protocol::nominal().drives->friction.coulomb(1));
  cell::set_effect(real, "tool_offset", "tool", "offset",
                   cell::EffectValue(Eigen::VectorXd(Eigen::Vector3d(1e-3, 0, 2e-3))));
  cell::Recording out = protocol::record(real, random);
  out.cell = protocol::nominal();
  return out;
}

/// Gap of a column over all experiments that have it.
double rms(const std::vector<gap::ResidualColumn>& columns, const std::string& name, int cell) {
  double sum = 0.0;
  int rows = 0;
  for (const gap::ResidualColumn& c : columns)
    if (c.column == name)
      for (const double r : c.residuals.col(cell))
        if (!std::isnan(r)) sum += r * r, ++rows;
  return rows > 0 ? std::sqrt(sum / rows) : 0.0;
}

}  // namespace

TEST_CASE("residuals are those that measure counts, at every cell") {
  Random random(3);
  const cell::Recording r = worn(random);
  const auto columns = gap::residual_columns(r, simulator, {protocol::nominal()});
  const gap::Measure m = gap::measure(r, simulator);
  REQUIRE(columns.size() == m.columns.size());
  for (std::size_t k = 0; k < columns.size(); ++k) {
    INFO(columns[k].experiment << "." << columns[k].column);
    CHECK(columns[k].experiment == m.columns[k].experiment);
    CHECK(columns[k].noise == m.columns[k].noise);
    const Eigen::ArrayXd own = columns[k].residuals.col(0), same = columns[k].residuals.col(1);
    CHECK(((own == same) || (own.isNaN() && same.isNaN())).all());
    CHECK(std::sqrt(own.isNaN().select(0.0, own.square()).sum() / m.columns[k].rows) == Approx(m.columns[k].gap));
  }
}

TEST_CASE("where residuals are is what measure tells, at any cell") {
  Random random(3);
  const cell::Recording r = worn(random);
  cell::Cell half = r.cell;
  cell::set_effect(half, "tool_offset", "tool", "offset",
                   cell::EffectValue(Eigen::VectorXd(Eigen::Vector3d(1e-3, 0, 2e-3))));
  const auto columns = gap::residual_columns(r, simulator, {half});
  for (const int which : {0, 1}) {
    const auto parts = gap::gap_parts(r, columns, which);
    const auto measured = gap::measure(r, which == 0 ? r.cell : half, simulator).parts;
    REQUIRE(parts.size() == measured.size());
    for (std::size_t k = 0; k < parts.size(); ++k) {
      INFO(parts[k].by << " " << parts[k].name);
      CHECK(parts[k].name == measured[k].name);
      CHECK(parts[k].gap == Approx(measured[k].gap));
      CHECK(parts[k].share == Approx(measured[k].share));
    }
  }
  CHECK_THROWS_WITH(gap::gap_parts(r, columns, 2), Catch::Contains("cell 2"));
  CHECK_THROWS_WITH(gap::gap_parts(protocol::only(r, cell::Kind::Step), columns), Catch::Contains("motion-1"));
}

TEST_CASE("single wild samples are no residuals, and steps are; noise is what was seen") {
  Random random(4);
  cell::Recording r = protocol::record(protocol::nominal(), random);
  for (cell::Experiment& e : r.experiments) {
    if (e.kind != cell::Kind::Motion) continue;
    auto current = e.data.values.col(e.data.find("i2"));
    current(50) += 40 * r.cell.noise.current;
    current.tail(30).array() += 40 * r.cell.noise.current;
  }
  const auto plain = gap::residual_columns(r, simulator);
  const auto seen = gap::residual_columns(r, simulator, {}, {{"current", cell::Kind::Motion, 2.0}});
  for (std::size_t k = 0; k < plain.size(); ++k) {
    const bool current = plain[k].column[0] == 'i';
    CHECK(seen[k].noise == (current ? 2.0 : 1.0) * plain[k].noise);
    if (plain[k].column != "i2") continue;
    CHECK(std::isnan(plain[k].residuals(50, 0)));
    CHECK(plain[k].residuals.col(0).tail(30).minCoeff() > 30);
    CHECK(seen[k].residuals(10, 0) == Approx(plain[k].residuals(10, 0) / 2));
  }
}

TEST_CASE("an effect that is on the cell closes what it makes, another does not, and its size is found") {
  Random random(5);
  const cell::Recording r = worn(random);
  const std::vector<gap::EffectName> names = {{"tool_offset", "tool"},
                                              {"coulomb_friction", "joint2"},
                                              {"stribeck_friction", "joint2"},
                                              {"contact_stiffness", "contact"}};
  const auto trials = gap::try_effects(r, r.cell, simulator, names);
  std::map<std::string, gap::Trial> of;
  for (const gap::Trial& t : trials) of[t.effect] = t;
  REQUIRE(of.contains("coulomb_friction"));
  REQUIRE(of.contains("tool_offset"));
  const double wrong = of["stribeck_friction"].closed;
  CHECK(of["coulomb_friction"].closed > wrong);
  CHECK(of["contact_stiffness"].closed < 0.01);
  const gap::ParameterEstimate& size = of["coulomb_friction"].parameters.at(0);
  CHECK(std::abs(size.value[0] - 1.4 * r.cell.drives->friction.coulomb(1)) < 5 * size.std[0]);
  CHECK(of["coulomb_friction"].columns.at(0).column == "motion.i2");
  for (int axis = 0; axis < 3; ++axis)
    CHECK(std::abs(of["tool_offset"].parameters.at(0).value[axis] - (axis == 0   ? 1e-3
                                                                     : axis == 2 ? 2e-3
                                                                                 : 0.0)) <
          5 * of["tool_offset"].parameters.at(0).std[axis]);
}

TEST_CASE("with one of two causes in the cell, the other closes the rest, and no rival does as well") {
  Random random(5);
  const cell::Recording r = worn(random);
  cell::Cell base = r.cell;
  cell::set_effect(base, "tool_offset", "tool", "offset",
                   cell::EffectValue(Eigen::VectorXd(Eigen::Vector3d(1e-3, 0, 2e-3))));
  const auto best = gap::best_effects(r, base, simulator, {}, 1);
  REQUIRE(best.size() == 1);
  CHECK(best[0].effect == "coulomb_friction");
  CHECK(best[0].closed > 0.95);
  const auto rivals = gap::best_effects(r, base, simulator, {{"coulomb_friction", "joint2"}}, 2);
  REQUIRE(rivals.size() == 2);
  CHECK(rivals[0].closed >= rivals[1].closed);
  CHECK(rivals[0].closed < best[0].closed);
  CHECK(rms(gap::residual_columns(r, simulator, {base}), "x", 1) == Approx(1).margin(0.15));
}

TEST_CASE("every effect can be tried on every cell: what it lacks, or what changes nothing, is no error") {
  Random random(6);
  for (const char* file : {"kr5_arc", "gantry_rrp"}) {
    cell::Recording r = protocol::record(protocol::nominal(), random);
    cell::Cell cell = cell::load_cell(std::string(KR5_SHARE_DIR "/cells/") + file + ".yaml");
    if (cell.robot.joints() != r.cell.robot.joints()) {
      CHECK_THROWS_AS(gap::try_effects(r, cell, simulator, {}), InvalidArgument);
      continue;
    }
    cell.drives.reset();
    std::vector<gap::EffectName> all;
    for (const cell::Effect& effect : cell::effect_catalogue())
      for (const std::string& target : cell::effect_targets(effect, r.cell)) all.push_back({effect.id, target});
    for (const gap::Trial& t : gap::try_effects(protocol::only(r, cell::Kind::Poses), cell, simulator, all)) {
      CHECK(t.closed < 0.6);
      CHECK(t.effect != "coulomb_friction");
    }
  }
}

TEST_CASE("bad input of trials is refused") {
  Random random(7);
  const cell::Recording r = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Poses);
  CHECK_THROWS_WITH(gap::residual_columns(r, simulator, {}, {{"current", {}, 0.0}}), Catch::Contains("current"));
  gap::TrialOptions options;
  options.threads = -1;
  CHECK_THROWS_WITH(gap::try_effects(r, r.cell, simulator, {}, options), Catch::Contains("threads"));
  CHECK_THROWS_WITH(gap::best_effects(r, r.cell, simulator, {}, 0), Catch::Contains("most"));
  CHECK(gap::try_effects(r, r.cell, simulator, {}).empty());
}
