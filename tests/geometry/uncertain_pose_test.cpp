#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/geometry/uncertain_pose.hpp>

namespace uncertain_pose_test {

using namespace kr5;
using Catch::Matchers::Contains;

namespace {

Matrix6 random_covariance(Random& random, double scale) {
  const Matrix6 A = Matrix6::NullaryExpr([&] { return random.normal(scale); });
  return A * A.transpose();
}

UncertainPose random_pose(Random& random, double scale) {
  Vector6 d;
  d << random.normal_vector(3), random.normal_vector(3, 0.8);
  return {to_pose(d), random_covariance(random, scale)};
}

Vector6 draw(Random& random, const Matrix6& covariance) { return covariance.llt().matrixL() * random.normal_vector(6); }

/// The same of a covariance without an inverse, that is diagonal.
Vector6 draw_singular(Random& random, const Matrix6& covariance) {
  return covariance.diagonal().cwiseSqrt().cwiseProduct(Vector6(random.normal_vector(6)));
}

/// The scanner on the flange and the covariance of its points, as printed (Hayat et al. 2022, eq. 2.8 and 3.60) [mm].
const Eigen::Matrix3d scanner_rotation =
    (Eigen::Matrix3d() << -0.8232, -0.5674, -0.0202, -0.5665, 0.8233, -0.0370, 0.0377, -0.0190, -0.9991).finished();
const Eigen::Matrix3d scanner_noise = (Eigen::Matrix3d() << 0.0346, 0, -0.1104, 0, 0, 0, -0.1104, 0, 0.9298).finished();

}  // namespace

TEST_CASE("the covariance of a chain and of an inverse is that of drawn poses") {
  Random random(1);
  const UncertainPose A = random_pose(random, 1e-3), B = random_pose(random, 2e-3);
  const UncertainPose AB = A * B, inv = inverse(A);
  Matrix6 chain = Matrix6::Zero(), back = Matrix6::Zero();
  const int n = 40000;
  for (int i = 0; i < n; ++i) {
    const Pose a = A.T * to_pose(draw(random, A.covariance)), b = B.T * to_pose(draw(random, B.covariance));
    const Vector6 d = pose_difference(AB.T, a * b), e = pose_difference(inv.T, a.inverse());
    chain += d * d.transpose() / n, back += e * e.transpose() / n;
  }
  CHECK((chain - AB.covariance).norm() < 0.03 * AB.covariance.norm());
  CHECK((back - inv.covariance).norm() < 0.03 * inv.covariance.norm());
}

TEST_CASE("the contributions of the poses of a chain add up to its covariance") {
  Random random(9);
  std::vector<UncertainPose> chain;
  for (int i = 0; i < 4; ++i) chain.push_back(random_pose(random, 2e-3));
  const std::vector<Matrix6> parts = chain_contributions(chain);
  REQUIRE(parts.size() == 4);
  Matrix6 sum = Matrix6::Zero();
  for (std::size_t k = 0; k < parts.size(); ++k) {
    std::vector<UncertainPose> alone = chain;
    for (std::size_t i = 0; i < alone.size(); ++i)
      if (i != k) alone[i].covariance.setZero();
    CHECK(parts[k].isApprox(propagate_chain(alone).covariance, 1e-12));
    sum += parts[k];
  }
  CHECK(sum.isApprox(propagate_chain(chain).covariance, 1e-12));
  chain[1].covariance(2, 2) = -1;
  CHECK_THROWS_WITH(chain_contributions(chain), Contains("pose 2 of the chain"));
  CHECK_THROWS_WITH(chain_contributions({}), Contains("no poses"));
}

TEST_CASE("the change of deviations is the largest of any axis that has an error") {
  Matrix6 first = Matrix6::Zero(), second = Matrix6::Zero();
  first.diagonal() << 1, 4, 0, 1, 1, 1;
  second.diagonal() << 1.21, 4, 9, 1, 0.25, 1;
  CHECK(deviation_change(first, second) == Approx(0.5));
  CHECK(deviation_change(first, first) == 0);
  CHECK(deviation_change(Matrix6::Zero(), second) == 0);
}

TEST_CASE("a chain is propagated as its poses one by one, and drawn poses tell which order is right") {
  Random random(6);
  std::vector<UncertainPose> chain;
  for (int i = 0; i < 3; ++i) chain.push_back(random_pose(random, 2e-3));
  const UncertainPose first = propagate_chain(chain), small = chain[0] * chain[1] * chain[2];
  CHECK((first.T.matrix() - small.T.matrix()).norm() < 1e-12);
  CHECK((first.covariance - small.covariance).norm() < 1e-12 * small.covariance.norm());
  CHECK((propagate_chain_unscented(chain).covariance - first.covariance).norm() < 1e-3 * first.covariance.norm());

  // Rotations of 0.3 rad on levers of 1 m: the mean moves by the second order, which the unscented transform has.
  chain.assign(2, {to_pose((Vector6() << 1, 0, 0, 0, 0, 0.5).finished()), Matrix6::Zero()});
  for (UncertainPose& pose : chain) pose.covariance(5, 5) = 0.09;
  const UncertainPose unscented = propagate_chain_unscented(chain), linear = propagate_chain(chain);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  const int n = 40000;
  for (int i = 0; i < n; ++i) {
    Pose T = Pose::Identity();
    for (const UncertainPose& pose : chain) T = T * pose.T * to_pose(draw_singular(random, pose.covariance));
    mean += T.translation() / n;
  }
  CHECK((unscented.T.translation() - mean).norm() < 0.1 * (linear.T.translation() - mean).norm());
  chain[1].covariance(0, 0) = -1e-4;
  CHECK_THROWS_WITH(propagate_chain(chain), Contains("pose 2 of the chain") && Contains("negative eigenvalue -0.0001"));
  CHECK_THROWS_WITH(propagate_chain_unscented({}), Contains("no poses"));
}

TEST_CASE("a matrix that is no covariance is told with its eigenvalue") {
  Eigen::Matrix3d printed;
  printed << 0.0187, 0.0146, -0.0663, 0.0146, 0.0115, -0.024, -0.0663, -0.024, 0.09341;
  CHECK_THAT(covariance_defect(printed), Contains("negative eigenvalue -0.020"));
  printed(2, 2) = 0.9341;
  CHECK_THAT(covariance_defect(printed), Contains("negative eigenvalue -0.0005"));
  CHECK(covariance_defect(printed, 1e-3).empty());  // the digits of the print
  CHECK(covariance_defect(Eigen::Matrix2d::Identity()).empty());
  CHECK_THAT(covariance_defect(Eigen::MatrixXd::Zero(2, 3)), Contains("2 x 3"));
  CHECK_THAT(covariance_defect(Eigen::Matrix2d::Constant(NAN)), Contains("not finite"));
  Eigen::Matrix2d skewed = Eigen::Matrix2d::Identity();
  skewed(0, 1) = 0.1;
  CHECK_THAT(covariance_defect(skewed), Contains("not symmetric"));
}

TEST_CASE("a point by an uncertain pose has the covariance of drawn points, the lever arm included") {
  Random random(2);
  const UncertainPose T = random_pose(random, 1e-3);
  const Eigen::Vector3d p(0.3, -0.1, 0.34);
  const Eigen::Matrix3d C = 1e-8 * Eigen::Matrix3d::Identity();
  const UncertainVector with = transform_point(T, p, C), without = transform_point(T, p, C, false);
  Eigen::Matrix3d drawn = Eigen::Matrix3d::Zero();
  const int n = 40000;
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d d = T.T * to_pose(draw(random, T.covariance)) * (p + random.normal_vector(3, 1e-4)) - T.T * p;
    drawn += d * d.transpose() / n;
  }
  CHECK((drawn - with.covariance).norm() < 0.03 * with.covariance.norm());
  CHECK((drawn - without.covariance).norm() > 0.1 * with.covariance.norm());
}

