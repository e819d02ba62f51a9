// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "gap/fitting/fit.hpp"
#include "gap/fitting/nuisance_model.hpp"
#include "gap/reporting/structure.hpp"
#include "gap/screening/screen.hpp"
#include "gap/stages/noise_stage.hpp"

/// @file
/// Third stage of a diagnosis: what each effect would change, and what of it small errors of the cell could take.

namespace kr5::gap {

/// Effects from which the search begins, since slopes at the nominal cell do not lead to them.
struct FarStart {
  std::vector<std::shared_ptr<const Candidate>> candidates;  ///< To which the parts of the model may point.
  Model model;
};

struct ScreenOutput {
  ComparisonData data;   ///< As before, poses with the noise that counts.
  Eigen::VectorXd base;  ///< Residuals of the nominal cell over that noise.
  Screen screen;
  NuisanceModel nuisance;
  std::vector<Group> groups;           ///< The columns, each over all its experiments.
  std::vector<NoiseScale> pose_noise;  ///< Of poses, where it is not as declared.
  int stray_poses = 0;                 ///< Values of poses that are marked as spikes.
  std::optional<FarStart> start = {};
};

ScreenOutput screen_stage(const NoiseOutput& noise, const DiagnoseOptions& options);

/// The same with the effects of `options.start` alone, from which the search begins wherever they are.
ScreenOutput start_stage(const NoiseOutput& noise, const DiagnoseOptions& options);

}  // namespace kr5::gap
