#include <kr5/job/journal.hpp>

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>
#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "job_run.hpp"

namespace journal_test {

using namespace kr5;
using namespace kr5::job;
using namespace kr5::test;
using Catch::Matchers::Contains;
using Catch::Matchers::EndsWith;

JobRecord record(std::uint64_t number, RecordKind kind = RecordKind::Enter) {
  JobRecord out;
  out.number = number;
  out.time = 0.1 * static_cast<double>(number);
  out.kind = kind;
  out.phase = Phase::Stand;
  out.outcome = Outcome::Gripped;
  out.pellet = 3;
  out.pellet_state = PelletState::Picked;
  out.attempt = 2;
  out.station.put << 0.1, 0.2, 0.3, 0.4, 0.5, 0.6;
  out.station.take = -out.station.put;
  out.station.second_put = 2 * out.station.put;
  out.station.second_take = 3 * out.station.put;
  out.station.visits = 2;
  out.station.visit = 1;
  return out;
}

JobRecord stop_record(std::uint64_t number) {
  JobRecord out = record(number, RecordKind::Stop);
  out.stop = StopReason::Force;
  return out;
}

std::string problem_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const IoError& e) {
    return e.what();
  }
  return "";
}

TEST_CASE("what was appended is there again, to the last bit") {
  Folder folder;
  const std::vector<JobRecord> in = {record(1), record(2), stop_record(3)};
  { Journal(folder / "job.db", "a").append(in); }
  Journal again(folder / "job.db", "a");
  const std::vector<JobRecord> out = again.records();
  REQUIRE(out.size() == in.size());
  for (std::size_t k = 0; k < in.size(); ++k) {
    CHECK(out[k].number == in[k].number);
    CHECK(out[k].time == in[k].time);
    CHECK(out[k].kind == in[k].kind);
    CHECK(out[k].phase == in[k].phase);
    CHECK(out[k].outcome == in[k].outcome);
    CHECK(out[k].pellet == in[k].pellet);
    CHECK(out[k].pellet_state == in[k].pellet_state);
    CHECK(out[k].attempt == in[k].attempt);
    CHECK(out[k].stop == in[k].stop);
    CHECK(out[k].station.put == in[k].station.put);
    CHECK(out[k].station.take == in[k].station.take);
    CHECK(out[k].station.second_put == in[k].station.second_put);
    CHECK(out[k].station.second_take == in[k].station.second_take);
    CHECK(out[k].station.visits == in[k].station.visits);
    CHECK(out[k].station.visit == in[k].station.visit);
  }
  CHECK(again.last_number() == 3);
  CHECK(again.job() == "a");
}

TEST_CASE("a journal tells whose it is") {
  Folder folder;
  { Journal(folder / "job.db", "Monday, first bin"); }
  CHECK(journal_job(folder / "job.db") == "Monday, first bin");
}

TEST_CASE("numbers that do not follow the last one are refused, and nothing of them is written") {
  Folder folder;
  Journal journal(folder / "job.db", "a");
  const std::vector<JobRecord> gap = {record(1), record(3)};
  CHECK_THROWS_WITH(journal.append(gap), "records: found number 3, expected 2, which follows the last one");
  CHECK(journal.records().empty());
  CHECK_THROWS_WITH(Journal(folder / "other.db", ""), "job: is empty; a journal needs the id of its job");
}

TEST_CASE("a stop is released by a person alone, who is named in the journal") {
  Folder folder;
  Journal journal(folder / "job.db", "a");
  CHECK_THROWS_WITH(journal.release("Ada"), "there is no stop to release");
  journal.append(std::vector<JobRecord>{record(1), stop_record(2)});
  CHECK(journal.belief().stop == StopReason::Force);
  CHECK(journal.belief().phase == Phase::Stand);
  CHECK_THROWS_WITH(journal.release(" 1 "), "person: is ' 1 '; name the person who releases the stop");
  CHECK(journal.belief().stop == StopReason::Force);
  journal.release("Ada");
  CHECK(journal.belief().stop == StopReason::None);
  CHECK(journal.released_by() == "Ada");
  CHECK(journal.last_number() == 3);
}

