// In no namespace of its own, and so compiled alone: Ceres defines CHECK, too.
#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <catch2/catch.hpp>
#include <kr5/calibration/hand_eye.hpp>
#include <kr5/geometry/resection.hpp>

#include "support/hand_eye_world.hpp"

// calibrate_hand_eye eliminates the pose of the target view by view. Here Ceres, with derivatives of its own making and
// the robot pose errors as unknowns, minimises the same sum over all of them at once: both must end at the same poses
// and covariance.

using namespace kr5;
using namespace kr5::calibration;

namespace {

using Six = std::array<double, 6>;  // [translation, rotation vector]

template <class T>
void transform(const T* pose, const T* point, T* out) {
  ceres::AngleAxisRotatePoint(pose + 3, point, out);
  for (int k = 0; k < 3; ++k) out[k] += pose[k];
}

template <class T>
void transform_back(const T* pose, const T* point, T* out) {
  const T shifted[3] = {point[0] - pose[0], point[1] - pose[1], point[2] - pose[2]};
  const T turn[3] = {-pose[3], -pose[4], -pose[5]};
  ceres::AngleAxisRotatePoint(turn, shifted, out);
}

/// A camera on the hand sees one point; written from the lens equation, not from Pinhole::project.
struct PixelResidual {
  Pinhole camera;
  Six T_base_flange;
  Eigen::Vector3d point;
  Eigen::Vector2d pixel;
  double scale;

  template <class T>
  bool operator()(const T* X, const T* Z, const T* e, T* residual) const {
    T reported[6];
    for (int k = 0; k < 6; ++k) reported[k] = T(T_base_flange[k]);
    const T local[3] = {T(point.x()), T(point.y()), T(point.z())};
    T in_base[3], in_reported[3], in_flange[3], p[3];
    transform(Z, local, in_base);
    transform_back(reported, in_base, in_reported);
    transform_back(e, in_reported, in_flange);
    transform_back(X, in_flange, p);
    const T x = p[0] / p[2], y = p[1] / p[2], r = x * x + y * y;
    const T g = 1.0 + camera.k1 * r + camera.k2 * r * r;
    residual[0] =
        scale * (camera.fx * (x * g + 2 * camera.p1 * x * y + camera.p2 * (r + 2.0 * x * x)) + camera.cx - pixel.x());
    residual[1] =
        scale * (camera.fy * (y * g + camera.p1 * (r + 2.0 * y * y) + 2 * camera.p2 * x * y) + camera.cy - pixel.y());
    return true;
  }
};

struct RobotResidual {
  double position, rotation;
  template <class T>
  bool operator()(const T* e, T* residual) const {
    for (int k = 0; k < 6; ++k) residual[k] = e[k] / T(k < 3 ? position : rotation);
    return true;
  }
};

Six six(const Pose& T) {
  Six out;
  Eigen::Map<Vector6>(out.data()) = to_vector(T);
  return out;
}

Pose pose(const Six& v) { return to_pose(Eigen::Map<const Vector6>(v.data())); }

}  // namespace

TEST_CASE("ends where Ceres ends when it minimises the same sum over every robot pose error at once") {
  const double sp = 1e-3, sr = 2e-3, su = 0.3;
  for (const std::uint64_t seed : {3, 4, 5}) {
    const auto world = test::make_hand_eye_world(
        {.views = 12, .sigma_pixel = su, .sigma_robot_position = sp, .sigma_robot_rotation = sr, .seed = seed});
    const HandEyeResult ours = calibrate_hand_eye(
        world.views, world.camera, {.sigma_pixel = su, .sigma_robot_position = sp, .sigma_robot_rotation = sr});
    REQUIRE(ours.fit.usable());

    Six X = six(world.T_mount_camera), Z = six(world.T_fixed_target);
    std::vector<Six> e(world.views.size(), Six{});
    ceres::Problem problem;
    for (std::size_t i = 0; i < world.views.size(); ++i) {
      REQUIRE_FALSE(ours.views[i].outlier);
      const View& view = world.views[i].view;
      const Eigen::VectorXd weights = resect(view.points, view.pixels, world.camera).front().weights;
      for (int k = 0; k < view.points.cols(); ++k)
        problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PixelResidual, 2, 6, 6, 6>(new PixelResidual{
                                     world.camera, six(world.views[i].T_base_flange), view.points.col(k),
                                     view.pixels.col(k), std::sqrt(weights[k]) / su}),
                                 nullptr, X.data(), Z.data(), e[i].data());
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<RobotResidual, 6, 6>(new RobotResidual{sp, sr}), nullptr,
                               e[i].data());
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.max_num_iterations = 200;
    options.function_tolerance = options.gradient_tolerance = options.parameter_tolerance = 1e-15;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    REQUIRE(summary.IsSolutionUsable());

    // Both stop within a small part of what the data can tell at all.
    const Vector6 sigma = ours.covariance.diagonal().cwiseSqrt();
    const Vector6 sigma_target = ours.covariance_target.diagonal().cwiseSqrt();
    CAPTURE(seed);
    CHECK(pose_difference(pose(X), ours.T_mount_camera).cwiseQuotient(sigma).cwiseAbs().maxCoeff() < 2e-3);
    CHECK(pose_difference(pose(Z), ours.T_fixed_target).cwiseQuotient(sigma_target).cwiseAbs().maxCoeff() < 2e-3);

    ceres::Covariance covariance{ceres::Covariance::Options()};
    const std::vector<std::pair<const double*, const double*>> blocks = {{X.data(), X.data()}};
    REQUIRE(covariance.Compute(blocks, &problem));
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> C;
    covariance.GetCovarianceBlock(X.data(), X.data(), C.data());
    // Positions only: Ceres perturbs rotation vectors, we rotations. Right perturbation turns them into camera axes.
    const Eigen::Matrix3d R = ours.T_mount_camera.linear();
    const Eigen::Vector3d theirs = (R.transpose() * C.topLeftCorner<3, 3>() * R).diagonal().cwiseSqrt();
    for (int k = 0; k < 3; ++k) CHECK(sigma[k] == Approx(theirs[k]).epsilon(0.02));
  }
}
