#include <cmath>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/force/contact_wrench.hpp>

#include "book_peg.hpp"

namespace contact_wrench_test {

using namespace kr5;
using namespace kr5::force;
using namespace kr5::test;

namespace {

ContactForce at_rest(const Pose& T, const ContactLaw& law = {}) {
  Stiction stiction;
  return contact_wrench(peg_tube_contacts(book, T), law, T, Vector6::Zero(), 0, stiction);
}

struct Roll {
  std::vector<double> alpha, height;
};

/// 1.5 kg held at 15 N over a fixed point of the tube, free along Z, leaning once round in six seconds.
Roll roll(const Eigen::Vector2d& centre, double tilt, double dt) {
  constexpr double held = 15, mass = 1.5, guide = 200, turn_time = 6;
  const ContactLaw law;
  Stiction stiction;
  double z = rest_peg_on_tube(radii, tilt, 0, centre).height, speed = 0;
  Roll out;
  for (int i = 0; i * dt < turn_time; ++i) {
    const double alpha = 2 * M_PI * i * dt / turn_time, ahead = alpha + 1e-6;
    const Pose T = leaning(tilt, alpha, {centre.x(), centre.y(), z});
    const Eigen::Vector3d turn =
        log_rotation(leaning(tilt, ahead, Eigen::Vector3d::Zero()).linear() * T.linear().transpose()) / 1e-6;
    Vector6 twist;
    twist << 0, 0, speed, turn * 2 * M_PI / turn_time;
    const ContactForce f = contact_wrench(peg_tube_contacts(book, T), law, T, twist, dt, stiction);
    speed += dt * (f.wrench.z() - held - guide * speed) / mass;
    z += dt * speed;
    out.alpha.push_back(alpha);
    out.height.push_back(z);
  }
  return out;
}

}  // namespace

TEST_CASE("a peg rolled under a held force draws the closed form's depth profile and its cusp") {
  const Eigen::Vector2d centre(-7.53e-3, -7.2e-3);
  const double tilt = 7.5 * degree;
  const Roll rolled = roll(centre, tilt, 1e-3);
  double error = 0, lowest = 1, direction = 0;
  for (std::size_t i = 0; i < rolled.alpha.size(); ++i) {
    const double expected = rest_peg_on_tube(radii, tilt, rolled.alpha[i], centre).height - 15.0 / 1e6;
    error += std::abs(rolled.height[i] - expected) / static_cast<double>(rolled.alpha.size());
    if (rolled.alpha[i] < M_PI_2 && rolled.height[i] < lowest) lowest = rolled.height[i], direction = rolled.alpha[i];
  }
  CHECK(error < 10 * micron);
  CHECK(direction / degree == Approx(std::atan2(7.2, 7.53) / degree).margin(1.5));
}

TEST_CASE("normal force is stiffness times depth whether one point carries the peg or many") {
  const ContactLaw law;
  CHECK(at_rest(leaning(0, 0, {8e-3, 0, -10 * micron})).normal == Approx(law.stiffness * 10 * micron).epsilon(1e-6));
  const double tilt = 7.5 * degree, low = rest_peg_on_tube(radii, tilt, 0, {1.5e-3, 0}).height;
  const ContactForce one = at_rest(leaning(tilt, 0, {1.5e-3, 0, low - 10 * micron}));
  CHECK(one.normal == Approx(law.stiffness * 10 * micron).epsilon(1e-3));
  CHECK(one.wrench.z() == Approx(one.normal).epsilon(1e-6));
  CHECK(one.wrench[4] == Approx(-one.normal * 9.42e-3 * std::cos(tilt)).epsilon(1e-3));
  CHECK(at_rest(leaning(tilt, 0, {1.5e-3, 0, low + micron})).normal == 0);
}

TEST_CASE("the wrench is continuous while the peg turns, lowers and straightens") {
  for (const double tilt : {0.2 * degree, 1.5 * degree, 7.5 * degree}) {
    const double deep = rest_peg_on_tube(radii, tilt, 40 * degree, {-7.53e-3, -7.2e-3}).height - 15 * micron;
    Vector6 last = Vector6::Zero();
    double jump = 0;
    for (int i = 0; i <= 4000; ++i) {
      const double part = i / 4000.0;
      const Pose T =
          leaning(tilt * (1 + 0.02 * part), (40 + 8 * part) * degree, {-7.53e-3, -7.2e-3, deep - 30 * micron * part});
      const Vector6 wrench = at_rest(T).wrench;
      if (i > 0) jump = std::max(jump, (wrench - last).head<3>().norm());
      last = wrench;
    }
    CAPTURE(tilt / degree);
    CHECK(last.z() > 5);
    CHECK(jump < 0.5);  // of 45 N; a step of the way is worth 0.01 N
  }
}

TEST_CASE("friction holds without creep below its limit and slides above it") {
  const ContactLaw law;
  const double depth = 20 * micron, weight = law.stiffness * depth;
  for (const double pull : {0.9, 1.1}) {
    Stiction stiction;
    double x = 8e-3, speed = 0, after = 0;
    const double dt = 1e-4, mass = 1.5;
    for (int i = 0; i < 40000; ++i) {
      const Pose T = leaning(0, 0, {x, 0, -depth});
      Vector6 twist = Vector6::Zero();
      twist[0] = speed;
      const ContactForce f = contact_wrench(peg_tube_contacts(book, T), law, T, twist, dt, stiction);
      CHECK(f.friction <= law.friction * f.normal * (1 + 1e-9));
      const double ramp = std::min(1.0, i * dt);
      speed += dt * (f.wrench.x() + ramp * pull * law.friction * weight) / mass;
      x += dt * speed;
      if (i == 20000) after = x;
      if (x > 9e-3) break;
    }
    CAPTURE(pull);
    if (pull < 1) {
      CHECK(x - 8e-3 < 1.05 * pull * law.friction * weight / law.tangential_stiffness);
      CHECK(std::abs(x - after) < 1e-9);  // two seconds later it has not moved
    } else {
      CHECK(x > 9e-3);
    }
  }
}

TEST_CASE("friction works against the motion, and damping takes energy") {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Pose T = leaning(random.uniform(0, 10) * degree, random.uniform(0, 7), {8e-3, 0, 0.3e-3 * random.uniform()});
    const Contacts contacts = peg_tube_contacts(book, T);
    if (contacts.count == 0) continue;
    Vector6 twist = random.normal_vector(6, 0.01);
    twist.tail<3>() *= 100;
    const ContactLaw still{.damping = 0}, slick{.damping = 0, .friction = 0};
    Stiction a, b;
    const double with = contact_wrench(contacts, still, T, twist, 1, a).wrench.dot(twist);
    const double without = contact_wrench(contacts, slick, T, twist, 1, b).wrench.dot(twist);
    CHECK(with <= without + 1e-9 * (1 + std::abs(without)));
  }
  const Pose T = leaning(0, 0, {8e-3, 0, -1e-5});
  Stiction stiction;
  const Contacts contacts = peg_tube_contacts(book, T);
  const double in = contact_wrench(contacts, {}, T, {0, 0, -0.05, 0, 0, 0}, 0, stiction).normal;
  const double out = contact_wrench(contacts, {}, T, {0, 0, 0.05, 0, 0, 0}, 0, stiction).normal;
  CHECK(in == Approx(10 * (1 + 5 * 0.05)));
  CHECK(out == Approx(10 * (1 - 5 * 0.05)));
  CHECK(contact_wrench(contacts, {}, T, {0, 0, 1, 0, 0, 0}, 0, stiction).normal == 0);  // never pulls
}

