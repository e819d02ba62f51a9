#include <kr5/force/insertion.hpp>

#include <cmath>
#include <cstddef>
#include <limits>
#include <set>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/force/depth_profile.hpp>
#include <kr5/robot/loopback.hpp>
#include <support/trials.hpp>

#include "book_peg.hpp"

namespace insertion_test {

using namespace kr5;
using namespace kr5::force;
using namespace kr5::test;

#ifndef KR5_SANITIZED
namespace {
long allocations = 0;
}
// What every allocation comes to, Eigen's and that of operator new.
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace {

constexpr double mm = 1e-3;

InsertionOptions book_options() {
  InsertionOptions out;
  out.bodies = radii;
  out.tilt = 15 * degree;
  return out;
}

/// A loopback robot over a tube: what carries the peg pushes it up by a spring, and the wall of the bore pushes back
/// the lowest point of its rim; other forces across are left out. Enough for everything up to the push.
class Cell {
 public:
  explicit Cell(const Eigen::Vector3d& tube, std::uint64_t seed = 1, const InsertionFrames& frames = {})
      : tube_(tube), frames_(frames), robot_({.force_noise = 0.15, .torque_noise = 0.008, .seed = seed}) {
    robot_.place(T_base_tool(frames_, Pose(Eigen::Translation3d(0, 0, 20 * mm))));
    robot_.set_environment([this](const Pose& T_base_tool) { return present ? push(T_base_tool) : Vector6::Zero(); });
  }
  Cell(const Cell&) = delete;

  robot::RobotReading read() {
    robot::RobotReading out = robot_.read();
    out.currents = currents;
    return out;
  }
  void obey(const robot::RobotCommand& command) { robot_.send(command); }
  /// Steps until the phase, or to the end.
  void run(Insertion& insertion, Phase until = Phase::Done) {
    for (int i = 0; i < 10000 && !insertion.finished() && insertion.state().phase != until; ++i)
      obey(insertion.step(read()));
  }
  Pose pose() const { return peg_at(robot_.T_base_tool()); }

  bool present = true;
  robot::JointVector currents;

 private:
  Pose peg_at(const Pose& T_base_tool) const {
    return frames_.T_base_tube.inverse() * T_base_tool * frames_.T_tool_peg;
  }
  /// At the bottom of the peg, along Z of the tube; about the origin of the tool.
  Vector6 push(const Pose& T_base_tool) const {
    const Pose T_tube_peg = peg_at(T_base_tool);
    const Eigen::Vector3d side = wall(T_tube_peg);  // a rim that it stops is in the bore, and nothing carries it
    const Eigen::Vector3d force =
        frames_.T_base_tube.linear() * (side.isZero() ? Eigen::Vector3d(0, 0, press(T_tube_peg)) : side);
    const Eigen::Vector3d tool_to_peg = T_base_tool.linear() * frames_.T_tool_peg.translation();
    Vector6 out;
    out << force, tool_to_peg.cross(force);
    return out;
  }
  Eigen::Vector3d wall(const Pose& T_tube_peg) const {
    const Eigen::Vector3d axis = T_tube_peg.linear().col(2);
    const Eigen::Vector3d down = (axis.z() * axis - Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Vector3d lowest = T_tube_peg.translation() + radii.peg_radius * down - tube_;
    const double off = lowest.head<2>().norm(), depth = off - radii.inner_radius;
    if (!(lowest.z() < -1.5 * mm) || !(depth > 0) || off > radii.outer_radius) return Eigen::Vector3d::Zero();
    return -23.38e3 * depth / off * Eigen::Vector3d(lowest.x(), lowest.y(), 0.0);
  }
  double press(const Pose& T_tube_peg) const {
    const Eigen::Vector3d axis = T_tube_peg.linear().col(2), p = T_tube_peg.translation();
    const double tilt = std::atan2(axis.head<2>().norm(), axis.z());
    const PegRest rest = rest_peg_on_tube(radii, tilt, std::atan2(axis.y(), axis.x()), p.head<2>() - tube_.head<2>());
    const double depth = tube_.z() + rest.height - p.z();
    return depth > 0 ? 23.38e3 * depth : 0.0;  // nothing where nothing carries it: NaN
  }

  Eigen::Vector3d tube_;
  InsertionFrames frames_;
  robot::LoopbackRobot robot_;
};

Insertion started(const InsertionOptions& options, Cell& cell, Phase phase, const InsertionFrames& frames = {}) {
  Insertion out(options, frames);
  cell.run(out, phase);
  REQUIRE(out.state().phase == phase);
  return out;
}

void check_stopped(Insertion& insertion, Cell& cell, Reason reason) {
  CHECK(insertion.state().phase == Phase::Stopped);
  CHECK(insertion.state().reason == reason);
  const robot::RobotCommand first = insertion.step(cell.read());
  CHECK(first.stop);
  for (int i = 0; i < 20; ++i) {  // it stays so, whatever comes
    const robot::RobotCommand next = insertion.step(cell.read());
    CHECK(next.stop);
    CHECK(next.tool.isApprox(first.tool));
  }
  CHECK(insertion.state().reason == reason);
}

}  // namespace

TEST_CASE("a peg that goes round knows where the hole is, whatever the direction", "[statistics]") {
  Random random(5);
  const int all = trials(2000, 60);
  int covered = 0, within = 0;
  for (int k = 0; k < all; ++k) {
    const double azimuth = random.uniform(0, 2 * M_PI), distance = random.uniform(3 * mm, 9.42 * mm);
    const Eigen::Vector3d tube(distance * std::cos(azimuth), distance * std::sin(azimuth), random.normal(0.2 * mm));
    Cell cell(tube, 100 + static_cast<std::uint64_t>(k));
    InsertionOptions options = book_options();
    options.grip.angular = 1e9;  // the grip of this cell gives way to forces alone
    options.grip.tilt_uncertainty = options.grip.position_uncertainty = 0.0;  // and holds the peg as it is believed
    options.forces.angular_gain = 0;
    Insertion insertion = started(options, cell, Phase::Aim);
    const Eigen::Vector3d error = insertion.state().hole - tube;
    within += error.head<2>().norm() < 0.1 * mm && std::abs(error.z()) < 0.1 * mm;
    covered += error.head<2>().norm() < 2.45 * insertion.state().hole_std;
  }
  CHECK(within == all);
  INFO(covered << " of " << all << " within 2.45 standard deviations, where 95 % are in every direction");
  CHECK(covered >= 0.95 * all - 3 * std::sqrt(0.95 * 0.05 * all));
}

TEST_CASE(
    "wherever the tube stands on the robot, and however the tool holds the peg, the insertion finds the same hole") {
  InsertionOptions options = book_options();
  options.grip.angular = 1e9;
  options.forces.angular_gain = 0;
  const Eigen::Vector3d tube(5 * mm, -3 * mm, 0.1 * mm);
  Random random(3);
  for (int k = 0; k < 5; ++k) {
    InsertionFrames frames;
    frames.T_base_tube = to_pose((Vector6() << random.direction(), 2.5 * random.direction()).finished());
    frames.T_tool_peg = to_pose((Vector6() << 0.1 * random.direction(), 3.0 * random.direction()).finished());
    Cell cell(tube, 40 + static_cast<std::uint64_t>(k), frames);
    const Insertion insertion = started(options, cell, Phase::Aim, frames);
    CHECK((insertion.state().hole - tube).norm() < 0.1 * mm);
  }
  InsertionFrames stretched;
  stretched.T_tool_peg.linear() *= 2;
  CHECK_THROWS_WITH(Insertion(options, stretched), Catch::Contains("T_tool_peg"));
}

TEST_CASE("beyond the critical offset the least height leads the wrong way and the cusp does not") {
  InsertionOptions options = book_options();
  options.tilt = 7.5 * degree;
  options.entry = EntryAttitude::Upright;
  options.motion.roll_time = 12;
  const double offset = critical_offset(radii, options.tilt) + 1 * mm;
  const Eigen::Vector3d tube(offset * std::cos(0.7), offset * std::sin(0.7), 0);
  const auto moved = [&](Localisation by) {
    options.localisation = by;
    Cell cell(tube);
    Insertion insertion = started(options, cell, Phase::Slide);
    const Eigen::Vector3d begin = cell.pose().translation();
    for (int i = 0; i < 150; ++i) cell.obey(insertion.step(cell.read()));
    const Eigen::Vector2d way = (cell.pose().translation() - begin).head<2>();
    return way.normalized().dot(tube.head<2>().normalized());
  };
  CHECK(moved(Localisation::Cusp) > std::cos(15 * degree));
  CHECK(moved(Localisation::Minimum) < -std::cos(30 * degree));
}

TEST_CASE("a step allocates nothing, whatever it is at") {
#ifndef KR5_SANITIZED
  Cell cell({5 * mm, 2 * mm, 0});
  Insertion insertion(book_options());
  long most = 0;
  std::set<Phase> phases;
  for (int i = 0; i < 4000 && !insertion.finished(); ++i) {
    const robot::RobotReading reading = cell.read();
    const long before = allocations;
    const robot::RobotCommand command = insertion.step(reading);
    most = std::max(most, allocations - before);
    phases.insert(insertion.state().phase);
    cell.obey(command);
  }
  CHECK(insertion.finished());
  CHECK(phases.size() >= 9);
  CHECK(most == 0);
#endif
}

TEST_CASE("an insertion that cannot be is stated, not thrown") {
  InsertionOptions wide = book_options();
  wide.bodies.peg_radius = 9.8 * mm;
  Cell cell({0, 0, 0});
  Insertion insertion(wide);
  CHECK(insertion.finished());
  check_stopped(insertion, cell, Reason::PegTooWide);

  for (const auto field :
       {&InsertionForces::axial_gain, &InsertionForces::lateral_gain, &InsertionForces::angular_gain}) {
    InsertionOptions fast = book_options();
    fast.forces.*field *= 10;
    Insertion unstable(fast);
    check_stopped(unstable, cell, Reason::UnstableGain);
  }
}

TEST_CASE("without a tube nothing is touched, and that is said in the end") {
  Cell cell({0, 0, 0});
  cell.present = false;
  Insertion insertion(book_options());
  cell.run(insertion);
  check_stopped(insertion, cell, Reason::NoContact);
  CHECK(insertion.state().attempt == 3);
  CHECK(cell.pose().translation().z() > -20 * mm);  // it did not go on downwards
}

TEST_CASE("a sensor that says the same for ever is dead, and stops the arm in the air") {
  Cell cell({5 * mm, 0, 0});
  Insertion insertion = started(book_options(), cell, Phase::Approach);
  const robot::RobotReading frozen = cell.read();
  int cycles = 0;
  for (; !insertion.finished() && cycles < 100; ++cycles) insertion.step(frozen);
  CHECK(cycles * robot::usual_cycle <= 0.25 + 2 * robot::usual_cycle);
  CHECK(insertion.state().stopped_in == Phase::Approach);
  check_stopped(insertion, cell, Reason::SensorDead);
}

TEST_CASE("what is met on the way down stops the arm within the cycle") {
  Cell cell({5 * mm, 2 * mm, 0});
  Insertion insertion = started(book_options(), cell, Phase::Approach);
  robot::RobotReading reading = cell.read();
  reading.wrench[2] = 7;
  CHECK(insertion.step(reading).stop);
  check_stopped(insertion, cell, Reason::Obstructed);
}

TEST_CASE("a force that will be beyond its limit when the arm stands stops it before") {
  Cell cell({5 * mm, 2 * mm, 0});
  Insertion insertion = started(book_options(), cell, Phase::Roll);
  robot::RobotReading reading = cell.read();
  reading.wrench[2] += 50;
  CHECK_FALSE(insertion.step(reading).stop);
  reading.T_base_tool.translation().z() -= 0.5 * mm;  // in a cycle: 22 N more by then
  CHECK(insertion.step(reading).stop);
  check_stopped(insertion, cell, Reason::Force);
}

TEST_CASE("every violation stops within the cycle, from any phase, with its name") {
  const Eigen::Vector2d currents(0.5, 2.5);
  struct Case {
    Reason reason;
    void (*spoil)(robot::RobotReading&);
  };
  const Case cases[] = {
      {Reason::Force, [](robot::RobotReading& r) { r.wrench[0] = 90; }},
      {Reason::Torque, [](robot::RobotReading& r) { r.wrench[4] = 9; }},
      {Reason::SensorSaturated, [](robot::RobotReading& r) { r.status.saturated = true; }},
      {Reason::SensorDead, [](robot::RobotReading& r) { r.sensor[3] = std::numeric_limits<double>::quiet_NaN(); }},
      {Reason::SensorDead, [](robot::RobotReading& r) { r.wrench[3] = std::numeric_limits<double>::infinity(); }},
      {Reason::PegLost, [](robot::RobotReading& r) { r.status.gripped = false; }},
      {Reason::OutOfReach, [](robot::RobotReading& r) { r.status.reachable = false; }},
      {Reason::OutOfReach,
       [](robot::RobotReading& r) { r.T_base_tool.translation().x() = std::numeric_limits<double>::quiet_NaN(); }},
  };
  for (const Phase phase : {Phase::Tare, Phase::Approach, Phase::Touch, Phase::Roll, Phase::Locate, Phase::Aim,
                            Phase::Slide, Phase::Upright, Phase::Push})
    for (const Case& c : cases) {
      Cell cell({5 * mm, 2 * mm, 0});
      Insertion insertion = started(book_options(), cell, phase);
      robot::RobotReading reading = cell.read();
      c.spoil(reading);
      CHECK(insertion.step(reading).stop);
      CHECK(insertion.state().stopped_in == phase);
      check_stopped(insertion, cell, c.reason);
    }
  InsertionOptions options = book_options();
  options.limits.current = Eigen::Vector2d(1.0, 2.0);
  Cell cell({5 * mm, 2 * mm, 0});
  cell.currents = Eigen::Vector2d(0.5, 1.5);
  Insertion insertion = started(options, cell, Phase::Roll);
  robot::RobotReading reading = cell.read();
  reading.currents = currents;
  CHECK(insertion.step(reading).stop);
  check_stopped(insertion, cell, Reason::Current);
}

TEST_CASE("what takes too long is stopped") {
  InsertionOptions options = book_options();
  options.limits.time = 2.0;
  Cell cell({5 * mm, 2 * mm, 0});
  Insertion insertion(options);
  cell.run(insertion);
  CHECK(insertion.state().time == Approx(2.0).margin(0.02));
  check_stopped(insertion, cell, Reason::TimeOut);
}

TEST_CASE("what cannot be is still stated after beginning anew") {
  InsertionOptions wide = book_options();
  wide.bodies.peg_radius = 9.8 * mm;
  Cell cell({0, 0, 0});
  Insertion insertion(wide);
  insertion.restart();
  check_stopped(insertion, cell, Reason::PegTooWide);
}

TEST_CASE("an insertion begins anew after a stop") {
  Cell cell({5 * mm, 2 * mm, 0});
  Insertion insertion = started(book_options(), cell, Phase::Roll);
  robot::RobotReading reading = cell.read();
  reading.status.saturated = true;
  insertion.step(reading);
  REQUIRE(insertion.finished());
  insertion.restart();
  CHECK_FALSE(insertion.finished());
  CHECK(insertion.state().attempt == 1);
  Cell fresh({5 * mm, 2 * mm, 0});
  fresh.run(insertion, Phase::Aim);
  CHECK(insertion.state().phase == Phase::Aim);
}

TEST_CASE("options that are no numbers, or of the wrong sign, are refused by name") {
  const auto refused = [](const char* field, auto spoil) {
    InsertionOptions options = book_options();
    spoil(options);
    CHECK_THROWS_AS(Insertion(options), InvalidArgument);
    CHECK_THROWS_WITH(Insertion(options), Catch::Contains(field));
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  refused("tilt", [](auto& o) { o.tilt = 0; });
  refused("tilt", [](auto& o) { o.tilt = 2; });
  refused("peg_radius", [](auto& o) { o.bodies.peg_radius = -1; });
  refused("cycle", [](auto& o) { o.cycle = 0; });
  refused("cutoff", [](auto& o) { o.cutoff = 50; });
  refused("delay", [](auto& o) { o.delay = -1; });
  refused("hole", [=](auto& o) { o.hole = Eigen::Vector3d(nan, 0, 0); });
  refused("forces.roll", [=](auto& o) { o.forces.roll = nan; });
  refused("forces.lean", [](auto& o) { o.forces.lean = -1; });
  refused("motion.depth", [=](auto& o) { o.motion.depth = nan; });
  refused("motion.roll_time", [](auto& o) { o.motion.roll_time = 0; });
  refused("grip.axial", [](auto& o) { o.grip.axial = -1; });
  refused("limits.attempts", [](auto& o) { o.limits.attempts = 0; });
  refused("limits.time", [](auto& o) { o.limits.time = -1; });
  for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
    refused("forces.lean", [=](auto& o) { o.forces.lean = bad; });
    refused("motion.spiral_pitch", [=](auto& o) { o.motion.spiral_pitch = bad; });
    refused("motion.contact_speed", [=](auto& o) { o.motion.contact_speed = bad; });
    refused("motion.upright_speed", [=](auto& o) { o.motion.upright_speed = bad; });
    refused("motion.turning", [=](auto& o) { o.motion.turning = bad; });
    refused("limits.time", [=](auto& o) { o.limits.time = bad; });
    if (!(bad > 0)) refused("grip.angular", [=](auto& o) { o.grip.angular = bad; });
  }
  refused("limits.force", [](auto& o) { o.limits.force = 3; });
  refused("forces.obstacle", [](auto& o) { o.limits.force = 7; });
  refused("limits.halting", [](auto& o) { o.limits.halting = -1; });
  refused("motion.braking", [](auto& o) { o.motion.braking = 0; });
  refused("force", [](auto& o) { o.limits.force = 0; });
  refused("current", [](auto& o) { o.limits.current = Eigen::VectorXd::Zero(6); });
}

}  // namespace insertion_test
