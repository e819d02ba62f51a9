#include <cmath>
#include <limits>
#include <numbers>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/current_model.hpp>
#include <kr5/identification/drives.hpp>

#include "../support/coverage.hpp"
#include "../support/trials.hpp"

namespace drives_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double deg = std::numbers::pi / 180, unread = std::numeric_limits<double>::quiet_NaN();

/// Hayat et al. 2022, table B.2: joints moved one at a time by whole turns of their motor; the others were not read.
DriveReadings book_readings() {
  const double counts[6][5] = {{16419, 32795, 49140, 65577, 81960}, {16330, 32723, 49132, 65537, 81889},
                               {16427, 32794, 49165, 65564, 81929}, {12280, 24612, 36874, 49208, 61481},
                               {12287, 24570, 36856, 49143, 61420}, {12283, 24541, 36840, 49133, 61419}};
  const double angles[6][5] = {{2.89, 5.76, 8.64, 11.53, 14.41},  {2.87, 5.75, 8.64, 11.52, 14.39},
                               {4.15, 8.28, 12.42, 16.56, 20.69}, {4.83, 9.69, 14.31, 19.37, 24.2},
                               {8.53, 17.05, 25.57, 34.1, 42.62}, {14.92, 29.81, 44.75, 59.68, 74.61}};
  DriveReadings out;
  out.counts = out.motor = out.joint = MatrixXd::Constant(30, 6, unread);
  for (Index j = 0; j < 6; ++j)
    for (Index k = 0; k < 5; ++k) {
      out.counts(5 * j + k, j) = counts[j][k];
      out.motor(5 * j + k, j) = 360.0 * deg * static_cast<double>(k + 1);
      out.joint(5 * j + k, j) = angles[j][k] * deg;
      out.group.push_back(static_cast<int>(j));
    }
  return out;
}

/// S of the book (eq. 4.54, with the digits of I-13 put right).
MatrixXd book_structure() {
  MatrixXd S = MatrixXd::Zero(6, 6);
  S.diagonal() << 125.04, 125.05, 86.98, 74.59, 42.00, 24.13;
  S(4, 3) = S(5, 3) = -1.0;
  S(5, 4) = 1.0;
  return S;
}

/// Postures all over the joints' ranges, read with the given noise [rad].
DriveReadings postures(const MatrixXd& S, int count, double noise, Random& random) {
  DriveReadings out;
  out.joint.resize(count, S.cols());
  for (Index i = 0; i < count; ++i)
    for (Index j = 0; j < S.cols(); ++j) out.joint(i, j) = random.uniform(-1.0, 1.0);
  out.motor = out.joint * S.transpose();
  out.motor.rowwise() += 3.0 * Eigen::RowVectorXd::LinSpaced(S.rows(), -1, 2);  // zeros of the encoders
  for (Index i = 0; i < out.joint.size(); ++i) out.joint(i) += random.normal(noise);
  return out;
}

}  // namespace

TEST_CASE("the book's table gives its gear ratios and names the bad reading of joint 4") {
  DriveOptions options;
  options.common_zero = true;
  const DriveResult got = identify_drives(book_readings(), options);
  REQUIRE(got.fit.usable());
  const double expected[] = {125.04, 125.05, 86.98, 74.59, 42.00, 24.13};
  const double counts[] = {16392.0, 16377.8, 16385.8, 12296.2, 12284.0, 12283.8};
  for (Index j = 0; j < 6; ++j) {
    CHECK(got.structure(j, j) == Approx(expected[j]).epsilon(0.01));
    CHECK(got.sigma(j, j) < 0.01 * expected[j]);
    CHECK(got.counts_per_turn[j] == Approx(counts[j]).epsilon(1e-3));
  }
  CHECK(got.couplings.empty());
  CHECK(got.warnings.empty());
  REQUIRE(got.unseen.size() == 30);  // no coupling can be told
  CHECK(got.unseen[0].motor == 1);
  CHECK(got.unseen[0].joint == 2);
  CHECK_THAT(got.unseen[0].text, Contains("motor 1") && Contains("whether joint 2 turns it"));
  REQUIRE(got.outliers.size() == 1);
  CHECK(got.outliers[0].motor == 4);
  CHECK(got.outliers[0].reading == 5 * 3 + 3);
  CHECK(got.outliers[0].residual == Approx(-0.2 * deg).margin(0.05 * deg));
  // T_j of eq. 4.49, in 1000 counts per degree.
  CHECK(1e-3 * deg * got.counts_per_joint(0, 0) == Approx(5.68).margin(0.02));
  CHECK(1e-3 * deg * got.counts_per_joint(5, 5) == Approx(0.82).margin(0.01));
}

