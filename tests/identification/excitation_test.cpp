#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/excitation.hpp>
#include <kr5/kinematics/newton_euler.hpp>
#include <kr5/physics/effective_arm.hpp>
#include <support/arm_cells.hpp>

namespace excitation_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

cell::Cell kuka() { return cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"); }

/// A test arm with limits, of which the torques bind.
cell::Cell limited_arm(const std::string& joints) {
  const test::ArmCase arm{joints};
  cell::Cell cell = test::arm_cell(arm);
  const Index n = arm.size();
  for (kinematics::DhJoint& joint : cell.robot.dh)  // which a file has with six digits
    joint.alpha = M_PI_2 * std::round(joint.alpha / M_PI_2);
  cell.robot.limits = cell::Limits{VectorXd(n), VectorXd(n), VectorXd(n), {}};
  for (Index j = 0; j < n; ++j) {
    const bool slides = arm.slides(static_cast<int>(j));
    cell.robot.limits->lower[j] = slides ? -0.1 : -2.0 - 0.1 * double(j);
    cell.robot.limits->upper[j] = slides ? 0.3 : 2.2;
    cell.robot.limits->velocity[j] = slides ? 0.5 : 2.0;
  }
  return cell;
}

/// Regressor of inverse dynamics, friction and rotors by differences of Newton-Euler torques: samples x joints rows.
MatrixXd independent_regressor(const cell::Cell& cell, const JointMotion& m) {
  const Index n = m.joints();
  MatrixXd A = MatrixXd::Zero(m.samples() * n, 13 * n);
  for (Index j = 0; j < n; ++j) {
    // Torques are linear in m, m c and the inertia about the com plus that of the mass: ten bodies span them.
    for (Index c = 0; c < 10; ++c) {
      std::vector<kinematics::Body> bodies(static_cast<std::size_t>(n));
      kinematics::Body& b = bodies[static_cast<std::size_t>(j)];
      if (c < 6) {
        b.inertia[c] = 1.0;
      } else {
        b.mass = 1.0;
        if (c < 9) b.com[c - 6] = 1.0;
      }
      kinematics::Dynamics arm(cell::nominal_chain(cell), bodies, cell.robot.gravity);
      for (Index k = 0; k < m.samples(); ++k)
        A.col(13 * j + c).segment(k * n, n) =
            arm.torques(VectorXd(m.q.row(k)), VectorXd(m.qd.row(k)), VectorXd(m.qdd.row(k)));
    }
    for (Index k = 0; k < m.samples(); ++k) {
      A(k * n + j, 13 * j + 10) = std::tanh(m.qd(k, j) / 0.002);
      A(k * n + j, 13 * j + 11) = m.qd(k, j);
      A(k * n + j, 13 * j + 12) = m.qdd(k, j);
    }
  }
  return A;
}

void check_limits(const JointMotion& fine, const MotionLimits& limits) {
  for (Index j = 0; j < fine.joints(); ++j) {
    CHECK(fine.q.col(j).minCoeff() >= limits.lower[j]);
    CHECK(fine.q.col(j).maxCoeff() <= limits.upper[j]);
    CHECK(fine.qd.col(j).cwiseAbs().maxCoeff() <= limits.speed[j]);
    CHECK(fine.qdd.col(j).cwiseAbs().maxCoeff() <= limits.acceleration[j]);
  }
}

/// Torques by the physics of the cell, written out.
MatrixXd expected_torques(const cell::Cell& cell, const JointMotion& m) {
  kinematics::Dynamics arm = physics::EffectiveArm(cell).dynamics(0.0);
  const cell::Drives& d = *cell.drives;
  const MatrixXd rotors = d.structure.transpose() * d.rotor_inertia.asDiagonal() * d.structure;
  MatrixXd out(m.samples(), m.joints());
  for (Index k = 0; k < m.samples(); ++k) {
    const VectorXd qd = m.qd.row(k), qdd = m.qdd.row(k);
    out.row(k) = arm.torques(VectorXd(m.q.row(k)), qd, qdd) + rotors * qdd + d.friction.viscous.cwiseProduct(qd) +
                 d.friction.coulomb.cwiseProduct((qd / 0.002).array().tanh().matrix());
  }
  return out;
}

}  // namespace

