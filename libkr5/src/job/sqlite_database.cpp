// SPDX-License-Identifier: BSD-3-Clause
#include "job/sqlite_database.hpp"

#include <sqlite3.h>

#include <kr5/core/error.hpp>

namespace kr5::job {
namespace {

constexpr int patience = 200;  // for which another program's lock is waited for [ms]

std::string remedy_of(int code) {
  switch (code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "end the other program that has it open";
    case SQLITE_FULL:
      return "make room on the disk, then start again";
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return "name another file";
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_PERM:
      return "name a file in a folder that can be written";
    default:
      return "check the disk, then start again";
  }
}

std::string problem_of(int code, sqlite3* handle) {
  switch (code & 0xff) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "is in use by another program";
    case SQLITE_FULL:
      return "cannot be written: the disk is full";
    case SQLITE_NOTADB:
      return "is no journal of a job";
    case SQLITE_CORRUPT:
      return "is damaged";
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return "may not be written";
    case SQLITE_CANTOPEN:
      return "cannot be opened";
    case SQLITE_IOERR:
      return std::string("cannot be read or written (") + sqlite3_errmsg(handle) + ")";
    default:
      return std::string("cannot be used (") + sqlite3_errmsg(handle) + ")";
  }
}

}  // namespace

SqliteDatabase::SqliteDatabase(const std::filesystem::path& file) : file_(file.string()) {
  const int code = sqlite3_open_v2(file_.c_str(), &handle_,
                                   SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_FULLMUTEX, nullptr);
  if (code != SQLITE_OK) {
    const std::string problem = problem_of(code, handle_);
    sqlite3_close(handle_);
    fail(problem, remedy_of(code));
  }
  sqlite3_busy_timeout(handle_, patience);
}

SqliteDatabase::~SqliteDatabase() { sqlite3_close(handle_); }

void SqliteDatabase::fail(const std::string& problem, const std::string& remedy) const {
  throw IoError(file_ + ": " + problem + "; " + remedy);
}

void SqliteDatabase::check(int code) const {
  if (code != SQLITE_OK && code != SQLITE_ROW && code != SQLITE_DONE) fail(problem_of(code, handle_), remedy_of(code));
}

void SqliteDatabase::run(const std::string& sql) {
  check(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr));
}

std::int64_t SqliteDatabase::number(const std::string& sql) {
  SqliteStatement statement(*this, sql);
  return statement.next() ? statement.integer(0) : 0;
}

void SqliteDatabase::roll_back() noexcept {
  if (!sqlite3_get_autocommit(handle_)) sqlite3_exec(handle_, "ROLLBACK", nullptr, nullptr, nullptr);
}

SqliteStatement::SqliteStatement(SqliteDatabase& database, const std::string& sql) : database_(database) {
  database_.check(sqlite3_prepare_v2(database_.handle(), sql.c_str(), -1, &handle_, nullptr));
}

SqliteStatement::~SqliteStatement() { sqlite3_finalize(handle_); }

void SqliteStatement::bind(int column, std::int64_t value) {
  database_.check(sqlite3_bind_int64(handle_, column, value));
}

void SqliteStatement::bind(int column, double value) { database_.check(sqlite3_bind_double(handle_, column, value)); }

void SqliteStatement::bind(int column, std::string_view text) {
  database_.check(sqlite3_bind_text(handle_, column, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT));
}

void SqliteStatement::bind_bytes(int column, std::string_view bytes) {
  database_.check(sqlite3_bind_blob(handle_, column, bytes.data(), static_cast<int>(bytes.size()), SQLITE_TRANSIENT));
}

bool SqliteStatement::next() {
  const int code = sqlite3_step(handle_);
  database_.check(code);
  return code == SQLITE_ROW;
}

std::int64_t SqliteStatement::integer(int column) const { return sqlite3_column_int64(handle_, column); }

double SqliteStatement::real(int column) const { return sqlite3_column_double(handle_, column); }

std::string SqliteStatement::text(int column) const {
  const unsigned char* found = sqlite3_column_text(handle_, column);
  return found ? reinterpret_cast<const char*>(found) : "";
}

std::string SqliteStatement::bytes(int column) const {
  const void* found = sqlite3_column_blob(handle_, column);
  return {static_cast<const char*>(found), found ? static_cast<std::size_t>(sqlite3_column_bytes(handle_, column)) : 0};
}

}  // namespace kr5::job
