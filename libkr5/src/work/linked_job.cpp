// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/linked_job.hpp>

#include <chrono>
#include <optional>
#include <thread>

#include <kr5/cell/sensor_model.hpp>
#include <kr5/core/error.hpp>
#include <kr5/job/journal_writer.hpp>

#include "work/job_program.hpp"

namespace kr5::work {
namespace {

constexpr auto pause = std::chrono::milliseconds(2);
constexpr int pauses_between_words = 300;

}  // namespace

struct LinkedJob::Program : JobProgram {
  Program(sim::WorkCell& given, const WorkOptions& options, const LinkedOptions& linked, job::Journal& to,
          const job::RestartMeasurements& seen, rsi::ExchangeFunction observe, const std::filesystem::path& cell_file)
      : JobProgram(given, options, to, cell_file) {
    linked.validate();
    if (!begin(options, seen)) return;
    writer.emplace(ring, journal);
    const robot::SensorModel model = cell::sensor_model(cell.believed());
    link.emplace(
        linked.layout, model, linked.link,
        [this](const robot::RobotReading& reading) noexcept { return cycle->step(reading); }, std::move(observe));
    emulator.emplace(linked.layout, model, linked.emulator, cell);
  }

  void serve();
  bool lost_link();
  void rest();
  void end();

  std::optional<job::JournalWriter> writer;
  std::optional<rsi::Link> link;
  std::optional<rsi::Emulator> emulator;
  rsi::LinkStatistics link_seen;
  rsi::EmulatorStatistics controller_seen;
  bool met = false;  ///< A controller was there.
};

/// Whether a controller that was there is silent.
bool LinkedJob::Program::lost_link() {
  const rsi::LinkState state = link->statistics().state;
  met = met || state != rsi::LinkState::Waiting;
  return met && state == rsi::LinkState::Waiting;
}

void LinkedJob::Program::serve() {
  if (!link) return;
  service.serve(*cycle);
  const std::string failure = emulator->statistics().failure;
  if (failure.empty() && !lost_link()) return;
  end();
  if (!failure.empty()) throw IoError("controller: it has ended itself: " + failure);
}

/// A program of the controller that has ended stands.
void LinkedJob::Program::rest() {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(lead_rest);
  while (std::chrono::steady_clock::now() < end && link &&
         emulator->statistics().controller.phase != rsi::ControllerPhase::Ended) {
    service.serve(*cycle);
    std::this_thread::sleep_for(pause);
  }
}

/// No thread but this one uses the cycle any more, then none the journal.
void LinkedJob::Program::end() {
  if (!link) return;
  link_seen = link->statistics();
  link.reset();
  controller_seen = emulator->statistics();
  emulator.reset();
  cycle->end();
  service.serve(*cycle);
  writer.reset();
}

LinkedJob::LinkedJob(sim::WorkCell& cell, const WorkOptions& options, const LinkedOptions& linked,
                     job::Journal& journal, const job::RestartMeasurements& seen, rsi::ExchangeFunction observe,
                     const std::filesystem::path& cell_file)
    : program_(std::make_unique<Program>(cell, options, linked, journal, seen, std::move(observe), cell_file)) {}
LinkedJob::~LinkedJob() = default;
LinkedJob::LinkedJob(LinkedJob&&) noexcept = default;

const job::RestartDecision& LinkedJob::decision() const noexcept { return program_->decision; }
bool LinkedJob::runs() const noexcept { return program_->cycle.has_value(); }
bool LinkedJob::finished() const noexcept { return program_->finished(); }

const job::JobState& LinkedJob::state() const {
  program_->require_cycle();
  return program_->service.state();
}

const robot::RobotReading& LinkedJob::reading() const {
  program_->require_cycle();
  return program_->service.reading();
}

void LinkedJob::serve() { program_->serve(); }

LinkedRun LinkedJob::run(const JobProgress& progress) {
  for (int k = 0; !finished(); ++k) {
    serve();
    if (progress && k % pauses_between_words == 0) progress(state());
    std::this_thread::sleep_for(pause);
  }
  program_->rest();
  return end();
}

LinkedRun LinkedJob::end() {
  program_->end();
  return {program_->result(), program_->link_seen, program_->controller_seen};
}

void LinkedJob::stop_by_operator() noexcept {
  if (runs()) program_->cycle->stop_by_operator();
}

std::uint64_t LinkedJob::written() const noexcept { return program_->ring.written(); }

sim::WorkCellState LinkedJob::cell_state() {
  return program_->cell.with_cell([](const sim::WorkCell& cell) { return cell.state(); });
}

sim::WorkCellTruth LinkedJob::cell_truth() {
  return program_->cell.with_cell([](const sim::WorkCell& cell) { return cell.truth(); });
}

rsi::Emulator& LinkedJob::controller() {
  require(program_->emulator.has_value(), "controller: it does not run");
  return *program_->emulator;
}

rsi::LinkStatistics LinkedJob::link_statistics() const {
  return program_->link ? program_->link->statistics() : program_->link_seen;
}

rsi::RealTimeStatus LinkedJob::real_time() const {
  return program_->link ? program_->link->real_time() : rsi::RealTimeStatus();
}

std::string LinkedJob::journal_problem() const {
  return program_->writer ? program_->writer->problem() : std::string();
}

}  // namespace kr5::work
