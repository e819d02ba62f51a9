// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/job_runner.hpp>

#include <optional>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/job/journal_writer.hpp>
#include <kr5/kinematics/inverse.hpp>

#include "work/job_service.hpp"

namespace kr5::work {
namespace {

constexpr int told_every = 50;  // cycles between two words of progress

}  // namespace

struct JobRunner::Program {
  Program(sim::WorkCell& given, const WorkOptions& options, job::Journal& to, job::RestartMeasurements seen)
      : cell(given), journal(to), service(cell, options) {
    options.validate();
    ring.begin_after(journal.last_number());
    seen.reading = cell.read();
    decision = job::decide_restart(journal.belief(), seen, restart_options(options));
    if (can_go_on(decision)) cycle.emplace(options, decision, cell.believed(), ring);
  }

  void step();

  SharedCell cell;
  job::Journal& journal;
  JobService service;
  job::RecordRing ring;
  job::RestartDecision decision;
  std::optional<JobCycle> cycle;
  robot::RobotCommand command;
};

/// What is asked for is answered before the next cycle: the arm stands meanwhile.
void JobRunner::Program::step() {
  command = cycle->step(cell.read());
  service.serve(*cycle);
  cell.send(command);
  std::string problem;
  job::write_records(ring, journal, problem);
  if (!problem.empty()) throw IoError(problem);
}

JobRunner::JobRunner(sim::WorkCell& cell, const WorkOptions& options, job::Journal& journal,
                     const job::RestartMeasurements& seen)
    : program_(std::make_unique<Program>(cell, options, journal, seen)) {}
JobRunner::~JobRunner() = default;
JobRunner::JobRunner(JobRunner&&) noexcept = default;
JobRunner& JobRunner::operator=(JobRunner&&) noexcept = default;

const job::RestartDecision& JobRunner::decision() const noexcept { return program_->decision; }
bool JobRunner::runs() const noexcept { return program_->cycle.has_value(); }
bool JobRunner::finished() const noexcept { return !runs() || program_->cycle->finished(); }
const robot::RobotCommand& JobRunner::command() const noexcept { return program_->command; }

const job::JobState& JobRunner::state() const {
  require(runs(), "job: it cannot go on: " + std::string(name_of(decision().status)));
  return program_->cycle->state();
}

const force::InsertionState& JobRunner::insertion() const {
  require(runs(), "job: it cannot go on: " + std::string(name_of(decision().status)));
  return program_->cycle->insertion();
}

void JobRunner::step() {
  if (!finished()) program_->step();
}

JobRun JobRunner::run(const JobProgress& progress) {
  for (int k = 0; !finished(); ++k) {
    step();
    if (progress && k % told_every == 0) progress(state());
  }
  return result();
}

JobRun JobRunner::result() const { return program_->service.result(decision(), program_->cycle, program_->journal); }

void place_over_bin(sim::WorkCell& cell, const WorkOptions& options) {
  const cell::Cell& c = cell.believed();
  kinematics::InverseOptions search;
  if (c.robot.limits) {
    search.lower = c.robot.limits->lower;
    search.upper = c.robot.limits->upper;
  }
  search.near = Eigen::VectorXd::Zero(c.robot.joints());
  const Pose T_base_flange = options.job.places.T_base_scan * c.tool->T_flange_tool.inverse();
  const auto found = kinematics::inverse_kinematics(cell::nominal_chain(c), T_base_flange, search);
  const kinematics::Posture* best = nullptr;
  for (const kinematics::Posture& p : found.postures)
    if (p.usable() && (!best || p.q.norm() < best->q.norm())) best = &p;
  require(best != nullptr, "job.places.T_base_scan: the arm does not reach it; move the bin nearer");
  cell.place(best->q);
}

JobTruth judge_job(const sim::WorkCell& cell) {
  const sim::WorkCellTruth truth = cell.truth();
  JobTruth out;
  out.max_force = truth.max_force;
  for (const sim::PelletTruth& p : truth.pellets) {
    if (p.tube >= 0 && p.place != sim::PelletPlace::Grip) {
      ++out.in_tube;
      continue;
    }
    out.on_stand += p.place == sim::PelletPlace::Stand;
    out.in_bin += p.place == sim::PelletPlace::Bin;
    out.loose += p.place == sim::PelletPlace::Grip || p.place == sim::PelletPlace::Loose;
    out.lost += p.place == sim::PelletPlace::Lost;
  }
  return out;
}

}  // namespace kr5::work
