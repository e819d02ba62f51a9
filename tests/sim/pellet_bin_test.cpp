#include <catch2/catch.hpp>

#include <cmath>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/sim/pellet_bin.hpp>

namespace pellet_bin_test {

using namespace kr5;
using Catch::Contains;
using Eigen::Vector3d;

namespace {

sim::BinShape small_bin() {
  sim::BinShape bin;
  bin.size = {0.1, 0.09, 0.1};
  return bin;
}

/// A pile of 30 that most tests share.
const sim::SettledPile& small_pile() {
  static const sim::SettledPile pile = [] {
    sim::PourOptions pour;
    pour.pellets = 30, pour.width = 0.06;
    return sim::pour_pellets(small_bin(), pour);
  }();
  return pile;
}

sim::Pellet pellet_at(double x, double y, double z, const Vector3d& axis = Vector3d::UnitZ()) {
  sim::Pellet out;
  out.T_bin_pellet.translation() = Vector3d(x, y, z);
  out.T_bin_pellet.linear() = rotation_from_z(axis);
  return out;
}

/// How deep a point lies in a pellet; not positive outside.
double depth_in(const sim::Pellet& pellet, const Vector3d& point) {
  const Vector3d p = pellet.T_bin_pellet.inverse() * point;
  return std::min(pellet.radius - std::hypot(p.x(), p.y()), 0.5 * pellet.height - std::abs(p.z()));
}

/// A random point of a pellet's volume.
Vector3d random_point(const sim::Pellet& pellet, Random& random) {
  const double angle = random.uniform(0.0, 2.0 * M_PI), r = pellet.radius * std::sqrt(random.uniform());
  return pellet.T_bin_pellet *
         Vector3d(r * std::cos(angle), r * std::sin(angle), pellet.height * random.uniform(-0.5, 0.5));
}

double share_with_axis(const sim::PelletScene& scene, double least, double most) {
  int count = 0;
  for (const sim::Pellet& p : scene.pellets) {
    const double cosine = std::abs(p.T_bin_pellet.linear()(2, 2));
    count += cosine >= least && cosine <= most;
  }
  return count / static_cast<double>(scene.pellets.size());
}

}  // namespace

TEST_CASE("pellets poured into a bin come to rest in it and hardly overlap") {
  const auto& [scene, state] = small_pile();
  REQUIRE(scene.pellets.size() == 30);
  CHECK(state.at_rest);
  CHECK(state.speed == 0.0);
  CHECK(state.penetration < 3e-4);
  Random random(3);
  double deepest = 0.0, beyond = -1.0;
  for (std::size_t i = 0; i < scene.pellets.size(); ++i)
    for (int k = 0; k < 3000; ++k) {
      const Vector3d p = random_point(scene.pellets[i], random);
      for (std::size_t j = 0; j < scene.pellets.size(); ++j)
        if (j != i) deepest = std::max(deepest, depth_in(scene.pellets[j], p));
      beyond = std::max({beyond, -p.z(), std::abs(p.x()) - 0.05, std::abs(p.y()) - 0.045, p.z() - 0.1});
    }
  CHECK(deepest < 3e-4);
  CHECK(beyond < 3e-4);
  CHECK(share_with_axis(scene, 0.0, 0.1) > 0.1);     // lying
  CHECK(share_with_axis(scene, 0.995, 1.0) > 0.05);  // standing
  CHECK(share_with_axis(scene, 0.1, 0.995) > 0.1);   // leaning
  for (const sim::Pellet& p : scene.pellets) CHECK((p.height >= 0.014 && p.height <= 0.017));
}

TEST_CASE("a pile carries itself: stepped on, it stays where it is") {
  const sim::SettledPile again = sim::settle(small_pile().scene);
  CHECK(again.state.at_rest);
  int moved = 0;
  for (std::size_t i = 0; i < again.scene.pellets.size(); ++i)
    moved +=
        (again.scene.pellets[i].T_bin_pellet.translation() - small_pile().scene.pellets[i].T_bin_pellet.translation())
            .norm() > 5e-4;
  CHECK(moved <= 1);
}

TEST_CASE("the same seed gives the same pile and another seed another") {
  sim::PourOptions pour;
  pour.pellets = 6, pour.width = 0.05;
  const auto z = [&](int seed) {
    pour.seed = seed;
    return sim::pour_pellets(small_bin(), pour).scene.pellets.back().T_bin_pellet.matrix().eval();
  };
  CHECK(z(4) == z(4));
  CHECK(z(4) != z(5));
}

TEST_CASE("a pellet that falls lands in the time of the law of free fall, and lies at its height") {
  sim::PelletScene scene{small_bin(), {pellet_at(0.0, 0.0, 0.0575)}};
  sim::PileOptions options;
  options.restitution = 0.0;
  const sim::SettledPile out = sim::settle(scene, options);
  CHECK(out.scene.pellets[0].T_bin_pellet.translation().z() == Approx(0.0075).margin(3e-5));
  // 0.1 s still, after a fall of 50 mm.
  CHECK(out.state.time == Approx(std::sqrt(2.0 * 0.05 / 9.81) + 0.1).margin(0.02));
}

TEST_CASE("a rod that leans on a wall slides down below the friction at which a ladder does") {
  // Slides when tan(lean) > 2 mu / (1 - mu^2): at 20 degrees below mu = 0.176.
  const double lean = 20.0 * M_PI / 180.0, half = 0.03, radius = 0.002;
  sim::Pellet rod = pellet_at(0.0, 0.0, half * std::cos(lean) + radius * std::sin(lean) + 1e-5,
                              {std::sin(lean), 0.0, std::cos(lean)});
  rod.radius = radius, rod.height = 2.0 * half;
  rod.T_bin_pellet.translation().x() = 0.05 - half * std::sin(lean) - radius * std::cos(lean) - 1e-5;
  const sim::PelletScene scene{small_bin(), {rod}};
  sim::PileOptions options;
  const auto tilt = [&](double friction) {
    options.friction = friction;
    return std::acos(std::abs(sim::settle(scene, options).scene.pellets[0].T_bin_pellet.linear()(2, 2)));
  };
  CHECK(tilt(0.25) == Approx(lean).margin(0.01));
  CHECK(tilt(0.1) > 1.5);
}

TEST_CASE("a tower of upright pellets stands, and a pellet on a round back rolls off") {
  sim::PelletScene tower{small_bin(), {}};
  for (int k = 0; k < 4; ++k) tower.pellets.push_back(pellet_at(0.001 * k, 0.0, 0.0075 + 0.015 * k));
  const sim::SettledPile standing = sim::settle(tower);
  CHECK(standing.state.at_rest);
  for (std::size_t k = 0; k < 4; ++k) {
    CAPTURE(k);
    const Vector3d before = tower.pellets[k].T_bin_pellet.translation();
    CHECK((standing.scene.pellets[k].T_bin_pellet.translation() - before).norm() < 2e-4);
  }

  sim::PelletScene pair{small_bin(), {pellet_at(0.0, 0.0, 0.008, Vector3d::UnitX())}};
  pair.pellets.push_back(pellet_at(0.0, 0.004, 0.0235, Vector3d::UnitX()));
  const sim::SettledPile rolled = sim::settle(pair);
  CHECK(rolled.scene.pellets[1].T_bin_pellet.translation().z() == Approx(0.008).margin(1e-4));
  const Vector3d apart =
      rolled.scene.pellets[1].T_bin_pellet.translation() - rolled.scene.pellets[0].T_bin_pellet.translation();
  CHECK(apart.norm() > 0.0159);
}

TEST_CASE("pellets that overlap are told so, and part as they fall") {
  Random random(5);
  int overlapping = 0;
  for (int trial = 0; trial < 60; ++trial) {
    sim::PelletScene scene{
        small_bin(), {pellet_at(0.0, 0.0, 0.04, random.direction()), pellet_at(0.0, 0.0, 0.04, random.direction())}};
    scene.pellets[1].T_bin_pellet.translation() += random.uniform(0.0145, 0.016) * random.direction();
    double deepest = 0.0;
    for (int k = 0; k < 20000; ++k)
      deepest = std::max({deepest, depth_in(scene.pellets[1], random_point(scene.pellets[0], random)),
                          depth_in(scene.pellets[0], random_point(scene.pellets[1], random))});
    const double told = sim::deepest_overlap(scene);
    CAPTURE(trial, told, deepest);
    CHECK(told >= deepest - 2e-4);
    overlapping += deepest > 1e-4;
    const sim::SettledPile parted = sim::settle(scene);
    CHECK(parted.state.penetration < 3e-4);
  }
  CHECK(overlapping > 10);
}

TEST_CASE("a pellet pulled out leaves the others, what stood on it falls, and far ones stay") {
  sim::PelletScene scene{small_bin(),
                         {pellet_at(0.0, 0.0, 0.0075), pellet_at(0.0, 0.0, 0.0225), pellet_at(0.035, 0.03, 0.0075)}};
  const sim::Removal top = sim::remove_pellet(scene, 1, {0.3, 0.0, 1.0});
  CHECK(top.removed);
  REQUIRE(top.scene.pellets.size() == 2);
  CHECK(top.shift.size() == 3);
  CHECK(top.shift[2] < 1e-5);
  CHECK(top.shift[1] == 0.0);
  CHECK(top.scene.pellets[1].T_bin_pellet.translation().x() == Approx(0.035).margin(1e-5));

  // Pulled to the side from below, it takes the support away.
  const sim::Removal below = sim::remove_pellet(scene, 0, {1.0, 0.0, 0.05});
  REQUIRE(below.removed);
  CHECK(below.moved == std::vector<int>{1});
  CHECK(below.scene.pellets[0].T_bin_pellet.translation().z() < 0.0125);
  CHECK(below.shift[1] > 0.01);
  CHECK(below.state.at_rest);
}

TEST_CASE("a suction cup too weak for the pile above it loses the pellet, which stays in the bin") {
  sim::PelletScene scene{small_bin(), {}};
  for (int k = 0; k < 5; ++k) scene.pellets.push_back(pellet_at(0.0, 0.0, 0.0075 + 0.015 * k));
  sim::RemovalOptions weak;
  weak.force = 0.12;  // more than the weight of one, 0.074 N, and less than that of five
  const sim::Removal out = sim::remove_pellet(scene, 0, {0.0, 0.0, 1.0}, weak);
  CHECK_FALSE(out.removed);
  CHECK(out.scene.pellets.size() == 5);
  weak.force = 6.0;
  CHECK(sim::remove_pellet(scene, 4, {0.0, 0.0, 1.0}, weak).removed);
}

TEST_CASE("a bin that cannot be filled as asked is refused by name") {
  sim::PourOptions pour;
  pour.pellets = 60;
  sim::BinShape low = small_bin();
  low.size.z() = 0.02;
  CHECK_THROWS_WITH(sim::pour_pellets(low, pour), Contains("pellets: the pile of 60") && Contains("larger bin"));
  low.size.x() = 0.01;
  CHECK_THROWS_WITH(sim::pour_pellets(low, pour), Contains("size"));
  pour.height_max = 0.01;
  CHECK_THROWS_WITH(sim::pour_pellets(small_bin(), pour), Contains("height_max"));
  CHECK_THROWS_WITH(sim::remove_pellet(small_pile().scene, 30, {0.0, 0.0, 1.0}), Contains("pellet: must be 0 to 29"));
  CHECK_THROWS_WITH(sim::remove_pellet(small_pile().scene, 0, {0.0, 0.0, -1.0}), Contains("approach"));
  sim::PelletScene bad = small_pile().scene;
  bad.pellets[4].radius = std::nan("");
  CHECK_THROWS_WITH(sim::settle(bad), Contains("pellets[4].radius"));
}

}  // namespace pellet_bin_test
