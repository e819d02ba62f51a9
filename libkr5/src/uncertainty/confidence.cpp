// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/uncertainty/confidence.hpp>

#include <cmath>
#include <string>

#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/non_central_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>

namespace kr5::uncertainty {
namespace {

void require_probability(double p, const char* name) {
  require(p > 0 && p < 1, std::string(name) + " must lie between 0 and 1, found " + std::to_string(p));
}

/// Boost's own exceptions are for its own arguments.
void require_dof(double dof, const char* name = "dof") {
  require(dof > 0 && std::isfinite(dof),
          std::string(name) + " must be positive and finite, found " + std::to_string(dof));
}

}  // namespace

double chi_square_quantile(double p, double dof) {
  require_probability(p, "p");
  require_dof(dof);
  return boost::math::quantile(boost::math::chi_squared(dof), p);
}

double chi_square_cdf(double x, double dof) {
  require_dof(dof);
  require(!std::isnan(x), "x must be a number");
  if (std::isinf(x)) return x > 0 ? 1.0 : 0.0;
  return x <= 0 ? 0.0 : boost::math::cdf(boost::math::chi_squared(dof), x);
}

double normal_factor(double confidence) {
  require_probability(confidence, "confidence");
  return boost::math::quantile(boost::math::normal(), 0.5 + confidence / 2);
}

double student_factor(double dof, double confidence) {
  require_probability(confidence, "confidence");
  require_dof(dof);
  return boost::math::quantile(boost::math::students_t(dof), 0.5 + confidence / 2);
}

double fisher_quantile(double p, double dof1, double dof2) {
  require_probability(p, "p");
  require_dof(dof1, "dof1");
  require_dof(dof2, "dof2");
  return boost::math::quantile(boost::math::fisher_f(dof1, dof2), p);
}

double covariance_inflation(double numbers, double dof) {
  return numbers * fisher_quantile(0.95, numbers, dof) / chi_square_quantile(0.95, numbers);
}

double fisher_cdf(double x, double dof1, double dof2) {
  require_dof(dof1, "dof1");
  require_dof(dof2, "dof2");
  require(!std::isnan(x), "x must be a number");
  if (std::isinf(x)) return x > 0 ? 1.0 : 0.0;
  return x <= 0 ? 0.0 : boost::math::cdf(boost::math::fisher_f(dof1, dof2), x);
}

double noncentral_fisher_cdf(double x, double dof1, double dof2, double noncentrality) {
  require(noncentrality >= 0 && std::isfinite(noncentrality), "noncentrality must not be negative");
  if (noncentrality == 0 || !(x > 0) || std::isinf(x)) return fisher_cdf(x, dof1, dof2);
  require_dof(dof1, "dof1");
  require_dof(dof2, "dof2");
  return boost::math::cdf(boost::math::non_central_f(dof1, dof2, noncentrality), x);
}

Interval binomial_interval(int successes, int trials, double confidence) {
  require_probability(confidence, "confidence");
  require(trials > 0 && successes >= 0 && successes <= trials,
          "binomial_interval: expected 0 <= successes <= trials and trials > 0, found " + std::to_string(successes) +
              " of " + std::to_string(trials));
  const double tail = (1 - confidence) / 2, k = successes, n = trials;
  Interval interval{0.0, 1.0};
  if (successes > 0) interval.low = boost::math::quantile(boost::math::beta_distribution<>(k, n - k + 1), tail);
  if (successes < trials)
    interval.high = boost::math::quantile(boost::math::beta_distribution<>(k + 1, n - k), 1 - tail);
  return interval;
}

Ellipsoid confidence_ellipsoid(const Eigen::MatrixXd& covariance, double confidence) {
  require(covariance.rows() == covariance.cols() && covariance.rows() > 0, "covariance: must be square");
  const double scale = covariance.cwiseAbs().maxCoeff();
  require(covariance.allFinite() && (covariance - covariance.transpose()).cwiseAbs().maxCoeff() <= 1e-9 * scale,
          "covariance: must be finite and symmetric");
  const SymmetricEigen eigen = symmetric_eigen(covariance);
  require(eigen.values.minCoeff() >= -1e-9 * scale, "covariance: has a negative eigenvalue");
  const double c2 = chi_square_quantile(confidence, static_cast<double>(covariance.rows()));
  return {(c2 * eigen.values.cwiseMax(0.0)).cwiseSqrt().reverse(), eigen.vectors.rowwise().reverse()};
}

}  // namespace kr5::uncertainty
