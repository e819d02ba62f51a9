// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/placed_object.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/core/random.hpp>
#include <kr5/physics/scanner.hpp>

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
    visit("points", self.points, "Number of points of a profile.");
    visit("width", self.width, "Width of a profile, along X of the scanner [m].");
    visit("near", self.near, "Minimum measurable range [m].");
    visit("far", self.far, "Maximum measurable range [m].");
    visit("noise", self.noise, "Noise of the cell, added to the ranges.");
    visit("seed", self.seed, "Random seed of the noise.");
  }
};

/// One line. Where nothing is met within range, z is NaN and object -1.
struct Profile {
  Eigen::VectorXd x;        ///< [m]
  Eigen::VectorXd z;        ///< [m]
  std::vector<int> object;  ///< Number of what was met, of those the scanner was given.
};

/// The line scanner of a cell with laser_mount, laser_bias, laser_lag and its noise: parallel rays along Z of L.
class LineScanner {
 public:
  /// @throws InvalidArgument naming the option, the object, or the part of the cell that is not there.
  LineScanner(const cell::Cell& cell, std::vector<cell::PlacedObject> objects, const LineScannerOptions& options = {});

  /// @param T_base_flange Flange now. @param speed Of the scanner along its own Y [m/s]: the profile was taken `speed`
  /// times
  ///        laser_lag further back.
  const Profile& read(const Pose& T_base_flange, double speed = 0.0);
  const std::vector<cell::PlacedObject>& objects() const { return objects_; }
  const Pose& T_flange_scanner() const { return scanner_.T_flange_scanner(); }
  /// Least range at which any ray met anything so far, within range or not; infinite: none did [m].
  double nearest() const { return nearest_; }

 private:
  double nearest_hit(const Ray& ray, int& object) const;

  std::vector<cell::PlacedObject> objects_;
  LineScannerOptions options_;
  double sigma_;
  physics::EffectiveScanner scanner_;
  Random random_;
  Profile profile_;
  double nearest_ = std::numeric_limits<double>::infinity();
};

}  // namespace kr5::sim
