#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/log_conditioning.hpp>
#include <kr5/identification/zero_phase.hpp>

namespace log_conditioning_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double step = 0.004;

/// Position, speed and acceleration of joint j, by formula.
double course(Index j, double t, int derivative) {
  const double w = 1.1 + 0.37 * static_cast<double>(j), p = 0.4 * static_cast<double>(j);
  const auto wave = [&](double amplitude, double w, double p) {
    const double scale = amplitude * std::pow(w, derivative);
    return scale * std::sin(w * t + p + derivative * std::numbers::pi / 2);
  };
  return wave(0.9, w, p) + wave(0.3, 2.7 * w, 1.3 + p) + wave(0.15, 5.1 * w, 0.2);
}

/// Three joints that move without being coupled, with gravity, inertia and friction, and noise on what is logged.
JointLog sound_log(std::uint64_t seed = 1, double noise = 1.0) {
  constexpr Index n = 5000, joints = 3;
  Random random(seed);
  JointLog log;
  log.t.resize(n);
  log.q = log.qd = log.tau = MatrixXd::Zero(n, joints);
  for (Index i = 0; i < n; ++i) {
    log.t[i] = step * static_cast<double>(i);
    for (Index j = 0; j < joints; ++j) {
      const double q = course(j, log.t[i], 0), qd = course(j, log.t[i], 1), qdd = course(j, log.t[i], 2);
      log.q(i, j) = q + random.normal(2e-5 * noise);
      log.qd(i, j) = qd + random.normal(2e-3 * noise);
      log.tau(i, j) =
          3.0 * qdd + 40.0 * std::cos(q) + 4.0 * std::tanh(qd / 0.002) + 2.0 * qd + random.normal(0.5 * noise);
    }
  }
  return log;
}

/// The only error that is found, if it is of the kind.
LogFinding only_error(const JointLog& log, LogFault fault, const ConditioningOptions& options = {}) {
  LogFinding out;
  int errors = 0;
  for (const LogFinding& f : check_log(log, options)) {
    INFO(f.text);
    if (f.severity != LogSeverity::Error) continue;
    CHECK(f.fault == fault);
    out = f;
    ++errors;
  }
  CHECK(errors == 1);
  const ConditionedMotion refused = condition_log(log, options);
  CHECK_FALSE(refused.usable());
  CHECK(refused.motion.samples() == 0);
  CHECK(refused.message == out.text);
  return out;
}

}  // namespace

TEST_CASE("the low-pass has the squared gain of a Butterworth filter and no delay") {
  constexpr double h = 0.002;
  for (const int order : {1, 3, 4, 7}) {
    for (const double f : {3.0, 20.0, 55.0}) {
      MatrixXd x(6000, 1);
      for (Index i = 0; i < x.rows(); ++i) x(i, 0) = std::sin(2 * std::numbers::pi * f * h * static_cast<double>(i));
      const MatrixXd y = zero_phase_low_pass(x, h, 20.0, order);
      const auto warped = [&](double g) { return std::tan(std::numbers::pi * g * h); };
      const double gain = 1 / (1 + std::pow(warped(f) / warped(20.0), 2 * order));
      const auto middle = Eigen::seqN(1500, 3000);
      CHECK((y(middle, 0) - gain * x(middle, 0)).cwiseAbs().maxCoeff() < 1e-6);
    }
  }
}

TEST_CASE("the low-pass keeps constants, and lines up to their ends") {
  MatrixXd x(400, 2);
  for (Index i = 0; i < x.rows(); ++i) x.row(i) << 5.0, 0.01 * static_cast<double>(i) - 1;
  const MatrixXd y = zero_phase_low_pass(x, 0.01, 2.0, 4);
  CHECK((y.col(0).array() - 5.0).abs().maxCoeff() < 1e-12);
  CHECK((y.col(1) - x.col(1)).cwiseAbs().maxCoeff() < 1e-3);
  CHECK_THROWS_WITH(zero_phase_low_pass(x, 0.01, 50.0, 4), Contains("cutoff") && Contains("50.0"));
}

TEST_CASE("differences are exact for parabolas, their ends included") {
  MatrixXd x(9, 1), first(9, 1);
  for (Index i = 0; i < 9; ++i) {
    const double t = 0.1 * static_cast<double>(i);
    x(i, 0) = 3 * t * t - t + 2;
    first(i, 0) = 6 * t - 1;
  }
  CHECK((central_differences(x, 0.1) - first).cwiseAbs().maxCoeff() < 1e-12);
  CHECK((second_differences(x, 0.1).array() - 6).abs().maxCoeff() < 1e-11);
}

