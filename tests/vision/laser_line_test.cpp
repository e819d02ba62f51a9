#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/vision/laser_line.hpp>

namespace laser_line_test {

using namespace kr5;
using namespace kr5::vision;
using Catch::Matchers::Contains;
using Eigen::Matrix3Xd;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
const Pinhole lens{.width = 640, .height = 480, .fx = 600, .fy = 600, .cx = 320, .cy = 240, .k1 = -0.1};

UncertainPose scanner_pose() {
  UncertainPose out;
  out.T = to_pose(Vector6{0.01, 0.065, 0.05, 0.35, 0, 0});
  out.covariance.diagonal() << 1e-8, 2e-8, 1e-8, 4e-8, 1e-8, 2e-8;
  return out;
}

/// A line that falls by a step of `step` in its middle [m].
Matrix3Xd profile(double step = 0.0) {
  Matrix3Xd out = Matrix3Xd::Zero(3, 161);
  out.row(0) = Eigen::RowVectorXd::LinSpaced(161, -0.04, 0.04);
  out.row(2) = (0.19 + 0.2 * out.row(0).array()).matrix();
  out.row(2).tail(80).array() += step;
  return out;
}

/// The laser line of a profile, shifted across it by `shift` pixels, on noisy ground.
Image line_image(const Matrix3Xd& points, double shift, double brightness = 180) {
  Image out(lens.width, lens.height);
  Random random(3);
  std::vector<double> grey(out.pixels.size());
  for (double& g : grey) g = 40 + random.normal(3);
  for (Eigen::Index k = 0; k + 1 < points.cols(); ++k)
    for (double along = 0; along < 1; along += 0.02) {
      const auto at = [&](double t) -> Vector2d {
        return lens.project(scanner_pose().T * Vector3d((1 - t) * points.col(k) + t * points.col(k + 1)));
      };
      const Vector2d way = at(1) - at(0), middle = at(along) + shift * Vector2d(-way.y(), way.x()).normalized();
      for (int y = static_cast<int>(middle.y()) - 4; y <= middle.y() + 5; ++y)
        for (int x = static_cast<int>(middle.x()) - 4; x <= middle.x() + 5; ++x) {
          if (x < 0 || y < 0 || x >= out.width || y >= out.height) continue;
          double& g = grey[static_cast<std::size_t>(y * out.width + x)];
          g = std::max(g, 40 + brightness * std::exp(-(Vector2d(x, y) - middle).squaredNorm() / 2));
        }
    }
  for (std::size_t i = 0; i < grey.size(); ++i)
    out.pixels[i] = static_cast<std::uint8_t>(std::clamp(std::round(grey[i]), 0.0, 255.0));
  return out;
}

TEST_CASE("the line is found where it is, across it", "[laser_line]") {
  for (const double shift : {0.0, 0.4, -7.3, 25.0}) {
    INFO(shift << " px");
    const LaserLineComparison found = compare_laser_line(line_image(profile(), shift), lens, scanner_pose(), profile());
    REQUIRE(found.fit.usable());
    CHECK(found.projected.cols() == 161);
    CHECK(found.with_line > 155);
    CHECK(found.mean_px == Approx(shift).margin(0.05));
    CHECK(found.rms_px == Approx(std::abs(shift)).margin(0.15));
    for (Eigen::Index k = 0; k < 161; ++k)
      if (std::isfinite(found.distance[k]))
        CHECK((found.seen.col(k) - found.projected.col(k)).norm() == Approx(std::abs(found.distance[k])).margin(1e-9));
  }
}

TEST_CASE("a line farther off than the reach is not seen", "[laser_line]") {
  const Image image = line_image(profile(), 25.0);
  const LaserLineComparison found = compare_laser_line(image, lens, scanner_pose(), profile(), {.reach = 15});
  CHECK_FALSE(found.fit.usable());
  CHECK(found.projected.cols() == 161);
  CHECK(found.rms_px == 0);
}

TEST_CASE("where the profile has a step no line is looked for", "[laser_line]") {
  const Matrix3Xd points = profile(-0.03);
  const LaserLineComparison found = compare_laser_line(line_image(points, 0.0), lens, scanner_pose(), points);
  REQUIRE(found.fit.usable());
  for (Eigen::Index k = 79; k < 83; ++k) CHECK(std::isnan(found.distance[k]));
  CHECK(found.rms_px < 0.2);
}

TEST_CASE("the expected deviation is that of drawn poses", "[laser_line]") {
  const UncertainPose T = scanner_pose();
  const Matrix3Xd points = profile();
  const Image dark(lens.width, lens.height, 40);
  const LaserLineComparison found = compare_laser_line(dark, lens, T, points);
  Random random(5);
  double squares = 0;
  constexpr int draws = 400;
  for (int draw = 0; draw < draws; ++draw) {
    const Vector6 error = T.covariance.diagonal().cwiseSqrt().cwiseProduct(random.normal_vector(6));
    for (Eigen::Index k = 1; k + 1 < points.cols(); ++k) {
      const Vector2d along = found.projected.col(k + 1) - found.projected.col(k - 1);
      const Vector2d moved = lens.project(T.T * to_pose(error) * Vector3d(points.col(k))) - found.projected.col(k);
      squares += std::pow(moved.dot(Vector2d(-along.y(), along.x()).normalized()), 2);
    }
  }
  CHECK(found.expected_std == Approx(std::sqrt(squares / draws / 159)).epsilon(0.1));
  UncertainPose known = T;
  known.covariance.setZero();
  CHECK(compare_laser_line(dark, lens, known, points).expected_std == 0);
}

TEST_CASE("points that were not measured, lie behind the camera or beside the image are left out", "[laser_line]") {
  Matrix3Xd points = profile();
  const Image image = line_image(points, 1.0);
  points(2, 3) = nan, points(0, 4) = nan;
  points.col(5) = Vector3d(0, 0, -5), points.col(6) = Vector3d(3, 0, 0.2);
  const LaserLineComparison found = compare_laser_line(image, lens, scanner_pose(), points);
  REQUIRE(found.fit.usable());
  CHECK(found.projected.cols() == 157);
  CHECK(found.mean_px == Approx(1.0).margin(0.05));
}

TEST_CASE("an image without the line, or without the profile, is told apart", "[laser_line]") {
  const LaserLineComparison dark = compare_laser_line(line_image(profile(), 0.0, 0.0), lens, scanner_pose(), profile());
  CHECK_FALSE(dark.fit.usable());
  CHECK_THAT(dark.fit.message, Contains("of 161 points"));
  CHECK(compare_laser_line(Image(640, 480, 200), lens, scanner_pose(), profile()).with_line == 0);
  UncertainPose turned = scanner_pose();
  turned.T = turned.T * to_pose(Vector6{0, 0, 0, 0, 3.1, 0});
  const LaserLineComparison behind = compare_laser_line(Image(640, 480), lens, turned, profile());
  CHECK_FALSE(behind.fit.usable());
  CHECK(behind.projected.size() == 0);
  CHECK_THAT(behind.fit.message, Contains("outside the image"));
  CHECK(compare_laser_line(Image(640, 480), lens, scanner_pose(), Matrix3Xd(3, 0)).projected.size() == 0);
}

TEST_CASE("an image, a pose or an option that does not fit is refused", "[laser_line]") {
  const Image image(640, 480);
  UncertainPose pose = scanner_pose();
  CHECK_THROWS_WITH(compare_laser_line(Image(320, 240), lens, pose, profile()),
                    Contains("320 x 240 px, the camera 640"));
  CHECK_THROWS_AS(compare_laser_line(ImageView{}, lens, pose, profile()), InvalidArgument);
  CHECK_THROWS_WITH(compare_laser_line(image, lens, pose, profile(), {.reach = 0}), Contains("reach"));
  CHECK_THROWS_WITH(compare_laser_line(image, lens, pose, profile(), {.min_contrast = nan}), Contains("min_contrast"));
  CHECK_THROWS_WITH(compare_laser_line(image, lens, pose, profile(), {.min_share = 2}), Contains("min_share"));
  pose.covariance(0, 0) = -1;
  CHECK_THROWS_WITH(compare_laser_line(image, lens, pose, profile()), Contains("covariance"));
  pose = scanner_pose(), pose.T.translation().x() = nan;
  CHECK_THROWS_WITH(compare_laser_line(image, lens, pose, profile()), Contains("finite"));
}

}  // namespace laser_line_test