TEST_CASE("an upright peg that is turned is held by friction up to its arm") {
  const Pose T = leaning(0, 0, {0, 0, -1e-5});
  const PegTubeShape wide{
      .peg_radius = 12e-3, .peg_length = 0.05, .inner_radius = 9.7e-3, .outer_radius = 12.65e-3, .tube_depth = 0.06};
  Stiction stiction;
  ContactForce f;
  for (int i = 0; i < 1000; ++i)
    f = contact_wrench(peg_tube_contacts(wide, T), {}, T, {0, 0, 0, 0, 0, 0.1}, 1e-3, stiction);
  CHECK(-f.wrench[5] > 0.18 * 10 * 9.7e-3);
  CHECK(-f.wrench[5] < 0.18 * 10 * 12e-3);
}

namespace {

/// Lowers a free rigid peg that hangs in springs from a hand moving straight down; gives the depth reached and the
/// greatest force met.
struct Lowering {
  double depth = 0.0, force = 0.0;
};

Lowering lower(const PegTubeShape& shape, const Eigen::Vector2d& offset, double tilt) {
  constexpr double dt = 1e-4, mass = 1.5, inertia = 2e-3, spring = 23.4e3, turn_spring = 300, speed_down = 5e-3;
  const double damping = 2 * 0.5 * std::sqrt(spring * mass), turn_damping = 2 * 0.5 * std::sqrt(turn_spring * inertia);
  const ContactLaw law;
  Stiction stiction;
  Pose T = leaning(tilt, 0.7, {offset.x(), offset.y(), 0.2e-3});
  const Pose start = T;
  Vector6 v = Vector6::Zero();
  Lowering out;
  for (double t = 0; t < 2; t += dt) {
    const ContactForce f = contact_wrench(peg_tube_contacts(shape, T), law, T, v, dt, stiction);
    Eigen::Vector3d hand = start.translation();
    hand.z() -= speed_down * t;
    const Eigen::Vector3d hand_speed(0, 0, -speed_down);
    v.head<3>() +=
        dt / mass * (f.wrench.head<3>() + spring * (hand - T.translation()) + damping * (hand_speed - v.head<3>()));
    const Eigen::Vector3d off = log_rotation(start.linear() * T.linear().transpose());
    v.tail<3>() += dt / inertia * (f.wrench.tail<3>() + turn_spring * off - turn_damping * v.tail<3>());
    T.translation() += dt * v.head<3>();
    T.linear() = nearest_rotation(exp_rotation(dt * v.tail<3>()) * T.linear());
    out.force = std::max(out.force, f.wrench.head<3>().norm());
  }
  out.depth = -T.translation().z();
  return out;
}

}  // namespace

