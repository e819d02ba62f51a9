#pragma once
#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>
#include <utility>

#include <catch2/catch.hpp>

#include <Eigen/Cholesky>

#include <kr5/uncertainty/confidence.hpp>

namespace kr5::test {

using uncertainty::known_noise;

/// How well stated covariances of `numbers` numbers agree with the errors that were made, trial by trial. In the end
/// appends its counts to the table that tools/benchmarks/coverage.py shows.
class Coverage {
 public:
  Coverage(std::string what, int numbers) : what_(std::move(what)), numbers_(numbers) {}

  ~Coverage() {
    if (const char* file = std::getenv("KR5_COVERAGE"))
      std::ofstream(file, std::ios::app) << what_ << ',' << inside_ << ',' << trials_ << ',' << mean() << '\n';
  }
  Coverage(const Coverage&) = delete;

  /// The covariance is widened for the `dof` degrees of freedom behind it.
  void add(const Eigen::VectorXd& error, const Eigen::MatrixXd& covariance, double dof = known_noise) {
    const double squared = error.dot(covariance.ldlt().solve(error));
    inside_ += squared < uncertainty::chi_square_quantile(0.95, numbers_);
    sum_ += as_chi_square(squared, dof);
    ++trials_;
  }

  int inside() const { return inside_; }
  int trials() const { return trials_; }
  uncertainty::Interval rate(double confidence) const {
    return uncertainty::binomial_interval(inside_, trials_, confidence);
  }

  /// Checks the share inside: 93 to 97 % of a thousand trials and more. Of fewer, a right covariance fails in one of
  /// 100 runs, and there must be so many trials that one of half the standard deviations fails in nine of ten.
  void check_rate() const {
    INFO(what_ << ": " << inside_ << " of " << trials_ << " in the 95 % region");
    REQUIRE(trials_ > 0);
    if (trials_ >= 1000) {
      CHECK(inside_ >= 0.93 * trials_);
      CHECK(inside_ <= 0.97 * trials_);
    } else {
      CHECK(rate(0.99).contains(0.95));
#ifndef KR5_SANITIZED  // few trials, which `check_mean` judges
      CHECK(uncertainty::binomial_interval(min_inside(), trials_, 0.8).low > half_region());
#endif
    }
  }

  /// Checks the mean squared distance, which a covariance too small makes large and one too large makes small: their
  /// sum is a chi-square variable, too.
  void check_mean() const {
    const double freedom = static_cast<double>(numbers_) * trials_, below = uncertainty::chi_square_cdf(sum_, freedom);
    INFO(what_ << ": mean squared distance " << mean() << " of the stated one, " << inside_ << " of " << trials_
               << " in the 95 % region");
    CHECK(below > 5e-7);
    CHECK(below < 1 - 5e-7);
  }

 private:
  /// The smallest count that passes.
  int min_inside() const {
    int count = 0;
    while (uncertainty::binomial_interval(count, trials_, 0.99).high < 0.95) ++count;
    return count;
  }

  /// What the region of half the standard deviations holds.
  double half_region() const {
    return uncertainty::chi_square_cdf(uncertainty::chi_square_quantile(0.95, numbers_) / 4, numbers_);
  }

  double mean() const { return sum_ / (static_cast<double>(numbers_) * trials_); }

  /// The chi-square value as probable as a squared distance that follows Fisher's F, for the noise was estimated.
  double as_chi_square(double squared, double dof) const {
    if (dof >= known_noise) return squared;
    const double f = squared * uncertainty::covariance_inflation(numbers_, dof) / numbers_;
    return uncertainty::chi_square_quantile(std::min(uncertainty::fisher_cdf(f, numbers_, dof), 1 - 1e-12), numbers_);
  }

  std::string what_;
  int numbers_ = 0, trials_ = 0, inside_ = 0;
  double sum_ = 0.0;
};

}  // namespace kr5::test