TEST_CASE("the scanner's covariance at the flange is the printed one with its slip corrected") {
  // Eq. 3.61 with 3.60 and 3.66; of 3.68 the last entry is printed a tenth of what it is.
  UncertainPose T;
  T.T.linear() = nearest_rotation(scanner_rotation);
  T.covariance.topLeftCorner<3, 3>() = 1e-4 * Eigen::Matrix3d::Identity();
  T.covariance.topLeftCorner<3, 3>() = T.T.linear().transpose() * T.covariance.topLeftCorner<3, 3>() * T.T.linear();
  const Eigen::Matrix3d at_flange = transform_point(T, Eigen::Vector3d::Zero(), scanner_noise).covariance;
  const Eigen::Matrix3d corrected =
      (Eigen::Matrix3d() << 0.0187, 0.0146, -0.0663, 0.0146, 0.0115, -0.024, -0.0663, -0.024, 0.9341).finished();
  CHECK((at_flange - corrected).cwiseAbs().maxCoeff() < 0.007);
  CHECK(is_covariance(at_flange));
  Eigen::Matrix3d printed = corrected;
  printed(2, 2) = 0.09341;
  CHECK_FALSE(is_covariance(printed));
  const Eigen::Matrix3d fused_printed =
      1e-3 *
      (Eigen::Matrix3d() << -0.2133, 0.0129, -0.568, 0.0129, 0.0045, -0.2152, -0.568, -0.2152, 0.8689).finished();
  CHECK_FALSE(is_covariance(fused_printed));
}

