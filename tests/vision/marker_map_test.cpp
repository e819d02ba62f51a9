#include <algorithm>
#include <utility>

#include <catch2/catch.hpp>

#include <Eigen/Cholesky>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/fit/pipeline/second_minimum.hpp>
#include <kr5/uncertainty/confidence.hpp>
#include <kr5/vision/marker_map.hpp>
#include <kr5/vision/render.hpp>
#include <support/coverage.hpp>
#include <support/rates.hpp>
#include <support/trials.hpp>

namespace marker_map_test {

using namespace kr5;
using namespace kr5::vision;

namespace {

const Pinhole lens{.width = 1280, .height = 960, .fx = 1100, .fy = 1100, .cx = 639.5, .cy = 479.5};

/// Five markers on the faces and beside a box.
Target truth() {
  Target map;
  map.kind = TargetKind::MarkerMap;
  const auto place = [](double x, double y, double z, double rx, double ry) {
    Pose T = Pose::Identity();
    T.translation() = Eigen::Vector3d(x, y, z);
    T.linear() = exp_rotation(Eigen::Vector3d(rx, ry, 0.2 * x));
    return T;
  };
  map.map = {{2, 0.05, Pose::Identity()},
             {5, 0.05, place(0.10, 0.01, 0.03, 0, 0.8)},
             {7, 0.05, place(-0.10, 0.0, 0.03, 0, -0.7)},
             {9, 0.05, place(0.0, 0.10, 0.03, -0.8, 0)},
             {11, 0.05, place(0.09, 0.11, 0.0, 0.2, 0.1)}};
  return map;
}

/// All of them tilted a little against each other.
Target nearly_flat() {
  Target map = truth();
  const double tilt[][2] = {{0, 0}, {0.2, 0.1}, {-0.15, 0.2}, {0.1, -0.2}, {-0.2, -0.1}};
  for (std::size_t k = 1; k < map.map.size(); ++k) {
    map.map[k].T_target_marker.translation().z() = 0.002 * static_cast<double>(k);
    map.map[k].T_target_marker.linear() = exp_rotation(Eigen::Vector3d(tilt[k][0], tilt[k][1], 0));
  }
  return map;
}

Pose camera_pose(Random& random) {
  Pose T = Pose::Identity();  // of the map in the camera
  T.linear() =
      exp_rotation(Eigen::Vector3d(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-1, 1)));
  T.translation() = Eigen::Vector3d(random.uniform(-0.03, 0.03), random.uniform(-0.03, 0.03), random.uniform(0.4, 0.6));
  return T;
}

/// Corners of the map at T in the camera, with noise.
MarkerSighting sighting(const Target& map, const Pose& T, double sigma, Random& random) {
  MarkerSighting image;
  for (const MapMarker& marker : map.map) {
    TagDetection tag;
    tag.family = map.family;
    tag.id = marker.id;
    const Eigen::Matrix<double, 3, 4> corners = marker.T_target_marker * square_corners(marker.size);
    for (int c = 0; c < 4; ++c)
      tag.corners.col(c) =
          lens.project(T * corners.col(c)) + Eigen::Vector2d(random.normal(sigma), random.normal(sigma));
    image.tags.push_back(tag);
  }
  return image;
}

/// Three of the markers in each image.
std::vector<MarkerSighting> sightings(int images, double sigma, Random& random) {
  std::vector<MarkerSighting> all;
  for (int i = 0; i < images; ++i) {
    Target map = truth();
    for (std::size_t k = 5; k-- > 0;)
      if ((static_cast<int>(k) + i) % 5 > 2) map.map.erase(map.map.begin() + static_cast<std::ptrdiff_t>(k));
    all.push_back(sighting(map, camera_pose(random), sigma, random));
    all.back().name = std::to_string(i);
  }
  return all;
}

/// Images from so far off, tilted by so much at most [rad].
std::vector<MarkerSighting> frontal(const Target& map, double distance, double tilt, double sigma, Random& random) {
  std::vector<MarkerSighting> all;
  for (int i = 0; i < 6; ++i) {
    Pose T = Pose::Identity();
    T.linear() =
        exp_rotation(Eigen::Vector3d(random.uniform(-tilt, tilt), random.uniform(-tilt, tilt), random.uniform(-1, 1)));
    T.translation().z() = distance;
    all.push_back(sighting(map, T, sigma, random));
    all.back().name = std::to_string(i);
  }
  return all;
}

}  // namespace

