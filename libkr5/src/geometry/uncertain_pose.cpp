// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/geometry/uncertain_pose.hpp>

#include <algorithm>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Cholesky>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>

namespace kr5 {
namespace {

void check(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance) {
  require(mean.size() > 0 && mean.allFinite(), "mean must be finite");
  require(covariance.rows() == mean.size() && covariance.cols() == mean.size(),
          "covariance is " + std::to_string(covariance.rows()) + " x " + std::to_string(covariance.cols()) +
              ", the mean has " + std::to_string(mean.size()) + " numbers");
  if (const std::string defect = covariance_defect(covariance); !defect.empty())
    throw InvalidArgument("covariance " + defect);
}

void check_chain(std::span<const UncertainPose> chain) {
  require(!chain.empty(), "propagate_chain: there are no poses");
  for (std::size_t i = 0; i < chain.size(); ++i) {
    require(chain[i].T.matrix().allFinite(), "pose " + std::to_string(i + 1) + " of the chain is not finite");
    if (const std::string defect = covariance_defect(chain[i].covariance); !defect.empty())
      throw InvalidArgument("covariance of pose " + std::to_string(i + 1) + " of the chain " + defect);
  }
}

}  // namespace

UncertainPose operator*(const UncertainPose& T_a_b, const UncertainPose& T_b_c) {
  // T exp(d) S exp(e) = T S exp(Ad(S^-1) d) exp(e)
  const Matrix6 across = adjoint(T_b_c.T.inverse());
  return {T_a_b.T * T_b_c.T, across * T_a_b.covariance * across.transpose() + T_b_c.covariance};
}

UncertainPose inverse(const UncertainPose& T_a_b) {
  const Matrix6 across = adjoint(T_a_b.T);
  return {T_a_b.T.inverse(), across * T_a_b.covariance * across.transpose()};
}

UncertainPose propagate_chain(std::span<const UncertainPose> chain) {
  check_chain(chain);
  UncertainPose out = chain.front();
  for (const UncertainPose& next : chain.subspan(1)) out = out * next;
  return out;
}

UncertainPose propagate_chain_unscented(std::span<const UncertainPose> chain) {
  check_chain(chain);
  const auto count = static_cast<Eigen::Index>(chain.size());
  Pose nominal = Pose::Identity();
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(6 * count, 6 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    nominal = nominal * chain[static_cast<std::size_t>(i)].T;
    covariance.block<6, 6>(6 * i, 6 * i) = chain[static_cast<std::size_t>(i)].covariance;
  }
  const auto difference = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    Pose T = Pose::Identity();
    for (Eigen::Index i = 0; i < count; ++i)
      T = T * chain[static_cast<std::size_t>(i)].T * to_pose(Vector6(d.segment<6>(6 * i)));
    return pose_difference(nominal, T);
  };
  const UncertainVector found = propagate_unscented(difference, Eigen::VectorXd::Zero(6 * count), covariance);
  return {nominal * to_pose(Vector6(found.value)), found.covariance};
}

std::vector<Matrix6> chain_contributions(std::span<const UncertainPose> chain) {
  check_chain(chain);
  std::vector<Matrix6> out(chain.size());
  Pose after = Pose::Identity();
  for (std::size_t i = chain.size(); i-- > 0;) {
    const Matrix6 across = adjoint(after.inverse());
    out[i] = across * chain[i].covariance * across.transpose();
    after = chain[i].T * after;
  }
  return out;
}

double deviation_change(const Matrix6& first, const Matrix6& second) {
  double most = 0.0;
  for (Eigen::Index k = 0; k < 6; ++k)
    if (first(k, k) > 0) most = std::max(most, std::abs(std::sqrt(second(k, k) / first(k, k)) - 1));
  return most;
}

UncertainVector transform_point(const UncertainPose& T_a_b, const Eigen::Vector3d& p_b,
                                const Eigen::Matrix3d& covariance, bool rotation_errors) {
  check(p_b, covariance);
  if (const std::string defect = covariance_defect(T_a_b.covariance); !defect.empty())
    throw InvalidArgument("covariance of the pose " + defect);
  const Eigen::Matrix3d& R = T_a_b.T.linear();
  Eigen::Matrix<double, 3, 6> by_pose;
  by_pose << R, (rotation_errors ? Eigen::Matrix3d(-R * skew(p_b)) : Eigen::Matrix3d::Zero());
  return {T_a_b.T * p_b, R * covariance * R.transpose() + by_pose * T_a_b.covariance * by_pose.transpose()};
}