TEST_CASE("a motion is at rest at both ends and its speeds are the derivatives of its places") {
  ExcitationOptions options{.duration = 8.0, .starts = 2, .exchanges = 0};
  for (const ExcitationKind kind : {ExcitationKind::Fourier, ExcitationKind::PointToPoint})
    for (const ExcitationProfile profile : {ExcitationProfile::Trapezoidal, ExcitationProfile::Quintic}) {
      options.kind = kind;
      options.profile = profile;
      const cell::Cell cell = limited_arm("rr");
      const ExcitationMotion motion = design_excitation(cell, motion_limits(cell), options).motion;
      const double h = 1e-5, end = motion.duration();
      const JointMotion ends = motion.states(Eigen::Vector2d(0.0, end));
      CHECK(ends.qd.cwiseAbs().maxCoeff() < 1e-9);
      CHECK((ends.q.row(0) - ends.q.row(1)).norm() < 1e-9);  // it may be repeated
      for (double t = 0.1003; t < end - 0.1; t += 0.3701) {
        const JointMotion s = motion.states(Eigen::Vector3d(t - h, t, t + h));
        CHECK((s.q.row(2) - s.q.row(0) - 2 * h * s.qd.row(1)).norm() < 1e-8);
        CHECK((s.qd.row(2) - s.qd.row(0) - 2 * h * s.qdd.row(1)).norm() < 1e-4);
      }
    }
  CHECK_THROWS_WITH(ExcitationMotion{}.states(VectorXd::Zero(1)), Contains("period"));
}

TEST_CASE("limits of joints, torques and heights are kept between the samples, for any arm") {
  struct Trial {
    const char* joints;
    ExcitationKind kind;
    ExcitationProfile profile;
  };
  for (const Trial& trial : {Trial{"r", ExcitationKind::Fourier, ExcitationProfile::Quintic},
                             Trial{"rrp", ExcitationKind::Fourier, ExcitationProfile::Quintic},
                             Trial{"rrrr", ExcitationKind::PointToPoint, ExcitationProfile::Trapezoidal},
                             Trial{"prr", ExcitationKind::PointToPoint, ExcitationProfile::Quintic}}) {
    INFO(trial.joints << " " << name_of(trial.kind));
    const cell::Cell cell = limited_arm(trial.joints);
    MotionLimits limits = motion_limits(cell);
    ExcitationOptions options{
        .kind = trial.kind, .duration = 12.0, .profile = trial.profile, .starts = 3, .exchanges = 60};
    const Excitation free = design_excitation(cell, limits, options);
    REQUIRE(free.fit.usable());
    JointMotion held = free.motion.sampled(0.05);
    Random random(9);
    for (Index k = 0; k < held.samples(); ++k)
      for (Index j = 0; j < held.joints(); ++j) held.q(k, j) = random.uniform(limits.lower[j], limits.upper[j]);
    held.qd.setZero(), held.qdd.setZero();
    const VectorXd holding = expected_torques(cell, held).cwiseAbs().colwise().maxCoeff();
    // So that they bind, and yet let the arm stand and move anywhere.
    limits.torque = (0.95 * free.torque_peak).cwiseMax(holding + 0.6 * free.torque_peak);
    limits.acceleration = 0.7 * free.limits.acceleration;
    options.lowest = free.lowest + (cell.robot.joints() > 1 ? 0.02 : -1e-6);  // one joint keeps its height
    options.starts = 5;
    const Excitation bound = design_excitation(cell, limits, options);
    INFO(bound.fit.message);
    REQUIRE(bound.fit.usable());
    const JointMotion fine = bound.motion.sampled(7.3e-4);
    check_limits(fine, limits);
    const VectorXd peak = expected_torques(cell, fine).cwiseAbs().colwise().maxCoeff();
    CHECK((peak.array() <= limits.torque.array()).all());
    CHECK((bound.torque_use - peak.cwiseQuotient(limits.torque)).cwiseAbs().maxCoeff() < 0.02);
    double lowest = 1e9;
    for (Index k = 0; k < fine.samples(); ++k)
      lowest = std::min(lowest, cell::nominal_chain(cell).flange(VectorXd(fine.q.row(k))).translation().z());
    CHECK(lowest >= options.lowest - 1e-3);
  }
}

