#include <catch2/catch.hpp>

#include <cmath>
#include <numbers>

#include <kr5/sim/cup_seat.hpp>

namespace cup_seat_test {

using namespace kr5;
using namespace kr5::sim;
using Eigen::Vector3d;

namespace {

constexpr double degree = std::numbers::pi / 180;

/// A cup that points down, at a place in the bin.
Pose down_at(const Vector3d& place) {
  Pose T = Pose::Identity();
  T.linear() = Vector3d(1, -1, -1).asDiagonal();
  T.translation() = place;
  return T;
}

/// A pellet that stands, and one that lies along Y.
PelletScene two_pellets() {
  PelletScene scene;
  Pellet stands{Pose(Eigen::Translation3d(-0.04, 0, 0.0075)), 0.008, 0.015}, lies = stands;
  lies.T_bin_pellet = Eigen::Translation3d(0.04, 0, 0.008) * Eigen::AngleAxisd(90 * degree, Vector3d::UnitX());
  scene.pellets = {stands, lies};
  return scene;
}

}  // namespace

TEST_CASE("a cup sits on the pellet whose surface is nearest, as far and as square as it stands") {
  const PelletScene scene = two_pellets();
  const CupSeat face = nearest_cup_seat(scene, down_at({-0.041, 0.002, 0.016}));
  CHECK(face.pellet == 0);
  CHECK(face.distance == Approx(0.001));
  CHECK(face.angle == Approx(0.0).margin(1e-7));
  // On the side of the one that lies, 30 degrees from its top.
  const Vector3d out(std::sin(30 * degree), 0, std::cos(30 * degree));
  const CupSeat side = nearest_cup_seat(scene, down_at(Vector3d(0.04, 0, 0.008) + 0.0085 * out));
  CHECK(side.pellet == 1);
  CHECK(side.distance == Approx(0.0005));
  CHECK(side.angle == Approx(30 * degree));
  CHECK(nearest_cup_seat(scene, down_at({-0.04, 0, 0.0145})).distance == Approx(0.0005));  // pressed in
}

TEST_CASE("a cup seals within its reach and its angle alone") {
  const GripOptions cup;
  CupSeat seat{0, 0.9 * cup.reach, 0.9 * cup.angle};
  CHECK(seat.sealed(cup));
  seat.angle = 1.1 * cup.angle;
  CHECK(seat.within_reach(cup));
  CHECK_FALSE(seat.sealed(cup));
  seat = {0, 1.1 * cup.reach, 0.0};
  CHECK_FALSE(seat.within_reach(cup));
  CHECK_FALSE(seat.sealed(cup));
}

TEST_CASE("in an empty bin there is no seat") {
  const CupSeat none = nearest_cup_seat({}, Pose::Identity());
  CHECK(none.pellet == -1);
  CHECK_FALSE(none.within_reach({}));
}

}  // namespace cup_seat_test
