// SPDX-License-Identifier: BSD-3-Clause
#include "vision/servo/visp_servo.hpp"

#include <vector>

#include <visp3/core/vpException.h>
#include <visp3/core/vpHomogeneousMatrix.h>
#include <visp3/visual_features/vpFeaturePoint.h>
#include <visp3/visual_features/vpFeatureThetaU.h>
#include <visp3/visual_features/vpFeatureTranslation.h>
#include <visp3/vs/vpServo.h>

namespace kr5::vision::detail {
namespace {

vpHomogeneousMatrix to_visp(const Eigen::Isometry3d& T) {
  vpHomogeneousMatrix M;
  for (unsigned r = 0; r < 3; ++r)
    for (unsigned c = 0; c < 4; ++c) M[r][c] = T.matrix()(r, c);
  return M;
}

/// Features are added by `add`, which must own them until the law was computed.
template <class Add>
ServoTwist control_law(const ServoGain& gain, const Add& add) {
  ServoTwist out;
  vpServo task;
  try {
    task.setServo(vpServo::EYEINHAND_CAMERA);
    task.setInteractionMatrixType(vpServo::CURRENT, vpServo::PSEUDO_INVERSE);
    task.setLambda(gain.near, gain.far, gain.slope);
    add(task);
    const vpColVector v = task.computeControlLaw();
    for (unsigned i = 0; i < 6; ++i) out.twist[i] = v[i];
    if (!out.twist.allFinite()) out.failure = "ViSP: the control law has no finite twist";
  } catch (const vpException& e) {
    out.failure = std::string("ViSP: ") + e.getMessage();
  }
  task.kill();
  return out;
}

}  // namespace

ServoTwist visp_position_law(const Eigen::Isometry3d& T_camera_target, const Eigen::Isometry3d& T_camera_target_goal,
                             const ServoGain& gain) {
  vpFeatureTranslation place(vpFeatureTranslation::cMo), wished_place(vpFeatureTranslation::cMo);
  vpFeatureThetaU turn(vpFeatureThetaU::cdRc), no_turn(vpFeatureThetaU::cdRc);
  place.buildFrom(to_visp(T_camera_target));
  wished_place.buildFrom(to_visp(T_camera_target_goal));
  turn.buildFrom(to_visp(T_camera_target_goal * T_camera_target.inverse()));
  return control_law(gain, [&](vpServo& task) {
    task.addFeature(place, wished_place);
    task.addFeature(turn, no_turn);
  });
}

ServoTwist visp_image_law(const Eigen::Matrix3Xd& seen, const Eigen::Matrix3Xd& wished, const ServoGain& gain) {
  const auto count = static_cast<std::size_t>(seen.cols());
  std::vector<vpFeaturePoint> now(count), then(count);
  return control_law(gain, [&](vpServo& task) {
    for (std::size_t i = 0; i < count; ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      now[i].buildFrom(seen(0, k), seen(1, k), seen(2, k));
      then[i].buildFrom(wished(0, k), wished(1, k), wished(2, k));
      task.addFeature(now[i], then[i]);
    }
  });
}

}  // namespace kr5::vision::detail
