// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/lockstep_job.hpp>

#include <cmath>
#include <optional>

#include <kr5/cell/sensor_model.hpp>

#include "work/job_program.hpp"

namespace kr5::work {
namespace {

constexpr int cycles_between_words = 50;
constexpr double in_second = 1e9;  // [ns]

}  // namespace

struct LockstepJob::Program : JobProgram {
  Program(sim::WorkCell& given, const WorkOptions& options, const LinkedOptions& with, job::Journal& to,
          const job::RestartMeasurements& seen, Observer look)
      : JobProgram(given, options, to),
        linked((with.validate(), with)),
        observe(std::move(look)),
        model(cell::sensor_model(given.believed())),
        telegrams(linked.emulator.telegram_faults),
        answers(linked.emulator.answer_faults),
        controller(linked.layout, model, linked.emulator.controller, cell) {
    if (!begin(options, seen)) return;
    session.emplace(linked.layout, model, linked.link,
                    [this](const robot::RobotReading& reading) noexcept { return cycle->step(reading); });
  }

  void step();
  void exchange(std::string_view telegram);
  void hear(double until, double since);
  void notice_silence();
  double period() const { return linked.link.cycle; }

  LinkedOptions linked;
  Observer observe;
  robot::SensorModel model;
  rsi::FaultyWay telegrams, answers;
  rsi::EmulatedController controller;
  std::optional<rsi::LinkSession> session;
  std::uint64_t cycles = 0;
  double time = 0.0, heard = 0.0, clock_ahead = 0.0;  ///< [s]
  bool over = false;                                  ///< The job has lost its link.
};

/// Answers that have come by a time, some time after the last telegram [s].
void LockstepJob::Program::hear(double until, double since) {
  for (std::string_view answer = answers.next(until); !answer.empty(); answer = answers.next(until))
    controller.receive(answer, since);
}

void LockstepJob::Program::exchange(std::string_view telegram) {
  heard = time;
  const auto arrival = static_cast<std::int64_t>(std::llround(in_second * (time + clock_ahead)));
  const std::string_view answer = session->answer(telegram, 1, arrival);
  if (!answer.empty()) session->note_sent(true, 0, 0);
  if (!answer.empty()) answers.pass(answer, time);
  service.serve(*cycle);
  const CellPerception& seen = service.perception();
  if (observe) observe({telegram, answer, seen.scan(), seen.hole(), seen.place(), seen.way()});
  write();
}

/// A job whose controller has gone is over, as its link would say.
void LockstepJob::Program::notice_silence() {
  if (over || cycle->finished() || time - heard <= linked.link.silence) return;
  over = true;
  cycle->end();
  service.serve(*cycle);
  write();
}

void LockstepJob::Program::step() {
  hear(time + period(), period());
  time = static_cast<double>(++cycles) * period();
  const std::string_view telegram = controller.cycle();
  if (!telegram.empty()) telegrams.pass(telegram, time);
  const double in_time = time + linked.emulator.controller.rules.answer_time;
  if (!over)
    for (std::string_view here = telegrams.next(in_time); !here.empty(); here = telegrams.next(in_time)) exchange(here);
  hear(in_time, 0.0);
  notice_silence();
}

LockstepJob::LockstepJob(sim::WorkCell& cell, const WorkOptions& options, const LinkedOptions& linked,
                         job::Journal& journal, const job::RestartMeasurements& seen, Observer observe)
    : program_(std::make_unique<Program>(cell, options, linked, journal, seen, std::move(observe))) {}
LockstepJob::~LockstepJob() = default;
LockstepJob::LockstepJob(LockstepJob&&) noexcept = default;

const job::RestartDecision& LockstepJob::decision() const noexcept { return program_->decision; }
bool LockstepJob::runs() const noexcept { return program_->cycle.has_value(); }
bool LockstepJob::finished() const noexcept { return program_->finished(); }

const job::JobState& LockstepJob::state() const {
  program_->require_cycle();
  return program_->cycle->state();
}

void LockstepJob::step() {
  if (runs()) program_->step();
}

LinkedRun LockstepJob::run(const JobProgress& progress) {
  for (int k = 0; !finished(); ++k) {
    step();
    if (progress && k % cycles_between_words == 0) progress(state());
  }
  for (double rest = 0.0; rest < lead_rest; rest += program_->period()) step();
  return result();
}

LinkedRun LockstepJob::result() const {
  LinkedRun out;
  out.job = program_->result();
  if (runs()) out.link = program_->session->statistics();
  out.controller.controller = program_->controller.statistics();
  out.controller.telegram_faults = program_->telegrams.counts();
  out.controller.answer_faults = program_->answers.counts();
  out.controller.connected = true;
  return out;
}

void LockstepJob::stop_by_operator() noexcept {
  if (runs()) program_->cycle->stop_by_operator();
}
void LockstepJob::jump_clock(double time) noexcept { program_->clock_ahead += time; }
rsi::EmulatedController& LockstepJob::controller() noexcept { return program_->controller; }

}  // namespace kr5::work
