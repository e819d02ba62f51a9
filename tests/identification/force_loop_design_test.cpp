#include <cmath>

#include <catch2/catch.hpp>

#include <Eigen/Eigenvalues>

#include <kr5/core/error.hpp>
#include <kr5/identification/force_loop_design.hpp>
#include <kr5/physics/path_correction.hpp>

namespace force_loop_design_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using force::CorrectionReference;
using force::ForceLoopOptions;

namespace {

const ForceLoopPlant book = {.servo = {3.064, 0.7492, 0.024}};

/// Forces in every cycle when force::ForceLoop acts on the simulated path correction.
std::vector<double> simulated(const ForceLoopPlant& plant, const ForceLoopOptions& options, double reference,
                              int cycles) {
  cell::Cell cell;
  cell.servo = cell::Servo{.cycle = plant.cycle, .joint = {}, .tool = plant.servo, .correction = cell::Correction{}};
  if (options.correction == CorrectionReference::Actual) cell.servo->correction->mode = cell::CorrectionMode::Relative;
  physics::PathCorrection path(physics::PathServo(cell), 0.0);
  force::ForceLoop loop(options);
  std::vector<double> out;
  for (int k = 0; k < cycles; ++k) {
    const double force = std::max(plant.stiffness * path.z() + plant.damping * path.speed(), 0.0);
    path.advance(loop.step(reference, force));
    out.push_back(plant.stiffness * path.z() + plant.damping * path.speed());
  }
  return out;
}

}  // namespace

TEST_CASE("the design of the book: compensator, errors, overshoot, peak, settling and the limit of the gain") {
  const ForceLoopDesign design = design_force_loop(book, {});
  CHECK(design.compensator == Approx(9.554).margin(1e-3));
  CHECK(design.uncompensated_error == Approx(0.895).margin(5e-4));
  CHECK(design.contact_speed == Approx(8.33e-3).margin(1e-5));
  CHECK(design.nominal.stable);
  CHECK(design.nominal.final_force == Approx(20.0).margin(1e-9));
  CHECK(design.nominal.overshoot == Approx(0.0446).margin(2e-4));
  CHECK(design.nominal.peak_time == Approx(1.39).margin(0.012));
  CHECK(design.nominal.settling_time == Approx(1.87).margin(0.012));
  CHECK(design.nominal.gain_margin == Approx(design.nominal.gain_limit / 5e-6));
  CHECK_FALSE(design.nominal.phase_margin);  // the open loop never reaches a gain of 1: k_p k_e = 0.117
  ForceLoopPlant late = book;
  late.servo.delay = 0.048;
  CHECK(design_force_loop(late, {}).nominal.overshoot == Approx(0.0463).margin(2e-4));
}

TEST_CASE("the limit of the gain is 0.888 mm/N without a hold, less with commands that are held over 12 ms") {
  // The loop in continuous time: phase -w T - arg(1 - (w/wn)^2 + 2 i zeta w/wn) = -pi, and the gain there.
  const double wn = 3.064, zeta = 0.7492, late = 0.024;
  double low = wn, high = 100.0;
  for (int i = 0; i < 100; ++i) {
    const double w = (low + high) / 2;
    const double phase = w * late + std::atan2(2 * zeta * w / wn, 1 - w * w / (wn * wn));
    (phase < 3.14159265358979 ? low : high) = w;
  }
  const double limit = std::hypot(1 - low * low / (wn * wn), 2 * zeta * low / wn) / 23.38e3;
  CHECK(limit == Approx(0.888e-3).epsilon(0.005));
  ForceLoopPlant fast = book;
  fast.cycle = 0.001;
  const auto radius = [&](double gain) {
    return force_loop_matrix(fast, CorrectionReference::Start, gain).eigenvalues().cwiseAbs().maxCoeff();
  };
  CHECK(radius(0.95 * limit) < 1);  // half a cycle of hold costs 2 %
  CHECK(radius(1.0 * limit) > 1);
  CHECK(design_force_loop(book, {}).nominal.gain_limit == Approx(0.714e-3).epsilon(0.001));
}

TEST_CASE("a stiffness a fifth wrong makes the force 17.5 % wrong, for corrections of the start alone") {
  ForceLoopPlant harder = book;
  harder.stiffness *= 1.2;
  CHECK(design_force_loop(harder, {}).nominal.steady_error == Approx(0.175).margin(5e-4));
  const ForceLoopDesign actual = design_force_loop(harder, {.correction = CorrectionReference::Actual});
  CHECK(actual.nominal.steady_error == Approx(0.0).margin(1e-9));
  CHECK(actual.compensator == 1.0);
  CHECK(actual.uncompensated_error == 0.0);
}

