// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/physics/path_correction.hpp>

namespace path_correction_test {

using namespace kr5;
using cell::CorrectionMode;
using physics::PathCorrection;
using physics::PathServo;

namespace {

cell::Cell arc() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

constexpr double stiffness = 23380.0, gain = 5e-6, wanted = 20.0;  // of the book [N/m], [m/N], [N]
constexpr double compensator = (1 + gain * stiffness) / (gain * stiffness);

cell::Cell cell_with(CorrectionMode mode, std::optional<double> per_cycle = {}, std::optional<double> total = {}) {
  cell::Cell cell = arc();
  cell.servo->correction = cell::Correction{mode, per_cycle, total};
  return cell;
}

struct Force {
  double last = 0.0, most = 0.0;
  bool limited = false;
};

/// Force control of section 5.3 on a wall at 0, in free contact with it at the start.
Force controlled(const cell::Cell& cell, double asked) {
  PathCorrection path(PathServo(cell), 0.0);
  Force out;
  for (int k = 0; k < 4000; ++k) {
    out.last = stiffness * std::max(path.z(), 0.0);
    out.most = std::max(out.most, out.last);
    path.advance(gain * (asked - out.last));
    out.limited = path.limited();
  }
  return out;
}

}  // namespace

TEST_CASE("with absolute corrections the compensator of the book brings the force to what is wanted") {
  const cell::Cell cell = cell_with(CorrectionMode::Absolute);
  const Force force = controlled(cell, compensator * wanted);
  CHECK(force.last == Approx(wanted).epsilon(1e-9));
  CHECK(force.most == Approx(wanted * 1.0446).epsilon(5e-4));  // the reference simulation of the book's loop
  CHECK(controlled(cell, wanted).last == Approx(wanted / compensator).epsilon(1e-9));
}

TEST_CASE("relative corrections add up: no steady error without compensator, and far too much force with it") {
  const cell::Cell cell = cell_with(CorrectionMode::Relative);
  CHECK(controlled(cell, wanted).last == Approx(wanted).epsilon(1e-4));  // slowly
  CHECK(controlled(cell, compensator * wanted).last == Approx(191.1).epsilon(1e-3));
}

TEST_CASE("a path never leaves its start by more than the whole correction that is allowed, in both modes") {
  for (const CorrectionMode mode : {CorrectionMode::Absolute, CorrectionMode::Relative}) {
    const Force force = controlled(cell_with(mode, {}, 4e-4), 10 * compensator * wanted);
    CHECK(force.last == Approx(4e-4 * stiffness).epsilon(1e-6));
    CHECK(force.limited);
  }
}

TEST_CASE("the limit of a cycle bounds the slope of absolute corrections, and each relative one") {
  const double most = 2e-5, cycle = arc().servo->cycle;
  PathCorrection absolute(PathServo(cell_with(CorrectionMode::Absolute, most)), 0.0);
  for (int k = 0; k < 250; ++k) absolute.advance(1.0);
  CHECK(absolute.speed() == Approx(most / cycle).epsilon(1e-3));  // once settled, the path runs as its command does
  CHECK(absolute.limited());
  const PathServo servo(cell_with(CorrectionMode::Relative, most));
  PathCorrection relative(servo, 0.0), free(PathServo(cell_with(CorrectionMode::Relative)), 0.0);
  for (int k = 0; k < 250; ++k) relative.advance(1.0), free.advance(most);
  CHECK(relative.z() == Approx(free.z()).epsilon(1e-12));
  CHECK(relative.z() > 0.0);
}

TEST_CASE("frequency, cycle and limits that are not positive are refused by name") {
  const auto complaint = [](const cell::Cell& cell) {
    try {
      const PathServo servo(cell);
    } catch (const InvalidArgument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  CHECK(complaint(cell_with(CorrectionMode::Absolute)).empty());
  CHECK_THAT(complaint(cell_with(CorrectionMode::Absolute, 0.0)), Catch::StartsWith("servo.correction.per_cycle"));
  CHECK_THAT(complaint(cell_with(CorrectionMode::Relative, {}, -1.0)), Catch::StartsWith("servo.correction.total"));
  cell::Cell cell = arc();
  cell.effects.set("tool_servo", "servo", "natural_frequency", 0.0);
  CHECK_THAT(complaint(cell), Catch::StartsWith("servo.tool.natural_frequency"));
  cell = arc();
  cell.servo->cycle = 0.0;
  CHECK_THAT(complaint(cell), Catch::StartsWith("servo.cycle"));
  cell.servo->tool.reset();
  CHECK_THAT(complaint(cell), Catch::StartsWith("servo.tool"));
}

}  // namespace path_correction_test
