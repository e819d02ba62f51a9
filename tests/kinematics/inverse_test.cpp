#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/kinematics/inverse.hpp>

#include "kinematics/postures.hpp"
#include "kinematics/random_chain.hpp"

namespace inverse_test {

using namespace kr5;
using namespace kr5::kinematics;
using Eigen::VectorXd;
using kr5::test::apart;
using kr5::test::nearest;

namespace {

constexpr double h = M_PI / 2;

DhChain kr5_arc(double alpha3) {
  DhChain chain;
  chain.joints = {{JointType::Revolute, 0.4, 0, 0.18, h},    {JointType::Revolute, 0, h, 0.6, 2 * h},
                  {JointType::Revolute, 0, 0, 0.12, alpha3}, {JointType::Revolute, 0.62, 2 * h, 0, h},
                  {JointType::Revolute, 0, -h, 0, h},        {JointType::Revolute, 0.115, h, 0, 0}};
  return chain;
}

/// Every ortho-parallel arm: offsets along the parallel axes, any twist 3, any wrist that turns, any flange.
DhChain random_ortho_parallel(Random& random) {
  DhChain chain{test::random_pose(random), {}};
  const auto any = [&](double size) { return random.uniform(-size, size); };
  const auto sign = [&] { return random.uniform() < 0.5 ? -1.0 : 1.0; };
  chain.joints = {{JointType::Revolute, any(0.5), any(3), any(0.3), sign() * h},
                  {JointType::Revolute, any(0.1), any(3), sign() * random.uniform(0.3, 0.8), sign() < 0 ? 0 : 2 * h},
                  {JointType::Revolute, any(0.1), any(3), any(0.2), sign() * random.uniform(0.5, 2.5)},
                  {JointType::Revolute, random.uniform(0.3, 0.7), any(3), 0, sign() * random.uniform(1.0, 2.0)},
                  {JointType::Revolute, 0, any(3), 0, sign() * random.uniform(1.0, 2.0)},
                  {JointType::Revolute, any(0.2), any(3), any(0.1), any(1), any(1)}};
  return chain;
}

/// Angles of the KR5 for which nothing is singular.
VectorXd plain(double q4 = 0.3, double q5 = 0.7) { return (VectorXd(6) << 0.4, -0.5, -0.3, q4, q5, 1.1).finished(); }

}  // namespace

TEST_CASE("every posture of an ortho-parallel arm is found, and each reaches the pose") {
  for (unsigned seed = 0; seed < 300; ++seed) {
    Random random(seed);
    const DhChain chain = random_ortho_parallel(random);
    REQUIRE(has_closed_form(chain));
    const VectorXd q = test::random_vector(random, 6, 3.1);
    const InverseResult result = inverse_kinematics(chain, chain.flange(q));
    CHECK(result.closed_form);
    CHECK(result.status == InverseStatus::Solved);
    CHECK(result.postures.size() % 2 == 0);
    CHECK(nearest(result, q) < 1e-6);
    for (std::size_t i = 0; i < result.postures.size(); ++i) {
      CHECK(result.postures[i].position_error < 1e-9);
      CHECK(result.postures[i].rotation_error < 1e-9);
      for (std::size_t j = 0; j < i; ++j) CHECK(apart(result.postures[i].q, result.postures[j].q) > 1e-6);
    }
  }
}

TEST_CASE("both KR5 tables have four postures at any pose, eight where the arm can also reach over its back") {
  for (const double alpha3 : {h, -h}) {
    const DhChain chain = kr5_arc(alpha3);
    Random random(5);
    int eight = 0;
    for (int k = 0; k < 200; ++k) {
      const VectorXd q = test::random_vector(random, 6, 3.1);
      const InverseResult result = inverse_kinematics(chain, chain.flange(q));
      CHECK((result.postures.size() == 4 || result.postures.size() == 8));
      eight += result.postures.size() == 8;
      CHECK(nearest(result, q) < 1e-8);
      for (const Posture& p : result.postures) {
        CHECK(p.position_error < 1e-12);
        CHECK(p.rotation_error < 1e-12);
        CHECK(p.singularity == Singularity::None);
      }
    }
    CHECK(eight > 20);
  }
}

TEST_CASE("the nearest joint values are those of the usable posture that differs least from `near`") {
  const DhChain chain = kr5_arc(-h);
  Random random(8);
  int skipped = 0;
  for (int k = 0; k < 100; ++k) {
    const VectorXd q = test::random_vector(random, 6, 2.5), near = test::random_vector(random, 6, 2.5);
    const InverseOptions options{
        .lower = VectorXd::Constant(6, -2.5), .upper = VectorXd::Constant(6, 2.5), .near = near};
    const InverseResult result = inverse_kinematics(chain, chain.flange(q), options);
    const auto found = result.nearest();
    REQUIRE(found);
    CHECK((chain.flange(*found).matrix() - chain.flange(q).matrix()).norm() < 1e-8);
    CHECK((found->array().abs() <= 2.5).all());
    for (const Posture& p : result.postures) {
      if (p.usable())
        CHECK((*found - near).norm() <= (p.q - near).norm());
      else
        skipped += (p.q - near).norm() < (*found - near).norm();
    }
  }
  CHECK(skipped > 0);
  const VectorXd q = plain();
  const InverseOptions elsewhere{.lower = q.array() + 0.1, .upper = q.array() + 0.2};
  const InverseResult outside = inverse_kinematics(chain, chain.flange(q), elsewhere);
  CHECK_FALSE((outside.postures.empty() || outside.nearest()));
  Pose far = chain.flange(q);
  far.translation() *= 10;
  CHECK_FALSE(inverse_kinematics(chain, far).nearest());
}

TEST_CASE("a wrist in line is named and leaves joint 4 where it was") {
  const DhChain chain = kr5_arc(-h);
  const VectorXd q = plain(0.8, h);  // theta 5 = 0
  const InverseResult result = inverse_kinematics(chain, chain.flange(q), {.near = q});
  REQUIRE(!result.postures.empty());
  CHECK(result.postures[0].singularity == Singularity::Wrist);
  CHECK((result.postures[0].q - q).norm() < 1e-8);
  CHECK(result.postures[0].rotation_error < 1e-8);
  const VectorXd close = plain(0.8, h + 3e-7);
  const InverseResult two = inverse_kinematics(chain, chain.flange(close), {.near = close});
  CHECK(two.postures[0].singularity == Singularity::Wrist);
  CHECK(two.postures[0].rotation_error < 1e-12);
  CHECK((two.postures[0].q - close).norm() < 1e-8);
}

TEST_CASE("a wrist centre above joint 1 is named and leaves joint 1 where it was") {
  const DhChain chain = kr5_arc(-h);
  VectorXd q = plain();
  // Turn joint 2 until the wrist centre lies on axis 1.
  double low = -0.5, high = 1.5;
  for (int k = 0; k < 100; ++k) {
    q[1] = (low + high) / 2;
    const Eigen::Vector3d wrist = chain.link_poses(q)[3].translation();
    (wrist.x() * std::cos(q[0]) + wrist.y() * std::sin(q[0]) > 0 ? low : high) = q[1];
  }
  const InverseResult result = inverse_kinematics(chain, chain.flange(q), {.near = q});
  REQUIRE(!result.postures.empty());
  CHECK(result.postures[0].singularity == Singularity::Shoulder);
  CHECK((result.postures[0].q - q).norm() < 1e-7);
}

TEST_CASE("a stretched arm is named, one pose beyond it is out of reach") {
  const DhChain chain = kr5_arc(-h);
  VectorXd q = plain();
  q[2] = -std::atan2(0.62, 0.12);
  q[2] += std::cos(q[2]) < 0 ? M_PI : 0.0;
  // Elbow angle at which the distance of the wrist centre from joint 2 is greatest.
  double best = 0;
  for (const double elbow : {std::atan2(0.62, 0.12), -std::atan2(0.62, 0.12)}) {
    VectorXd at = q;
    at[2] = elbow;
    const double distance = (chain.link_poses(at)[3].translation() - chain.link_poses(at)[0].translation()).norm();
    if (distance > best) {
      best = distance;
      q = at;
    }
  }
  REQUIRE(best == Approx(0.6 + std::hypot(0.62, 0.12)).epsilon(1e-12));
  const Pose T = chain.flange(q);
  const InverseResult stretched = inverse_kinematics(chain, T, {.near = q});
  REQUIRE(!stretched.postures.empty());
  CHECK(stretched.postures[0].singularity == Singularity::Elbow);
  CHECK((stretched.postures[0].q - q).norm() < 1e-6);
  const Eigen::Vector3d out = chain.link_poses(q)[3].translation() - chain.link_poses(q)[0].translation();
  Pose beyond = T;
  beyond.translation() += 1e-3 * out.normalized();
  CHECK(inverse_kinematics(chain, beyond).status != InverseStatus::Solved);
  beyond.translation() += 2 * out;
  const InverseResult none = inverse_kinematics(chain, beyond);
  CHECK(none.status == InverseStatus::OutOfReach);
  CHECK(none.postures.empty());
}

TEST_CASE("limits sort postures, full turns are used, and joints outside are named") {
  const DhChain chain = kr5_arc(-h);
  const VectorXd q = plain();
  InverseOptions options;
  options.lower = q.array() - 0.2;
  options.upper = q.array() + 0.2;
  options.near = q;
  const InverseResult result = inverse_kinematics(chain, chain.flange(q), options);
  CHECK(result.status == InverseStatus::Solved);
  CHECK(result.postures.size() > 1);
  CHECK(result.postures[0].usable());
  CHECK((result.postures[0].q - q).norm() < 1e-10);
  CHECK_FALSE(result.postures[1].usable());
  options.lower[5] += 2 * M_PI;
  options.upper[5] += 2 * M_PI;
  CHECK(inverse_kinematics(chain, chain.flange(q), options).postures[0].q[5] == Approx(q[5] + 2 * M_PI));
  options.lower[0] += 0.3;
  options.upper[0] += 0.3;
  const InverseResult outside = inverse_kinematics(chain, chain.flange(q), options);
  CHECK(outside.status == InverseStatus::OutsideLimits);
  bool named = false;
  for (const Posture& p : outside.postures) named = named || p.outside_limits == std::vector<int>{0};
  CHECK(named);
}

TEST_CASE("any other arm is solved within its limits, step by step") {
  int solved = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    Random random(seed);
    const DhChain chain = test::random_chain(random, 7);
    REQUIRE_FALSE(has_closed_form(chain));
    const VectorXd q = test::random_vector(random, 7, 1.5);
    const InverseOptions options{.lower = VectorXd::Constant(7, -1.6), .upper = VectorXd::Constant(7, 1.6)};
    const InverseResult result = inverse_kinematics(chain, chain.flange(q), options);
    if (result.status != InverseStatus::Solved) continue;
    ++solved;
    CHECK(result.postures[0].position_error < 1e-9);
    CHECK(result.postures[0].rotation_error < 1e-9);
    CHECK(result.postures[0].usable());
  }
  CHECK(solved >= 48);
}

