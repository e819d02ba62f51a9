// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <vector>

#include <kr5/force/peg_tube_contact.hpp>
#include <kr5/sim/pellet_bin.hpp>
#include <kr5/sim/work_cell_options.hpp>

#include "cylinder_contact.hpp"
#include "held_peg.hpp"

/// @file
/// What a pellet in motion may touch in a work cell: stand, tubes, bin, and pellets that lie still. All in B.

namespace kr5::sim {

/// A pellet that is an obstacle to others.
struct RestingPellet {
  int number = 0;
  CylinderBody body;
};

/// The bodies of a cell where they really stand.
struct CellSolids {
  BinShape bin;
  StandShape stand;
  std::vector<Pose> T_base_tubes;
  force::PegTubeShape tube;  ///< Of every tube; the peg in it is replaced by each pellet.
  std::vector<RestingPellet> pellets;

  /// Whether a body is inside the bin, below its rim.
  bool in_bin(const CylinderBody& body) const;
  /// Number of the tube in whose bore a body is: its middle below the face, or its lower end, and its axis within the
  /// play from there up; -1: in none.
  int tube_around(const CylinderBody& body) const;
  /// Of its lower end below the face of a tube [m].
  double depth_in(int tube, const CylinderBody& body) const;
  /// Whether it touches the plate, or is nearer to it than `margin` [m].
  bool on_stand(const CylinderBody& body, double margin) const;
  /// Whether anything but the pellet itself is nearer than `margin` [m]; at times also when it is farther.
  bool near(const CylinderBody& body, int number, double margin) const;
  /// All places where it overlaps with something.
  force::Contacts contacts(const CylinderBody& body, int number) const;
};

CylinderBody cylinder_of(const Pose& T_base_pellet, double radius, double height);

/// The same for a pellet that moves as a peg.
class PelletSurroundings : public PegSurroundings {
 public:
  /// @param solids Outlives this.
  PelletSurroundings(const CellSolids& solids, int number, double radius, double height)
      : solids_(&solids), number_(number), radius_(radius), height_(height) {}
  bool clear(const Pose& T_base_peg) const override;
  force::Contacts contacts(const Pose& T_base_peg) const override;

 private:
  CylinderBody body(const Pose& T_base_peg) const;

  const CellSolids* solids_;
  int number_;
  double radius_, height_;
};

}  // namespace kr5::sim
