#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/picking/placing.hpp>

namespace placing_test {

using namespace kr5;
using namespace kr5::picking;
using Catch::Matchers::Contains;
using Eigen::AngleAxisd;
using Eigen::Translation3d;
using Eigen::Vector3d;

namespace {

constexpr double right_angle = std::numbers::pi / 2;

Pellet a_pellet(Random& random) {
  Pellet pellet;
  pellet.frame = exp_rotation(random.direction() * random.uniform(0, 3));
  pellet.axis = pellet.frame.col(2);
  pellet.centre = Vector3d(0.6, -0.2, 0.1) + 0.1 * random.direction();
  pellet.radius = 0.008, pellet.height = random.uniform(0.014, 0.017);
  const Eigen::Matrix<double, 7, 7> A = Eigen::Matrix<double, 7, 7>::NullaryExpr([&] { return random.normal(2e-4); });
  pellet.covariance = A * A.transpose();
  return pellet;
}

/// Taken by the side at a place off the centre, X along the axis.
Pose side_grasp(const Pellet& pellet, double along, double lean) {
  const Pose T_base_pellet = pellet_pose(pellet).T;
  Eigen::Matrix3d axes;  // X along the axis, Z to the axis
  axes << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  Pose T_pellet_tool(Translation3d(pellet.radius, 0, along));
  T_pellet_tool.linear() = axes;
  return T_base_pellet * T_pellet_tool * AngleAxisd(lean, Vector3d::UnitY());
}

/// Taken by its end.
Pose end_grasp(const Pellet& pellet, double turn) {
  return pellet_pose(pellet).T * Translation3d(0, 0, pellet.height / 2) * AngleAxisd(turn, Vector3d::UnitZ()) *
         AngleAxisd(std::numbers::pi, Vector3d::UnitX());
}

Pose a_seat() { return Translation3d(0.3, 0.4, 0.02) * AngleAxisd(0.3, Vector3d::UnitZ()) * Pose::Identity(); }

/// Lowest point of a cylinder over a seat.
double height_over(const Pose& T_base_seat, const Pose& T_base_pellet, double radius, double height) {
  const Pose T = T_base_seat.inverse() * T_base_pellet;
  const double up = std::abs(T.linear()(2, 2));
  return T.translation().z() - height / 2 * up - radius * std::sqrt(std::max(0.0, 1 - up * up));
}

}  // namespace

TEST_CASE("a cylinder held by its side is placed lying, its axis along the seat, its centre over it") {
  Random random(1);
  for (int trial = 0; trial < 20; ++trial) {
    const Pellet pellet = a_pellet(random);
    const HeldPellet held = hold(pellet, side_grasp(pellet, random.uniform(-0.003, 0.003), 0.0));
    const Placement placed = place(held, a_seat(), PelletPosture::Lying, {.release_gap = 0.001});
    REQUIRE(placed.possible);
    CHECK(placed.tilt < 1e-6);
    const Pose T_seat_pellet = a_seat().inverse() * placed.T_base_pellet.T;
    CHECK((T_seat_pellet.translation() - Vector3d(0, 0, pellet.radius + 0.001)).norm() < 1e-12);
    CHECK(std::abs(std::abs(T_seat_pellet.linear()(0, 2)) - 1) < 1e-12);
    CHECK(height_over(a_seat(), placed.T_base_pellet.T, pellet.radius, pellet.height) == Approx(0.001).margin(1e-7));
    // The tool carries it there: the grasp is rigid.
    CHECK((placed.T_base_tool * held.T_tool_pellet.T).isApprox(placed.T_base_pellet.T, 1e-12));
    CHECK(placed.T_base_tool.linear().col(0).dot(a_seat().linear().col(0)) == Approx(1.0));
    CHECK(((placed.T_base_approach.translation() - placed.T_base_tool.translation()) - Vector3d(0, 0, 0.05)).norm() <
          1e-12);
  }
}

TEST_CASE("a cylinder held by its end is placed standing, the tool straight down, X as the seat's") {
  Random random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const Pellet pellet = a_pellet(random);
    const HeldPellet held = hold(pellet, end_grasp(pellet, random.uniform(0, 6)));
    const Placement placed = place(held, a_seat(), PelletPosture::Standing, {.release_gap = 0.0});
    REQUIRE(placed.possible);
    CHECK(placed.tilt < 1e-6);
    CHECK(height_over(a_seat(), placed.T_base_pellet.T, pellet.radius, pellet.height) == Approx(0.0).margin(1e-7));
    CHECK(placed.T_base_tool.linear().col(0).dot(a_seat().linear().col(0)) == Approx(1.0));
    const Vector3d tip = a_seat().inverse() * placed.T_base_tool.translation();
    CHECK((tip - Vector3d(0, 0, pellet.height)).norm() < 1e-9);  // on the upper end
  }
}

