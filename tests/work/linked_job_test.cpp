#include <kr5/work/linked_job.hpp>

#include <chrono>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "linked_cell.hpp"
#include "rsi/plain_controller.hpp"

namespace linked_job_test {

using namespace kr5;
using Catch::Contains;
using test::new_journal;
using test::small_cell;
using namespace std::chrono_literals;

namespace {

/// A job in a small bin, at its beginning, on a machine that may be busy.
struct Begun {
  explicit Begun(std::uint64_t seed) : cell(small_cell(seed)), options(work::work_options(cell)) {
    options.job.pellets = 1;
    linked = work::linked_options(options, cell.believed());
    linked.layout.port = test::free_port(SOCK_DGRAM);
    linked.emulator.controller.rules.max_late = 2000;
    linked.link.silence = 20.0;
    options.job.stop.silence = 20.0;
    options.job.record_time = 20.0;
    work::place_over_bin(cell, options);
  }
  sim::WorkCell cell;
  work::WorkOptions options;
  work::LinkedOptions linked;
};

/// Serves until a condition holds; whether it did in time.
bool serve_until(work::LinkedJob& job, std::chrono::seconds patience, auto condition) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!condition() && !job.finished() && std::chrono::steady_clock::now() < end) {
    job.serve();
    std::this_thread::sleep_for(2ms);
  }
  return condition();
}

}  // namespace

TEST_CASE("a job through sockets brings a pellet into the tube in real time", "[real_time][not_sanitized]") {
  Begun b(831);
  job::Journal journal(new_journal("sockets"), "test");
  work::LinkedJob job(b.cell, b.options, b.linked, journal);
  const work::LinkedRun run = job.run();
  for (const job::JobRecord& r : journal.records())
    UNSCOPED_INFO(r.time << " s: " << name_of(r.kind) << " " << name_of(r.phase) << " after " << name_of(r.outcome)
                         << ", " << name_of(r.pellet_state) << ", stop " << name_of(r.stop));
  UNSCOPED_INFO("overruns " << run.controller.overruns << ", missing " << run.controller.controller.missing << ", late "
                            << run.link.late << ", longest answer " << run.link.answer.max << " s");
  CHECK(run.job.done());
  CHECK(run.job.state.inserted == 1);
  CHECK(run.link.sessions == 1);
  CHECK((run.link.limited == 0 && run.link.refused == 0));
  CHECK(run.job.rows.values.rows() > 500);
  CHECK(journal.belief().inserted == 1);
  test::let_rest(b.cell);
  CHECK(work::judge_job(b.cell).in_tube == 1);
}

TEST_CASE("a link that goes silent stops the job and is written down", "[real_time]") {
  Begun b(832);
  b.linked.link.silence = 0.3;
  b.linked.emulator.controller.rules.max_late = 10;
  b.linked.emulator.telegram_faults.timed = {{.fault = rsi::LinkFault::Lose, .time = 2.0, .count = 100000}};
  job::Journal journal(new_journal("silent"), "test");
  work::LinkedJob job(b.cell, b.options, b.linked, journal);
  const work::LinkedRun run = job.run();
  CHECK(run.job.state.phase == job::Phase::Stopped);
  CHECK(run.job.state.stop == job::StopReason::LostLink);
  CHECK(journal.belief().stop == job::StopReason::LostLink);
  CHECK(run.controller.controller.phase == rsi::ControllerPhase::Ended);
}

TEST_CASE("an emergency stop at the controller latches in the job", "[real_time]") {
  Begun b(833);
  job::Journal journal(new_journal("pressed"), "test");
  work::LinkedJob job(b.cell, b.options, b.linked, journal);
  REQUIRE(serve_until(job, 20s, [&] { return job.state().phase == job::Phase::Scan; }));
  job.controller().emergency_stop();
  const work::LinkedRun run = job.run();
  CHECK(run.job.state.stop == job::StopReason::Robot);
  CHECK(journal.belief().stop == job::StopReason::Robot);
}

TEST_CASE("an operator stops the job, and the controller ends its program", "[real_time]") {
  Begun b(834);
  job::Journal journal(new_journal("asked"), "test");
  work::LinkedJob job(b.cell, b.options, b.linked, journal);
  REQUIRE(serve_until(job, 20s, [&] { return job.state().phase == job::Phase::Scan; }));
  const double before = job.cell_truth().time;
  REQUIRE(serve_until(job, 20s, [&] { return job.cell_truth().time > before; }));
  job.stop_by_operator();
  const work::LinkedRun run = job.run();
  CHECK(run.job.state.stop == job::StopReason::Operator);
  CHECK(run.controller.controller.stop.reason == rsi::ProgramStopReason::Asked);
}

TEST_CASE("a program that is killed leaves a journal from which the next one goes on", "[real_time]") {
  Begun b(835);
  const auto file = new_journal("killed");
  {
    job::Journal journal(file, "test");
    work::LinkedJob job(b.cell, b.options, b.linked, journal);
    REQUIRE(serve_until(job, 20s, [&] { return job.state().phase == job::Phase::Scan; }));
  }
  job::Journal journal(file, "test");
  work::LinkedJob job(b.cell, b.options, b.linked, journal);
  CHECK(job.decision().status == job::RestartStatus::Continue);
  const Eigen::Vector3d before = b.cell.truth().T_base_tool.translation();
  REQUIRE(serve_until(job, 20s, [&] { return job.link_statistics().answered > 3; }));
  CHECK((job.controller().reading().T_base_tool.translation() - before).norm() < 5e-4);
  CHECK(job.end().link.refused == 0);
}

TEST_CASE("a port that another program has is refused") {
  Begun b(836);
  const rsi::Link other(b.linked.layout, {}, b.linked.link, {});
  job::Journal journal(new_journal("port"), "test");
  CHECK_THROWS_WITH(work::LinkedJob(b.cell, b.options, b.linked, journal),
                    Contains(std::to_string(b.linked.layout.port)));
}

}  // namespace linked_job_test
