#include <limits>

#include <catch2/catch.hpp>

#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/problem.hpp>

#include "fit/derivatives.hpp"
#include "fit/fit_world.hpp"

namespace pose_test {

using namespace kr5;
using namespace kr5::fit;
using namespace kr5::test;

TEST_CASE("poses count by their covariance, which may change") {
  Random random(9);
  const auto random_covariance = [&] {
    const Eigen::MatrixXd A = Eigen::MatrixXd::NullaryExpr(6, 8, [&] { return random.normal(); });
    return Matrix6(1e-6 * A * A.transpose());
  };
  const Matrix6 C = random_covariance(), D = random_covariance();
  Vector6 d;
  d << 1e-4, -2e-4, 1e-4, 1e-5, 2e-5, -1e-5;
  Problem fit;
  const FitBlock pose = fit.add_pose("pose", Pose::Identity());
  fit.add(PoseMeasurement(PoseChain().then(pose), Pose::Identity(), C));
  const FitMeasurement second =
      fit.add(PoseMeasurement(PoseChain().then(pose), to_pose(d), Matrix6(Matrix6::Identity())));
  fit.set_covariance(second, D);
  const Solution result = fit.solve();
  const Matrix6 mean_covariance = (C.inverse() + D.inverse()).inverse();
  CHECK((to_vector(fit.pose(pose)) - mean_covariance * D.inverse() * d).norm() < 1e-4 * d.norm());
  CHECK(result.covariance.isApprox(mean_covariance, 1e-3));
}

TEST_CASE("a pose may be seen without its orientation") {
  Problem fit;
  const FitBlock pose = fit.add_pose("pose", Pose::Identity());
  Pose seen = Pose::Identity();
  seen.translation() << 0.1, 0.2, 0.3;
  fit.add(PoseMeasurement(PoseChain().then(pose), seen, 1e-3, std::numeric_limits<double>::infinity()));
  const Solution result = fit.solve();
  CHECK((fit.pose(pose).translation() - seen.translation()).norm() < 1e-9);
  CHECK(result.unidentifiable.size() == 3);
}

TEST_CASE("a pose is off by the right perturbation from where it was seen, in standard deviations") {
  Vector6 d;
  d << 2e-3, -1e-3, 3e-3, 0.2, -0.1, 0.3;
  Random random(38);
  const Pose seen = random_pose(random);
  Problem problem;
  const FitMeasurement m = problem.add(PoseMeasurement(PoseChain().then(Pose(seen * to_pose(d))), seen, 1e-3, 0.1));
  Vector6 expected;
  expected << 2, -1, 3, 2, -1, 3;
  CHECK((problem.residuals(m) - expected).norm() < 1e-9);
}

TEST_CASE("a pose changes with all poses of its chain") {
  Random random(39);
  Problem problem;
  const FitBlock base = problem.add_pose("base", random_pose(random)),
                 arm = problem.add_arm("arm", random_arm(random, 3)),
                 tool = problem.add_pose("tool", random_pose(random));
  const FitMeasurement m = problem.add(PoseMeasurement(
      PoseChain().then_inverse(base).then_arm(arm, random.normal_vector(3)).then(tool), random_pose(random), 0.1, 0.1));
  check_derivatives(problem, m, {base, arm, tool});
}

}  // namespace pose_test