TEST_CASE("a sound log gives the motion that was made") {
  const ConditionedMotion got = condition_log(sound_log());
  INFO(got.message);
  for (const LogFinding& f : got.findings) UNSCOPED_INFO(f.text);
  REQUIRE(got.usable());
  CHECK(got.findings.empty());
  CHECK_NOTHROW(got.motion.validate());
  CHECK(got.cutoff > 3.0);
  CHECK(got.cutoff < 15.0);
  double qd = 0, qdd = 0;
  for (Index i = 0; i < got.motion.samples(); ++i)
    for (Index j = 0; j < 3; ++j) {
      qd = std::max(qd, std::abs(got.motion.qd(i, j) - course(j, got.motion.t[i], 1)));
      qdd = std::max(qdd, std::abs(got.motion.qdd(i, j) - course(j, got.motion.t[i], 2)));
    }
  CHECK(qd < 0.01);  // of up to 3 rad/s
  CHECK(qdd < 0.6);  // of up to 10 rad/s^2; of the noise of unfiltered differences it is a fifth of one sigma
  CHECK(got.tau_measured.rows() == got.motion.samples());
}

TEST_CASE("decimation, cut-off and logged speeds are taken as asked for") {
  ConditioningOptions options;
  options.cutoff = 8.0;
  options.decimation = 7;
  options.speeds = SpeedSource::Logged;
  const ConditionedMotion got = condition_log(sound_log(), options);
  REQUIRE(got.usable());
  CHECK(got.motion.t[1] - got.motion.t[0] == Approx(7 * step));
  CHECK(got.cutoff == 8.0);
  options.cutoff = 200.0;
  CHECK_THROWS_WITH(condition_log(sound_log(), options), Contains("cutoff"));
}

TEST_CASE("torques that are not smoothed are those of the log, at its own rate") {
  ConditioningOptions options;
  const ConditionedMotion smooth = condition_log(sound_log(), options);
  options.smooth_torques = false;
  const ConditionedMotion raw = condition_log(sound_log(), options);
  CHECK(raw.decimation == 1);
  CHECK(smooth.decimation > 1);
  CHECK((raw.motion.tau - raw.tau_measured).norm() == 0.0);
  const Index first = static_cast<Index>(std::lround(raw.motion.t[0] / step));
  CHECK((raw.motion.tau - sound_log().tau.middleRows(first, raw.motion.samples())).norm() == 0.0);
  options.decimation = 3;
  CHECK(condition_log(sound_log(), options).decimation == 3);
}

TEST_CASE("gaps end runs; doubles and disorder are repaired and told") {
  JointLog log = sound_log();
  const JointLog whole = log;
  std::vector<Index> rows;
  for (Index i = 0; i < log.t.size(); ++i)
    if (i < 2000 || i >= 2400) rows.push_back(i);
  rows.insert(rows.begin() + 100, 99);  // twice
  std::swap(rows[301], rows[302]);
  log.t = whole.t(rows);
  log.q = whole.q(rows, Eigen::all), log.qd = whole.qd(rows, Eigen::all), log.tau = whole.tau(rows, Eigen::all);
  const ConditionedMotion got = condition_log(log);
  REQUIRE(got.usable());
  CHECK_NOTHROW(got.motion.validate());
  CHECK(got.motion.run_starts.size() == 2);
  std::string kinds;
  for (const LogFinding& f : got.findings) kinds += std::string(name_of(f.fault)) + " ";
  CHECK(kinds == "clock_backward clock_duplicate clock_gap ");
  CHECK(got.findings[2].begin == Approx(1999 * step));
  CHECK(got.findings[2].end == Approx(2400 * step));
}

