// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/job/belief.hpp>
#include <kr5/job/record.hpp>

/// @file
/// The records of a job on a disk, in an SQLite database with a log written ahead: after a loss of power it holds
/// whatever `append` returned for, and nothing by halves.

namespace kr5::job {

/// Version of the tables; a database of another one is refused.
inline constexpr int journal_version = 1;

class Journal {
 public:
  /// Opens the database of a job, or makes it. No other program can open it meanwhile.
  /// @throws InvalidArgument for an empty id. @throws IoError naming the file and the remedy: for a database of another
  /// job, version or program, one that another program has open, a folder that cannot be written.
  Journal(const std::filesystem::path& file, const std::string& job);
  ~Journal();
  Journal(Journal&&) noexcept;
  Journal& operator=(Journal&&) noexcept;

  /// Writes records, all or none, and returns when they are on the disk.
  /// @throws InvalidArgument for numbers that do not follow the last one. @throws IoError naming the file, as when the
  /// disk is full; what was written before stays.
  void append(std::span<const JobRecord> records);
  /// Called before records are written, each time; records of which it throws an Error are not. What a restart needs
  /// besides the records is kept there, so that it is never older than they are. Not called by `release`.
  void set_before_append(std::function<void()> call);
  /// A person releases the stop. @throws InvalidArgument for a name without letters, or when there is no stop.
  void release(const std::string& person);

  std::vector<JobRecord> records() const;
  JobBelief belief() const;
  std::uint64_t last_number() const noexcept;
  const std::string& job() const noexcept;
  /// Who released a stop last; empty: nobody yet.
  std::string released_by() const;

 private:
  struct Database;
  std::unique_ptr<Database> database_;
};

/// The id of the job that a database belongs to. @throws IoError naming the file, for one that is not there, or is
/// none.
std::string journal_job(const std::filesystem::path& file);

}  // namespace kr5::job
