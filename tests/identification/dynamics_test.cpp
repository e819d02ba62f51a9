
#include <catch2/catch.hpp>

#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/dynamics.hpp>
#include <kr5/identification/log_conditioning.hpp>
#include <kr5/identification/payload.hpp>
#include <kr5/io/csv.hpp>

#include "kinematics/random_chain.hpp"
#include "support/coverage.hpp"
#include "support/reference.hpp"
#include "support/trials.hpp"

namespace dynamics_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using kinematics::JointType;

namespace {

DynamicsModel three_joint_arm() {
  DynamicsModel model;
  model.chain.joints = {{JointType::Revolute, 0.4, 0, 0.1, M_PI_2, 0},
                        {JointType::Revolute, 0, 0, 0.5, 0, 0},
                        {JointType::Revolute, 0, 0.3, 0.3, -M_PI_2, 0}};
  return model;
}

/// Bodies with mass about the middle of their links.
std::vector<kinematics::Body> links(int n) {
  std::vector<kinematics::Body> out;
  for (int i = 0; i < n; ++i) {
    kinematics::Body body;
    body.mass = 12.0 / (1 + i);
    body.com = Eigen::Vector3d(-0.15, 0.02 * i, 0.01);
    body.inertia << 0.05, 0.12, 0.11, 0.004, -0.003, 0.002;
    body.inertia /= 1 + i;
    out.push_back(body);
  }
  return out;
}

Eigen::VectorXd standard_parameters(const DynamicsRegressor& regressor, const std::vector<kinematics::Body>& bodies) {
  Eigen::VectorXd chi = Eigen::VectorXd::Zero(regressor.parameters());
  for (int i = 0; i < regressor.joints(); ++i) {
    const auto p = kinematics::inertial_parameters(bodies[static_cast<std::size_t>(i)]);
    chi.segment<6>(13 * i) = p.tail<6>();
    chi.segment<3>(13 * i + 6) = p.segment<3>(1);
    chi[13 * i + 9] = p[0];
    chi.segment<3>(13 * i + 10) << 6.0 - i, 4.0 - i, 0.8 / (1 + i);
  }
  return chi;
}

/// A sum of sines in each joint, with exact speeds and accelerations.
JointMotion sine_motion(int n, Eigen::Index samples, unsigned seed, double end = 20.0) {
  Random random(seed);
  JointMotion out{Eigen::VectorXd::LinSpaced(samples, 0, end), Eigen::MatrixXd::Zero(samples, n),
                  Eigen::MatrixXd::Zero(samples, n),           Eigen::MatrixXd::Zero(samples, n),
                  Eigen::MatrixXd::Zero(samples, n),           {}};
  for (int i = 0; i < n; ++i)
    for (int k = 1; k <= 5; ++k) {
      const double w = 2 * M_PI * k / 10.0, amplitude = random.uniform(0.2, 0.6), phase = random.uniform(0, 6);
      const Eigen::ArrayXd angle = w * out.t.array() + phase;
      out.q.col(i).array() += amplitude * angle.sin();
      out.qd.col(i).array() += amplitude * w * angle.cos();
      out.qdd.col(i).array() -= amplitude * w * w * angle.sin();
    }
  return out;
}

struct Truth {
  DynamicsModel model;
  Eigen::VectorXd chi;
  JointMotion motion;
  BaseParameters base;
  Eigen::VectorXd values;  ///< Of the base parameters.

  explicit Truth(Eigen::Index samples, unsigned seed = 1, DynamicsModel arm = three_joint_arm())
      : model(std::move(arm)), motion(sine_motion(model.joints(), samples, seed)), base(base_parameters(model)) {
    const DynamicsRegressor regressor(model);
    chi = standard_parameters(regressor, links(model.joints()));
    motion.tau = regressor.torques(motion, chi);
    values = base.values(chi);
  }
};

/// Adds noise to each joint that is correlated from sample to sample.
void add_noise(JointMotion& motion, const Eigen::VectorXd& sigma, double memory, Random& random) {
  for (Eigen::Index i = 0; i < motion.tau.cols(); ++i) {
    double e = random.normal(sigma[i]);
    for (Eigen::Index k = 0; k < motion.tau.rows(); ++k) {
      e = memory * e + random.normal(sigma[i] * std::sqrt(1 - memory * memory));
      motion.tau(k, i) += e;
    }
  }
}

const Eigen::Vector3d noise(2.0, 0.8, 0.3);

double distance_in_torque(const Truth& truth, const Eigen::VectorXd& values) {
  const DynamicsRegressor regressor(truth.model);
  return (regressor.torques(truth.motion, truth.base.standard(values)) - regressor.torques(truth.motion, truth.chi))
      .norm();
}

DynamicsOptions with(Estimator estimator, double held_out = 0.0) {
  DynamicsOptions options;
  options.estimator = estimator;
  options.held_out = held_out;
  return options;
}

}  // namespace

TEST_CASE("exact torques give the exact base parameters, and predict those that were held out") {
  const Truth truth(600);
  for (const Estimator estimator : {Estimator::Ordinary, Estimator::Weighted, Estimator::Robust}) {
    const DynamicsResult result = identify_dynamics(truth.motion, truth.model, with(estimator, 0.4));
    INFO(name_of(estimator) << ": " << result.fit.message);
    REQUIRE(result.fit.usable());
    CHECK((result.values - truth.values).norm() < 1e-7 * truth.values.norm());
    CHECK(result.first_held_out == 360);
    CHECK(result.held_out.total < 1e-8);
    CHECK((predict_torques(result, truth.motion) - truth.motion.tau).norm() < 1e-7 * truth.motion.tau.norm());
  }
  const DynamicsResult iv = identify_dynamics(truth.motion, truth.model, with(Estimator::Instruments), &truth.motion);
  CHECK((iv.values - truth.values).norm() < 1e-7 * truth.values.norm());
}

