#include <kr5/arm_log/log_problem.hpp>

#include <cmath>
#include <functional>

#include <catch2/catch.hpp>

#include <kr5/arm_log/log_recording.hpp>

#include "arm_log/servo_arms.hpp"

namespace command_checks_test {

using namespace kr5;
using namespace kr5::test;
using arm_log::ArmLog;
using arm_log::LogProblem;
using arm_log::LogProblemKind;
using arm_log::LogRemedy;
using Catch::Matchers::Contains;
using Eigen::Index;

namespace {

struct Logged {
  cell::Cell arm;
  ArmLog log;
};

Logged logged(std::uint64_t seed, const std::function<void(cell::Cell&)>& change = nullptr) {
  Random random(seed);
  Logged out;
  out.arm = servo_arm(3, random);
  cell::Cell moved = out.arm;
  if (change) change(moved);
  out.log = servo_log(moved, random, 20.0);
  return out;
}

std::vector<LogProblem> problems_of(const Logged& l) {
  std::vector<LogProblem> out;
  for (const cell::Experiment& e : arm_log::record_log(l.log, l.arm).recording.experiments)
    for (const LogProblem& p : arm_log::check_positions(l.arm, e)) out.push_back(p);
  return out;
}

LogProblem first_problem(const Logged& l) {
  const auto found = problems_of(l);
  REQUIRE_FALSE(found.empty());
  INFO(text(found.front(), l.arm));
  return found.front();
}

/// The only problem of a log that is not split.
LogProblem problem_of(const Logged& l) {
  cell::Experiment e;
  e.name = "motion";
  e.data.columns = {"t", "qc1", "qc2", "qc3", "q1", "q2", "q3"};
  e.data.values.resize(l.log.q.rows(), 7);
  e.data.values << l.log.t, l.log.command, l.log.q;
  const auto found = arm_log::check_positions(l.arm, e);
  REQUIRE(found.size() == 1);
  return found.front();
}

}  // namespace

TEST_CASE("rows need not come at the cycle of torque servos, which is that of their loop") {
  Logged l = logged(7);
  for (const double cycle : {1e-4, 0.002, 2.0}) {
    l.arm.servo->cycle = cycle;
    INFO("cycle of " << cycle << " s");
    CHECK(problems_of(l).empty());
  }
}

TEST_CASE("nothing speaks against commands that servos follow, weak, late and stiff ones") {
  const std::function<void(cell::Cell&)> changes[] = {
      [](cell::Cell&) {},
      [](cell::Cell& arm) {
        for (auto& s : arm.servo->torque) s.stiffness *= 0.3;
      },
      [](cell::Cell& arm) {
        for (auto& s : arm.servo->torque) s.delay = 0.15;
      },
      [](cell::Cell& arm) { arm.drives->friction.coulomb.array() += 0.5; },
      [](cell::Cell& arm) {
        for (auto& s : arm.servo->torque) s.dead_band = 0.03;
      },
      [](cell::Cell& arm) {
        for (auto& s : arm.servo->torque) s.torque_limit = 0.4;
      },
  };
  const int change = GENERATE(0, 1, 2, 3, 4, 5);
  const int seed = GENERATE(1, 2, 3, 4, 5, 6);
  const Logged l = logged(8100 + static_cast<std::uint64_t>(10 * change + seed), changes[change]);
  const auto found = problems_of(l);
  INFO(change << " " << (found.empty() ? "" : text(found.front(), l.arm)));
  CHECK(found.empty());
}

TEST_CASE("commands that are the measured positions are told, also those of the next row") {
  Logged l = logged(8201);
  const Index shift = GENERATE(0, 1);
  l.log.command.topRows(l.log.q.rows() - shift) = l.log.q.bottomRows(l.log.q.rows() - shift);
  l.log.command.bottomRows(1) = l.log.q.bottomRows(1);
  const LogProblem found = first_problem(l);
  CHECK(found.kind == LogProblemKind::CommandsMeasured);
  CHECK(found.found == static_cast<double>(shift));
  CHECK_THAT(text(found, l.arm), Contains("the log is of an arm that was led"));
}

TEST_CASE("commands that are speeds or changes of the position are told") {
  Logged l = logged(8301);
  const Index n = l.log.q.rows();
  const double scale = GENERATE(1.0, 50.0);
  const Eigen::MatrixXd steps = l.log.command.bottomRows(n - 1) - l.log.command.topRows(n - 1);
  l.log.command.topRows(n - 1) = scale * steps * 20.0;
  l.log.command.row(n - 1) = l.log.command.row(n - 2);
  CHECK(first_problem(l).kind == LogProblemKind::CommandsAreSpeeds);
}

TEST_CASE("commands in another unit or from another zero are told with what brings them to the positions") {
  Logged l = logged(8401);
  const Eigen::MatrixXd right = l.log.command;
  SECTION("of a range") {
    l.log.command = (right.array() - 0.2) / 1.9;
    const LogProblem found = first_problem(l);
    CHECK(found.kind == LogProblemKind::CommandsScaled);
    CHECK(found.remedy == LogRemedy::ScaleCommands);
    for (int k = 0; k < 3; ++k) {
      INFO(found.factors[static_cast<std::size_t>(k)] << " " << found.offsets[static_cast<std::size_t>(k)]);
      CHECK(found.factors[static_cast<std::size_t>(k)] == Approx(1.9).epsilon(0.15));
    }
  }
  SECTION("degrees") {
    l.log.command = right * 180 / M_PI;
    CHECK(first_problem(l).remedy == LogRemedy::Degrees);
  }
  SECTION("counted the other way") {
    l.log.command = -right;
    CHECK(first_problem(l).kind == LogProblemKind::CommandsScaled);
  }
  SECTION("from another zero") {
    l.log.command = right.array() + 1.2;
    const LogProblem found = first_problem(l);
    CHECK(found.kind == LogProblemKind::CommandsScaled);
    CHECK(found.offsets[0] == Approx(-1.2).margin(0.2));
  }
}

TEST_CASE("commands that have nothing to do with the joints are told") {
  Logged l = logged(8501);
  Random random(8502);
  l.log.command = servo_commands(l.log.t, 3, random);
  CHECK(first_problem(l).kind == LogProblemKind::CommandsUnlike);
}

TEST_CASE("small commands beside positions that move are told by how the positions follow them") {
  Logged l = logged(8501);
  l.arm.robot.limits =
      cell::Limits{Eigen::Vector3d(-3, -3, -3), Eigen::Vector3d(3, 3, 3), Eigen::Vector3d(9, 9, 9), {}};
  SECTION("not at all") {
    Random random(8502);
    l.log.command = 0.02 * servo_commands(l.log.t, 3, random);
    CHECK(problem_of(l).kind == LogProblemKind::CommandsUnlike);
  }
  SECTION("at a constant ratio") {
    l.log.command *= M_PI / 180;
    const LogProblem found = problem_of(l);
    CHECK(found.kind == LogProblemKind::CommandsScaled);
    CHECK(found.factors[0] == Approx(180 / M_PI).epsilon(0.2));
  }
}

TEST_CASE("a joint that never moves is named") {
  Logged l = logged(8601);
  l.log.q.col(1).setConstant(l.log.q(0, 1));
  const LogProblem found = first_problem(l);
  CHECK(found.kind == LogProblemKind::NeverMoves);
  CHECK(found.joint == 1);
  CHECK_THAT(text(found, l.arm), Contains("q2 (joint_b)") && Contains("was its motor on"));
}

TEST_CASE("a motor that is switched off midway is named with its time") {
  Logged l = logged(8701, [](cell::Cell& arm) {
    for (auto& s : arm.servo->torque) s.stiffness = 200, s.damping = 5;
  });
  const Index off = 700;
  l.log.command.bottomRows(l.log.q.rows() - off).col(1).setConstant(0.9);
  for (Index i = off; i < l.log.q.rows(); ++i)
    l.log.q(i, 1) = l.log.q(off, 1) - 1.2 * (1 - std::exp(-10 * (l.log.t[i] - l.log.t[off])));
  const LogProblem found = problem_of(l);
  CHECK(found.kind == LogProblemKind::StopsFollowing);
  CHECK(found.remedy == LogRemedy::CutLog);
  CHECK(found.joint == 1);
  CHECK(found.found == Approx(l.log.t[off]).margin(0.3));
}

}  // namespace command_checks_test
