// A cycle of the supervisor allocates nothing, in any phase and when it stops.
#ifndef KR5_SANITIZED

#include <cstddef>
#include <set>

#include <catch2/catch.hpp>

#include <kr5/job/supervisor.hpp>

#include "fake_cell.hpp"

namespace {
long job_allocations = 0;
}
// What every allocation comes to, Eigen's and that of operator new.
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++job_allocations;
  return __libc_malloc(size);
}

using namespace kr5;
using namespace kr5::job;
using namespace kr5::test;

namespace job_allocation_test {

TEST_CASE("no cycle of a job allocates, from the look for a pellet that is lost to the stop") {
  FakeCell cell(3, 1);
  RecordRing ring;
  JobOptions options = FakeCell::options(0);
  options.arm = FakeCell::arm();
  RestartDecision start;
  start.status = RestartStatus::Look;
  start.finding = RestartFinding::StationUnseen;
  start.phase = Phase::Look;
  start.interrupted = Phase::Regrip;
  start.pellet = start.tried = 1;
  start.pellet_state = PelletState::Stood;
  Supervisor supervisor(options, start, ring);
  std::set<Phase> phases;
  long allocated = 0;
  for (int k = 0; k < 100000 && !supervisor.finished(); ++k) {
    const robot::RobotReading reading = cell.read();
    if (supervisor.state().inserted == 2) supervisor.stop_by_operator();
    const PerceptionRequest asked = supervisor.request();
    const ScanResult scan = cell.scan(asked.stamp);
    const HoleResult hole = cell.look(asked.stamp);
    const PlaceResult place = cell.place(asked);
    const WayResult way = asked.kind == RequestKind::Way ? FakeCell::way(asked) : WayResult{};
    const long before = job_allocations;
    supervisor.deliver(scan);
    supervisor.deliver(hole);
    supervisor.deliver(place);
    supervisor.deliver(way);
    const robot::RobotCommand command = supervisor.step(reading);
    allocated += job_allocations - before;
    phases.insert(supervisor.state().phase);
    cell.send(command);
    if (const JobRecord* next = ring.after(ring.written())) ring.note_written(next->number);
  }
  CHECK(phases.size() == static_cast<std::size_t>(phase_count) - 1);  // all but done
  CHECK(allocated == 0);
}

}  // namespace job_allocation_test

#endif
