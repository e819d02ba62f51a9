#include <map>
#include <sstream>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/base_parameters.hpp>
#include <kr5/physics/friction.hpp>

#include "kinematics/random_chain.hpp"

namespace base_parameters_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using kinematics::JointType;

namespace {

/// The KR5 of Table 3.1 with the lateral offsets that Table 4.3 implies (method.md, I-14).
DynamicsModel kr5_model() {
  const double right = M_PI_2;
  DynamicsModel model;
  model.chain.joints = {
      {JointType::Revolute, 0.4, 0, 0.18, right, 0},   {JointType::Revolute, -0.135, right, 0.6, M_PI, 0},
      {JointType::Revolute, 0.135, 0, 0.12, right, 0}, {JointType::Revolute, 0.62, M_PI, 0, right, 0},
      {JointType::Revolute, 0, -right, 0, right, 0},   {JointType::Revolute, 0.115, right, 0, 0, 0}};
  return model;
}

/// A row of Table 4.3 as coefficients of the standard parameters; mbar_i is the sum of m_j, j >= i.
Eigen::VectorXd book_row(const std::string& text, const DynamicsRegressor& regressor) {
  Eigen::VectorXd out = Eigen::VectorXd::Zero(regressor.parameters());
  std::istringstream words(text);
  double sign = 1, factor = 1;
  std::string word;
  const auto add = [&](const std::string& name) {
    REQUIRE(regressor.index(name) >= 0);
    out[regressor.index(name)] += sign * factor;
  };
  std::vector<std::string> all;
  while (words >> word) all.push_back(word);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::string& w = all[i];
    if (w == "+" || w == "-") {
      sign = w == "+" ? 1 : -1, factor = 1;
    } else if (std::isdigit(static_cast<unsigned char>(w[0]))) {
      factor = std::stod(w);
    } else if (w.rfind("mbar", 0) == 0) {
      for (int j = w[4] - '0'; j <= 6; ++j) add("m" + std::to_string(j));
    } else if (w[0] == 'm' && i + 1 < all.size() && all[i + 1][0] == 'd') {
      add(w + " c" + all[++i].substr(1, 2));
    } else if (w[0] == 'F') {
      add({'f', w[2], w[1]});
    } else if (w.size() == 3 && w[2] == 'a') {
      add({'I', 'a', w[1]});
    } else {
      add(w);
    }
  }
  return out;
}

const std::vector<std::string> table_4_3 = {
    "I1a + I1yy + I2yy + I3zz + 0.0324 m1 - 0.309375 m2 - 0.2691 mbar3 + 0.36 m1 d1x + 0.54 m3 d3y + 0.27 m2 d2z",
    "F1c",
    "F1v",
    "I2xx - I2yy + 0.36 mbar2",
    "I2xy",
    "I2xz - 0.081 mbar3 - 0.6 m3 d3y - 0.6 m2 d2z",
    "I2yz",
    "I2a + I2zz - 0.36 mbar2",
    "0.6 mbar2 + m2 d2x",
    "m2 d2y",
    "F2c",
    "F2v",
    "I3xx - I3zz + I4zz + 0.0144 m3 + 0.3988 mbar4 + 1.24 m4 d4y",
    "I3xy - 0.12 m3 d3y",
    "I3xz",
    "I3yy + I4zz - 0.0144 m3 + 0.37 mbar4 + 1.24 m4 d4y",
    "I3yz",
    "0.12 mbar3 + m3 d3x",
    "0.62 mbar4 + m4 d4y + m3 d3z",
    "I3a",
    "F3c",
    "F3v",
    "I4xx - I4zz + I5zz",
    "I4xy",
    "I4xz",
    "I4yy + I5zz",
    "I4yz",
    "m4 d4x",
    "m5 d5y + m4 d4z",
    "I4a",
    "F4c",
    "F4v",
    "I5xx + I6yy - I5zz + 0.013225 m6 + 0.23 m6 d6z",
    "I5xy",
    "I5xz",
    "I5yy + I6yy + 0.013225 m6 + 0.23 m6 d6z",
    "I5yz",
    "m5 d5x",
    "m5 d5z + m6 d6z + 0.115 m6",
    "I5a",
    "F5c",
    "F5v",
    "I6xx - I6yy",
    "I6xy",
    "I6xz",
    "I6yz",
    "I6zz",
    "m6 d6x",
    "m6 d6y",
    "I6a",
    "F6c",
    "F6v"};

