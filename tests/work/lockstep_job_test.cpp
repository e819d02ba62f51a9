#include <kr5/work/lockstep_job.hpp>

#include <string>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/cell/sensor_model.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/job/journal_writer.hpp>
#include <kr5/work/job_cycle.hpp>

#include "linked_cell.hpp"

namespace lockstep_job_test {

using namespace kr5;
using Catch::Contains;
using test::new_journal;
using test::small_cell;

namespace {

/// A job in a small bin, at its beginning.
struct Begun {
  explicit Begun(std::uint64_t seed, int pellets = 1) : cell(small_cell(seed)), options(work::work_options(cell)) {
    options.job.pellets = pellets;
    linked = work::linked_options(options, cell.believed());
    work::place_over_bin(cell, options);
  }
  sim::WorkCell cell;
  work::WorkOptions options;
  work::LinkedOptions linked;
};

void until(work::LockstepJob& job, job::Phase phase, int most = 6000) {
  for (int k = 0; k < most && !job.finished() && job.state().phase != phase; ++k) job.step();
  REQUIRE(job.state().phase == phase);
}

void cycles(work::LockstepJob& job, int count) {
  for (int k = 0; k < count; ++k) job.step();
}

/// How far the arm goes in some cycles, as it is measured.
double way_in(work::LockstepJob& job, const sim::WorkCell& cell, int count) {
  const Eigen::Vector3d before = cell.truth().T_base_tool.translation();
  cycles(job, count);
  return (cell.truth().T_base_tool.translation() - before).norm();
}

}  // namespace

TEST_CASE("a job through a link brings the pellets of a small bin into the tube", "[long][not_sanitized]") {
  const std::uint64_t seed = GENERATE(as<std::uint64_t>{}, 9411, 9412);
  Begun b(seed, 3);
  job::Journal journal(new_journal("whole"), "test");
  work::LockstepJob job(b.cell, b.options, b.linked, journal);
  const work::LinkedRun run = job.run();
  for (const job::JobRecord& r : journal.records())
    UNSCOPED_INFO(r.time << " s, pellet " << r.pellet << ": " << name_of(r.kind) << " " << name_of(r.phase) << " after "
                         << name_of(r.outcome) << ", " << name_of(r.pellet_state) << ", stop " << name_of(r.stop));
  UNSCOPED_INFO("controller: " << name_of(run.controller.controller.stop.reason) << ", limited " << run.link.limited
                               << ", refused " << run.link.refused);
  CHECK(run.job.done());
  CHECK(run.job.state.inserted == 3);
  test::let_rest(b.cell);
  CHECK(work::judge_job(b.cell).in_tube == 3);
  CHECK(run.job.statistics.peak_force < b.options.job.insertion.limits.force);
  CHECK((run.link.limited == 0 && run.link.refused == 0 && run.link.lost == 0));
  CHECK(run.controller.controller.missing == 0);
}

TEST_CASE("equal telegrams and deliveries give answers that are equal, byte by byte") {
  struct Told {
    std::string telegram, answer;
    std::optional<job::ScanResult> scan;
    std::optional<job::HoleResult> hole;
    std::optional<job::WayResult> way;
  };
  std::vector<Told> told;
  Begun b(813);
  {
    job::Journal journal(new_journal("told"), "test");
    work::LockstepJob job(b.cell, b.options, b.linked, journal, {}, [&](const work::LockstepExchange& e) {
      told.push_back({std::string(e.telegram), std::string(e.answer), {}, {}, {}});
      if (e.scan) told.back().scan = *e.scan;
      if (e.hole) told.back().hole = *e.hole;
      if (e.way) told.back().way = *e.way;
    });
    until(job, job::Phase::Regrip);
  }
  job::Journal journal(new_journal("again"), "test");
  job::RecordRing ring;
  sim::WorkCell other = small_cell(813);
  work::place_over_bin(other, b.options);
  const job::RestartDecision start =
      job::decide_restart(journal.belief(), {.reading = other.read()}, work::restart_options(b.options));
  work::JobCycle cycle(b.options, start, other.believed(), ring);
  rsi::LinkSession session(b.linked.layout, cell::sensor_model(other.believed()), b.linked.link,
                           [&](const robot::RobotReading& r) noexcept { return cycle.step(r); });
  std::int64_t arrival = 0;
  std::size_t equal = 0, delivered = 0;
  for (const Told& t : told) {
    equal += session.answer(t.telegram, 1, arrival += 12'000'000) == t.answer;
    if (t.scan) delivered += cycle.deliver(*t.scan);
    if (t.hole) delivered += cycle.deliver(*t.hole);
    if (t.way) delivered += cycle.deliver(*t.way);
    std::string problem;
    REQUIRE(job::write_records(ring, journal, problem));
  }
  CHECK(told.size() > 300);
  CHECK(delivered > 0);
  CHECK(equal == told.size());
}

TEST_CASE("the first answer moves nothing, and the first command is where the arm is measured") {
  Begun b(814);
  job::Journal journal(new_journal("first"), "test");
  work::LockstepJob job(b.cell, b.options, b.linked, journal);
  CHECK(way_in(job, b.cell, 5) < 2e-4);
  CHECK(job.controller().correction().tool().translation().norm() < 1e-4);  // noise of the encoders
}

TEST_CASE("every controller scans the bin through its telegrams") {
  const rsi::Controller controller = GENERATE(rsi::Controller::Krc2, rsi::Controller::Krc4Rsi3, rsi::Controller::Krc4,
                                              rsi::Controller::Krc5, rsi::Controller::Iiqka);
  Begun b(822);
  b.linked = work::linked_options(b.options, b.cell.believed(), controller);
  job::Journal journal(new_journal("controllers"), "test");
  work::LockstepJob job(b.cell, b.options, b.linked, journal);
  INFO(name_of(controller));
  until(job, job::Phase::Pick);
  const work::LinkedRun run = job.result();
  CHECK((run.link.limited == 0 && run.link.refused == 0 && run.link.lost == 0));
  CHECK(run.controller.controller.missing == 0);
}

TEST_CASE("a link that loses answers for longer than the controller bears stops arm and job") {
  Begun b(815);
  b.linked.emulator.answer_faults.timed = {{.fault = rsi::LinkFault::Lose, .time = 2.0, .count = 100000}};
  job::Journal journal(new_journal("lost"), "test");
  work::LockstepJob job(b.cell, b.options, b.linked, journal);
  const work::LinkedRun run = job.run();
  CHECK(run.controller.controller.stop.reason == rsi::ProgramStopReason::LateAnswers);
  CHECK(run.job.state.phase == job::Phase::Stopped);
  CHECK(run.job.state.stop == job::StopReason::LostLink);
  CHECK(journal.belief().stop == job::StopReason::LostLink);
  cycles(job, 100);
  CHECK(way_in(job, b.cell, 100) < 2e-4);
}

TEST_CASE("an emergency stop latches, also over a restart of the program, until a person releases it") {
  Begun b(816);
  const auto file = new_journal("emergency");
  {
    job::Journal journal(file, "test");
    work::LockstepJob job(b.cell, b.options, b.linked, journal);
    until(job, job::Phase::Scan);
    cycles(job, 60);
    job.controller().emergency_stop();
    const work::LinkedRun run = job.run();
    CHECK(run.job.state.stop == job::StopReason::Robot);
    cycles(job, 50);
    CHECK(way_in(job, b.cell, 50) < 2e-4);
    job.controller().set_drives(true);  // nothing of what was asked for before is made up for
    CHECK(way_in(job, b.cell, 100) < 2e-4);
    CHECK(job.controller().statistics().stop.reason == rsi::ProgramStopReason::Asked);
  }
  {
    job::Journal journal(file, "test");
    work::LockstepJob job(b.cell, b.options, b.linked, journal);
    CHECK_FALSE(job.runs());
    CHECK(job.decision().status == job::RestartStatus::Latched);
    journal.release("a person");
  }
  job::Journal journal(file, "test");
  work::LockstepJob job(b.cell, b.options, b.linked, journal);
  CHECK(job.runs());
  CHECK(way_in(job, b.cell, 5) < 2e-4);
}

TEST_CASE("a controller that restarts amid a job moves nothing until a person has released the stop") {
  Begun b(817);
  b.linked.emulator.controller.rules.first_ipoc = 5000;
  job::Journal journal(new_journal("restarted"), "test");
  work::LockstepJob job(b.cell, b.options, b.linked, journal);
  until(job, job::Phase::Scan);
  cycles(job, 120);  // stamps go on for more than a second, so that they are seen to begin anew
  job.controller().reset_program();
  const work::LinkedRun run = job.run();
  CHECK(run.link.sessions == 2);
  CHECK(run.link.state == rsi::LinkState::Holding);
  CHECK(run.job.state.stop == job::StopReason::Robot);
  CHECK(way_in(job, b.cell, 50) < 2e-4);
}

TEST_CASE("a stop by the operator ends the motion within two cycles") {
  Begun b(818);
  job::Journal journal(new_journal("operator"), "test");
  work::LockstepJob job(b.cell, b.options, b.linked, journal);
  until(job, job::Phase::Scan);
  cycles(job, 60);
  job.stop_by_operator();
  cycles(job, 2);
  CHECK(job.state().stop == job::StopReason::Operator);
  CHECK(job.controller().statistics().stop.reason == rsi::ProgramStopReason::Asked);
  cycles(job, 50);
  CHECK(way_in(job, b.cell, 50) < 2e-4);
}

TEST_CASE("a clock that jumps makes the link hold, and the job stop") {
  Begun b(819);
  job::Journal journal(new_journal("clock"), "test");
  work::LockstepJob job(b.cell, b.options, b.linked, journal);
  until(job, job::Phase::Scan);
  cycles(job, 60);
  job.jump_clock(3600.0);
  const work::LinkedRun run = job.run();
  CHECK(run.job.state.stop == job::StopReason::Robot);
}

TEST_CASE("a job through a link that is killed goes on from its journal, or says what must be seen first",
          "[long][not_sanitized]") {
  const std::uint64_t seed = GENERATE(as<std::uint64_t>{}, 9421, 9422, 9423, 9424);
  Begun b(seed);
  const auto file = new_journal("killed");
  Random random(seed);
  const int kill = 200 + random.integer(1000);
  {
    job::Journal journal(file, "test");
    work::LockstepJob job(b.cell, b.options, b.linked, journal);
    cycles(job, kill);
  }
  job::Journal journal(file, "test");
  work::LockstepJob job(b.cell, b.options, b.linked, journal);
  INFO("killed in cycle " << kill << ": " << name_of(job.decision().status) << ", " << name_of(job.decision().finding));
  CHECK(job.decision().status != job::RestartStatus::Contradiction);
  CHECK(job.decision().status != job::RestartStatus::Fresh);
  if (!job.runs()) return;
  const work::LinkedRun run = job.run();
  std::string told;  // where it fails, the records say why
  for (const job::JobRecord& r : journal.records())
    told += std::string(name_of(r.kind)) + " " + std::string(name_of(r.phase)) + " " + std::string(name_of(r.outcome)) +
            " " + std::string(name_of(r.pellet_state)) + "\n";
  INFO(told << "stop: " << name_of(run.job.state.stop) << ", " << name_of(run.job.state.cell_fault));
  // A program that begins while the arm still brakes feels its inertia, and leaves it to a person.
  if (run.job.state.stop == job::StopReason::CellFault) {
    CHECK(run.job.state.cell_fault == job::CellFault::Loaded);
    return;
  }
  CHECK(run.job.done());
  CHECK(run.job.state.inserted == 1);
}

TEST_CASE("two ends that do not agree are refused with the field") {
  Begun b(820);
  job::Journal journal(new_journal("refused"), "test");
  const auto refused = [&](auto change, const std::string& word) {
    work::LinkedOptions linked = b.linked;
    change(linked);
    CHECK_THROWS_WITH(work::LockstepJob(b.cell, b.options, linked, journal), Contains(word));
  };
  refused([](auto& l) { l.link.cycle = 0.004; }, "link.cycle");
  refused([](auto& l) { l.link.mode = robot::CommandMode::Relative; }, "link.mode");
  refused([](auto& l) { l.link.frame = robot::CommandFrame::Tool; }, "link.frame");
  refused([](auto& l) { l.layout.port = 0; }, "port");
  refused(
      [](auto& l) {
        rsi::ControllerRules& rules = l.emulator.controller.rules;
        l.link.cycle = rules.cycle = rules.answer_time = 0.004;
      },
      "rules.cycle");
  work::WorkOptions far = b.options;
  far.job.places.T_base_tube.translation().x() += 5.0;
  CHECK_THROWS_WITH(work::linked_options(far, b.cell.believed()), Contains("job.places"));
}

TEST_CASE("the program of a real controller has the limits of the link") {
  const Begun b(821);
  const rsi::ProgramOptions program = work::program_options(b.linked);
  const rsi::ControllerRules& rules = b.linked.emulator.controller.rules;
  CHECK((program.timeout == rules.max_late && program.translation_limit == rules.translation_limit));
  CHECK(program.translation_limit >= b.linked.link.limits.translation.total);
  CHECK_NOTHROW(rsi::controller_files(b.linked.layout, program));
}

}  // namespace lockstep_job_test