TEST_CASE("couplings of the wrist are found from counts, and no others") {
  Random random(2);
  const MatrixXd S = book_structure();
  DriveReadings readings = postures(S, 40, 0.005 * deg, random);
  const VectorXd per_turn = VectorXd::Constant(6, 16384.0);
  readings.counts = readings.motor * 16384.0 / (2 * std::numbers::pi);
  readings.motor.resize(0, 0);
  DriveOptions options;
  options.counts_per_turn = per_turn;
  const DriveResult got = identify_drives(readings, options);
  REQUIRE(got.fit.usable());
  REQUIRE(got.couplings.size() == 3);
  CHECK(got.outliers.empty());
  CHECK(got.warnings.empty());
  CHECK(got.unseen.empty());
  for (Index i = 0; i < 6; ++i)
    for (Index j = 0; j < 6; ++j)
      if (S(i, j) == 0.0)
        CHECK(got.structure(i, j) == 0.0);
      else
        CHECK(got.structure(i, j) == Approx(S(i, j)).epsilon(0.01));
  options.counts_per_turn.resize(0);
  CHECK_THROWS_WITH(identify_drives(readings, options), Contains("counts_per_turn: needed"));
}

TEST_CASE("false couplings are as rare as stated, and standard deviations as large") {
  const MatrixXd S = book_structure();
  test::Coverage coverage("identify_drives: row 6 of S", 3);
  int alarms = 0;
  const int trials = test::trials(2000, 300);
  for (int k = 0; k < trials; ++k) {
    Random random(static_cast<std::uint64_t>(100 + k));
    DriveOptions options;
    options.reject_outliers = false;
    options.coupling_false_alarm = 0.01;
    const DriveResult got = identify_drives(postures(S, 25, 0.02 * deg, random), options);
    alarms += got.couplings.size() > 3;
    if (got.structure(5, 3) == 0.0 || got.structure(5, 4) == 0.0) continue;
    const Eigen::Array3i joints(3, 4, 5);
    coverage.add(got.structure.row(5)(joints).transpose() - S.row(5)(joints).transpose(),
                 got.covariance[5](joints, joints));
  }
  CHECK(coverage.trials() > 0.99 * trials);
  coverage.check_rate();
  CHECK(uncertainty::binomial_interval(alarms, trials, 0.99).low < 0.06);  // six motors of 1 % each
}

TEST_CASE("says what the readings do not tell") {
  Random random(5);
  DriveReadings readings = postures(book_structure(), 40, 0.005 * deg, random);
  readings.joint.col(2) = 0.5 * readings.joint.col(1);
  DriveResult got = identify_drives(readings);
  CHECK_FALSE(got.fit.usable());
  CHECK_THAT(got.fit.message, Contains("move independently"));
  readings = postures(book_structure(), 5, 0.0, random);
  CHECK_FALSE(identify_drives(readings).fit.usable());
  readings.motor.conservativeResize(4, 6);
  CHECK_THROWS_WITH(identify_drives(readings), Contains("expected 5 x 6 numbers, found 4 x 6"));
  CHECK_THROWS_WITH(identify_drives({}), Contains("no reading"));
  readings = postures(MatrixXd::Identity(2, 2) * 80, 30, 2.0 * deg, random);
  readings.joint *= 0.3;  // small motions under large noise
  got = identify_drives(readings);
  CHECK_FALSE(got.warnings.empty());
}

TEST_CASE("the current model gives constants within their standard deviations") {
  test::Coverage coverage("identify_current_model", 3);
  const int trials = test::trials(2000, 300);
  for (int k = 0; k < trials; ++k) {
    Random random(static_cast<std::uint64_t>(k));
    const Index n = 400;
    VectorXd torque(n), speed(n), current(n);
    double drift = 0.0;
    for (Index i = 0; i < n; ++i) {
      const double t = 0.05 * static_cast<double>(i);
      torque[i] = 60 * std::sin(0.7 * t) + 10;
      speed[i] = std::cos(1.9 * t);
      drift = 0.5 * drift + random.normal(0.05);  // correlated, as friction that changes is
      current[i] = torque[i] / 12.5 + 0.3 + 0.8 * (speed[i] > 0 ? 1 : -1) + drift;
    }
    const CurrentModel got = identify_current_model(current, torque, speed);
    REQUIRE(got.fit.usable());
    coverage.add(Eigen::Vector3d(got.torque_constant - 12.5, got.offset - 0.3, got.hysteresis - 0.8), got.covariance);
    if (k > 0) continue;
    CHECK(got.torque_constant == Approx(12.5).epsilon(0.01));
    CHECK(got.torque(got.current(33.0, -0.5), -0.5) == Approx(33.0).epsilon(1e-12));
    CHECK(got.current(0.0, 1.0) - got.current(0.0, -1.0) == Approx(1.6).epsilon(0.05));
  }
  coverage.check_rate();
}

TEST_CASE("the current model says when a motion does not show it") {
  const VectorXd wave = VectorXd::LinSpaced(50, -3, 3), one = VectorXd::Ones(50);
  CHECK_THAT(identify_current_model(wave, wave, one).fit.message, Contains("move the joint both ways"));
  CHECK_THAT(identify_current_model(wave, one, wave).fit.message, Contains("different torques"));
  CHECK_THAT(identify_current_model(wave.head(5), wave.head(5), wave.head(5)).fit.message, Contains("5 samples"));
  CHECK_THROWS_WITH(identify_current_model(wave, wave.head(20), wave), Contains("found 50, 20 and 50 samples"));
}

}  // namespace drives_test
