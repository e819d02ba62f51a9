// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/job_runner.hpp>

#include <optional>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/job/journal_writer.hpp>
#include <kr5/kinematics/inverse.hpp>
#include <kr5/vision/render.hpp>
#include <kr5/work/plan_work.hpp>

#include "work/job_rows.hpp"

namespace kr5::work {
namespace {

constexpr int told_every = 50;  // cycles between two words of progress

picking::Cloud cloud_of(const sim::BinScan& scan) {
  picking::Cloud out;
  out.points = scan.cloud().transpose();
  out.origins = scan.origins().transpose();
  return out;
}

vision::Image photograph(const sim::WorkCell& cell, int number) {
  const predict::CameraScene scene = cell.picture();
  vision::RenderOptions options;
  options.oversampling = 4;
  options.noise = cell.options().noise ? 1.0 : 0.0;
  options.seed = static_cast<int>(cell.options().seed) + number;
  return vision::render(scene.targets, scene.solids, scene.lens, options);
}

bool can_run(const job::RestartDecision& decision) noexcept {
  return decision.status == job::RestartStatus::Fresh || decision.status == job::RestartStatus::Continue;
}

}  // namespace

struct JobRunner::Program {
  Program(sim::WorkCell& given, const WorkOptions& with, job::Journal& to, job::RestartMeasurements seen)
      : cell(given), options(with), journal(to), rows(given.believed().robot.joints()) {
    options.validate();
    ring.begin_after(journal.last_number());
    seen.reading = cell.read();
    decision = job::decide_restart(journal.belief(), seen, restart_options(options));
    if (can_run(decision)) controller.emplace(options.job, decision, cell.believed(), ring);
  }

  void step();
  void answer(const robot::RobotReading& reading);
  void write();

  sim::WorkCell& cell;
  WorkOptions options;
  job::Journal& journal;
  job::RecordRing ring;
  job::RestartDecision decision;
  std::optional<WorkController> controller;
  robot::RobotCommand command;
  JobRows rows;
  std::int64_t swept = -1;  ///< Stamp of the last sweep that was begun.
  int pictures = 0;
};

void JobRunner::Program::write() {
  std::string problem;
  job::write_records(ring, journal, problem);
  if (!problem.empty()) throw IoError(problem);
}

/// What is asked for is answered before the next cycle: the arm stands meanwhile.
void JobRunner::Program::answer(const robot::RobotReading& reading) {
  const job::PerceptionRequest asked = controller->supervisor().request();
  if (asked.kind == job::RequestKind::Sweep && asked.stamp != swept) {
    swept = asked.stamp;
    cell.start_scan();
  } else if (asked.kind == job::RequestKind::Scan) {
    job::ScanResult result = plan_work(cloud_of(cell.finish_scan(sim::ScanPlace::Bin)), cell.believed(), options);
    result.stamp = asked.stamp;
    controller->supervisor().deliver(result);
  } else if (asked.kind == job::RequestKind::Hole) {
    job::HoleResult result = find_tube(photograph(cell, ++pictures), cell.believed(), reading.T_base_flange, options);
    result.stamp = asked.stamp;
    controller->supervisor().deliver(result);
  }
}

void JobRunner::Program::step() {
  const robot::RobotReading reading = cell.read();
  command = controller->step(reading);
  rows.add(reading, controller->setpoint(), command.gripper, controller->supervisor().state(),
           controller->supervisor().insertion().attempt);
  answer(reading);
  cell.send(command);
  write();
}

JobRunner::JobRunner(sim::WorkCell& cell, const WorkOptions& options, job::Journal& journal,
                     const job::RestartMeasurements& seen)
    : program_(std::make_unique<Program>(cell, options, journal, seen)) {}
JobRunner::~JobRunner() = default;
JobRunner::JobRunner(JobRunner&&) noexcept = default;
JobRunner& JobRunner::operator=(JobRunner&&) noexcept = default;

const job::RestartDecision& JobRunner::decision() const noexcept { return program_->decision; }
bool JobRunner::runs() const noexcept { return program_->controller.has_value(); }
bool JobRunner::finished() const noexcept { return !runs() || program_->controller->supervisor().finished(); }
const robot::RobotCommand& JobRunner::command() const noexcept { return program_->command; }

const job::JobState& JobRunner::state() const {
  require(runs(), "job: it cannot go on: " + std::string(name_of(decision().status)));
  return program_->controller->supervisor().state();
}

const force::InsertionState& JobRunner::insertion() const {
  require(runs(), "job: it cannot go on: " + std::string(name_of(decision().status)));
  return program_->controller->supervisor().insertion();
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

JobRun JobRunner::result() const {
  JobRun out;
  out.decision = decision();
  if (runs()) out.state = state();
  out.rows = program_->rows.table();
  out.statistics = job::job_statistics(program_->journal.records(), program_->rows.samples());
  return out;
}

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
