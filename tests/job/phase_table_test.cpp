#include <kr5/job/phase_table.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace phase_table_test {

using namespace kr5;
using namespace kr5::job;

PhaseRow& row_of(PhaseTable& table, Phase phase) { return table.rows[static_cast<std::size_t>(phase)]; }

TEST_CASE("the usual table can be run: every phase leads to the end, and a stop is possible in each") {
  const PhaseTable table = usual_phases();
  CHECK_NOTHROW(table.validate());
  for (const PhaseRow& row : table.rows) {
    if (row.phase == Phase::Stopped || row.phase == Phase::Done) {
      CHECK(row.exits.empty());
      continue;
    }
    CHECK(row.timeout > 0);
    REQUIRE(table.find_exit(row.phase, Outcome::Stop) != nullptr);
    CHECK(table.find_exit(row.phase, Outcome::Stop)->next == Phase::Stopped);
  }
}

TEST_CASE("an interrupted job is resumed only where the table says so") {
  const PhaseTable table = usual_phases();
  for (const Phase phase : {Phase::Look, Phase::Scan, Phase::Stand, Phase::Regrip, Phase::Approach, Phase::Next}) {
    REQUIRE(table.find_exit(Phase::CheckCell, Outcome::Resumed, phase) != nullptr);
    CHECK(table.find_exit(Phase::CheckCell, Outcome::Resumed, phase)->next == phase);
  }
  CHECK(table.find_exit(Phase::CheckCell, Outcome::Resumed, Phase::Insert) == nullptr);
}

TEST_CASE("a table that cannot be run is refused by the name of phase and field") {
  PhaseTable table = usual_phases();
  row_of(table, Phase::Pick).exits.pop_back();
  CHECK_THROWS_WITH(table.validate(), "phase pick: the outcome stop has no exit");
  table = usual_phases();
  row_of(table, Phase::Pick).exits.push_back({Outcome::Gripped, Phase::Stand});
  CHECK_THROWS_WITH(table.validate(), "phase pick: the outcome gripped has more than one exit");
  table = usual_phases();
  row_of(table, Phase::Pick).exits.push_back({Outcome::HoleFound, Phase::Stand});
  CHECK_THROWS_WITH(table.validate(), "phase pick: has no outcome hole_found");
  table = usual_phases();
  row_of(table, Phase::Scan).timeout = -1;
  CHECK_THROWS_WITH(table.validate(), "phase scan: timeout must not be negative [s]");
  table = usual_phases();
  row_of(table, Phase::Scan).retries = -1;
  CHECK_THROWS_WITH(table.validate(), "phase scan: retries must not be negative");
  table = usual_phases();
  std::swap(table.rows[0], table.rows[1]);
  CHECK_THROWS_WITH(table.validate(), "phase look: stands where check_cell belongs");
  table = usual_phases();
  table.rows.pop_back();
  CHECK_THROWS_WITH(table.validate(), "rows: found 11, expected one a phase: 12");
  table = usual_phases();
  for (PhaseExit& e : row_of(table, Phase::Next).exits) e.next = e.exhausted = Phase::Stopped;
  row_of(table, Phase::Scan).exits[2].next = Phase::Stopped;
  CHECK_THROWS_WITH(table.validate(), "phase check_cell: nothing leads from it to done");
}

}  // namespace phase_table_test
