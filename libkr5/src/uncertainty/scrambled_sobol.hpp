// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace kr5::uncertainty {

/// Points of the unit cube: independent randomisations of Sobol's sequence, each by random lower triangular matrices of
/// bits and a shift of its own (Matousek 1998), so that every point is uniform and a replicate keeps its evenness.
class ScrambledSobol {
 public:
  ScrambledSobol(Eigen::Index dimension, int replicates, std::uint64_t seed);

  Eigen::Index dimension() const { return dimension_; }

  /// Points `first` to `first + out.rows()` of a replicate, each coordinate within (0, 1).
  void points(int replicate, std::int64_t first, Eigen::Ref<Eigen::MatrixXd> out) const;

 private:
  static constexpr int bits = 32;  ///< Of a coordinate that are scrambled; the shift gives those below.
  struct Scramble {
    std::uint32_t rows[bits];
    std::uint64_t shift;
    double apply(std::uint64_t x) const;
  };

  Eigen::Index dimension_;
  std::vector<Scramble> scrambles_;  ///< Replicate by replicate.
};

}  // namespace kr5::uncertainty
