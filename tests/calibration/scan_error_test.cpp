#include <functional>
#include <limits>
#include <string>
#include <utility>

#include <catch2/catch.hpp>

#include <kr5/calibration/scan_error.hpp>
#include <kr5/core/error.hpp>
#include <kr5/predict/fast_simulator.hpp>

namespace scan_error_test {

using namespace kr5;
using namespace kr5::calibration;
using Catch::Matchers::Contains;

cell::Cell scanning_cell(double noise) {
  cell::Cell out = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  out.noise.laser = noise;
  return out;
}

/// What the fast simulator shows, changed.
class Changed : public cell::Simulator {
 public:
  using Change = std::function<void(io::Table&)>;
  explicit Changed(Change change) : change_(std::move(change)) {}

 protected:
  io::Table simulate(const cell::Cell& cell, const cell::Experiment& experiment) const override {
    io::Table out = predict::FastSimulator().simulate(cell, experiment);
    change_(out);
    return out;
  }

 private:
  Change change_;
};

constexpr double best = 0.19;  // stand-off of the cell [m]
const predict::FastSimulator fast;

TEST_CASE("a scanner without bias, lag and noise is exact at every stand-off and speed", "[scan_error]") {
  const cell::Cell cell = scanning_cell(0.0);
  for (const auto& [stand_off, speed] : {std::pair(0.15, 0.3), std::pair(best, 0.01), std::pair(0.23, 1.0)}) {
    const ScanErrorResult found =
        simulate_scan_error(cell, fast, stand_off, speed, {.bias = 0.0, .delay = 0.0, .passes = 3});
    REQUIRE(found.fit.usable());
    for (const ScanError& error : {found.as_stamped, found.synchronised}) {
      CHECK(error.rms < 1e-9);
      CHECK(error.centre < 1e-9);
    }
  }
}

TEST_CASE("a late profile misplaces the sphere by speed times lag, and interpolation undoes it", "[scan_error]") {
  const cell::Cell cell = scanning_cell(0.0);
  for (const double lag : {0.006, -0.02})
    for (const double speed : {0.01, 0.3}) {
      const ScanErrorResult found =
          simulate_scan_error(cell, fast, best, speed, {.bias = 0.0, .delay = lag, .passes = 4});
      REQUIRE(found.fit.usable());
      CHECK(found.as_stamped.centre == Approx(speed * std::abs(lag)).epsilon(1e-3));
      CHECK(found.as_stamped.rms > 0.1 * speed * std::abs(lag));
      CHECK(found.synchronised.centre < 1e-8);
      CHECK(found.synchronised.rms < 1e-8);
    }
}

TEST_CASE("a range error grows away from the best stand-off, whatever the times", "[scan_error]") {
  const cell::Cell cell = scanning_cell(0.0);
  const ScanErrorOptions options{.bias = 2e-3, .delay = 0.0, .passes = 2};
  const auto at = [&](double stand_off) { return simulate_scan_error(cell, fast, stand_off, 0.1, options); };
  const ScanErrorResult near = at(0.15), middle = at(best), far = at(0.23);
  CHECK(middle.synchronised.centre < 0.2 * near.synchronised.centre);
  CHECK(middle.synchronised.centre < 0.2 * far.synchronised.centre);
  CHECK(far.as_stamped.centre == Approx(far.synchronised.centre).epsilon(1e-9));
  CHECK(far.as_stamped.rms == Approx(far.synchronised.rms).epsilon(1e-9));
}

TEST_CASE("any simulator is evaluated: ranges a millimetre too long lower the sphere by that", "[scan_error]") {
  const cell::Cell cell = scanning_cell(0.0);
  const Changed longer([](io::Table& shown) { shown.values.col(shown.find("z")).array() += 1e-3; });
  const ScanErrorResult found = simulate_scan_error(cell, longer, best, 0.05, {.bias = 0.0, .delay = 0.0, .passes = 2});
  REQUIRE(found.fit.usable());
  CHECK(found.as_stamped.centre == Approx(1e-3).epsilon(1e-6));
  CHECK(found.as_stamped.rms > 3e-4);  // cosine of the slope
  CHECK(found.as_stamped.rms < 1e-3);
}

TEST_CASE("noise comes from the seed, and is that of the cell", "[scan_error]") {
  const cell::Cell cell = scanning_cell(2e-5);
  const auto with = [&](std::uint64_t seed) {
    return simulate_scan_error(cell, fast, best, 0.05, {.bias = 0.0, .delay = 0.0, .passes = 2, .seed = seed})
        .as_stamped;
  };
  const ScanError one = with(1), again = with(1), other = with(2);
  CHECK(one.rms == again.rms);
  CHECK(one.centre == again.centre);
  CHECK(one.centre != other.centre);
  CHECK(one.rms < 2e-5);  // of which a slope takes the cosine
  CHECK(one.rms > 1e-5);
  CHECK(one.centre < 5e-6);
}

TEST_CASE("scans that do not show the sphere have no error", "[scan_error]") {
  const cell::Cell cell = scanning_cell(0.0);
  const Changed beside([](io::Table& shown) { shown.values.col(shown.find("sphere")).setZero(); });
  const Changed blind([](io::Table& shown) {
    shown.values.col(shown.find("z")).setConstant(std::numeric_limits<double>::quiet_NaN());
  });
  for (const Changed* simulator : {&beside, &blind}) {
    const ScanErrorResult found = simulate_scan_error(cell, *simulator, best, 0.05, {.passes = 2});
    CHECK_FALSE(found.fit.usable());
    CHECK_THAT(found.fit.message, Contains("pass 1: found 0 points of the sphere"));
  }
}

TEST_CASE("a cell or an option that does not suffice is named", "[scan_error]") {
  const cell::Cell cell = scanning_cell(0.0);
  const auto refusal = [&](const cell::Cell& of, double stand_off, double speed, const ScanErrorOptions& options) {
    try {
      simulate_scan_error(of, fast, stand_off, speed, options);
    } catch (const InvalidArgument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  cell::Cell without = cell;
  without.laser.reset();
  CHECK_THAT(refusal(without, best, 0.1, {}), Contains("no laser with a mount and a target"));
  without = cell;
  without.laser->target.reset();
  CHECK_THAT(refusal(without, best, 0.1, {}), Contains("no laser with a mount and a target"));
  without = cell;
  without.robot.limits.reset();
  CHECK_THAT(refusal(without, best, 0.1, {}), Contains("robot.limits"));
  CHECK_THAT(refusal(cell, 4.0, 0.1, {}), Contains("does not reach a pass at a stand-off of 4000 mm"));
  CHECK_THAT(refusal(cell, best, 0.1, {.bias = 0.5}), Contains("bias"));  // beyond the catalogue
  CHECK_THAT(refusal(cell, best, 0.1, {.delay = std::numeric_limits<double>::infinity()}), Contains("delay"));
  CHECK_THAT(refusal(cell, best, 0.1, {.passes = 0}), Contains("passes"));
  CHECK_THAT(refusal(cell, best, 0.1, {.lines = 1}), Contains("lines"));
  CHECK_THAT(refusal(cell, best, 0.1, {.points = 1}), Contains("points"));
  CHECK_THAT(refusal(cell, best, 0.1, {.width = 0.0}), Contains("width"));
  CHECK_THAT(refusal(cell, best, 0.0, {}), Contains("speed"));
  CHECK_THAT(refusal(cell, std::numeric_limits<double>::quiet_NaN(), 0.1, {}), Contains("stand_off"));
}

}  // namespace scan_error_test
