#include "gap/screening/periodic.hpp"

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Effects that are periodic in a joint angle, found from the signature of one cycle.

namespace periodic_test {

using namespace kr5;
using namespace linear_world;

namespace {

double load(double t) { return 0.3 + 0.1 * std::cos(2.0 * t); }

/// A motion in which joint 1 swings while a ripple of some cycles acts on i1; positions as recorded, when there are.
struct Ripple {
  Ripple(int cycles, double amplitude, double phase, bool measured)
      : experiment(motion("motion-1", cell::Split::Fit, 600)) {
    Random random(31);
    const Eigen::VectorXd q = experiment.data.column("qc1").array() + (measured ? 0.2 : 0.0);
    if (measured) add_column(experiment, "q1", q);
    for (int j = 2; measured && j <= 6; ++j) add_column(experiment, "q" + std::to_string(j), 0.0 * q);
    angle = q;
    strength = at_times(experiment, load);
    add_column(
        experiment, "i1",
        random.normal_vector(q.size()).array() + amplitude * strength.array() * (cycles * q.array() + phase).sin());
  }
  cell::Experiment experiment;
  Eigen::VectorXd angle, strength;

  /// The candidate of one cycle, its signatures on i1 alone.
  gap::Candidate one_cycle(const World& world) const {
    const gap::PeriodicEffect effect = gap::periodic_effects(world.recording.cell).front();
    gap::Candidate out{gap::periodic_hypothesis(world.recording.cell, effect, 1), {0}, {}};
    const auto of_current = std::ranges::find(world.data.blocks, "i1", &gap::Block::column);
    const int block = static_cast<int>(of_current - world.data.blocks.begin());
    const Eigen::VectorXf sine = (strength.array() * angle.array().sin()).cast<float>();
    const Eigen::VectorXf cosine = (strength.array() * angle.array().cos()).cast<float>();
    out.signatures = {{{{{block, sine}}}, {{{block, cosine}}}}};
    return out;
  }
};

}  // namespace

TEST_CASE("the carrier is what the effect would be at a constant angle") {
  const Ripple ripple(5, 0.0, 0.0, false);
  const World world({ripple.experiment});
  const gap::Carrier carrier = gap::make_carrier(world.data, ripple.one_cycle(world), 0);
  REQUIRE(carrier.constant.parts.size() == 1);
  CHECK((carrier.constant.parts[0].second.cast<double>() - ripple.strength).cwiseAbs().maxCoeff() < 1e-5);
  CHECK(carrier.square == Approx(ripple.strength.squaredNorm()).epsilon(1e-5));
  for (const int c : {1, 7, 200}) {  // sums of squares times e^{2icq}
    const Eigen::ArrayXd square = ripple.strength.array().square();
    CHECK(carrier.squares(c).real() == Approx((square * (2.0 * c * ripple.angle.array()).cos()).sum()).margin(1e-3));
    CHECK(carrier.squares(c).imag() == Approx((square * (2.0 * c * ripple.angle.array()).sin()).sum()).margin(1e-3));
  }
}

TEST_CASE("the number of cycles is read from what is left, at recorded angles where there are some") {
  for (const bool measured : {false, true})
    for (const int cycles : {3, 48, 171}) {
      const Ripple ripple(cycles, 4.0, 0.7, measured);
      const World world({ripple.experiment});
      const gap::Carrier carrier = gap::make_carrier(world.data, ripple.one_cycle(world), 0);
      const std::vector<int> best = gap::best_cycles(world.data, carrier, world.base, 2);
      REQUIRE(best.size() == 2);
      CHECK(best[0] == cycles);
      CHECK(best[1] != cycles);
    }
}

TEST_CASE("the candidate of some cycles has their signature, and the prior of one number among many") {
  const Ripple ripple(48, 0.0, 0.0, false);
  const World world({ripple.experiment});
  const gap::Carrier carrier = gap::make_carrier(world.data, ripple.one_cycle(world), 0);
  const gap::Candidate found = gap::modulated(world.data, carrier, 48);
  REQUIRE(found.signatures.size() == 1);
  const Eigen::VectorXd turned = 48.0 * ripple.angle;
  const Eigen::VectorXd sine = ripple.strength.array() * turned.array().sin(),
                        cosine = ripple.strength.array() * turned.array().cos();
  CHECK((found.signatures[0][0].parts[0].second.cast<double>() - sine).cwiseAbs().maxCoeff() < 1e-5);
  CHECK((found.signatures[0][1].parts[0].second.cast<double>() - cosine).cwiseAbs().maxCoeff() < 1e-5);
  CHECK(found.hypothesis.log_prior == Approx(-std::log(200.0)));
  CHECK(found.hypothesis.choice == "48 cycles");
  CHECK(found.experiments == std::vector<int>{0});
}

}  // namespace periodic_test