JointMotion random_motion(Random& random, int n, Eigen::Index samples) {
  const auto matrix = [&](double size) -> Eigen::MatrixXd {
    return Eigen::MatrixXd::NullaryExpr(samples, n, [&] { return random.uniform(-size, size); });
  };
  return {Eigen::VectorXd::LinSpaced(samples, 0, 10), matrix(3), matrix(2), matrix(5), matrix(10), {}};
}

}  // namespace

TEST_CASE("the KR5 has 52 base parameters of 78, and the rows of Table 4.3 are such") {
  const DynamicsModel model = kr5_model();
  const DynamicsRegressor regressor(model);
  CHECK(regressor.parameters() == 78);
  const BaseParameters base = base_parameters(model);
  CHECK(base.size() == 52);
  int inertial = 0, friction = 0, rotors = 0;
  for (const int c : base.independent) (c % 13 < 10 ? inertial : c % 13 < 12 ? friction : rotors) += 1;
  CHECK(inertial == 36);
  CHECK(friction == 12);
  CHECK(rotors == 4);
  CHECK(std::count(base.independent.begin(), base.independent.end(), regressor.index("Ia1")) == 0);
  CHECK(std::count(base.independent.begin(), base.independent.end(), regressor.index("Ia2")) == 0);
  Eigen::MatrixXd rows(52, 78);
  for (std::size_t k = 0; k < table_4_3.size(); ++k) {
    const Eigen::VectorXd row = book_row(table_4_3[k], regressor);
    INFO("row " << k + 1 << ": " << table_4_3[k]);
    CHECK(base.identifiable(row));
    rows.row(static_cast<Eigen::Index>(k)) = row;
  }
  CHECK(singular_values(rows)[51] > 1e-3);  // 52 different ones
  for (const char* not_alone : {"m3", "I1xx", "I2zz", "Ia2"})
    CHECK_FALSE(base.identifiable(Eigen::VectorXd::Unit(78, regressor.index(not_alone))));
  // Without the lateral offset row 1 is none: the table holds for one arm only.
  DynamicsModel other = model;
  other.chain.joints[1].b = other.chain.joints[2].b = 0;
  CHECK_FALSE(base_parameters(other).identifiable(book_row(table_4_3[0], regressor)));
}

TEST_CASE("base parameters predict what the standard ones do, on arms of any kind") {
  for (unsigned seed = 0; seed < 8; ++seed) {
    Random random(seed);
    DynamicsModel model;
    const int n = 1 + static_cast<int>(seed);
    model.chain = test::random_chain(random, n);
    if (seed % 2) {  // a coupled wrist
      model.structure = Eigen::MatrixXd::Identity(n, n) * 50;
      model.structure(n - 1, n - 2) = -7;
    }
    model.terms.resize(static_cast<std::size_t>(n));
    model.terms[0].offset = model.terms[0].direction = true;
    model.terms.back().stribeck_velocity = 0.05;
    const DynamicsRegressor regressor(model);
    const BaseParameters base = base_parameters(model);
    const Eigen::VectorXd chi = random.normal_vector(regressor.parameters());
    const JointMotion motion = random_motion(random, n, 40);
    const Eigen::MatrixXd Y = regressor.evaluate(motion);
    const Eigen::VectorXd tau = Y * chi;
    CHECK((Y * base.standard(base.values(chi)) - tau).norm() < 1e-8 * tau.norm());
    const Eigen::VectorXd scale = Y.colwise().norm().cwiseMax(1e-300).cwiseInverse();
    const Eigen::VectorXd s = singular_values(Y * scale.asDiagonal());
    CHECK((s.array() > 1e-9 * s[0]).count() == base.size());
  }
}

TEST_CASE("a pendulum's base parameters are written as a textbook has them") {
  DynamicsModel model;
  model.chain.T_base_0.linear() = exp_rotation({-M_PI_2, 0, 0});
  model.chain.joints = {{JointType::Revolute, 0, 0, 0.5, 0, 0}};
  const BaseParameters base = base_parameters(model);
  REQUIRE(base.size() == 5);
  // About its axis: Izz + 0.25 m + 2 0.5 m cx, and what weighs: m cx + 0.5 m. So Izz takes the rest: -0.25 m.
  CHECK(base.expressions[0] == "I1zz - 0.25 m1 + Ia1");
  CHECK(base.expressions[1] == "m1 c1x + 0.5 m1");
  CHECK(base.expressions[2] == "m1 c1y");
  CHECK(base.expressions[3] == "fc1");
  CHECK(base.expressions[4] == "fv1");
  CHECK(base.units == std::vector<std::string>{"kg m^2", "kg m", "kg m", "N m", "N m s/rad"});
}

