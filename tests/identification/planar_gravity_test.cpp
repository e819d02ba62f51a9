#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/planar_gravity.hpp>
#include <kr5/kinematics/newton_euler.hpp>
#include <support/coverage.hpp>
#include <support/trials.hpp>

namespace planar_gravity_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr double degree = M_PI / 180;

/// The three joints of the book with the signs of its angles: theta2, theta3, theta5 all turn the same way.
std::vector<GravityAngle> book_angles() {
  return {{2, Vector3d(1, 1, 1), 1.0}, {1, Vector3d(1, 1, 0), 1.0}, {0, Vector3d(1, 0, 0), 1.0}};
}

/// Torques of Hayat et al. 2022, eqs. 5.6 and 5.7, of joints 2, 3, 5.
Vector3d book_torques(const Vector3d& theta) {
  const double psi5 = theta.sum();
  const double tau5 = -0.052 - 11.47 * std::cos(psi5) + 4.9 * std::sin(psi5);
  const double tau3 = -126.28 * std::cos(theta[0] + theta[1] - 44.85 * degree) + tau5;
  return {-375.70 * std::cos(theta[0]) + tau3, tau3, tau5};
}

/// Joints one after the other, to and fro in a sine, with friction.
JointMotion book_motion(double noise, std::uint64_t seed) {
  constexpr Index each = 240;
  const Vector3d middle(-1.2, 1.4, 0.3), friction(40.0, 16.0, 3.2);
  Random random(seed);
  JointMotion out;
  out.t = VectorXd::LinSpaced(3 * each, 0.0, 360.0);
  out.q = out.qd = out.qdd = out.tau = MatrixXd::Zero(3 * each, 3);
  for (Index k = 0; k < 3 * each; ++k) {
    const Index moving = 2 - k / each;
    const double phase = 12 * M_PI * double(k % each) / double(each);
    out.q.row(k) = middle.transpose();
    out.q(k, moving) += 1.1 * std::sin(phase);
    out.qd(k, moving) = 0.25 * std::cos(phase);
    Vector3d tau = book_torques(out.q.row(k).transpose());
    for (Index j = 0; j < 3; ++j) tau[j] += random.normal(noise);
    tau[moving] += out.qd(k, moving) > 0 ? friction[moving] : -friction[moving];
    out.tau.row(k) = tau.transpose();
  }
  return out;
}

/// Constant, sine, cosine of joint 5, 3, 2.
VectorXd book_terms() {
  VectorXd out(9);
  out << -0.052, 4.9, -11.47, 0.0, -126.28 * std::sin(44.85 * degree), -126.28 * std::cos(44.85 * degree), 0.0, 0.0,
      -375.70;
  return out;
}

VectorXd terms_of(const PlanarGravity& model) {
  VectorXd out(3 * model.joints.size());
  for (std::size_t k = 0; k < model.joints.size(); ++k)
    out.segment<3>(3 * static_cast<Index>(k)) << model.joints[k].constant, model.joints[k].sine, model.joints[k].cosine;
  return out;
}

}  // namespace

TEST_CASE("the book's gravity coefficients come back from exact torques") {
  const PlanarGravity model = identify_planar_gravity(book_motion(0.0, 1), book_angles());
  REQUIRE(model.fit.usable());
  CHECK((terms_of(model) - book_terms()).norm() < 1e-7);
  CHECK(model.joints[2].coulomb == Approx(40.0).epsilon(1e-9));
  // Table 5.1: mass moments of link 5, 3 and 2 as coefficients over g.
  CHECK(std::hypot(model.joints[0].sine, model.joints[0].cosine) / 9.81 == Approx(1.271).epsilon(1e-3));
  CHECK(std::hypot(model.joints[1].sine, model.joints[1].cosine) / 9.81 == Approx(12.87).epsilon(1e-3));
  CHECK(-model.joints[2].cosine / 9.81 == Approx(38.30).epsilon(1e-3));
  CHECK(std::atan2(model.joints[1].sine, model.joints[1].cosine) - M_PI + 2 * M_PI ==
        Approx(44.85 * degree).epsilon(1e-9));
  const Vector3d theta(0.3, -0.2, 1.0), truth = book_torques(theta);
  CHECK((model.predict(theta).tau - Vector3d(truth[2], truth[1], truth[0])).norm() < 1e-7);
}

