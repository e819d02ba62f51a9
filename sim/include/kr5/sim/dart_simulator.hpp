// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/cell/simulator.hpp>
#include <kr5/core/fields.hpp>
#include <kr5/sim/mesh_contact.hpp>

namespace kr5::sim {

struct DartSimulatorOptions {
  double step = 0.0;  ///< [s]
  ContactBy contact = ContactBy::ClosedForm;

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("step", self.step, "Step of the integration; 0: chosen so that gears and contact are resolved [s].");
    visit("contact", self.contact,
          "Search of the contacts of peg and tube: closed_form | mesh (ODE, an independent check).");
  }
};

/// The full grade of a simulator: the arm, its drives and its contacts stepped through time in DART; static kinds from
/// the kinematics of the same skeleton. All effects of the catalogue act.
///
/// Holds nothing but its options: one object may be used by many threads.
class DartSimulator : public cell::Simulator {
 public:
  /// @throws InvalidArgument naming the option.
  explicit DartSimulator(const DartSimulatorOptions& options = {});

  /// @throws InvalidArgument as for Simulator; for masses and inertias that are not positive, joint values out of the
  ///         limits of the cell, an effect on a joint that is not there, a step that is not stable, each by name.
  io::Table simulate(const cell::Cell& cell, const cell::Experiment& experiment) const override;

 private:
  DartSimulatorOptions options_;
};

}  // namespace kr5::sim
