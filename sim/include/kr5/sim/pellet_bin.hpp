// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <vector>

#include <Eigen/Core>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// A bin with cylindrical pellets: poured, settled, and disturbed by picking (Hayat et al. 2022, sections 2.4 and 6.2).
///
/// Rigid bodies with Coulomb friction. The contacts of two cylinders come from the exact distance to a cylinder, taken
/// along the rims of the other one, and from the common perpendicular of the axes; ODE's own contact of two cylinders
/// is a single point, with which pellets sink several millimetres into each other. The steps are those of a sequential
/// impulse solver with soft contacts and short substeps (Catto, "Solver2D", 2024): its effort grows with the number of
/// contacts, that of DART's LCP with the square or the cube of it.

namespace kr5::sim {

/// An open box with four walls. Frame: origin at the centre of the inner floor, Z up.
struct BinShape {
  Pose T_base_bin = Pose::Identity();
  Eigen::Vector3d size = {0.22, 0.22, 0.1};  ///< Inner length along X and Y, height of the walls [m].
  double wall = 0.003;                       ///< [m]

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("T_base_bin", self.T_base_bin, "Bin in the base: origin at the centre of the inner floor, Z up [m].");
    visit("size", self.size, "Inner length along X and Y of the bin, height of the walls above the floor [m].");
    visit("wall", self.wall, "Thickness of walls and floor [m].");
  }
};

/// A solid cylinder. Frame: origin in its middle, Z along its axis.
struct Pellet {
  Pose T_bin_pellet = Pose::Identity();
  double radius = 0.008;  ///< [m]
  double height = 0.015;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("T_bin_pellet", self.T_bin_pellet, "Pellet in the bin: origin in its middle, Z along its axis [m].");
    visit("radius", self.radius, "Radius [m].");
    visit("height", self.height, "Height: length along the axis [m].");
  }
};

struct PelletScene {
  BinShape bin;
  std::vector<Pellet> pellets;

  /// @throws InvalidArgument naming the field and the pellet.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("bin", self.bin, "Bin.");
    visit("pellets", self.pellets, "Pellets.");
  }
};

/// Bodies and steps of a simulated pile.
struct PileOptions {
  double density = 2500.0;   ///< [kg/m^3]
  double friction = 0.4;     ///< [-]
  double restitution = 0.2;  ///< [-]
  double step = 0.001;       ///< [s]
  double timeout = 6.0;      ///< [s]

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("density", self.density, "Density of the pellets [kg/m^3].");
    visit("friction", self.friction, "Coefficient of friction between pellets, and between pellets and bin [-].");
    visit("restitution", self.restitution, "Speed after an impact over the speed before it [-].");
    visit("step", self.step, "Step between two searches for contacts; the motion takes four substeps in it [s].");
    visit("timeout", self.timeout, "Simulated time after which a pile that still moves is returned as it is [s].");
  }
};

/// What is poured into a bin.
struct PourOptions {
  int pellets = 125;
  double radius = 0.008;      ///< [m]
  double height_min = 0.014;  ///< [m]
  double height_max = 0.017;  ///< [m]
  double width = 0.12;        ///< [m]
  int seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("pellets", self.pellets, "Number of pellets.");
    visit("radius", self.radius, "Radius of the pellets [m].");
    visit("height_min", self.height_min,
          "Minimum height of a pellet [m]. Heights are uniform from this to height_max.");
    visit("height_max", self.height_max, "Maximum height of a pellet [m].");
    visit("width", self.width,
          "Side of the square in the middle of the bin into which the pellets fall [m]: small for a heap, as wide as "
          "the bin for an even layer.");
    visit("seed", self.seed, "Random seed of heights, places and orientations.");
  }
};