TEST_CASE("an upright peg enters the bore with 0.28 and with 0.05 mm to spare, and stays out when it is beside it") {
  for (const double spare : {0.28e-3, 0.05e-3}) {
    PegTubeShape shape = book;
    shape.peg_radius = shape.inner_radius - spare;
    for (double z = 1e-3; z > -20e-3; z -= 0.1e-3)
      CHECK(peg_tube_contacts(shape, leaning(0, 0, {0.9 * spare, 0, z})).count == 0);
    CHECK(peg_tube_contacts(shape, leaning(0, 0, {1.1 * spare, 0, -5e-3})).count > 0);
    const Lowering in = lower(shape, {0.9 * spare, 0}, 0.4 * degree);
    CAPTURE(spare, in.force);
    CHECK(in.depth > 9e-3);
    CHECK(in.force > 0.1);  // it rubs on the bore on its way
    CHECK(in.force < 60);
    const Lowering out = lower(shape, {5e-3, 0}, 0.1 * degree);
    CAPTURE(out.force);
    CHECK(out.depth < 0.5e-3);
    CHECK(out.force == Approx(23.4e3 * 10e-3).epsilon(0.2));
  }
}

TEST_CASE("a law that cannot be is refused") {
  CHECK_NOTHROW(ContactLaw{}.validate());
  CHECK_THROWS_WITH((ContactLaw{.stiffness = 0}.validate()), Catch::Contains("stiffness"));
  CHECK_THROWS_AS((ContactLaw{.friction = -1}.validate()), InvalidArgument);
}

}  // namespace contact_wrench_test