TEST_CASE("what cannot be reached step by step is said not to converge") {
  Random random(1);
  const DhChain chain = test::random_chain(random, 4);
  Pose far = Pose::Identity();
  far.translation().x() = 1000;
  const InverseOptions options{.lower = VectorXd::Constant(4, -1.0), .upper = VectorXd::Constant(4, 1.0), .starts = 3};
  const InverseResult result = inverse_kinematics(chain, far, options);
  CHECK(result.status == InverseStatus::NotConverged);
  CHECK(result.postures.empty());
}

TEST_CASE("options of the wrong size and a matrix that is no pose are refused by name") {
  const DhChain chain = kr5_arc(-h);
  CHECK_THROWS_WITH(inverse_kinematics(chain, Pose::Identity(), {.near = VectorXd::Zero(5)}),
                    "near has 5 values, the chain 6 joints");
  CHECK_THROWS_WITH(inverse_kinematics(chain, Pose::Identity(), {.starts = 0}), "starts must be positive");
  Pose skewed = Pose::Identity();
  skewed.linear()(0, 1) = 0.1;
  CHECK_THROWS_WITH(inverse_kinematics(chain, skewed), "T_base_flange must be a rigid motion");
  CHECK_THROWS_AS(inverse_kinematics(DhChain{}, Pose::Identity()), InvalidArgument);
}

}  // namespace inverse_test
