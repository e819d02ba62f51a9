// SPDX-License-Identifier: BSD-3-Clause
#include "gap/stages/report_stage.hpp"

#include "gap/planning/next_experiment.hpp"
#include "gap/reporting/gap_figures.hpp"
#include "gap/reporting/untried_effects.hpp"
#include "gap/stages/nearest_effects.hpp"
#include "gap/stages/stage_progress.hpp"

namespace kr5::gap {
namespace {

/// What the stages noticed beside the causes.
void add_findings(const CompareOutput& compared, const NoiseOutput& noise, const ScreenOutput& screened,
                  const JudgeOutput& judged, const DiagnoseOptions& options, Diagnosis& out) {
  out.joint_names = compared.data.recording->cell.robot.joint_names;
  out.left_out = compared.data.left_out;
  out.missing_splits = compared.missing_splits;
  out.scope = compared.scope;
  for (const auto* scales : {&noise.corrected, &screened.pose_noise})
    for (const NoiseScale& scale : *scales) out.noise.push_back({scale.key, scale.kind, scale.ratio, scale.std});
  out.excused = noise.excused;
  out.coarse = noise.coarse;
  out.spikes = noise.spikes + screened.stray_poses;
  out.outliers = judged.late_spikes;
  out.clock_faults = judged.clock_faults;
  if (judged.found.cut_short) out.sets_limit = static_cast<int>(most_examined);
  if (!screened.start && static_cast<int>(judged.causes.size()) >= options.max_effects)
    out.effects_limit = options.max_effects;
}

}  // namespace

Diagnosis report_stage(const CompareOutput& compared, const NoiseOutput& noise, const ScreenOutput& screened,
                       const JudgeOutput& judged, const DiagnoseOptions& options) {
  const ComparisonData& data = judged.data;
  const std::vector<Group>& groups = screened.groups;
  const ResidualAnalysis &before = judged.before, &after = judged.after;
  Diagnosis out;
  out.verdict = judged.verdict;
  out.causes = judged.causes;
  if (out.verdict != Verdict::NoGap) out.where = column_excesses(data, groups, before);
  if (after.any()) out.unexplained = column_excesses(data, groups, after);
  // Small errors of the nominal parameters alone are no cause, so that nothing is said to fall by them.
  out.reduction =
      gap_reduction(data, groups, judged.above, before.shown, out.causes.empty() ? before.shown : after.shown);
  out.cell = setup_of(data, judged.model.parts).cell;
  out.next_experiment = next_experiment(data, judged.model, judged.found.models.kept, out.causes, options.threads);
  if (after.any()) out.nearest = nearest_effects(screened, judged, options);
  out.not_tried = untried_effects(data.recording->cell, screened.screen.unseen());
  out.nuisance_std = judged.found.prior.size();
  add_findings(compared, noise, screened, judged, options, out);
  tell(options, judging_step, 1.0);
  return out;
}

}  // namespace kr5::gap
