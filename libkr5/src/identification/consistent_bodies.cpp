// SPDX-License-Identifier: BSD-3-Clause
#include "consistent_bodies.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/identification/dynamics_model.hpp>

namespace kr5::identification {
namespace {

using Eigen::Index;
using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using BodyEquations = NormalEquations<Eigen::Dynamic>;

constexpr int coordinates = 10;

/// Inertias, first moments and mass of a pseudo-inertia [Sigma, h; h^T, m], to which they are linear.
Eigen::Matrix<double, 10, 1> parameters_of(const Matrix4d& J) {
  Eigen::Matrix<double, 10, 1> out;
  out << J(1, 1) + J(2, 2), -J(0, 1), -J(0, 2), J(0, 0) + J(2, 2), -J(1, 2), J(0, 0) + J(1, 1), J(0, 3), J(1, 3),
      J(2, 3), J(3, 3);
  return out;
}

/// U without the factor e^alpha.
Matrix4d unit_factor(const BodyCoordinates& x) {
  Matrix4d U;
  U << std::exp(x[1]), x[4], x[5], x[7], 0, std::exp(x[2]), x[6], x[8], 0, 0, std::exp(x[3]), x[9], 0, 0, 0, 1;
  return U;
}

/// The model as a function of the coordinates of all bodies, then the other parameters.
struct ConsistentProblem {
  const MatrixXd& R;
  const VectorXd& z;
  int joints;
  const VectorXd& prior;
  const VectorXd& spread;  ///< Infinite: no prior.
  Box<Eigen::Dynamic> box;

  static constexpr int others_per_joint = parameters_per_joint - coordinates;

