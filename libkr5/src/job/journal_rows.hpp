// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/job/record.hpp>

#include "job/sqlite_database.hpp"

namespace kr5::job {

void insert_record(SqliteDatabase& database, const JobRecord& record);

/// All records, the oldest first. @throws IoError naming the file, for values that no journal holds.
std::vector<JobRecord> read_records(SqliteDatabase& database);

}  // namespace kr5::job
