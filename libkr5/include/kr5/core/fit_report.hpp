// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/core/fields.hpp>

namespace kr5 {

/// How an estimation ended.
enum class FitStatus {
  Converged,      ///< Reached a tolerance; the estimate may be used.
  MaxIterations,  ///< Stopped early; the estimate may be used with care.
  Degenerate,     ///< The data do not determine all parameters; do not use the estimate.
};

constexpr auto enum_names(FitStatus) {
  return names<FitStatus>({{FitStatus::Converged, "converged"},
                           {FitStatus::MaxIterations, "max_iterations"},
                           {FitStatus::Degenerate, "degenerate"}});
}

/// The part of a result that every estimator shares. Starts as "not run".
struct FitReport {
  FitStatus status = FitStatus::Degenerate;
  int iterations = 0;
  double initial_rms = 0.0;  ///< [-]
  double final_rms = 0.0;    ///< [-]
  std::string message = "not run";

  bool usable() const { return status != FitStatus::Degenerate; }

  static void each_field(auto& self, auto&& visit) {
    visit("status", self.status, "Status of the estimation.");
    visit("iterations", self.iterations, "Number of steps taken.");
    visit("initial_rms", self.initial_rms, "RMS of the whitened residuals before the fit [-].");
    visit("final_rms", self.final_rms,
          "RMS of the whitened residuals after the fit; near 1 when the noise model is right [-].");
    visit("message", self.message, "Explanation of the status.");
  }
};

}  // namespace kr5
