// SPDX-License-Identifier: BSD-3-Clause
#include "vision/homography.hpp"

#include <vector>

#include <opencv2/calib3d.hpp>

namespace kr5::vision {

std::optional<Eigen::Matrix3d> fit_homography(const Eigen::Matrix2Xd& from, const Eigen::Matrix2Xd& to) {
  std::vector<cv::Point2d> a, b;
  for (const auto point : from.colwise()) a.emplace_back(point.x(), point.y());
  for (const auto point : to.colwise()) b.emplace_back(point.x(), point.y());
  const cv::Mat H = cv::findHomography(a, b, 0);
  if (H.empty()) return std::nullopt;
  Eigen::Matrix3d out;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) out(r, c) = H.at<double>(r, c);
  return out;
}

}  // namespace kr5::vision