TEST_CASE("the tilt of a placement is the least of all turns about the axis, and too much is said") {
  Random random(3);
  for (int trial = 0; trial < 10; ++trial) {
    const Pellet pellet = a_pellet(random);
    const HeldPellet held = hold(pellet, side_grasp(pellet, 0.0, random.uniform(-0.8, 0.8)));
    for (const auto posture : {PelletPosture::Standing, PelletPosture::Lying}) {
      const Placement placed = place(held, a_seat(), posture, {.max_tilt = 3.1});
      const Vector3d axis = placed.T_base_pellet.T.linear().col(2);
      double least = 10;
      for (int k = 0; k < 3600; ++k)
        for (const bool over : {false, true}) {
          const Vector3d across = axis.unitOrthogonal();
          const Eigen::Matrix3d turned = AngleAxisd(k * right_angle / 900, axis) *
                                         AngleAxisd(over ? std::numbers::pi : 0.0, across) *
                                         placed.T_base_tool.linear();
          least = std::min(least, std::acos(std::clamp(-turned(2, 2), -1.0, 1.0)));
        }
      CHECK(placed.tilt == Approx(least).margin(1e-3));
    }
  }
  const Pellet pellet = a_pellet(random);
  const Placement standing = place(hold(pellet, side_grasp(pellet, 0, 0)), a_seat(), PelletPosture::Standing);
  CHECK_FALSE(standing.possible);
  CHECK_THAT(standing.message, Contains("90 deg from straight down") && Contains("turn it between two fingers"));
}

TEST_CASE("the covariance of a placed cylinder is that of drawn ones") {
  Random random(4);
  const Pellet pellet = a_pellet(random);
  const Pose grasp = side_grasp(pellet, 0.002, 0.2);
  Matrix6 grip = Matrix6::Zero();
  grip.diagonal() << 4e-8, 4e-8, 1e-8, 1e-6, 1e-6, 0;
  const HeldPellet held = hold(pellet, grasp, grip);
  const Placement placed = place(held, a_seat(), PelletPosture::Lying);
  const Eigen::Matrix<double, 5, 5> root =
      Eigen::Matrix<double, 5, 5>(pellet.covariance.topLeftCorner<5, 5>()).llt().matrixL();
  Matrix6 sum = Matrix6::Zero();
  constexpr int draws = 20000;
  for (int k = 0; k < draws; ++k) {
    Vector6 error = Vector6::Zero(), slip = Vector6::Zero();
    error.head<5>() = root * random.normal_vector(5);
    for (int i = 0; i < 5; ++i) slip[i] = random.normal(std::sqrt(grip(i, i)));
    const Pose T_base_true = pellet_pose(pellet).T * to_pose(error) * to_pose(slip);
    const Pose T_placed_true = placed.T_base_tool * grasp.inverse() * T_base_true;
    const Vector6 d = pose_difference(placed.T_base_pellet.T, T_placed_true);
    sum += d * d.transpose();
  }
  const Matrix6 drawn = sum / draws;
  const Eigen::Matrix<double, 5, 5> stated = placed.T_base_pellet.covariance.topLeftCorner<5, 5>();
  const Eigen::Matrix<double, 5, 5> ratio = stated.llt().solve(drawn.topLeftCorner<5, 5>());
  const Eigen::VectorXcd eigen = ratio.eigenvalues();
  CHECK(eigen.real().minCoeff() > 0.95);
  CHECK(eigen.real().maxCoeff() < 1.05);
  CHECK(placed.T_base_pellet.covariance(5, 5) == 0.0);
}

