#include <numbers>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/kinematics/dh_chain.hpp>

namespace dh_chain_test {

using namespace kr5;
using namespace kr5::kinematics;

namespace {
/// Table 3.1 of Hayat et al. 2022; `alpha3` as printed (+90 deg) or as the KUKA drawing has it (-90 deg).
DhChain kr5_arc(double alpha3) {
  const double h = std::numbers::pi / 2, pi = std::numbers::pi;
  DhChain chain;
  chain.joints = {{JointType::Revolute, 0.4, 0, 0.18, h},    {JointType::Revolute, 0, h, 0.6, pi},
                  {JointType::Revolute, 0, 0, 0.12, alpha3}, {JointType::Revolute, 0.62, pi, 0, h},
                  {JointType::Revolute, 0, -h, 0, h},        {JointType::Revolute, 0, h, 0, 0}};
  return chain;
}
}  // namespace

TEST_CASE("forward kinematics of the printed table") {
  const double h = std::numbers::pi / 2, deg = std::numbers::pi / 180;
  Eigen::VectorXd q = Eigen::VectorXd::Zero(6);
  CHECK((kr5_arc(h).flange(q).translation() - Eigen::Vector3d(-0.44, 0, 1.12)).norm() < 1e-12);
  CHECK((kr5_arc(-h).flange(q).translation() - Eigen::Vector3d(0.8, 0, 1.12)).norm() < 1e-12);
  q << 0, 70 * deg, 12 * deg, 0, 0, 0;
  CHECK((kr5_arc(h).flange(q).translation() - Eigen::Vector3d(-0.8141, 0, 0.1430)).norm() < 1e-4);
  CHECK((kr5_arc(-h).flange(q).translation() - Eigen::Vector3d(-0.1570, 0, 1.1946)).norm() < 1e-4);
}

TEST_CASE("prismatic joint slides along its axis and Hayati's beta turns about y") {
  DhChain chain;
  chain.joints = {{JointType::Prismatic, 0.1, 0, 0, 0}};
  CHECK(chain.flange(Eigen::VectorXd::Constant(1, 0.25)).translation().z() == Approx(0.35));
  chain.joints[0].beta = 0.2;
  const Eigen::Matrix3d R = chain.flange(Eigen::VectorXd::Zero(1)).linear();
  CHECK((R - Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitY()).toRotationMatrix()).norm() < 1e-15);
}

TEST_CASE("last link pose is the flange, and the wrong number of joints is refused") {
  const DhChain chain = kr5_arc(1.0);
  const Eigen::VectorXd q = Eigen::VectorXd::LinSpaced(6, -1, 1);
  CHECK(chain.link_poses(q).back().isApprox(chain.flange(q), 1e-15));
  CHECK_THROWS_AS(chain.flange(Eigen::VectorXd::Zero(5)), InvalidArgument);
}

TEST_CASE("rows of joint values give the flange of each") {
  const DhChain chain = kr5_arc(1.0);
  const Rows q = Rows::Random(3, 6);
  const Rows T = chain.flanges(q);
  for (int k = 0; k < 3; ++k) {
    const Eigen::Matrix4d expected = chain.flange(q.row(k)).matrix();
    CHECK(T.row(k).reshaped<Eigen::RowMajor>(4, 4) == expected);
  }
  CHECK_THROWS_AS(chain.flanges(Rows::Zero(2, 5)), InvalidArgument);
}

}  // namespace dh_chain_test
