// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/fit/measurements/pixels.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <Eigen/Dense>
#include <kr5/core/error.hpp>

namespace kr5::fit {
namespace {

constexpr int rows_of_pose = 7;  // six that hang on it, and what is left

}  // namespace

/// A pixel over its standard deviation, and its derivatives where they are wanted.
struct PixelMeasurement::Rows {
  Eigen::Vector2d r;
  Eigen::Matrix<double, 2, 6> by_chain;  ///< By the right perturbation of the target; its left half by the point.
  Eigen::Matrix<double, 2, Pinhole::parameter_count> by_camera;
};

PixelMeasurement::PixelMeasurement(PoseChain T_camera_target, FitBlock camera, Eigen::Matrix3Xd points,
                                   Eigen::Matrix2Xd pixels, double sigma, FitDeformation deformation)
    : chain_(std::move(T_camera_target)),
      camera_(camera),
      points_(std::move(points)),
      pixels_(std::move(pixels)),
      whitening_(Eigen::VectorXd::Constant(points_.cols(), 1 / sigma)),
      deformation_(std::move(deformation)) {
  require(sigma > 0, "sigma must be positive [px]");
  require(points_.cols() == pixels_.cols() && points_.cols() > 0,
          std::to_string(points_.cols()) + " points, but " + std::to_string(pixels_.cols()) + " pixels");
  require(points_.allFinite() && pixels_.allFinite(), "points and pixels must be finite");
  if (deformation_.amounts.exists())
    require(deformation_.displacements.rows() == 3 * points_.cols() && deformation_.displacements.allFinite(),
            "displacements of a deformation must be finite, three rows a point and one column an amount");
}

void PixelMeasurement::set_sigmas(const Eigen::VectorXd& sigmas) {
  require(sigmas.size() == points_.cols(), "sigmas of pixels belong to a measurement of as many pixels");
  require(!sigmas.hasNaN() && (sigmas.array() > 0).all(), "sigmas must be positive [px]");
  whitening_ = sigmas.cwiseInverse();
}

void PixelMeasurement::declare(BlockUse& use) const {
  use.chain(chain_), use.camera(camera_);
  if (deformation_.amounts.exists())
    use.vector(deformation_.amounts, deformation_.displacements.cols(),
               "displacements of a deformation must be finite, three rows a point and one column an amount");
}

/// Points moved by what deforms their target.
Eigen::Matrix3Xd PixelMeasurement::deformed_points(const Evaluation& e) const {
  if (!deformation_.amounts.exists()) return points_;
  const Eigen::MatrixXd& D = deformation_.displacements;
  const Eigen::VectorXd moved = D * Eigen::Map<const Eigen::VectorXd>(e.values(deformation_.amounts), D.cols());
  return points_ + moved.reshaped(3, points_.cols());
}

/// Calls visit(k, Rows) for each pixel that has a part; false where a point is beyond what the camera can see.
template <class Visit>
bool PixelMeasurement::each_pixel(const Evaluation& e, const Pose& T, Visit&& visit) const {
  const Pinhole camera = e.camera(camera_);
  const Eigen::Matrix3Xd points = deformed_points(e);
  const bool by_lens = e.wanted(camera_);
  Eigen::Matrix<double, 2, 3> P;
  Rows rows;
  for (Eigen::Index k = 0; k < points.cols(); ++k) {
    const double whitening = whitening_[k];
    if (whitening == 0.0) continue;
    const Eigen::Vector3d point = points.col(k), seen = T * point;
    if (!camera.covers(seen)) return false;
    rows.r = whitening * (camera.project(seen, e.derivatives() ? &P : nullptr, by_lens ? &rows.by_camera : nullptr) -
                          pixels_.col(k));
    if (e.derivatives()) {
      rows.by_chain.leftCols<3>() = whitening * P * T.linear();
      rows.by_chain.rightCols<3>() = -rows.by_chain.leftCols<3>() * skew(point);
      if (by_lens) rows.by_camera *= whitening;
    }
    visit(k, rows);
  }
  return true;
}

bool PixelMeasurement::evaluate_all(const Evaluation& e, const ChainState& at) const {
  const bool by_lens = e.wanted(camera_), by_shape = e.wanted(deformation_.amounts);
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_chain =
      Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(e.derivatives() ? e.rows() : 0, 6);
  e.residuals().setZero();
  const bool exists = each_pixel(e, at.T, [&](Eigen::Index k, const Rows& pixel) {
    e.residuals().segment<2>(2 * k) = pixel.r;
    if (!e.derivatives()) return;
    by_chain.middleRows<2>(2 * k) = pixel.by_chain;
    if (by_lens) e.by(camera_).middleRows<2>(2 * k) = pixel.by_camera;
    if (by_shape)
      e.by(deformation_.amounts).middleRows<2>(2 * k) =
          pixel.by_chain.leftCols<3>() * deformation_.displacements.middleRows<3>(3 * k);
  });
  if (!exists || !e.residuals().allFinite()) return false;
  e.add(at, by_chain);
  return true;
}

/// The pixels of a known camera by seven rows: with H = J' J = M' M and g = J' r, the rows M d + M^-T g have the
/// information H, the gradient g and, with a last row that does not depend on d, the squares of r.
bool PixelMeasurement::evaluate_condensed(const Evaluation& e, const ChainState& at) const {
  Matrix6 H = Matrix6::Zero();
  Vector6 g = Vector6::Zero();
  double squares = 0.0;
  const bool exists = each_pixel(e, at.T, [&](Eigen::Index, const Rows& pixel) {
    squares += pixel.r.squaredNorm();
    if (!e.derivatives()) return;
    H.noalias() += pixel.by_chain.transpose() * pixel.by_chain;
    g.noalias() += pixel.by_chain.transpose() * pixel.r;
  });
  if (!exists || !std::isfinite(squares)) return false;
  Eigen::Map<Eigen::VectorXd> out = e.residuals();
  out.setZero();
  out[rows_of_pose - 1] = std::sqrt(squares);
  if (!e.derivatives()) return true;
  const Eigen::LDLT<Matrix6> factors(H);  // P' L D L' P, where rounding or points on a line leave D without its last
  const auto P = factors.transpositionsP();
  const Matrix6 L = factors.matrixL();
  const Vector6 along = factors.matrixL().solve(Vector6(P * g));
  const Vector6 own = P * Vector6(H.diagonal());
  Eigen::Matrix<double, Eigen::Dynamic, 6> by_chain = Eigen::Matrix<double, Eigen::Dynamic, 6>::Zero(rows_of_pose, 6);
  for (Eigen::Index k = 0; k < 6; ++k) {
    const double d = factors.vectorD()[k];
    if (!(d > 1e-14 * own[k])) continue;
    by_chain.row(k) = std::sqrt(d) * (P.transpose() * L.col(k)).transpose();
    out[k] = along[k] / std::sqrt(d);
  }
  out[rows_of_pose - 1] = std::sqrt(std::max(0.0, squares - out.head<6>().squaredNorm()));
  e.add(at, by_chain);
  return true;
}

bool PixelMeasurement::evaluate(const Evaluation& e) const {
  const auto at = e.state(chain_);
  if (!at) return false;
  return e.rows() < rows() ? evaluate_condensed(e, *at) : evaluate_all(e, *at);
}

int PixelMeasurement::condensed_rows(const std::function<bool(FitBlock)>& free) const {
  for (const FitBlock block : {camera_, deformation_.amounts})
    if (block.exists() && free(block)) return rows();
  return std::min(rows(), rows_of_pose);
}

}  // namespace kr5::fit
