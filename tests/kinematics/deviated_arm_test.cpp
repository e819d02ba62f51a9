#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/kinematics/deviated_arm.hpp>

namespace deviated_arm_test {

using namespace kr5;
using namespace kr5::kinematics;
using Catch::Matchers::Contains;

namespace {

double& field(DhJoint& joint, DhParameter parameter) {
  if (parameter == DhParameter::B) return joint.b;
  if (parameter == DhParameter::A) return joint.a;
  if (parameter == DhParameter::Beta) return joint.beta;
  return parameter == DhParameter::Theta ? joint.theta_offset : joint.alpha;
}

}  // namespace

TEST_CASE("errors of deviated arms are those of chains made one by one, prismatic joints included") {
  Random random(5);
  for (const bool joints_vary : {false, true}) {
    DeviatedArm arm;
    for (int i = 0; i < 5; ++i)
      arm.nominal.joints.push_back({.type = i == 2 ? JointType::Prismatic : JointType::Revolute,
                                    .b = random.normal(),
                                    .theta_offset = random.normal(),
                                    .a = random.normal(),
                                    .alpha = random.normal(),
                                    .beta = i == 1 ? 0.1 : 0.0});
    arm.nominal.T_base_0 = to_pose(Vector6(random.normal_vector(6)));
    arm.parameters = joint_parameters(arm.nominal);
    arm.parameters[7].parameter = DhParameter::Beta;  // in place of alpha2
    arm.q = random.normal_vector(5);
    arm.joints_vary = joints_vary;
    const Eigen::Index width = 20 + (joints_vary ? 5 : 0);
    Rows deviations = Rows::NullaryExpr(30, width, [&] { return random.normal(0.1); });
    deviations.bottomRows(10).leftCols(15) = deviations.row(0).leftCols(15).replicate(10, 1);  // links that are kept
    const Rows errors = arm.errors(deviations);
    for (Eigen::Index k = 0; k < deviations.rows(); ++k) {
      DhChain chain = arm.nominal;
      for (std::size_t i = 0; i < 20; ++i)
        field(chain.joints[i / 4], arm.parameters[i].parameter) += deviations(k, static_cast<Eigen::Index>(i));
      const Eigen::VectorXd q = joints_vary ? Eigen::VectorXd(deviations.row(k).tail(5).transpose()) : arm.q;
      const Pose T = chain.flange(q), nominal = arm.nominal.flange(q);
      CHECK((errors.row(k).head<3>().transpose() - (T.translation() - nominal.translation())).norm() < 1e-12);
      CHECK((exp_rotation(errors.row(k).tail<3>().transpose()) * nominal.linear() - T.linear()).norm() < 1e-12);
    }
  }
}

TEST_CASE("parameters of an arm have the names of the tables, and one it has not is refused") {
  DeviatedArm arm{
      .nominal = DhChain{Pose::Identity(), {DhJoint{}, DhJoint{}}}, .parameters = {}, .q = Eigen::Vector2d::Zero()};
  arm.parameters = joint_parameters(arm.nominal);
  REQUIRE(arm.parameters.size() == 8);
  CHECK(arm.parameters[4].label() == "b2");
  CHECK(arm.parameters[7].label() == "alpha2");
  CHECK(JointParameter{1, DhParameter::Beta}.label() == "beta2");
  CHECK_FALSE(JointParameter{1, DhParameter::Beta}.is_length());
  CHECK_THROWS_WITH(arm.errors(Rows::Zero(3, 7)), Contains("deviations have 7 columns, expected 8"));
  arm.parameters[0].joint = 2;
  CHECK_THROWS_WITH(arm.errors(Rows::Zero(3, 8)), Contains("the arm has no joint 3"));
  arm.q = Eigen::Vector3d::Zero();
  CHECK_THROWS_WITH(arm.errors(Rows::Zero(3, 8)), Contains("q has 3 values, the arm 2 joints"));
}

}  // namespace deviated_arm_test
