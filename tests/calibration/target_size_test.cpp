#include <kr5/calibration/target_size.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <support/hand_eye_world.hpp>

namespace target_size_test {

using namespace kr5;
using namespace kr5::calibration;

namespace {

/// What was seen of a board that is stated `stated` times as large as it is, in one form of rotation.
struct Seen {
  std::vector<PoseRows> readings;
  std::vector<ViewOfPose> views;
  Pinhole camera;
  std::vector<PoseConvention> conventions;
};

Seen see_board(double stated, Mount mount, std::uint64_t seed) {
  const auto world = test::make_hand_eye_world(
      {.mount = mount, .views = 12, .sigma_robot_position = 2e-4, .sigma_robot_rotation = 2e-4, .seed = seed});
  const PoseFormat format;
  Eigen::MatrixXd rows(std::ssize(world.views) + 1, 7);
  rows.row(0) = to_row(Pose::Identity(), format);  // a pose without an image
  Seen out;
  for (std::size_t i = 0; i < world.views.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i) + 1) = to_row(world.views[i].T_base_flange, format);
    out.views.push_back({static_cast<int>(i) + 1, world.views[i].view});
    out.views.back().view.points *= stated;
  }
  out.readings = {{format.rotation, rows}, {RotationForm::QuaternionWxyz, rows}};
  out.camera = world.camera;
  out.conventions = rank_conventions(out.readings, out.views, out.camera);
  return out;
}

}  // namespace

TEST_CASE("robot poses tell the size of a target, and with it how they are to be read") {
  const double stated = GENERATE(0.5, 1.6);
  const Mount mount = GENERATE(Mount::EyeInHand, Mount::EyeToHand);
  const Seen seen = see_board(stated, mount, 71);
  REQUIRE_FALSE(seen.conventions.empty());
  const auto found = size_from_poses(seen.readings, seen.views, seen.camera, seen.conventions);
  REQUIRE(found);
  CHECK(found->factor == Approx(1 / stated).epsilon(5e-3));
  REQUIRE_FALSE(found->conventions.empty());
  CHECK(found->conventions[0].mount == mount);
  CHECK(found->conventions[0].format.rotation == RotationForm::QuaternionXyzw);
  CHECK(found->conventions[0].error < 2e-3);
  CHECK(found->conventions[0].error < seen.conventions[0].error);
}

TEST_CASE("a target of the stated size has no other, and conventions that no reading has are refused") {
  const Seen seen = see_board(1.0, Mount::EyeInHand, 72);
  CHECK_FALSE(size_from_poses(seen.readings, seen.views, seen.camera, seen.conventions));
  CHECK_FALSE(size_from_poses(seen.readings, seen.views, seen.camera, {}));
  const std::vector<PoseRows> none;
  CHECK_THROWS_WITH(size_from_poses(none, seen.views, seen.camera, seen.conventions),
                    Catch::Contains("rotation quaternion_xyzw"));
  Seen wrong = seen;
  wrong.views.back().pose = 13;
  CHECK_THROWS_WITH(size_from_poses(wrong.readings, wrong.views, wrong.camera, wrong.conventions),
                    Catch::Contains("view of pose 13, expected one of 13"));
}

}  // namespace target_size_test
