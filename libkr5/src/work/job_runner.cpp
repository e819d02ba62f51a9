// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/job_runner.hpp>

#include <kr5/core/error.hpp>

#include "work/job_program.hpp"
#include "work/reach.hpp"

namespace kr5::work {
namespace {

constexpr int told_every = 50;  // cycles between two words of progress

}  // namespace

struct JobRunner::Program : JobProgram {
  Program(sim::WorkCell& given, const WorkOptions& options, job::Journal& to, const job::RestartMeasurements& seen,
          const std::filesystem::path& cell_file)
      : JobProgram(given, options, to, cell_file) {
    begin(options, seen);
  }

  void step();

  robot::RobotCommand command;
};

/// What is asked for is answered before the next cycle: the arm stands meanwhile.
void JobRunner::Program::step() {
  command = cycle->step(cell.read());
  service.serve(*cycle);
  cell.send(command);
  write();
}

JobRunner::JobRunner(sim::WorkCell& cell, const WorkOptions& options, job::Journal& journal,
                     const job::RestartMeasurements& seen, const std::filesystem::path& cell_file)
    : program_(std::make_unique<Program>(cell, options, journal, seen, cell_file)) {}
JobRunner::~JobRunner() = default;
JobRunner::JobRunner(JobRunner&&) noexcept = default;
JobRunner& JobRunner::operator=(JobRunner&&) noexcept = default;

const job::RestartDecision& JobRunner::decision() const noexcept { return program_->decision; }
bool JobRunner::runs() const noexcept { return program_->cycle.has_value(); }
bool JobRunner::finished() const noexcept { return program_->finished(); }
const robot::RobotCommand& JobRunner::command() const noexcept { return program_->command; }

const job::JobState& JobRunner::state() const {
  program_->require_cycle();
  return program_->cycle->state();
}

const robot::RobotReading& JobRunner::reading() const {
  program_->require_cycle();
  return program_->service.reading();
}

const force::InsertionState& JobRunner::insertion() const {
  program_->require_cycle();
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

JobRun JobRunner::result() const { return program_->result(); }

void place_over_bin(sim::WorkCell& cell, const WorkOptions& options) {
  const auto posture = Reach(cell.believed()).posture(options.job.places.T_base_scan);
  require(posture.has_value(), "job.places.T_base_scan: the arm does not reach it; move the bin nearer");
  cell.place(*posture);
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
