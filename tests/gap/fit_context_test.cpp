#include "gap/planning/fit_context.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "gap/two_shapes.hpp"

/// @file
/// Alternatives fitted to a recording, of which every answer is known.

namespace fit_context_test {

using namespace kr5;
using namespace two_shapes;

namespace {

cell::Recording recording(double of_wave, double of_ramp) {
  cell::Recording r;
  r.cell = unit_noise();
  r.experiments = recorded(of_wave, of_ramp, 131, 300, 300);
  return r;
}

gap::PlanOptions options() {
  gap::PlanOptions out;
  out.own_hypotheses = {adding("wave", "i1", wave), adding("ramp", "i1", ramp)};
  out.threads = 1;
  return out;
}

/// Shows the mass of the tool in i1.
class MassShown : public Zeros {
 public:
  io::Table simulate(const cell::Cell& cell, const cell::Experiment& e) const override {
    io::Table out = Zeros::simulate(cell, e);
    out.values.col(out.find("i1")).setConstant(cell.tool->mass);
    return out;
  }
};

}  // namespace

TEST_CASE("every experiment of a context may be fitted") {
  const Zeros simulator;
  const cell::Recording r = recording(2.0, 0.0);
  const gap::FitContext context(r, simulator);
  for (const gap::Block& block : context.data.blocks) CHECK(block.split == cell::Split::Fit);
  CHECK(context.chi2() ==
        Approx(r.experiments[0].data.column("i1").squaredNorm() + r.experiments[1].data.column("i1").squaredNorm()));
}

TEST_CASE("alternatives are fitted to the whole recording, an effect after the other") {
  const Zeros simulator;
  const gap::FitContext context(recording(8.0, -6.0), simulator);
  const gap::EffectName a{"wave", "i1"}, b{"ramp", "i1"};
  const std::vector<gap::Fitted> found = gap::fit_alternatives(context, {{a}, {b, a}}, options());
  REQUIRE(found.size() == 2);
  REQUIRE(found[1].x.size() == 2);
  Eigen::MatrixXd J(600, 2);
  for (int e = 0; e < 2; ++e) {
    J.block(300 * e, 0, 300, 1) = at_times(context.recording.experiments[static_cast<std::size_t>(e)], wave);
    J.block(300 * e, 1, 300, 1) = at_times(context.recording.experiments[static_cast<std::size_t>(e)], ramp);
  }
  const Eigen::VectorXd expected = (J.transpose() * J).ldlt().solve(J.transpose() * context.base);
  for (std::size_t k = 0; k < 2; ++k) {
    const bool is_wave = found[1].candidates[k].hypothesis.effect == "wave";
    CHECK(found[1].x[k](0) == Approx(expected(is_wave ? 0 : 1)).margin(0.2));
  }
  CHECK(found[1].chi2 == Approx((context.base - J * expected).squaredNorm()).margin(0.03));
  CHECK(found[0].chi2 > found[1].chi2 + 10.0);
  CHECK(found[0].information.rows() == 1);
}

TEST_CASE("effects that the cell cannot have, or that show nowhere, are refused with their name") {
  const Zeros simulator;
  const gap::FitContext context(recording(1.0, 0.0), simulator);
  CHECK_THROWS_WITH(gap::fit_alternatives(context, {{{"coulomb_friction", "joint9"}}}, options()),
                    Catch::Contains("no target 'joint9'") && Catch::Contains("joint6"));
  CHECK_THROWS_WITH(gap::fit_alternatives(context, {{{"coulomb_friction", "joint1"}}}, options()),
                    Catch::Contains("does not show"));
  CHECK_THROWS_AS(gap::fit_alternatives(context, {{}}, options()), InvalidArgument);
}

TEST_CASE("what a fitted cell would record is fitted again without a gap, from anywhere") {
  const Zeros simulator;
  const gap::FitContext context(recording(8.0, 0.0), simulator);
  gap::Fitted fitted = gap::fit_alternatives(context, {{{"wave", "i1"}}}, options()).front();
  const gap::FitContext synthetic(gap::synthesize_recording(context, fitted), simulator);
  CHECK((synthetic.recording.experiments[0].data.column("i1") -
         fitted.x[0](0) * at_times(context.recording.experiments[0], wave))
            .norm() < 1e-9);
  gap::Fitted usual = fitted;
  gap::assume_usual_size(usual);
  CHECK(usual.x[0](0) == 1.0);
  const gap::Fitted again = gap::refit(synthetic, usual, 10);
  CHECK(again.x[0](0) == Approx(fitted.x[0](0)).margin(0.05));
  CHECK(again.chi2 < 0.02);
}

TEST_CASE("predictions go into columns that are there or asked for, and what is not seen stays") {
  cell::Experiment e = experiment("motion-1", cell::Kind::Motion, cell::Split::Fit);
  add_column(e, "t", Eigen::Vector2d(0, 1));
  add_column(e, "i1", Eigen::Vector2d(5, 6));
  io::Table predicted{{"i1", "i2", "i3"}, Eigen::MatrixXd(2, 3)};
  predicted.values << 1, 2, 3, std::nan(""), 4, 5;
  gap::show(e, predicted, {"i2"});
  CHECK(e.data.column("i1") == Eigen::Vector2d(1, 6));
  CHECK(e.data.column("i2") == Eigen::Vector2d(2, 4));
  CHECK(e.data.find("i3") < 0);
}

TEST_CASE("a simulator carries another tool where it is told to") {
  const MassShown inner;
  const cell::Cell cell = unit_noise();
  cell::Tool heavy = *cell.tool;
  heavy.mass += 5.0;
  const gap::ToolSimulator simulator(inner, {{"motion-2", heavy}});
  const auto mass = [&](const std::string& name) {
    return simulator.predict(cell, motion(name, cell::Split::Fit, 2)).column("i1")(0);
  };
  CHECK(mass("motion-1") == cell.tool->mass);
  CHECK(mass("motion-2") == heavy.mass);
}

}  // namespace fit_context_test
