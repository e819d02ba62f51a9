#include <catch2/catch.hpp>

#include <Eigen/Eigenvalues>

#include <kr5/core/error.hpp>
#include <kr5/kinematics/inertial_regressor.hpp>
#include <kr5/kinematics/newton_euler.hpp>

#include "kinematics/random_chain.hpp"

namespace newton_euler_test {

using namespace kr5;
using namespace kr5::kinematics;
using kr5::test::random_vector;

#ifndef KR5_SANITIZED
extern "C" void* __libc_malloc(std::size_t size);
static std::size_t allocations = 0;
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
#endif

namespace {

const Eigen::Vector3d gravity(0.3, -0.5, -9.7);

struct Arm {
  DhChain chain;
  std::vector<Body> bodies;
  Dynamics dynamics;
  Eigen::VectorXd q, qd, qdd;

  explicit Arm(unsigned seed, int joints = 6) : Arm(Random(seed), joints) {}
  Arm(Random random, int joints)
      : chain(test::random_chain(random, joints)),
        bodies(test::random_bodies(random, joints)),
        dynamics(chain, bodies, gravity),
        q(random_vector(random, joints, 3)),
        qd(random_vector(random, joints, 2)),
        qdd(random_vector(random, joints, 5)) {}
};

/// Velocity of a point of a link, and of the link about its com, by central differences of the poses alone.
struct LinkVelocity {
  Eigen::Vector3d v, w;
};

LinkVelocity velocity(const Arm& arm, std::size_t i, const Eigen::VectorXd& qd) {
  const double h = 1e-5;
  const Pose a = arm.chain.link_poses(arm.q - h * qd)[i], b = arm.chain.link_poses(arm.q + h * qd)[i];
  const Eigen::Vector3d c = arm.bodies[i].com;
  return {(b * c - a * c) / (2 * h), log_rotation(b.linear() * a.linear().transpose()) / (2 * h)};
}

double kinetic_energy(const Arm& arm, const Eigen::VectorXd& qd) {
  double sum = 0;
  const std::vector<Pose> T = arm.chain.link_poses(arm.q);
  for (std::size_t i = 0; i < T.size(); ++i) {
    const LinkVelocity at = velocity(arm, i, qd);
    const Eigen::Matrix3d R = T[i].linear();
    sum += (arm.bodies[i].mass * at.v.squaredNorm() +
            at.w.dot(R * inertia_matrix(arm.bodies[i].inertia) * R.transpose() * at.w)) /
           2;
  }
  return sum;
}

double potential_energy(const Arm& arm, const Eigen::VectorXd& q) {
  double sum = 0;
  const std::vector<Pose> T = arm.chain.link_poses(q);
  for (std::size_t i = 0; i < T.size(); ++i) sum -= arm.bodies[i].mass * gravity.dot(T[i] * arm.bodies[i].com);
  return sum;
}

}  // namespace

TEST_CASE("the mass matrix gives the kinetic energy of the moving bodies, and is symmetric and positive") {
  for (unsigned seed = 0; seed < 20; ++seed) {
    Arm arm(seed, 1 + static_cast<int>(seed % 8));
    const Eigen::MatrixXd M = arm.dynamics.mass_matrix(arm.q);
    CHECK(arm.qd.dot(M * arm.qd) / 2 == Approx(kinetic_energy(arm, arm.qd)).epsilon(1e-6));
    CHECK((M - M.transpose()).norm() == 0.0);
    CHECK(M.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff() > 0);
    CHECK((arm.dynamics.mass_diagonal(arm.q) - M.diagonal()).norm() < 1e-12 * M.norm());
  }
}

TEST_CASE("torques are those of Lagrange's equations") {
  for (unsigned seed = 100; seed < 120; ++seed) {
    Arm arm(seed, 1 + static_cast<int>(seed % 8));
    const double h = 1e-5;
    const int n = arm.dynamics.joints();
    Eigen::VectorXd expected = arm.dynamics.mass_matrix(arm.q) * arm.qdd;
    for (int k = 0; k < n; ++k) {
      const Eigen::VectorXd step = h * Eigen::VectorXd::Unit(n, k);
      const Eigen::MatrixXd M_rate =
          (arm.dynamics.mass_matrix(arm.q + step) - arm.dynamics.mass_matrix(arm.q - step)) / (2 * h);
      expected += M_rate * arm.qd * arm.qd[k];
      expected[k] -= arm.qd.dot(M_rate * arm.qd) / 2;
      expected[k] += (potential_energy(arm, arm.q + step) - potential_energy(arm, arm.q - step)) / (2 * h);
    }
    CHECK((arm.dynamics.torques(arm.q, arm.qd, arm.qdd) - expected).norm() < 1e-6 * (1 + expected.norm()));
  }
}

TEST_CASE("the work of the torques is the change of energy along a motion") {
  Arm arm(7);
  const auto q = [&](double t) -> Eigen::VectorXd { return arm.q + arm.qd * t + arm.qdd * t * t / 2; };
  const auto energy = [&](double t) {
    const Eigen::VectorXd qd = arm.qd + arm.qdd * t;
    return qd.dot(arm.dynamics.mass_matrix(q(t)) * qd) / 2 + potential_energy(arm, q(t));
  };
  double work = 0;
  const double dt = 1e-4, end = 0.5;
  for (double t = dt / 2; t < end; t += dt) {
    const Eigen::VectorXd qd = arm.qd + arm.qdd * t;
    work += dt * arm.dynamics.torques(q(t), qd, arm.qdd).dot(qd);
  }
  CHECK(work == Approx(energy(end) - energy(0)).epsilon(1e-5));
}

TEST_CASE("a wrench on a link is carried by the torques that its virtual work asks for") {
  Arm arm(8);
  Random random(3);
  std::vector<Vector6> external(6, Vector6::Zero());
  for (Vector6& w : external) w = random_vector(random, 6, 10);
  Eigen::VectorXd tau(6);
  arm.dynamics.torques(arm.q, arm.qd, arm.qdd, tau, external);
  Eigen::VectorXd expected = arm.dynamics.torques(arm.q, arm.qd, arm.qdd);
  const double h = 1e-6;
  for (int k = 0; k < 6; ++k) {
    const auto a = arm.chain.link_poses(arm.q - h * Eigen::VectorXd::Unit(6, k));
    const auto b = arm.chain.link_poses(arm.q + h * Eigen::VectorXd::Unit(6, k));
    for (std::size_t i = 0; i < 6; ++i) expected[k] -= external[i].dot(pose_difference(a[i], b[i])) / (2 * h);
  }
  CHECK((tau - expected).norm() < 1e-7 * expected.norm());
}

TEST_CASE("the wrench through a cut is what the tool beyond it adds to the last joint") {
  Arm arm(9);
  Random random(4);
  const SensorCut cut{-1, test::random_pose(random), test::random_body(random)};
  arm.dynamics.torques(arm.q, arm.qd, arm.qdd);
  const Vector6 bare = arm.dynamics.joint_wrench(5), through = arm.dynamics.wrench(cut);
  arm.dynamics.add_body(5, cut.body, cut.T_link_sensor);
  arm.dynamics.torques(arm.q, arm.qd, arm.qdd);
  const Vector6 added = arm.dynamics.joint_wrench(5) - bare;
  const Eigen::Matrix3d R = cut.T_link_sensor.linear();
  const Eigen::Vector3d force = R * through.head<3>();
  CHECK((added.head<3>() - force).norm() < 1e-10 * force.norm());
  CHECK((added.tail<3>() - R * through.tail<3>() - cut.T_link_sensor.translation().cross(force)).norm() < 1e-9);
}

TEST_CASE("at rest the wrench through a cut bears the weight") {
  Arm arm(10);
  Random random(5);
  const SensorCut cut{2, test::random_pose(random), test::random_body(random)};
  arm.dynamics.gravity_torques(arm.q);
  const Vector6 w = arm.dynamics.wrench(cut);
  const Eigen::Matrix3d R_base_sensor = arm.chain.link_poses(arm.q)[2].linear() * cut.T_link_sensor.linear();
  const Eigen::Vector3d force = -cut.body.mass * (R_base_sensor.transpose() * gravity);
  CHECK((w.head<3>() - force).norm() < 1e-12 * force.norm());
  CHECK((w.tail<3>() - cut.body.com.cross(force)).norm() < 1e-12 * force.norm());
}

TEST_CASE("bodies and gravity change in place, and a tilted base is a turned gravity") {
  Arm arm(11);
  Random random(6);
  const Eigen::Matrix3d tilt = exp_rotation({0.02, -0.01, 0.3});
  std::vector<Body> bodies = arm.bodies;
  bodies[3] = test::random_body(random);
  DhChain tilted = arm.chain;
  tilted.T_base_0 = Pose(tilt) * tilted.T_base_0;
  Dynamics fresh(tilted, bodies, gravity);
  arm.dynamics.set_body(3, bodies[3]);
  arm.dynamics.set_gravity(tilt.transpose() * gravity);
  const Eigen::VectorXd expected = fresh.torques(arm.q, arm.qd, arm.qdd);
  CHECK((arm.dynamics.torques(arm.q, arm.qd, arm.qdd) - expected).norm() < 1e-12 * expected.norm());
}

TEST_CASE("rows give what single samples give") {
  Arm arm(12);
  const Rows q = Rows::Random(5, 6), qd = Rows::Random(5, 6), qdd = Rows::Random(5, 6);
  Random random(7);
  const SensorCut cut{-1, test::random_pose(random), test::random_body(random)};
  const MotionLoads loads = arm.dynamics.loads(q, qd, qdd, cut);
  CHECK(arm.dynamics.loads(q, qd, qdd).wrench.size() == 0);
  for (int k = 0; k < 5; ++k) {
    CHECK(loads.tau.row(k).transpose() == arm.dynamics.torques(q.row(k), qd.row(k), qdd.row(k)));
    CHECK(loads.wrench.row(k).transpose() == arm.dynamics.wrench(cut));
  }
}

#ifndef KR5_SANITIZED
TEST_CASE("a call allocates nothing") {
  Arm arm(13);
  Eigen::VectorXd tau(6);
  const SensorCut cut{-1, Pose::Identity(), arm.bodies[0]};
  InertialRegressor regressor(arm.chain);
  Eigen::MatrixXd Y(6, 60);
  const std::size_t before = allocations;
  arm.dynamics.torques(arm.q, arm.qd, arm.qdd, tau);
  const Vector6 w = arm.dynamics.wrench(cut);
  regressor.evaluate(arm.q, arm.qd, arm.qdd, Y);
  CHECK(allocations == before);
  CHECK(w.allFinite());
  CHECK(before > 0);
}
#endif

TEST_CASE("bodies are moved and welded without a change of their moments") {
  Random random(8);
  const Body a = test::random_body(random), b = test::random_body(random);
  Moments sum = inertial_moments(a);
  sum += inertial_moments(b);
  const Body both = to_body(sum), same = merged_body(a, b);
  CHECK(same.mass == Approx(both.mass));
  CHECK((same.com - both.com).norm() < 1e-14);
  CHECK((same.inertia - both.inertia).norm() < 1e-14);
  const Pose T = test::random_pose(random);
  const Body back = transformed_body(T.inverse(), transformed_body(T, a));
  CHECK((back.com - a.com).norm() < 1e-14);
  CHECK((back.inertia - a.inertia).norm() < 1e-14);
  CHECK(merged_body(Body{}, a).com == a.com);
  CHECK(merged_body(Body{}, Body{}).mass == 0.0);
}

TEST_CASE("a wrong size or link is refused by name") {
  Arm arm(14);
  CHECK_THROWS_WITH(Dynamics(arm.chain, std::vector<Body>(5)), "bodies has 5 values, the chain 6 joints");
  CHECK_THROWS_WITH(arm.dynamics.torques(arm.q, Eigen::VectorXd::Zero(7), arm.qdd),
                    "qd has 7 values, the chain 6 joints");
  CHECK_THROWS_WITH(arm.dynamics.set_body(6, Body{}), "no link 6, the chain has links 0 to 5");
  CHECK_THROWS_AS(arm.dynamics.loads(Rows::Zero(2, 6), Rows::Zero(3, 6), Rows::Zero(2, 6)), InvalidArgument);
}

}  // namespace newton_euler_test
