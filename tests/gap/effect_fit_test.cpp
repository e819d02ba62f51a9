#include <kr5/gap/effect_fit.hpp>

#include <cmath>
#include <map>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/gap/diagnose.hpp>
#include <kr5/gap/measure.hpp>
#include <kr5/predict/fast_simulator.hpp>

#include "gap/protocol.hpp"

namespace effect_fit_test {

using namespace kr5;

namespace {

const predict::FastSimulator simulator;

void offset_tool(cell::Cell& cell) {
  cell::set_effect(cell, "tool_offset", "tool", "offset",
                   cell::EffectValue(Eigen::VectorXd(Eigen::Vector3d(1e-3, 0, 2e-3))));
}

cell::Recording worn(Random& random) {
  cell::Cell real = protocol::carrying("coulomb_friction", "joint2", "coulomb",
                                       1.4 * protocol::nominal().drives->friction.coulomb(1));
  offset_tool(real);
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
  offset_tool(half);
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

TEST_CASE("single wild samples are no residuals, steps are, and noise is what was seen") {
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

TEST_CASE("a wild pose and poses that show no noise spoil nothing") {
  Random random(8);
  cell::Recording r = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Poses);
  r.experiments[0].data.values(7, r.experiments[0].data.find("y")) += 60 * r.cell.noise.pose_position;
  for (const gap::ResidualColumn& c : gap::residual_columns(r, simulator)) {
    if (c.experiment != r.experiments[0].name || c.column != "y") continue;
    CHECK(std::isnan(c.residuals(7, 0)));
    CHECK(c.residuals.col(0).array().isNaN().count() == 1);
  }
  for (cell::Experiment& e : r.experiments) e.data = protocol::computed(r.cell, e);
  CHECK(gap::diagnose(r, simulator).verdict == gap::Verdict::NoGap);
}

TEST_CASE("an effect that is on the cell closes what it makes, another does not, and its size is found") {
  Random random(5);
  const cell::Recording r = worn(random);
  const std::vector<gap::EffectName> names = {{"tool_offset", "tool"},
                                              {"coulomb_friction", "joint2"},
                                              {"stribeck_friction", "joint2"},
                                              {"contact_stiffness", "contact"}};
  const auto trials = gap::fit_effects(r, r.cell, simulator, names);
  std::map<std::string, gap::EffectFit> of;
  for (const gap::EffectFit& t : trials) of[t.effect] = t;
  REQUIRE(of.contains("coulomb_friction"));
  REQUIRE(of.contains("tool_offset"));
  REQUIRE(of.contains("stribeck_friction"));
  REQUIRE(of.contains("contact_stiffness"));
  // Of all the excess the tool makes nearly everything; the friction is judged beside it in the rest.
  CHECK(of["tool_offset"].explained_fraction > 0.95);
  CHECK(of["coulomb_friction"].explained_fraction < 1 - of["tool_offset"].explained_fraction + 0.01);
  CHECK(of["coulomb_friction"].explained_fraction > of["stribeck_friction"].explained_fraction);
  CHECK(of["contact_stiffness"].explained_fraction < 1e-4);
  cell::Cell with_tool = r.cell;
  offset_tool(with_tool);
  const auto rest = gap::fit_effects(
      r, with_tool, simulator,
      {{"coulomb_friction", "joint2"}, {"stribeck_friction", "joint2"}, {"coulomb_friction", "joint3"}});
  REQUIRE(rest.size() == 3);
  std::map<std::string, double> closed;
  for (const gap::EffectFit& t : rest) closed[t.effect + "." + t.target] = t.explained_fraction;
  CAPTURE(closed["coulomb_friction.joint2"], closed["stribeck_friction.joint2"], closed["coulomb_friction.joint3"]);
  CHECK(closed["coulomb_friction.joint2"] > 0.95);
  CHECK(closed["stribeck_friction.joint2"] < closed["coulomb_friction.joint2"] - 0.02);
  CHECK(closed["coulomb_friction.joint3"] < 0.1);
  const gap::ParameterEstimate& size = of["coulomb_friction"].parameters.at(0);
  const double true_size = 1.4 * r.cell.drives->friction.coulomb(1);
  CHECK(std::abs(size.value[0] - true_size) < 4 * size.std[0]);
  CHECK(size.std[0] < 0.02 * true_size);  // a size that is not known is not found
  CHECK(of["coulomb_friction"].columns.at(0).column == "motion.i2");
  for (int axis = 0; axis < 3; ++axis)
    CHECK(std::abs(of["tool_offset"].parameters.at(0).value[axis] - (axis == 0   ? 1e-3
                                                                     : axis == 2 ? 2e-3
                                                                                 : 0.0)) <
          4 * of["tool_offset"].parameters.at(0).std[axis]);
  for (const double std : of["tool_offset"].parameters.at(0).std) CHECK(std < 1e-4);
}

TEST_CASE("with one of two causes in the cell, the other closes the rest, and no rival does as well",
          "[not_sanitized]") {
  Random random(5);
  const cell::Recording r = worn(random);
  cell::Cell base = r.cell;
  offset_tool(base);
  const auto best = gap::fit_best_effects(r, base, simulator, {}, 1);
  REQUIRE(best.size() == 1);
  CHECK(best[0].effect == "coulomb_friction");
  CHECK(best[0].explained_fraction > 0.95);
  const auto rivals = gap::fit_best_effects(r, base, simulator, {{"coulomb_friction", "joint2"}}, 2);
  REQUIRE(rivals.size() == 2);
  CHECK(rivals[0].explained_fraction >= rivals[1].explained_fraction);
  CHECK(rivals[0].explained_fraction < best[0].explained_fraction);
  CHECK(rms(gap::residual_columns(r, simulator, {base}), "x", 1) == Approx(1).margin(0.15));
}

TEST_CASE("every effect can be tried on an arm with a slide, and its own is the best") {
  Random random(6);
  cell::Cell real = cell::load_cell(KR5_SHARE_DIR "/cells/gantry_rrp.yaml");
  real.effects = {};
  cell::Recording r;
  r.cell = real;
  cell::set_effect(real, "viscous_friction", "joint4", "viscous", cell::EffectValue(90.0));  // believed: 40
  for (const cell::Split split : {cell::Split::Fit, cell::Split::Check}) {
    constexpr int rows = 900;
    cell::Experiment e;
    e.name = split == cell::Split::Fit ? "motion-1" : "motion-2";
    e.kind = cell::Kind::Motion;
    e.split = split;
    e.data = {{"t", "qc1", "qc2", "qc3", "qc4"}, Eigen::MatrixXd(rows, 5)};
    for (int i = 0; i < rows; ++i) {
      const double t = 0.004 * i, w = split == cell::Split::Fit ? 3.0 : 4.1;
      e.data.values.row(i) << t, 0.8 * std::sin(w * t), 0.6 * std::sin(1.3 * w * t), std::sin(0.7 * w * t),
          0.12 + 0.1 * std::sin(1.1 * w * t);
    }
    protocol::show(e, real, random);
    r.experiments.push_back(e);
  }
  std::vector<gap::EffectName> all;
  for (const cell::Effect& effect : cell::effect_catalogue())
    for (const std::string& target : cell::effect_targets(effect, r.cell)) all.push_back({effect.id, target});
  const auto trials = gap::fit_effects(r, r.cell, simulator, all);
  REQUIRE(!trials.empty());
  CHECK(trials.front().effect == "viscous_friction");
  CHECK(trials.front().target == "joint4");
  CHECK(trials.front().explained_fraction > 0.98);
  CHECK(std::abs(trials.front().parameters.at(0).value.at(0) - 90) < 5 * trials.front().parameters.at(0).std.at(0));
  std::map<std::string, int> tried;
  for (const gap::EffectFit& t : trials) ++tried[t.effect];
  CHECK(tried["coulomb_friction"] == 4);
  CHECK(tried["rotor_inertia"] == 4);
  CHECK(tried["ft_bias"] == 6);
  CHECK_FALSE(tried.contains("camera_focal"));  // no view was recorded
  bool slide = false;
  for (const gap::GapPart& part : gap::measure(r, simulator).parts)
    slide = slide || part.name.find("rad/s or m/s") != std::string::npos;
  CHECK(slide);

  cell::Cell bare = r.cell;  // shows no currents: nothing can be said of them
  bare.drives.reset();
  for (const gap::ResidualColumn& c : gap::residual_columns(r, simulator, {bare})) {
    INFO(c.column);
    CHECK(c.residuals.col(1).array().isNaN().all() == (c.column[0] == 'i'));
    CHECK_FALSE(c.residuals.col(0).array().isNaN().all());
  }
}

TEST_CASE("bad input of trials is refused") {
  Random random(7);
  const cell::Recording r = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Poses);
  CHECK_THROWS_WITH(gap::residual_columns(r, simulator, {}, {{"current", {}, 0.0}}), Catch::Contains("current"));
  gap::EffectFitOptions options;
  options.threads = -1;
  CHECK_THROWS_WITH(gap::fit_effects(r, r.cell, simulator, {}, options), Catch::Contains("threads"));
  CHECK_THROWS_WITH(gap::fit_best_effects(r, r.cell, simulator, {}, 0), Catch::Contains("most"));
  CHECK(gap::fit_effects(r, r.cell, simulator, {}).empty());
  CHECK_THROWS_WITH(gap::fit_effects(r, r.cell, simulator, {{"coulomb_fricton", "joint2"}}),
                    Catch::Contains("coulomb_friction"));
  CHECK_THROWS_WITH(gap::residual_columns(r, simulator, {}, {{"curent", {}, 2.0}}), Catch::Contains("curent"));
  const cell::Cell other = cell::load_cell(KR5_SHARE_DIR "/cells/gantry_rrp.yaml");
  CHECK_THROWS_WITH(gap::fit_effects(r, other, simulator, {{"tool_offset", "tool"}}), Catch::Contains("joints"));
}

}  // namespace effect_fit_test
