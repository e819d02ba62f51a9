// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <optional>
#include <span>

#include <kr5/force/insertion.hpp>

namespace kr5::force {

/// What is felt while a peg goes once round, gathered by azimuth. Of fixed size.
class TurnProfile {
 public:
  static constexpr int bins = 360;  ///< So narrow that the cusp is not rounded.

  void clear() noexcept;
  void add(const ProfileRow& row) noexcept;
  /// Means of the bins that were met, by azimuth, for the other functions.
  void finish() noexcept;
  std::span<const ProfileRow> rows() const noexcept { return {rows_.data(), static_cast<std::size_t>(count_)}; }
  /// Mean centre of the peg.
  Eigen::Vector2d centre() const noexcept;

  /// Azimuth of the least height; none for fewer than three rows.
  std::optional<double> minimum() const noexcept;
  /// Azimuth of the minimum at which the slope jumps most: the least height may be that of the outer edge. None without
  /// a minimum.
  std::optional<double> cusp() const noexcept;

 private:
  struct Bin {
    int count = 0;
    double ca = 0.0, sa = 0.0;
    ProfileRow sum;
  };
  const ProfileRow& row(int k) const noexcept { return rows_[static_cast<std::size_t>((k + count_) % count_)]; }
  /// Height over azimuth in the rows k+from .. k+to, from row k: intercept and slope.
  Eigen::Vector2d line(int k, int from, int to) const noexcept;

  std::array<Bin, bins> bins_;
  std::array<ProfileRow, bins> rows_;
  int count_ = 0;
};

}  // namespace kr5::force