TEST_CASE("late stamps are told from samples at uneven times") {
  for (const bool stamps_true : {false, true}) {
    JointLog log = sound_log(1, 0.1);
    Random random(4);
    for (Index i = 0; i < log.t.size(); ++i) {
      const double taken = log.t[i] + random.uniform(0, 0.4 * step);
      if (stamps_true)
        for (Index j = 0; j < 3; ++j) {
          log.q(i, j) += course(j, taken, 0) - course(j, log.t[i], 0);
          log.qd(i, j) += course(j, taken, 1) - course(j, log.t[i], 1);
        }
      log.t[i] = taken;
    }
    const ConditionedMotion got = condition_log(log);
    REQUIRE(got.usable());
    CHECK(got.even_clock != stamps_true);
    REQUIRE(got.findings.size() == 1);
    CHECK(got.findings[0].fault == LogFault::ClockJitter);
    double qd = 0;
    for (Index i = 0; i < got.motion.samples(); ++i)
      qd = std::max(qd, std::abs(got.motion.qd(i, 1) - course(1, got.motion.t[i], 1)));
    CHECK(qd < 0.03);  // late stamps leave a delay of their mean, 0.8 ms
  }
}

TEST_CASE("names missing numbers with column and span, and leaves them out when asked to") {
  JointLog log = sound_log();
  log.tau_names = {"a", "Motor 2", "c"};
  log.tau(700, 1) = std::numeric_limits<double>::quiet_NaN();
  log.tau(900, 1) = std::numeric_limits<double>::infinity();
  const LogFinding f = only_error(log, LogFault::NotFinite);
  CHECK_THAT(f.text, Contains("Motor 2: no number in 2 of 5000 rows, first in row 701"));
  CHECK(f.begin == Approx(700 * step));
  CHECK(f.end == Approx(900 * step));
  ConditioningOptions options;
  options.leave_out_faulty = true;
  CHECK(condition_log(log, options).usable());
}

TEST_CASE("tells degrees from radians, in positions and in speeds") {
  JointLog log = sound_log();
  log.q *= 180 / std::numbers::pi;
  log.qd *= 180 / std::numbers::pi;
  const auto found = check_log(log);
  REQUIRE_FALSE(found.empty());
  CHECK(found[0].fault == LogFault::Degrees);
  CHECK(found[0].severity == LogSeverity::Error);
  CHECK_THAT(found[0].text, Contains("q1") && Contains("degrees for radians?"));
  JointLog speeds = sound_log();
  speeds.qd *= 180 / std::numbers::pi;
  const auto wrong = check_log(speeds);
  REQUIRE(wrong.size() == 3);
  CHECK(wrong[1].fault == LogFault::SpeedScale);
  CHECK_THAT(wrong[1].text, Contains("qd2") && Contains("degrees per second"));
  CHECK(wrong[1].value == Approx(57.3).epsilon(0.02));
}

TEST_CASE("names a speed that is not the derivative of its position") {
  JointLog log = sound_log();
  log.qd.col(1) *= -1;
  CHECK(only_error(log, LogFault::SpeedSign).joint == 2);
  log = sound_log();
  log.qd.col(2) *= 1.2;
  CHECK(only_error(log, LogFault::SpeedScale).value == Approx(1.2).epsilon(0.01));
  log = sound_log();
  log.qd.col(0) = log.qd.col(1);
  CHECK_THAT(only_error(log, LogFault::SpeedUnrelated).text, Contains("that of q2: columns are swapped"));
  log = sound_log();
  log.qd = MatrixXd(log.qd.bottomRows(4960));  // the others 40 rows, 160 ms, later
  log.q = MatrixXd(log.q.topRows(4960)), log.tau = MatrixXd(log.tau.topRows(4960));
  log.t = VectorXd(log.t.head(4960));
  const ConditionedMotion early = condition_log(log);
  CHECK(early.usable());
  REQUIRE(early.findings.size() == 3);
  CHECK(early.findings[0].fault == LogFault::SpeedDelay);
  CHECK(early.findings[0].value == Approx(-0.16).margin(0.002));
  ConditioningOptions logged;
  logged.speeds = SpeedSource::Logged;
  CHECK_FALSE(condition_log(log, logged).usable());
}

TEST_CASE("names a joint that never moved") {
  JointLog log = sound_log();
  log.q.col(1).setConstant(0.3);
  log.qd.col(1).setZero();
  log.tau.col(1) = log.tau.col(1).array() * 0 + 40 * std::cos(0.3);
  Random random(3);
  log.tau.col(1) += random.normal_vector(5000, 0.5);
  const ConditionedMotion got = condition_log(log);
  REQUIRE(got.usable());
  REQUIRE(got.findings.size() == 1);
  CHECK(got.findings[0].fault == LogFault::NeverMoved);
  CHECK(got.findings[0].joint == 2);
  log.qd = sound_log().qd;  // yet its speed was logged
  CHECK(only_error(log, LogFault::Frozen).column == "q2");
}

