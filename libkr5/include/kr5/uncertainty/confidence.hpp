// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>

#include <kr5/core/fields.hpp>

/// @file
/// Confidence regions and intervals from a covariance or a count.

namespace kr5::uncertainty {

/// Value that a chi-square variable with `dof` degrees of freedom stays below with probability `p`.
double chi_square_quantile(double p, double dof);
/// Probability that a chi-square variable with `dof` degrees of freedom stays below `x`.
double chi_square_cdf(double x, double dof);
/// Two-sided factor of a standard normal variable: |x| stays below it with probability `confidence`.
double normal_factor(double confidence = 0.95);
/// The same for Student's t.
double student_factor(double dof, double confidence = 0.95);
/// Value that Fisher's F stays below with probability `p`: with a covariance C estimated on `dof2` degrees of freedom,
/// the region of an n-vector is e' C^-1 e <= n F(n, dof2).
double fisher_quantile(double p, double dof1, double dof2);
/// Factor for the covariance of `numbers` numbers that was estimated on `dof` degrees of freedom, after which its
/// normal 95 % region, as from confidence_ellipsoid, is the one of Fisher's F [-].
double covariance_inflation(double numbers, double dof);
constexpr double known_noise = 1e6;  ///< Degrees of freedom behind a covariance for which nothing was estimated [-].
/// Probability that Fisher's F stays below `x`.
double fisher_cdf(double x, double dof1, double dof2);
/// The same when the numerator has the squared mean `noncentrality` in its standard deviations.
double noncentral_fisher_cdf(double x, double dof1, double dof2, double noncentrality);

/// An interval of a number.
struct Interval {
  double low = 0.0;
  double high = 0.0;
  bool contains(double x) const { return low <= x && x <= high; }
  static void each_field(auto& self, auto&& visit) {
    visit("low", self.low, "Lower end.");
    visit("high", self.high, "Upper end.");
  }
};

/// Exact (Clopper-Pearson) interval of a rate from `successes` in `trials`.
/// @throws InvalidArgument unless 0 <= successes <= trials, trials > 0, 0 < confidence < 1.
Interval binomial_interval(int successes, int trials, double confidence = 0.95);

/// The region that holds a normal vector with a given probability (Hayat et al. 2022, eq. 3.14 and 3.15).
struct Ellipsoid {
  Eigen::VectorXd semi_axes;   ///< Longest first, in the unit of the vector.
  Eigen::MatrixXd directions;  ///< Unit columns, in the order of `semi_axes`.
};
/// @throws InvalidArgument when the matrix is not square, not symmetric, or has a negative eigenvalue.
Ellipsoid confidence_ellipsoid(const Eigen::MatrixXd& covariance, double confidence = 0.95);

}  // namespace kr5::uncertainty
