#include <catch2/catch.hpp>

#include <kr5/calibration/pair_readings.hpp>
#include <support/hand_eye_pairs_world.hpp>
#include <support/rates.hpp>
#include <support/trials.hpp>

namespace pair_readings_test {

using namespace kr5;
using namespace kr5::calibration;
using test::make_pairs_world;

namespace {

constexpr test::PairsNoise rough{.position = 2e-3, .robot_rotation = 2e-3, .camera_rotation = 5e-3};

bool alike(const PairReading& a, const PairReading& b) {
  return a.robot_inverted == b.robot_inverted && a.camera_inverted == b.camera_inverted;
}

}  // namespace

TEST_CASE("the data tell whether one list of poses is inverted, and the shorter lever which", "[statistics]") {
  int right = 0, all = 0;
  for (int i = 0; i < test::trials(400, 40); ++i)
    for (const Mount mount : {Mount::EyeInHand, Mount::EyeToHand}) {
      Random random(static_cast<std::uint64_t>(i));
      const test::PairsWorld w = make_pairs_world(4 + i % 15, mount, rough, 3000 + static_cast<std::uint64_t>(i));
      const bool robot = random.integer(2) == 1, camera = random.integer(2) == 1 && !robot;  // both: see below
      const PairReading truth{.robot_inverted = robot, .camera_inverted = camera};
      const PairReadings found = compare_pair_readings(read_pairs(w.pairs, truth), mount);
      REQUIRE(found.readings.size() == 4);
      CAPTURE(found.text, i);
      // Three or four pairs may fit either way, but not for certain.
      if (found.certain) CHECK(alike(found.readings.front(), truth));
      if (w.pairs.size() < 6) continue;
      right += found.certain && alike(found.readings.front(), truth);
      ++all;
    }
  test::check_rate(right, all, 0.98, test::full() ? 0.97 : 0.9);
}

TEST_CASE("what no pair can tell is not claimed: both lists inverted, the other mount, robot and camera exchanged") {
  const test::PairsWorld w = make_pairs_world(10, Mount::EyeInHand, {}, 11);
  const double lever = w.T_mount_camera.translation().norm(), far = w.T_fixed_target.translation().norm();
  REQUIRE(lever < far);
  const PairReadings straight = compare_pair_readings(w.pairs, Mount::EyeInHand);
  CHECK(straight.certain);
  CHECK(alike(straight.readings[0], {}));
  CHECK(alike(straight.readings[1], {.robot_inverted = true, .camera_inverted = true}));
  CHECK(straight.readings[0].score == straight.readings[1].score);
  CHECK(straight.readings[0].flange_distance == Approx(lever));
  CHECK(straight.readings[1].flange_distance == Approx(far));
  const auto both = read_pairs(w.pairs, {.robot_inverted = true, .camera_inverted = true});
  const PairReadings inverted = compare_pair_readings(both, Mount::EyeInHand);
  CHECK(alike(inverted.readings[0], {}));  // as given; the distance shows that it is not
  CHECK(inverted.readings[0].flange_distance == Approx(far));
  std::vector<PosePair> exchanged = w.pairs;
  for (PosePair& pair : exchanged) std::swap(pair.T_base_flange, pair.T_camera_target);
  CHECK(compare_pair_readings(exchanged, Mount::EyeInHand).certain);
  const PairReadings mount = compare_pair_readings(w.pairs, Mount::EyeToHand);
  CHECK(mount.certain);
  CHECK(mount.readings[0].robot_inverted != mount.readings[0].camera_inverted);
}

TEST_CASE("pairs that hardly move leave open which way round they are") {
  test::PairsWorld w = make_pairs_world(8, Mount::EyeInHand, rough, 7);
  Random random(8);
  for (PosePair& pair : w.pairs) {  // the first one again and again, with its noise
    pair = w.pairs.front();
    for (Pose* T : {&pair.T_base_flange, &pair.T_camera_target})
      *T = *T * to_pose((Vector6() << random.normal_vector(3, 2e-3), random.normal_vector(3, 2e-3)).finished());
  }
  const PairReadings found = compare_pair_readings(w.pairs, Mount::EyeInHand);
  CHECK_FALSE(found.certain);
  CHECK_THAT(found.text, Catch::Contains("do not show"));
}

}  // namespace pair_readings_test
