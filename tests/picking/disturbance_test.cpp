#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/picking/disturbance.hpp>

#include "support/rates.hpp"
#include "support/trials.hpp"

namespace disturbance_test {

using namespace kr5;
using namespace kr5::picking;
using Catch::Matchers::Contains;

namespace {

/// A dark scene of low contrast: blobs on a slope, drawn again with fresh noise.
struct Scene {
  int width = 160, height = 120;
  double noise = 2.0;
  std::function<double(double, double)> change = [](double, double) { return 0.0; };

  double grey(double u, double v) const {
    return 40 + 0.1 * u + (std::hypot(std::fmod(u, 29) - 15, std::fmod(v, 31) - 15) < 9 ? 14 : 0);
  }
};

struct Shot {
  int width = 0, height = 0;
  std::vector<std::uint8_t> pixels;
  ImageView view() const { return {pixels.data(), width, height, width}; }
};

Shot shoot(const Scene& scene, Random& random, double gain = 1.0, double offset = 0.0, double shift = 0.0) {
  Shot out{scene.width, scene.height, {}};
  for (int v = 0; v < scene.height; ++v)
    for (int u = 0; u < scene.width; ++u) {
      const double grey = gain * (scene.grey(u + shift, v) + scene.change(u, v)) + offset + random.normal(scene.noise);
      out.pixels.push_back(static_cast<std::uint8_t>(std::clamp(std::lround(grey), 0L, 255L)));
    }
  return out;
}

ImageNoise learn(const std::vector<Shot>& shots, const ImageNoiseOptions& options = {}) {
  std::vector<ImageView> views;
  for (const Shot& shot : shots) views.push_back(shot.view());
  return learn_image_noise(views, options);
}

ImageNoise learnt(const Scene& scene, Random& random, int images = 8) {
  std::vector<Shot> shots;
  for (int k = 0; k < images; ++k) shots.push_back(shoot(scene, random));
  return learn(shots);
}

/// A disc becomes brighter.
std::function<double(double, double)> disc(double x, double y, double radius, double by) {
  return [=](double u, double v) { return std::hypot(u - x, v - y) < radius ? by : 0.0; };
}

}  // namespace

TEST_CASE("the noise of each pixel is learnt, of an averaged one a third") {
  Random random(1);
  const Scene scene;
  const ImageNoise single = [&] {
    std::vector<Shot> shots;
    for (int k = 0; k < 12; ++k) shots.push_back(shoot(scene, random));
    return learn(shots, {.average = 0});
  }();
  REQUIRE(single.fit.usable());
  CHECK(single.spread.mean() == Approx(std::sqrt(4 + 1.0 / 12)).epsilon(0.03));
  const ImageNoise noise = learnt(scene, random);
  CHECK(noise.spread(60, 80) == Approx(std::sqrt(4 + 1.0 / 12) / 3).epsilon(0.3));
  CHECK(noise.spread.mean() == Approx(std::sqrt(4 + 1.0 / 12) / 3).epsilon(0.03));
  CHECK(noise.mean(60, 80) == Approx(scene.grey(80, 60)).margin(3));
  CHECK(noise.dof > 100);  // all pixels scatter alike
}

TEST_CASE("pixels that scatter more than others keep their own spread") {
  Random random(2);
  std::vector<Shot> shots;
  for (int k = 0; k < 12; ++k) {
    Shot shot = shoot({}, random);
    for (int v = 0; v < 120; ++v)  // a cable that swings
      for (int u = 100; u < 110; ++u) shot.pixels[v * 160 + u] += static_cast<std::uint8_t>(random.integer(60));
    shots.push_back(shot);
  }
  const ImageNoise noise = learn(shots, {.average = 0, .moved_share = 0.2});
  REQUIRE(noise.fit.usable());
  CHECK(noise.spread.block(0, 100, 120, 10).mean() > 4 * noise.spread.block(0, 0, 120, 90).mean());
  CHECK(noise.dof < 60);
}

TEST_CASE("an image of the scene at rest raises no alarm more often than promised", "[statistics]") {
  Random random(3);
  const Scene scene;
  const ImageNoise noise = learnt(scene, random);
  const int trials = test::trials(2000, 60);
  int alarms = 0;
  for (int k = 0; k < trials; ++k) {
    const Shot before = shoot(scene, random), after = shoot(scene, random);
    const auto change = find_changes(before.view(), after.view(), noise, {.false_alarms = 0.01, .min_region = 1});
    REQUIRE(change.usable());
    alarms += change.finding == ChangeFinding::Changed;
  }
  test::check_rare(alarms, trials, 0.015, 0.02);  // one in a hundred in the mean, over noises that are learnt
}

TEST_CASE("a change of ten grey levels is found where it is, and nothing else") {
  Random random(4);
  Scene scene;
  const ImageNoise noise = learnt(scene, random);
  const Shot before = shoot(scene, random);
  scene.change = disc(70, 50, 10, 10);
  const Shot after = shoot(scene, random);
  const auto change = find_changes(before.view(), after.view(), noise);
  REQUIRE(change.finding == ChangeFinding::Changed);
  REQUIRE(change.regions.size() == 1);
  CHECK_THAT(change.message, Contains("1 region changed"));
  int missed = 0, wrong = 0;
  for (int v = 0; v < scene.height; ++v)
    for (int u = 0; u < scene.width; ++u) {
      const double d = std::hypot(u - 70, v - 50);
      missed += d < 9 && !change.changed(v, u);
      wrong += d > 12.5 && change.changed(v, u);
    }
  CHECK(missed == 0);
  CHECK(wrong == 0);
  CHECK(change.regions[0].mean_change == Approx(10).margin(2));
  CHECK(change.regions[0].left == Approx(60).margin(2));
  CHECK(change.regions[0].bottom == Approx(60).margin(2));
}

TEST_CASE("a region smaller than asked for is no change") {
  Random random(5);
  Scene scene;
  const ImageNoise noise = learnt(scene, random);
  const Shot before = shoot(scene, random);
  Shot after = shoot(scene, random);
  after.pixels[60 * 160 + 80] = 200;  // a hot pixel, 3 x 3 when averaged
  CHECK(find_changes(before.view(), after.view(), noise).finding == ChangeFinding::Unchanged);
  CHECK(find_changes(before.view(), after.view(), noise, {.min_region = 9}).regions.size() == 1);
}

TEST_CASE("light that changed is taken out, and what moved is found all the same") {
  Random random(6);
  Scene scene;
  const ImageNoise noise = learnt(scene, random);
  const Shot before = shoot(scene, random);
  CHECK(find_changes(before.view(), shoot(scene, random, 1.15, 3).view(), noise).finding == ChangeFinding::Unchanged);
  scene.change = disc(40, 80, 15, -12);
  const auto change = find_changes(before.view(), shoot(scene, random, 1.15, 3).view(), noise);
  CHECK(change.finding == ChangeFinding::Changed);
  CHECK(change.regions.size() == 1);
  CHECK(change.gain == Approx(1.15).margin(0.02));
  CHECK(change.offset == Approx(3).margin(1));
  const auto bright = find_changes(before.view(), shoot(scene, random, 1.6).view(), noise);
  CHECK(bright.finding == ChangeFinding::LightChanged);
  CHECK_FALSE(bright.usable());
  CHECK_THAT(bright.message, Contains("the light changed by") && Contains("exposure"));
}

TEST_CASE("a camera that moved, and pictures without grey levels, are said") {
  Random random(7);
  const Scene scene;
  const ImageNoise noise = learnt(scene, random);
  const Shot before = shoot(scene, random);
  const auto moved = find_changes(before.view(), shoot(scene, random, 1, 0, 3.0).view(), noise);
  CHECK(moved.finding == ChangeFinding::CameraMoved);
  CHECK_THAT(moved.message, Contains("the camera or the bin moved"));
  const auto black = find_changes(before.view(), shoot(scene, random, 0.0).view(), noise);
  CHECK(black.finding == ChangeFinding::Saturated);
  CHECK_FALSE(black.usable());
  CHECK_THAT(black.message, Contains("black or white"));
}

TEST_CASE("images in which something moved are left out of the noise, and too few at rest are said") {
  Random random(8);
  Scene scene;
  std::vector<Shot> shots;
  for (int k = 0; k < 6; ++k) shots.push_back(shoot(scene, random));
  scene.change = disc(70, 50, 12, 60);
  shots.push_back(shoot(scene, random));
  const ImageNoise noise = learn(shots);
  REQUIRE(noise.fit.usable());
  CHECK(noise.left_out == 1);
  CHECK(noise.spread(50, 70) < 1.5);
  shots.erase(shots.begin() + 2, shots.begin() + 6);
  const ImageNoise none = learn(shots);
  CHECK_FALSE(none.fit.usable());
  CHECK_THAT(none.fit.message, Contains("something moved in 1 of 3 images"));
  shots.resize(2);
  CHECK_THAT(learn(shots).fit.message, Contains("three images of the scene at rest are needed"));
  CHECK_THROWS_WITH(find_changes(shots[0].view(), shots[1].view(), none), Contains("noise is not usable"));
}

TEST_CASE("images of different size, and options out of range, are refused") {
  Random random(9);
  const Scene scene;
  const ImageNoise noise = learnt(scene, random, 3);
  const Shot good = shoot(scene, random), small = shoot({.width = 80}, random);
  CHECK_THROWS_WITH(learn({good, small, good}), Contains("must all have the same size"));
  CHECK_THROWS_WITH(find_changes(good.view(), small.view(), noise), Contains("after") && Contains("160 x 120 px"));
  CHECK_THROWS_WITH(find_changes({}, good.view(), noise), Contains("before: the image is empty"));
  CHECK_THROWS_WITH(learn({good}, {.average = 50}), Contains("average must lie"));
  CHECK_THROWS_WITH(learn({good}, {.min_spread = 0}), Contains("min_spread"));
  CHECK_THROWS_WITH(find_changes(good.view(), good.view(), noise, {.false_alarms = 0}), Contains("false_alarms"));
  CHECK_THROWS_WITH(find_changes(good.view(), good.view(), noise, {.max_moved_tiles = 2}), Contains("max_moved_tiles"));
}

}  // namespace disturbance_test
