// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/fault_trials.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/work/lockstep_job.hpp>

namespace kr5::work {
namespace {

constexpr int longest_job = 20'000;      // cycles
constexpr int rest_cycles = 50;          // given to an arm that is stopped, and then watched for as long
constexpr double at_rest = 5e-4;         // way in that time [m]
constexpr int repair_cycles = 40;        // after which drives are switched on again
constexpr double longest_delay = 0.1;    // [s]
constexpr double longest_jump = 3600.0;  // [s]

/// A fault, and when it comes.
struct Injection {
  TrialFault fault = TrialFault::Late;
  int cycle = 0;
  bool of_answers = false;
  int messages = 1;
  double delay = 0.0;  ///< [s]
  double jump = 0.0;   ///< [s]
};

std::optional<rsi::LinkFault> network_fault(TrialFault fault) {
  switch (fault) {
    case TrialFault::Late:
      return rsi::LinkFault::Late;
    case TrialFault::Lost:
      return rsi::LinkFault::Lose;
    case TrialFault::Doubled:
      return rsi::LinkFault::Double;
    case TrialFault::Reordered:
      return rsi::LinkFault::Reorder;
    case TrialFault::Truncated:
      return rsi::LinkFault::Truncate;
    default:
      return std::nullopt;
  }
}

/// The force on the tool, cycle by cycle.
struct ForceWatch {
  double limit = 0.0;  ///< [N]
  double max = 0.0;    ///< [N]
  int above = 0, most_above = 0;

  void step(const sim::WorkCell& cell) {
    const double force = cell.truth().contact.head<3>().norm();
    max = std::max(max, force);
    above = force > limit ? above + 1 : 0;
    most_above = std::max(most_above, above);
  }
};

/// A job that has come to the tube, from where each trial begins.
class TrialBench {
 public:
  TrialBench(const cell::Cell& cell, const sim::WorkCellOptions& bin, const std::filesystem::path& folder)
      : cell_(cell, bin), folder_(folder), options_(work_options(cell_)) {
    options_.job.pellets = 1;
    linked_ = linked_options(options_, cell_.believed());
    place_over_bin(cell_, options_);
    bring_to_tube();
    find_instants();
  }

  Injection draw(TrialFault fault, Random& random, int most_messages) const;
  void run(const Injection& injection, FaultRow& row);

 private:
  void bring_to_tube();
  void find_instants();
  void begin_again();
  job::Journal journal(const char* name) const { return {folder_ / name, "trial"}; }
  LinkedOptions with(const Injection& injection) const;
  void inject(const Injection& injection, int cycle, LockstepJob& job) const;
  void judge_stop(LockstepJob& job, job::Journal& journal, ForceWatch& force, FaultRow& row);
  bool agrees(const job::Journal& journal) const;