TEST_CASE("names torques of the wrong sign") {
  JointLog log = sound_log();
  log.tau.col(2) *= -1;
  const LogFinding f = only_error(log, LogFault::ReversedTorque);
  CHECK(f.column == "tau3");
  ConditioningOptions options;
  options.accept = " reversed_torque ";
  CHECK(condition_log(log, options).usable());
  options.accept = "reversed";
  CHECK_THROWS_WITH(condition_log(log, options), Contains("accept: 'reversed' is no kind of finding"));
}

TEST_CASE("finds the delay between two clocks, and undoes it") {
  for (const Index late : {9, -9}) {
    JointLog log = sound_log();
    const Index n = log.t.size() - 9, first = late > 0 ? 9 : 0;
    const MatrixXd tau = log.tau.middleRows(first - std::max<Index>(late, 0) - std::min<Index>(late, 0), n);
    log.t = VectorXd(log.t.segment(first, n));
    log.q = MatrixXd(log.q.middleRows(first, n)), log.qd = MatrixXd(log.qd.middleRows(first, n));
    log.tau = tau;
    const double delay = static_cast<double>(late) * step;
    const LogFinding f = only_error(log, LogFault::TorqueDelay);
    CHECK(f.value == Approx(delay).margin(0.5 * step));
    CHECK_THAT(f.text, Contains("two clocks"));
    ConditioningOptions options;
    options.torque_delay = delay;
    const ConditionedMotion got = condition_log(log, options);
    INFO(got.message);
    REQUIRE(got.usable());
    const ConditionedMotion right = condition_log(sound_log());
    double off = 0;
    for (Index i = 0; i < got.motion.samples(); ++i) {
      const double qd = got.motion.qd(i, 0);
      const double tau1 = 3 * got.motion.qdd(i, 0) + 40 * std::cos(got.motion.q(i, 0)) + 2 * qd;
      if (std::abs(qd) > 0.5) off = std::max(off, std::abs(got.motion.tau(i, 0) - tau1 - (qd > 0 ? 4 : -4)));
    }
    CHECK(off < 2.5);  // a delay of 36 ms makes 5 and more
  }
}

TEST_CASE("names saturated and frozen channels with their spans") {
  JointLog log = sound_log();
  log.tau.col(0) = log.tau.col(0).cwiseMin(35.0);
  LogFinding f = only_error(log, LogFault::Saturated);
  CHECK(f.column == "tau1");
  CHECK_THAT(f.text, Contains("flat at its extreme, 35,"));
  ConditioningOptions options;
  options.leave_out_faulty = true;
  const ConditionedMotion left = condition_log(log, options);
  REQUIRE(left.usable());
  for (Index i = 0; i < left.motion.samples(); ++i) CHECK(left.tau_measured(i, 0) < 35.0);
  log = sound_log();
  log.tau.col(1).segment(1000, 80).setConstant(log.tau(1000, 1));
  f = only_error(log, LogFault::Frozen);
  CHECK(f.column == "tau2");
  CHECK(f.begin == Approx(1000 * step));
  CHECK(f.end == Approx(1079 * step));
  log = sound_log();
  log.q.col(1).segment(1000, 60).setConstant(log.q(1000, 1));
  f = only_error(log, LogFault::Frozen);
  CHECK(f.column == "q2");
}

TEST_CASE("a torque that is constant at rest, without noise, is not saturated") {
  constexpr Index rest = 400;
  JointLog log = sound_log(1, 0.0);
  for (Index i = 0; i < rest; ++i) {
    log.q.row(i) = log.q.row(rest);
    log.qd.row(i).setZero();
    log.tau.row(i).setConstant(1.01 * log.tau.maxCoeff());
  }
  for (const LogFinding& f : check_log(log)) {
    INFO(f.text);
    CHECK_FALSE(f.column.starts_with("tau"));
  }
}

TEST_CASE("the bandwidth of a motion is that of the motion, whatever noise its angles have") {
  const double sound = motion_bandwidth(sound_log(1, 0.0).q, step);
  for (const double noise : {1.0, 10.0, 50.0}) {  // up to 1 mrad, as of an encoder of 12 bits
    INFO("noise " << 2e-5 * noise << " rad");
    CHECK(motion_bandwidth(sound_log(1, noise).q, step) == Approx(sound).epsilon(0.2));
  }
}

