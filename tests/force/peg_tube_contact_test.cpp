#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

#include "book_peg.hpp"
#include "support/trials.hpp"

namespace peg_tube_contact_test {

using namespace kr5;
using namespace kr5::force;
using namespace kr5::test;

namespace {

bool in_tube(const PegTubeShape& s, const Eigen::Vector3d& p) {
  const double rho = p.head<2>().norm();
  return p.z() < 0 && p.z() > -s.tube_depth && rho > s.inner_radius && rho < s.outer_radius &&
         rho - p.z() > s.inner_radius + s.tube_chamfer;
}

bool in_peg(const PegTubeShape& s, const Eigen::Vector3d& p) {
  const double rho = p.head<2>().norm();
  return p.z() > 0 && p.z() < s.peg_length && rho < s.peg_radius && rho - p.z() < s.peg_radius - s.peg_chamfer;
}

/// Dense sampling of all edges of both bodies, and of rings on the faces between.
bool overlap(const PegTubeShape& s, const Pose& T, int n = 30000) {
  const Pose T_inv = T.inverse();
  const double c = s.peg_chamfer, k = s.tube_chamfer;
  for (int i = 0; i < n; ++i) {
    const double a = 2 * M_PI * (i + 0.5) / n, x = std::cos(a), y = std::sin(a);
    for (const double part : {0.0, 0.5, 1.0}) {
      const double r = s.peg_radius - (1 - part) * c, R = s.inner_radius + (1 - part) * k;
      if (in_tube(s, T * Eigen::Vector3d(r * x, r * y, part * c))) return true;
      if (in_peg(s, T_inv * Eigen::Vector3d(R * x, R * y, -part * k))) return true;
    }
    if (in_peg(s, T_inv * Eigen::Vector3d(s.outer_radius * x, s.outer_radius * y, 0))) return true;
  }
  return false;
}

Pose moved(const Pose& T, const Eigen::Vector3d& by) { return Eigen::Translation3d(by) * T; }

/// Moves a free peg along `way` until it overlaps by `depth` more than touching.
Pose push(const PegTubeShape& s, const Pose& start, const Eigen::Vector3d& way, double reach, double depth) {
  double free = 0, caught = reach;
  for (int i = 0; i < 18; ++i) {
    const double middle = 0.5 * (free + caught);
    (overlap(s, moved(start, middle * way)) ? caught : free) = middle;
  }
  return moved(start, (caught + depth) * way);
}

/// Tells of a pose with one contact whether moving out by its depth frees the peg, and by less does not; in microns.
void check_single(const PegTubeShape& s, const Pose& T, const ContactPoint& c) {
  CAPTURE(name_of(c.touch), c.depth, c.normal.transpose(), c.point.transpose());
  CHECK(c.normal.norm() == Approx(1).margin(1e-12));
  CHECK_FALSE(overlap(s, moved(T, (c.depth + micron) * c.normal)));
  CHECK(overlap(s, moved(T, (c.depth - micron) * c.normal)));
}

PegTubeShape chamfered() {
  PegTubeShape s = book;
  s.peg_chamfer = 0.5e-3;
  s.tube_chamfer = 0.4e-3;
  return s;
}

}  // namespace

TEST_CASE("the depth of a peg pressed on the top is what frees it, to 1 micron", "[statistics]") {
  Random random(1);
  int single = 0, met[3] = {};
  const int tries = test::trials(300, 300);
  for (int i = 0; i < tries; ++i) {
    const PegTubeShape s = i % 2 ? chamfered() : book;
    const double tilt = random.uniform(0.05, 30) * degree, alpha = random.uniform(0, 7);
    const Eigen::Vector2d c =
        random.uniform(0, 22e-3) * Eigen::Rotation2Dd(random.uniform(0, 7)).toRotationMatrix().col(0);
    const Pose start = leaning(tilt, alpha, {c.x(), c.y(), 12e-3});
    if (overlap(s, start) || !overlap(s, moved(start, {0, 0, -12e-3 + micron}))) continue;
    const Pose T = push(s, start, -Eigen::Vector3d::UnitZ(), 12e-3, random.uniform(2, 20) * micron);
    const Contacts contacts = peg_tube_contacts(s, T);
    REQUIRE(contacts.count > 0);
    int exact = 0;
    for (const ContactPoint& p : contacts) exact += p.touch != ContactFeature::Sample;
    if (exact != 1) continue;
    for (const ContactPoint& p : contacts)
      if (p.touch != ContactFeature::Sample) {
        ++single;
        ++met[static_cast<int>(p.touch)];
        check_single(s, T, p);
      }
  }
  CHECK(single > tries / 3);
  for (const int count : met) CHECK(count > tries / 60);
}

TEST_CASE("the depth of a peg in the bore pressed to its wall is what frees it, to 1 micron", "[statistics]") {
  Random random(2);
  int single = 0;
  const int tries = test::trials(140, 140);
  for (int i = 0; i < tries; ++i) {
    const PegTubeShape s = i % 2 ? chamfered() : book;
    const double deep = random.uniform(1e-3, 20e-3);
    const double tilt = random.uniform(0, 0.3) * 0.28e-3 / deep, azimuth = random.uniform(0, 7);
    const Pose start = leaning(tilt, random.uniform(0, 7), {0, 0, -deep});
    if (overlap(s, start)) continue;
    const Eigen::Vector3d way(std::cos(azimuth), std::sin(azimuth), 0);
    const Pose T = push(s, start, way, 2e-3, random.uniform(2, 20) * micron);
    const Contacts contacts = peg_tube_contacts(s, T);
    REQUIRE(contacts.count > 0);
    const ContactPoint* deepest = contacts.begin();
    for (const ContactPoint& p : contacts)
      if (p.depth > deepest->depth) deepest = &p;
    int exact = 0;
    for (const ContactPoint& p : contacts) exact += p.touch != ContactFeature::Sample;
    CHECK(deepest->normal.dot(way) < 0);
    if (exact != 1) continue;
    ++single;
    check_single(s, T, *deepest);
  }
  CHECK(single > tries / 4);
}

TEST_CASE("there are contacts when the bodies overlap and none when they do not") {
  Random random(3);
  int touching = 0;
  for (int i = 0; i < 1500; ++i) {
    const PegTubeShape s = i % 2 ? chamfered() : book;
    const Eigen::Vector2d c =
        random.uniform(0, 14e-3) * Eigen::Rotation2Dd(random.uniform(0, 7)).toRotationMatrix().col(0);
    const double tilt = std::pow(random.uniform(), 3) * 30 * degree, alpha = random.uniform(0, 7);
    PegTube top{s.peg_radius, s.inner_radius, s.outer_radius};
    double height = rest_peg_on_tube(top, tilt, alpha, c).height;
    if (std::isnan(height)) height = -random.uniform(0, 20e-3);
    const Pose T = leaning(tilt, alpha, {c.x(), c.y(), height + random.normal(20 * micron)});
    const bool over = overlap(s, moved(T, Eigen::Vector3d::Zero()), 8000);
    const Contacts contacts = peg_tube_contacts(s, T);
    CAPTURE(i, tilt, c.transpose(), contacts.depth());
    touching += over;
    if (over) CHECK(contacts.count > 0);
    if (!over) CHECK(contacts.depth() < micron);  // the rough sampling may miss less
  }
  CHECK(touching > 500);
  CHECK(touching < 1400);
}

TEST_CASE("pressed from above, depth along the normal is the closed form's to second order") {
  Random random(4);
  int met = 0;
  for (int i = 0; i < 1000; ++i) {
    const double tilt = random.uniform(3, 25) * degree, alpha = random.uniform(0, 7), press = 20 * micron;
    const Eigen::Vector2d c =
        random.uniform(8e-3, 13e-3) * Eigen::Rotation2Dd(random.uniform(0, 7)).toRotationMatrix().col(0);
    const PegRest rest = rest_peg_on_tube({9.42e-3, 9.7e-3, 12.65e-3}, tilt, alpha, c);
    // Where rim and circle nearly touch along their way, the overlap is long and the second order large.
    if (rest.kind == RestContact::None || rest.by_centre.norm() > 2 * std::tan(tilt)) continue;
    const Contacts contacts = peg_tube_contacts(book, leaning(tilt, alpha, {c.x(), c.y(), rest.height - press}));
    double deepest = 0;
    for (const ContactPoint& p : contacts) {
      if (p.depth / p.normal.z() < deepest) continue;
      deepest = p.depth / p.normal.z();
      if ((rest.point - rest.mirrored).norm() == 0 && rest.kind != RestContact::RimOnInnerEdge)
        CHECK((p.point.head<2>() - rest.point).norm() < 1e-4);
    }
    ++met;
    CAPTURE(i, name_of(rest.kind), rest.by_centre.norm());
    CHECK(deepest == Approx(press).margin(micron));
  }
  CHECK(met > 500);
}

TEST_CASE("where one feature hands over to the next the contact holds the peg as before, by brute force",
          "[not_sanitized]") {
  const Eigen::Vector2d c(-7.53e-3, -7.2e-3);
  const double tilt = 7.5 * degree, press = 15 * micron;
  // Rim from edge to face and back, rim to face of the peg, from one side of the tube to the other.
  for (const double at : {102.4, 123.0, 176.9, 270.5, 344.9})
    for (double beside = -0.5; beside < 0.5; beside += 0.08) {
      const double alpha = (at + beside) * degree;
      const Pose T = push(book, leaning(tilt, alpha, {c.x(), c.y(), 5e-3}), -Eigen::Vector3d::UnitZ(), 8e-3, press);
      double deepest = 0;
      for (const ContactPoint& p : peg_tube_contacts(book, T))
        if (p.normal.z() > 0.5) deepest = std::max(deepest, p.depth / p.normal.z());
      CAPTURE(at + beside);
      CHECK(deepest == Approx(press).margin(micron));
    }
}

TEST_CASE("around every hand-over of a roll the contact is as deep as the peg is pressed") {
  Random random(5);
  int met = 0;
  for (int i = 0; i < 60; ++i) {
    const double tilt = random.uniform(3, 25) * degree, press = random.uniform(5, 20) * micron;
    const Eigen::Vector2d c =
        random.uniform(8e-3, 13e-3) * Eigen::Rotation2Dd(random.uniform(0, 7)).toRotationMatrix().col(0);
    const auto rest = [&](double alpha) { return rest_peg_on_tube(radii, tilt, alpha, c); };
    for (double alpha = 0; alpha < 2 * M_PI; alpha += 0.01) {
      if (rest(alpha).kind == rest(alpha + 0.01).kind) continue;
      for (double beside = -0.01; beside < 0.02; beside += 2e-4) {
        const PegRest at = rest(alpha + beside);
        if (at.kind == RestContact::None || at.by_centre.norm() > 2 * std::tan(tilt)) continue;
        double deepest = 0;
        for (const ContactPoint& p :
             peg_tube_contacts(book, leaning(tilt, alpha + beside, {c.x(), c.y(), at.height - press})))
          if (p.normal.z() > 0.5) deepest = std::max(deepest, p.depth / p.normal.z());
        ++met;
        CAPTURE(i, alpha + beside, name_of(at.kind));
        CHECK(deepest == Approx(press).margin(micron));
      }
    }
  }
  CHECK(met > 5000);
}

TEST_CASE("the contacts of a mirrored pose are the mirrored contacts") {
  for (const double tilt : {0.0, 0.5 * degree, 2 * degree, 7.5 * degree}) {
    const Pose T =
        leaning(tilt, 0,
                {-10.418e-3, 0,
                 rest_peg_on_tube({9.42e-3, 9.7e-3, 12.65e-3}, tilt, 0, Eigen::Vector2d(-10.418e-3, 0)).height - 2e-5});
    Eigen::Vector3d sum = Eigen::Vector3d::Zero(), centre = sum;
    const Contacts contacts = peg_tube_contacts(book, T);
    REQUIRE(contacts.count >= 2);
    for (const ContactPoint& p : contacts) {
      sum += p.weight * p.depth * p.normal;
      centre += p.weight * p.depth * p.point;
    }
    CHECK(std::abs(sum.y()) < 1e-6 * sum.z());
    CHECK(std::abs(centre.y()) < micron * sum.z());  // their centre of force lies on the plane of symmetry
  }
}

TEST_CASE("an upright peg is carried by samples of all edges that overlap") {
  const Contacts contacts = peg_tube_contacts(book, leaning(0, 0, {8e-3, 0, -10 * micron}));
  CHECK(contacts.count >= 12);
  CHECK(contacts.count < Contacts::capacity);
  CHECK(contacts.depth() == Approx(10 * micron).margin(1e-9));
  CHECK(peg_tube_contacts(book, leaning(0, 0, {0.05e-3, 0, -5e-3})).count == 0);  // free in the bore
}

TEST_CASE("the bench meets the lowest point of a tilted peg, and the whole rim of an upright one") {
  const double lowest = 9.42e-3 * std::sin(0.1);
  const Contacts tilted = peg_bench_contacts(book, leaning(0.1, 1.0, {0.3, 0.2, lowest - 1e-5}));
  REQUIRE(tilted.count == 1);
  CHECK(tilted.points[0].depth == Approx(1e-5).margin(1e-12));
  CHECK((tilted.points[0].point.head<2>() - Eigen::Vector2d(0.3, 0.2)).norm() == Approx(9.42e-3 * std::cos(0.1)));
  const Contacts upright = peg_bench_contacts(book, leaning(0, 0, {0, 0, -1e-5}));
  CHECK(upright.count == 24);
  CHECK(peg_bench_contacts(book, leaning(0, 0, {0, 0, 1e-9})).count == 0);
}

TEST_CASE("a shape that cannot be is refused") {
  PegTubeShape s = book;
  CHECK_NOTHROW(s.validate());
  s.outer_radius = s.inner_radius;
  CHECK_THROWS_WITH(s.validate(), Catch::Contains("outer_radius"));
  s = book;
  s.tube_chamfer = 0.01;
  CHECK_THROWS_AS(s.validate(), InvalidArgument);
}

}  // namespace peg_tube_contact_test
