// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>

#include <kr5/job/journal.hpp>
#include <kr5/job/record_ring.hpp>

/// @file
/// From the ring of a supervisor to the disk, beside its cycle.

namespace kr5::job {

/// Writes what is in the ring; whether it could. What could not be written stays in the ring, which says that it
/// failed. @param problem The error in words, where it could not.
bool write_records(RecordRing& ring, Journal& journal, std::string& problem);

/// Writes what comes into a ring, in a thread of its own, until it is destroyed.
class JournalWriter {
 public:
  /// Ring and journal must outlive it.
  JournalWriter(RecordRing& ring, Journal& journal);
  /// Writes what is left.
  ~JournalWriter();
  JournalWriter(const JournalWriter&) = delete;
  JournalWriter& operator=(const JournalWriter&) = delete;

  /// The last error in words; empty: none.
  std::string problem() const;

 private:
  struct Worker;
  std::unique_ptr<Worker> worker_;
};

}  // namespace kr5::job
