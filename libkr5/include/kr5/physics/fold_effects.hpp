// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <vector>

#include <kr5/cell/cell.hpp>
#include <kr5/cell/effect.hpp>

/// @file
/// Effects put into the nominal parameters of a cell: a diagnosed cell as a plain model.

namespace kr5::physics {

struct FoldOptions {
  /// Gives a cell without drives some of unit gear (a current is then a joint torque), in which friction has a place.
  bool add_drives = false;

  static void each_field(auto& self, auto&& visit) {
    visit("add_drives", self.add_drives,
          "Whether a cell without drives gets some of unit gear, in which friction has a place.");
  }
};

/// An effect that is in the nominal parameters now.
struct FoldedEffect {
  cell::ActiveEffect effect;  ///< With the parameters that were folded.
  std::string field;          ///< Of the cell, where they are; empty for a registered effect.
};

/// An effect that is one still.
struct RemainingEffect {
  cell::ActiveEffect effect;
  std::string reason;  ///< In words.
};

struct FoldedCell {
  cell::Cell cell;  ///< With the remaining effects.
  std::vector<FoldedEffect> folded;
  std::vector<RemainingEffect> remaining;  ///< In the order of the catalogue.
};

/// The cell with every effect in its nominal parameters for which they have a place: the laws of this module give the
/// same before and after, to rounding. What has none (friction that depends on speed or load, elasticity, play, ripple,
/// sensors) stays an effect, and so does one whose value no cell may have. A tube that stands elsewhere is one of
/// these: profiles are stated in its nominal frame. Registered effects that change the cell are applied.
FoldedCell fold_effects(const cell::Cell& cell, const FoldOptions& options = {});

}  // namespace kr5::physics
