// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace kr5::job {

/// An SQLite database whose errors are sentences: file, problem, remedy.
class SqliteDatabase {
 public:
  /// @throws IoError when it cannot be opened.
  explicit SqliteDatabase(const std::filesystem::path& file);
  ~SqliteDatabase();
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  void run(const std::string& sql);
  /// The first value of a query.
  std::int64_t number(const std::string& sql);
  /// Throws IoError: file, problem, remedy.
  [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const;
  /// Throws IoError for a code of SQLite.
  void check(int code) const;
  /// Undoes what was begun; says nothing when there is nothing to undo.
  void roll_back() noexcept;
  sqlite3* handle() const noexcept { return handle_; }

 private:
  std::string file_;
  sqlite3* handle_ = nullptr;
};

class SqliteStatement {
 public:
  SqliteStatement(SqliteDatabase& database, const std::string& sql);
  ~SqliteStatement();
  SqliteStatement(const SqliteStatement&) = delete;
  SqliteStatement& operator=(const SqliteStatement&) = delete;

  void bind(int column, std::int64_t value);
  void bind(int column, double value);
  void bind(int column, std::string_view text);
  void bind_bytes(int column, std::string_view bytes);
  /// False when there is no row any more.
  bool next();
  void run() { next(); }

  std::int64_t integer(int column) const;
  double real(int column) const;
  std::string text(int column) const;
  std::string bytes(int column) const;

 private:
  SqliteDatabase& database_;
  sqlite3_stmt* handle_ = nullptr;
};

/// What is not committed is undone.
class SqliteTransaction {
 public:
  explicit SqliteTransaction(SqliteDatabase& database) : database_(database) { database_.run("BEGIN IMMEDIATE"); }
  ~SqliteTransaction() {
    if (!done_) database_.roll_back();
  }
  SqliteTransaction(const SqliteTransaction&) = delete;
  SqliteTransaction& operator=(const SqliteTransaction&) = delete;
  void commit() {
    database_.run("COMMIT");
    done_ = true;
  }

 private:
  SqliteDatabase& database_;
  bool done_ = false;
};

}  // namespace kr5::job
