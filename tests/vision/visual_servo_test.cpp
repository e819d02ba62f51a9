#include <catch2/catch.hpp>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/robot/loopback.hpp>
#include <kr5/vision/visual_servo.hpp>

#include "support/servo_world.hpp"
#include "support/trials.hpp"

namespace visual_servo_test {

using namespace kr5;
using namespace kr5::vision;
using namespace kr5::test;
using Eigen::Vector3d;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// What a perfect camera sees of a target with four points.
TargetObservation exact(const Pose& T_camera_target) {
  TargetObservation observation{.seen = true, .T_camera_target = T_camera_target};
  observation.points = square_corners(tag_side);
  observation.rays = (T_camera_target * observation.points).colwise().hnormalized();
  return observation;
}

TargetObservation unseen(const std::string& why) { return {.message = why}; }

Pose exact_goal() { return tag_pose(over_tube()); }
Pose exact_start(Random& random) { return away_from(exact_goal(), random, 0.1, 20 * degree); }

/// A robot that does at once what it is told, with perfect observations; `visit` gets each pose and step.
template <class Visit>
ServoStep ideal_run(const Pose& start, const VisualServoOptions& o, const Visit& visit) {
  VisualServo servo(exact_goal(), o);
  Pose T = start;
  for (double time = 0;; time += o.cycle) {
    const ServoStep step = servo.step(exact(T), time);
    visit(T, step);
    if (step.state != ServoState::Moving) return step;
    T = moved(step.twist, o.cycle).inverse() * T;
  }
}

/// The first step with this observation.
ServoStep first(const TargetObservation& observation, const VisualServoOptions& o = {}) {
  VisualServo servo(exact_goal(), o);
  return servo.step(observation, 0.0);
}

struct Kind {
  bool hole;
  ServoFeature by;
};

ServoEnd simulated(const Kind& kind, int seed) {
  Random random(static_cast<std::uint64_t>(seed));
  const Pinhole camera = cell_camera();
  const CellErrors errors(random, camera);
  Pose start;
  do start = away_from(over_tube(), random, 0.1, 20 * degree, seed % 2 == 1);
  while (!in_view(start, camera, kind.hole ? 1.2 * bore : 0.9 * tag_side));
  VisualServoOptions o{.feature = kind.by};
  o.turn_free = kind.hole;
  return approach(over_tube(), start, o, errors, [&](const Pose& T, int cycle) {
    const int image = 1000 * seed + cycle;
    return kind.hole ? see_hole(T, camera, errors, image) : see_tag(T, camera, errors, image);
  });
}

}  // namespace

TEST_CASE("from up to 100 mm and 20 degrees away the camera ends over the tube, on a tag and on the bare bore",
          "[statistics]") {
#ifdef KR5_SANITIZED  // the other two run the same code
  const Kind kind = GENERATE(Kind{false, ServoFeature::Position}, Kind{true, ServoFeature::Image});
#else
  const Kind kind = GENERATE(Kind{false, ServoFeature::Position}, Kind{false, ServoFeature::Image},
                             Kind{true, ServoFeature::Position}, Kind{true, ServoFeature::Image});
#endif
  for (int seed = 1; seed <= trials(100, 1); ++seed) {
    const ServoEnd end = simulated(kind, seed);
    INFO((kind.hole ? "bore" : "tag") << " by " << name_of(kind.by) << ", seed " << seed << ": " << end.last.reason
                                      << "; truly " << 1e3 * end.position << " mm, " << end.angle / degree << " deg");
    CHECK(end.over_tube());
  }
}