TEST_CASE("an arm whose right angles are rounded has the base parameters of the exact one") {
  DynamicsModel exact;
  exact.chain.joints = {{JointType::Revolute, 0.19, 0, 0, M_PI_2, 0},
                        {JointType::Revolute, 0, 0, 0, -M_PI_2, 0},
                        {JointType::Revolute, 0.1, 0, 0.2, 0, 0}};
  const BaseParameters right = base_parameters(exact);
  for (const int digits : {2, 3, 4, 6, 9, 11, 14}) {
    INFO(digits);
    const double unit = std::pow(10.0, -digits), quarter = std::round(M_PI_2 / unit) * unit;
    DynamicsModel rounded = exact;
    rounded.chain.joints[0].alpha = quarter;
    rounded.chain.joints[1].alpha = -quarter;
    rounded.chain.joints[2].a = 0.2 + 1e-9;
    const BaseParameters found = base_parameters(rounded);
    CHECK(found.independent == right.independent);
    CHECK((found.regrouping - right.regrouping).norm() < 1e-6);
  }
}

TEST_CASE("every parameter has its unit, of joints that turn and of those that slide") {
  DynamicsModel model;
  model.chain.joints = {{JointType::Revolute, 0, 0, 0.5, M_PI_2, 0}, {JointType::Prismatic, 0, 0, 0, 0, 0}};
  model.structure = (Eigen::Matrix2d() << 80, 20, 0, 60).finished();  // the first motor is turned by both joints
  model.terms.resize(2);
  for (JointTerms& t : model.terms) {
    t.offset = t.direction = t.load = t.temperature = t.motor = true;
    t.stribeck_velocity = t.motor_stribeck_velocity = 0.1, t.thermal_time_constant = 100;
  }
  const DynamicsRegressor regressor(model);
  REQUIRE(regressor.units().size() == regressor.names().size());
  const std::map<std::string, std::string> expected = {{"I1xy", "kg m^2"},   {"m1 c1z", "kg m"},
                                                       {"m1", "kg"},         {"fc1", "N m"},
                                                       {"fv1", "N m s/rad"}, {"Ia1", "kg m^2"},
                                                       {"fo1", "N m"},       {"fvd1", "N m s/rad"},
                                                       {"fs1", "N m"},       {"fl1", "-"},
                                                       {"fct1", "N m"},      {"fvt1", "N m s/rad"},
                                                       {"fcT1", "N m/K"},    {"fvT1", "N m s/(rad K)"},
                                                       {"fcm1", "N m"},      {"fvm1", "N m s/rad"},
                                                       {"fsm1", "N m"},      {"I2zz", "kg m^2"},
                                                       {"m2", "kg"},         {"fc2", "N"},
                                                       {"fv2", "N s/m"},     {"Ia2", "kg"},
                                                       {"fl2", "-"},         {"fcT2", "N/K"},
                                                       {"fvT2", "N s/(m K)"}};
  for (const auto& [name, unit] : expected) {
    CAPTURE(name);
    REQUIRE(regressor.index(name) >= 0);
    CHECK(regressor.units()[static_cast<std::size_t>(regressor.index(name))] == unit);
  }
}