TEST_CASE("errors of the prediction are told for each joint, fitted and held out apart") {
  Truth truth(900);
  Random random(3);
  add_noise(truth.motion, noise, 0.0, random);
  const DynamicsResult result = identify_dynamics(truth.motion, truth.model);
  REQUIRE(result.first_held_out == 600);
  const Eigen::MatrixXd off = truth.motion.tau - result.predicted;
  for (int i = 0; i < 3; ++i) {
    CHECK(result.fitted.rms[i] == Approx(off.col(i).head(600).norm() / std::sqrt(600.0)));
    CHECK(result.held_out.rms[i] == Approx(off.col(i).tail(300).norm() / std::sqrt(300.0)));
    CHECK(result.held_out.relative[i] ==
          Approx(off.col(i).tail(300).norm() / truth.motion.tau.col(i).tail(300).norm()));
    CHECK(result.sigma[i] == Approx(noise[i]).epsilon(0.1));
  }
  CHECK(result.held_out.total == Approx(off.bottomRows(300).norm() / truth.motion.tau.bottomRows(300).norm()));
  CHECK(result.fit.final_rms == Approx(1.0).epsilon(0.05));
}

TEST_CASE("errors of torques are those of each joint over its torque, and refused for sizes that differ") {
  const Eigen::MatrixXd measured = (Eigen::MatrixXd(2, 3) << 3, 0, 1, 4, 0, -1).finished();
  Eigen::MatrixXd predicted = measured;
  predicted(0, 0) += 1, predicted(1, 1) -= 2;
  const TorqueError error = torque_error(measured, predicted);
  CHECK(error.rms.isApprox(Eigen::Vector3d(1, 2, 0) / std::sqrt(2.0)));
  CHECK(error.relative.isApprox(Eigen::Vector3d(0.2, 2, 0)));  // the second joint bore no torque
  CHECK(error.total == Approx(std::sqrt(5.0 / 27.0)));
  CHECK(torque_error(measured.topRows(0), predicted.topRows(0)).total == 0);
  CHECK_THROWS_WITH(torque_error(measured, predicted.leftCols(2)), Contains("expected 2 x 3 torques, found 2 x 2"));
  predicted(0, 0) = std::numeric_limits<double>::quiet_NaN();
  CHECK(std::isnan(torque_error(measured, predicted).total));
}

TEST_CASE("weights bring the joints with little noise to bear") {
  double ordinary = 0, weighted = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    Truth truth(400);
    const Truth clean = truth;
    Random random(seed);
    add_noise(truth.motion, Eigen::Vector3d(20.0, 1.0, 0.05), 0.0, random);
    const auto error = [&](Estimator estimator) {
      const DynamicsResult result = identify_dynamics(truth.motion, truth.model, with(estimator));
      const Eigen::MatrixXd off = predict_torques(result, clean.motion) - clean.motion.tau;
      return off.rightCols(2).squaredNorm();
    };
    ordinary += error(Estimator::Ordinary);
    weighted += error(Estimator::Weighted);
  }
  CHECK(weighted < 0.25 * ordinary);
}

TEST_CASE("collisions that a robust estimate leaves aside") {
  double weighted = 0, robust = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    Truth truth(600, 1);
    const Truth clean = truth;
    Random random(seed);
    add_noise(truth.motion, noise, 0.0, random);
    for (int k = 0; k < 60; ++k) truth.motion.tau.row(random.integer(600)).array() += random.uniform(20, 60);
    weighted +=
        distance_in_torque(clean, identify_dynamics(truth.motion, truth.model, with(Estimator::Weighted)).values);
    robust += distance_in_torque(clean, identify_dynamics(truth.motion, truth.model, with(Estimator::Robust)).values);
  }
  CHECK(robust < 0.5 * weighted);
}

TEST_CASE("instruments remove the bias of accelerations with noise") {
  Eigen::VectorXd mean_weighted, mean_instruments, truth_values;
  const int trials = 20;
  for (int seed = 0; seed < trials; ++seed) {
    Truth truth(1500, 1);
    const JointMotion commanded = truth.motion;
    Random random(static_cast<unsigned>(seed));
    add_noise(truth.motion, noise, 0.0, random);
    for (Eigen::Index k = 0; k < truth.motion.qdd.size(); ++k) truth.motion.qdd.data()[k] += random.normal(3.0);
    const Eigen::VectorXd a = identify_dynamics(truth.motion, truth.model, with(Estimator::Weighted)).values;
    const Eigen::VectorXd b =
        identify_dynamics(truth.motion, truth.model, with(Estimator::Instruments), &commanded).values;
    if (seed == 0) mean_weighted = mean_instruments = Eigen::VectorXd::Zero(a.size()), truth_values = truth.values;
    mean_weighted += a / trials;
    mean_instruments += b / trials;
  }
  CHECK((mean_instruments - truth_values).norm() < 0.2 * (mean_weighted - truth_values).norm());
}

