// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <vector>

#include <kr5/cell/recording.hpp>
#include <kr5/cell/simulator.hpp>
#include <kr5/gap/diagnosis.hpp>
#include <kr5/identification/dynamics.hpp>

/// @file
/// The freely fitted arm of one recording as the reference of another.

namespace kr5::arm_log {

struct ReferenceArm {
  identification::DynamicsResult found;
  double delay = 0.0;  ///< By which its loads were logged late [s].
};

/// The arm of all motions of a recording on measured positions; nothing without such, or where they determine none.
std::optional<ReferenceArm> reference_arm(const cell::Recording& recording);

struct Relative {
  cell::Recording recording;  ///< Its loads are those of the simulator, and the difference from the reference.
  std::vector<gap::ColumnError> errors;  ///< Of these loads, as the uncertainty of the reference makes them.
};
Relative relative_to(const ReferenceArm& arm, const cell::Recording& recording, const cell::Simulator& simulator);

/// Standard deviations that the uncertainty of a reference adds to what was fitted relative to it: of every number of
/// every parameter, one after the other; zeros without a reference.
Eigen::VectorXd deviations_by(const std::optional<ReferenceArm>& arm, const cell::Recording& relative,
                              const cell::Simulator& simulator, const std::vector<gap::Cause>& causes);

}  // namespace kr5::arm_log
