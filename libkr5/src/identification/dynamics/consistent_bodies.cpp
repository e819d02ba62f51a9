// SPDX-License-Identifier: BSD-3-Clause
#include "identification/dynamics/consistent_bodies.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <kr5/core/error.hpp>
#include <kr5/core/levenberg_marquardt.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/identification/dynamics_model.hpp>

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using BodyEquations = NormalEquations<Eigen::Dynamic>;
using BodyVector = Eigen::Matrix<double, 10, 1>;

constexpr int coordinates = 10;      // of a symmetric 4 x 4 matrix
constexpr double negligible = 1e-2;  // step at which a fit has converged [standard deviations]

/// Ixx Ixy Ixz Iyy Iyz Izz, m c and m of a pseudo-inertia, to which they are linear.
BodyVector parameters_of(const Matrix4d& P) {
  BodyVector out;
  out << P(1, 1) + P(2, 2), -P(0, 1), -P(0, 2), P(0, 0) + P(2, 2), -P(1, 2), P(0, 0) + P(1, 1), P(0, 3), P(1, 3),
      P(2, 3), P(3, 3);
  return out;
}

/// Element k of the symmetric 4 x 4 matrix of coordinates y: the diagonal, then the upper triangle row by row.
constexpr std::array<std::array<Index, 2>, coordinates> elements = {
    {{0, 0}, {1, 1}, {2, 2}, {3, 3}, {0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}};

Matrix4d symmetric_matrix(const BodyVector& y) {
  Matrix4d Y;
  for (Index k = 0; k < coordinates; ++k) {
    const auto [r, c] = elements[static_cast<std::size_t>(k)];
    Y(r, c) = Y(c, r) = y[k];
  }
  return Y;
}

BodyVector identity_coordinates() {
  BodyVector y = BodyVector::Zero();
  y.head<4>().setOnes();
  return y;
}

/// Lower triangular L with L L^T the pseudo-inertia of a body.
Matrix4d prior_factor(const kinematics::Body& body) {
  const Eigen::Matrix3d I = body.inertia_matrix();
  const Eigen::Matrix3d central = 0.5 * I.trace() * Eigen::Matrix3d::Identity() - I;
  const bool round = Eigen::LLT<Eigen::Matrix3d>(central).info() == Eigen::Success;
  Matrix4d P;
  P << central + body.mass * body.com * body.com.transpose(), body.mass * body.com, body.mass * body.com.transpose(),
      body.mass;
  const Eigen::LLT<Matrix4d> cholesky(P);
  require(
      body.mass > 0 && round && P.allFinite() && cholesky.info() == Eigen::Success,
      "a body cannot exist: mass " + std::to_string(body.mass) +
          " kg; the mass must be positive, and each principal moment of inertia less than the sum of the other two");
  return cholesky.matrixL();
}

/// tr Y - log det Y - 4; infinite where the body cannot exist.
double divergence(const Matrix4d& Y) {
  const Eigen::LLT<Matrix4d> cholesky(Y);
  if (cholesky.info() != Eigen::Success) return std::numeric_limits<double>::infinity();
  return Y.trace() - 4.0 - 2.0 * cholesky.matrixLLT().diagonal().array().log().sum();
}

/// The objective |A x - z|^2 + weight * sum of divergences of the bodies. x holds the coordinates of Y of every body,
/// where L Y L^T is its pseudo-inertia and L L^T that of the prior, then the other parameters of the model.
struct ConsistentProblem {
  const MatrixXd& A;
  const VectorXd& z;
  MatrixXd information;  ///< A^T A
  int joints;
  double weight;
  Box<Eigen::Dynamic> box;

  double cost(const VectorXd& x) const {
    double out = (A * x - z).squaredNorm();
    for (Index i = 0; i < joints; ++i) out += weight * divergence(body(x, i));
    return out;
  }
  /// A step as long as it surely lowers the cost. Along it, beside a quadratic function of curvature q, are logarithms
  /// of curvature r^2 that end where the first body ceases to exist, at 1 / m: they lie below the one that does so with
  /// their whole curvature, whose minimum is given (Boyd and Vandenberghe 2004, section 9.6).
  VectorXd moved(const VectorXd& x, const VectorXd& step) const {
    double m = 0.0, r2 = 0.0;
    for (Index i = 0; i < joints; ++i) {
      const Eigen::LLT<Matrix4d> cholesky(body(x, i));
      const Matrix4d half = cholesky.matrixL().solve(body(step, i));
      const Matrix4d relative = cholesky.matrixL().solve(half.transpose());
      m = std::max(m, -symmetric_eigen(relative).values.minCoeff());
      r2 += 0.5 * weight * relative.squaredNorm();
    }
    const double q = (A * step).squaredNorm();
    const double length = 2 / (1 + m + std::sqrt(std::max((1 + m) * (1 + m) - 4 * m * q / (q + r2), 0.0)));
    constexpr double part = 0.95;  // of the way to where a body ceases to exist, which rounding must not reach
    return x + (m > 0 ? std::min(length, part / m) : 1.0) * step;
  }
  /// With the exact second derivatives, so that steps are Newton's.
  BodyEquations equations(const VectorXd& x) const {
    BodyEquations out(x.size());
    out.information = information;
    out.gradient = A.transpose() * (A * x - z);
    out.cost = cost(x);
    out.count = static_cast<int>(z.size() + x.size());
    for (Index i = 0; i < joints; ++i) {
      const Matrix4d inverse = body(x, i).inverse(), slope = Matrix4d::Identity() - inverse;
      for (Index k = 0; k < coordinates; ++k) {
        const auto [r, c] = elements[static_cast<std::size_t>(k)];
        const double both = r == c ? 1.0 : 2.0;
        out.gradient[coordinates * i + k] += 0.5 * weight * both * slope(r, c);
        for (Index l = 0; l < coordinates; ++l) {
          const auto [s, d] = elements[static_cast<std::size_t>(l)];
          const double term = inverse(r, s) * inverse(c, d) + inverse(r, d) * inverse(c, s);
          out.information(coordinates * i + k, coordinates * i + l) +=
              0.25 * weight * both * (s == d ? 1.0 : 2.0) * term;
        }
      }
    }
    return out;
  }

 private:
  static Matrix4d body(const VectorXd& x, Index i) { return symmetric_matrix(x.segment<coordinates>(coordinates * i)); }
};

/// Derivative of the parameters of a model by x.
MatrixXd parameter_map(Index size, int joints, const std::vector<kinematics::Body>& priors) {
  MatrixXd out = MatrixXd::Zero(size, size);
  for (Index i = 0; i < joints; ++i) {
    const Matrix4d L = prior_factor(priors[static_cast<std::size_t>(i)]);
    for (Index k = 0; k < coordinates; ++k) {
      const Matrix4d unit = symmetric_matrix(BodyVector::Unit(k));
      out.block<coordinates, 1>(parameters_per_joint * i, coordinates * i + k) =
          parameters_of(L * unit * L.transpose());
    }
  }
  constexpr Index others = parameters_per_joint - coordinates;
  for (Index k = coordinates * joints; k < size; ++k) {
    const Index e = k - coordinates * joints;
    out(e < others * joints ? parameters_per_joint * (e / others) + coordinates + e % others : k, k) = 1.0;
  }
  return out;
}

/// The minimum of the objective's quadratic approximation at the priors, each body made one that can exist.
VectorXd linear_start(const ConsistentProblem& problem, const VectorXd& at_priors) {
  const BodyEquations at = problem.equations(at_priors);
  MatrixXd H = at.information;
  for (Index k = 0; k < H.rows(); ++k)
    if (!(H(k, k) > 0)) H(k, k) = 1.0;  // a parameter without a column
  const VectorXd scale = H.diagonal().cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = scale.asDiagonal() * H * scale.asDiagonal();
  VectorXd x = at_priors - scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(at.gradient)));
  constexpr double least = 0.05;  // of the prior
  for (Index i = 0; i < problem.joints; ++i) {
    const SymmetricEigen axes = symmetric_eigen(symmetric_matrix(x.segment<coordinates>(coordinates * i)));
    const MatrixXd Y = axes.vectors * axes.values.cwiseMax(least).asDiagonal() * axes.vectors.transpose();
    for (Index k = 0; k < coordinates; ++k) {
      const auto [r, c] = elements[static_cast<std::size_t>(k)];
      x[coordinates * i + k] = Y(r, c);
    }
  }
  return problem.box.clamp(x);
}

}  // namespace