TEST_CASE("intervals of base parameters hold the truth", "[statistics]") {
  // The long log is sampled so fast that neighbours are taken as one.
  for (const auto& [estimator, memory, samples] : {std::tuple{Estimator::Ordinary, 0.7, 1500},
                                                   {Estimator::Weighted, 0.0, 1500},
                                                   {Estimator::Weighted, 0.9, 1500},
                                                   {Estimator::Weighted, 0.98, 8000},
                                                   {Estimator::Robust, 0.5, 1500},
                                                   {Estimator::Instruments, 0.9, 1500},
                                                   {Estimator::Consistent, 0.5, 1500}}) {
    const Truth truth(samples);
    const auto count = truth.values.size();
    const std::string what =
        "identify_dynamics, " + std::string(name_of(estimator)) + ", memory " + std::to_string(memory).substr(0, 4);
    test::Coverage coverage(what, static_cast<int>(count));
    DynamicsOptions options = with(estimator);
    if (estimator == Estimator::Consistent) options.prior_bodies = links(3), options.prior_spread = 2.0;
    Eigen::VectorXi inside = Eigen::VectorXi::Zero(count);
    const int trials = test::trials(2000, 60);
    for (int seed = 0; seed < trials; ++seed) {
      Truth trial = truth;
      Random random(static_cast<unsigned>(seed));
      add_noise(trial.motion, noise, memory, random);
      const DynamicsResult result = identify_dynamics(trial.motion, trial.model, options,
                                                      estimator == Estimator::Instruments ? &truth.motion : nullptr);
      const Eigen::VectorXd error = result.values - truth.values;
      for (Eigen::Index k = 0; k < count; ++k)
        inside[k] += std::abs(error[k]) < uncertainty::normal_factor(0.95) * result.deviations[k];
      coverage.add(error, result.covariance);
    }
    INFO(what << ": " << inside.transpose());
    for (Eigen::Index k = 0; k < count; ++k) {
      if (test::full())
        CHECK((inside[k] >= 0.93 * trials && inside[k] <= 0.97 * trials));
      else  // all of them at once, in 99 of 100 runs
        CHECK(uncertainty::binomial_interval(inside[k], trials, 1 - 0.01 / static_cast<double>(count)).contains(0.95));
    }
    coverage.check_rate();
  }
}

TEST_CASE("bodies of the consistent estimate can exist, however little the data say") {
  for (unsigned seed = 0; seed < 6; ++seed) {
    Truth truth(60 + 200 * (seed % 3), seed);
    Random random(seed);
    add_noise(truth.motion, 10 * noise, 0.0, random);
    DynamicsOptions options = with(Estimator::Consistent, 0.2);
    if (seed % 2) options.prior_bodies = links(3);
    const DynamicsResult result = identify_dynamics(truth.motion, truth.model, options);
    REQUIRE(result.fit.usable());
    REQUIRE(result.bodies.size() == 3);
    for (const kinematics::Body& body : result.bodies) {
      const Eigen::Matrix3d I = body.inertia_matrix();
      CHECK(body.mass > 0);
      CHECK(symmetric_eigen(0.5 * I.trace() * Eigen::Matrix3d::Identity() - I).values.minCoeff() > 0);
    }
    for (int i = 0; i < 3; ++i) CHECK(result.parameters.segment<3>(13 * i + 10).minCoeff() >= 0);
    kinematics::Dynamics arm(truth.model.chain, result.bodies);
    const Eigen::MatrixXd load = arm.loads(truth.motion.q, truth.motion.qd, truth.motion.qdd).tau;
    const Eigen::MatrixXd expected = DynamicsRegressor(result.model).link_torques(truth.motion, result.parameters);
    CHECK((load - expected).norm() < 1e-8 * load.norm());
  }
}

TEST_CASE("with little data the consistent estimate predicts better than free base parameters") {
  double free = 0, consistent = 0;
  for (unsigned seed = 0; seed < 8; ++seed) {
    Truth truth(40, 5);
    const JointMotion other = sine_motion(3, 300, 77);
    const Eigen::MatrixXd expected = DynamicsRegressor(truth.model).torques(other, truth.chi);
    Random random(seed);
    add_noise(truth.motion, 10 * noise, 0.0, random);
    DynamicsOptions options = with(Estimator::Consistent);
    options.prior_bodies = links(3);
    for (kinematics::Body& body : options.prior_bodies) body.mass *= 1.2, body.inertia *= 0.8;  // CAD is off
    free += (predict_torques(identify_dynamics(truth.motion, truth.model, with(Estimator::Weighted)), other) - expected)
                .norm();
    consistent += (predict_torques(identify_dynamics(truth.motion, truth.model, options), other) - expected).norm();
  }
  CHECK(consistent < 0.7 * free);
}