TEST_CASE("with perfect observations both laws reach the goal from every start, within the limits of speed") {
  const ServoFeature by = GENERATE(ServoFeature::Position, ServoFeature::Image);
  Random random(7);
  for (int i = 0; i < 40; ++i) {
    VisualServoOptions o{.feature = by};
    o.latency = 0, o.tolerance_position = 1e-6, o.tolerance_angle = 1e-5;
    o.max_speed = 0.05, o.max_turn_rate = 0.1;
    const Pose start = exact_start(random);
    Pose last;
    const ServoStep end = ideal_run(start, o, [&](const Pose& T, const ServoStep& step) {
      CHECK(step.twist.head<3>().norm() <= 0.05 * (1 + 1e-12));
      CHECK(step.twist.tail<3>().norm() <= 0.1 * (1 + 1e-12));
      last = T;
    });
    INFO(i << ": " << end.reason);
    CHECK(end.state == ServoState::Arrived);
    CHECK(end.twist.isZero(0));
    const Vector6 error = to_vector(exact_goal() * last.inverse());
    CHECK(error.head<3>().norm() < 1e-6);
    CHECK(error.tail<3>().norm() < 1e-5);
  }
}

TEST_CASE("by position the target crosses the image on a straight line, by image its points do") {
  Random random(11);
  const Pose start = exact_start(random);
  const auto off_line = [](const Eigen::Vector2d& p, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
    const Eigen::Vector2d along = (b - a).normalized(), d = p - a;
    return std::abs(d.x() * along.y() - d.y() * along.x());
  };
  VisualServoOptions o;
  o.latency = 0, o.cycle = 0.005, o.gain_near = 1.0;
  const Eigen::Vector2d from = start.translation().hnormalized(), to = exact_goal().translation().hnormalized();
  double worst = 0;
  ideal_run(start, o, [&](const Pose& T, const ServoStep&) {
    worst = std::max(worst, off_line(T.translation().hnormalized(), from, to));
  });
  CHECK(worst < 0.01 * (from - to).norm());
  o.feature = ServoFeature::Image;
  const Eigen::Matrix2Xd first = exact(start).rays, last = exact(exact_goal()).rays;
  double most = 0;
  ideal_run(start, o, [&](const Pose& T, const ServoStep&) {
    for (int k = 0; k < 4; ++k) most = std::max(most, off_line(exact(T).rays.col(k), first.col(k), last.col(k)));
  });
  CHECK(most < 0.05 * (first - last).colwise().norm().minCoeff());
}

TEST_CASE("over a loopback robot, by readings and commands alone, the camera reaches its goal") {
  const ServoFeature by = GENERATE(ServoFeature::Position, ServoFeature::Image);
  const bool with_arm = GENERATE(false, true);
  robot::SensorModel model;
  model.T_flange_tool = Pose(Eigen::Translation3d(0.0, 0.0, 0.19));
  if (with_arm)  // six axes with a wrist
    model.arm.joints = {{.b = 0.4, .a = 0.18, .alpha = M_PI_2},
                        {.theta_offset = M_PI_2, .a = 0.6, .alpha = M_PI},
                        {.a = 0.12, .alpha = M_PI_2},
                        {.b = 0.62, .theta_offset = M_PI, .alpha = M_PI_2},
                        {.theta_offset = -M_PI_2, .alpha = M_PI_2},
                        {.b = 0.115}};
  const Pose T_tool_camera = to_pose((Vector6() << 0.05, -0.02, -0.1, 0.1, -0.2, 0.4).finished());
  const VisualServoOptions o{.feature = by};
  Random random(21);
  for (int k = 0; k < 8; ++k) {
    robot::LoopbackRobot robot({.cycle = o.cycle,
                                .delay = o.cycle + o.latency,
                                .limits = {.translation = 0.02, .rotation = 0.1},
                                .joint_noise = 1e-5,
                                .position_noise = 1e-4,
                                .rotation_noise = 1e-4,
                                .seed = 70 + static_cast<std::uint64_t>(k)},
                               model);
    if (with_arm) robot.place(Eigen::Matrix<double, 6, 1>(0.2, 0.3, -2.3, 0.4, -1.0, 0.3));
    const Pose T_base_target = robot.T_base_tool() * T_tool_camera * exact_start(random);
    const auto seen = [&](const Pose& T_base_tool) { return (T_base_tool * T_tool_camera).inverse() * T_base_target; };
    VisualServo servo(exact_goal(), o);
    ServoStep step;
    for (int i = 0; i < 200 && step.state == ServoState::Moving; ++i) {
      const robot::RobotReading reading = robot.read();
      REQUIRE(reading.status.reachable);
      step = servo.step(exact(seen(robot.T_base_tool())), reading.time);
      robot.send(servo_command(step, T_tool_camera, o.cycle));
    }
    CAPTURE(k, name_of(by), with_arm, step.reason);
    CHECK(step.state == ServoState::Arrived);
    for (int i = 0; i < 5; ++i) robot.send({});
    const Vector6 error = to_vector(exact_goal() * seen(robot.T_base_tool()).inverse());
    CHECK(error.head<3>().norm() < 2 * o.tolerance_position);
    CHECK(error.tail<3>().norm() < 2 * o.tolerance_angle);
  }
}

