#include <kr5/arm_log/read_log.hpp>

#include <filesystem>
#include <fstream>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "arm_log/logged_arm.hpp"

namespace read_log_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;
using Names = std::vector<std::string>;

TEST_CASE("columns are found by the names of the joints, whatever stands around them") {
  const Names header = {"__time",
                        "/js/elbow/position",
                        "/js/elbow/effort",
                        "/js/shoulder/position",
                        "/js/shoulder/effort",
                        "/js/shoulder/velocity",
                        "/js/wrist/position",
                        "/js/wrist/effort"};
  const arm_log::LogColumns found = arm_log::find_columns(header, described_arm());
  CHECK(found.time == "__time");
  CHECK(found.q == Names{"/js/shoulder/position", "/js/elbow/position", "/js/wrist/position"});
  CHECK(found.effort == Names{"/js/shoulder/effort", "/js/elbow/effort", "/js/wrist/effort"});
  CHECK(found.command.empty());
  CHECK(found.current.empty());
}

TEST_CASE("columns are found by their numbers, from 1 or from 0") {
  const cell::Cell arm = described_arm();
  const arm_log::LogColumns one =
      arm_log::find_columns({"t", "q1", "q2", "q3", "qc1", "qc2", "qc3", "i1", "i2", "i3", "qd1", "qd2", "qd3"}, arm);
  CHECK(one.q == Names{"q1", "q2", "q3"});
  CHECK(one.command == Names{"qc1", "qc2", "qc3"});
  CHECK(one.current == Names{"i1", "i2", "i3"});
  const arm_log::LogColumns zero = arm_log::find_columns(
      {"timestamp_ms", "position[0]", "position[1]", "position[2]", "torque[0]", "torque[1]", "torque[2]"}, arm);
  CHECK(zero.q == Names{"position[0]", "position[1]", "position[2]"});
  CHECK(zero.effort == Names{"torque[0]", "torque[1]", "torque[2]"});
}

TEST_CASE("units at the end of names count, and names that are given stay") {
  io::Table table;
  table.columns = {"time [ms]", "a_deg", "b_deg", "c_deg", "load1 [N mm]", "load2 [N mm]", "load3 [N mm]"};
  table.values.resize(40, 7);
  for (int i = 0; i < 40; ++i) table.values.row(i) << 1e12 + 10 * i, 90, i, 0, 2000, 1000, 500;
  const arm_log::ArmLog log =
      arm_log::log_of(table, described_arm(),
                      {.q = {"a_deg", "b_deg", "c_deg"}, .effort = {"load1 [N mm]", "load2 [N mm]", "load3 [N mm]"}});
  CHECK(log.t[1] - log.t[0] == Approx(0.01).epsilon(1e-9));
  CHECK(log.q(0, 0) == Approx(1.5707963267948966).epsilon(1e-14));
  CHECK(log.effort(3, 0) == Approx(2.0));
}

TEST_CASE("what a log lacks is named") {
  const cell::Cell arm = described_arm();
  CHECK_THROWS_WITH(arm_log::find_columns({"q1", "q2", "q3", "tau1", "tau2", "tau3"}, arm),
                    Contains("no column of the time") && Contains("q1, q2"));
  CHECK_THROWS_WITH(arm_log::find_columns({"t", "shoulder_position", "elbow_position", "tau1"}, arm),
                    Contains("positions of some joints, but not of wrist"));
  CHECK_THROWS_WITH(arm_log::find_columns({"t", "x", "y", "tau1", "tau2", "tau3"}, arm),
                    Contains("no positions of the 3 joints") && Contains("the model names shoulder, elbow, wrist"));
  CHECK_THROWS_WITH(arm_log::find_columns({"t", "q1", "q2", "q3"}, arm), Contains("no currents of the 3 joints"));
  CHECK_THROWS_WITH(arm_log::find_columns({"t", "q1 [turns]", "q2 [turns]", "q3 [turns]", "tau1", "tau2", "tau3"}, arm),
                    Contains("found the unit 'turns'"));
}

TEST_CASE("a file is read, and errors in it name it") {
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "kr5_read_log_test.csv";
  {
    std::ofstream out(file);
    out << "t,q1,q2,q3,tau1,tau2,tau3\n";
    for (int i = 0; i < 40; ++i) out << 0.01 * i << "," << i << ",0,0,1,2,3\n";
  }
  CHECK(arm_log::read_log(file, described_arm()).effort(39, 2) == 3.0);
  { std::ofstream(file, std::ios::app) << "0.39,1,2,3,nan,1,1\n"; }
  CHECK_THROWS_WITH(arm_log::read_log(file, described_arm()), Contains("kr5_read_log_test.csv") && Contains("42"));
  { std::ofstream(file) << "t,q1,q2,q3\n0,1,2,3\n"; }
  CHECK_THROWS_WITH(arm_log::read_log(file, described_arm()), Contains("kr5_read_log_test.csv: found no currents"));
  std::filesystem::remove(file);
}

}  // namespace read_log_test
