// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/journal.hpp>

#include <algorithm>
#include <cctype>
#include <utility>

#include <kr5/core/error.hpp>

#include "job/journal_rows.hpp"
#include "job/sqlite_database.hpp"

namespace kr5::job {
namespace {

constexpr int application = 0x6b723561;  // "kr5a": which program's database it is

constexpr const char* tables =
    "CREATE TABLE job(id TEXT NOT NULL);"
    "CREATE TABLE release(number INTEGER PRIMARY KEY, person TEXT NOT NULL);"
    "CREATE TABLE record(number INTEGER PRIMARY KEY, time REAL, kind TEXT, phase TEXT, outcome TEXT, pellet INTEGER,"
    " pellet_state TEXT, attempt INTEGER, stop TEXT, put BLOB, take BLOB,"
    " second_put BLOB, second_take BLOB, visits INTEGER, visit INTEGER);";

/// The id of the job, in tables of this version.
std::string checked_job(SqliteDatabase& sqlite) {
  if (sqlite.number("PRAGMA application_id") != application)
    sqlite.fail("is a database of another program", "name another file");
  if (const auto version = sqlite.number("PRAGMA user_version"); version != journal_version)
    sqlite.fail(
        "has version " + std::to_string(version) + " of the journal, expected " + std::to_string(journal_version),
        "finish that job with the program that began it, or name another file");
  SqliteStatement select(sqlite, "SELECT id FROM job");
  return select.next() ? select.text(0) : "";
}

}  // namespace

std::string journal_job(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) throw IoError(file.string() + ": is not there; name the journal of a job");
  SqliteDatabase sqlite(file);
  return checked_job(sqlite);
}

struct Journal::Database {
  Database(const std::filesystem::path& file, std::string id) : sqlite(file), job(std::move(id)) {}

  /// A database of somebody else is left as it is.
  void open() {
    sqlite.run("PRAGMA locking_mode=EXCLUSIVE;");
    const bool empty = sqlite.number("SELECT count(*) FROM sqlite_master") == 0;
    if (!empty) check_tables();
    sqlite.run("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;");
    SqliteTransaction transaction(sqlite);  // takes the lock that keeps every other program out
    if (empty) make_tables();
    transaction.commit();
    last = static_cast<std::uint64_t>(sqlite.number("SELECT coalesce(max(number), 0) FROM record"));
  }

  void make_tables() {
    sqlite.run(tables);
    sqlite.run("PRAGMA application_id=" + std::to_string(application) +
               "; PRAGMA user_version=" + std::to_string(journal_version) + ";");
    SqliteStatement insert(sqlite, "INSERT INTO job VALUES(?)");
    insert.bind(1, job);
    insert.run();
  }

  void check_tables() {
    const std::string found = checked_job(sqlite);
    if (found != job)
      sqlite.fail("belongs to the job '" + found + "', expected '" + job + "'",
                  "name the file of this job, or a new one");
  }

  SqliteDatabase sqlite;
  std::string job;
  std::uint64_t last = 0;
  std::function<void()> before_append;
};

Journal::Journal(const std::filesystem::path& file, const std::string& job) {
  require(!job.empty(), "job: is empty; a journal needs the id of its job");
  database_ = std::make_unique<Database>(file, job);
  database_->open();
}

Journal::~Journal() = default;
Journal::Journal(Journal&&) noexcept = default;
Journal& Journal::operator=(Journal&&) noexcept = default;

void Journal::append(std::span<const JobRecord> records) {
  std::uint64_t last = database_->last;
  for (const JobRecord& record : records) {
    ++last;
    require(record.number == last, "records: found number " + std::to_string(record.number) + ", expected " +
                                       std::to_string(last) + ", which follows the last one");
  }
  if (records.empty()) return;
  if (database_->before_append) database_->before_append();
  SqliteTransaction transaction(database_->sqlite);
  for (const JobRecord& record : records) insert_record(database_->sqlite, record);
  transaction.commit();
  database_->last = last;
}

void Journal::set_before_append(std::function<void()> call) { database_->before_append = std::move(call); }

void Journal::release(const std::string& person) {
  const auto letter = [](unsigned char c) { return std::isalpha(c) || c >= 0x80; };
  require(std::any_of(person.begin(), person.end(), letter),
          "person: is '" + person + "'; name the person who releases the stop");
  const JobBelief now = belief();
  require(now.stop != StopReason::None, "there is no stop to release");
  JobRecord record;
  record.number = database_->last + 1;
  record.kind = RecordKind::Release;
  record.phase = now.phase;
  record.stop = now.stop;
  SqliteTransaction transaction(database_->sqlite);
  insert_record(database_->sqlite, record);
  SqliteStatement insert(database_->sqlite, "INSERT INTO release VALUES(?, ?)");
  insert.bind(1, static_cast<std::int64_t>(record.number));
  insert.bind(2, person);
  insert.run();
  transaction.commit();
  database_->last = record.number;
}

std::vector<JobRecord> Journal::records() const { return read_records(database_->sqlite); }

JobBelief Journal::belief() const { return believe(records()); }

std::uint64_t Journal::last_number() const noexcept { return database_->last; }

const std::string& Journal::job() const noexcept { return database_->job; }

std::string Journal::released_by() const {
  SqliteStatement select(database_->sqlite, "SELECT person FROM release ORDER BY number DESC LIMIT 1");
  return select.next() ? select.text(0) : "";
}

}  // namespace kr5::job
