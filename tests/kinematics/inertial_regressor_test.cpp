#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/kinematics/denoc.hpp>
#include <kr5/kinematics/inertial_regressor.hpp>

#include "kinematics/random_chain.hpp"

namespace inertial_regressor_test {

using namespace kr5;
using namespace kr5::kinematics;
using kr5::test::random_vector;

namespace {

const Eigen::Vector3d gravity(0.7, -0.4, -9.6);

/// An arm in one state of motion.
struct State {
  DhChain chain;
  std::vector<Body> bodies;
  Eigen::VectorXd q, qd, qdd, chi;

  explicit State(unsigned seed, int joints = 6) : State(Random(seed), joints) {}
  State(Random random, int n)
      : chain(test::random_chain(random, n)),
        bodies(test::random_bodies(random, n)),
        q(random_vector(random, n, 3)),
        qd(random_vector(random, n, 2)),
        qdd(random_vector(random, n, 5)),
        chi(inertial_parameter_count * n) {
    for (int i = 0; i < n; ++i)
      chi.segment<inertial_parameter_count>(inertial_parameter_count * i) =
          inertial_parameters(bodies[static_cast<std::size_t>(i)]);
  }
  int joints() const { return static_cast<int>(q.size()); }
};

/// Newton-Euler in the axes of the base and about the centres of mass; q, qd and qdd enter through the axes of the
/// joints alone.
Eigen::VectorXd world_frame_torques(const State& s) {
  const std::size_t n = s.bodies.size();
  const std::vector<Pose> T = s.chain.link_poses(s.q);
  std::vector<Eigen::Vector3d> axis(n), origin(n), force(n), moment(n), com(n);
  Eigen::Vector3d w = Eigen::Vector3d::Zero(), wd = w, a = -gravity;
  for (std::size_t i = 0; i < n; ++i) {
    const Pose& before = i == 0 ? s.chain.T_base_0 : T[i - 1];
    const auto k = static_cast<Eigen::Index>(i);
    const bool slides = s.chain.joints[i].type == JointType::Prismatic;
    axis[i] = before.linear().col(2), origin[i] = before.translation();
    const Eigen::Vector3d rate = axis[i] * s.qd[k], push = axis[i] * s.qdd[k];
    if (!slides) wd += push + w.cross(rate), w += rate;
    const auto at = [&](const Eigen::Vector3d& p) -> Eigen::Vector3d {
      const Eigen::Vector3d r = p - origin[i];
      Eigen::Vector3d out = a + wd.cross(r) + w.cross(w.cross(r));
      if (slides) out += push + 2 * w.cross(rate);
      return out;
    };
    com[i] = T[i] * s.bodies[i].com;
    const Eigen::Matrix3d R = T[i].linear(), I = R * inertia_matrix(s.bodies[i].inertia) * R.transpose();
    force[i] = s.bodies[i].mass * at(com[i]);
    moment[i] = I * wd + w.cross(I * w);
    a = at(T[i].translation());
  }
  Eigen::VectorXd tau(s.joints());
  for (std::size_t i = 0; i < n; ++i) {
    Eigen::Vector3d f = Eigen::Vector3d::Zero(), m = f;
    for (std::size_t j = i; j < n; ++j) f += force[j], m += moment[j] + (com[j] - origin[i]).cross(force[j]);
    tau[static_cast<Eigen::Index>(i)] = axis[i].dot(s.chain.joints[i].type == JointType::Prismatic ? f : m);
  }
  return tau;
}

double distance(const Eigen::VectorXd& a, const Eigen::VectorXd& b) { return (a - b).norm() / b.norm(); }

}  // namespace

TEST_CASE("regressor, DeNOC and Newton-Euler give the torques of a Newton-Euler in axes of the base") {
  for (unsigned seed = 0; seed < 60; ++seed) {
    const State s(seed, 1 + static_cast<int>(seed % 12));
    const Eigen::VectorXd expected = world_frame_torques(s);
    Eigen::MatrixXd Y(s.joints(), inertial_parameter_count * s.joints());
    InertialRegressor(s.chain, gravity).evaluate(s.q, s.qd, s.qdd, Y);
    INFO("seed " << seed << ", " << s.joints() << " joints");
    CHECK(distance(Dynamics(s.chain, s.bodies, gravity).torques(s.q, s.qd, s.qdd), expected) < 1e-10);
    CHECK(distance(Y * s.chi, expected) < 1e-10);
    CHECK(distance(denoc_torques(s.chain, s.bodies, s.q, s.qd, s.qdd, gravity), expected) < 1e-10);
    CHECK((denoc(s.chain, s.q, s.qd, s.qdd, gravity).regressor() - Y).norm() < 1e-10 * Y.norm());
  }
}

TEST_CASE("each column of the regressor is the derivative of the torques by its parameter") {
  const State s(100, 4);
  Eigen::MatrixXd Y(4, 40);
  InertialRegressor(s.chain, gravity).evaluate(s.q, s.qd, s.qdd, Y);
  for (int c = 0; c < 40; ++c) {
    // Massless but for one parameter: a Body cannot hold a first moment without mass, so take differences.
    Eigen::VectorXd more = s.chi;
    more[c] += 1.0;
    std::vector<Body> bodies = s.bodies;
    const auto link = static_cast<std::size_t>(c / 10);
    bodies[link] = to_body(to_moments(more.segment<10>(c / 10 * 10)));
    const Eigen::VectorXd step = Dynamics(s.chain, bodies, gravity).torques(s.q, s.qd, s.qdd) -
                                 Dynamics(s.chain, s.bodies, gravity).torques(s.q, s.qd, s.qdd);
    INFO("column " << c);
    CHECK((Y.col(c) - step).norm() < 1e-10 * Y.norm());
  }
}

TEST_CASE("a single link that turns about a level axis has the regressor of a pendulum") {
  DhChain chain;
  chain.T_base_0.linear() = exp_rotation({-1.5707963267948966, 0, 0});  // joint axis along Y of the base
  chain.joints = {{JointType::Revolute, 0, 0, 0.5, 0, 0}};
  const double q = 0.3, qdd = 2.0, g = 9.81;
  Eigen::MatrixXd Y(1, 10);
  InertialRegressor(chain).evaluate(Eigen::VectorXd::Constant(1, q), Eigen::VectorXd::Constant(1, 1.7),
                                    Eigen::VectorXd::Constant(1, qdd), Y);
  // The frame is 0.5 m out along x, and y points down at q = 0: tau = I qdd - g (x-moment cos q - y-moment sin q).
  CHECK(Y(0, 0) == Approx(0.25 * qdd - 0.5 * g * std::cos(q)));
  CHECK(Y(0, 1) == Approx(2 * 0.5 * qdd - g * std::cos(q)));
  CHECK(Y(0, 2) == Approx(g * std::sin(q)));
  CHECK(Y(0, 9) == Approx(qdd));
  for (const int c : {3, 4, 5, 6, 7, 8}) CHECK(std::abs(Y(0, c)) < 1e-14);
}

TEST_CASE("DeNOC twists are the velocities of the link frames") {
  const State s(7, 5);
  const Eigen::VectorXd twists = denoc(s.chain, s.q, s.qd, s.qdd).twists(s.qd);
  const double h = 1e-6;
  const auto now = s.chain.link_poses(s.q), before = s.chain.link_poses(s.q - h * s.qd),
             after = s.chain.link_poses(s.q + h * s.qd);
  for (std::size_t i = 0; i < 5; ++i) {
    const Eigen::Matrix3d R = now[i].linear();
    const Eigen::Vector3d v = R.transpose() * (after[i].translation() - before[i].translation()) / (2 * h);
    const Eigen::Vector3d w =
        R.transpose() * log_rotation(after[i].linear() * before[i].linear().transpose()) / (2 * h);
    const auto at = static_cast<Eigen::Index>(6 * i);
    CHECK((twists.segment<3>(at) - v).norm() < 1e-7);
    CHECK((twists.segment<3>(at + 3) - w).norm() < 1e-7);
  }
}

TEST_CASE("regressor rows of many samples are those of single ones") {
  const State s(8);
  InertialRegressor regressor(s.chain, gravity);
  const Rows q = Rows::Random(5, 6), qd = Rows::Random(5, 6), qdd = Rows::Random(5, 6);
  const Rows all = regressor.evaluate(q, qd, qdd);
  REQUIRE(all.rows() == 30);
  Eigen::MatrixXd Y(6, 60);
  for (int k = 0; k < 5; ++k) {
    regressor.evaluate(q.row(k).transpose(), qd.row(k).transpose(), qdd.row(k).transpose(), Y);
    CHECK((all.middleRows(6 * k, 6) - Y).norm() == 0.0);
  }
}

TEST_CASE("inertial parameters are read back") {
  Random random(9);
  const Body body = test::random_body(random), back = to_body(to_moments(inertial_parameters(body)));
  CHECK(back.mass == Approx(body.mass));
  CHECK((back.com - body.com).norm() < 1e-14);
  CHECK((back.inertia - body.inertia).norm() < 1e-14);
}

TEST_CASE("a regressor refuses wrong sizes by name") {
  const State s(10);
  InertialRegressor regressor(s.chain);
  Eigen::MatrixXd Y(6, 60), small(6, 59);
  CHECK_THROWS_WITH(regressor.evaluate(s.q, Eigen::VectorXd::Zero(5), s.qdd, Y), "qd: expected 6 values, found 5");
  CHECK_THROWS_WITH(regressor.evaluate(s.q, s.qd, s.qdd, small), "a row of Y: expected 60 values, found 59");
  CHECK_THROWS_AS(regressor.evaluate(Rows::Zero(2, 6), Rows::Zero(3, 6), Rows::Zero(2, 6)), InvalidArgument);
  CHECK_THROWS_WITH(denoc_torques(s.chain, std::vector<Body>(5), s.q, s.qd, s.qdd),
                    "bodies: expected 6, one a joint, found 5");
  CHECK_THROWS_WITH(denoc(s.chain, s.q, s.qd, Eigen::VectorXd::Zero(5)),
                    "q, qd, qdd: expected 6 values each, one a joint");
}

}  // namespace inertial_regressor_test