namespace {

struct LoggedArm {
  DynamicsModel model;
  JointMotion motion;
  std::vector<kinematics::Body> priors;
};

/// The KR5 of a cell on a motion with noise, with masses that are off as priors.
LoggedArm noisy_kr5() {
  const cell::Cell cell = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  LoggedArm out;
  out.model.chain = {cell.robot.T_base_0, cell.robot.dh};
  out.motion = sine_motion(6, 1500, 4);
  out.motion.q *= 0.5, out.motion.qd *= 0.5, out.motion.qdd *= 0.5;
  const DynamicsRegressor regressor(out.model);
  out.motion.tau = regressor.torques(out.motion, standard_parameters(regressor, cell.robot.links));
  Random random(6);
  add_noise(out.motion, (Eigen::VectorXd(6) << 6, 6, 4, 1, 1, 1).finished(), 0.8, random);
  out.priors = cell.robot.links;
  for (kinematics::Body& body : out.priors) body.mass *= 1.3, body.inertia *= 0.8;
  return out;
}

/// The excitation of a Panda (Gaz et al. 2019); its modified DH rows hold a and alpha of the joint before.
LoggedArm logged_panda() {
  const auto folder = test::reference("data/dyn_panda_gaz2019");
  const double d[] = {0.333, 0, 0.316, 0, 0.384, 0, 0.107}, a[] = {0, 0, 0.0825, -0.0825, 0, 0.088, 0},
               alpha[] = {-90, 90, 90, -90, 90, 90, 0};
  LoggedArm out;
  for (int i = 0; i < 7; ++i)
    out.model.chain.joints.push_back({JointType::Revolute, d[i], 0, a[i], alpha[i] * M_PI / 180, 0});
  const Eigen::MatrixXd rows = io::load_csv(folder / "panda_excitation.csv").values;
  const ConditionedMotion log =
      condition_log({rows.col(0), rows.middleCols(1, 7), {}, rows.middleCols(15, 7), {}, {}, {}});
  INFO(log.message);
  REQUIRE(log.usable());
  out.motion = log.motion;
  return out;
}

/// Pseudo-inertia of Ixx Ixy Ixz Iyy Iyz Izz, m c, m.
Eigen::Matrix4d pseudo_inertia(const Eigen::VectorXd& p) {
  Eigen::Matrix3d I;
  I << p[0], p[1], p[2], p[1], p[3], p[4], p[2], p[4], p[5];
  Eigen::Matrix4d P;
  P << 0.5 * I.trace() * Eigen::Matrix3d::Identity() - I, p.segment<3>(6), p.segment<3>(6).transpose(), p[9];
  return P;
}

/// By how much the objective of the consistent estimate may lie above its minimum, which is not known: for a
/// self-concordant function the square of the Newton decrement, where that is small (Boyd and Vandenberghe 2004,
/// eq. 9.50). What stands at a bound and would leave it may not move.
double excess_bound(const DynamicsResult& result, const JointMotion& motion,
                    const std::vector<kinematics::Body>& priors, double spread) {
  const DynamicsRegressor regressor(result.model);
  const Eigen::VectorXd prior = standard_parameters(regressor, priors), &chi = result.parameters;
  const double weight = 0.5 / (spread * spread), common = 1 / result.correlation.cwiseInverse().mean();
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(chi.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(chi.size(), chi.size());
  const std::vector<JointRegressor> rows = regressor.joint_regressors(motion);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Eigen::VectorXd off = rows[i].X * chi(rows[i].columns) - motion.tau.col(k);
    const double w = 2 / (std::pow(result.sigma[k], 2) * common);
    gradient(rows[i].columns) += w * rows[i].X.transpose() * off;
    H(rows[i].columns, rows[i].columns) += w * rows[i].X.transpose() * rows[i].X;
  }
  for (int i = 0; i < regressor.joints(); ++i) {
    const Eigen::Matrix4d inverse = pseudo_inertia(chi.segment<10>(13 * i)).inverse(),
                          slope = pseudo_inertia(prior.segment<10>(13 * i)).inverse() - inverse;
    for (int k = 0; k < 10; ++k) {
      const Eigen::Matrix4d left = inverse * pseudo_inertia(Eigen::VectorXd::Unit(10, k));
      gradient[13 * i + k] += weight * (slope * pseudo_inertia(Eigen::VectorXd::Unit(10, k))).trace();
      for (int l = 0; l < 10; ++l)
        H(13 * i + k, 13 * i + l) += weight * (left * inverse * pseudo_inertia(Eigen::VectorXd::Unit(10, l))).trace();
    }
    for (int k = 10; k < 13; ++k)
      if (chi[13 * i + k] == 0 && gradient[13 * i + k] > 0) gradient[13 * i + k] = 0;
  }
  const Eigen::VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd g = scale.cwiseProduct(gradient);
  const double out = g.dot(Eigen::MatrixXd(scale.asDiagonal() * H * scale.asDiagonal()).ldlt().solve(g));
  CHECK(out < 0.4 * weight);  // or it bounds nothing
  return out;
}

/// Balls about the origins of the links, which is what the estimator takes without priors.
std::vector<kinematics::Body> balls(int n) {
  kinematics::Body ball;
  ball.mass = 2.0;
  ball.inertia << 0.032, 0.032, 0.032, 0, 0, 0;
  return std::vector<kinematics::Body>(static_cast<std::size_t>(n), ball);
}

}  // namespace

TEST_CASE("the consistent estimate is the minimum of its objective, on a KR5 and a Panda") {
  const std::vector<LoggedArm> arms = {noisy_kr5(), logged_panda()};
  for (const LoggedArm& arm : arms)
    for (const bool known : {false, true}) {
      if (known && arm.priors.empty()) continue;
      DynamicsOptions options = with(Estimator::Consistent);
      if (known) options.prior_bodies = arm.priors;
      const DynamicsResult result = identify_dynamics(arm.motion, arm.model, options);
      INFO(arm.model.joints() << " joints, " << (known ? "bodies" : "none") << ": " << result.fit.message);
      CHECK(result.fit.status == FitStatus::Converged);
      for (const kinematics::Body& body : result.bodies) CHECK(body.mass > 0);
      for (int i = 0; i < arm.model.joints(); ++i)
        CHECK(symmetric_eigen(pseudo_inertia(result.parameters.segment<10>(13 * i))).values.minCoeff() > 0);
      const double spread = known ? 0.5 : 2.0;
      CHECK(excess_bound(result, arm.motion, known ? arm.priors : balls(arm.model.joints()), spread) < 1e-3);
      DynamicsOptions more = options;
      more.max_body_iterations = 100000;
      CHECK((identify_dynamics(arm.motion, arm.model, more).predicted - result.predicted).norm() <
            1e-5 * result.predicted.norm());

      options.max_body_iterations = 2;
      const DynamicsResult early = identify_dynamics(arm.motion, arm.model, options);
      CHECK(early.fit.status == FitStatus::MaxIterations);
      CHECK_THAT(early.fit.message, Contains("the bodies had not converged after 2 steps"));
      for (int i = 0; i < arm.model.joints(); ++i)
        CHECK(symmetric_eigen(pseudo_inertia(early.parameters.segment<10>(13 * i))).values.minCoeff() > 0);
    }
}