TEST_CASE("the noise of speeds is that of low-passed and differenced readings") {
  // Above the cut-off f nothing is left: variance of the derivative of white noise of one sample a step,
  // 2 step (2 pi)^2 f^3 / 3, less what the filter takes below f.
  const double step = 1e-3, cutoff = 20.0;
  const double sharp = 2 * std::numbers::pi * std::sqrt(2 * step * std::pow(cutoff, 3) / 3);
  const double found = identification::speed_noise_gain(step, cutoff);
  CHECK(found > 0.7 * sharp);
  CHECK(found < 1.2 * sharp);
  // Differences over two steps alone.
  CHECK(identification::speed_noise_gain(step, 0.0) == Approx(std::sqrt(0.5) / step).epsilon(0.03));
  CHECK_THROWS_AS(identification::speed_noise_gain(0.0, 1.0), InvalidArgument);
}

TEST_CASE("names torques of brakes, and not those of a rest that the motors hold") {
  for (const bool brake : {true, false}) {
    const JointLog sound = sound_log();
    JointLog log = sound;
    const Index first = 2500, rest = 500;
    Random random(6);
    for (Index i = first; i < first + rest; ++i)
      for (Index j = 0; j < 3; ++j) {
        log.q(i, j) = course(j, step * first, 0) + random.normal(2e-5);
        log.qd(i, j) = random.normal(2e-3);
        log.tau(i, j) = (brake ? 0.0 : 40 * std::cos(log.q(i, j))) + random.normal(0.5);
      }
    for (Index i = first + rest; i < log.t.size(); ++i) {  // the motion goes on from there
      const Index from = i - rest;
      log.q.row(i) = sound.q.row(from);
      log.qd.row(i) = sound.qd.row(from);
      log.tau.row(i) = sound.tau.row(from);
      if (i > first + rest + 1200) {
        log.t.conservativeResize(i);
        break;
      }
    }
    const Index n = log.t.size();
    log.q.conservativeResize(n, 3), log.qd.conservativeResize(n, 3), log.tau.conservativeResize(n, 3);
    if (brake) {
      const LogFinding f = only_error(log, LogFault::Brake);
      CHECK(f.begin == Approx(first * step).margin(0.02));
      CHECK_THAT(f.text, Contains("the brakes hold"));
    } else {
      CHECK(condition_log(log).usable());
    }
  }
}

TEST_CASE("doubts torques whose size is that of currents") {
  JointLog log = sound_log();
  ConditioningOptions options;
  options.expected_torque = VectorXd::Constant(3, 35.0);
  CHECK(check_log(log, options).empty());
  log.tau *= 0.02;
  const auto found = check_log(log, options);
  REQUIRE(found.size() == 1);
  CHECK(found[0].fault == LogFault::CurrentForTorque);
  CHECK(found[0].value == Approx(0.02).epsilon(0.2));
}

TEST_CASE("says what cannot be conditioned") {
  JointLog log = sound_log();
  log.tau.conservativeResize(10, 3);
  CHECK_THROWS_WITH(condition_log(log), Contains("tau: expected 5000 x 3 numbers, found 10 x 3"));
  CHECK_THROWS_AS(condition_log(JointLog{}), InvalidArgument);
  log = sound_log();
  for (auto* m : {&log.q, &log.qd, &log.tau}) m->conservativeResize(12, 3);
  log.t.conservativeResize(12);
  const ConditionedMotion few = condition_log(log);
  CHECK_FALSE(few.usable());
  CHECK_THAT(few.message, Contains("no run of 15 rows"));
  ConditioningOptions options;
  options.lower = options.upper = VectorXd::Zero(2);
  CHECK_THROWS_WITH(check_log(sound_log(), options), Contains("lower, upper"));
}