TEST_CASE("the regressor is the derivative of the physics that predicts") {
  Random random(3);
  DynamicsModel model;
  model.chain = test::random_chain(random, 3);
  model.structure = (Eigen::Matrix3d() << 80, 0, 0, 0, 60, 0, 0, -20, 40).finished();
  model.terms.resize(3);
  model.terms[1].stribeck_velocity = 0.3;
  model.terms[1].load = true;
  model.terms[2].offset = true;
  const DynamicsRegressor regressor(model);
  const std::vector<kinematics::Body> bodies = test::random_bodies(random, 3);
  const Eigen::Vector3d rotors(3e-4, 2e-4, 1e-4);
  Eigen::VectorXd chi = Eigen::VectorXd::Zero(regressor.parameters());
  std::vector<physics::JointFriction> friction(3);
  for (int i = 0; i < 3; ++i) {
    const auto p = kinematics::inertial_parameters(bodies[static_cast<std::size_t>(i)]);
    chi.segment<6>(13 * i) = p.tail<6>();
    chi.segment<3>(13 * i + 6) = p.segment<3>(1);
    chi[13 * i + 9] = p[0];
    physics::JointFriction& f = friction[static_cast<std::size_t>(i)];
    chi[13 * i + 10] = f.coulomb = random.uniform(1, 5);
    chi[13 * i + 11] = f.viscous = random.uniform(1, 5);
    chi[13 * i + 12] = rotors[i] * std::pow(model.structure(i, i), 2);
  }
  friction[1].stribeck_velocity = 0.3;
  chi[regressor.index("fs2")] = friction[1].stribeck = 2.0;
  chi[regressor.index("fl2")] = friction[1].load_coefficient = 0.1;
  chi[regressor.index("fo3")] = 4.0;
  const JointMotion motion = random_motion(random, 3, 30);
  kinematics::Dynamics arm(model.chain, bodies, model.gravity);
  const Eigen::MatrixXd load = arm.loads(motion.q, motion.qd, motion.qdd).tau;
  Eigen::MatrixXd expected = load + motion.qdd * model.structure.transpose() * rotors.asDiagonal() * model.structure;
  for (int i = 0; i < 3; ++i)
    expected.col(i).array() += physics::joint_friction<Eigen::ArrayXd>(
        friction[static_cast<std::size_t>(i)], {motion.q.col(i), motion.qd.col(i), load.col(i), motion.t});
  expected.col(2).array() += 4.0;
  CHECK((regressor.torques(motion, chi) - expected).norm() < 1e-10 * expected.norm());
  CHECK((regressor.link_torques(motion, chi) - load).norm() < 1e-10 * load.norm());
}

TEST_CASE("what a motion cannot tell is named") {
  const DynamicsModel model = kr5_model();
  const BaseParameters base = base_parameters(model);
  Random random(4);
  JointMotion motion = random_motion(random, 6, 200);
  const Observability all = observability(model, base, motion);
  CHECK(all.unidentifiable.empty());
  CHECK(all.unmoved.empty());
  CHECK(all.condition > 1);
  // The condition number is that of the stacked independent columns.
  const Eigen::MatrixXd Y = DynamicsRegressor(model).evaluate(motion);
  const Eigen::VectorXd s = singular_values(Y(Eigen::all, base.independent));
  CHECK(all.condition == Approx(s[0] / s[51]).epsilon(1e-8));
  motion.q.col(3).setConstant(0.4);
  motion.qd.col(3).setZero();
  motion.qdd.col(3).setZero();
  const Observability still = observability(model, base, motion);
  CHECK(still.unmoved == std::vector<int>{4});
  for (const char* name : {"fc4", "fv4", "Ia4"})
    CHECK(std::count(still.unidentifiable.begin(), still.unidentifiable.end(), name) == 1);
  CHECK(std::isinf(still.condition));
}

TEST_CASE("a model or options that cannot be are refused by name") {
  DynamicsModel model = kr5_model();
  model.structure = Eigen::MatrixXd::Identity(5, 5);
  CHECK_THROWS_WITH(DynamicsRegressor(model), Contains("structure: expected 6 x 6"));
  model = kr5_model();
  model.terms.resize(2);
  CHECK_THROWS_WITH(DynamicsRegressor(model), Contains("terms: expected one entry a joint, 6"));
  BaseParameterOptions options;
  options.lower = Eigen::Vector2d::Zero(), options.upper = Eigen::Vector2d::Ones();
  CHECK_THROWS_WITH(base_parameters(kr5_model(), options), Contains("lower, upper: expected 6 values"));
  options.upper[1] = -1;
  CHECK_THROWS_WITH(base_parameters(kr5_model(), options), Contains("lower must be below upper, joint 2"));
  options = {};
  options.tolerance = 2;
  CHECK_THROWS_WITH(base_parameters(kr5_model(), options), Contains("tolerance must be between 0 and 1"));
  Random random(5);
  CHECK_THROWS_WITH(DynamicsRegressor(kr5_model()).evaluate(random_motion(random, 5, 3)),
                    Contains("motion: expected 6 joints, found 5"));
}

}  // namespace base_parameters_test