/// How a pile came to rest.
struct PileState {
  bool at_rest = false;
  double time = 0.0;            ///< [s]
  double speed = 0.0;           ///< [m/s]
  double kinetic_energy = 0.0;  ///< [J]
  double penetration = 0.0;     ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("at_rest", self.at_rest, "True when every pellet lay still for a tenth of a second.");
    visit("time", self.time, "Simulated time [s].");
    visit("speed", self.speed, "Speed of the fastest point of a pellet when the simulation ended [m/s].");
    visit("kinetic_energy", self.kinetic_energy, "Kinetic energy of all pellets when the simulation ended [J].");
    visit("penetration", self.penetration, "Deepest overlap of two pellets or of a pellet and the bin [m].");
  }
};

/// A pile with the pellets where they came to rest.
struct SettledPile {
  PelletScene scene;
  PileState state;

  static void each_field(auto& self, auto&& visit) {
    visit("scene", self.scene, "Bin and pellets.");
    visit("state", self.state, "Report of how the pile came to rest.");
  }
};

/// Told now and then which share of the work is done, 0 to 1; an exception from it ends the work.
using PileProgress = std::function<void(double share)>;

/// Pellets of random height and orientation, poured layer by layer and settled. The same seed gives the same pile.
/// @throws InvalidArgument naming the field; when the pellets do not fit into the bin below its rim.
SettledPile pour_pellets(const BinShape& bin, const PourOptions& pour = {}, const PileOptions& options = {},
                         const PileProgress& progress = {});

/// The pellets of a scene fall from where they are until they lie still.
/// @throws InvalidArgument naming the field.
SettledPile settle(const PelletScene& scene, const PileOptions& options = {}, const PileProgress& progress = {});

/// How a suction gripper pulls a pellet out of the pile.
struct RemovalOptions {
  double force = 6.0;         ///< [N]
  double speed = 0.25;        ///< [m/s]
  double pull = 0.02;         ///< [m]
  double slip = 0.003;        ///< [m]
  double cup_radius = 0.006;  ///< [m]
  double min_moved = 2e-4;    ///< [m]

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("force", self.force, "Holding force of the suction cup [N].");
    visit("speed", self.speed, "Speed of the gripper [m/s].");
    visit("pull", self.pull, "Way along the approach direction, before the gripper goes straight up [m].");
    visit("slip", self.slip, "Lag of the pellet behind the gripper at which the suction cup loses it [m].");
    visit("cup_radius", self.cup_radius, "Radius of the suction cup [m]; with the force, it holds the orientation.");
    visit("min_moved", self.min_moved, "Shift of a pellet above which it counts as moved [m].");
  }
};

/// What picking a pellet did.
struct Removal {
  bool removed = false;
  PelletScene scene;
  std::vector<int> moved;
  Eigen::VectorXd shift;  ///< [m]
  Eigen::VectorXd turn;   ///< [rad]
  PileState state;

  static void each_field(auto& self, auto&& visit) {
    visit("removed", self.removed, "True when the suction cup held; otherwise the pellet fell back into the bin.");
    visit("scene", self.scene, "Bin and pellets afterwards, in the same order, without the one that was removed.");
    visit("moved", self.moved, "Pellets that shifted more than min_moved; numbers of the scene before.");
    visit("shift", self.shift, "Shift of the middle of each pellet of the scene before [m]; of the one removed, 0.");
    visit("turn", self.turn, "Turn of the axis of each pellet of the scene before [rad]; of the one removed, 0.");
    visit("state", self.state, "Report of how the pile came to rest.");
  }
};

/// Pulls one pellet out of the pile with a suction cup of limited force: along `approach`, then up beyond the rim and
/// the pile. Neighbours that it touches move, and what lost its support settles again. The gripper itself touches
/// nothing.
/// @param approach Out of the surface of the pellet, in the bin; of any length.
/// @throws InvalidArgument naming the field or the argument.
Removal remove_pellet(const PelletScene& scene, int pellet, const Eigen::Vector3d& approach,
                      const RemovalOptions& removal = {}, const PileOptions& options = {});

/// Deepest overlap of two pellets, or of a pellet and the bin, by points on all surfaces half a millimetre apart or
/// closer; 0: none [m].
double deepest_overlap(const PelletScene& scene);

}  // namespace kr5::sim