TEST_CASE("the database of another job, version or program is refused in words, and left as it is") {
  Folder folder;
  const auto file = folder / "job.db";
  { Journal(file, "a").append(std::vector<JobRecord>{record(1)}); }
  CHECK_THAT(problem_of([&] { Journal(file, "b"); }),
             EndsWith("job.db: belongs to the job 'a', expected 'b'; name the file of this job, or a new one"));
  std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekp(63);  // user_version of the header of an SQLite file, its last byte
  bytes.put(9);
  bytes.close();
  CHECK_THAT(problem_of([&] { Journal(file, "a"); }), Contains("has version 9 of the journal, expected 1"));
  std::ofstream(folder / "text.db") << std::string(2000, 'x');
  CHECK_THAT(problem_of([&] { Journal(folder / "text.db", "a"); }),
             EndsWith("text.db: is no journal of a job; name another file"));
  CHECK_THAT(problem_of([&] { journal_job(folder / "none.db"); }),
             EndsWith("none.db: is not there; name the journal of a job"));
  CHECK_THAT(problem_of([&] { Journal(folder / "none/job.db", "a"); }),
             EndsWith("job.db: cannot be opened; name a file in a folder that can be written"));
}

TEST_CASE("a journal that another program has open is refused in words") {
  Folder folder;
  Journal first(folder / "job.db", "a");
  first.append(std::vector<JobRecord>{record(1)});
  CHECK_THAT(problem_of([&] { Journal(folder / "job.db", "a"); }),
             EndsWith("job.db: is in use by another program; end the other program that has it open"));
  first.append(std::vector<JobRecord>{record(2)});
  CHECK(first.records().size() == 2);
}

TEST_CASE("whatever append returned for is there after a kill at any instant") {
  Folder folder;
  const auto file = folder / "job.db";
  Random random(7);
  std::uint64_t told = 0;
  for (int kill = 0; kill < 10; ++kill) {
    int pipe_ends[2];
    REQUIRE(pipe(pipe_ends) == 0);
    const pid_t child = fork();
    if (child == 0) {
      close(pipe_ends[0]);
      Journal journal(file, "a");
      for (std::uint64_t n = journal.last_number() + 1;; ++n) {
        journal.append(std::vector<JobRecord>{record(n)});
        if (write(pipe_ends[1], &n, sizeof n) != sizeof n) _exit(1);
      }
    }
    close(pipe_ends[1]);
    std::uint64_t n = 0;
    for (int k = random.integer(20); k >= 0; --k) REQUIRE(read(pipe_ends[0], &n, sizeof n) == sizeof n);
    std::this_thread::sleep_for(std::chrono::microseconds(random.integer(3000)));
    ::kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    while (read(pipe_ends[0], &n, sizeof n) == sizeof n) told = n;
    told = std::max(told, n);
    close(pipe_ends[0]);
    const Journal journal(file, "a");
    CHECK(journal.last_number() >= told);
    CHECK(journal.records().size() == journal.last_number());
  }
  CHECK(told > 10);
}

TEST_CASE("what a restart needs besides is kept before the records, or they are not written") {
  Folder folder;
  Journal journal(folder / "job.db", "a");
  JobRecord record;
  record.number = 1;
  std::uint64_t seen = 99;
  journal.set_before_append([&] { seen = journal.last_number(); });
  journal.append({&record, 1});
  CHECK(seen == 0);
  CHECK(journal.last_number() == 1);
  journal.set_before_append([] { throw IoError("full"); });
  record.number = 2;
  CHECK_THROWS_AS(journal.append({&record, 1}), IoError);
  CHECK(journal.records().size() == 1);
  journal.set_before_append({});
  journal.append({&record, 1});
  CHECK(journal.records().size() == 2);
}

}  // namespace journal_test