TEST_CASE("exact data leave the prior no say where they tell") {
  const Truth truth(600);
  DynamicsOptions options = with(Estimator::Consistent);
  options.prior_bodies = links(3);
  for (kinematics::Body& body : options.prior_bodies) body.mass *= 1.5;
  const DynamicsResult result = identify_dynamics(truth.motion, truth.model, options);
  CHECK((result.values - truth.values).norm() < 1e-3 * truth.values.norm());
  CHECK(result.fitted.total < 1e-4);
}

namespace {

bool has_further_terms(const JointTerms& t) {
  return t.offset || t.direction || t.load || t.stribeck_velocity > 0 || t.thermal_time_constant > 0 || t.temperature ||
         t.motor || t.motor_stribeck_velocity > 0;
}

/// Gives the motion the torques of the arm with further terms, of these values.
void add_terms(Truth& truth, const std::vector<JointTerms>& terms,
               const std::vector<std::pair<std::string, double>>& values) {
  DynamicsModel actual = truth.model;
  actual.terms = terms;
  const DynamicsRegressor regressor(actual);
  Eigen::VectorXd chi = Eigen::VectorXd::Zero(regressor.parameters());
  chi.head(truth.chi.size()) = truth.chi;
  for (const auto& [name, value] : values) chi[regressor.index(name)] = value;
  truth.motion.tau = regressor.torques(truth.motion, chi);
}

DynamicsOptions choosing() {
  DynamicsOptions out = with(Estimator::Weighted);
  out.choose_terms = true;
  return out;
}

}  // namespace

TEST_CASE("friction terms are chosen that are there, and no others") {
  Truth truth(4000);
  std::vector<JointTerms> terms(3);
  terms[0].stribeck_velocity = 0.08;
  terms[0].offset = true;
  terms[2].load = true;
  add_terms(truth, terms, {{"fs1", 9.0}, {"fo1", 5.0}, {"fl3", 0.15}});
  Random random(2);
  add_noise(truth.motion, 0.3 * noise, 0.0, random);
  DynamicsOptions options;
  options.choose_terms = true;
  const DynamicsResult plain = identify_dynamics(truth.motion, truth.model),
                       result = identify_dynamics(truth.motion, truth.model, options);
  REQUIRE(result.fit.usable());
  CHECK(result.model.terms[0].stribeck_velocity == Approx(0.08).epsilon(0.6));
  CHECK(result.model.terms[0].offset);
  CHECK_FALSE(result.model.terms[1].offset);
  CHECK(result.model.terms[2].load);
  CHECK_FALSE(result.model.terms[0].load);
  CHECK_FALSE(result.model.terms[1].load);
  CHECK(result.model.terms[1].stribeck_velocity == 0);
  for (const JointTerms& terms : result.model.terms) CHECK(terms.thermal_time_constant == 0);
  CHECK(result.held_out.total < 0.8 * plain.held_out.total);
  // Without any of them the plain model stays as it is.
  Truth none(4000);
  add_noise(none.motion, noise, 0.5, random);
  for (const JointTerms& terms : identify_dynamics(none.motion, none.model, options).model.terms)
    CHECK_FALSE(has_further_terms(terms));
}

TEST_CASE("joints without further friction get none, with correlated noise, too", "[statistics]") {
  for (const double memory : {0.0, 0.9}) {
    const int trials = test::trials(200, 10);
    int wrong = 0;
    for (int seed = 0; seed < trials; ++seed) {
      Truth truth(2000, static_cast<unsigned>(seed) % 7);
      Random random(static_cast<unsigned>(seed));
      add_noise(truth.motion, 0.3 * noise, memory, random);
      for (const JointTerms& terms : identify_dynamics(truth.motion, truth.model, choosing()).model.terms)
        wrong += has_further_terms(terms);
    }
    INFO("memory " << memory << ": " << wrong << " of " << 3 * trials << " joints");
    CHECK(uncertainty::binomial_interval(wrong, 3 * trials, 0.99).low <= 0.05);
  }
}

TEST_CASE("terms are found that links imitate in part", "[statistics]") {
  const int trials = test::trials(200, 10);
  int offsets = 0, loads = 0, others = 0;
  for (int seed = 0; seed < trials; ++seed) {
    Truth truth(2000, static_cast<unsigned>(seed) % 7);
    std::vector<JointTerms> terms(3);
    terms[1].offset = true;  // beside gravity
    terms[2].load = true;
    add_terms(truth, terms, {{"fo2", 6.0}, {"fl3", 0.2}});
    Random random(static_cast<unsigned>(seed));
    add_noise(truth.motion, 0.3 * noise, 0.5, random);
    const DynamicsResult result = identify_dynamics(truth.motion, truth.model, choosing());
    offsets += result.model.terms[1].offset;
    loads += result.model.terms[2].load;
    others += has_further_terms(result.model.terms[0]);
  }
  INFO(offsets << " offsets, " << loads << " loads, " << others << " others of " << trials);
  CHECK(uncertainty::binomial_interval(offsets, trials, 0.99).high >= 0.9);
  CHECK(uncertainty::binomial_interval(loads, trials, 0.99).high >= 0.9);
  CHECK(uncertainty::binomial_interval(others, trials, 0.99).low <= 0.05);
}