TEST_CASE("seats of a stack keep the clearance, in every direction, and stand in the order asked for") {
  for (const auto posture : {PelletPosture::Standing, PelletPosture::Lying}) {
    const StackOptions options{.posture = posture, .rows = 3, .columns = 4, .layers = 2, .clearance = 0.001};
    const auto seats = plan_stack(a_seat(), options);
    REQUIRE(seats.size() == (posture == PelletPosture::Standing ? 24U : 12U + 8U));
    double least = 1;
    for (const auto& a : seats)
      for (const auto& b : seats) {
        if (&a == &b) continue;
        const Vector3d d = a_seat().linear().transpose() * (a.T_base_seat.translation() - b.T_base_seat.translation());
        if (posture == PelletPosture::Standing) {
          const double across = d.head<2>().norm() - 2 * options.radius, along = std::abs(d.z()) - options.height;
          least = std::min(least, std::max(across, along));
        } else {
          const double across = d.tail<2>().norm() - 2 * options.radius, along = std::abs(d.x()) - options.height;
          least = std::min(least, std::max(across, along));
        }
      }
    CHECK(least == Approx(0.0).margin(1e-12));  // a layer rests on the one below, touching
    CHECK(seats[0].layer == 0);
    CHECK(seats.back().layer == 1);
    CHECK(seats[1].column == 1);
    CHECK(seats[1].row == 0);
    const double length = posture == PelletPosture::Standing ? 0.017 : 0.018;
    CHECK(((a_seat().inverse() * seats[0].T_base_seat).translation() - Vector3d(length / 2, 0.0085, 0)).norm() < 1e-12);
  }
  const auto seats = plan_stack(Pose::Identity(), {.rows = 3, .columns = 4, .order = GridOrder::Columns});
  CHECK(seats[1].row == 1);
  CHECK(seats[1].column == 0);
  CHECK(seats[3].column == 1);
}

TEST_CASE("a regrip puts a cylinder down where the fingers take it") {
  Random random(5);
  const Pellet pellet = a_pellet(random);
  const HeldPellet held = hold(pellet, side_grasp(pellet, 0.001, 0.0));
  Matrix6 slip = Matrix6::Zero();
  slip(0, 0) = 1e-8;
  const HandlingPlan plan = regrip_steps(held, a_seat(), PelletPosture::Lying, {.lift = 0.04, .grip_covariance = slip});
  REQUIRE(plan.possible);
  REQUIRE(plan.steps.size() == 6);
  const auto& release = plan.steps[1];
  const auto& grip = plan.steps[4];
  CHECK(release.action == GripperAction::Release);
  CHECK(release.gripper == Gripper::Suction);
  CHECK(grip.action == GripperAction::Grip);
  CHECK(grip.gripper == Gripper::Fingers);
  CHECK(height_over(a_seat(), release.T_base_pellet.T, pellet.radius, pellet.height) == Approx(0.0).margin(1e-7));
  CHECK((grip.T_base_tool.translation() - release.T_base_pellet.T.translation()).norm() < 1e-12);
  CHECK(grip.T_base_tool.linear()(2, 2) == Approx(-1.0));
  CHECK(std::abs(grip.T_base_tool.linear().col(0).dot(grip.T_base_pellet.T.linear().col(2))) == Approx(1.0));
  CHECK(
      (plan.steps[5].T_base_pellet.T.translation() - grip.T_base_pellet.T.translation() - Vector3d(0, 0, 0.04)).norm() <
      1e-12);
  CHECK(grip.T_base_pellet.covariance.isApprox(release.T_base_pellet.covariance + slip, 1e-12));
}

