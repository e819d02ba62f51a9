#include <catch2/catch.hpp>

#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/sim/bin_image.hpp>
#include <kr5/sim/bin_rays.hpp>

namespace bin_image_test {

using namespace kr5;
using Catch::Contains;
using Eigen::Vector3d;

namespace {

Pinhole bin_camera() {
  Pinhole out;
  out.width = 160, out.height = 120, out.fx = out.fy = 250.0, out.cx = 79.5, out.cy = 59.5;
  out.k1 = -0.2;
  return out;
}

sim::PelletScene two_pellets() {
  sim::PelletScene scene;
  scene.bin.T_base_bin = from_xyzrpy((Vector6() << 0.6, -0.1, 0.1, 0.0, 0.0, 0.7).finished());
  sim::Pellet standing, lying;
  standing.T_bin_pellet.translation() = Vector3d(0.03, 0.02, 0.0075);
  lying.T_bin_pellet = from_xyzrpy((Vector6() << -0.03, -0.02, 0.008, 0.0, M_PI / 2, 0.0).finished());
  scene.pellets = {standing, lying};
  return scene;
}

}  // namespace

TEST_CASE("pellets are in the picture where the camera projects their points") {
  const sim::PelletScene scene = two_pellets();
  const Pinhole camera = bin_camera();
  const Pose T_base_camera = sim::camera_above(scene.bin, 0.4);
  const sim::BinImage image = sim::render_bin(scene, camera, T_base_camera);
  REQUIRE(image.grey.rows() == 120);
  REQUIRE(image.grey.cols() == 160);
  const Pose T_camera_bin = T_base_camera.inverse() * scene.bin.T_base_bin;
  for (int i = 0; i < 2; ++i) {
    const Vector3d middle = scene.pellets[static_cast<std::size_t>(i)].T_bin_pellet.translation();
    // Just inside and just outside the top edges, which the sides of the pellet do not hide.
    const double top = i == 0 ? 0.015 : 0.016, x = i == 0 ? 0.0 : 0.0075;
    const auto at = [&](const Vector3d& p) {
      const Eigen::Vector2d pixel = camera.project(T_camera_bin * p);
      return image.surface(std::lround(pixel.y()), std::lround(pixel.x()));
    };
    CHECK(at({middle.x(), middle.y(), top}) == i);
    CHECK(at({middle.x() + 0.8 * x, middle.y(), top}) == i);
    CHECK(at({middle.x() + 0.02, middle.y() + 0.02, 0.0}) == sim::BinFloor);
  }
  CHECK((image.surface.array() == sim::BinWall).count() > 100);
}

TEST_CASE("grey levels follow Lambert's law without gloss, and lie in shadow at the ambient light") {
  sim::PelletScene scene = two_pellets();
  scene.pellets[0].height = 0.06, scene.pellets[0].T_bin_pellet.translation().z() = 0.03;
  sim::BinImageOptions options;
  options.gloss = 0.0, options.noise = 0.0, options.blur = 0.0;
  options.light = Vector3d(0.1, 0.0, 0.1);  // X of the camera is X of the bin: shadows lie at smaller x
  const Pinhole camera = bin_camera();
  const Pose T_base_camera = sim::camera_above(scene.bin, 0.4);
  const sim::BinImage image = sim::render_bin(scene, camera, T_base_camera, options);
  const Pose T_camera_bin = T_base_camera.inverse() * scene.bin.T_base_bin;
  const auto grey = [&](const Vector3d& p) {
    const Eigen::Vector2d pixel = camera.project(T_camera_bin * p);
    return static_cast<double>(image.grey(std::lround(pixel.y()), std::lround(pixel.x())));
  };
  const Vector3d lamp(0.1, 0.0, 0.3);
  for (const Vector3d& p : {Vector3d(0.0, 0.06, 0.0), Vector3d(0.05, -0.04, 0.0)}) {
    const double facing = (lamp - p).normalized().z();
    CHECK(grey(p) == Approx(255.0 * options.gain * options.bin_albedo * (options.ambient + facing)).margin(1.0));
  }
  CHECK(grey({0.015, 0.0235, 0.0}) == Approx(255.0 * options.gain * options.bin_albedo * options.ambient).margin(0.6));

  options.gloss = 0.5;
  const sim::BinImage shiny = sim::render_bin(scene, camera, T_base_camera, options);
  CHECK(shiny.grey.cast<int>().maxCoeff() > 2 * image.grey.cast<int>().maxCoeff());
  options.noise = 3.0, options.gloss = 0.0;
  const sim::BinImage noisy = sim::render_bin(scene, camera, T_base_camera, options);
  const Eigen::ArrayXXd error = (noisy.grey.cast<double>() - image.grey.cast<double>()).array();
  CHECK(std::sqrt(error.square().mean()) == Approx(3.0).epsilon(0.08));
}

TEST_CASE("a picture that cannot be rendered is refused by the name of its field") {
  sim::BinImageOptions options;
  options.gloss = 1.5;
  CHECK_THROWS_WITH(sim::render_bin({}, bin_camera(), Pose::Identity(), options), Contains("gloss"));
  CHECK_THROWS_WITH(sim::render_bin({}, Pinhole{}, Pose::Identity()), Contains("width"));
  CHECK_THROWS_WITH(sim::camera_above({}, -1.0), Contains("height"));
}

}  // namespace bin_image_test
