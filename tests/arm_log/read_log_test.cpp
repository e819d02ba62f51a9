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

TEST_CASE("the number of a joint may stand anywhere, and of several stems one is used for all joints") {
  const cell::Cell arm = described_arm();
  const arm_log::LogColumns inside = arm_log::find_columns(
      {"t", "joint1_pos", "joint2_pos", "joint3_pos", "joint1_eff", "joint2_eff", "joint3_eff"}, arm);
  CHECK(inside.q == Names{"joint1_pos", "joint2_pos", "joint3_pos"});
  CHECK(inside.effort == Names{"joint1_eff", "joint2_eff", "joint3_eff"});
  const arm_log::LogColumns several =
      arm_log::find_columns({"t", "/controller/q1", "q1", "/controller/q2", "q2", "/controller/q3", "q3",
                             "motor_torque1", "motor_torque2", "motor_torque3", "tau1", "tau2", "tau3"},
                            arm);
  CHECK(several.q == Names{"q1", "q2", "q3"});
  CHECK(several.effort == Names{"tau1", "tau2", "tau3"});  // those of motors are other torques
}

TEST_CASE("stamps without a unit are told by their steps, and counts of rows are no times") {
  io::Table table;
  table.columns = {"stamp", "q1", "q2", "q3", "tau1", "tau2", "tau3"};
  table.values = Eigen::MatrixXd::Random(40, 7);
  for (int i = 0; i < 40; ++i) table.values(i, 0) = 1.7e18 + 4e6 * i;  // [ns] since 1970
  CHECK(arm_log::log_of(table, described_arm()).t[39] == Approx(39 * 0.004).epsilon(1e-4));
  table.values.col(0) = Eigen::VectorXd::LinSpaced(40, 0, 39);
  CHECK_THROWS_WITH(arm_log::log_of(table, described_arm()), Contains("'stamp' counts rows"));
}

TEST_CASE("a unit of another quantity is refused with those that are expected") {
  const cell::Cell arm = described_arm();
  CHECK_THROWS_WITH(arm_log::find_columns({"t", "q1_mA", "q2_mA", "q3_mA", "tau1", "tau2", "tau3"}, arm),
                    Contains("'q1_mA': found the unit 'mA'") && Contains("rad, mrad, deg"));
  CHECK_THROWS_WITH(arm_log::find_columns({"t", "q1", "q2", "q3", "load_percent1", "load_percent2", "load_percent3",
                                           "torque_percent1", "torque_percent2", "torque_percent3"},
                                          arm),
                    Contains("found the unit '%'") && Contains("N m"));
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
