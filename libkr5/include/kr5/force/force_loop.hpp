// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>

/// @file
/// Force along one axis by corrections of the path (Hayat et al. 2022, section 5.3). Cycle by cycle, for one thread;
/// nothing here allocates or throws once it is made.

namespace kr5::force {

/// What a correction adds to.
enum class CorrectionReference {
  Start,   ///< The pose at which the loop began: proportional, with the compensator (5.17) no steady error.
  Actual,  ///< The present pose: corrections add up, the loop integrates by itself.
};
constexpr auto enum_names(CorrectionReference) {
  return names<CorrectionReference>({{CorrectionReference::Start, "start"}, {CorrectionReference::Actual, "actual"}});
}

struct ForceLoopOptions {
  double gain = 5e-6;
  CorrectionReference correction = CorrectionReference::Start;
  double stiffness = 23.38e3;
  double largest_step = 0.0;
  double range = 0.05;

  /// (1 + k_p k_e) / (k_p k_e), eq. 5.17: what the reference is multiplied by so that a proportional loop reaches it; 1
  /// for corrections of the actual pose, which need none.
  double compensator() const;
  /// The fastest that contact may be made at, so that the first cycle behind it is no harder than the reference [m/s].
  double contact_speed(double reference, double cycle) const;
  /// @throws InvalidArgument naming the offending field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("gain", self.gain, "Gain k_p: correction per error of force [m/N].");
    visit("correction", self.correction,
          "Reference of the corrections: start (the pose at the beginning) | actual (the present pose).");
    visit("stiffness", self.stiffness, "Stiffness k_e of the contact, for the compensator [N/m].");
    visit("largest_step", self.largest_step,
          "Maximum step of one cycle; 0: unlimited within range for start, a fiftieth of range for actual [m].");
    visit("range", self.range, "Maximum correction of the start; maximum step of the present pose [m].");
  }
};

/// One axis, positive into the contact.
class ForceLoop {
 public:
  explicit ForceLoop(const ForceLoopOptions& options);

  /// Begins anew from no correction.
  void reset() noexcept;
  /// The correction of this cycle, towards a reference force: of the pose at reset() [m], or with
  /// `CorrectionReference::Actual` of the present one.
  /// @param reference and @param measured: force of the tool into the contact [N].
  double step(double reference, double measured) noexcept;
  /// A limit, or an argument that is no finite number, holds the correction back.
  bool limited() const noexcept { return limited_; }
  /// The last one [m].
  double correction() const noexcept { return correction_; }

 private:
  double step_limit() const noexcept;

  ForceLoopOptions options_;
  double compensator_ = 1.0;
  double correction_ = 0.0;
  bool limited_ = false;
};

}  // namespace kr5::force
