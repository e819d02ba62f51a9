#include <kr5/rsi/controller_axes.hpp>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/rsi/controller_files.hpp>
#include <kr5/rsi/link_diagnosis.hpp>
#include <kr5/rsi/link_rows.hpp>
#include <kr5/rsi/link_session.hpp>

#include "emulated_arm.hpp"
#include "plain_controller.hpp"

using namespace kr5;
using namespace kr5::rsi;
using kr5::test::deg;
using kr5::test::plain_value;

namespace controller_axes_test {

ControllerAxes drawn(std::mt19937& random) {
  ControllerAxes out{Eigen::VectorXd(6), Eigen::VectorXd(6)};
  for (int i = 0; i < 6; ++i) {
    out.sign[i] = random() % 2 ? 1 : -1;
    out.zero[i] = (static_cast<double>(random() % 4) - 1) * M_PI / 2;
  }
  return out;
}

TelegramLayout counted(const ControllerAxes& axes) {
  TelegramLayout out = usual_layout(Controller::Krc4);
  out.current_units.assign(6, 0.5);
  out.axes = axes;
  return out;
}

std::string axis_name(int axis) { return "A" + std::to_string(axis + 1); }

TEST_CASE("places, differences and currents of axes are those of joints again") {
  std::mt19937 random(1);
  for (int trial = 0; trial < 50; ++trial) {
    const ControllerAxes axes = drawn(random);
    const TelegramUnits units(counted(axes)), plain(usual_layout(Controller::Krc4));
    ControllerState state;
    state.joints = test::bent_joints();
    state.joint_setpoints = -0.5 * test::bent_joints();
    state.currents = test::bent_joints();
    Telegram t;
    units.set_state(state, t);
    t.present.set();
    const ControllerState again = units.state(t);
    CHECK(again.joints.isApprox(state.joints, 1e-12));
    CHECK(again.joint_setpoints.isApprox(state.joint_setpoints, 1e-12));
    CHECK(again.currents.isApprox(state.currents, 1e-12));
    const Eigen::VectorXd counts = axes.axes(state.joints);
    CHECK(Eigen::VectorXd(plain.state(t).joints).isApprox(counts, 1e-12));
    CHECK(axes.joints(counts).isApprox(Eigen::VectorXd(state.joints), 1e-12));
    Correction correction;
    correction.joints = test::bent_joints();
    units.set_correction(correction, t);
    CHECK(units.correction(t).joints.isApprox(correction.joints, 1e-12));
    const Eigen::VectorXd asked = axes.sign.cwiseProduct(Eigen::VectorXd(correction.joints));
    CHECK(Eigen::VectorXd(plain.correction(t).joints).isApprox(asked, 1e-12));
  }
}

/// A controller of some layout at whose other end a link of some layout goes to joint values.
struct Loop {
  Loop(const TelegramLayout& of_controller, const TelegramLayout& of_link)
      : controller(of_controller, test::six_joints(), wide(), robot),
        link(of_link, test::six_joints(), {}, [this](const robot::RobotReading& r) noexcept {
          reading = r;
          robot::RobotCommand out;
          out.space = robot::CommandSpace::Joints;
          out.joints = goal;
          return out;
        }) {}

  static EmulationOptions wide() {
    EmulationOptions out;
    out.rules.axis_limit = 1.0;
    return out;
  }
  void run(int cycles) {
    for (int i = 0; i < cycles; ++i) {
      telegram = std::string(controller.cycle());
      answer = std::string(link.answer(telegram, 1, now += 4'000'000));
      controller.receive(answer, 0.001);
    }
  }

