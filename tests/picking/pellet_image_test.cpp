#include <cmath>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/picking/pellet_image.hpp>

#include "picking/rendered_pellets.hpp"
#include "support/coverage.hpp"
#include "support/rates.hpp"
#include "support/trials.hpp"

namespace pellet_image_test {

using namespace kr5;
using namespace kr5::picking;
using Catch::Matchers::Contains;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::PelletErrors;

namespace {

/// Of the cloud's estimate of a cylinder between aligned ones: along the axis hardly known.
PelletErrors cloud_sigmas() {
  PelletErrors out;
  out << 1e-4, 1e-4, 8e-4, 0.012, 0.012, 1e-4, 3e-4;
  return out;
}

PelletErrors lean(double up, double angle) {
  PelletErrors out = PelletErrors::Zero();
  out[1] = up, out[3] = angle;
  return out;
}

Pellet drawn_estimate(const Pellet& truth, Random& random) {
  const PelletErrors sigmas = cloud_sigmas();
  PelletErrors errors;
  for (int k = 0; k < 7; ++k) errors[k] = random.normal(sigmas[k]);
  Pellet out = test::displaced(truth, errors);
  out.covariance = sigmas.cwiseAbs2().asDiagonal();
  return out;
}

/// Three in a row, end to end with narrow gaps; the one in the middle is to be refined.
std::vector<Pellet> three_aligned(double angle, double gap) {
  const double pitch = 0.015 + gap;
  const Vector2d along(std::cos(angle), std::sin(angle));
  return {test::lying({0, 0}, angle), test::lying(pitch * along, angle), test::lying(-pitch * along, angle)};
}

/// Lying, and leaning either way.
const std::vector<Pellet>& single_ones() {
  static const std::vector<Pellet> poses = {test::lying({0, 0}, 0.2), test::lying({0.002, 0.001}, 1.3),
                                            test::displaced(test::lying({0, 0}, 0.7), lean(0, 0.3)),
                                            test::displaced(test::lying({0, 0}, 0.4), lean(0.002, 0.9))};
  return poses;
}

UncertainPose exact(const Pose& T) { return {T, Matrix6::Zero()}; }

}  // namespace

TEST_CASE(
    "the position along an aligned row becomes three times better by the image, whatever streaks and neighbours") {
  Random random(1);
  double before = 0, after = 0;
  int refined = 0, wrong = 0, trials = 0;
  for (const double angle : {0.2, 1.0}) {
    test::PelletScene scene = test::scene_of(three_aligned(angle, 0.002));
    scene.streak = 80;
    const Eigen::MatrixXd grey = scene.render();
    for (int k = 0; k < test::trials(200, 16); ++k, ++trials) {
      const test::NoisyImage image(grey, random, 2.0);
      const Pellet cloud = drawn_estimate(scene.pellets[0], random);
      const auto result = refine_pellet(image.view(), scene.camera, exact(scene.T_camera_base), cloud, scene.pellets);
      CHECK(result.noise == Approx(2.0).epsilon(0.2));
      if (!result.refined()) continue;
      ++refined;
      before += std::pow(test::errors_of(cloud, scene.pellets[0])[2], 2);
      const PelletErrors errors = test::errors_of(result.pellet, scene.pellets[0]);
      after += errors[2] * errors[2];
      wrong += std::abs(errors[2]) > 2e-4;  // the neighbours stand 2 mm away
    }
  }
  CAPTURE(std::sqrt(before / refined), std::sqrt(after / refined));
  test::check_rate(refined, trials, 0.8, 0.6);
  test::check_rare(wrong, trials, 0.02, 0.05);
  CHECK(std::sqrt(after) < std::sqrt(before) / 3);
}

TEST_CASE("the covariance of a cylinder refined by exact edges holds the truth", "[statistics]") {
  Random random(2);
  test::Coverage coverage("picking: cylinder refined in an image", 7);
  for (const Pellet& truth : single_ones()) {
    test::PelletScene scene = test::scene_of({truth});
    scene.flat = true;
    const Eigen::MatrixXd grey = scene.render();
    for (int k = 0; k < test::trials(500, 40); ++k) {
      const test::NoisyImage image(grey, random, 2.0);
      const auto result = refine_pellet(image.view(), scene.camera, exact(scene.T_camera_base),
                                        drawn_estimate(truth, random), {}, {.edge_sigma = 0.05, .edge_bias = 0.01});
      if (!result.refined()) continue;
      coverage.add(test::errors_of(result.pellet, truth), result.pellet.covariance);
    }
  }
  CHECK(coverage.trials() >= 0.95 * 4 * test::trials(500, 40));
  coverage.check_rate();
}

TEST_CASE("shading moves edges by less than the covariance allows for", "[statistics]") {
  Random random(3);
  int inside = 0, trials = 0;
  for (const Pellet& truth : single_ones())
    for (int light = 0; light < test::trials(12, 2); ++light) {
      test::PelletScene scene = test::scene_of({truth});
      scene.light = (Vector3d(0, 0, 1.3) + random.direction()).normalized();
      scene.streak = random.uniform(0, 60);
      const Eigen::MatrixXd grey = scene.render();
      for (int k = 0; k < 6; ++k, ++trials) {
        const test::NoisyImage image(grey, random, 2.0);
        const auto result =
            refine_pellet(image.view(), scene.camera, exact(scene.T_camera_base), drawn_estimate(truth, random));
        const PelletErrors errors = test::errors_of(result.pellet, truth);
        inside += errors.dot(result.pellet.covariance.ldlt().solve(errors)) < 14.07;  // 95 % of a chi-square of 7
      }
    }
  test::check_rate(inside, trials, 0.93, test::full() ? 0.9 : 0.82);
}

TEST_CASE("the error of the camera's pose stands in the covariance") {
  Random random(4);
  const Pellet truth = test::lying({0, 0}, 0.2);
  const test::PelletScene scene = test::scene_of({truth});
  const Eigen::MatrixXd grey = scene.render();
  const test::NoisyImage image(grey, random, 2.0);
  const Pellet cloud = drawn_estimate(truth, random);
  UncertainPose T_camera_base = exact(scene.T_camera_base);
  const auto sharp = refine_pellet(image.view(), scene.camera, T_camera_base, cloud);
  T_camera_base.covariance.diagonal().head<3>().setConstant(9e-8);  // 0.3 mm
  const auto wide = refine_pellet(image.view(), scene.camera, T_camera_base, cloud);
  REQUIRE(sharp.refined());
  REQUIRE(wide.refined());
  CHECK(std::sqrt(sharp.pellet.covariance(2, 2)) < 1e-4);
  // As good as both together: the camera's 0.3 mm and the cloud's 0.8 mm along the axis.
  CHECK(std::sqrt(wide.pellet.covariance(2, 2)) == Approx(3e-4 * 8 / std::hypot(3.0, 8.0)).epsilon(0.15));
}

TEST_CASE("an image from a wrong pose of the camera refines nothing") {
  Random random(5);
  int accepted = 0;
  constexpr int trials = 40;
  test::PelletScene scene = test::scene_of(three_aligned(0.2, 0.002));
  const Eigen::MatrixXd grey = scene.render();
  for (int k = 0; k < trials; ++k) {
    const test::NoisyImage image(grey, random, 2.0);
    Vector6 off = Vector6::Zero();
    const double azimuth = random.uniform(0.2 + 0.5, 0.2 + 2.6);  // not along the axis, where the cloud knows little
    off.head<3>() = 0.004 * (k % 2 == 0 ? 1 : -1) * Vector3d(std::cos(azimuth), std::sin(azimuth), 0);
    const UncertainPose T_camera_base = exact(scene.T_camera_base * to_pose(off));
    const Pellet cloud = drawn_estimate(scene.pellets[0], random);
    const auto result = refine_pellet(image.view(), scene.camera, T_camera_base, cloud, scene.pellets);
    accepted += result.refined();
    if (!result.refined()) {
      CHECK(result.pellet.centre == cloud.centre);
      CHECK(result.pellet.covariance == cloud.covariance);
      CHECK_FALSE(result.fit.usable());
    }
  }
  CHECK(accepted == 0);
}

TEST_CASE("a refinement says what is missing") {
  Random random(6);
  const Pellet truth = test::lying({0, 0}, 0.2);
  const test::PelletScene scene = test::scene_of({truth});
  const Pellet cloud = drawn_estimate(truth, random);
  const auto refine = [&](const Eigen::MatrixXd& grey, const Pellet& pellet, const std::vector<Pellet>& others = {}) {
    const test::NoisyImage image(grey, random, 2.0);
    return refine_pellet(image.view(), scene.camera, exact(scene.T_camera_base), pellet, others);
  };
  const Eigen::MatrixXd empty = Eigen::MatrixXd::Constant(scene.camera.height, scene.camera.width, 40);
  const auto none = refine(empty, cloud);
  CHECK(none.status == PelletImageStatus::TooFewEdges);
  CHECK_THAT(none.fit.message, Contains("expected edges were found; check the light"));
  Pellet away = cloud;
  away.centre.x() += 0.05;
  CHECK(refine(scene.render(), away).status == PelletImageStatus::OutsideImage);
  Pellet behind = cloud;
  behind.centre.z() += 1;
  CHECK(refine(scene.render(), behind).status == PelletImageStatus::OutsideImage);
  Pellet lid = test::lying({0, 0}, 0.2);
  lid.centre = Vector3d(0.004, -0.018, 0.1), lid.radius = 0.02, lid.height = 0.05;
  const auto hidden = refine(scene.render(), cloud, {cloud, lid});
  CHECK(hidden.status == PelletImageStatus::OutsideImage);
  CHECK_THAT(hidden.fit.message, Contains("hide it") || Contains("hidden"));
}

TEST_CASE("a cylinder seen half is refined by the edges that are seen") {
  Random random(7);
  const Pellet truth = test::lying({0, 0}, 0.2);
  Pellet over = test::lying({-0.006, 0.001}, 1.5);
  over.centre.z() = 0.0245;
  const test::PelletScene scene = test::scene_of({truth, over});
  const test::NoisyImage image(scene.render(), random, 2.0);
  const Pellet cloud = drawn_estimate(truth, random);
  const auto result = refine_pellet(image.view(), scene.camera, exact(scene.T_camera_base), cloud, {over});
  REQUIRE(result.refined());
  const auto all = refine_pellet(test::NoisyImage(test::scene_of({truth}).render(), random, 2.0).view(), scene.camera,
                                 exact(scene.T_camera_base), cloud);
  CHECK(result.predicted < 0.8 * all.predicted);
  const PelletErrors errors = test::errors_of(result.pellet, truth);
  CHECK(errors.dot(result.pellet.covariance.ldlt().solve(errors)) < 24.3);  // 99.9 %
}

TEST_CASE("a refinement refuses images, cylinders and options that are none") {
  Random random(8);
  const Pellet truth = test::lying({0, 0}, 0.2);
  const test::PelletScene scene = test::scene_of({truth});
  const test::NoisyImage image(Eigen::MatrixXd::Constant(220, 280, 40), random, 2.0);
  const auto refine = [&](ImageView view, const Pellet& pellet, const PelletImageOptions& options = {}) {
    return refine_pellet(view, scene.camera, exact(scene.T_camera_base), pellet, {}, options);
  };
  const test::NoisyImage small(Eigen::MatrixXd::Constant(100, 280, 40), random, 2.0);
  CHECK_THROWS_WITH(refine(small.view(), truth), Contains("image: must have the size of the camera's, 280 x 220 px"));
  CHECK_THROWS_WITH(refine({}, truth), Contains("image: must have the size"));
  Pellet millimetres = truth;
  millimetres.radius = 8;
  CHECK_THROWS_WITH(refine(image.view(), millimetres), Contains("are they in millimetres?"));
  Pellet nowhere = truth;
  nowhere.centre.y() = std::nan("");
  CHECK_THROWS_WITH(refine(image.view(), nowhere), Contains("centre or frame is no pose"));
  Pellet negative = truth;
  negative.covariance(2, 2) = -1e-6;
  CHECK_THROWS_WITH(refine(image.view(), negative), Contains("pellet: no covariance"));
  CHECK_THROWS_WITH(refine(image.view(), truth, {.edge_bias = 0}), Contains("edge_bias"));
  CHECK_THROWS_WITH(refine(image.view(), truth, {.min_supported = 50}), Contains("min_supported"));
  UncertainPose scaled = exact(scene.T_camera_base);
  scaled.T.linear() *= 1000;
  CHECK_THROWS_WITH(refine_pellet(image.view(), scene.camera, scaled, truth),
                    Contains("T_camera_base is no rigid motion"));
}

}  // namespace pellet_image_test
