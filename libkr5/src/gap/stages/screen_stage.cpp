// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/screen_stage.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "gap/recording_scope.hpp"
#include "gap/screening/geometry_prior.hpp"
#include "gap/screening/pose_noise.hpp"
#include "gap/screening/recording_faults.hpp"
#include "gap/stages/stage_progress.hpp"

namespace kr5::gap {
namespace {

/// All that may explain a recording: effects of the catalogue, those of the options, faults of the recording.
std::vector<Hypothesis> all_hypotheses(const cell::Recording& recording, const DiagnoseOptions& options) {
  std::vector<Hypothesis> out = hypotheses(recording.cell, span_of(recording));
  if (only_loads(recording)) apply_geometry_prior(out);
  out.insert(out.end(), options.own_hypotheses.begin(), options.own_hypotheses.end());
  std::vector<Hypothesis> faults = recording_faults(recording);
  out.insert(out.end(), std::make_move_iterator(faults.begin()), std::make_move_iterator(faults.end()));
  return out;
}

std::vector<const Hypothesis*> acting_on_poses(const Screen& screen, const cell::Recording& recording) {
  std::vector<const Hypothesis*> out;
  for (const auto& candidate : screen.candidates())
    if (std::ranges::any_of(candidate->experiments,
                            [&](int e) { return recording.experiments[e].kind == cell::Kind::Poses; }))
      out.push_back(&candidate->hypothesis);
  return out;
}

}  // namespace

ScreenOutput screen_stage(const NoiseOutput& noise, const DiagnoseOptions& options) {
  const cell::Recording& recording = *noise.data.recording;
  ScreenOutput out{noise.data,
                   noise.base,
                   Screen(noise.data, all_hypotheses(recording, options), noise.base, options.threads,
                          [&](double fraction) { tell(options, screening_step, fraction); }),
                   {},
                   {},
                   {},
                   0};
  const std::vector<NoiseScale> scales =
      pose_noise_scales(out.data, out.base, acting_on_poses(out.screen, recording), out.stray_poses);
  out.pose_noise = correct_wrong(out.data, scales, out.base);
  out.groups = make_groups(out.data);
  out.nuisance = make_nuisance_model(out.data, out.base, options.threads);
  return out;
}

}  // namespace kr5::gap