TEST_CASE("friction that falls with the measured temperature is found, and needs a temperature") {
  Truth truth(2000);
  truth.motion.temperature = Eigen::VectorXd::LinSpaced(2000, 20, 45).replicate(1, 3);
  for (int i = 0; i < 3; ++i) truth.motion.temperature.col(i).array() += 4 * (0.9 * truth.motion.t.array()).sin();
  const Eigen::MatrixXd cold = truth.motion.tau;
  DynamicsModel actual = truth.model;
  actual.terms.resize(3);
  actual.terms[1].temperature = true;
  add_terms(truth, actual.terms, {{"fcT2", -0.12}, {"fvT2", -0.08}});
  // The law, written out.
  const Eigen::ArrayXd v = truth.motion.qd.col(1), warm = truth.motion.temperature.col(1).array() - 20;
  const Eigen::VectorXd law = (-0.12 * warm) * (v / 0.002).tanh() + (-0.08 * warm) * v;
  CHECK(((truth.motion.tau - cold).col(1) - law).norm() < 1e-9 * law.norm());

  Random random(2);
  add_noise(truth.motion, 0.2 * noise, 0.5, random);
  const DynamicsResult result = identify_dynamics(truth.motion, truth.model, choosing());
  CHECK(result.model.terms[1].temperature);
  CHECK_FALSE(has_further_terms(result.model.terms[0]));
  const auto slope = result.parameter("fcT2");
  REQUIRE(slope.has_value());
  CHECK(std::abs(slope->first + 0.12) < 4 * slope->second);
  CHECK(slope->second < 0.02);

  JointMotion bare = truth.motion;
  bare.temperature.resize(0, 0);
  CHECK_THROWS_WITH(identify_dynamics(bare, actual), Contains("temperature: the friction of joint 2 depends on it"));
  for (const JointTerms& terms : identify_dynamics(bare, truth.model, choosing()).model.terms)
    CHECK_FALSE(terms.temperature);
  bare.temperature = Eigen::MatrixXd::Zero(5, 3);
  CHECK_THROWS_WITH(identify_dynamics(bare, truth.model), Contains("temperature: expected 2000 x 3 numbers"));
}

TEST_CASE("friction of a motor that two joints turn is told from that of its joint") {
  DynamicsModel arm = three_joint_arm();
  arm.structure = Eigen::Vector3d(100.0, -80.0, 50.0).asDiagonal();
  arm.structure(2, 1) = -50.0;  // motor 3 turns with joint 2, too
  arm.terms.resize(3);
  for (JointTerms& terms : arm.terms) terms.motor = true, terms.motor_stribeck_velocity = 0.4;
  const DynamicsRegressor regressor(arm);
  CHECK(regressor.index("fcm3") >= 39);
  CHECK(regressor.index("fcm1") == -1);  // no other joint turns it: the same as the friction of the joint
  Truth truth(2000, 1, arm);
  Eigen::VectorXd chi = truth.chi;
  chi[regressor.index("fcm3")] = 5.0;
  chi[regressor.index("fvm3")] = 2.0;
  chi[regressor.index("fsm3")] = 3.0;
  truth.motion.tau = regressor.torques(truth.motion, chi);
  const Eigen::ArrayXd motor = (truth.motion.qd.col(2) - truth.motion.qd.col(1)).array(),
                       level = 5.0 + 3.0 * (-(motor / 0.4).square()).exp(),
                       torque = level * (motor / 0.002).tanh() + 2.0 * motor;
  const Eigen::MatrixXd added = truth.motion.tau - DynamicsRegressor(arm).torques(truth.motion, truth.chi);
  CHECK((added.col(2).array() - torque).matrix().norm() < 1e-9 * torque.matrix().norm());
  CHECK((added.col(1).array() + torque).matrix().norm() < 1e-9 * torque.matrix().norm());
  CHECK(added.col(0).norm() == 0.0);
  const DynamicsResult with_motor = identify_dynamics(truth.motion, arm);
  REQUIRE(with_motor.parameter("fcm3"));
  CHECK(with_motor.parameter("fcm3")->first == Approx(5.0).epsilon(1e-6));
  CHECK(with_motor.parameter("fvm3")->first == Approx(2.0).epsilon(1e-6));
  CHECK(with_motor.parameter("fsm3")->first == Approx(3.0).epsilon(1e-6));
  arm.terms.clear();
  CHECK(identify_dynamics(truth.motion, arm).held_out.total > 0.02);

  Random random(8);
  add_noise(truth.motion, 0.3 * noise, 0.5, random);
  const DynamicsResult chosen = identify_dynamics(truth.motion, arm, choosing());
  CHECK(chosen.model.terms[2].motor);
  CHECK(chosen.model.terms[2].motor_stribeck_velocity > 0);
  CHECK_FALSE(has_further_terms(chosen.model.terms[0]));
  CHECK_FALSE(has_further_terms(chosen.model.terms[1]));
}

TEST_CASE("friction that falls as a gear warms up is offered to logs of minutes on one clock") {
  for (const auto& [one_clock, loss] : {std::pair{true, 1.0}, {false, 1.0}, {true, -1.0}}) {
    Truth truth(4000);
    truth.motion = sine_motion(3, 4000, 1, 200.0);
    std::vector<JointTerms> terms(3);
    terms[1].thermal_time_constant = 60.0;
    add_terms(truth, terms, {{"fct2", 0.5 * loss}, {"fvt2", 0.4 * loss}});
    if (!one_clock) {
      truth.motion.t.tail(2000).array() -= truth.motion.t[2000];
      truth.motion.run_starts = {0, 2000};
    }
    Random random(3);
    add_noise(truth.motion, 0.05 * noise, 0.5, random);
    const DynamicsResult result = identify_dynamics(truth.motion, truth.model, choosing());
    CHECK((result.model.terms[1].thermal_time_constant > 0) == (one_clock && loss > 0));
    CHECK(result.model.terms[0].thermal_time_constant == 0);
  }
}