  sim::WorkCell cell_;
  std::filesystem::path folder_;
  WorkOptions options_;
  LinkedOptions linked_;
  std::optional<sim::WorkCellState> at_tube_;
  int first_ = 0, last_ = 0;  ///< Cycles of the insertion, from the beginning of a trial.
};

void TrialBench::bring_to_tube() {
  std::filesystem::remove(folder_ / "begin.db");
  job::Journal records = journal("begin.db");
  LockstepJob job(cell_, options_, linked_, records);
  for (int k = 0; k < longest_job && !job.finished() && job.state().phase != job::Phase::Search; ++k) job.step();
  require(job.state().phase == job::Phase::Search, "bin: its pellet does not come to the tube without faults");
  at_tube_ = cell_.state();
}

/// Cell and journal are as they were when the pellet had come to the tube.
void TrialBench::begin_again() {
  cell_.restore(*at_tube_);
  std::filesystem::copy_file(folder_ / "begin.db", folder_ / "trial.db",
                             std::filesystem::copy_options::overwrite_existing);
}

void TrialBench::find_instants() {
  begin_again();
  job::Journal records = journal("trial.db");
  LockstepJob job(cell_, options_, linked_, records);
  for (int k = 0; k < longest_job && !job.finished(); ++k) {
    job.step();
    const job::Phase phase = job.state().phase;
    if (phase != job::Phase::Search && phase != job::Phase::Insert) continue;
    if (first_ == 0) first_ = k;
    last_ = k;
  }
  require(job.state().phase == job::Phase::Done, "bin: its pellet is not inserted without faults");
}

Injection TrialBench::draw(TrialFault fault, Random& random, int most_messages) const {
  Injection out{.fault = fault};
  out.cycle = first_ + random.integer(last_ - first_ + 1);
  out.of_answers = random.integer(2) == 0;
  out.messages = 1 + random.integer(most_messages);
  out.delay = random.uniform(linked_.link.cycle, longest_delay);
  out.jump = random.uniform(1.0, longest_jump);
  return out;
}

LinkedOptions TrialBench::with(const Injection& injection) const {
  LinkedOptions out = linked_;
  const std::optional<rsi::LinkFault> fault = network_fault(injection.fault);
  if (!fault) return out;
  rsi::LinkFaults& way = injection.of_answers ? out.emulator.answer_faults : out.emulator.telegram_faults;
  way.delay = injection.delay;
  way.timed = {{.fault = *fault, .time = injection.cycle * out.link.cycle, .count = injection.messages}};
  return out;
}

void TrialBench::inject(const Injection& injection, int cycle, LockstepJob& job) const {
  const int since = cycle - injection.cycle;
  if (since == repair_cycles) job.controller().set_drives(true);  // a person is quick with it
  if (since != 0) return;
  if (injection.fault == TrialFault::EmergencyStop) job.controller().emergency_stop();
  if (injection.fault == TrialFault::DrivesOff) job.controller().set_drives(false);
  if (injection.fault == TrialFault::Restart) job.controller().reset_program();
  if (injection.fault == TrialFault::ClockJump) job.jump_clock(injection.jump);
}

bool TrialBench::agrees(const job::Journal& journal) const {
  const JobTruth truth = judge_job(cell_);
  return truth.lost == 0 && truth.in_tube == journal.belief().inserted;
}

/// The arm must stand; a person releases the stop, and the job must come to its end.
void TrialBench::judge_stop(LockstepJob& job, job::Journal& journal, ForceWatch& force, FaultRow& row) {
  ++row.stopped;
  for (int k = 0; k < rest_cycles; ++k) job.step(), force.step(cell_);
  const Eigen::Vector3d before = cell_.truth().T_base_tool.translation();
  for (int k = 0; k < rest_cycles; ++k) job.step(), force.step(cell_);
  row.moving += (cell_.truth().T_base_tool.translation() - before).norm() > at_rest;
  journal.release("a person");
  LockstepJob again(cell_, options_, linked_, journal);
  if (again.runs()) again.run();
  row.resumed += again.decision().status == job::RestartStatus::Finished ||
                 (again.runs() && again.state().phase == job::Phase::Done);
}

void TrialBench::run(const Injection& injection, FaultRow& row) {
  begin_again();
  job::Journal records = journal("trial.db");
  LockstepJob job(cell_, options_, with(injection), records);
  ForceWatch force{.limit = options_.job.insertion.limits.force};
  for (int k = 0; k < longest_job && !job.finished(); ++k) {
    inject(injection, k, job);
    job.step();
    if (k >= injection.cycle) force.step(cell_);
  }
  ++row.trials;
  if (job.state().phase == job::Phase::Done)
    ++row.continued;
  else
    judge_stop(job, records, force, row);
  row.max_force = std::max(row.max_force, force.max);
  row.over_limit += force.most_above > 1;
  for (int k = 0; k < rest_cycles; ++k) cell_.read(), cell_.send({});  // a pellet may still fall
  row.astray += !agrees(records);
}

}  // namespace

void FaultTrialOptions::validate() const {
  require(trials >= 1 && trials <= 100'000, "trials must lie between 1 and 100000");
  require(messages >= 1 && messages <= 10'000, "messages must lie between 1 and 10000");
}

std::vector<FaultRow> run_fault_trials(const cell::Cell& cell, const sim::WorkCellOptions& bin,
                                       const std::filesystem::path& folder, const FaultTrialOptions& options,
                                       const TrialProgress& progress) {
  options.validate();
  TrialBench bench(cell, bin, folder);
  Random random(options.seed);
  std::vector<FaultRow> out;
  const auto faults = enum_names(TrialFault{});
  const double all = static_cast<double>(options.trials) * static_cast<double>(std::size(faults));
  int done = 0;
  for (const auto& [fault, name] : faults) {
    out.push_back({.fault = fault});
    for (int trial = 0; trial < options.trials; ++trial) {
      bench.run(bench.draw(fault, random, options.messages), out.back());
      if (progress) progress(++done / all);
    }
  }
  return out;
}

}  // namespace kr5::work
