#include <kr5/work/fault_trials.hpp>

#include <filesystem>

#include <unistd.h>
#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <support/trials.hpp>

namespace fault_trials_test {

using namespace kr5;

TEST_CASE("whatever fails while a pellet is inserted, the arm goes on or stands, and no pellet goes astray",
          "[long][not_sanitized]") {
  const auto folder = std::filesystem::temp_directory_path() / ("kr5_fault_trials_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const int trials = test::trials(5, 1);  // of each fault
  sim::WorkCellOptions bin;
  bin.pour.pellets = 2;
  bin.pour.seed = 9401;
  bin.seed = 9401;
  double told = 0.0;
  const auto rows = work::run_fault_trials(cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"), bin, folder,
                                           {.trials = trials, .seed = 5}, [&](double share) { told = share; });
  REQUIRE(rows.size() == 9);
  for (const work::FaultRow& row : rows) {
    INFO(name_of(row.fault) << ": continued " << row.continued << ", stopped " << row.stopped << ", resumed "
                            << row.resumed << ", force " << row.max_force << " N");
    CHECK(row.trials == trials);
    CHECK(row.continued + row.stopped == trials);
    CHECK(row.moving == 0);
    CHECK(row.over_limit == 0);
    CHECK(row.astray == 0);
    CHECK(row.max_force > 0.0);
    const bool ends = row.fault >= work::TrialFault::EmergencyStop;
    if (ends) CHECK(row.continued == 0);
  }
  CHECK(told == 1.0);
  std::filesystem::remove_all(folder);
}

TEST_CASE("numbers of trials that are none are refused") {
  CHECK_THROWS_AS(work::FaultTrialOptions{.trials = 0}.validate(), InvalidArgument);
  CHECK_THROWS_AS(work::FaultTrialOptions{.messages = 0}.validate(), InvalidArgument);
}

}  // namespace fault_trials_test
