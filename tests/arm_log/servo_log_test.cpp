#include <kr5/arm_log/diagnose_log.hpp>

#include <algorithm>
#include <cmath>
#include <functional>

#include <catch2/catch.hpp>

#include <kr5/arm_log/log_recording.hpp>
#include <kr5/arm_log/servo_fit.hpp>
#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

#include "arm_log/servo_arms.hpp"
#include "gap/diagnosis_matchers.hpp"

namespace servo_log_test {

using namespace kr5;
using namespace kr5::test;
using Catch::Matchers::Contains;

namespace {

struct Change {
  const char* effect;
  std::function<void(cell::Cell&, int joint, Random&)> make;
};

cell::TorqueServo& servo_of(cell::Cell& arm, int joint) { return arm.servo->torque[static_cast<std::size_t>(joint)]; }

/// The arm of a seed, changed against its model, is diagnosed from commands and positions. Its motors turn at most at 4
/// rad/s, which no motion of it reaches.
arm_log::LogDiagnosis diagnosed(std::uint64_t seed, const Change* change, std::string& target) {
  Random random(seed);
  cell::Cell model = servo_arm(4, random);
  for (cell::TorqueServo& servo : model.servo->torque) servo.stall_torque = 2.0, servo.no_load_speed = 4.0;
  cell::Cell arm = model;
  const int joint = random.integer(4);
  target = "joint" + std::to_string(joint + 1);
  if (change) change->make(arm, joint, random);
  return arm_log::diagnose_log(servo_log(arm, random), model);
}

/// The change is named first, on the target, if that is not the joint that was drawn, and explains the log.
void check_named(std::uint64_t seed, const Change& change, const std::string& on = "") {
  std::string drawn;
  const gap::Diagnosis found = diagnosed(seed, &change, drawn).diagnosis;
  const std::string target = on.empty() ? drawn : on;
  INFO(change.effect << "." << target << ": " << text(found));
  REQUIRE(!found.causes.empty());
  CHECK(cause_matches(found.causes[0], {change.effect, target}));
  CHECK(found.verdict == gap::Verdict::Explained);
}

}  // namespace

TEST_CASE("what is wrong with a servo or its friction is named from commands and rounded positions",
          "[not_sanitized]") {
  const Change changes[] = {
      {"servo_stiffness",
       [](cell::Cell& arm, int j, Random& r) { servo_of(arm, j).stiffness *= r.uniform(0.5, 0.75); }},
      {"servo_damping", [](cell::Cell& arm, int j, Random& r) { servo_of(arm, j).damping *= r.uniform(1.8, 2.5); }},
      {"coulomb_friction",
       [](cell::Cell& arm, int j, Random& r) { arm.drives->friction.coulomb[j] += r.uniform(0.15, 0.3); }},
      {"servo_dead_band",
       [](cell::Cell& arm, int j, Random& r) { servo_of(arm, j).dead_band = r.uniform(0.01, 0.02); }},
  };
  const int k = GENERATE(0, 1, 2, 3);
  check_named(7100 + static_cast<std::uint64_t>(k), changes[k]);
}

TEST_CASE("friction of other laws is named from commands and rounded positions", "[long][not_sanitized]") {
  const auto set = [](cell::Cell& arm, const char* effect, int j, const char* parameter, double value) {
    cell::set_effect(arm, effect, "joint" + std::to_string(j + 1), parameter, value);
  };
  const Change changes[] = {
      {"quadratic_drag",
       [&](cell::Cell& arm, int j, Random& r) { set(arm, "quadratic_drag", j, "quadratic", r.uniform(0.15, 0.3)); }},
      {"angle_friction",
       [&](cell::Cell& arm, int j, Random& r) {
         set(arm, "angle_friction", j, "amplitude", r.uniform(0.15, 0.3));
         set(arm, "angle_friction", j, "cycles", 3.0 + r.integer(4));
         set(arm, "angle_friction", j, "phase", r.uniform(-3.0, 3.0));
       }},
      {"torque_dead_band",
       [](cell::Cell& arm, int j, Random& r) { servo_of(arm, j).torque_dead_band = r.uniform(0.15, 0.3); }},
  };
  const int k = GENERATE(0, 1, 2);
  check_named(7500 + static_cast<std::uint64_t>(k), changes[k]);
}

TEST_CASE("a load that drives its gear and a low supply are named in a joint that carries the arm", "[not_sanitized]") {
  const Change changes[] = {{"driven_friction",
                             [](cell::Cell& arm, int, Random& r) {
                               cell::set_effect(arm, "driven_friction", "joint2", "coefficient", r.uniform(0.3, 0.5));
                             }},
                            // Without a load it is nearly a lower limit of torque with more viscous friction.
                            {"servo_voltage", [](cell::Cell& arm, int, Random& r) {
                               cell::set_effect(arm, "servo_voltage", "joint2", "voltage", r.uniform(0.3, 0.45));
                             }}};
  const int k = GENERATE(0, 1);
  check_named(7510 + static_cast<std::uint64_t>(k), changes[k], "joint2");
}

TEST_CASE("an arm that is as its model says has no gap in commands and rounded positions", "[not_sanitized]") {
  std::string target;
  const arm_log::LogDiagnosis found = diagnosed(7200, nullptr, target);
  INFO(text(found.diagnosis));
  CHECK(found.diagnosis.verdict == gap::Verdict::NoGap);
}

TEST_CASE("servos of another scale, friction and rotors that a model lacks are named joint by joint",
          "[not_sanitized]") {
  const auto seed = static_cast<std::uint64_t>(GENERATE(7801, 7802, 7803));
  Random random(seed);
  const cell::Cell arm = servo_arm(4, random), model = ignorant(arm, random);
  INFO("stiffness of the model " << model.servo->torque[0].stiffness);
  const gap::Diagnosis found = arm_log::diagnose_log(servo_log(arm, random), model).diagnosis;
  INFO(text(found));
  CHECK(found.verdict == gap::Verdict::Explained);
  CHECK(found.effects_limit == 0);
  const auto value_of = [&](const std::string& effect, int joint) {
    for (const gap::Cause& cause : found.causes)
      if (cause.effect == effect && cause.target == "joint" + std::to_string(joint + 1))
        return cause.parameters.front().value[0];
    return std::nan("");
  };
  for (const gap::Cause& cause : found.causes)
    CHECK(std::ranges::find(arm_log::servo_effects(), cause.effect) != arm_log::servo_effects().end());
  for (int j = 1; j < 4; ++j) {  // joint 1 turns about the vertical: its links are too light to tell its gains apart
    INFO("joint " << j + 1);
    CHECK(value_of("servo_stiffness", j) ==
          Approx(arm.servo->torque[static_cast<std::size_t>(j)].stiffness).epsilon(0.05));
    CHECK(value_of("coulomb_friction", j) == Approx(arm.drives->friction.coulomb[j]).epsilon(0.1));
    CHECK(value_of("rotor_inertia", j) == Approx(arm.drives->rotor_inertia[j]).epsilon(0.1));
  }
}

TEST_CASE("of servos that move as no law describes, what is sure is named beside what is left", "[not_sanitized]") {
  Random random(7851);
  const cell::Cell arm = servo_arm(2, random);
  cell::Cell model = ignorant(arm, random);
  for (cell::TorqueServo& servo : model.servo->torque) servo = {.stiffness = 500.0, .damping = 5.0};
  arm_log::ArmLog log = servo_log(arm, random);
  for (Eigen::Index i = 0; i < log.t.size(); ++i)  // of whatever the arm stands on
    for (int j = 0; j < 2; ++j) log.q(i, j) += 0.06 * std::sin(2.9 * log.t[i] + j) * std::sin(0.31 * log.t[i]);
  const gap::Diagnosis found = arm_log::diagnose_log(log, model).diagnosis;
  INFO(text(found));
  CHECK(found.verdict == gap::Verdict::PartlyExplained);
  CHECK(names_cause(found, "servo_stiffness", "joint2"));
  const std::vector<std::string> own = arm_log::servo_effects();
  for (const gap::Cause& cause : found.causes) CHECK(std::ranges::find(own, cause.effect) != own.end());
}

TEST_CASE("commands and positions alone need a model that states its servos") {
  Random random(7300);
  cell::Cell arm = servo_arm(3, random);
  const arm_log::ArmLog log = servo_log(arm, random, 10.0);
  CHECK_NOTHROW(arm_log::record_log(log, arm));
  arm.servo.reset();
  CHECK_THROWS_WITH(arm_log::record_log(log, arm), Contains("servo.torque"));
}

TEST_CASE("what torques are measured by is told where no efforts were logged") {
  Random random(7310);
  const cell::Cell arm = servo_arm(2, random);
  const auto tells = [](const std::vector<arm_log::LogNote>& notes) {
    return std::ranges::any_of(
        notes, [](const arm_log::LogNote& note) { return note.kind == arm_log::LogNoteKind::TorqueScale; });
  };
  arm_log::LogRecording found = arm_log::prepare_log(servo_log(arm, random, 10.0), arm, {});
  CHECK(tells(found.notes));
  for (cell::Experiment& e : found.recording.experiments)
    for (const char* name : {"tau1", "tau2"}) {
      e.data.columns.push_back(name);
      e.data.values.conservativeResize(Eigen::NoChange, e.data.values.cols() + 1);
      e.data.values.rightCols(1).setZero();
    }
  CHECK_FALSE(tells(arm_log::complete_model(found.recording, found.readings, true)));
}

TEST_CASE("a soft servo needs longer to forget how a motion began, and a late one by its delay") {
  Random random(7400);
  cell::Cell arm = servo_arm(2, random);
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(2);
  const double usual = arm_log::settle_time(arm, q);
  CHECK(usual > 0.0);
  for (cell::TorqueServo& servo : arm.servo->torque) servo.delay = 0.25;
  CHECK(arm_log::settle_time(arm, q) == Approx(usual + 0.25));
  arm.servo.reset();
  CHECK(arm_log::settle_time(arm, q) == 0.0);
}

}  // namespace servo_log_test
