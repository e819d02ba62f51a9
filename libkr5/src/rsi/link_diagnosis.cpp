// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/link_diagnosis.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/rsi/cycles.hpp>

#include "rsi/answer_findings.hpp"
#include "rsi/arrival_findings.hpp"
#include "rsi/content_findings.hpp"
#include "rsi/motion_findings.hpp"
#include "rsi/pose_findings.hpp"
#include "rsi/timing_findings.hpp"

namespace kr5::rsi {
namespace {

Distribution distribution_of(const std::vector<double>& seconds) {
  DurationHistogram histogram;
  for (const double s : seconds) histogram.add(std::llround(1e9 * s));
  return histogram.summary();
}

void fill_durations(const ReadObservations& read, LinkDiagnosis& out) {
  std::vector<double> periods, answers;
  for (std::size_t i = 0; i < read.telegrams.size(); ++i) {
    const Exchange& here = *read.telegrams[i].exchange;
    if (i > 0) periods.push_back(here.time - read.telegrams[i - 1].exchange->time);
    if (here.duration) answers.push_back(*here.duration);
  }
  out.period = distribution_of(periods);
  out.answer = distribution_of(answers);
}

}  // namespace

void DiagnosisOptions::validate() const {
  require(!cycle || (*cycle >= 0.001 && *cycle <= 0.1), "cycle: must lie between 1 and 100 ms [s]");
  require(!deadline || (*deadline > 0 && *deadline <= 0.1), "deadline: must be positive, at most 100 ms [s]");
  require(silence >= 0.1 && silence <= 60, "silence: must lie between 0.1 and 60 s [s]");
  require(jitter > 0 && std::isfinite(jitter), "jitter: must be positive [-]");
  require(clock_jump > 0 && std::isfinite(clock_jump), "clock_jump: must be positive [s]");
  require(min_telegrams >= 4, "min_telegrams: must be at least 4");
  require(position_tolerance > 0 && std::isfinite(position_tolerance), "position_tolerance: must be positive [m]");
  require(gain_tolerance > 0 && gain_tolerance < 1, "gain_tolerance: must lie between 0 and 1 [-]");
  if (model) model->validate();
}

double DiagnosisOptions::cycle_of(Controller controller) const noexcept {
  return cycle.value_or(controller == Controller::Krc2 ? krc2_cycle : short_cycle);
}

LinkDiagnosis examine_link(const LinkObservations& observations, const TelegramLayout& layout,
                           const DiagnosisOptions& options) {
  const ReadObservations read = read_observations(observations, layout, options);
  LinkDiagnosis out;
  out.telegrams = read.counts;
  out.senders = read.senders;
  out.cycle = measured_cycle(read);
  fill_durations(read, out);
  for (const Findings& part :
       {arrival_findings(read), content_findings(read), timing_findings(read), answer_findings(read),
        pose_findings(read, out.pose_compared), motion_findings(read, out.motion_compared)})
    out.findings.insert(out.findings.end(), part.begin(), part.end());
  std::ranges::stable_sort(out.findings, {}, &LinkFinding::severity);
  const bool faulty = !out.findings.empty() && out.findings.front().severity == FindingSeverity::Fault;
  const bool enough = read.telegrams.size() >= static_cast<std::size_t>(options.min_telegrams);
  out.verdict = faulty ? LinkVerdict::Faulty : enough ? LinkVerdict::Sound : LinkVerdict::Undecided;
  return out;
}

}  // namespace kr5::rsi