TEST_CASE("as many base parameters as an independent regressor has rank, and exchanges that better their condition") {
  const cell::Cell cell = limited_arm("rrr");
  const Excitation found =
      design_excitation(cell, motion_limits(cell), {.duration = 10.0, .starts = 5, .exchanges = 200});
  const MatrixXd A = independent_regressor(cell, found.motion.sampled(0.05));
  Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
  qr.setThreshold(1e-9);
  CHECK(found.base_parameters == qr.rank());
  CHECK(found.condition_after.back() == Approx(found.condition).epsilon(0.05));
  CHECK(found.condition < found.condition_after.front());
}

TEST_CASE("a designed motion of a KR5 conditions its 52 base parameters to better than the book's 51") {
  const cell::Cell cell = kuka();
  ExcitationOptions options{.lowest = 0.1, .starts = 10, .exchanges = 600};
  const Excitation designed = design_excitation(cell, motion_limits(cell), options);
  REQUIRE(designed.fit.usable());
  CHECK(designed.base_parameters == 52);
  CHECK(designed.condition <= 51.0);
  CHECK(designed.lowest >= 0.1 - 1e-3);
}

TEST_CASE("asked for it, the condition of a KR5 in plain SI columns is better than the book's 51, too") {
  const cell::Cell cell = kuka();
  const MotionLimits limits = motion_limits(cell);
  ExcitationOptions options{.kind = ExcitationKind::PointToPoint, .lowest = 0.1, .starts = 10, .exchanges = 1000};
  const Excitation scaled = design_excitation(cell, limits, options);
  options.criterion = ExcitationCriterion::ConditionUnscaled;
  const Excitation plain = design_excitation(cell, limits, options);
  REQUIRE(plain.fit.usable());
  CHECK(plain.base_parameters == 52);
  CHECK(plain.condition_unscaled <= 51.0);
  CHECK(plain.condition_unscaled < 0.7 * scaled.condition_unscaled);
  CHECK(plain.condition > scaled.condition);
  CHECK(plain.condition_after.back() == Approx(plain.condition_unscaled).epsilon(0.05));
  for (const double use : plain.speed_use) CHECK(use <= options.limit_share + 1e-9);
}

TEST_CASE("the same seed gives the same motion, another seed another") {
  const cell::Cell cell = limited_arm("rrr");
  for (const ExcitationKind kind : {ExcitationKind::Fourier, ExcitationKind::PointToPoint}) {
    ExcitationOptions options{.kind = kind, .duration = 10.0, .starts = 2, .exchanges = 20};
    const JointMotion one = design_excitation(cell, motion_limits(cell), options).motion.sampled(0.1);
    const JointMotion two = design_excitation(cell, motion_limits(cell), options).motion.sampled(0.1);
    CHECK(one.q == two.q);
    options.seed = 2;
    const JointMotion other = design_excitation(cell, motion_limits(cell), options).motion.sampled(0.1);
    CHECK((other.q.rows() != one.q.rows() || (other.q - one.q).norm() > 1e-3));
  }
}

