#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/sim/bin_rays.hpp>
#include <kr5/sim/bin_scan.hpp>

namespace bin_scan_test {

using namespace kr5;
using Catch::Contains;
using Eigen::Index;
using Eigen::Vector3d;

namespace {

/// Pellets anywhere, also through each other: rays do not mind.
sim::PelletScene scattered(int count, int seed) {
  Random random(static_cast<std::uint64_t>(seed));
  sim::PelletScene scene;
  scene.bin.T_base_bin = from_xyzrpy((Vector6() << 0.7, 0.1, 0.2, 0.02, -0.03, 0.5).finished());
  for (int i = 0; i < count; ++i) {
    sim::Pellet pellet;
    pellet.T_bin_pellet = to_pose((Vector6() << random.uniform(-0.09, 0.09), random.uniform(-0.09, 0.09),
                                   random.uniform(0.01, 0.06), 2.0 * random.direction())
                                      .finished());
    pellet.height = random.uniform(0.014, 0.017);
    scene.pellets.push_back(pellet);
  }
  return scene;
}

bool inside(const sim::Pellet& pellet, const Vector3d& point) {
  const Vector3d p = pellet.T_bin_pellet.inverse() * point;
  return std::hypot(p.x(), p.y()) < pellet.radius && std::abs(p.z()) < 0.5 * pellet.height;
}

/// What is at a point of the bin, by the definition of each body.
int body_at(const sim::PelletScene& scene, const Vector3d& p) {
  for (std::size_t i = 0; i < scene.pellets.size(); ++i)
    if (inside(scene.pellets[i], p)) return static_cast<int>(i);
  const Vector3d half = 0.5 * scene.bin.size;
  const double t = scene.bin.wall, out = std::max(std::abs(p.x()) - half.x(), std::abs(p.y()) - half.y());
  if (out > t) return sim::BinNothing;
  if (p.z() < 0.0) return p.z() > -t ? sim::BinFloor : sim::BinNothing;
  return out > 0.0 && p.z() < scene.bin.size.z() ? sim::BinWall : sim::BinNothing;
}

sim::BinScannerOptions exact_scanner() {
  sim::BinScannerOptions out;
  out.noise = 0.0, out.specular = 0.0, out.points = 160, out.pitch = 0.002;
  return out;
}

}  // namespace

TEST_CASE("a ray meets what stands first on it, where small steps along it find it", "[not_sanitized]") {
  const sim::PelletScene scene = scattered(40, 1);
  const sim::BinRays rays(scene);
  Random random(2);
  int pellets = 0, walls = 0;
  for (int k = 0; k < 300; ++k) {
    const Vector3d origin(random.uniform(-0.15, 0.15), random.uniform(-0.15, 0.15), 0.25);
    const Vector3d aim(random.uniform(-0.12, 0.12), random.uniform(-0.12, 0.12), random.uniform(0.0, 0.05));
    const Vector3d direction = (aim - origin).normalized();
    const sim::BinHit hit = rays.first_hit(origin, direction);
    CAPTURE(k, hit.surface, hit.distance);
    constexpr double step = 5e-5;
    double walked = step;
    while (walked < 0.6 && body_at(scene, origin + walked * direction) == sim::BinNothing) walked += step;
    if (hit.surface == sim::BinNothing) {
      CHECK(walked >= 0.6);
      continue;
    }
    // Steps may jump over a corner.
    if (walked > hit.distance + step) {
      CHECK(body_at(scene, origin + (hit.distance + 1e-7) * direction) == hit.surface);
      continue;
    }
    CHECK(walked >= hit.distance - 1e-9);
    CHECK(body_at(scene, origin + (hit.distance - 1e-7) * direction) == sim::BinNothing);
    CHECK(hit.normal.norm() == Approx(1.0));
    CHECK(hit.normal.dot(direction) < 0.0);
    CHECK(body_at(scene, origin + hit.distance * direction - 1e-6 * hit.normal) == hit.surface);
    CHECK(rays.blocked(origin, direction, hit.distance + 1e-6));
    CHECK_FALSE(rays.blocked(origin, direction, hit.distance - 1e-6));
    pellets += hit.surface >= 0, walls += hit.surface == sim::BinWall;
  }
  CHECK(pellets > 50);
  CHECK(walls > 10);
}

TEST_CASE("readings of a scan lie on the surfaces they are said to be of") {
  const sim::PelletScene scene = scattered(30, 3);
  const sim::BinScannerOptions options = exact_scanner();
  const sim::BinScan scan = sim::scan_bin(scene, sim::scan_path(scene.bin, options), options);
  std::vector<int> surfaces;
  const auto cloud = scan.cloud(&surfaces);
  REQUIRE(cloud.rows() == static_cast<Index>(surfaces.size()));
  REQUIRE(cloud.rows() > 5000);
  const Pose T_bin_base = scene.bin.T_base_bin.inverse();
  double worst = 0.0;
  for (Index k = 0; k < cloud.rows(); ++k) {
    const Vector3d p = T_bin_base * Vector3d(cloud.row(k));
    const int surface = surfaces[static_cast<std::size_t>(k)];
    if (surface < 0) continue;
    const sim::Pellet& pellet = scene.pellets[static_cast<std::size_t>(surface)];
    const Vector3d q = pellet.T_bin_pellet.inverse() * p;
    worst = std::max(
        worst, std::abs(std::max(std::hypot(q.x(), q.y()) - pellet.radius, std::abs(q.z()) - 0.5 * pellet.height)));
  }
  CHECK(worst < 1e-12);
}

TEST_CASE("what the receiver does not see has no reading, though the laser meets it") {
  sim::PelletScene scene;
  sim::Pellet tall;
  tall.height = 0.05;
  tall.T_bin_pellet.translation() = Vector3d(0.0, 0.0, 0.025);
  scene.pellets = {tall};
  sim::BinScannerOptions options = exact_scanner();
  options.pitch = 0.0005;
  const sim::BinScan scan = sim::scan_bin(scene, sim::scan_path(scene.bin, options), options);
  const Index middle = scan.x.cols() / 2;
  // Y of the scanner is -Y of the bin: the receiver goes behind the laser. Behind the pellet, seen from there, the
  // shadow on the floor is as long as the triangle of baseline and height says.
  double lit = 0.0;
  for (Index k = 0; k < scan.times.size(); ++k) {
    const double y = (scan.T_base_flange[static_cast<std::size_t>(k)] * scan.T_flange_scanner).translation().y();
    const bool dark = std::isnan(scan.z(k, middle));
    if (y > 0.009 && y < 0.1 && dark) lit = std::max(lit, y);
    if (y < -0.009 && y > -0.08) CHECK_FALSE(dark);
  }
  const double slope = options.baseline / options.stand_off;  // of the ray from a point of the floor to the receiver
  CHECK(lit == Approx(0.008 + slope * 0.05).margin(8e-4));
  CHECK(scan.seen[0] == 1.0);

  // A second pellet in that shadow is hidden from the receiver alone: the share of it that is seen drops, though from
  // above all of it is exposed.
  sim::Pellet low;
  low.T_bin_pellet.translation() = Vector3d(0.0, 0.0165, 0.0075);
  scene.pellets.push_back(low);
  const sim::BinScan shaded = sim::scan_bin(scene, sim::scan_path(scene.bin, options), options);
  CHECK(sim::exposed_shares(scene)[1] == 1.0);
  CHECK(shaded.seen[0] == 1.0);
  CHECK(shaded.seen[1] < 0.9);
  CHECK(shaded.seen[1] > 0.1);
}

TEST_CASE("noise has the deviation asked for along the ray, grazing and shiny spots give no reading") {
  sim::PelletScene scene;
  sim::BinScannerOptions options;
  options.noise = 2e-4;
  const sim::ScanPath path = sim::scan_path(scene.bin, options);
  const sim::BinScan scan = sim::scan_bin(scene, path, options);
  double sum = 0.0, squares = 0.0;
  int count = 0, missing = 0, on_floor = 0;
  for (Index k = 0; k < scan.z.rows(); ++k)
    for (Index i = 0; i < scan.z.cols(); ++i) {
      if (scan.surface(k, i) != sim::BinFloor) continue;
      const double cosine = scan.z(k, i) / std::hypot(scan.x(k, i), scan.z(k, i));
      const double error = (scan.z(k, i) - 0.35) / cosine;
      sum += error, squares += error * error, ++count;
    }
  REQUIRE(count > 100000);
  CHECK(std::abs(sum / count) < 5.0 * 2e-4 / std::sqrt(count));
  CHECK(std::sqrt(squares / count) == Approx(2e-4).epsilon(0.02));

  // A mirror for the receiver: where the floor leans half the angle between laser and receiver.
  scene.bin.size = {0.22, 0.22, 0.001};
  scene.bin.T_base_bin = from_xyzrpy((Vector6() << 0, 0, 0, 0.5 * std::atan(options.baseline / 0.35), 0, 0).finished());
  for (const double streaks : {0.0, 1.0}) {
    options.streaks = streaks;
    const sim::BinScan shiny = sim::scan_bin(scene, path, options);
    const Index k = shiny.z.rows() / 2, i = shiny.z.cols() / 2;
    CAPTURE(streaks);
    CHECK(std::isnan(shiny.z(k, i)) == (streaks == 0.0));
    CHECK(shiny.surface(k, i) == sim::BinNothing);
    for (Index c = 0; c < shiny.z.cols(); ++c) missing += std::isnan(shiny.z(k, c)), ++on_floor;
  }
  CHECK(missing < on_floor / 2);
}

TEST_CASE("a delay shifts the cloud by speed times delay, along the motion of the scanner") {
  sim::PelletScene one = scattered(0, 1);
  sim::Pellet pellet;
  pellet.T_bin_pellet.translation() = Vector3d(0.01, -0.02, 0.0075);
  one.pellets = {pellet};
  sim::BinScannerOptions options = exact_scanner();
  options.speed = 0.1;
  options.pitch = 0.0002;
  const auto middle = [&](double delay) {
    options.delay = delay;
    std::vector<int> surfaces;
    const auto cloud = sim::scan_bin(one, sim::scan_path(one.bin, options), options).cloud(&surfaces);
    Vector3d low = Vector3d::Constant(1.0), high = -low;
    for (Index k = 0; k < cloud.rows(); ++k)
      if (surfaces[static_cast<std::size_t>(k)] == 0) {
        const Vector3d p = one.bin.T_base_bin.inverse() * Vector3d(cloud.row(k));
        low = low.cwiseMin(p), high = high.cwiseMax(p);
      }
    return Vector3d(0.5 * (low + high));
  };
  const Vector3d shift = middle(0.02) - middle(0.0);
  CHECK(shift.y() == Approx(0.002).margin(3e-4));
  CHECK(std::abs(shift.x()) < 3e-4);
}

TEST_CASE("exposed shares are those of circles that cover each other") {
  sim::PelletScene scene;
  const auto stand = [](double x, double z) {
    sim::Pellet out;
    out.T_bin_pellet.translation() = Vector3d(x, 0.0, z);
    return out;
  };
  scene.pellets = {stand(0.0, 0.0075), stand(0.008, 0.0225), stand(-0.05, 0.0075), stand(-0.05, 0.0225)};
  const Eigen::VectorXd shares = sim::exposed_shares(scene, 1e-4);
  const double r = 0.008, d = 0.008;  // common area of two circles
  const double lens = 2.0 * r * r * std::acos(d / (2.0 * r)) - 0.5 * d * std::sqrt(4.0 * r * r - d * d);
  CHECK(shares[0] == Approx(1.0 - lens / (M_PI * r * r)).margin(0.01));
  CHECK(shares[1] == 1.0);
  CHECK(shares[2] == Approx(0.0).margin(0.001));
  CHECK(shares[3] == 1.0);
}

TEST_CASE("a scan that cannot be made is refused by the name of its field") {
  sim::BinScannerOptions options;
  sim::ScanPath path = sim::scan_path(sim::BinShape{}, options);
  path.times[3] = path.times[2];
  CHECK_THROWS_WITH(sim::scan_bin({}, path, options), Contains("profiles 2 and 3"));
  path.T_base_flange.pop_back();
  CHECK_THROWS_WITH(sim::scan_bin({}, path, options), Contains("a pose for each"));
  options.far = 0.1;
  CHECK_THROWS_WITH(sim::scan_path({}, options), Contains("far"));
  CHECK_THROWS_WITH(sim::exposed_shares({}, 1.0), Contains("spacing"));
}

}  // namespace bin_scan_test
