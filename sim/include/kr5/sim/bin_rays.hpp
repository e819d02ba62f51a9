// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include <kr5/geometry/solid.hpp>
#include <kr5/sim/pellet_bin.hpp>

namespace kr5::sim {

/// What a ray in a bin meets: the number of a pellet, or one of these.
enum BinSurface : int { BinWall = -1, BinFloor = -2, BinNothing = -3 };

struct BinHit {
  double distance = std::numeric_limits<double>::infinity();  ///< [m]
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();           ///< Out of the material, of length 1, in the bin.
  int surface = BinNothing;                                   ///< Number of a pellet, or a BinSurface.
};

/// Something else that stands in a bin, or beside it.
struct SolidInBin {
  Solid solid;
  Pose T_bin_solid = Pose::Identity();
};

/// Rays among the pellets and walls of a bin: exact on sides and end faces of the pellets and on walls and floor, found
/// by a tree of boxes. Walls are boxes outside the inner size; the floor reaches below them. All in the frame of the
/// bin.
class BinRays {
 public:
  /// @param solids Other things in the bin; what a ray meets of them counts as wall.
  explicit BinRays(const PelletScene& scene, std::vector<SolidInBin> solids = {});

  /// First hit. @param direction Of length 1.
  BinHit first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  /// Entries into all pellets that a ray passes through, in any order.
  void all_pellets(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, std::vector<BinHit>& hits) const;
  /// Whether anything lies nearer than `distance` [m] on a ray.
  bool blocked(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double distance) const;

 private:
  struct Node {
    Eigen::AlignedBox3d box;
    int first = 0, count = 0;  ///< Pellets of a leaf, places in `order_`; count 0: an inner node.
    int right = 0;             ///< Second child; the first one follows its parent.
  };
  struct Round {
    Eigen::Matrix3d to_pellet;
    Eigen::Vector3d centre;
    double radius, half;
  };
  struct Block {
    Eigen::AlignedBox3d box;
    int surface;
  };
  int build(int first, int count, const std::vector<Eigen::AlignedBox3d>& boxes);
  void each_pellet_near(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, const double& within,
                        auto&& visit) const;
  BinHit meet(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, int pellet) const;
  void meet_solids(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, BinHit& best) const;

  std::vector<Round> pellets_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
  std::vector<Block> blocks_;
  std::vector<SolidInBin> solids_;
};

/// Share of each pellet that is seen from above: the area of its projection along Z of the bin that no other pellet
/// hides, over the area of its whole projection [-]; by vertical rays on a grid.
/// @param spacing Of the rays [m].
/// @throws InvalidArgument naming the argument or the field of the scene.
Eigen::VectorXd exposed_shares(const PelletScene& scene, double spacing = 2.5e-4);

}  // namespace kr5::sim