UncertainVector propagate(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f, const Eigen::VectorXd& mean,
                          const Eigen::MatrixXd& covariance) {
  check(mean, covariance);
  UncertainVector out;
  out.value = f(mean);
  Eigen::MatrixXd J(out.value.size(), mean.size());
  for (Eigen::Index k = 0; k < mean.size(); ++k) {
    // A small part of the spread is where f is straight; without spread, of the value.
    const double spread = std::sqrt(covariance(k, k));
    const double h = spread > 0 ? 1e-3 * spread : 1e-6 * std::max(1.0, std::abs(mean[k]));
    Eigen::VectorXd above = mean, below = mean;
    above[k] += h, below[k] -= h;
    J.col(k) = (f(above) - f(below)) / (above[k] - below[k]);
  }
  out.covariance = J * covariance * J.transpose();
  return out;
}

UncertainVector propagate_unscented(const std::function<Eigen::VectorXd(const Eigen::VectorXd&)>& f,
                                    const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance) {
  check(mean, covariance);
  const auto n = static_cast<double>(mean.size());
  constexpr double kappa_sum = 3.0;  // n + kappa: matches the fourth moment of a normal variable
  const SymmetricEigen eigen = symmetric_eigen(covariance);
  const Eigen::MatrixXd root = eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
  std::vector<Eigen::VectorXd> values = {f(mean)};
  std::vector<double> weights = {(kappa_sum - n) / kappa_sum};
  for (Eigen::Index k = 0; k < mean.size(); ++k)
    for (const double side : {1.0, -1.0}) {
      values.push_back(f(mean + side * std::sqrt(kappa_sum) * root.col(k)));
      weights.push_back(0.5 / kappa_sum);
    }
  UncertainVector out;
  out.value = Eigen::VectorXd::Zero(values[0].size());
  for (std::size_t i = 0; i < values.size(); ++i) out.value += weights[i] * values[i];
  out.covariance = Eigen::MatrixXd::Zero(out.value.size(), out.value.size());
  // Deviations from the value at the mean, whose own weight may be negative, keep the covariance one.
  const Eigen::VectorXd shift = out.value - values[0];
  for (std::size_t i = 1; i < values.size(); ++i) {
    const Eigen::VectorXd d = values[i] - values[0];
    out.covariance += weights[i] * d * d.transpose();
  }
  if (kappa_sum >= n) out.covariance -= shift * shift.transpose();
  return out;
}

UncertainVector fuse(std::span<const UncertainVector> measurements) {
  require(!measurements.empty(), "fuse: there are no measurements");
  const Eigen::Index n = measurements.front().value.size();
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(n);
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    check(measurements[i].value, measurements[i].covariance);
    require(measurements[i].value.size() == n, "fuse: measurement " + std::to_string(i) + " has another size");
    const Eigen::LLT<Eigen::MatrixXd> factors(measurements[i].covariance);
    require(factors.info() == Eigen::Success,
            "fuse: the covariance of measurement " + std::to_string(i) + " is not positive definite");
    const Eigen::MatrixXd own = factors.solve(Eigen::MatrixXd::Identity(n, n));
    information += own;
    sum += own * measurements[i].value;
  }
  const Eigen::LLT<Eigen::MatrixXd> factors(information);
  return {factors.solve(sum), factors.solve(Eigen::MatrixXd::Identity(n, n))};
}

std::string covariance_defect(const Eigen::MatrixXd& matrix, double tolerance) {
  std::ostringstream text;
  if (matrix.rows() != matrix.cols()) {
    text << "is " << matrix.rows() << " x " << matrix.cols() << ", not square";
    return text.str();
  }
  if (!matrix.allFinite()) return "has an entry that is not finite";
  if (matrix.size() == 0) return "";
  const double size = matrix.cwiseAbs().maxCoeff();
  if ((matrix - matrix.transpose()).cwiseAbs().maxCoeff() > tolerance * size) return "is not symmetric";
  const Eigen::VectorXd values = symmetric_eigen(matrix).values;
  if (values.minCoeff() >= -tolerance * size) return "";
  text << "is no covariance: it has the negative eigenvalue " << values.minCoeff() << " (the largest is "
       << values.maxCoeff() << ")";
  return text.str();
}

bool is_covariance(const Eigen::MatrixXd& matrix) { return covariance_defect(matrix).empty(); }

}  // namespace kr5
