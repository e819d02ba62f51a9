#include <kr5/force/force_loop.hpp>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace force_loop_test {

using namespace kr5;
using namespace kr5::force;

namespace {

/// The servo and the contact of the book (5.10, 5.14), stepped far finer than a cycle.
class Bench {
 public:
  double force() const { return std::max(0.0, stiffness * z_); }
  double z() const { return z_; }
  /// One cycle with a command that acts two cycles later.
  void advance(double command) {
    line_.push_back(command);
    const double u = line_.front();
    line_.pop_front();
    constexpr int fine = 120;
    const double h = cycle / fine;
    for (int i = 0; i < fine; ++i) {
      const double a = wn * wn * (u - z_) - 2 * zeta * wn * v_;
      v_ += h * a;
      z_ += h * v_;
    }
  }

  double stiffness = 23.38e3;
  static constexpr double cycle = 0.012, wn = 3.064, zeta = 0.7492;

 private:
  double z_ = 0.0, v_ = 0.0;
  std::deque<double> line_ = {0.0, 0.0};
};

struct Response {
  double last = 0.0, most = 0.0, peak_at = 0.0, settled_at = 0.0;
  double overshoot(double wish) const { return 100 * (most - wish) / wish; }
};

Response respond(const ForceLoopOptions& options, double wish, double stiffness = 23.38e3, double seconds = 8.0) {
  ForceLoop loop(options);
  Bench bench;
  bench.stiffness = stiffness;
  Response out;
  for (int k = 0; k * Bench::cycle < seconds; ++k) {
    const double correction = loop.step(wish, bench.force());
    bench.advance(options.correction == CorrectionReference::Start ? correction : bench.z() + correction);
    const double t = (k + 1) * Bench::cycle;
    out.last = bench.force();
    if (out.last > out.most) out.most = out.last, out.peak_at = t;
    if (std::abs(out.last - wish) > 0.02 * wish) out.settled_at = t;
  }
  return out;
}

}  // namespace

TEST_CASE("the force loop of the book: overshoot, peak and settling of its reference simulation") {
  const Response r = respond({}, 20.0);
  CHECK(r.last == Approx(20.0).margin(0.01));
  CHECK(r.overshoot(20.0) == Approx(4.46).margin(0.05));
  CHECK(r.peak_at == Approx(1.39).margin(0.025));
  CHECK(r.settled_at == Approx(1.87).margin(0.025));
  CHECK(ForceLoopOptions{}.compensator() == Approx(9.554).margin(1e-3));
}

TEST_CASE("overshoot stays below that which was measured, the steady error below a tenth of a newton, at all forces") {
  for (const double wish : {10.0, 20.0, 30.0, 40.0, 50.0, 60.0}) {
    const Response r = respond({}, wish);
    CHECK(r.overshoot(wish) <= 4.75);
    CHECK(std::abs(r.last - wish) <= 0.1);
  }
}

TEST_CASE("a stiffness that is a fifth wrong makes the force as wrong as the book says, for corrections of the start") {
  CHECK(respond({}, 20.0, 1.2 * 23.38e3).last == Approx(20 * 1.175).margin(0.1));
}

TEST_CASE("corrections of the actual pose need no compensator, whatever the stiffness") {
  const ForceLoopOptions options{.correction = CorrectionReference::Actual};
  CHECK(options.compensator() == 1.0);
  for (const double stiffness : {15e3, 23.38e3, 30e3})
    CHECK(respond(options, 20.0, stiffness, 60.0).last == Approx(20.0).margin(0.1));
}

TEST_CASE("the loop is stable up to the gain of the reference, not beyond") {
  const auto swings = [](double gain) {
    const Response r = respond({.gain = gain}, 20.0, 23.38e3, 60.0);
    return std::abs(r.last - 20) > 5 || r.settled_at > 55;
  };
  CHECK_FALSE(swings(0.7 * 0.888e-3));
  CHECK(swings(1.2 * 0.888e-3));
}

TEST_CASE("limits hold and are told, and a reading that is no number moves nothing") {
  ForceLoop loop({.largest_step = 1e-4, .range = 2.5e-4});
  CHECK(loop.step(20, 0) == Approx(1e-4));
  CHECK(loop.limited());
  CHECK(loop.step(20, 0) == Approx(2e-4));
  CHECK(loop.step(20, 0) == Approx(2.5e-4));
  CHECK(loop.step(20, std::numeric_limits<double>::quiet_NaN()) == Approx(2.5e-4));
  CHECK(loop.step(0, 20) == Approx(1.5e-4));
  loop.reset();
  CHECK(loop.correction() == 0.0);
  CHECK(loop.step(0.1, 0.1 * 9.554 - 0.5) == Approx(2.5e-6).epsilon(0.01));
  CHECK_FALSE(loop.limited());
}

TEST_CASE("contact is made no faster than the loop can take it") {
  CHECK(ForceLoopOptions{}.contact_speed(20.0, 0.012) == Approx(8.3e-3).margin(1e-4));
  CHECK_THROWS_WITH(ForceLoop({.gain = 0.0}), Catch::Contains("gain"));
  CHECK_THROWS_WITH(ForceLoop({.range = -1.0}), Catch::Contains("range"));
}

TEST_CASE("forces that are no finite numbers move nothing, then or afterwards") {
  const double infinite = std::numeric_limits<double>::infinity(), none = std::numeric_limits<double>::quiet_NaN();
  for (const CorrectionReference reference : {CorrectionReference::Start, CorrectionReference::Actual})
    for (const double bad : {none, infinite, -infinite}) {
      CAPTURE(name_of(reference), bad);
      ForceLoop loop({.correction = reference});
      const double before = loop.step(10, 0), held = reference == CorrectionReference::Start ? before : 0.0;
      CHECK(loop.step(10, bad) == held);
      CHECK(loop.limited());
      CHECK(loop.step(bad, 10) == held);
      CHECK(std::abs(loop.step(10, 0)) <= 1e-3);
    }
}

TEST_CASE("a step of a correction that adds up is bounded without being asked for") {
  ForceLoop loop({.correction = CorrectionReference::Actual});
  CHECK(loop.step(10, -1e9) == Approx(1e-3));
  CHECK(loop.limited());
  CHECK(loop.step(10, 1e300) == Approx(-1e-3));
  for (const double limit : {std::numeric_limits<double>::infinity(), 1e308}) {
    CHECK_THROWS_WITH(ForceLoop({.range = limit}), Catch::Contains("range"));
    CHECK_THROWS_WITH(ForceLoop({.largest_step = limit}), Catch::Contains("largest_step"));
  }
}

}  // namespace force_loop_test