TEST_CASE("the map of markers in space lies within its stated uncertainty", "[coverage][statistics]") {
  const int trials = test::trials(500, 40);
  Random random(4);
  const Target map = truth();
  test::Coverage coverage("marker map", 6);
  for (int i = 0; i < trials; ++i) {
    const auto result = estimate_marker_map(sightings(10, 0.2, random), lens, {.size = 0.05, .sigma_pixel = 0.2});
    INFO(result.fit.message);
    REQUIRE(result.fit.usable());
    REQUIRE(result.target.map.size() == 5);
    CHECK(result.covariance[0].isZero());
    const std::size_t k = 1 + static_cast<std::size_t>(random.integer(4));
    coverage.add(pose_difference(result.target.map[k].T_target_marker, map.map[k].T_target_marker),
                 result.covariance[k]);
  }
  CAPTURE(coverage.inside(), trials);
  coverage.check_mean();
  coverage.check_rate();
}

TEST_CASE("a map is estimated from rendered images") {
  Random random(9);
  std::vector<MarkerSighting> images;
  for (int i = 0; i < 6; ++i) {
    const PlacedTarget p{truth(), camera_pose(random)};
    const Image image = render(std::span(&p, 1), lens, {.blur = 0.7, .noise = 2});
    images.push_back({std::to_string(i), find_tags(image)});
  }
  const auto result = estimate_marker_map(images, lens, {.size = 0.05});
  INFO(result.fit.message);
  REQUIRE(result.fit.usable());
  REQUIRE(result.target.map.size() == 5);
  CHECK(result.rms_px < 0.1);
  for (std::size_t k = 0; k < 5; ++k) {
    CHECK(result.target.map[k].id == truth().map[k].id);
    const Vector6 d = pose_difference(result.target.map[k].T_target_marker, truth().map[k].T_target_marker);
    CHECK(d.head<3>().norm() < 3e-4);
    CHECK(d.tail<3>().norm() < 5e-3);
  }
  CHECK_NOTHROW(result.target.validate());
}

TEST_CASE("an image in which a marker had moved is named and has no part, and sound ones are not named",
          "[statistics]") {
  const int trials = test::trials(300, 40);
  Random random(12);
  int named = 0, falsely = 0;
  for (int i = 0; i < trials; ++i) {
    auto images = sightings(10, 0.2, random);
    for (TagDetection& tag : images[3].tags)
      if (tag.id == images[3].tags.back().id) tag.corners.colwise() += Eigen::Vector2d(4.0, -3.0);
    const auto result = estimate_marker_map(images, lens, {.size = 0.05});
    INFO(result.fit.message);
    REQUIRE(result.fit.usable());
    for (std::size_t k = 0; k < result.views.size(); ++k)
      if (result.view_outlier[k]) (result.views[k] == "3" ? named : falsely) += 1;
    CHECK(result.sigma_pixel == Approx(0.2).epsilon(0.4));
  }
  test::check_rate(named, trials, 0.95, 0.8);
  test::check_rare(falsely, trials, 0.0, 0.02);
}

TEST_CASE("of five images the one in which a marker had moved is named, too", "[statistics]") {
  const int trials = test::trials(300, 40);
  Random random(14);
  int named = 0, falsely = 0;
  for (int i = 0; i < trials; ++i) {
    auto images = frontal(truth(), 0.5, 0.5, 0.2, random);
    images.pop_back();
    images[3].tags[2].corners.colwise() += Eigen::Vector2d(4.0, -3.0);
    const auto result = estimate_marker_map(images, lens, {.size = 0.05});
    INFO(result.fit.message);
    REQUIRE(result.fit.usable());
    for (std::size_t k = 0; k < result.views.size(); ++k)
      if (result.view_outlier[k]) (result.views[k] == "3" ? named : falsely) += 1;
  }
  test::check_rate(named, trials, 0.95, 0.8);
  test::check_rare(falsely, trials, 0.0, 0.02);
}

