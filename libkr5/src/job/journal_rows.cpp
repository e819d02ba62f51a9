// SPDX-License-Identifier: BSD-3-Clause
#include "job/journal_rows.hpp"

#include <cstring>

namespace kr5::job {
namespace {

constexpr int most_pellets = 1000000;

std::string_view bytes_of(const Vector6& v) {
  return {reinterpret_cast<const char*>(v.data()), sizeof(double) * static_cast<std::size_t>(v.size())};
}

/// Reads the columns of a row, and says which of them holds what no journal writes.
class RowReader {
 public:
  RowReader(const SqliteDatabase& database, const SqliteStatement& row) : database_(database), row_(row) {}

  template <HasNames E>
  E value(int column, const char* name) const {
    const std::string text = row_.text(column);
    for (const auto& [candidate, known] : enum_names(E{}))
      if (known == text) return candidate;
    fail(name, "'" + text + "' is none of its values");
  }
  int count(int column, const char* name) const {
    const std::int64_t found = row_.integer(column);
    if (found < 0 || found > most_pellets) fail(name, std::to_string(found) + " is no count");
    return static_cast<int>(found);
  }
  Vector6 vector(int column, const char* name) const {
    const std::string found = row_.bytes(column);
    Vector6 out;
    if (found.size() != bytes_of(out).size()) fail(name, "is no pose");
    std::memcpy(out.data(), found.data(), found.size());
    if (!out.allFinite()) fail(name, "is no pose");
    return out;
  }

 private:
  [[noreturn]] void fail(const char* name, const std::string& problem) const {
    database_.fail("record " + std::to_string(row_.integer(0)) + ", " + name + ": " + problem,
                   "the journal is damaged: begin a new one, with bin and tube as they are");
  }

  const SqliteDatabase& database_;
  const SqliteStatement& row_;
};

}  // namespace

void insert_record(SqliteDatabase& database, const JobRecord& r) {
  SqliteStatement insert(database, "INSERT INTO record VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  insert.bind(1, static_cast<std::int64_t>(r.number));
  insert.bind(2, r.time);
  insert.bind(3, name_of(r.kind));
  insert.bind(4, name_of(r.phase));
  insert.bind(5, name_of(r.outcome));
  insert.bind(6, static_cast<std::int64_t>(r.pellet));
  insert.bind(7, name_of(r.pellet_state));
  insert.bind(8, static_cast<std::int64_t>(r.attempt));
  insert.bind(9, name_of(r.stop));
  insert.bind_bytes(10, bytes_of(r.station.put));
  insert.bind_bytes(11, bytes_of(r.station.take));
  insert.bind_bytes(12, bytes_of(r.station.second_put));
  insert.bind_bytes(13, bytes_of(r.station.second_take));
  insert.bind(14, static_cast<std::int64_t>(r.station.visits));
  insert.bind(15, static_cast<std::int64_t>(r.station.visit));
  insert.run();
}

std::vector<JobRecord> read_records(SqliteDatabase& database) {
  std::vector<JobRecord> out;
  SqliteStatement row(database, "SELECT * FROM record ORDER BY number");
  const RowReader read(database, row);
  while (row.next()) {
    JobRecord r;
    r.number = static_cast<std::uint64_t>(row.integer(0));
    r.time = row.real(1);
    r.kind = read.value<RecordKind>(2, "kind");
    r.phase = read.value<Phase>(3, "phase");
    r.outcome = read.value<Outcome>(4, "outcome");
    r.pellet = read.count(5, "pellet");
    r.pellet_state = read.value<PelletState>(6, "pellet_state");
    r.attempt = read.count(7, "attempt");
    r.stop = read.value<StopReason>(8, "stop");
    r.station.put = read.vector(9, "put");
    r.station.take = read.vector(10, "take");
    r.station.second_put = read.vector(11, "second_put");
    r.station.second_take = read.vector(12, "second_take");
    r.station.visits = read.count(13, "visits");
    r.station.visit = read.count(14, "visit");
    out.push_back(r);
  }
  return out;
}

}  // namespace kr5::job
