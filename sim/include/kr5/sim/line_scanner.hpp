// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/thing.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/core/random.hpp>

namespace kr5::sim {

struct LineScannerOptions {
  int points = 61;
  double width = 0.09;  ///< [m]
  double near = 0.1;    ///< [m]
  double far = 0.3;     ///< [m]
  bool noise = true;
  int seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("points", self.points, "Of a profile.");
    visit("width", self.width, "Of a profile, along X of the scanner [m].");
    visit("near", self.near, "Least range it can measure [m].");
    visit("far", self.far, "Greatest range it can measure [m].");
    visit("noise", self.noise, "Add the noise of the cell.");
    visit("seed", self.seed, "Of the noise.");
  }
};

/// One line. Where nothing is met within range, z is NaN and thing -1.
struct Profile {
  Eigen::VectorXd x;       ///< [m]
  Eigen::VectorXd z;       ///< [m]
  std::vector<int> thing;  ///< Number of what was met, of those the scanner was given.
};

/// The line scanner of a cell with laser_mount, laser_bias, laser_lag and its noise: parallel rays along Z of L.
class LineScanner {
 public:
  /// @throws InvalidArgument naming the option, the thing, or the part of the cell that is not there.
  LineScanner(const cell::Cell& cell, std::vector<cell::Thing> things, const LineScannerOptions& options = {});

  /// @param T_B_F Flange now. @param speed Of the scanner along its own Y [m/s]: the profile was taken `speed` times
  ///        laser_lag further back.
  const Profile& read(const Pose& T_B_F, double speed = 0.0);
  const std::vector<cell::Thing>& things() const { return things_; }
  const Pose& T_F_L() const { return T_F_L_; }
  /// Least range at which any ray met anything so far, within range or not; infinite: none did [m].
  double nearest() const { return nearest_; }

 private:
  double meet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, int& thing) const;

  std::vector<cell::Thing> things_;
  LineScannerOptions options_;
  cell::SensorEffects effects_;
  double sigma_;
  Pose T_F_L_;
  Random random_;
  Profile profile_;
  double nearest_ = std::numeric_limits<double>::infinity();
};

}  // namespace kr5::sim
