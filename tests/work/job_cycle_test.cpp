#include <kr5/work/job_cycle.hpp>

#include <atomic>
#include <cstddef>
#include <string>
#include <thread>

#include <catch2/catch.hpp>

#include <kr5/job/journal_writer.hpp>
#include <kr5/work/arm_ways.hpp>
#include <kr5/work/job_runner.hpp>

#include "linked_cell.hpp"

#ifndef KR5_SANITIZED
namespace {
long work_allocations = 0;
}
// What every allocation comes to, Eigen's and that of operator new.
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++work_allocations;
  return __libc_malloc(size);
}
#endif

namespace job_cycle_test {

using namespace kr5;
using test::new_journal;
using test::small_cell;

namespace {

/// A cycle in a cell, with its journal.
struct Begun {
  explicit Begun(const std::string& name)
      : cell(small_cell(861)), options(work::work_options(cell)), journal(new_journal(name), "test") {
    work::place_over_bin(cell, options);
    const job::RestartDecision start =
        job::decide_restart(journal.belief(), {.reading = cell.read()}, work::restart_options(options));
    cycle.emplace(options, start, cell.believed(), ring);
  }
  void step() {
    cell.send(cycle->step(cell.read()));
    std::string problem;
    REQUIRE(job::write_records(ring, journal, problem));
  }
  /// What is asked for, ways apart, which are delivered.
  std::optional<work::LookRequest> take_request() {
    const auto asked = cycle->take_request();
    if (!asked || asked->request.kind != job::RequestKind::Way) return asked;
    CHECK(cycle->deliver(work::plan_way(asked->request, cell.believed(), asked->joints, options)));
    return std::nullopt;
  }
  sim::WorkCell cell;
  work::WorkOptions options;
  job::Journal journal;
  job::RecordRing ring;
  std::optional<work::JobCycle> cycle;
};

}  // namespace

#ifndef KR5_SANITIZED
TEST_CASE("a cycle of a job allocates nothing, with a scan that is delivered in it, either") {
  Begun b("allocation");
  long allocated = 0;
  bool delivered = false;
  for (int k = 0; k < 900 && !delivered; ++k) {
    if (const auto asked = b.take_request(); asked && asked->request.kind == job::RequestKind::Scan) {
      job::ScanResult scan;
      scan.stamp = asked->request.stamp;
      scan.bin_empty = true;
      delivered = b.cycle->deliver(scan);
    }
    const robot::RobotReading reading = b.cell.read();
    const long before = work_allocations;
    const robot::RobotCommand command = b.cycle->step(reading);
    allocated += work_allocations - before;
    b.cell.send(command);
    std::string problem;
    REQUIRE(job::write_records(b.ring, b.journal, problem));
  }
  CHECK(delivered);
  CHECK(allocated == 0);
}
#endif

TEST_CASE("a request is told once, and what is delivered counts in the next cycle") {
  Begun b("request");
  std::optional<work::LookRequest> asked;
  for (int k = 0; k < 900 && !(asked && asked->request.kind == job::RequestKind::Scan); ++k) {
    b.step();
    if (const auto next = b.take_request()) asked = next;
  }
  REQUIRE((asked && asked->request.kind == job::RequestKind::Scan));
  CHECK((asked->T_base_flange.translation() - b.cell.read().T_base_flange.translation()).norm() < 1e-3);
  b.step();
  CHECK_FALSE(b.cycle->take_request());
  job::ScanResult old;
  old.stamp = asked->request.stamp - 1;
  CHECK(b.cycle->deliver(old));
  CHECK_FALSE(b.cycle->deliver(old));  // the first has not been taken
  b.step();
  CHECK(b.cycle->state().phase == job::Phase::Scan);  // nobody asked for it
  job::ScanResult empty;
  empty.stamp = asked->request.stamp;
  empty.bin_empty = true;
  CHECK(b.cycle->deliver(empty));
  for (int k = 0; k < 3; ++k) b.step();
  CHECK(b.cycle->state().attempt == 2);  // an empty bin is looked at from the other side
}

TEST_CASE("another thread takes every row in order while the cycle goes on") {
  Begun b("rows");
  constexpr int cycles = 400;
  double last = -1.0;
  int rows = 0;
  bool rises = true;
  std::atomic<bool> over = false;
  std::thread taker([&] {
    for (bool again = true; again;) {
      again = !over;
      b.cycle->take_rows([&](const work::CycleRow& row) {
        rises = rises && row.reading.time > last;
        last = row.reading.time;
        ++rows;
      });
    }
  });
  for (int k = 0; k < cycles; ++k) b.step();
  over = true;
  taker.join();
  CHECK(rows == cycles);
  CHECK(rises);
  CHECK(b.cycle->lost_rows() == 0);
}

TEST_CASE("a cycle that ends before its job has lost its link, which is written down") {
  Begun b("end");
  for (int k = 0; k < 50; ++k) b.step();
  b.cycle->end();
  CHECK(b.cycle->finished());
  CHECK(b.cycle->state().stop == job::StopReason::LostLink);
  std::string problem;
  REQUIRE(job::write_records(b.ring, b.journal, problem));
  CHECK(b.journal.belief().stop == job::StopReason::LostLink);
}

}  // namespace job_cycle_test
