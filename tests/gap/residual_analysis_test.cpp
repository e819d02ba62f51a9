#include "gap/reporting/residual_analysis.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// What a model leaves, and whether its effects may be trusted.

namespace residual_analysis_test {

using namespace kr5;
using namespace linear_world;

namespace {

double wave(double t) { return std::sin(5.0 * t); }
double ramp(double t) { return t - 3.0; }

/// i1 holds a wave, i2 something else; noise of 1 in both.
struct Fitted {
  Fitted(double of_wave, double of_ramp, double with_ramp_in_1 = 0.0, std::uint64_t seed = 111)
      : world(recorded(of_wave, of_ramp, with_ramp_in_1, seed)),
        candidate(acting_in(adding("wave", "i1", wave), {0, 1})) {
    empty = gap::empty_model(problem, world.base);
    model = gap::fit(problem, empty, {part(candidate, 1.0)});
    groups = gap::make_groups(world.data);
  }
  static std::vector<cell::Experiment> recorded(double of_wave, double of_ramp, double with_ramp_in_1,
                                                std::uint64_t seed) {
    Random random(seed);
    std::vector<cell::Experiment> out = {motion("motion-1", cell::Split::Fit, 500),
                                         motion("motion-2", cell::Split::Check, 400)};
    for (cell::Experiment& e : out) {
      const Eigen::Index rows = e.data.values.rows();
      add_column(e, "i1",
                 random.normal_vector(rows) + of_wave * at_times(e, wave) + with_ramp_in_1 * at_times(e, ramp));
      add_column(e, "i2", random.normal_vector(rows) + of_ramp * at_times(e, ramp));
    }
    return out;
  }
  gap::ResidualAnalysis analysis(const gap::Model& of) const {
    return gap::analyze_residual(problem, groups, of, world.base, options);
  }
  World world;
  gap::Candidate candidate;
  gap::NuisanceModel none;
  gap::FitProblem problem{world.data, none, {}, 0.0};
  gap::DiagnoseOptions options = single_threaded();
  gap::Model empty, model;
  std::vector<gap::Group> groups;