TEST_CASE("a designed motion leaves smaller deviations than random ones of the same length") {
  const cell::Cell cell = limited_arm("rrrr");
  for (const ExcitationKind kind : {ExcitationKind::Fourier, ExcitationKind::PointToPoint}) {
    ExcitationOptions options{
        .kind = kind, .criterion = ExcitationCriterion::Determinant, .duration = 15.0, .starts = 1, .exchanges = 0};
    const double noise = 1.0;
    // Mean logarithm of the deviations that a least-squares fit finds from a log with noise; the columns are those
    // that span the regressor of the first motion.
    Eigen::VectorXi columns;
    const auto found = [&](const ExcitationMotion& motion, std::uint64_t seed) {
      const MatrixXd A = independent_regressor(cell, motion.sampled(0.02));
      if (columns.size() == 0) {
        Eigen::ColPivHouseholderQR<MatrixXd> qr(A);
        qr.setThreshold(1e-9);
        columns = qr.colsPermutation().indices().head(qr.rank());
      }
      MatrixXd kept(A.rows(), columns.size());
      for (Index c = 0; c < columns.size(); ++c) kept.col(c) = A.col(columns[c]);
      const VectorXd tau = Random(seed).normal_vector(A.rows(), noise);
      const MatrixXd information = kept.transpose() * kept;
      const VectorXd x = information.ldlt().solve(kept.transpose() * tau);
      const double variance = (tau - kept * x).squaredNorm() / double(A.rows() - kept.cols());
      const MatrixXd L = information.llt().matrixL();
      return 0.5 * std::log(variance) - L.diagonal().array().log().mean();
    };
    std::vector<double> random_motions;
    for (std::uint64_t seed = 11; seed < 17; ++seed) {
      options.seed = seed;
      random_motions.push_back(found(design_excitation(cell, motion_limits(cell), options).motion, seed));
    }
    options.seed = 1;
    options.starts = 5;
    options.exchanges = 400;
    const double designed = found(design_excitation(cell, motion_limits(cell), options).motion, 5);
    CHECK(designed < *std::min_element(random_motions.begin(), random_motions.end()) - 0.05);
  }
}

TEST_CASE("what a design cannot use is named") {
  cell::Cell cell = limited_arm("rrp");
  const MotionLimits sound = motion_limits(cell);
  const auto refused = [&](const MotionLimits& limits, const ExcitationOptions& options, const char* text) {
    CHECK_THROWS_WITH(design_excitation(cell, limits, options), Contains(text));
  };
  MotionLimits limits = sound;
  limits.speed.resize(0);
  refused(limits, {}, "limits.speed: found 0 values, expected one a joint: 3");
  limits = sound;
  limits.upper[1] = limits.lower[1];
  refused(limits, {}, "the range of joint 2 is empty");
  limits = sound;
  limits.upper[2] = std::numeric_limits<double>::infinity();
  refused(limits, {}, "joint 3 is a slide without limits");
  limits = sound;
  limits.speed[0] = std::numeric_limits<double>::quiet_NaN();
  refused(limits, {}, "limits.speed: joint 1 must have a positive limit");
  limits = sound;
  limits.speed[0] = std::numeric_limits<double>::infinity();
  refused(limits, {}, "limits.speed must be finite");
  refused(sound, {.start = Eigen::Vector3d(0.0, 9.0, 0.0)}, "start: joint 2 at 9");
  refused(sound, {.start = Eigen::Vector2d(0.0, 0.0)}, "start: found 2 values, expected one a joint: 3");
  refused(sound, {.harmonics = 1}, "harmonics must be at least 2");
  refused(sound, {.duration = 0.0}, "duration must be positive");
  refused(sound, {.limit_share = 1.5}, "limit_share");
  refused(sound, {.torque_noise = Eigen::Vector2d(1.0, 1.0)}, "torque_noise: found 2 values");
  const Excitation high = design_excitation(cell, sound, {.lowest = 50.0, .starts = 2});
  CHECK_FALSE(high.fit.usable());
  CHECK_THAT(high.fit.message, Contains("a guarded point below `lowest`"));
  limits = sound;
  limits.torque = VectorXd::Constant(3, 1e-3);
  const Excitation weak = design_excitation(cell, limits, {.starts = 2});
  CHECK_FALSE(weak.fit.usable());
  CHECK_THAT(weak.fit.message, Contains("the torque of joint"));
  cell.robot.links.clear();
  refused(limits, {}, "the cell has no masses");
  cell.robot.limits.reset();
  CHECK_THROWS_WITH(motion_limits(cell), Contains("robot.limits: the cell states none"));
  cell.robot.limits = cell::Limits{Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {}, {}};
  CHECK_THROWS_WITH(motion_limits(cell), Contains("velocity is missing"));
}

}  // namespace excitation_test
