// SPDX-License-Identifier: BSD-3-Clause
#include "vision/undistort.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

#include "vision/cv_view.hpp"

namespace kr5::vision {
namespace {

using Eigen::Vector2d;

/// The camera without its lens, its picture grown to what the border of the image sees.
Pinhole plain_camera(const Pinhole& camera) {
  Pinhole plain;
  plain.width = camera.width, plain.height = camera.height;
  plain.fx = camera.fx, plain.fy = camera.fy, plain.cx = camera.cx, plain.cy = camera.cy;
  const Vector2d last(camera.width - 1.0, camera.height - 1.0);
  Eigen::AlignedBox2d seen(Vector2d(0, 0), last);
  constexpr int steps = 8;
  for (int k = 0; k <= steps; ++k)
    for (const Vector2d& at : {Vector2d(k, 0), Vector2d(k, steps), Vector2d(0, k), Vector2d(steps, k)})
      if (const auto ray = camera.ray(at.cwiseProduct(last) / steps)) seen.extend(plain.project(*ray));
  const Vector2d margin = last / 4;
  seen = seen.intersection(Eigen::AlignedBox2d(Vector2d(-margin), Vector2d(last + margin)));
  const Vector2d shift = (-seen.min()).array().ceil(), size = (seen.max() + shift).array().ceil() + 1;
  plain.cx += shift.x(), plain.cy += shift.y();
  plain.width = static_cast<int>(size.x()), plain.height = static_cast<int>(size.y());
  return plain;
}

}  // namespace

PlainView undistort(ImageView image, const Pinhole& camera) {
  PlainView out;
  out.camera = plain_camera(camera);
  out.image = Image(out.camera.width, out.camera.height);
  cv::Mat2f map(out.camera.height, out.camera.width);
  for (int y = 0; y < map.rows; ++y)
    for (int x = 0; x < map.cols; ++x) {
      const Vector2d pixel =
          camera.project({(x - out.camera.cx) / out.camera.fx, (y - out.camera.cy) / out.camera.fy, 1.0});
      map(y, x) = {static_cast<float>(pixel.x()), static_cast<float>(pixel.y())};
    }
  cv::Mat drawn(out.camera.height, out.camera.width, CV_8UC1, out.image.pixels.data());
  cv::remap(cv_view(image), drawn, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_CONSTANT);
  return out;
}

}  // namespace kr5::vision