TEST_CASE("first order is exact for a linear function, unscented also for the mean of a quadratic one") {
  Random random(3);
  const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(2, 4, [&] { return random.normal(); }),
                        B = Eigen::MatrixXd::NullaryExpr(4, 4, [&] { return random.normal(); });
  const Eigen::MatrixXd C = B * B.transpose();
  const Eigen::VectorXd mean = random.normal_vector(4);
  const auto linear = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd { return A * x; };
  for (const UncertainVector& y : {propagate(linear, mean, C), propagate_unscented(linear, mean, C)}) {
    CHECK((y.value - A * mean).norm() < 1e-9);
    CHECK((y.covariance - A * C * A.transpose()).norm() < 1e-6 * C.norm());
  }
  const auto square = [](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    return Eigen::VectorXd::Constant(1, x.squaredNorm());
  };
  CHECK(propagate_unscented(square, mean, C).value[0] == Approx(mean.squaredNorm() + C.trace()).epsilon(1e-9));
  CHECK(propagate(square, mean, C).value[0] == Approx(mean.squaredNorm()));
}

TEST_CASE("fused measurements are more certain than each, and weighted by their covariances") {
  const UncertainVector scanner{Eigen::Vector3d(1, 2, 3), (Eigen::Vector3d(1, 4, 1).asDiagonal())},
      camera{Eigen::Vector3d(2, 2, 7), (Eigen::Vector3d(1, 1, 9).asDiagonal())};
  const std::vector<UncertainVector> both = {scanner, camera};
  const UncertainVector fused = fuse(both);
  CHECK((fused.value - Eigen::Vector3d(1.5, 2, 3.4)).norm() < 1e-12);
  CHECK((fused.covariance - Eigen::MatrixXd(Eigen::Vector3d(0.5, 0.8, 0.9).asDiagonal())).norm() < 1e-12);
  CHECK(fused.covariance.trace() < std::min(scanner.covariance.trace(), camera.covariance.trace()));
}

TEST_CASE("what is no covariance is refused") {
  const auto f = [](const Eigen::VectorXd& x) -> Eigen::VectorXd { return x; };
  Eigen::Matrix2d bad;
  bad << 1, 2, 2, 1;
  CHECK_THROWS_WITH(propagate(f, Eigen::Vector2d(0, 0), bad), Contains("negative eigenvalue"));
  CHECK_THROWS_WITH(propagate(f, Eigen::Vector3d(0, 0, 0), bad), Contains("covariance is 2 x 2, the mean has 3"));
  CHECK_THROWS_WITH(fuse({}), Contains("no measurements"));
}

}  // namespace uncertain_pose_test
