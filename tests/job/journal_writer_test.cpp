#include <kr5/job/journal_writer.hpp>

#include <chrono>
#include <csignal>
#include <thread>

#include <sys/resource.h>
#include <catch2/catch.hpp>

#include "job_run.hpp"

namespace journal_writer_test {

using namespace kr5;
using namespace kr5::job;
using namespace kr5::test;
using Catch::Matchers::Contains;

/// Files grow no further while it lives, as on a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t most) : former_(std::signal(SIGXFSZ, SIG_IGN)) {
    getrlimit(RLIMIT_FSIZE, &limit_);
    const rlimit small = {most, limit_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &limit_);
    std::signal(SIGXFSZ, former_);
  }
  FullDisk(const FullDisk&) = delete;

 private:
  void (*former_)(int);
  rlimit limit_{};
};

TEST_CASE("a disk that takes nothing more stops the arm, and nothing that was written is lost") {
  Folder folder;
  FakeCell cell(2, 1);
  Program program(cell, folder / "job.db", FakeCell::options(2));
  program.run([&] { return program.supervisor().state().phase == Phase::Stand; });
  const std::size_t before = program.journal().records().size();
  {
    const FullDisk full(1024);
    program.run();
  }
  CHECK(program.supervisor().state().stop == StopReason::Journal);
  CHECK(program.command().stop);
  CHECK_THAT(program.problem(), Contains("job.db: cannot be"));
  program.write();  // there is room again
  const std::vector<JobRecord> records = program.journal().records();
  REQUIRE(records.size() > before);
  CHECK(records.back().kind == RecordKind::Stop);
  CHECK(records.back().stop == StopReason::Journal);
}

TEST_CASE("a thread writes what comes, and says what it could not write") {
  Folder folder;
  Journal journal(folder / "job.db", "a");
  const auto ring = std::make_unique<RecordRing>();
  {
    const JournalWriter writer(*ring, journal);
    for (int k = 0; k < 20; ++k) ring->push({});
    for (int k = 0; k < 5000 && ring->written() < 20; ++k) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    CHECK(ring->written() == 20);
    CHECK(writer.problem().empty());
    const FullDisk full(1024);
    ring->push({});
    for (int k = 0; k < 5000 && writer.problem().empty(); ++k)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    CHECK_THAT(writer.problem(), Contains("cannot be"));
    CHECK(ring->failed());
  }
  CHECK(journal.last_number() == 21);  // the last look, with room again
}

}  // namespace journal_writer_test
