#include <kr5/calibration/pose_convention.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <support/hand_eye_world.hpp>
#include <support/trials.hpp>

namespace pose_convention_test {

using namespace kr5;
using namespace kr5::calibration;

namespace {

struct Written {
  std::vector<PoseRows> readings;
  std::vector<ViewOfPose> views;
  PoseFormat format;
};

/// Poses of a world as a file in this format has them, read in every form that rows of this length allow.
Written write(const test::HandEyeWorld& world, const PoseFormat& format) {
  Eigen::MatrixXd rows(std::ssize(world.views), to_row(world.views[0].T_base_flange, format).size());
  Written out;
  for (std::size_t i = 0; i < world.views.size(); ++i) {
    rows.row(static_cast<Eigen::Index>(i)) = to_row(world.views[i].T_base_flange, format);
    out.views.push_back({static_cast<int>(i), world.views[i].view});
  }
  for (const PoseFormat& form : plausible_formats(rows))
    if (out.readings.empty() || out.readings.back().rotation != form.rotation)
      out.readings.push_back({form.rotation, rows});
  out.format = format;
  return out;
}

}  // namespace

TEST_CASE("the convention and the mount in which poses were written agree best with what was seen") {
  const auto rotation =
      GENERATE(RotationForm::QuaternionXyzw, RotationForm::QuaternionWxyz, RotationForm::RotationVector,
               RotationForm::Rpy, RotationForm::KukaAbc, RotationForm::Matrix);
  const Mount mount = GENERATE(Mount::EyeInHand, Mount::EyeToHand);
  if (test::sanitized && (rotation != RotationForm::KukaAbc || mount != Mount::EyeInHand)) return;  // the same code
  const auto world = test::make_hand_eye_world({.mount = mount,
                                                .views = 12,
                                                .sigma_robot_position = 2e-4,
                                                .sigma_robot_rotation = 2e-4,
                                                .seed = 91 + static_cast<std::uint64_t>(rotation)});
  PoseFormat format;
  format.rotation = rotation;
  if (rotation == RotationForm::KukaAbc) format.position = LengthUnit::Millimetre, format.angle = AngleUnit::Degree;
  const Written given = write(world, format);
  const auto found = rank_conventions(given.readings, given.views, world.camera);
  CAPTURE(name_of(rotation), name_of(mount), found.size());
  REQUIRE_FALSE(found.empty());
  CHECK(found[0].mount == mount);
  CHECK(name_of(found[0].format.rotation) == name_of(rotation));
  CHECK(name_of(found[0].format.position) == name_of(format.position));
  CHECK(found[0].error < 2e-3);
  for (std::size_t k = 1; k < found.size(); ++k) {
    CHECK(found[k].error > 3 * found[0].error);
    CHECK(found[k].format.meaning == PoseMeaning::BaseFlange);
  }
}

TEST_CASE("a view of a pose that is not there is refused, and poses without rotation have no convention") {
  auto world = test::make_hand_eye_world({.views = 6});
  Written given = write(world, {});
  given.views.back().pose = 6;
  CHECK_THROWS_WITH(rank_conventions(given.readings, given.views, world.camera),
                    Catch::Contains("view of pose 6, expected one of 6"));
  for (HandEyeView& view : world.views) view.T_base_flange.linear().setIdentity();
  given = write(world, {});
  CHECK(rank_conventions(given.readings, given.views, world.camera).empty());
}

}  // namespace pose_convention_test
