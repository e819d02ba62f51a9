// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/journal_writer.hpp>

#include <atomic>
#include <chrono>
#include <mutex>
#include <thread>
#include <vector>

#include <kr5/core/error.hpp>

namespace kr5::job {

bool write_records(RecordRing& ring, Journal& journal, std::string& problem) {
  std::vector<JobRecord> records;
  for (const JobRecord* next = ring.after(ring.written()); next; next = ring.after(next->number))
    records.push_back(*next);
  if (records.empty()) return true;
  try {
    journal.append(records);
  } catch (const Error& e) {
    problem = e.what();
    ring.note_failure();
    return false;
  }
  ring.note_written(records.back().number);
  return true;
}

struct JournalWriter::Worker {
  Worker(RecordRing& ring, Journal& journal) : thread([this, &ring, &journal] { run(ring, journal); }) {}
  ~Worker() {
    ending = true;
    thread.join();
  }

  /// The cycle of a controller must never wait for this thread, so nothing wakes it: it looks.
  void run(RecordRing& ring, Journal& journal) {
    constexpr auto pause = std::chrono::milliseconds(1), after_failure = std::chrono::milliseconds(200);
    while (true) {
      const bool last = ending;
      std::string now;
      const bool good = write_records(ring, journal, now);
      if (!good) {
        const std::lock_guard lock(mutex);
        problem = now;
      }
      if (last) return;
      std::this_thread::sleep_for(good ? pause : after_failure);
    }
  }

  std::atomic<bool> ending = false;
  mutable std::mutex mutex;  // of the text alone, which the cycle does not read
  std::string problem;
  std::thread thread;
};

JournalWriter::JournalWriter(RecordRing& ring, Journal& journal) : worker_(std::make_unique<Worker>(ring, journal)) {}

JournalWriter::~JournalWriter() = default;

std::string JournalWriter::problem() const {
  const std::lock_guard lock(worker_->mutex);
  return worker_->problem;
}

}  // namespace kr5::job