 private:
  static gap::DiagnoseOptions single_threaded() {
    gap::DiagnoseOptions out;
    out.threads = 1;
    return out;
  }
};

}  // namespace

TEST_CASE("a model that explains its column leaves structure in the other alone") {
  const Fitted f(3.0, 1.0);
  const gap::ResidualAnalysis before = f.analysis(f.empty), after = f.analysis(f.model);
  CHECK(before.structured == std::vector<bool>{true, true});
  CHECK(after.structured == std::vector<bool>{false, true});
  CHECK(after.any_structure());
  CHECK(after.any());
  CHECK(after.shown == f.model.residual);
  REQUIRE(after.without.size() == 1);
  CHECK((after.without[0] - f.world.base).norm() < 1e-9);  // without its only part, the nominal cell
  CHECK(after.strayed == std::vector<double>{0.0});
  CHECK(gap::trust(f.world.data, f.groups, f.model, after, 0, f.options) == Approx(1.0));
  const Fitted clean(3.0, 0.0);
  CHECK_FALSE(clean.analysis(clean.model).any());
}

TEST_CASE("trust falls by the logarithm of what is left beside what is explained") {
  const Fitted f(3.0, 0.0);
  gap::ResidualAnalysis rest = f.analysis(f.model);
  const double explained = rest.without[0].squaredNorm() - rest.whole.squaredNorm();
  rest.structured[0] = true;
  const double accuracy = f.options.simulator_accuracy;  // full trust at its square, none at a twentieth
  const auto trust_at = [&](double left) {
    rest.strength[0] = left * explained;
    return gap::trust(f.world.data, f.groups, f.model, rest, 0, f.options);
  };
  CHECK(trust_at(0.5 * accuracy * accuracy) == Approx(1.0));
  CHECK(trust_at(0.06) == Approx(0.0).margin(1e-9));
  const double middle = std::sqrt(0.05 * accuracy * accuracy);  // half way by the logarithm
  CHECK(trust_at(middle) == Approx(0.5).epsilon(0.01));
  rest.structured[0] = false;
  rest.strayed[0] = middle * explained;  // sizes that differ count the same
  CHECK(gap::trust(f.world.data, f.groups, f.model, rest, 0, f.options) == Approx(0.5).epsilon(0.01));
}

TEST_CASE("an effect worsens the check experiments when they fit worse with it") {
  Fitted f(3.0, 0.0);
  CHECK_FALSE(gap::worsens_check(f.world.data, f.groups, f.model, f.empty));
  CHECK(gap::worsens_check(f.world.data, f.groups, f.empty, f.model));
  gap::Model of_fit_alone = f.model;  // better on the fit experiment, the same on the check one
  of_fit_alone.residual = f.world.base;
  f.world.data.blocks[0].rows_of(of_fit_alone.residual).setZero();
  CHECK_FALSE(gap::worsens_check(f.world.data, f.groups, of_fit_alone, f.empty));
  CHECK_FALSE(gap::worsens_check(f.world.data, f.groups, f.empty, of_fit_alone));
}

TEST_CASE("an effect is within the discrepancy when it explains no more than a few shapes of it could") {
  Fitted f(0.25, 0.0);
  f.options.simulator_accuracy = 0.0;
  const auto within = [&](double floor) {
    f.options.simulator_floor = floor;
    return gap::within_discrepancy(f.problem, f.groups, f.model, f.empty, f.world.base, f.options);
  };
  const double gain = gap::updated(f.problem, f.empty).squaredNorm() - gap::updated(f.problem, f.model).squaredNorm();
  const double limit = std::sqrt(gain * 12.0 / 2.0 / 900.0);  // floor^2 times rows, two of twelve shapes
  CHECK_FALSE(within(0.95 * limit));
  CHECK(within(1.05 * limit));
}

TEST_CASE("a column is beyond a known error when it is off by more than twice of it, where it is known") {
  Fitted f(0.0, 0.0);
  CHECK(gap::known_error(f.options, "motion.i2") == 0.0);
  f.options.simulator_errors = {{"motion.i2", 1.5}};
  CHECK(gap::known_error(f.options, "motion.i2") == 1.5);
  gap::Model off = f.empty;
  const auto beyond = [&](double rms) {
    off.residual.setConstant(rms);
    return f.analysis(off).beyond;
  };
  CHECK(beyond(std::sqrt(0.95 * 10.0)) == std::vector<bool>{false, false});  // 1 + (2 1.5)^2
  CHECK(beyond(std::sqrt(1.05 * 10.0)) == std::vector<bool>{false, true});
  // Estimated from the recording itself, it excuses twice the noise and twice the accuracy of what is shown.
  f.options.errors_of_recording = true;
  f.options.simulator_accuracy = 0.0;
  CHECK(beyond(1.9) == std::vector<bool>{false, false});
  CHECK(beyond(2.1) == std::vector<bool>{false, true});
}

TEST_CASE("what a column beyond a known error depends on is told by tests against noise") {
  Fitted f(0.0, 2.0);
  f.options.simulator_errors = {{"motion.i2", 0.1}};
  gap::ResidualAnalysis rest = f.analysis(f.empty);
  REQUIRE(rest.beyond == std::vector<bool>{false, true});
  rest.structure[1].dependences = {{{gap::VariableKind::Experiment}, gap::Shape::EffectDiffers}};
  gap::describe_beyond(f.world.data, f.groups, f.options, rest);
  REQUIRE(rest.structure[1].dependences.size() > 1);
  CHECK(rest.structure[1].dependences[0].shape == gap::Shape::EffectDiffers);  // stays first
  CHECK(rest.structure[1].dependences[1].shape != gap::Shape::EffectDiffers);
  CHECK(rest.structure[0].dependences.empty());
}

}  // namespace residual_analysis_test