TEST_CASE("temperatures are ordered, resampled and decimated with the rest") {
  JointLog log = sound_log(3);
  const auto warm = [](double t, Index j) { return 25.0 + 0.8 * t + 3.0 * std::sin(0.3 * t + double(j)); };
  Random random(4);
  for (Index i = 0; i < log.t.size(); ++i) log.t[i] += i ? random.uniform(-0.4, 0.4) * step : 0.0;
  log.temperature.resize(log.t.size(), 3);
  for (Index i = 0; i < log.t.size(); ++i)
    for (Index j = 0; j < 3; ++j) {
      log.q(i, j) = course(j, log.t[i], 0);
      log.temperature(i, j) = warm(log.t[i], j) + random.normal(0.2);
    }
  log.t.segment(1000, 2).reverseInPlace();  // two rows out of order, with all of theirs
  for (MatrixXd* m : {&log.q, &log.qd, &log.tau, &log.temperature}) m->row(1000).swap(m->row(1001));
  ConditioningOptions options;
  options.decimation = 7;
  options.clock = ClockModel::Stamps;
  const ConditionedMotion out = condition_log(log, options);
  INFO(out.message);
  REQUIRE(out.usable());
  REQUIRE(out.motion.temperature.rows() == out.motion.samples());
  REQUIRE(out.motion.temperature.cols() == 3);
  CHECK(out.motion.t[1] - out.motion.t[0] == Approx(7 * step).epsilon(0.01));
  double squared = 0.0;
  for (Index i = 0; i < out.motion.samples(); ++i)
    for (Index j = 0; j < 3; ++j) squared += std::pow(out.motion.temperature(i, j) - warm(out.motion.t[i], j), 2);
  // Smoothed as the torques are, so better than what was logged; a row off would be 0.007 to 0.02 beside.
  CHECK(std::sqrt(squared / double(3 * out.motion.samples())) < 0.15);
  out.motion.validate();
}

TEST_CASE("temperatures in another unit, missing ones and those of no drive are named") {
  JointLog log = sound_log();
  log.temperature = MatrixXd::Constant(log.t.size(), 3, 40.0);
  CHECK(condition_log(log).usable());
  log.temperature.col(1).array() += 273.15;
  const LogFinding kelvin = only_error(log, LogFault::TemperatureRange);
  CHECK(kelvin.joint == 2);
  CHECK(kelvin.text ==
        "temperature2: 313.1 to 313.1, expected -40 to 200 deg C; kelvins for degrees Celsius? state the unit");
  log.temperature_names = {"T_a", "T_b", "T_c"};
  CHECK(only_error(log, LogFault::TemperatureRange).column == "T_b");
  ConditioningOptions accepting;
  accepting.accept = "temperature_range";
  CHECK(condition_log(log, accepting).usable());
  log.temperature.col(1).setConstant(40.0);
  log.temperature(2500, 2) = -80.0;
  const LogFinding cold = only_error(log, LogFault::TemperatureRange);
  CHECK(cold.begin == Approx(10.0));
  CHECK_THAT(cold.text, Contains("T_c: -80 to 40") && Contains("check unit and column"));
  log.temperature(2500, 2) = std::numeric_limits<double>::quiet_NaN();
  CHECK(only_error(log, LogFault::NotFinite).column == "T_c");
  log.temperature_names.pop_back();
  CHECK_THROWS_WITH(check_log(log), Contains("temperature_names: one name a joint"));
  log.temperature = MatrixXd::Zero(5, 3);
  CHECK_THROWS_WITH(check_log(log), Contains("temperature: expected 5000 x 3 numbers, found 5 x 3"));
}

TEST_CASE("further logs are conditioned like those before, unless the options say how") {
  std::vector<ConditionedMotion> motions(2);
  for (ConditionedMotion& motion : motions) motion.motion.t = Eigen::VectorXd::LinSpaced(10, 0, 1);
  motions[0].cutoff = 10, motions[0].decimation = 2;
  motions[1].cutoff = 13, motions[1].decimation = 5;
  const ConditioningOptions alike = conditioning_like(motions, {});
  CHECK(alike.cutoff == 11.5);
  CHECK(alike.decimation == 4);  // of 3.5
  ConditioningOptions given;
  given.decimation = 1;
  CHECK(conditioning_like(motions, given).decimation == 1);
  CHECK(conditioning_like(motions, given).cutoff == 11.5);
  given.cutoff = 20;
  CHECK(conditioning_like(motions, given).cutoff == 20);
  CHECK(conditioning_like({}, {}).cutoff == 0);
  motions.push_back({});  // refused
  CHECK(conditioning_like(motions, {}).cutoff == 0);
  const ConditionedMotion sound = condition_log(sound_log());
  CHECK(conditioning_like(std::vector{sound}, {}).cutoff == sound.cutoff);
  CHECK(conditioning_like(std::vector{sound}, {}).decimation == sound.decimation);
}

}  // namespace log_conditioning_test
