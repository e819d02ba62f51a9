#include <kr5/arm_log/reading_noise.hpp>

#include <catch2/catch.hpp>

#include <kr5/arm_log/diagnose_log.hpp>

#include "arm_log/logged_arm.hpp"

namespace reading_noise_test {

using namespace kr5;
using namespace kr5::test;
using Eigen::VectorXd;

TEST_CASE("the noise of readings is found on a smooth course, and the step of coarse ones") {
  const VectorXd t = VectorXd::LinSpaced(2000, 0, 20);
  const VectorXd smooth = 30 * (1.3 * t.array()).sin();
  const double sigma = 0.25;
  const VectorXd noisy = smooth + Random(2).normal_vector(t.size(), sigma);
  CHECK(arm_log::noise_of_readings({noisy}) == Approx(sigma).epsilon(0.08));
  CHECK(arm_log::noise_of_readings({noisy.head(900), noisy.tail(900)}) == Approx(sigma).epsilon(0.12));
  const double step = 0.5;
  const VectorXd coarse = (smooth / step).array().round() * step;
  CHECK(arm_log::noise_of_readings({coarse}) >= Approx(step / std::sqrt(12.0)));
  CHECK(arm_log::noise_of_readings({VectorXd::Constant(50, 3.0)}) == 1e-9);
  CHECK(arm_log::noise_of_readings({}) == 1e-9);
}

TEST_CASE("a model without noise gets that of its log, joint by joint") {
  const LoggedMotionOptions options;
  const arm_log::LogRecording prepared = arm_log::prepare_log(logged(moved_arm(), options), described_arm());
  const auto& sigma = prepared.recording.cell.noise.joint_torque;
  REQUIRE(sigma.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) CHECK(sigma[k] == Approx(options.noise[k]).epsilon(0.1));
}

TEST_CASE("noise that a model states stays") {
  cell::Cell model = described_arm();
  model.noise.joint_torque = {1.0, 2.0, 3.0};
  const arm_log::LogRecording prepared = arm_log::prepare_log(logged(moved_arm()), model);
  CHECK(prepared.recording.cell.noise.joint_torque == std::vector<double>{1.0, 2.0, 3.0});
}

TEST_CASE("noise of torques follows from that of the currents, which a cell states") {
  cell::Cell model = arm_cell({"rrr"});
  model.servo.reset();
  model.noise = {};
  model.noise.current = 0.03;
  arm_log::LogRecording prepared = arm_log::record_log(logged(moved_arm()), model);
  const auto notes = arm_log::add_reading_noise(prepared.recording, prepared.readings);
  REQUIRE(notes.front().kind == arm_log::LogNoteKind::TorqueNoise);
  const cell::Drives& d = *model.drives;
  const Eigen::MatrixXd share = d.structure.transpose() * d.torque_constant.asDiagonal();
  for (int k = 0; k < 3; ++k)
    CHECK(prepared.recording.cell.noise.joint_torque[static_cast<std::size_t>(k)] ==
          Approx(0.03 * share.row(k).norm()));
}

TEST_CASE("noise of a long log is that of its rows, not of those that are left of them") {
  const LoggedMotionOptions options{.rows = 60000};  // 600 s at 100 Hz
  const arm_log::LogRecording prepared = arm_log::prepare_log(logged(moved_arm(), options), described_arm());
  const auto& sigma = prepared.recording.cell.noise.joint_torque;
  for (std::size_t k = 0; k < 3; ++k) CHECK(sigma[k] == Approx(options.noise[k]).epsilon(0.1));
}

}  // namespace reading_noise_test