TEST_CASE("a lying cylinder is made to stand by fingers that lean") {
  Random random(6);
  for (const double lean : {0.5, 0.7853981633974483, 1.1}) {
    const Pellet pellet = a_pellet(random);
    const HeldPellet held = hold(pellet, side_grasp(pellet, 0.001, 0.0));
    const Pose T_base_standing = Translation3d(0.1, 0, 0) * a_seat();
    const HandlingPlan plan = stand_up_steps(held, a_seat(), T_base_standing, {.lean = lean});
    REQUIRE(plan.possible);
    REQUIRE(plan.steps.size() == 12);
    const auto& take = plan.steps[4];
    const auto& stand = plan.steps[7];
    const auto& last = plan.steps[10];
    CHECK(take.T_base_tool.linear()(2, 2) == Approx(-std::cos(lean)));
    CHECK(stand.T_base_tool.linear()(2, 2) == Approx(-std::cos(right_angle - lean)));
    // The fingers close across the axis, before and after.
    CHECK(std::abs(take.T_base_tool.linear().col(1).dot(take.T_base_pellet.T.linear().col(2))) < 1e-12);
    CHECK(std::abs(stand.T_base_tool.linear().col(1).dot(stand.T_base_pellet.T.linear().col(2))) < 1e-12);
    CHECK(std::abs(stand.T_base_pellet.T.linear()(2, 2)) == Approx(1.0));
    CHECK(height_over(T_base_standing, stand.T_base_pellet.T, pellet.radius, pellet.height) ==
          Approx(0.0).margin(1e-7));
    const Vector3d at = T_base_standing.inverse() * stand.T_base_pellet.T.translation();
    CHECK(at.head<2>().norm() < 1e-12);
    // While the fingers hold it, it moves with them.
    const Pose grip = take.T_base_tool.inverse() * take.T_base_pellet.T;
    CHECK((plan.steps[6].T_base_tool.inverse() * plan.steps[6].T_base_pellet.T).isApprox(grip, 1e-12));
    CHECK(last.action == GripperAction::Grip);
    CHECK(last.T_base_tool.linear()(2, 2) == Approx(-1.0));
    CHECK((last.T_base_tool.translation() - last.T_base_pellet.T.translation()).norm() < 1e-12);
  }
  const Pellet pellet = a_pellet(random);
  const HandlingPlan none = stand_up_steps(hold(pellet, end_grasp(pellet, 0)), a_seat(), a_seat());
  CHECK_FALSE(none.possible);
  CHECK(none.steps.empty());
  CHECK_THAT(none.message, Contains("from straight down"));
}

TEST_CASE("placing refuses what is no pose, no covariance, or in millimetres") {
  Random random(7);
  Pellet pellet = a_pellet(random);
  const HeldPellet held = hold(pellet, end_grasp(pellet, 0));
  Pose scaled = Pose::Identity();
  scaled.linear() *= 1000;
  CHECK_THROWS_WITH(hold(pellet, scaled), Contains("T_base_tool is no rigid motion"));
  CHECK_THROWS_WITH(hold(pellet, Pose::Identity(), -Matrix6::Identity()), Contains("grip_covariance is no covariance"));
  CHECK_THROWS_WITH(place(held, scaled, PelletPosture::Lying), Contains("T_base_seat is no rigid motion"));
  CHECK_THROWS_WITH(place(held, a_seat(), PelletPosture::Lying, {.retreat = 50}), Contains("retreat"));
  CHECK_THROWS_WITH(plan_stack(scaled), Contains("T_base_tray is no rigid motion"));
  CHECK_THROWS_WITH(plan_stack(a_seat(), {.radius = 8}), Contains("is it in millimetres?"));
  CHECK_THROWS_WITH(plan_stack(a_seat(), {.rows = 0}), Contains("rows, columns and layers"));
  CHECK_THROWS_WITH(plan_stack(a_seat(), {.posture = PelletPosture::Lying, .rows = 2, .layers = 3}),
                    Contains("layers must not be greater than rows"));
  CHECK_THROWS_WITH(plan_stack(a_seat(), {.posture = PelletPosture::Lying, .rows = 2, .layers = 2, .clearance = 0.02}),
                    Contains("fall between"));
  CHECK_THROWS_WITH(stand_up_steps(held, a_seat(), a_seat(), {.lean = 45}), Contains("is it in degrees?"));
  pellet.height = 15;
  CHECK_THROWS_WITH(hold(pellet, Pose::Identity()), Contains("height must be positive"));
  pellet.centre.x() = std::nan("");
  CHECK_THROWS_WITH(hold(pellet, Pose::Identity()), Contains("pose of the pellet"));
}

}  // namespace placing_test