TEST_CASE("a step that moves nothing commands nothing, and a twist moves the camera and not the tool") {
  ServoStep step;
  CHECK(servo_command(step, Pose::Identity(), 0.1).space == robot::CommandSpace::None);
  step.twist << 0.0, 0.0, 0.0, 0.0, 0.0, 0.5;
  const Pose T_tool_camera(Eigen::Translation3d(0.1, 0.0, 0.0));
  const Pose moved_tool = robot::commanded_tool(servo_command(step, T_tool_camera, 0.1), Pose::Identity());
  CHECK((moved_tool * T_tool_camera).translation().isApprox(T_tool_camera.translation(), 1e-12));
  CHECK(moved_tool.translation().norm() > 4e-3);
  CHECK(log_rotation(moved_tool.linear()).isApprox(Vector3d(0, 0, 0.05), 1e-9));
}

TEST_CASE("a free turn is left alone and does not count") {
  const ServoFeature by = GENERATE(ServoFeature::Position, ServoFeature::Image);
  VisualServoOptions o{.feature = by};
  o.turn_free = true;
  const Pose turned = exact_goal() * Eigen::AngleAxisd(2.5, Vector3d::UnitZ());
  CHECK(first(exact(turned), o).error_angle < 1e-9);
  CHECK(first(exact(turned), o).twist.norm() < 1e-9);
  Random random(3);
  const Pose start = exact_start(random) * Eigen::AngleAxisd(-1.7, Vector3d::UnitZ());
  Pose last;
  const ServoStep end = ideal_run(start, o, [&](const Pose& T, const ServoStep&) { last = T; });
  CHECK(end.state == ServoState::Arrived);
  CHECK((last.translation() - exact_goal().translation()).norm() < o.tolerance_position);
  CHECK(last.linear().col(2).cross(exact_goal().linear().col(2)).norm() < o.tolerance_angle);
  const Pose back = exact_goal().inverse() * last;  // the turn it began with is the turn it ends with
  CHECK(std::abs(std::atan2(back.linear()(1, 0), back.linear()(0, 0)) + 1.7) < 20 * degree);
}

TEST_CASE("a camera at its goal arrives after as many observations as it takes to be sure") {
  VisualServo servo(exact_goal(), {});
  for (int i = 0; i < 3; ++i) CHECK(servo.step(exact(exact_goal()), 0.1 * i).state == ServoState::Moving);
  CHECK(servo.step(exact(exact_goal()), 0.3).state == ServoState::Arrived);
  const ServoStep after = servo.step(unseen("gone"), 0.4);  // the end stays the end
  CHECK(after.state == ServoState::Arrived);
  CHECK(after.twist.isZero(0));
}

TEST_CASE("observations that scatter more than the tolerance do not make an arrival") {
  Random random(5);
  VisualServo servo(exact_goal(), {});
  ServoStep step;
  for (int i = 0; i < 200 && step.state == ServoState::Moving; ++i) {
    Vector6 noise;
    noise << 1e-3 * Vector3d(random.normal_vector(3)), 5e-3 * Vector3d(random.normal_vector(3));
    step = servo.step(exact(exact_goal() * to_pose(noise)), 0.1 * i);
  }
  CHECK(step.state == ServoState::Stalled);
  CHECK_THAT(step.reason, Catch::Contains("scatter"));
}

