// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/thing.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/placed.hpp>

/// @file
/// What stands before camera and scanner of a cell as they really are: the effects on lens, mount and tube act.

namespace kr5::predict {

/// The camera as it really is: with camera_focal, lens_distortion and hand_eye.
class RealCamera {
 public:
  /// @throws InvalidArgument naming what is not there: camera, its mount.
  explicit RealCamera(const cell::Cell& cell);

  const Pinhole& lens() const { return lens_; }
  /// T_B_C when the flange is at T_B_F.
  Pose at(const Pose& T_B_F) const { return on_flange_ ? T_B_F * mount_ : mount_; }

 private:
  Pinhole lens_;
  bool on_flange_ = true;
  Pose mount_ = Pose::Identity();
};

/// The scanner in the flange as it really is: with laser_mount.
/// @throws InvalidArgument naming what is not there.
Pose real_scanner_mount(const cell::Cell& cell);

/// Range that a scanner tells for a true one: laser_bias, nothing at the best stand-off of 0.19 m [m].
double biased_range(const cell::SensorEffects& effects, double z);

/// The tube in the base as it really is: with tube_shift, tube_tilt and tube_radius. Needs a tube.
cell::Thing real_tube_solid(const cell::Cell& cell);

/// What a camera of the cell has before it.
struct Sight {
  Pinhole lens;
  Pose T_B_C = Pose::Identity();
  std::vector<std::string> names;     ///< Of the targets.
  std::vector<PlacedTarget> targets;  ///< Board and targets of the cell.
  std::vector<PlacedSolid> solids;    ///< Its tube and the scanner's sphere, then the things given.

  static void each_field(auto& self, auto&& visit) {
    visit("lens", self.lens, "The lens as it really is.");
    visit("T_B_C", self.T_B_C, "The camera in the base.");
    visit("names", self.names, "Of the targets.");
    visit("targets", self.targets, "Board and targets of the cell, in the camera.");
    visit("solids", self.solids, "Tube, scanner's sphere and other things, in the camera.");
  }
};

/// @throws InvalidArgument as RealCamera.
Sight sight(const cell::Cell& cell, const Pose& T_B_F, const std::vector<cell::Thing>& things = {});

/// What rays of the scanner may meet in the cell: its tube, board and targets, the sphere and the plane of the
/// scanner's target. The plane reaches 10 m from the base.
std::vector<cell::Thing> things_of(const cell::Cell& cell);
/// A plate of that size at a height in the base.
cell::Thing wide_plate(const std::string& name, double height);

}  // namespace kr5::predict
