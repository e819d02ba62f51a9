#include <kr5/job/tool_path.hpp>

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/robot/quintic_profile.hpp>

#include "fake_cell.hpp"

namespace tool_path_test {

using namespace kr5;
using namespace kr5::job;

constexpr double cycle = 0.012, rounding = 1e-6;

Pose drawn_pose(Random& random) {
  return Eigen::Translation3d(0.3 * random.direction()) * Eigen::AngleAxisd(random.uniform(0, 3), random.direction()) *
         Pose::Identity();
}

/// The greatest speeds and accelerations that a sequence of poses shows.
struct Motion {
  double speed = 0.0, acceleration = 0.0, turning_speed = 0.0, turning_acceleration = 0.0;
  void note(const Pose& T) {
    const Eigen::Vector3d v = (T.translation() - last_.translation()) / cycle;
    const Eigen::Vector3d w = last_.linear() * log_rotation(last_.linear().transpose() * T.linear()) / cycle;
    if (seen_ > 0) {
      speed = std::max(speed, v.norm());
      turning_speed = std::max(turning_speed, w.norm());
      acceleration = std::max(acceleration, (v - v_).norm() / cycle);
      turning_acceleration = std::max(turning_acceleration, (w - w_).norm() / cycle);
      v_ = v;
      w_ = w;
    }
    last_ = T;
    ++seen_;
  }

