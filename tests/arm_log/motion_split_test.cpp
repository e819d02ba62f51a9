#include <kr5/arm_log/motion_split.hpp>

#include <algorithm>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "arm_log/logged_arm.hpp"

namespace motion_split_test {

using namespace kr5;
using namespace kr5::test;
using arm_log::CutReason;
using arm_log::LoggedMotion;
using cell::Split;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// A swing that rests from `begin` to `end` [s], from rest.
LoggedMotion pausing(double begin, double end, double length = 20.0) {
  LoggedMotion out;
  const auto rows = static_cast<Eigen::Index>(length * 100) + 1;
  out.t = VectorXd::LinSpaced(rows, 0, length);
  out.q.resize(rows, 2);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = out.t[i], moved = std::min(t, begin) + std::max(0.0, t - end);
    out.q(i, 0) = 1 - std::cos(moved), out.q(i, 1) = 0.3 * (1 - std::cos(2 * moved));
  }
  return out;
}

}  // namespace

TEST_CASE("a log that rests is cut there, near 70 % of its motion") {
  const auto spans = arm_log::split_motions({pausing(12.6, 14.0)});
  REQUIRE(spans.size() == 2);
  CHECK(spans[0].cut == CutReason::AtRest);
  CHECK(spans[0].split == Split::Fit);
  CHECK(spans[1].split == Split::Check);
  CHECK(spans[0].end == spans[1].begin);
  CHECK(spans[0].end > 12.6);
  CHECK(spans[0].end < 14.0);
}

TEST_CASE("measured positions that never rest are cut at 70 % of the motion") {
  LoggedMotion log = pausing(100, 100);
  const auto spans = arm_log::split_motions({log});
  REQUIRE(spans.size() == 2);
  CHECK(spans[0].cut == CutReason::Measured);
  CHECK(spans[0].end == Approx(14.0).margin(1.0));
  CHECK(spans[1].lead_in == 0.0);
  log.commanded = true;
  const auto commanded = arm_log::split_motions({log});
  CHECK(commanded[0].cut == CutReason::LeadIn);
  CHECK(commanded[1].lead_in == commanded[0].end);
  CHECK(commanded[1].begin < 0);  // simulated from the beginning of the log
}

TEST_CASE("a log is parted where its clock stands still, the last parts are to check") {
  LoggedMotion log = pausing(100, 100);
  log.t.tail(800).array() += 5.0;
  const auto spans = arm_log::split_motions({log});
  REQUIRE(spans.size() == 2);
  CHECK(spans[0].cut == CutReason::Uncut);
  CHECK(spans[0].end == spans[1].begin);
  CHECK(spans[1].split == Split::Check);
  log.max_gap = 6.0;
  CHECK(arm_log::split_motions({log})[0].cut != CutReason::Uncut);
}

TEST_CASE("a part in which the arm creeps after its motion, and is told to stand, is none") {
  LoggedMotion log = pausing(14, 100);
  log.commanded = true;
  log.command = log.q;
  log.t.tail(500).array() += 5.0;
  log.q.col(0).tail(500) += VectorXd::LinSpaced(500, 0, 0.002);
  const auto spans = arm_log::split_motions({log});
  for (const auto& span : spans) CHECK(span.end < 16.0 + 5.0);
  CHECK(spans.size() == 2);
}

TEST_CASE("of several logs the last are to check") {
  const auto spans = arm_log::split_motions({pausing(100, 100), pausing(100, 100), pausing(100, 100)});
  REQUIRE(spans.size() == 3);
  CHECK(spans[1].log == 1);
  CHECK(spans[1].split == Split::Fit);
  CHECK(spans[2].split == Split::Check);
}

TEST_CASE("logs that are kept to check are, and all others are to fit") {
  std::vector<LoggedMotion> logs(4, pausing(100, 100));
  logs[0].kept_to_check = logs[2].kept_to_check = true;
  const auto spans = arm_log::split_motions(logs);
  REQUIRE(spans.size() == 4);
  for (const auto& span : spans) CHECK(span.split == (span.log % 2 == 0 ? Split::Check : Split::Fit));
  for (LoggedMotion& log : logs) log.kept_to_check = true;
  CHECK_THROWS_AS(arm_log::split_motions(logs), InvalidArgument);
}

