// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/vision/hand_eye_closed_form.hpp>

#include <vector>

#include <kr5/core/error.hpp>
#include <opencv2/calib3d.hpp>

#include "vision/hand_eye/visp_hand_eye.hpp"

namespace kr5::vision {
namespace {

cv::Mat rotation(const Pose& T) {
  cv::Mat R(3, 3, CV_64F);
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) R.at<double>(r, c) = T(r, c);
  return R;
}

cv::Mat translation(const Pose& T) {
  cv::Mat t(3, 1, CV_64F);
  for (int r = 0; r < 3; ++r) t.at<double>(r) = T(r, 3);
  return t;
}

Pose opencv(std::span<const HandEyeSample> samples, cv::HandEyeCalibrationMethod method) {
  std::vector<cv::Mat> R_flange, t_flange, R_target, t_target;
  for (const HandEyeSample& s : samples) {
    R_flange.push_back(rotation(s.T_base_flange));
    t_flange.push_back(translation(s.T_base_flange));
    R_target.push_back(rotation(s.T_camera_target));
    t_target.push_back(translation(s.T_camera_target));
  }
  cv::Mat R, t;
  cv::calibrateHandEye(R_flange, t_flange, R_target, t_target, R, t, method);
  Pose out = Pose::Identity();
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) out(r, c) = R.at<double>(r, c);
    out(r, 3) = t.at<double>(r);
  }
  return out;
}

Pose visp(std::span<const HandEyeSample> samples) {
  std::vector<Eigen::Matrix4d> targets, flanges;
  for (const HandEyeSample& s : samples) {
    targets.push_back(s.T_camera_target.matrix());
    flanges.push_back(s.T_base_flange.matrix());
  }
  return Pose(visp_hand_eye(targets, flanges));
}

}  // namespace

Pose closed_form_hand_eye(std::span<const HandEyeSample> samples, HandEyeMethod method) {
  require(samples.size() >= 3,
          "closed_form_hand_eye: at least three samples are needed, found " + std::to_string(samples.size()));
  for (const HandEyeSample& s : samples)
    require(s.T_base_flange.matrix().allFinite() && s.T_camera_target.matrix().allFinite(),
            "closed_form_hand_eye: poses must be finite");
  switch (method) {
    case HandEyeMethod::Tsai:
      return opencv(samples, cv::CALIB_HAND_EYE_TSAI);
    case HandEyeMethod::Park:
      return opencv(samples, cv::CALIB_HAND_EYE_PARK);
    case HandEyeMethod::Horaud:
      return opencv(samples, cv::CALIB_HAND_EYE_HORAUD);
    case HandEyeMethod::Andreff:
      return opencv(samples, cv::CALIB_HAND_EYE_ANDREFF);
    case HandEyeMethod::Daniilidis:
      return opencv(samples, cv::CALIB_HAND_EYE_DANIILIDIS);
    case HandEyeMethod::Visp:
      return visp(samples);
  }
  throw InvalidArgument("closed_form_hand_eye: unknown method");
}

}  // namespace kr5::vision
