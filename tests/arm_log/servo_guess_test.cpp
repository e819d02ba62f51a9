#include "arm_log/servo_guess.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/arm_log/log_recording.hpp>
#include <kr5/core/error.hpp>

#include "arm_log/servo_arms.hpp"

namespace servo_guess_test {

using namespace kr5;
using namespace kr5::test;
using Eigen::VectorXd;

TEST_CASE("gains are guessed from a motion within a factor of two, whatever the model states") {
  Random random(7801);
  const cell::Cell arm = servo_arm(3, random);
  const double factor = GENERATE(0.05, 40.0);
  cell::Recording recording = arm_log::record_log(servo_log(arm, random), arm).recording;
  for (cell::TorqueServo& servo : recording.cell.servo->torque)
    servo = {.stiffness = factor * 20.0, .damping = factor * 0.2};
  std::vector<double> told;
  const cell::Cell guess = arm_log::guess_servos(arm_log::moving_part(recording, 8.0), predict::FastSimulator(), 1,
                                                 [&](double share) { told.push_back(share); });
  for (int j = 0; j < 3; ++j) {
    INFO("joint " << j + 1 << ": " << guess.servo->torque_of(j).stiffness << " for "
                  << arm.servo->torque_of(j).stiffness);
    CHECK(std::abs(std::log(guess.servo->torque_of(j).stiffness / arm.servo->torque_of(j).stiffness)) < std::log(2.0));
  }
  CHECK(std::ranges::is_sorted(told));
  CHECK(told.back() == Approx(1.0));
}

TEST_CASE("the part of a recording in which the joints move most is taken, and enters in motion") {
  Random random(7802);
  const cell::Cell arm = servo_arm(2, random);
  cell::Experiment e;
  e.name = "motion-1";
  e.data.columns = {"t", "qc1", "qc2", "q1", "q2"};
  const VectorXd t = VectorXd::LinSpaced(3000, 0.0, 35.988);
  e.data.values = Eigen::MatrixXd::Zero(t.size(), 5);
  e.data.values.col(0) = t;
  e.data.values.col(1) = (t.array() > 20.0 && t.array() < 26.0).select((5.0 * t.array()).sin(), 0.0);
  cell::Recording recording;
  recording.cell = arm;
  recording.experiments = {e};
  const cell::Recording part = arm_log::moving_part(recording, 6.0);
  REQUIRE(part.experiments.size() == 1);
  const VectorXd found = part.experiments[0].data.column("t");
  CHECK(found[0] > 19.0);
  CHECK(found[0] < 21.5);
  CHECK(found[found.size() - 1] - found[0] == Approx(6.0).margin(0.05));
  CHECK(part.experiments[0].lead_in.values.rows() > 50);
  recording.experiments[0].split = cell::Split::Check;
  CHECK_THROWS_AS(arm_log::moving_part(recording, 6.0), InvalidArgument);
}

}  // namespace servo_guess_test