TEST_CASE("the book's gravity coefficients come back from noisy torques within their covariance", "[statistics]") {
  test::Coverage coverage("harmonics of gravity", 9);
  for (int k = 0; k < test::trials(2000, 250); ++k) {
    const PlanarGravity model =
        identify_planar_gravity(book_motion(1.5, 10 + static_cast<std::uint64_t>(k)), book_angles());
    REQUIRE(model.fit.usable());
    coverage.add(terms_of(model) - book_terms(), model.covariance);
  }
  coverage.check_rate();
}

TEST_CASE("in the sagittal plane of a KR5 the harmonics are its whole gravity") {
  const cell::Cell cell = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  const kinematics::DhChain chain = cell::nominal_chain(cell);
  VectorXd home(6);
  home << 0.4, -0.5, -2.6, 0.0, -1.0, 0.3;
  const std::vector<GravityAngle> angles = gravity_angles(chain, home);
  REQUIRE(angles.size() == 3);
  CHECK(angles[0].joint == 4);
  CHECK(angles[2].joint == 1);
  CHECK(angles[1].factors[1] * angles[1].factors[2] == -1.0);  // axes 2 and 3 point opposite ways
  kinematics::Dynamics arm(chain, cell.robot.links);
  const Index n = 900;
  JointMotion motion;
  motion.t = VectorXd::LinSpaced(n, 0.0, 90.0);
  motion.q = home.transpose().replicate(n, 1);
  motion.qd = motion.qdd = motion.tau = MatrixXd::Zero(n, 6);
  for (Index k = 0; k < n; ++k) {
    const Index j = std::array{4, 2, 1}[static_cast<std::size_t>(k / 300)];
    const double phase = 4 * M_PI * double(k % 300) / 300;
    motion.q(k, j) += 0.8 * std::sin(phase);
    motion.qd(k, j) = 0.1 * std::cos(phase);
    motion.tau.row(k) = arm.gravity_torques(motion.q.row(k).transpose()).transpose();
  }
  const PlanarGravity model = identify_planar_gravity(motion, angles);
  REQUIRE(model.fit.usable());
  for (const double bend : {-0.7, 0.2, 0.9}) {
    VectorXd q = home;
    q[1] += bend, q[2] -= 0.5 * bend, q[4] += 2.0 * bend;
    const VectorXd truth = arm.gravity_torques(q);
    CHECK((model.predict(q).tau - Vector3d(truth[4], truth[2], truth[1])).norm() < 1e-6);
  }
}

TEST_CASE("slow motion that tells no harmonic is named") {
  const auto message = [](const JointMotion& motion) {
    const PlanarGravity model = identify_planar_gravity(motion, book_angles());
    CHECK_FALSE(model.fit.usable());
    return model.fit.message;
  };
  JointMotion motion = book_motion(0.0, 1);
  motion.qd.col(2).setZero();
  CHECK_THAT(message(motion), Contains("joint 3 did not move slowly"));
  motion = book_motion(0.0, 1);
  motion.q.col(2).setConstant(0.3);
  CHECK_THAT(message(motion), Contains("joint 3 moved over too small an angle"));
  std::vector<GravityAngle> angles = book_angles();
  angles[1].joint = 3;
  CHECK_THROWS_WITH(identify_planar_gravity(motion, angles), Contains("angles[1].joint: found 3, expected 0 to 2"));
  angles = book_angles();
  angles[0].factors.resize(2);
  CHECK_THROWS_WITH(identify_planar_gravity(motion, angles), Contains("angles[0].factors"));
  CHECK_THROWS_WITH(identify_planar_gravity(motion, {}), Contains("angles: none"));
  kinematics::DhChain upright;
  upright.joints.resize(2);
  CHECK_THROWS_WITH(gravity_angles(upright, VectorXd::Zero(2)), Contains("no joint has a horizontal axis"));
}

}  // namespace planar_gravity_test