  robot::LoopbackRobot robot = test::prompt_robot();
  robot::JointVector goal = test::bent_joints() + 2 * deg * robot::JointVector::Ones(6);
  robot::RobotReading reading;
  EmulatedController controller;
  LinkSession link;
  std::string telegram, answer;
  std::int64_t now = 0;
};

TEST_CASE("a link goes where it shall with a controller that counts its axes otherwise") {
  std::mt19937 random(2);
  for (int trial = 0; trial < 20; ++trial) {
    const ControllerAxes axes = drawn(random);
    Loop loop(counted(axes), counted(axes));
    loop.run(400);
    CHECK((Eigen::VectorXd(loop.robot.read().joints) - Eigen::VectorXd(loop.goal)).cwiseAbs().maxCoeff() < 1e-5);
    CHECK((Eigen::VectorXd(loop.reading.joints) - Eigen::VectorXd(loop.goal)).cwiseAbs().maxCoeff() < 1e-5);
    CHECK(loop.link.statistics().refused == 0);
    const Eigen::VectorXd counts = axes.axes(loop.goal);
    for (int i = 0; i < 6; ++i) {
      CHECK(plain_value(loop.telegram, "AIPos", axis_name(i)) == Approx(counts[i] / deg).margin(2e-4));
      CHECK(plain_value(loop.answer, "AKorr", axis_name(i)) == Approx(2 * axes.sign[i]).margin(1e-3));
    }
  }
}

TEST_CASE("a link that does not know the directions of the axes goes elsewhere") {
  ControllerAxes turned{Eigen::VectorXd::Ones(6), Eigen::VectorXd::Zero(6)};
  turned.sign[2] = -1;
  Loop loop(counted(turned), usual_layout(Controller::Krc4));
  loop.run(400);
  CHECK(std::abs(loop.robot.read().joints[2] - loop.goal[2]) > 1 * deg);
}

TEST_CASE("without a mapping, and with that of the joints themselves, telegrams are the same, byte by byte") {
  const ControllerAxes same{Eigen::VectorXd::Ones(6), Eigen::VectorXd::Zero(6)};
  TelegramLayout plain = counted(same);
  plain.axes.reset();
  Loop with(counted(same), counted(same)), without(plain, plain);
  for (int i = 0; i < 100; ++i) {
    with.run(1);
    without.run(1);
    REQUIRE((with.telegram == without.telegram && with.answer == without.answer));
  }
}

TEST_CASE("rows of a log hold joint values, and the pose fits them") {
  std::mt19937 random(3);
  const TelegramLayout layout = counted(drawn(random));
  Loop loop(layout, layout);
  LinkObservations seen;
  for (int i = 0; i < 60; ++i) {
    loop.run(1);
    seen.exchanges.push_back({.time = 0.004 * i, .sender = "c", .telegram = loop.telegram, .answer = loop.answer});
  }
  LinkRowReader reader(layout);
  const LinkRows rows = reader.read(seen);
  REQUIRE(rows.values.rows() == 60);
  const auto q1 = std::ranges::find(reader.names(), "q1") - reader.names().begin();
  const Eigen::VectorXd last = rows.values.row(59).segment(q1, 6);
  CHECK((last - Eigen::VectorXd(loop.controller.reading().joints)).cwiseAbs().maxCoeff() < 2e-6);
  DiagnosisOptions options;
  options.model = test::six_joints();
  const auto mismatch = [&](const TelegramLayout& of) {
    return std::ranges::any_of(examine_link(seen, of, options).findings,
                               [](const LinkFinding& f) { return f.kind == LinkFindingKind::PoseMismatch; });
  };
  CHECK_FALSE(mismatch(layout));
  CHECK(mismatch(usual_layout(Controller::Krc4)));
}

TEST_CASE("the program of a controller starts at its own axis values") {
  ControllerAxes axes{Eigen::VectorXd::Ones(6), Eigen::VectorXd::Zero(6)};
  axes.sign[1] = -1;
  axes.zero[2] = M_PI / 2;
  const ProgramOptions options{.start = {0.0, -M_PI / 2, M_PI / 2, 0.0, M_PI / 4, 0.0}};
  const auto source = [&](const TelegramLayout& layout) { return controller_files(layout, options).files[0].text; };
  CHECK_THAT(source(usual_layout(Controller::Krc4)), Catch::Contains("PTP {A1 0, A2 -90, A3 90, A4 0, A5 45, A6 0}"));
  CHECK_THAT(source(counted(axes)), Catch::Contains("PTP {A1 0, A2 90, A3 0, A4 0, A5 45, A6 0}"));
}

TEST_CASE("a mapping of axes is checked by its names") {
  const auto refused = [](ControllerAxes axes, const std::string& field) {
    CHECK_THROWS_WITH(counted(axes).validate(), Catch::StartsWith(field));
  };
  refused({Eigen::VectorXd::Ones(5), Eigen::VectorXd::Zero(6)}, "axes.sign");
  refused({Eigen::VectorXd::Ones(6), Eigen::VectorXd::Zero(7)}, "axes.zero");
  refused({Eigen::VectorXd::Constant(6, 2.0), Eigen::VectorXd::Zero(6)}, "axes.sign");
  refused({Eigen::VectorXd::Ones(6), Eigen::VectorXd::Constant(6, NAN)}, "axes.zero");
}

}  // namespace controller_axes_test
