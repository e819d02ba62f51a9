// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/job_statistics.hpp>

#include <algorithm>
#include <cmath>

#include <kr5/core/error.hpp>
#include <kr5/job/belief.hpp>

namespace kr5::job {
namespace {

constexpr double even = 0.01;  // part by which cycles of a jerk may differ in length

/// Whether time passes from a record to the next one: within one program, until the arm is stopped.
bool goes_on(const JobRecord& from, const JobRecord& to) {
  const bool ended = from.kind == RecordKind::Stop || from.kind == RecordKind::Release;
  return !ended && to.kind != RecordKind::Begin && to.kind != RecordKind::Release;
}

PhaseTime& phase_entry(JobStatistics& s, Phase phase) {
  const auto found =
      std::find_if(s.phases.begin(), s.phases.end(), [&](const PhaseTime& p) { return p.phase == phase; });
  if (found != s.phases.end()) return *found;
  s.phases.push_back({.phase = phase});
  return s.phases.back();
}

/// The phase that a program is in after a record: it begins with the check, whatever phase it goes on with.
Phase phase_after(const JobRecord& record) {
  return record.kind == RecordKind::Begin ? Phase::CheckCell : record.phase;
}

void note_times(JobStatistics& s, std::span<const JobRecord> records) {
  double stay = 0.0;
  for (std::size_t k = 0; k < records.size(); ++k) {
    const JobRecord& r = records[k];
    s.programs += r.kind == RecordKind::Begin;
    s.stops += r.kind == RecordKind::Stop;
    if (r.kind == RecordKind::Begin || r.kind == RecordKind::Enter) {
      ++phase_entry(s, phase_after(r)).count;
      stay = 0.0;
    }
    if (k + 1 == records.size() || !goes_on(r, records[k + 1])) continue;
    const double passed = std::max(records[k + 1].time - r.time, 0.0);
    PhaseTime& phase = phase_entry(s, phase_after(r));
    stay += passed;
    s.time += passed;
    phase.total += passed;
    phase.max = std::max(phase.max, stay);
    if (r.pellet > 0) s.pellets[static_cast<std::size_t>(r.pellet - 1)].time += passed;
  }
  std::sort(s.phases.begin(), s.phases.end(), [](const PhaseTime& a, const PhaseTime& b) { return a.phase < b.phase; });
}

void note_pellets(JobStatistics& s, const JobBelief& belief) {
  s.inserted = belief.inserted;
  for (const PelletEntry& p : belief.pellets) {
    s.pellets.push_back({.number = p.number, .state = p.state, .picks = p.picks, .insertions = p.insertions});
    for (int attempt = 1; attempt <= p.insertions; ++attempt) {
      if (static_cast<int>(s.attempts.size()) < attempt) s.attempts.push_back({.attempt = attempt});
      ++s.attempts[static_cast<std::size_t>(attempt - 1)].tried;
    }
    if (p.state == PelletState::Inserted && p.insertions > 0)
      ++s.attempts[static_cast<std::size_t>(p.insertions - 1)].inserted;
  }
}

PelletFigures* figures_of(JobStatistics& s, const JobSamples& samples, Eigen::Index k) {
  const int pellet = samples.pellet.empty() ? 0 : samples.pellet[static_cast<std::size_t>(k)];
  const bool known = pellet >= 1 && pellet <= static_cast<int>(s.pellets.size());
  return known ? &s.pellets[static_cast<std::size_t>(pellet - 1)] : nullptr;
}

void note_forces(JobStatistics& s, const JobSamples& samples, double contact) {
  for (Eigen::Index k = 0; k < samples.force.cols(); ++k) {
    const double force = samples.force.col(k).norm();
    const double lasts = k > 0 ? samples.time[k] - samples.time[k - 1] : 0.0;
    const double impulse = force >= contact ? force * lasts : 0.0;
    s.peak_force = std::max(s.peak_force, force);
    s.impulse += impulse;
    if (PelletFigures* pellet = figures_of(s, samples, k)) {
      pellet->peak_force = std::max(pellet->peak_force, force);
      pellet->impulse += impulse;
    }
  }
}

/// Third differences, where the cycles follow each other: an interruption is no motion.
void note_jerk(JobStatistics& s, const JobSamples& samples) {
  const Eigen::Matrix3Xd& p = samples.position;
  double squares = 0.0;
  int count = 0;
  for (Eigen::Index k = 3; k < p.cols(); ++k) {
    const Eigen::Vector3d steps = samples.time.segment<3>(k - 2) - samples.time.segment<3>(k - 3);
    const double dt = steps.mean();
    if (steps.maxCoeff() - steps.minCoeff() > even * dt) continue;
    const double jerk = (p.col(k) - 3 * p.col(k - 1) + 3 * p.col(k - 2) - p.col(k - 3)).norm() / (dt * dt * dt);
    squares += jerk * jerk;
    ++count;
    s.peak_jerk = std::max(s.peak_jerk, jerk);
    if (PelletFigures* pellet = figures_of(s, samples, k)) pellet->peak_jerk = std::max(pellet->peak_jerk, jerk);
  }
  if (count > 0) s.rms_jerk = std::sqrt(squares / count);
}

}  // namespace

void JobSamples::validate() const {
  const auto fits = [this](Eigen::Index n) { return n == 0 || n == time.size(); };
  require(fits(position.cols()), "position: must have a column for each time");
  require(fits(force.cols()), "force: must have a column for each time");
  require(fits(static_cast<Eigen::Index>(pellet.size())), "pellet: must have a value for each time");
  require(time.allFinite() && position.allFinite() && force.allFinite(), "samples hold a number that is not finite");
  for (Eigen::Index k = 1; k < time.size(); ++k) require(time[k] > time[k - 1], "time: must rise [s]");
}

void JobStatisticsOptions::validate() const {
  require(contact_force >= 0 && std::isfinite(contact_force), "contact_force must not be negative [N]");
}

JobStatistics job_statistics(std::span<const JobRecord> records, const JobSamples& samples,
                             const JobStatisticsOptions& options) {
  samples.validate();
  options.validate();
  JobStatistics out;
  note_pellets(out, believe(records));
  note_times(out, records);
  note_forces(out, samples, options.contact_force);
  note_jerk(out, samples);
  return out;
}

}  // namespace kr5::job