ConsistentFit fit_consistent(const MatrixXd& R, const VectorXd& z, int joints,
                             const std::vector<kinematics::Body>& priors, double spread, int max_iterations) {
  const double endless = std::numeric_limits<double>::infinity();
  const Index size = R.cols();
  const MatrixXd map = parameter_map(size, joints, priors);
  const MatrixXd A = R * map;
  VectorXd lower = VectorXd::Constant(size, -endless), x = VectorXd::Zero(size);
  for (Index i = 0; i < joints; ++i) x.segment<coordinates>(coordinates * i) = identity_coordinates();
  // Coulomb and viscous friction and the rotor.
  lower.segment((parameters_per_joint - 3) * joints, 3 * joints).setZero();
  // A divergence is 2 d^2 for a mass or a radius whose logarithm is off by a small d.
  ConsistentProblem problem{
      A, z, A.transpose() * A, joints, 0.5 / (spread * spread), {lower, VectorXd::Constant(size, endless)}};
  LevenbergMarquardtOptions options;
  options.max_iterations = max_iterations;
  options.sigma = 1.0;
  options.tolerance = negligible;
  options.initial_damping = 1e-9;
  const auto found = levenberg_marquardt<Eigen::Dynamic>(linear_start(problem, x), problem, options);

  ConsistentFit out;
  out.iterations = found.iterations;
  out.parameters = map * found.x;
  BodyEquations at = problem.equations(found.x);
  MatrixXd information = at.information;
  for (Index k = 0; k < size; ++k)
    if (!(information(k, k) > 0)) information(k, k) = 1.0;  // a parameter without a column takes no part
  problem.box.hold(found.x, at);
  const VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<MatrixXd> factors(MatrixXd(scale.asDiagonal() * information * scale.asDiagonal()));
  const VectorXd step = scale.cwiseProduct(factors.solve(scale.cwiseProduct(at.gradient)));
  // A minimum, however the steps ended: the problem is convex.
  out.converged = at.gradient.dot(step) <= negligible * negligible;
  if (factors.vectorD().minCoeff() > 1e-14) {
    const MatrixXd C = factors.solve(MatrixXd::Identity(size, size));
    out.covariance = map * scale.asDiagonal() * C * scale.asDiagonal() * map.transpose();
  }
  return out;
}

}  // namespace kr5::identification