TEST_CASE("the design predicts what the controller does on the simulated path, cycle by cycle, in both modes") {
  for (const CorrectionReference correction : {CorrectionReference::Start, CorrectionReference::Actual}) {
    const ForceLoopOptions loop{.gain = 8e-6, .correction = correction};
    ForceLoopPlant plant = book;
    plant.damping = 40.0;
    CAPTURE(name_of(correction));
    const Eigen::MatrixXd A = force_loop_matrix(plant, correction, loop.gain);
    Eigen::VectorXd x = Eigen::VectorXd::Zero(A.rows());
    for (const double force : simulated(plant, loop, 20.0, 400)) {
      x = A * x;
      x[A.rows() - 1] += loop.gain * loop.compensator() * 20.0;
      REQUIRE(plant.stiffness * x[0] + plant.damping * x[1] == Approx(force).margin(1e-9));
    }
  }
}

TEST_CASE("below the limit of the gain the simulated loop settles, above it it does not, in both modes") {
  for (const CorrectionReference correction : {CorrectionReference::Start, CorrectionReference::Actual}) {
    const double limit = design_force_loop(book, {.correction = correction}).nominal.gain_limit;
    CAPTURE(name_of(correction), limit);
    REQUIRE(limit > 0);
    for (const double part : {0.97, 1.03}) {
      const Eigen::MatrixXd A = force_loop_matrix(book, correction, part * limit);
      Eigen::VectorXd x = Eigen::VectorXd::Ones(A.rows());
      for (int k = 0; k < 2000; ++k) x = A * x;  // the slow modes have died away
      const double early = x.norm();
      for (int k = 0; k < 4000; ++k) x = A * x;
      CHECK((x.norm() < early) == (part < 1));
    }
    const Eigen::MatrixXd A = force_loop_matrix(book, correction, limit);
    CHECK(A.eigenvalues().cwiseAbs().maxCoeff() == Approx(1.0).margin(1e-9));
  }
}

TEST_CASE("a delay between whole cycles lies between theirs, and margins agree with each other") {
  double last = 1e9;
  for (const double delay : {0.0, 0.012, 0.015, 0.018, 0.024, 0.03}) {
    ForceLoopPlant plant = book;
    plant.servo.delay = delay;
    const double limit = design_force_loop(plant, {}).nominal.gain_limit;
    CHECK(limit < last);
    last = limit;
  }
  // At the limit of the gain there is no phase left.
  const double limit = design_force_loop(book, {}).nominal.gain_limit;
  const auto close = design_force_loop(book, {.gain = 0.999 * limit}).nominal.phase_margin;
  REQUIRE(close);
  CHECK(*close < 0.01);
  CHECK(*close >= 0);
  const auto integrating = design_force_loop(book, {.correction = CorrectionReference::Actual}).nominal.phase_margin;
  REQUIRE(integrating);  // an integrator crosses a gain of 1 always
  CHECK(*integrating > 1.0);
}

TEST_CASE("the recommended gain keeps to overshoot and margin over the range, a greater one does not") {
  for (const CorrectionReference correction : {CorrectionReference::Start, CorrectionReference::Actual}) {
    const ForceLoopDesignOptions options{.lowest_stiffness = 10e3, .highest_stiffness = 40e3, .points = 5};
    ForceLoopOptions loop{.correction = correction};
    loop.gain = design_force_loop(book, loop, options).recommended_gain;
    CAPTURE(name_of(correction), loop.gain);
    REQUIRE(loop.gain > 0);
    for (const ForceLoopPoint& point : design_force_loop(book, loop, options).range) {
      CHECK(point.overshoot <= options.max_overshoot + 1e-6);
      CHECK(point.gain_margin >= options.min_gain_margin - 1e-6);
    }
    loop.gain *= 1.05;
    const ForceLoopPoint worst = design_force_loop(book, loop, options).range.back();
    CHECK((worst.overshoot > options.max_overshoot || worst.gain_margin < options.min_gain_margin));
  }
}

TEST_CASE("a plant or an option that cannot be is named") {
  ForceLoopPlant plant = book;
  plant.servo.delay = -0.01;
  CHECK_THROWS_WITH(design_force_loop(plant, {}), Contains("servo.delay"));
  plant = book;
  plant.stiffness = 0;
  CHECK_THROWS_WITH(design_force_loop(plant, {}), Contains("stiffness must be positive"));
  CHECK_THROWS_WITH(design_force_loop(book, {.gain = -1}), Contains("gain must be positive"));
  CHECK_THROWS_WITH(design_force_loop(book, {}, {.lowest_stiffness = 2e4, .highest_stiffness = 1e4}),
                    Contains("highest_stiffness"));
  CHECK_THROWS_WITH(design_force_loop(book, {}, {.points = 0}), Contains("points"));
}

}  // namespace force_loop_design_test
