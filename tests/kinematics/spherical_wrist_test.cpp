#include <cmath>
#include <vector>

#include <Eigen/Cholesky>

#include <catch2/catch.hpp>

#include <kr5/kinematics/inverse.hpp>
#include <kr5/kinematics/jacobian.hpp>

#include "kinematics/postures.hpp"
#include "kinematics/random_chain.hpp"

namespace spherical_wrist_test {

using namespace kr5;
using namespace kr5::kinematics;
using Eigen::VectorXd;
using kr5::test::apart;
using kr5::test::nearest;

namespace {

constexpr double h = M_PI / 2;

DhJoint turns(double b, double a, double alpha, double beta = 0) { return {JointType::Revolute, b, 0, a, alpha, beta}; }

/// Three joints of any make, a wrist of any twists, any flange and base.
DhChain random_arm(Random& random) {
  const auto any = [&](double size) { return random.uniform(-size, size); };
  const auto twist = [&] { return (random.uniform() < 0.5 ? -1 : 1) * random.uniform(0.3, M_PI - 0.3); };
  DhChain chain{test::random_pose(random), {}};
  for (int i = 0; i < 2; ++i) chain.joints.push_back(turns(any(0.5), any(0.6), any(M_PI), any(0.5)));
  chain.joints.push_back(turns(any(0.5), any(0.6), any(M_PI)));
  chain.joints.push_back(turns(random.uniform(0.2, 0.7), 0, twist()));
  chain.joints.push_back(turns(0, 0, twist()));
  chain.joints.push_back(turns(any(0.2), any(0.1), any(1), any(1)));
  for (DhJoint& joint : chain.joints) joint.theta_offset = any(3);
  return chain;
}

/// The wrist of most arms behind three joints.
DhChain with_wrist(const DhJoint& one, const DhJoint& two, const DhJoint& three) {
  return {Pose::Identity(), {one, two, three, turns(0.5, 0, h), turns(0, 0, -h), turns(0.1, 0, 0)}};
}

/// Returns how many postures there are.
std::size_t check_all(const DhChain& chain, const VectorXd& q) {
  const InverseResult result = inverse_kinematics(chain, chain.flange(q));
  CHECK(result.closed_form);
  CHECK(result.status == InverseStatus::Solved);
  CHECK(result.postures.size() % 2 == 0);
  CHECK(result.postures.size() <= 8);
  CHECK(nearest(result, q) < 1e-6);
  for (std::size_t i = 0; i < result.postures.size(); ++i) {
    CHECK(result.postures[i].position_error < 1e-9);
    CHECK(result.postures[i].rotation_error < 1e-9);
    for (std::size_t j = 0; j < i; ++j) CHECK(apart(result.postures[i].q, result.postures[j].q) > 1e-6);
  }
  return result.postures.size();
}

/// Newton from many postures at random, with nothing in common with the closed form.
std::vector<VectorXd> search(const DhChain& chain, const Pose& T, Random& random, int starts) {
  std::vector<VectorXd> found;
  for (int k = 0; k < starts; ++k) {
    VectorXd q = test::random_vector(random, 6, M_PI);
    Vector6 e = Vector6::Ones();
    for (int i = 0; i < 60 && e.norm() > 1e-10; ++i) {
      const Pose at = chain.flange(q);
      e << T.translation() - at.translation(), log_rotation(T.linear() * at.linear().transpose());
      const Jacobian J = jacobian(chain, q);
      const Matrix6 A = J * J.transpose() + 1e-4 * std::min(1.0, e.squaredNorm()) * Matrix6::Identity();
      q += J.transpose() * A.ldlt().solve(e);
    }
    const auto same = [&](const VectorXd& other) { return apart(q, other) < 1e-5; };
    if (e.norm() <= 1e-10 && std::none_of(found.begin(), found.end(), same)) found.push_back(q);
  }
  return found;
}

}  // namespace

TEST_CASE("every posture of any arm with a spherical wrist is found, and each reaches the pose") {
  std::vector<int> met(9);
  for (unsigned seed = 0; seed < 2000; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const DhChain chain = random_arm(random);
    REQUIRE(has_closed_form(chain));
    ++met.at(check_all(chain, test::random_vector(random, 6, M_PI)));
  }
  for (const int count : {2, 4, 8}) CHECK(met[static_cast<std::size_t>(count)] > 50);
}

TEST_CASE("there are as many postures as a dense search finds") {
  for (unsigned seed = 0; seed < 12; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const DhChain chain = random_arm(random);
    const Pose T = chain.flange(test::random_vector(random, 6, M_PI));
    const InverseResult result = inverse_kinematics(chain, T);
    const std::vector<VectorXd> found = search(chain, T, random, 600);
    CHECK(found.size() == result.postures.size());
    for (const VectorXd& q : found) CHECK(nearest(result, q) < 1e-6);
  }
}

TEST_CASE("first axes that meet, are parallel, or nearly so, are no exception") {
  for (const double off : {0.0, 1e-12, 1e-9, 1e-7, 1e-6, 1e-4}) {
    const std::vector<DhChain> chains = {
        with_wrist(turns(0.4, off, h), turns(0.1, 0.5, 0), turns(0, 0.1, h)),          // axes 1 and 2 meet
        with_wrist(turns(0.4, off, 1.0), turns(0.1, 0.5, 0.6), turns(0.2, 0.1, 1.2)),  // and nothing is square
        with_wrist(turns(0.4, 0.5, off), turns(0.1, 0.4, h), turns(0.1, 0.1, h)),      // 1 and 2 are parallel
        with_wrist(turns(0.4, 0.5, off), turns(0.1, 0.4, 0.7), turns(0.1, 0.1, 0.8)),
        with_wrist(turns(0.4, 0.2, h), turns(0, off, h), turns(0.3, 0.1, h)),  // 2 and 3 meet
        with_wrist(turns(0.4, 0.2, h), turns(0, 0.6, off), turns(0, 0.1, h)),  // 2 and 3 are parallel
        with_wrist(turns(0.4, 0.2, h + off), turns(0, 0.6, 2 * h), turns(0, 0.1, -h)),
        with_wrist(turns(0.4, 0.2, off + 1e-5), turns(0, 0.4, 0.7), turns(0.1, 0.1, 0.8))};
    for (std::size_t i = 0; i < chains.size(); ++i) {
      CAPTURE(off, i);
      REQUIRE(has_closed_form(chains[i]));
      Random random(7);
      for (int k = 0; k < 50; ++k) check_all(chains[i], test::random_vector(random, 6, M_PI));
    }
  }
}

TEST_CASE("it does not matter where along its axis a frame of the chain lies") {
  Random random(7);
  const double far = 20;
  for (const DhChain& chain : {with_wrist(turns(far, 0.2, h), turns(0, 0.6, 0), turns(0, 0.1, h)),
                               with_wrist(turns(0.4, 0.2, h), turns(far, 0.6, 0), turns(-far, 0.1, h))}) {
    REQUIRE(has_closed_form(chain));
    for (int k = 0; k < 50; ++k) check_all(chain, test::random_vector(random, 6, M_PI));
  }
}

TEST_CASE("a skew wrist with its axes in one plane is named and loses nothing") {
  for (unsigned seed = 0; seed < 200; ++seed) {
    CAPTURE(seed);
    Random random(seed);
    const DhChain chain = random_arm(random);
    VectorXd q = test::random_vector(random, 6, M_PI);
    q[4] = (seed % 2 ? M_PI : 0) - chain.joints[4].theta_offset;
    // Joint 5 moves by the root of a rounding error of the orientation, in an arm that is itself nearly singular 1e-10.
    const InverseResult result = inverse_kinematics(chain, chain.flange(q), {.near = q, .singular_within = 1e-5});
    REQUIRE(!result.postures.empty());
    CHECK(nearest(result, q) < 1e-5);
    CHECK(result.postures[0].singularity == Singularity::Wrist);
    CHECK(result.postures[0].position_error < 1e-9);
    CHECK(result.postures[0].rotation_error < 1e-9);
  }
}

TEST_CASE("a skew arm at the edge of its work space is named, and a pose beyond it is out of reach") {
  const DhChain chain = with_wrist(turns(0.4, 0.2, 1.0), turns(0.1, 0.5, 0.6), turns(0.2, 0.1, 1.2));
  VectorXd q = (VectorXd(6) << 0.3, 0.1, 0.2, 0.5, 0.8, -0.4).finished();
  // Joints 2 and 3 go where the wrist centre is farthest from the foot of axis 1: no posture is beyond.
  const auto wrist = [&](const VectorXd& at) -> Eigen::Vector3d { return chain.link_poses(at)[3].translation(); };
  const auto far = [&](const VectorXd& at) { return (wrist(at) - Eigen::Vector3d(0, 0, 0.4)).norm(); };
  for (double step = 1; step > 1e-10; step *= 0.9)
    for (const int joint : {1, 2, 1, 2})
      for (const double way : {-step, step}) {
        VectorXd other = q;
        other[joint] += way;
        if (far(other) > far(q)) q = other;
      }
  const InverseResult result = inverse_kinematics(chain, chain.flange(q), {.near = q});
  REQUIRE(!result.postures.empty());
  CHECK(nearest(result, q) < 1e-4);  // the search above cannot tell the angles of a maximum better
  const InverseResult near = inverse_kinematics(chain, chain.flange(q), {.near = q, .singular_within = 1e-3});
  CHECK(near.postures.size() == result.postures.size());
  CHECK(near.postures.at(0).singularity == Singularity::Shoulder);
  Pose beyond = chain.flange(q);
  beyond.translation() += 1e-4 * (wrist(q) - Eigen::Vector3d(0, 0, 0.4)).normalized();
  CHECK(inverse_kinematics(chain, beyond).status == InverseStatus::OutOfReach);
}

TEST_CASE("an arm folded onto its shoulder leaves joint 2 where it was") {
  // Upper arm and forearm of one length: the wrist centre can lie on axis 2.
  const DhChain chain = with_wrist(turns(0.4, 0.2, h), turns(0, 0.5, 0), turns(0, 0, h));
  VectorXd q = (VectorXd(6) << 0.3, 0.6, 0, 0.5, 0.8, -0.4).finished();
  q[2] = -h;
  if ((chain.link_poses(q)[3].translation() - chain.link_poses(q)[0].translation()).norm() > 0.1) q[2] = h;
  REQUIRE((chain.link_poses(q)[3].translation() - chain.link_poses(q)[0].translation()).norm() < 1e-12);
  const InverseResult result = inverse_kinematics(chain, chain.flange(q), {.near = q});
  REQUIRE(!result.postures.empty());
  CHECK(result.postures[0].singularity == Singularity::Elbow);
  CHECK(nearest(result, q) < 1e-6);
  for (const Posture& p : result.postures) CHECK(p.position_error < 1e-9);
}

TEST_CASE("axis 3 folded onto axis 1 leaves joint 3 where it was") {
  const DhChain chain = with_wrist(turns(0, 0.4, 0.9), turns(0, 0.4, 0.9), turns(0.3, 0.2, 1.1));
  for (const double q3 : {-2.0, 0.4, 1.3}) {
    const VectorXd q = (VectorXd(6) << 0.3, M_PI, q3, 0.5, 0.8, -0.4).finished();
    const InverseResult result = inverse_kinematics(chain, chain.flange(q), {.near = q});
    REQUIRE(!result.postures.empty());
    CHECK(nearest(result, q) < 1e-6);
  }
}

TEST_CASE("chains that cannot place or turn the wrist have no closed form") {
  const DhJoint ok = turns(0.1, 0.4, 1.0);
  CHECK(has_closed_form(with_wrist(ok, ok, ok)));
  CHECK_FALSE(has_closed_form(with_wrist(turns(0, 0.3, 0), turns(0, 0.3, 0), turns(0, 0.3, h))));  // in a plane
  CHECK_FALSE(has_closed_form(with_wrist(turns(0, 0, h), turns(0, 0, h), turns(0.3, 0, h))));      // on a sphere
  CHECK_FALSE(has_closed_form(with_wrist(turns(0, 0, 0), ok, ok)));                                // axes 1 and 2 one
  DhChain chain = with_wrist(ok, ok, ok);
  chain.joints[4].alpha = 0;
  CHECK_FALSE(has_closed_form(chain));
  chain = with_wrist(ok, ok, ok);
  chain.joints[4].b = 1e-4;  // axes 4 and 6 pass each other
  CHECK_FALSE(has_closed_form(chain));
  chain = with_wrist(ok, ok, ok);
  chain.joints[1].type = JointType::Prismatic;
  CHECK_FALSE(has_closed_form(chain));
}

}  // namespace spherical_wrist_test