  /// Parameter of the model behind coordinate k >= 10 joints.
  Index other(Index k) const {
    const Index e = k - coordinates * joints;
    return e < others_per_joint * joints
               ? parameters_per_joint * (e / others_per_joint) + coordinates + e % others_per_joint
               : parameters_per_joint * joints + e - others_per_joint * joints;
  }
  VectorXd parameters(const VectorXd& x, MatrixXd* jacobian = nullptr) const {
    VectorXd chi(x.size());
    if (jacobian) jacobian->setZero(x.size(), x.size());
    for (Index i = 0; i < joints; ++i) {
      Eigen::Matrix<double, 10, 10> D;
      chi.segment<10>(parameters_per_joint * i) =
          body_parameters(x.segment<coordinates>(coordinates * i), jacobian ? &D : nullptr);
      if (jacobian) jacobian->block<10, 10>(parameters_per_joint * i, coordinates * i) = D;
    }
    for (Index k = coordinates * joints; k < x.size(); ++k) {
      chi[other(k)] = x[k];
      if (jacobian) (*jacobian)(other(k), k) = 1.0;
    }
    return chi;
  }
  BodyEquations equations(const VectorXd& x) const {
    MatrixXd D;
    const VectorXd residual = R * parameters(x, &D) - z;
    const MatrixXd J = R * D;
    const VectorXd off = (x - prior).cwiseQuotient(spread), weight = spread.cwiseAbs2().cwiseInverse();
    BodyEquations out(x.size());
    out.information = J.transpose() * J;
    out.information.diagonal() += weight;
    out.gradient = J.transpose() * residual + off.cwiseQuotient(spread);
    out.cost = residual.squaredNorm() + off.squaredNorm();
    out.count = static_cast<int>(z.size() + x.size());
    return out;
  }
  double cost(const VectorXd& x) const {
    return (R * parameters(x) - z).squaredNorm() + (x - prior).cwiseQuotient(spread).squaredNorm();
  }
};

}  // namespace

Eigen::Matrix<double, 10, 1> body_parameters(const BodyCoordinates& x, Eigen::Matrix<double, 10, 10>* jacobian) {
  const double scale = std::exp(2 * x[0]);
  const Matrix4d U = unit_factor(x);
  const Eigen::Matrix<double, 10, 1> out = scale * parameters_of(U * U.transpose());
  if (!jacobian) return out;
  jacobian->col(0) = 2 * out;
  for (Index k = 1; k < coordinates; ++k) {
    Matrix4d d = Matrix4d::Zero();
    if (k < 4)
      d(k - 1, k - 1) = U(k - 1, k - 1);
    else if (k < 7)
      d(k == 6 ? 1 : 0, k == 4 ? 1 : 2) = 1.0;
    else
      d(k - 7, 3) = 1.0;
    jacobian->col(k) = scale * parameters_of(d * U.transpose() + U * d.transpose());
  }
  return out;
}

BodyCoordinates body_coordinates(const kinematics::Body& body) {
  const Eigen::Matrix3d I = body.inertia_matrix();
  // About the centre of mass: the second moment, over the mass, is the upper factor times its transpose.
  const Eigen::Matrix3d second = (0.5 * I.trace() * Eigen::Matrix3d::Identity() - I) / body.mass;
  const Eigen::LLT<Eigen::Matrix3d> cholesky(Eigen::Matrix3d(second.reverse()));
  require(
      body.mass > 0 && second.allFinite() && cholesky.info() == Eigen::Success,
      "a body cannot exist: mass " + std::to_string(body.mass) +
          " kg; the mass must be positive, and each principal moment of inertia less than the sum of the other two");
  const Eigen::Matrix3d U = Eigen::Matrix3d(cholesky.matrixL()).reverse();
  BodyCoordinates x;
  x << 0.5 * std::log(body.mass), std::log(U(0, 0)), std::log(U(1, 1)), std::log(U(2, 2)), U(0, 1), U(0, 2), U(1, 2),
      body.com;
  return x;
}

BodyCoordinates coordinate_spread(const BodyCoordinates& x, double spread) {
  const double size = std::exp((x[1] + x[2] + x[3]) / 3);
  BodyCoordinates out;
  out << spread / 2, spread, spread, spread, spread * size, spread * size, spread * size, spread * size, spread * size,
      spread * size;
  return out;
}

namespace {

/// A start near the minimum: the linear estimate, with priors as they are near their bodies, each body then made one
/// that can exist.
VectorXd linear_start(const MatrixXd& R, const VectorXd& z, int joints, const VectorXd& prior, const VectorXd& sigma) {
  MatrixXd A = R.transpose() * R;
  VectorXd b = R.transpose() * z, start = prior;
  for (Index i = 0; i < joints; ++i) {
    Eigen::Matrix<double, 10, 10> D;
    const Eigen::Matrix<double, 10, 1> chi = body_parameters(prior.segment<coordinates>(coordinates * i), &D);
    const Eigen::Matrix<double, 10, 10> whitener =
        sigma.segment<coordinates>(coordinates * i).cwiseInverse().asDiagonal() * D.inverse();
    const Eigen::Matrix<double, 10, 10> W = whitener.transpose() * whitener;
    A.block<10, 10>(parameters_per_joint * i, parameters_per_joint * i) += W;
    b.segment<10>(parameters_per_joint * i) += W * chi;
  }
  for (Index k = 0; k < A.rows(); ++k)
    if (!(A(k, k) > 0)) A(k, k) = 1.0;  // a parameter without a column
  const VectorXd scale = A.diagonal().cwiseSqrt().cwiseInverse();
  MatrixXd scaled = scale.asDiagonal() * A * scale.asDiagonal();
  scaled.diagonal().array() += 1e-12;
  const VectorXd chi = scale.cwiseProduct(scaled.ldlt().solve(scale.cwiseProduct(b)));
  for (Index i = 0; i < joints; ++i) {
    auto body = start.segment<coordinates>(coordinates * i);
    const double mass = std::max(chi[parameters_per_joint * i + 9], 0.05 * std::exp(2 * body[0]));
    const Eigen::Vector3d com = chi.segment<3>(parameters_per_joint * i + 6) / mass;
    Eigen::Matrix3d I;
    const auto p = chi.segment<6>(parameters_per_joint * i);
    I << p[0], p[1], p[2], p[1], p[3], p[4], p[2], p[4], p[5];
    const Eigen::Matrix3d second = (0.5 * I.trace() * Eigen::Matrix3d::Identity() - I) / mass - com * com.transpose();
    const SymmetricEigen axes = symmetric_eigen(second);
    const double least = 0.01 * std::exp(2 * (body[1] + body[2] + body[3]) / 3);
    const Eigen::Matrix3d V = axes.vectors;
    const Eigen::Matrix3d positive = V * axes.values.cwiseMax(least).asDiagonal() * V.transpose();
    kinematics::Body possible{mass, com, {}};
    possible.inertia = kinematics::inertia_vector(mass * (positive.trace() * Eigen::Matrix3d::Identity() - positive));
    body = body_coordinates(possible);
  }
  for (Index k = coordinates * joints; k < start.size(); ++k) {
    const Index e = k - coordinates * joints;
    const bool bounded = e < 3 * joints;
    const Index at = bounded ? parameters_per_joint * (e / 3) + coordinates + e % 3 : k;
    start[k] = bounded ? std::max(chi[at], 0.0) : chi[at];
  }
  return start;
}

}  // namespace

ConsistentFit fit_consistent(const MatrixXd& R, const VectorXd& z, int joints,
                             const std::vector<kinematics::Body>& priors, double spread) {
  const double endless = std::numeric_limits<double>::infinity();
  const Index size = R.cols();
  VectorXd x = VectorXd::Zero(size), sigma = VectorXd::Constant(size, endless);
  VectorXd lower = VectorXd::Constant(size, -endless);
  for (Index i = 0; i < joints; ++i) {
    const BodyCoordinates at = body_coordinates(priors[static_cast<std::size_t>(i)]);
    x.segment<coordinates>(coordinates * i) = at;
    sigma.segment<coordinates>(coordinates * i) = coordinate_spread(at, spread);
    lower.segment<3>(coordinates * joints + 3 * i).setZero();  // Coulomb, viscous, rotor
  }
  const VectorXd prior = x;
  x = linear_start(R, z, joints, prior, sigma);
  ConsistentProblem problem{R, z, joints, prior, sigma, {lower, VectorXd::Constant(size, endless)}};
  LevenbergMarquardtOptions options;
  options.max_iterations = 300;
  options.sigma = 1.0;
  options.tolerance = 1e-2;
  const auto found = levenberg_marquardt<Eigen::Dynamic>(x, problem, options);
  ConsistentFit out;
  out.iterations = found.iterations;
  out.usable = found.usable();
  MatrixXd D;
  out.parameters = problem.parameters(found.x, &D);
  MatrixXd information = found.equations.information.selfadjointView<Eigen::Lower>();
  for (Index k = 0; k < size; ++k)
    if (!(information(k, k) > 0)) information(k, k) = 1.0;  // a parameter without a column takes no part
  const VectorXd scale = information.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<MatrixXd> factors(MatrixXd(scale.asDiagonal() * information * scale.asDiagonal()));
  if (factors.vectorD().minCoeff() > 1e-14) {
    const MatrixXd C = factors.solve(MatrixXd::Identity(size, size));
    out.covariance = D * scale.asDiagonal() * C * scale.asDiagonal() * D.transpose();
  }
  return out;
}

}  // namespace kr5::identification