TEST_CASE("sound images are not named, whether there are few or their noise is stated too small", "[statistics]") {
  const int trials = test::trials(200, 16);
  Random random(13);
  for (const auto& [count, stated] : {std::pair(4, 0.0), std::pair(10, 0.0), std::pair(10, 0.05), std::pair(4, 0.05)}) {
    int falsely = 0;
    for (int i = 0; i < trials; ++i) {
      auto images = frontal(truth(), 0.5, 0.5, 0.2, random);
      for (MarkerSighting& more : frontal(truth(), 0.5, 0.5, 0.2, random)) images.push_back(std::move(more));
      images.resize(static_cast<std::size_t>(count));
      const auto result = estimate_marker_map(images, lens, {.size = 0.05, .sigma_pixel = stated});
      falsely += std::count(result.view_outlier.begin(), result.view_outlier.end(), true) > 0;
    }
    CAPTURE(count, stated);
    test::check_rare(falsely, trials, 0.01, 0.04);
  }
}

TEST_CASE("of a map seen from far off and from the front the second minimum is told and the map refused",
          "[statistics]") {
  const int trials = test::trials(100, 16);
  Random random(31);
  int told = 0, refused = 0;
  for (int i = 0; i < trials; ++i) {
    const auto result = estimate_marker_map(frontal(nearly_flat(), 2.5, 0.1, 0.3, random), lens, {.size = 0.05});
    told += result.second.has_value();
    refused += !result.fit.usable();
    if (!result.fit.usable()) CHECK_THAT(result.fit.message, Catch::Contains("two poses of marker"));
  }
  CAPTURE(told);
  test::check_rate(refused, trials, 0.9, 0.7);
}

TEST_CASE("a map that is not refused is hardly ever the wrong one of two", "[statistics]") {
  const int trials = test::trials(200, 24);
  Random random(32);
  int usable = 0, wrong = 0;
  for (int i = 0; i < trials; ++i) {
    const Target map = nearly_flat();
    const double distance = i % 4 == 0 ? 1.5 : 1.0;
    const auto result = estimate_marker_map(frontal(map, distance, 0.1, 0.3, random), lens, {.size = 0.05});
    if (!result.fit.usable()) continue;
    ++usable;
    wrong += std::any_of(map.map.begin() + 1, map.map.end(), [&](const MapMarker& marker) {
      const auto k = static_cast<std::size_t>(&marker - map.map.data());
      const Vector6 d = pose_difference(result.target.map[k].T_target_marker, marker.T_target_marker);
      return d.dot(result.covariance[k].ldlt().solve(d)) > uncertainty::chi_square_quantile(0.9999, 6);
    });
  }
  CAPTURE(usable, wrong, trials);
  test::check_rate(usable, trials, 0.5, 0.3);
  test::check_rare(wrong, usable, fit::pipeline::undecided, 0.06);
}

TEST_CASE("images that do not connect the markers are refused with the islands named") {
  Random random(2);
  auto images = sightings(1, 0.1, random);
  MarkerSighting apart = images[0];
  for (TagDetection& tag : apart.tags) tag.id += 20;
  images.push_back(apart);
  const auto result = estimate_marker_map(images, lens, {.size = 0.05});
  CHECK_FALSE(result.fit.usable());
  CHECK(result.islands.size() == 2);
  CHECK_THAT(result.fit.message, Catch::Contains("{2, 5, 7} {22, 25, 27}"));
}

TEST_CASE("no marker, one marker, two families, a wrong reference and a size of zero are each told") {
  Random random(2);
  auto images = sightings(2, 0.1, random);
  CHECK_THROWS_WITH(estimate_marker_map(images, lens, {}), Catch::Contains("size"));
  CHECK_THROWS_WITH(estimate_marker_map(images, lens, {.size = 0.05, .reference = 99}), Catch::Contains("99"));
  CHECK_FALSE(estimate_marker_map({}, lens, {.size = 0.05}).fit.usable());
  auto single = images;
  for (auto& image : single) image.tags.resize(1), image.tags[0].id = 2;
  CHECK_THAT(estimate_marker_map(single, lens, {.size = 0.05}).fit.message, Catch::Contains("only marker 2"));
  images[1].tags[0].family = "25h9";
  CHECK_THROWS_WITH(estimate_marker_map(images, lens, {.size = 0.05}), Catch::Contains("25h9"));
}

}  // namespace marker_map_test
