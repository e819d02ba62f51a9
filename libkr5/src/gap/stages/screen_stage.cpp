// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/screen_stage.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "gap/fitting/start.hpp"
#include "gap/recording_scope.hpp"
#include "gap/screening/effect_prior.hpp"
#include "gap/screening/pose_noise.hpp"
#include "gap/screening/recording_faults.hpp"
#include "gap/stages/stage_progress.hpp"

namespace kr5::gap {
namespace {

/// All that may explain a recording: effects of the catalogue, those of the options, faults of the recording.
std::vector<Hypothesis> all_hypotheses(const cell::Recording& recording, const DiagnoseOptions& options) {
  std::vector<Hypothesis> out = hypotheses(recording.cell, span_of(recording));
  if (only_loads(recording)) apply_geometry_prior(out);
  apply_omission_prior(recording.cell, out);
  out.insert(out.end(), options.own_hypotheses.begin(), options.own_hypotheses.end());
  std::vector<Hypothesis> faults = recording_faults(recording);
  out.insert(out.end(), std::make_move_iterator(faults.begin()), std::make_move_iterator(faults.end()));
  return out;
}

bool is_of_start(const DiagnoseOptions& options, const Hypothesis& h) {
  return std::ranges::any_of(options.start, [&](const FittedEffect& e) { return is_of(e, h); });
}

/// The start of the options, fitted.
FarStart fitted_start(const NoiseOutput& noise, const std::vector<Hypothesis>& hypotheses,
                      const DiagnoseOptions& options) {
  const std::vector<int> compared = compared_experiments(noise.data);
  FarStart out;
  for (const Hypothesis& h : hypotheses)
    if (is_of_start(options, h)) out.candidates.push_back(std::make_shared<Candidate>(Candidate{h, compared, {}}));
  const NuisanceModel none;
  const FitProblem problem{noise.data, none, {}, 0.0, Slopes::WhereNeeded};
  out.model = fit_start(problem, noise.base, options.start, out.candidates, options.threads);
  return out;
}

/// The start of the options, if it is out of reach of the nominal cell.
std::optional<FarStart> far_start(const NoiseOutput& noise, const std::vector<Hypothesis>& hypotheses,
                                  const DiagnoseOptions& options) {
  if (options.start.empty()) return std::nullopt;
  FarStart out = fitted_start(noise, hypotheses, options);
  if (in_reach(noise.data, out.model, noise.base)) return std::nullopt;
  return out;
}

/// Lets the parts of a start be candidates of the screen, where it has them.
void adopt(const Screen& screen, FarStart& start) {
  for (Part& part : start.model.parts)
    for (const auto& candidate : screen.candidates())
      if (candidate->hypothesis.name() == part.candidate->hypothesis.name()) part.candidate = candidate.get();
}

std::vector<const Hypothesis*> acting_on_poses(const Screen& screen, const cell::Recording& recording) {
  std::vector<const Hypothesis*> out;
  for (const auto& candidate : screen.candidates())
    if (std::ranges::any_of(candidate->experiments,
                            [&](int e) { return recording.experiments[e].kind == cell::Kind::Poses; }))
      out.push_back(&candidate->hypothesis);
  return out;
}

ScreenOutput screened(const NoiseOutput& noise, std::vector<Hypothesis> all, std::optional<FarStart> start,
                      const DiagnoseOptions& options) {
  const cell::Recording& recording = *noise.data.recording;
  const cell::Cell about = start ? setup_of(noise.data, start->model.parts).cell : recording.cell;
  ScreenOutput out{noise.data,
                   noise.base,
                   Screen(noise.data, std::move(all), about, start ? start->model.residual : noise.base,
                          options.threads, [&](double fraction) { tell(options, screening_step, fraction); }),
                   {},
                   {},
                   {},
                   0,
                   std::move(start)};
  if (out.start) adopt(out.screen, *out.start);
  const std::vector<NoiseScale> scales =
      pose_noise_scales(out.data, out.base, acting_on_poses(out.screen, recording), out.stray_poses);
  out.pose_noise = correct_wrong(out.data, scales, out.base);
  out.groups = make_groups(out.data);
  if (!out.start) out.nuisance = make_nuisance_model(out.data, out.base, options.threads);
  return out;
}

}  // namespace

ScreenOutput screen_stage(const NoiseOutput& noise, const DiagnoseOptions& options) {
  std::vector<Hypothesis> all = all_hypotheses(*noise.data.recording, options);
  std::optional<FarStart> start = far_start(noise, all, options);
  return screened(noise, std::move(all), std::move(start), options);
}

ScreenOutput start_stage(const NoiseOutput& noise, const DiagnoseOptions& options) {
  const cell::Recording& recording = *noise.data.recording;
  std::vector<Hypothesis> all = hypotheses(recording.cell, span_of(recording));
  std::erase_if(all, [&](const Hypothesis& h) { return !is_of_start(options, h); });
  FarStart start = fitted_start(noise, all, options);
  return screened(noise, std::move(all), std::move(start), options);
}

}  // namespace kr5::gap
