// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <random>
#include <string>

#include <Eigen/Core>

namespace kr5 {

/// Random numbers from an explicit seed; there is no global generator.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  double uniform(double low = 0.0, double high = 1.0) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  double normal(double sigma = 1.0) { return sigma * normal_(engine_); }
  /// Integer in [0, count).
  int integer(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }
  Eigen::VectorXd normal_vector(Eigen::Index size, double sigma = 1.0) {
    return Eigen::VectorXd::NullaryExpr(size, [&] { return normal(sigma); });
  }
  /// Uniform on the unit sphere.
  Eigen::Vector3d direction() { return Eigen::Vector3d(normal_vector(3)).normalized(); }
  /// Where in its sequence it is, as a text of digits.
  std::string state() const;
  /// Goes on from there. @throws InvalidArgument for a text that is no such state.
  void restore(const std::string& state);
  /// For std::shuffle and the like.
  std::mt19937_64& engine() { return engine_; }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<double> normal_;
};

}  // namespace kr5