TEST_CASE("a commanded log that begins in motion has a lead-in as long as its servos need") {
  LoggedMotion log = pausing(100, 100);
  const Eigen::Index from = 100;
  log.q = MatrixXd(log.q.bottomRows(log.q.rows() - from));
  log.t = VectorXd(log.t.head(log.q.rows()));
  log.commanded = true;
  log.settle = 0.32156;
  const auto spans = arm_log::split_motions({log});
  CHECK(spans[0].lead_in == Approx(0.322).epsilon(1e-12));
  CHECK(spans[0].initial_speed == Approx(std::sin(1.0)).epsilon(0.1));
  log.command = log.q * 10;  // the arm is far slower than its command: it begins at rest
  CHECK(arm_log::split_motions({log})[0].lead_in == 0.0);
}

TEST_CASE("noise is no motion") {
  CHECK_FALSE(arm_log::joints_move(MatrixXd::Constant(50, 3, 0.4)));
  CHECK(arm_log::joints_move(pausing(1, 2).q));
  const LoggedMotion still = pausing(0, 100);
  REQUIRE(arm_log::rests(still.t, still.q).size() == 1);
  CHECK(arm_log::rests(still.t, still.q)[0].end == still.t[still.t.size() - 1]);
}

TEST_CASE("sizes that differ are refused") {
  LoggedMotion log = pausing(1, 2);
  log.q.conservativeResize(100, 2);
  CHECK_THROWS_AS(arm_log::split_motions({log}), InvalidArgument);
  CHECK_THROWS_AS(arm_log::split_motions({}), InvalidArgument);
}

TEST_CASE("a long log becomes stretches that are spread over it, at the rate its motion needs") {
  const LoggedMotion log = pausing(1e9, 2e9, 3000.0);  // 300,000 rows
  const auto spans = arm_log::split_motions({log});
  const auto is_fit = [](const auto& span) { return span.split == Split::Fit; };
  const auto count = static_cast<std::size_t>(std::ranges::count_if(spans, is_fit));
  REQUIRE(count == 40);  // 210,000 rows to fit: four times the fewest, up to which more rows narrow the intervals
  Eigen::Index fit = 0;
  for (std::size_t k = 0; k < spans.size(); ++k) {
    CHECK(spans[k].stretch);
    CHECK(spans[k].split == (k < count ? Split::Fit : Split::Check));
    if (k > 0) CHECK(spans[k].begin > spans[k - 1].begin);
    fit += spans[k].split == Split::Fit ? std::lround((spans[k].end - spans[k].begin) * 100) : 0;
  }
  CHECK(spans.front().begin < 1.0);
  CHECK(spans[count - 1].end == Approx(2100).margin(30));
  CHECK(spans.back().end == Approx(3000).margin(1));
  CHECK(fit >= 24000 - 40);
  CHECK(arm_log::split_motions({pausing(1e9, 2e9, 100.0)}).size() <= 20);  // 10,000 rows
}

TEST_CASE("an arm that is simulated step by step is judged in the stretches in which most moves") {
  LoggedMotion log = pausing(40, 140, 400);
  log.commanded = log.stepwise = true;
  LoggedMotion kept = log;
  kept.kept_to_check = true;
  const auto spans = arm_log::split_motions({log, kept, kept});
  double fit = 0, check = 0;
  for (const auto& span : spans) {
    CHECK(span.stretch);
    CHECK((span.begin > 0 ? span.lead_in == Approx(2.0) : span.lead_in <= 2.0));
    CHECK((span.end <= 40.1 || span.begin + span.lead_in >= 125.0));  // nothing moves between 40 and 140 s
    CHECK(span.split == (span.log == 0 ? Split::Fit : Split::Check));
    (span.split == Split::Fit ? fit : check) += span.end - span.begin;
  }
  CHECK(fit == Approx(80).margin(30));
  CHECK(check == Approx(40).margin(20));

  LoggedMotion brief = pausing(100, 100);
  brief.commanded = brief.stepwise = true;
  const auto whole = arm_log::split_motions({brief});
  CHECK_FALSE(whole[0].stretch);
  CHECK(whole[1].lead_in == Approx(2.0));
  CHECK(whole[1].begin == Approx(whole[0].end - 2.0));
}

}  // namespace motion_split_test