 private:
  Pose last_ = Pose::Identity();
  Eigen::Vector3d v_ = Eigen::Vector3d::Zero(), w_ = Eigen::Vector3d::Zero();
  int seen_ = 0;
};

void check_limits(const Motion& m, const PathLimits& limits) {
  CHECK(m.speed <= limits.speed * (1 + rounding));
  CHECK(m.acceleration <= limits.acceleration * (1 + rounding) + rounding);
  CHECK(m.turning_speed <= limits.turning_speed * (1 + rounding));
  CHECK(m.turning_acceleration <= limits.turning_acceleration * (1 + rounding) + rounding);
}

TEST_CASE("a path goes through its poses, within its limits, also where it brakes") {
  Random random(3);
  for (int run = 0; run < 200; ++run) {
    const PathLimits limits{random.uniform(0.05, 1), random.uniform(0.2, 5), random.uniform(0.2, 3),
                            random.uniform(1, 10)};
    ToolPath path(limits, cycle);
    const Pose begin = drawn_pose(random), via = drawn_pose(random), end = drawn_pose(random);
    path.start(begin);
    path.add(via);
    path.add(end);
    const int braking_from = run % 2 == 0 ? random.integer(200) : 1000000;
    Motion motion;
    motion.note(begin);
    double nearest = HUGE_VAL;
    int steps = 0;
    while (!path.standing() && steps < 100000) {
      motion.note(++steps > braking_from ? path.brake() : path.step(Eigen::Vector3d::Zero()));
      nearest = std::min(nearest, (path.pose().translation() - via.translation()).norm());
    }
    REQUIRE(path.standing());
    motion.note(path.step(Eigen::Vector3d::Zero()));
    check_limits(motion, limits);
    if (steps <= braking_from) {
      CHECK(nearest < 1e-12);
      CHECK(path.pose().isApprox(end));
    }
  }
}

TEST_CASE("a careful way goes at one speed, and ends where something is met") {
  const PathLimits limits;
  const double length = 0.08;
  for (const bool meets : {false, true}) {
    ToolPath path(limits, cycle);
    path.start(Pose::Identity());
    path.add(Pose(Eigen::Translation3d(0, 0, -length)), Way::Careful);
    double fastest = 0.0, met_at = 0.0;
    int steady = 0, cycles = 0;
    for (; !path.standing() && cycles < 10000; ++cycles) {
      const double before = path.pose().translation().z();
      const bool presses = meets && before < -0.05;
      if (presses && met_at == 0.0) met_at = before;
      path.step(presses ? Eigen::Vector3d(6, 0, 6) : Eigen::Vector3d(0, 0, 0));
      const double speed = (before - path.pose().translation().z()) / cycle;
      fastest = std::max(fastest, speed);
      steady += std::abs(speed - limits.careful_speed) < 0.05 * limits.careful_speed;
    }
    CHECK(path.obstructed() == meets);
    CHECK_FALSE(path.touched());
    CHECK(fastest <= limits.careful_speed * (1 + rounding));
    CHECK(steady > 0.4 * cycles);
    if (meets)
      CHECK(met_at - path.pose().translation().z() < 2e-3);
    else
      CHECK(path.pose().translation().z() == Approx(-length));
  }
}

TEST_CASE("a guarded way ends where something is touched, a free one does not") {
  for (const Way way : {Way::Guarded, Way::Slow}) {
    ToolPath path({}, cycle);
    path.start(Pose::Identity());
    path.add(Pose(Eigen::Translation3d(0, 0, -0.1)), way);
    const Eigen::Vector3d offset(1, 2, 5);  // of a sensor that nothing touches
    double stood = 0.0;
    for (int k = 0; k < 5000 && !path.standing(); ++k) {
      const double z = path.pose().translation().z();
      const Eigen::Vector3d push(0, 0, z < -0.05 ? 5.0 : 0.0);
      stood = path.step(offset + push).translation().z();
    }
    CHECK(path.touched() == (way == Way::Guarded));
    if (way == Way::Guarded) {
      CHECK(stood < -0.05);
      CHECK(stood > -0.05 - 2e-3);
    } else {
      CHECK(stood == Approx(-0.1));
    }
  }
}

TEST_CASE("a push along a guarded way is no touch") {
  ToolPath path({}, cycle);
  path.start(Pose::Identity());
  path.add(Pose(Eigen::Translation3d(0, 0, -0.01)), Way::Guarded);
  for (int k = 0; k < 1000 && !path.standing(); ++k) path.step(Eigen::Vector3d(0, 0, k > 5 ? -50.0 : 0.0));
  CHECK_FALSE(path.touched());
  CHECK(path.pose().translation().z() == Approx(-0.01));
}

TEST_CASE("the inertia of an arm that still brakes is no touch, what comes later is one") {
  const PathLimits limits;
  for (const bool touches : {false, true}) {
    ToolPath path(limits, cycle);
    path.start(Pose::Identity());
    path.add(Pose(Eigen::Translation3d(0, 0, -0.01)), Way::Guarded);
    for (int k = 0; !path.standing(); ++k) {
      const double time = k * cycle;
      const double braking = -2 * limits.touch_force * std::max(1.0 - time / limits.settling, 0.0);
      const double touch = touches && time > 0.3 ? 2 * limits.touch_force : 0.0;
      path.step({0, 0, braking + touch});
    }
    CHECK(path.touched() == touches);
  }
}

TEST_CASE("more poses than a path holds are told") {
  ToolPath path({}, cycle);
  path.start(Pose::Identity());
  for (std::size_t k = 0; k < ToolPath::capacity; ++k) path.add(Pose(Eigen::Translation3d(0.01 * double(k), 0, 0)));
  CHECK(path.complete());
  path.add(Pose::Identity());
  CHECK_FALSE(path.complete());
}

TEST_CASE("limits of a path that are none are named") {
  CHECK_THROWS_WITH(ToolPath({.speed = 0.0}, cycle), "speed must lie between 0 and 10 m/s");
  CHECK_THROWS_WITH(ToolPath({.acceleration = -1.0}, cycle), "acceleration must lie between 0 and 1000 m/s^2");
  CHECK_THROWS_WITH(ToolPath({.speed = 0.1, .contact_speed = 0.2}, cycle),
                    "contact_speed must lie between 0 and speed [m/s]");
  CHECK_THROWS_WITH(ToolPath({}, 0.0), "cycle: must be positive [s]");
}

/// A way of an arm, and the poses between which it is.
struct DrawnWay {
  explicit DrawnWay(Random& random) {
    way.begin = way.end = way.bow = robot::JointVector::Zero(6);
    for (int i = 0; i < 6; ++i) {
      way.begin[i] = random.uniform(-1, 1);
      way.end[i] = random.uniform(-1, 1);
      way.bow[i] = random.uniform(-0.2, 0.2);
    }
    way.duration = random.uniform(0.5, 3);
    from = tool(way.begin);
    to = tool(way.end);
  }
  Pose tool(const robot::JointVector& q) const { return arm.arm.flange(q) * arm.T_flange_tool; }

