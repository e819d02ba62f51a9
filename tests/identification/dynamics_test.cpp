#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/dynamics.hpp>
#include <kr5/identification/payload.hpp>

#include "kinematics/random_chain.hpp"
#include "support/coverage.hpp"
#include "support/trials.hpp"

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
  for (const auto& [estimator, memory] : {std::pair{Estimator::Weighted, 0.0},
                                          {Estimator::Weighted, 0.9},
                                          {Estimator::Ordinary, 0.9},
                                          {Estimator::Robust, 0.5},
                                          {Estimator::Instruments, 0.9}}) {
    const Truth truth(1500);
    test::Coverage coverage(
        "identify_dynamics, " + std::string(name_of(estimator)) + ", memory " + std::to_string(memory),
        static_cast<int>(truth.values.size()));
    int inside = 0, all = 0;
    const int trials = test::trials(2000, 60);
    for (int seed = 0; seed < trials; ++seed) {
      Truth trial = truth;
      Random random(static_cast<unsigned>(seed));
      add_noise(trial.motion, noise, memory, random);
      const DynamicsResult result = identify_dynamics(trial.motion, trial.model, with(estimator),
                                                      estimator == Estimator::Instruments ? &truth.motion : nullptr);
      const Eigen::VectorXd error = result.values - truth.values;
      for (Eigen::Index k = 0; k < error.size(); ++k, ++all)
        inside += std::abs(error[k]) < uncertainty::normal_factor(0.95) * result.deviations[k];
      coverage.add(error, result.covariance);
    }
    INFO(name_of(estimator) << ", memory " << memory << ": " << inside << " of " << all);
    CHECK(inside >= (test::full() ? 0.93 : 0.91) * all);
    CHECK(inside <= (test::full() ? 0.97 : 0.98) * all);
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

TEST_CASE("exact data leave the prior no say where they tell") {
  const Truth truth(600);
  DynamicsOptions options = with(Estimator::Consistent);
  options.prior_bodies = links(3);
  for (kinematics::Body& body : options.prior_bodies) body.mass *= 1.5;
  const DynamicsResult result = identify_dynamics(truth.motion, truth.model, options);
  CHECK((result.values - truth.values).norm() < 1e-3 * truth.values.norm());
  CHECK(result.fitted.total < 1e-4);
}

TEST_CASE("friction terms are chosen that are there, and no others") {
  Truth truth(4000);
  DynamicsModel actual = truth.model;
  actual.terms.resize(3);
  actual.terms[0].stribeck_velocity = 0.08;
  actual.terms[0].offset = true;
  actual.terms[2].load = true;
  const DynamicsRegressor regressor(actual);
  Eigen::VectorXd chi = Eigen::VectorXd::Zero(regressor.parameters());
  chi.head(39) = truth.chi;
  chi[regressor.index("fs1")] = 9.0;
  chi[regressor.index("fo1")] = 5.0;
  chi[regressor.index("fl3")] = 0.15;
  truth.motion.tau = regressor.torques(truth.motion, chi);
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
    CHECK((!terms.offset && !terms.direction && !terms.load && terms.stribeck_velocity == 0 &&
           terms.thermal_time_constant == 0));
}

TEST_CASE("friction of a motor that two joints turn is told from that of its joint") {
  DynamicsModel arm = three_joint_arm();
  arm.structure = Eigen::Vector3d(100.0, -80.0, 50.0).asDiagonal();
  arm.structure(2, 1) = -50.0;  // motor 3 turns with joint 2, too
  arm.terms.resize(3);
  for (JointTerms& terms : arm.terms) terms.motor = true;
  const DynamicsRegressor regressor(arm);
  CHECK(regressor.index("fcm3") >= 39);
  CHECK(regressor.index("fcm1") == -1);  // no other joint turns it: the same as the friction of the joint
  Truth truth(2000, 1, arm);
  Eigen::VectorXd chi = truth.chi;
  chi[regressor.index("fcm3")] = 5.0;
  chi[regressor.index("fvm3")] = 2.0;
  truth.motion.tau = regressor.torques(truth.motion, chi);
  const Eigen::ArrayXd motor = (truth.motion.qd.col(2) - truth.motion.qd.col(1)).array(),
                       torque = 5.0 * (motor / 0.002).tanh() + 2.0 * motor;
  const Eigen::MatrixXd added = truth.motion.tau - DynamicsRegressor(arm).torques(truth.motion, truth.chi);
  CHECK((added.col(2).array() - torque).matrix().norm() < 1e-9 * torque.matrix().norm());
  CHECK((added.col(1).array() + torque).matrix().norm() < 1e-9 * torque.matrix().norm());
  CHECK(added.col(0).norm() == 0.0);
  const DynamicsResult with_motor = identify_dynamics(truth.motion, arm);
  REQUIRE(with_motor.parameter("fcm3"));
  CHECK(with_motor.parameter("fcm3")->first == Approx(5.0).epsilon(1e-6));
  CHECK(with_motor.parameter("fvm3")->first == Approx(2.0).epsilon(1e-6));
  arm.terms.clear();
  CHECK(identify_dynamics(truth.motion, arm).held_out.total > 0.02);
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
  options.least_speed = 0.04;
  const DynamicsResult moving = identify_dynamics(motion, truth.model, options);
  for (int i = 1; i <= 3; ++i) {
    const std::string name = "fc" + std::to_string(i);
    const double level = truth.chi[regressor.index(name)];
    INFO(name);
    CHECK(std::abs(moving.parameter(name)->first - level) < 4 * moving.parameter(name)->second);
    CHECK(moving.parameter(name)->second < 0.02 * level);
    CHECK(all.parameter(name)->first < level - 5 * all.parameter(name)->second);
  }
  options.least_speed = 1.0;
  CHECK_THROWS_WITH(identify_dynamics(motion, truth.model, options), Contains("least_speed must be"));
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