TEST_CASE("a target that is hidden half way stops the camera, which goes on when it is seen again in time") {
  Random random(9);
  Pose T = exact_start(random);
  VisualServo servo(exact_goal(), {});
  double time = 0;
  const auto move = [&](const TargetObservation& observation) {
    const ServoStep step = servo.step(observation, time);
    T = moved(step.twist, 0.1).inverse() * T;
    time += 0.1;
    return step;
  };
  for (int i = 0; i < 5; ++i) CHECK(move(exact(T)).state == ServoState::Moving);
  for (int i = 0; i < 4; ++i) {
    const ServoStep step = move(unseen("something hides it"));
    CHECK(step.state == ServoState::Moving);
    CHECK(step.twist.isZero(0));
    CHECK_THAT(step.reason, Catch::Contains("something hides it"));
  }
  CHECK_FALSE(move(exact(T)).twist.isZero(0));
  ServoStep step;
  for (int i = 0; i < 5; ++i) step = move(unseen("something hides it"));
  CHECK(step.state == ServoState::Lost);
  CHECK(step.twist.isZero(0));
  CHECK_THAT(step.reason, Catch::Contains("was lost") && Catch::Contains("something hides it"));
}

TEST_CASE("a start that does not show the target ends with the reason, from images") {
  const Pinhole camera = cell_camera();
  Random random(1);
  const CellErrors errors(random, camera);
  Pose away = over_tube();
  away.translation().x() = 0.25;
  VisualServoOptions o;
  const auto tag = [&](const Pose& T, int k) { return see_tag(T, camera, errors, k); };
  const auto hole = [&](const Pose& T, int k) { return see_hole(T, camera, errors, k); };
  const ServoEnd of_tag = approach(over_tube(), away, o, errors, tag),
                 of_hole = approach(over_tube(), away, o, errors, hole);
  for (const ServoEnd& end : {of_tag, of_hole}) {
    INFO(end.last.reason);
    CHECK(end.last.state == ServoState::Lost);
    CHECK_THAT(end.last.reason, Catch::Contains("never seen"));
  }
  CHECK_THAT(of_hole.last.reason, Catch::Contains("circle"));
  const auto wrong = [&](const Pose& T, int k) { return see_hole(T, camera, errors, k, 1.2 * bore); };
  CHECK_THAT(approach(over_tube(), over_tube(), o, errors, wrong).last.reason, Catch::Contains("9.7"));
}

TEST_CASE("a mirrored tag is not followed, and is told") {
  const Pinhole camera = cell_camera();
  const PlacedTarget placed{tag_target(), tag_pose(over_tube())};
  const Image image = render(std::span(&placed, 1), camera, realistic(1));
  Image mirrored = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) mirrored.at(x, y) = image.view().at(image.width - 1 - x, y);
  const TargetObservation observation = observe_target(mirrored, tag_target(), camera);
  CHECK_FALSE(observation.seen);
  CHECK_THAT(observation.message, Catch::Contains("mirror"));
  CHECK(first(observation).twist.isZero(0));
}

TEST_CASE("a first observation too far away moves nothing") {
  Pose far = exact_goal();
  far.translation().z() += 0.4;
  CHECK(first(exact(far)).state == ServoState::TooFar);
  const Pose turned = exact_goal() * Eigen::AngleAxisd(1.0, Vector3d::UnitZ());
  CHECK(first(exact(turned)).state == ServoState::TooFar);
  CHECK(first(exact(turned)).twist.isZero(0));
}

TEST_CASE("a robot that takes the twist in a wrong frame is stopped before it has gone far") {
  Random random(2);
  Pose T = away_from(exact_goal(), random, 0.05, 5 * degree);
  const double before = to_vector(exact_goal() * T.inverse()).head<3>().norm();
  VisualServo servo(exact_goal(), {});
  ServoStep step;
  for (double time = 0; step.state == ServoState::Moving; time += 0.1) {
    step = servo.step(exact(T), time);
    T = moved(-step.twist, 0.1).inverse() * T;
  }
  INFO(step.reason);
  CHECK(step.state == ServoState::Diverged);
  CHECK_THAT(step.reason, Catch::Contains("hand-eye"));
  CHECK(to_vector(exact_goal() * T.inverse()).head<3>().norm() < 3 * before + 0.02);
}