  robot::SensorModel arm = test::FakeCell::arm();
  JointWay way;
  Pose from, to;
};

TEST_CASE("the tool goes as the joints do, in the time of their way, and stands before it until it is known") {
  Random random(11);
  for (int run = 0; run < 50; ++run) {
    const DrawnWay drawn(random);
    ToolPath path({}, cycle, drawn.arm);
    path.start(drawn.from);
    path.add(drawn.to, Way::Joint);
    path.add(drawn.to * Eigen::Translation3d(0, 0, 0.01));
    for (int k = 0; k < 5; ++k) CHECK(path.step({}).isApprox(drawn.from));
    CHECK((path.waiting() && !path.standing()));
    REQUIRE(path.set_joint_way(drawn.way));
    CHECK_FALSE(path.waiting());
    CHECK_FALSE(path.set_joint_way(drawn.way));  // it is known
    const int cycles = static_cast<int>(std::ceil(drawn.way.duration / cycle));
    for (int k = 1; k <= cycles; ++k) {
      const double share = robot::quintic_profile(static_cast<double>(k) / cycles).x;
      CHECK(path.step({}).isApprox(drawn.tool(drawn.way.at(share)), 1e-9));
    }
    CHECK(path.pose().isApprox(drawn.to));
    CHECK_FALSE(path.standing());
    for (int k = 0; k < 400 && !path.standing(); ++k) path.step({});
    CHECK(path.pose().isApprox(drawn.to * Eigen::Translation3d(0, 0, 0.01)));
  }
}

TEST_CASE("a way of joints that brakes stops on it, and one that waits stands at once") {
  Random random(12);
  const DrawnWay drawn(random);
  ToolPath path({}, cycle, drawn.arm);
  path.start(drawn.from);
  path.add(drawn.to, Way::Joint);
  path.step({});
  path.brake();
  CHECK(path.standing());
  path.start(drawn.from);
  path.add(drawn.to, Way::Joint);
  REQUIRE(path.set_joint_way(drawn.way));
  const int middle = static_cast<int>(0.4 * drawn.way.duration / cycle);
  for (int k = 0; k < middle; ++k) path.step({});
  int cycles = 0;
  while (!path.standing() && ++cycles < 1000) path.brake();
  CHECK((cycles > 3 && cycles < 1000));
  const Pose end = path.pose();
  double least = HUGE_VAL;
  for (double share = 0; share <= 1; share += 1e-3)
    least = std::min(least, (drawn.tool(drawn.way.at(share)).translation() - end.translation()).norm());
  CHECK(least < 1e-3);
}

TEST_CASE("a way that is not between the poses of the path, or none of this arm, is refused") {
  Random random(13);
  const DrawnWay drawn(random);
  ToolPath path({}, cycle, drawn.arm);
  path.start(drawn.from);
  CHECK_FALSE(path.set_joint_way(drawn.way));  // nobody waits for it
  path.add(drawn.to, Way::Joint);
  JointWay other = drawn.way;
  other.begin[2] += 1e-3;
  CHECK_FALSE(path.set_joint_way(other));
  other = drawn.way;
  other.bow = robot::JointVector::Zero(5);
  CHECK_FALSE(path.set_joint_way(other));
  other = drawn.way;
  other.duration = NAN;
  CHECK_FALSE(path.set_joint_way(other));
  CHECK(path.waiting());
  CHECK(path.set_joint_way(drawn.way));
}

}  // namespace tool_path_test