TEST_CASE("no friction is chosen that drives a joint at rest") {
  Truth truth(2000);
  std::vector<JointTerms> terms(3);
  terms[0].stribeck_velocity = 0.3;
  add_terms(truth, terms, {{"fs1", -12.0}});  // beside a Coulomb friction of 6
  Random random(5);
  add_noise(truth.motion, 0.3 * noise, 0.0, random);
  const DynamicsResult result = identify_dynamics(truth.motion, truth.model, choosing());
  const auto level = result.parameter("fc1"), stribeck = result.parameter("fs1");
  REQUIRE(level);
  CHECK((!stribeck || level->first + stribeck->first > -3 * (level->second + stribeck->second)));
}

TEST_CASE("estimator, prior and least speed are chosen by what predicts thirds that were left out") {
  double free = 0, chosen = 0;
  int consistent = 0;
  DynamicsOptions options = with(Estimator::Weighted);
  for (unsigned seed = 0; seed < 6; ++seed) {
    Truth few(40, 5);
    const JointMotion other = sine_motion(3, 300, 77);
    const Eigen::MatrixXd expected = DynamicsRegressor(few.model).torques(other, few.chi);
    const auto error = [&](const DynamicsResult& result) { return (predict_torques(result, other) - expected).norm(); };
    Random random(seed);
    add_noise(few.motion, 10 * noise, 0.0, random);
    options.choose_estimate = false;
    options.prior_bodies.clear();
    free += error(identify_dynamics(few.motion, few.model, options));
    options.choose_estimate = true;
    CHECK(identify_dynamics(few.motion, few.model, options).estimator == Estimator::Weighted);  // no body is expected
    options.prior_bodies = links(3);
    const DynamicsResult result = identify_dynamics(few.motion, few.model, options);
    consistent += result.estimator == Estimator::Consistent && result.bodies.size() == 3;
    chosen += error(result);
  }
  CHECK(consistent >= 4);
  CHECK(chosen < 0.8 * free);

  Random random(1);
  Truth many(3000);
  add_noise(many.motion, 0.1 * noise, 0.0, random);
  for (kinematics::Body& body : options.prior_bodies) body.mass *= 3, body.com *= -1;  // nothing like the arm
  options.held_out = 1.0 / 3;
  const DynamicsResult sure = identify_dynamics(many.motion, many.model, options);
  CHECK((sure.estimator == Estimator::Weighted || sure.prior_spread == 2.0));
  CHECK(sure.held_out.total < 1.01 * identify_dynamics(many.motion, many.model).held_out.total);

  options.estimator = Estimator::Robust;
  CHECK_THROWS_WITH(identify_dynamics(many.motion, many.model, options),
                    Contains("choose_estimate: compares weighted and consistent only"));
}

TEST_CASE("a robust estimate bears a drive whose currents are zero for most of a log") {
  Truth truth(5000);
  JointMotion& motion = truth.motion;
  const auto at_rest = [](Eigen::Index k) { return k / 500 % 5 >= 2; };
  for (Eigen::Index k = 0; k < motion.samples(); ++k)
    if (at_rest(k)) {
      motion.q.row(k) = motion.q.row(k - 1);
      motion.qd.row(k).setZero();
      motion.qdd.row(k).setZero();
    }
  motion.tau = DynamicsRegressor(truth.model).torques(motion, truth.chi);
  Random random(4);
  add_noise(motion, noise, 0.0, random);
  for (Eigen::Index k = 0; k < motion.samples(); ++k) {
    if (at_rest(k)) motion.tau(k, 0) = 0.0;  // below the resolution: the first axis is upright
    motion.qd(k, 0) += random.normal(1e-5);
  }
  const DynamicsResult result = identify_dynamics(motion, truth.model, with(Estimator::Robust));
  CHECK(result.sigma[0] == Approx(noise[0]).epsilon(0.1));
  for (const char* name : {"fc1", "fv1"})
    CHECK(std::abs(result.parameter(name)->first - truth.chi[DynamicsRegressor(truth.model).index(name)]) <
          4 * result.parameter(name)->second);
}

TEST_CASE("samples about rest do not draw dry friction, when they are left out") {
  Truth truth(6000);
  const DynamicsRegressor regressor(truth.model);
  JointMotion& motion = truth.motion;
  for (Eigen::Index k = 0; k < motion.samples(); ++k)
    if (k / 500 % 2 == 1) {  // a pause
      motion.q.row(k) = motion.q.row(k - 1);
      motion.qd.row(k).setZero();
      motion.qdd.row(k).setZero();
    }
  motion.tau = regressor.torques(motion, truth.chi);
  Random random(4);
  add_noise(motion, 0.2 * noise, 0.0, random);
  for (Eigen::Index k = 0; k < motion.samples(); ++k)
    for (Eigen::Index i = 0; i < 3; ++i) motion.qd(k, i) += random.normal(0.005);
  DynamicsOptions options = with(Estimator::Weighted);
  const DynamicsResult all = identify_dynamics(motion, truth.model, options);
  options.min_speed = 0.04;
  const DynamicsResult moving = identify_dynamics(motion, truth.model, options);
  for (int i = 1; i <= 3; ++i) {
    const std::string name = "fc" + std::to_string(i);
    const double level = truth.chi[regressor.index(name)];
    INFO(name);
    CHECK(std::abs(moving.parameter(name)->first - level) < 4 * moving.parameter(name)->second);
    CHECK(moving.parameter(name)->second < 0.02 * level);
    CHECK(all.parameter(name)->first < level - 5 * all.parameter(name)->second);
  }
  options.min_speed = 1.0;
  CHECK_THROWS_WITH(identify_dynamics(motion, truth.model, options), Contains("min_speed must be"));
}