TEST_CASE("a robot that does not move is told of") {
  Random random(2);
  const TargetObservation observation = exact(exact_start(random));
  VisualServo servo(exact_goal(), {});
  ServoStep step;
  double time = 0;
  for (; step.state == ServoState::Moving; time += 0.1) step = servo.step(observation, time);
  CHECK(step.state == ServoState::Stalled);
  CHECK_THAT(step.reason, Catch::Contains("follow"));
  CHECK(time < 5.0);
}

TEST_CASE("the time limit ends a run that is too slow") {
  Random random(2);
  VisualServoOptions slow;
  slow.max_speed = 1e-3, slow.time_limit = 3.0;
  const ServoStep end = ideal_run(exact_start(random), slow, [](const Pose&, const ServoStep&) {});
  CHECK(end.state == ServoState::TimedOut);
  CHECK_THAT(end.reason, Catch::Contains("time_limit"));
  slow.lost_after = 100.0;
  VisualServo blind(exact_goal(), slow);
  ServoStep step;
  for (double time = 0; step.state == ServoState::Moving; time += 0.1) step = blind.step(unseen("dark"), time);
  CHECK(step.state == ServoState::TimedOut);
}

TEST_CASE("observations, times and options that make no sense are refused by name") {
  const Pose goal = exact_goal();
  const auto refused = [&](VisualServoOptions o, const std::string& field) {
    CHECK_THROWS_WITH(VisualServo(goal, o), Catch::Contains(field));
  };
  refused({.gain = 0.0}, "gain");
  refused({.gain = not_a_number}, "gain");
  refused({.gain_near = 3.0}, "gain_near");  // above 0.5 / 0.2 s
  refused({.latency = 0.5}, "gain_near");
  refused({.gain = 2.0, .gain_near = 1.0}, "gain_near");
  refused({.cycle = -0.1}, "cycle");
  refused({.max_speed = 0.0}, "max_speed");
  refused({.tolerance_angle = -1.0}, "tolerance_angle");
  refused({.settle = 1}, "settle");
  refused({.time_limit = not_a_number}, "time_limit");
  Pose broken = goal;
  broken.translation().z() = -0.2;
  CHECK_THROWS_WITH(VisualServo(broken), Catch::Contains("behind"));
  broken.translation().z() = not_a_number;
  CHECK_THROWS_AS(VisualServo(broken), InvalidArgument);

  VisualServo servo(goal, {.feature = ServoFeature::Image});
  servo.step(exact(goal), 1.0);
  CHECK_THROWS_WITH(servo.step(exact(goal), 1.0), Catch::Contains("time"));
  CHECK_THROWS_WITH(servo.step(exact(goal), not_a_number), Catch::Contains("time"));
  TargetObservation observation = exact(goal);
  observation.T_camera_target.translation().x() = not_a_number;
  CHECK_THROWS_WITH(servo.step(observation, 2.0), Catch::Contains("T_camera_target"));
  observation = exact(goal);
  observation.rays(0, 1) = not_a_number;
  CHECK_THROWS_WITH(servo.step(observation, 2.0), Catch::Contains("finite"));
  observation = exact(goal);
  observation.rays.conservativeResize(2, 3);
  CHECK_THROWS_WITH(servo.step(observation, 2.0), Catch::Contains("ray for each"));
  observation = exact(goal);
  observation.points *= 100.0;
  const Pose tilted = goal * Eigen::AngleAxisd(0.8, Vector3d::UnitX());
  CHECK_THROWS_WITH(VisualServo(tilted, {.feature = ServoFeature::Image}).step(observation, 2.0),
                    Catch::Contains("goal"));
  CHECK(servo.step(exact(goal), 2.0).state == ServoState::Moving);  // what was refused has changed nothing
}

}  // namespace visual_servo_test
