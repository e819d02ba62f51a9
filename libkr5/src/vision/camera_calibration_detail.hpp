// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <vector>

#include <kr5/vision/camera_calibration.hpp>

/// @file
/// Parts of calibrate_camera. "Shared" parameters are those of the camera (12) and of the target's shape (5).

namespace kr5::vision::detail {

/// @throws InvalidArgument for views that no calibration can use.
void check_views(std::span<const View> views, int width, int height);

constexpr int shape_count = 5;
constexpr int shared_count = Pinhole::parameter_count + shape_count;
using Shape = Eigen::Matrix<double, shape_count, 1>;

/// A model to be fitted: which of the shared parameters are free.
struct Model {
  LensModel lens = LensModel::None;
  bool square_pixels = false;
  bool bent_target = false;
  bool centred = false;  ///< Principal point held; only for the start.
  bool operator==(const Model&) const = default;
};
/// Columns: free parameters; shared change = basis * free change.
Eigen::MatrixXd free_basis(const Model& model);
std::vector<std::string> free_names(const Model& model);
/// Puts parameters that the model holds at 0 to 0, and fy to fx for square pixels.
void impose(const Model& model, Pinhole& camera, Shape& shape);

/// The plane of a flat target, in which its bow and stretch are described.
struct TargetPlane {
  bool flat = false;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  Eigen::Matrix3d basis = Eigen::Matrix3d::Identity();  ///< Columns: two directions in the plane, normal.
  double half = 1.0;                                    ///< Half the target's size [m].
};
TargetPlane common_plane(std::span<const View> views);
/// Points of the target as bent by `shape`.
Eigen::Vector3d bend(const TargetPlane& plane, const Shape& shape, const Eigen::Vector3d& point,
                     Eigen::Matrix<double, 3, shape_count>* by_shape = nullptr);

struct State {
  Pinhole camera;
  Shape shape = Shape::Zero();
  std::vector<Pose> poses;  ///< T_camera_target of each view.
};

/// One view, linearised: gradient and information (of half the weighted sum of squares) by its pose and by the
/// shared parameters.
struct Block {
  Matrix6 pose = Matrix6::Zero();
  Vector6 pose_gradient = Vector6::Zero();
  Eigen::MatrixXd cross;   ///< free x 6
  Eigen::MatrixXd shared;  ///< free x free
  Eigen::VectorXd shared_gradient;
  double cost = 0.0;

  /// Information on the shared parameters once the pose is unknown, and the gradient likewise.
  Eigen::MatrixXd reduced() const;
  Eigen::VectorXd reduced_gradient() const;
};

/// Weights of points [1/px^2], one vector a view; an empty or zero one leaves the view out.
using Weights = std::vector<Eigen::VectorXd>;

struct Problem {
  std::span<const View> views;
  TargetPlane plane;
  int max_iterations = 60;
};

/// Seen minus predicted; empty when a point lies behind the camera or at the pole of the lens model.
Eigen::Matrix2Xd residuals(const Problem& problem, const State& state, std::size_t view);
/// The same as one column u1 v1 u2 v2 ... with its derivatives; false as above.
bool linearise(const Problem& problem, const State& state, std::size_t view, Eigen::VectorXd& r,
               Eigen::MatrixXd& by_shared, Eigen::Matrix<double, Eigen::Dynamic, 6>& by_pose);

struct Adjustment {
  State state;
  std::vector<Block> blocks;  ///< At `state`.
  double cost = 0.0;
  int iterations = 0;
  bool converged = false;
};
/// Levenberg-Marquardt with fixed weights; poses are eliminated from the normal equations.
Adjustment adjust(const Problem& problem, const Eigen::MatrixXd& basis, State start, const Weights& weights,
                  int max_iterations);
/// Pose of one view under a known camera.
Pose fit_pose(const Problem& problem, const State& state, std::size_t view, const Eigen::VectorXd& weights);

/// First guess: sound[i] is false where not even a homography explains the view.
struct Start {
  State state;
  std::vector<bool> sound;
};
Start first_guess(std::span<const View> views, int width, int height);

/// An adjustment with weights found from the residuals.
struct RobustFit {
  Adjustment adjustment;
  Weights weights;                 ///< Point weight / view noise^2 [1/px^2]; empty for views left out.
  std::vector<double> view_noise;  ///< [px]
  Eigen::VectorXd zoom;            ///< Direction of fx and fy alike among the free parameters.
  double sigma = 0.0;              ///< [px]
  int points = 0;
};
RobustFit robust_fit(const Problem& problem, const Model& model, const State& start, const std::vector<bool>& used,
                     bool robust, int rounds);
/// Robust scale of a view's residuals per axis [px].
double noise_of(const Eigen::Matrix2Xd& residuals, bool robust, double lost_freedom);
/// Huber weights of the residuals of a view, threshold 3 sigma of the vector's length.
Eigen::VectorXd huber_weights(const Eigen::Matrix2Xd& residuals, double sigma);

/// What the views say of each other.
struct ViewTest {
  int worst = -1;           ///< The view that contradicts the others most, beyond the false-alarm rate; or -1.
  double dispersion = 1.0;  ///< Disagreement of the views over what their noise allows [-].
};
/// Fills influence and probability of the reports, and the reason of the worst one. The test is scaled by the views'
/// disagreement, at least by `correlation`, that of points which err together.
ViewTest test_views(const RobustFit& fit, const std::vector<bool>& used, double false_alarm, double correlation,
                    std::vector<CameraViewReport>& reports);

/// Scores of all models that the options allow; the chosen one is marked. Empty with too few views.
std::vector<CameraModelScore> compare_models(const Problem& problem, const RobustFit& reference,
                                             const std::vector<bool>& used, const CameraOptions& options);

CameraCoverage coverage_of(std::span<const View> views, const std::vector<CameraViewReport>& reports, int width,
                           int height);
void add_findings(const std::vector<bool>& used, const TargetPlane& plane, CameraCalibration& result);

}  // namespace kr5::vision::detail
