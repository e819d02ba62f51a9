#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/vision/hand_eye_closed_form.hpp>

namespace hand_eye_closed_form_test {

using namespace kr5;
using namespace kr5::vision;

namespace {

std::vector<HandEyeSample> samples(Random& random, const Pose& X, int count, bool fixed_camera) {
  const Pose Z = to_pose((Vector6() << 0.7, 0.1, 0.05, 1.0, 0.3, -0.2).finished());
  std::vector<HandEyeSample> out;
  for (int i = 0; i < count; ++i) {
    Vector6 v;
    v << random.normal_vector(3, 0.3), random.normal_vector(3, 0.25);
    const Pose T = to_pose(v);  // T_base_flange; its inverse stands in the sample for a fixed camera
    const Pose T_sample = fixed_camera ? Pose(T.inverse()) : T;
    out.push_back({T_sample, X.inverse() * T_sample.inverse() * Z});
  }
  return out;
}

}  // namespace

TEST_CASE("every closed form is exact on exact poses, for both mounts") {
  Random random(8);
  const Pose X = to_pose((Vector6() << 0.05, -0.03, 0.08, 0.2, -0.1, 1.5).finished());
  for (const bool fixed_camera : {false, true}) {
    const auto data = samples(random, X, 10, fixed_camera);
    for (const auto& [method, name] : enum_names(HandEyeMethod{})) {
      CAPTURE(name, fixed_camera);
      CHECK(pose_difference(X, closed_form_hand_eye(data, method)).norm() < 1e-6);
    }
  }
}

TEST_CASE("too few or unreadable samples are refused") {
  Random random(9);
  auto data = samples(random, Pose::Identity(), 4, false);
  CHECK_THROWS_AS(closed_form_hand_eye(std::span(data).first(2), HandEyeMethod::Park), InvalidArgument);
  data[1].T_camera_target(0, 3) = std::nan("");
  CHECK_THROWS_AS(closed_form_hand_eye(data, HandEyeMethod::Visp), InvalidArgument);
}

}  // namespace hand_eye_closed_form_test