TEST_CASE("a joint that never moved is named, and the estimate may not be used") {
  Truth truth(300);
  truth.motion.q.col(1).setConstant(0.7);
  truth.motion.qd.col(1).setZero();
  truth.motion.qdd.col(1).setZero();
  const DynamicsResult result = identify_dynamics(truth.motion, truth.model);
  CHECK(result.fit.status == FitStatus::Degenerate);
  CHECK_THAT(result.fit.message, Contains("joint 2 never moved") && Contains("fc2"));
  CHECK_THROWS_WITH(identify_payload(truth.motion, result), Contains("arm: the estimate may not be used: joint 2"));
}

TEST_CASE("data and options that do not fit are refused by name") {
  Truth truth(300);
  CHECK_THROWS_WITH(identify_dynamics(truth.motion, truth.model, with(Estimator::Instruments)),
                    Contains("instruments: the estimator needs the same motion"));
  CHECK_THROWS_WITH(identify_dynamics(truth.motion, truth.model, with(Estimator::Weighted), &truth.motion),
                    Contains("instruments: only the estimator"));
  DynamicsOptions options;
  options.prior_bodies = links(2);
  CHECK_THROWS_WITH(identify_dynamics(truth.motion, truth.model, options),
                    Contains("prior_bodies: expected one a link"));
  options = with(Estimator::Consistent);
  options.prior_bodies = links(3);
  options.prior_bodies[1].mass = 0;
  CHECK_THROWS_WITH(identify_dynamics(truth.motion, truth.model, options), Contains("a body cannot exist: mass 0"));
  options = {};
  options.held_out = 1;
  CHECK_THROWS_WITH(identify_dynamics(truth.motion, truth.model, options), Contains("held_out must be"));
  const DynamicsResult few = identify_dynamics(sine_motion(3, 5, 1), truth.model);
  CHECK(few.fit.status == FitStatus::Degenerate);
  CHECK_THAT(few.fit.message, Contains("too few samples: 3 to fit"));
  JointMotion wrong = sine_motion(2, 50, 1);
  CHECK_THROWS_WITH(identify_dynamics(wrong, truth.model), Contains("motion: expected 3 joints, as the chain has"));
  wrong = truth.motion;
  wrong.tau(3, 1) = std::nan("");
  CHECK_THROWS_WITH(identify_dynamics(wrong, truth.model), Contains("tau: row 3, joint 2 is not finite"));
}

TEST_CASE("a payload is found beside a known arm and beside one that was identified") {
  DynamicsModel arm = three_joint_arm();
  arm.chain.joints.push_back({JointType::Revolute, 0.2, 0, 0, M_PI_2, 0});
  arm.chain.joints.push_back({JointType::Revolute, 0.0, 0, 0.05, M_PI_2, 0});
  arm.chain.joints.push_back({JointType::Revolute, 0.1, 0, 0, 0, 0});
  Truth truth(3000, 1, arm);
  kinematics::Body payload;
  payload.mass = 3.0;
  payload.com = {0.02, -0.03, 0.12};
  payload.inertia << 0.03, 0.025, 0.02, 0.002, -0.001, 0.003;
  std::vector<kinematics::Body> bodies = links(6);
  bodies[5] = kinematics::merged_body(bodies[5], payload);
  const DynamicsRegressor regressor(arm);
  JointMotion loaded = sine_motion(6, 3000, 9);
  Eigen::VectorXd chi = standard_parameters(regressor, bodies);
  chi[10] += 1.5;  // friction has changed since
  loaded.tau = regressor.torques(loaded, chi);

  const PayloadResult exact = identify_payload(loaded, arm, truth.chi);
  REQUIRE(exact.fit.usable());
  CHECK(exact.body.mass == Approx(3.0).epsilon(1e-7));
  CHECK((exact.body.com - payload.com).norm() < 1e-7);
  CHECK((exact.body.inertia - payload.inertia).norm() < 1e-6);
  CHECK(exact.possible);
  CHECK(exact.without.total > 100 * exact.fitted.total);

  int inside = 0;
  const int trials = 20;
  for (unsigned seed = 0; seed < trials; ++seed) {
    Truth noisy = truth;
    JointMotion more = loaded;
    Random random(seed);
    const Eigen::VectorXd sigma = Eigen::VectorXd::Constant(6, 0.5);
    add_noise(noisy.motion, sigma, 0.8, random);
    add_noise(more, sigma, 0.8, random);
    const PayloadResult result =
        identify_payload(more, identify_dynamics(noisy.motion, arm, with(Estimator::Weighted)));
    REQUIRE(result.fit.usable());
    inside += std::abs(result.body.mass - 3.0) < 1.96 * result.mass_deviation;
    CHECK(((result.body.com - payload.com).array().abs() < 5 * result.com_deviation.array()).all());
    CHECK(result.mass_deviation < 0.2);
  }
  CHECK(uncertainty::binomial_interval(inside, trials, 0.99).contains(0.95));
  CHECK_THROWS_WITH(identify_payload(loaded, arm, truth.chi, {Estimator::Consistent}),
                    Contains("estimator: a payload is estimated with"));
}

}  // namespace dynamics_test
