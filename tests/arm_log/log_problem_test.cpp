#include <kr5/arm_log/log_problem.hpp>

#include <algorithm>
#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/arm_log/diagnose_log.hpp>
#include <kr5/core/error.hpp>

#include "arm_log/logged_arm.hpp"

namespace log_problem_test {

using namespace kr5;
using namespace kr5::test;
using arm_log::LogProblem;
using arm_log::LogProblemKind;
using arm_log::LogRemedy;
using Catch::Matchers::Contains;

namespace {

cell::Cell limited_arm() {
  cell::Cell out = described_arm();
  out.robot.limits = cell::Limits{Eigen::Vector3d(-3, -3, -3), Eigen::Vector3d(3, 3, 3), Eigen::Vector3d(4, 4, 4),
                                  Eigen::Vector3d(400, 200, 50)};
  return out;
}

/// What speaks against a log that is trusted nevertheless.
std::vector<LogProblem> problems_of(const arm_log::ArmLog& log) {
  return arm_log::prepare_log(log, limited_arm(), {.trust = true}).problems;
}

LogProblem first_problem(const arm_log::ArmLog& log) {
  const std::vector<LogProblem> found = problems_of(log);
  REQUIRE_FALSE(found.empty());
  return found.front();
}

}  // namespace

TEST_CASE("nothing speaks against a sound log, friction or not") {
  CHECK(problems_of(logged(moved_arm())).empty());
  cell::Cell arm = moved_arm();
  arm.drives->friction.coulomb = Eigen::Vector3d(10, 6, 1);
  CHECK(problems_of(logged(arm)).empty());
}

TEST_CASE("a load that is another joint's is told, not blamed on the arm") {
  arm_log::ArmLog log = logged(moved_arm());
  log.effort.col(2) = 0.5 * log.effort.col(1);
  const LogProblem found = first_problem(log);
  CHECK(found.kind == LogProblemKind::Copy);
  CHECK(found.joint == 2);
  CHECK(found.other == 1);
  CHECK_THROWS_WITH(arm_log::diagnose_log(log, limited_arm()), Contains("the load of joint 2, or a multiple of it"));
}

TEST_CASE("loads without their sign are told as such, not as a reversed joint") {
  arm_log::ArmLog log = logged(moved_arm());
  log.effort = log.effort.cwiseAbs();
  const LogProblem found = first_problem(log);
  CHECK(found.kind == LogProblemKind::Unsigned);
  CHECK_FALSE(found.columns.empty());
}

TEST_CASE("loads that a driver cuts to whole counts are sound") {
  arm_log::ArmLog log = logged(moved_arm());
  const double count = GENERATE(0.5, 4.0);  // [N m]
  log.effort = (log.effort / count).unaryExpr([](double x) { return std::trunc(x); }) * count;
  CHECK(problems_of(log).empty());
}

TEST_CASE("negative loads that were read as unsigned numbers are told with what they are too large by") {
  arm_log::ArmLog log = logged(moved_arm());
  const double modulus = GENERATE(65536.0, 4096.0);
  const double unit = GENERATE(1.0, 0.1);  // [N m] of a count
  log.effort = (log.effort / unit).array().round();
  REQUIRE(log.effort.cwiseAbs().maxCoeff() < modulus / 4);
  log.effort = (log.effort.array() < 0).select(log.effort.array() + modulus, log.effort);
  log.effort *= unit;
  const LogProblem found = first_problem(log);
  CHECK(found.kind == LogProblemKind::Wrapped);
  CHECK(found.found == Approx(modulus * unit));
  CHECK(found.columns.size() >= 2);
}

TEST_CASE("degrees are recognised by the limits") {
  arm_log::ArmLog log = logged(moved_arm());
  log.q *= 180 / M_PI;
  const LogProblem found = first_problem(log);
  CHECK(found.kind == LogProblemKind::BeyondLimits);
  CHECK(found.remedy == LogRemedy::Degrees);
  CHECK_THROWS_WITH(arm_log::diagnose_log(log, limited_arm()),
                    Contains("beyond") || (Contains("expected -3 to 3 rad") && Contains("as degrees")));
}

TEST_CASE("radians that were read as degrees hardly move") {
  arm_log::ArmLog log = logged(moved_arm());
  log.q *= M_PI / 180;
  const LogProblem found = first_problem(log);
  CHECK(found.kind == LogProblemKind::HardlyMoves);
  CHECK(found.remedy == LogRemedy::Radians);
}

TEST_CASE("a clock in milliseconds is recognised by the speeds of the joints") {
  arm_log::ArmLog log = logged(moved_arm());
  log.t *= 1e3;
  const LogProblem found = first_problem(log);
  CHECK(found.kind == LogProblemKind::SpeedBeyond);
  CHECK(found.remedy == LogRemedy::Milliseconds);
}

TEST_CASE("loads of the other sign, in another unit, exchanged or constant are told apart") {
  arm_log::ArmLog log = logged(moved_arm());
  SECTION("all of the other sign") {
    log.effort *= -1;
    CHECK(first_problem(log).kind == LogProblemKind::OppositeSign);
    CHECK_THROWS_WITH(arm_log::diagnose_log(log, limited_arm()), Contains("tau1 to tau3") && Contains("opposite sign"));
  }
  SECTION("thousandths") {
    log.effort *= 1e3;
    const LogProblem found = first_problem(log);
    CHECK(found.kind == LogProblemKind::Factor);
    CHECK(found.remedy == LogRemedy::Thousandth);
    CHECK(found.found == Approx(1000).epsilon(0.05));
  }
  SECTION("per cent of the limits of effort") {
    log.effort = log.effort * (100 * limited_arm().robot.limits->effort.cwiseInverse()).asDiagonal();
    CHECK(first_problem(log).remedy == LogRemedy::PercentOfEffort);
  }
  SECTION("a factor of no known reason") {
    log.effort *= 7;
    const LogProblem found = first_problem(log);
    CHECK(found.kind == LogProblemKind::UnknownFactor);
    CHECK(found.found == Approx(7).epsilon(0.05));
  }
  SECTION("constant") {
    log.effort.setConstant(2.0);
    CHECK(first_problem(log).kind == LogProblemKind::Constant);
  }
  SECTION("the order of joints") {
    log.q.col(0).swap(log.q.col(1));
    log.effort.col(0).swap(log.effort.col(1));
    const LogProblem found = first_problem(log);
    CHECK(found.kind == LogProblemKind::Order);
    CHECK(found.reading.order == std::vector<int>{1, 0, 2});
  }
}

TEST_CASE("loads from which the controller took gravity are those of an arm without weight") {
  cell::Cell arm = moved_arm();
  arm.robot.gravity.setConstant(1e-9);
  CHECK(first_problem(logged(arm)).kind == LogProblemKind::Weightless);
}

TEST_CASE("every kind of problem has a sentence with what was found and expected") {
  for (const auto& [kind, name] : enum_names(LogProblemKind{})) {
    LogProblem problem{.kind = kind, .experiment = "motion-1", .columns = {"tau1"}, .joint = 0, .other = 1};
    problem.reading = {{0, 1, 2}, {1, -1, 1}, {0, 0, 1.57}};
    INFO(name);
    CHECK(found_text(problem, described_arm()).size() > 5);
    CHECK(expected_text(problem, described_arm()).size() > 5);
    CHECK(text(problem, described_arm()).find("motion-1: tau1 (shoulder): found ") == 0);
  }
}

TEST_CASE("columns are told by the ends of their row, one by one where only some of them are meant") {
  const auto text = [](std::vector<std::string> columns, LogProblemKind kind = LogProblemKind::Unlike) {
    return arm_log::columns_text({.kind = kind, .columns = std::move(columns)});
  };
  CHECK(text({"tau2"}) == "tau2");
  CHECK(text({"tau1", "tau2"}) == "tau1 and tau2");
  CHECK(text({"tau1", "tau2", "tau3"}) == "tau1 to tau3");
  CHECK(text({"x", "y", "z"}) == "x y z");
  CHECK(text({"tau1", "tau3"}, LogProblemKind::SomeOpposite) == "tau1, tau3");
}

TEST_CASE("a problem names the joint of its column, a log with problems is put in question") {
  arm_log::ArmLog log = logged(moved_arm());
  log.effort *= -1;
  CHECK_THROWS_WITH(arm_log::prepare_log(log, limited_arm()), Contains(arm_log::mismatch_text()));
  const LogProblem problem{.kind = LogProblemKind::Unlike, .experiment = "motion-1", .columns = {"tau2"}, .joint = 1};
  CHECK_THAT(text(problem, limited_arm()), Contains("motion-1: tau2 (elbow): found a correlation"));
}

}  // namespace log_problem_test
