#include <kr5/arm_log/measured_positions.hpp>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "arm_log/logged_arm.hpp"

namespace measured_positions_test {

using namespace kr5;
using namespace kr5::test;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double two_pi = 6.283185307179586;

double rms(const MatrixXd& x) { return std::sqrt(x.cwiseAbs2().mean()); }

}  // namespace

TEST_CASE("the cut-off follows the bandwidth of the motion, the stride the cut-off") {
  const VectorXd t = VectorXd::LinSpaced(20000, 0, 19.999);  // 1 kHz
  const double fastest = 0.8;                                // [Hz]
  const MatrixXd q = 0.5 * (two_pi * fastest * t.array()).sin();
  const arm_log::Smoothing found = arm_log::choose_smoothing(t, q);
  CHECK(found.cutoff > 5 * fastest);
  CHECK(found.cutoff < 15 * fastest);
  CHECK(found.smooths);
  CHECK(found.even_step == 0.0);
  CHECK(found.stride == static_cast<int>(1 / (20 * found.cutoff * 0.001)));
}

TEST_CASE("smoothing takes most of the noise of positions, and next to nothing of their motion") {
  const VectorXd t = VectorXd::LinSpaced(6000, 0, 11.998);
  const MatrixXd truth = 0.5 * (two_pi * 0.8 * t.array()).sin(), noise = 1e-4 * Random(4).normal_vector(t.size());
  const arm_log::Smoothing smoothing = arm_log::choose_smoothing(t, truth + noise);
  const arm_log::Positions smooth = arm_log::smooth_positions(t, truth + noise, smoothing);
  const Index edge = 500, inside = t.size() - 2 * edge;
  const MatrixXd left = arm_log::positions_at(smooth, t) - truth;
  // White noise in a band of 2 x cut-off of the rate of 500 Hz keeps that share of its variance.
  const double share = std::sqrt(2 * smoothing.cutoff / 500.0);
  CHECK(rms(left.middleRows(edge, inside)) < 1.5 * share * 1e-4);
}

TEST_CASE("the noise of the speeds is what smoothed positions give, each joint by its own") {
  const VectorXd t = VectorXd::LinSpaced(30000, 0, 59.998);
  MatrixXd truth(t.size(), 2);
  truth << 0.5 * (two_pi * 0.4 * t.array()).sin(), 0.02 * (two_pi * 0.1 * t.array()).sin();
  MatrixXd q = truth;
  q.col(0) += 1e-4 * Random(4).normal_vector(t.size());
  q.col(1) += 3e-3 * Random(5).normal_vector(t.size());
  const arm_log::Smoothing found = arm_log::choose_smoothing(t, q);
  const MatrixXd left = arm_log::smooth_positions(t, q, found).q - truth;
  REQUIRE(found.speed_noise.size() == 2);
  const Index edge = 2500, inside = t.size() - 2 * edge;
  const auto speed_of = [](const MatrixXd& x) -> MatrixXd { return (x.bottomRows(29998) - x.topRows(29998)) / 0.004; };
  for (const Index k : {0, 1}) {
    const double ringing = 0.01 * rms(speed_of(truth.col(k)));
    const double of_noise = rms(speed_of(left.col(k)).middleRows(edge, inside));
    CHECK(found.speed_noise[k] == Approx(std::hypot(of_noise, ringing)).epsilon(0.15));
  }
}

TEST_CASE("where a motion ends in its noise, the cut-off is lower; where readings are fine, it is not") {
  const VectorXd t = VectorXd::LinSpaced(20000, 0, 39.998);
  const MatrixXd truth = 0.5 * (two_pi * 0.4 * t.array()).sin();
  const MatrixXd coarse = truth + 1e-3 * Random(4).normal_vector(t.size());
  const double fine = arm_log::choose_smoothing(t, truth + 1e-9 * Random(4).normal_vector(t.size())).cutoff;
  const double noisy = arm_log::choose_smoothing(t, coarse).cutoff;
  CHECK(noisy < 0.7 * fine);
  CHECK(noisy > 1.2 * 0.4);
}

TEST_CASE("stamps that came late are replaced by even ones") {
  VectorXd t = VectorXd::LinSpaced(4000, 0, 7.998);
  const MatrixXd q = 0.5 * (two_pi * 0.8 * t.array()).sin();
  Random random(8);
  for (double& x : t) x += random.uniform(0.0, 9e-4);
  CHECK(arm_log::choose_smoothing(t, q).even_step == Approx(0.002).epsilon(1e-3));
}

TEST_CASE("kept rows stay away from the ends of what was smoothed, and inside their experiment") {
  const VectorXd t = VectorXd::LinSpaced(1001, 0, 10);
  const arm_log::Smoothing smoothing{.cutoff = 4.0, .stride = 2, .smooths = true};
  const auto rows = arm_log::kept_rows(t, smoothing, {2.0, 10.1}, {0.0, 10.0});
  REQUIRE(!rows.empty());
  CHECK(t[rows.front()] == Approx(2.0).margin(0.011));
  CHECK(t[rows.back()] <= 9.5 + 1e-9);  // two periods of 4 Hz
  CHECK(rows[1] - rows[0] == 2);
  CHECK(arm_log::kept_rows(t, smoothing, {0.0, 10.1}, {0.0, 10.0}, 100).size() <= 100);
}

TEST_CASE("positions that tell no motion are refused with a remedy") {
  const VectorXd t = VectorXd::LinSpaced(29, 0, 0.28);
  CHECK_THROWS_WITH(arm_log::choose_smoothing(t, MatrixXd::Zero(29, 2)),
                    Catch::Contains("found 29 rows") && Catch::Contains("log a longer motion"));
  CHECK_THROWS_AS(arm_log::choose_smoothing(t, MatrixXd::Zero(28, 2)), InvalidArgument);
}

}  // namespace measured_positions_test
