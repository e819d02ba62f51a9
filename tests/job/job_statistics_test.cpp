#include <kr5/job/job_statistics.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

namespace job_statistics_test {

using namespace kr5;
using namespace kr5::job;

JobRecord entered(double time, Phase phase, int pellet, PelletState state, Outcome outcome = Outcome::None) {
  JobRecord out;
  out.kind = RecordKind::Enter;
  out.time = time;
  out.phase = phase;
  out.pellet = pellet;
  out.pellet_state = state;
  out.outcome = outcome;
  return out;
}

JobRecord of_kind(RecordKind kind, double time, Phase phase, int pellet, PelletState state) {
  JobRecord out = entered(time, phase, pellet, state);
  out.kind = kind;
  return out;
}

/// Two pellets: the first inserted at its second attempt, the second dropped; a kill lies between.
std::vector<JobRecord> two_pellets() {
  using enum PelletState;
  return {of_kind(RecordKind::Begin, 0, Phase::CheckCell, 0, Waiting),
          entered(1, Phase::Scan, 0, Waiting),
          entered(3, Phase::Pick, 1, Waiting, Outcome::PicksFound),
          entered(5, Phase::Stand, 1, Picked),
          of_kind(RecordKind::Begin, 1000, Phase::Approach, 1, Regripped),
          entered(1001, Phase::Approach, 1, Regripped),
          entered(1002, Phase::Search, 1, Regripped, Outcome::HoleFound),
          of_kind(RecordKind::Attempt, 1004, Phase::Search, 1, Regripped),
          entered(1005, Phase::Insert, 1, Regripped, Outcome::InBore),
          entered(1007, Phase::Next, 1, Seated),
          of_kind(RecordKind::Pellet, 1008, Phase::Next, 1, Inserted),
          entered(1008, Phase::Pick, 2, Waiting),
          entered(1009, Phase::Stand, 2, Picked),
          entered(1010, Phase::Next, 2, Dropped),
          of_kind(RecordKind::Stop, 1012, Phase::Next, 0, Waiting)};
}

const PhaseTime& time_of(const JobStatistics& s, Phase phase) {
  for (const PhaseTime& p : s.phases)
    if (p.phase == phase) return p;
  throw InvalidArgument("no such phase");
}

TEST_CASE("times by phase leave out what lies between two programs") {
  const JobStatistics s = job_statistics(two_pellets());
  CHECK(s.programs == 2);
  CHECK(s.stops == 1);
  CHECK(s.time == Approx(5 + 12));
  CHECK(time_of(s, Phase::CheckCell).total == Approx(2));
  CHECK(time_of(s, Phase::CheckCell).count == 2);
  CHECK(time_of(s, Phase::Search).total == Approx(3));
  CHECK(time_of(s, Phase::Search).max == Approx(3));
  CHECK(time_of(s, Phase::Search).count == 1);
  CHECK(time_of(s, Phase::Pick).total == Approx(3));
  CHECK(time_of(s, Phase::Pick).max == Approx(2));
  CHECK(time_of(s, Phase::Next).total == Approx(3));
}

TEST_CASE("success is counted by attempt, and each pellet has its figures") {
  const JobStatistics s = job_statistics(two_pellets());
  CHECK(s.inserted == 1);
  REQUIRE(s.attempts.size() == 2);
  CHECK(s.attempts[0].tried == 1);
  CHECK(s.attempts[0].inserted == 0);
  CHECK(s.attempts[1].tried == 1);
  CHECK(s.attempts[1].inserted == 1);
  REQUIRE(s.pellets.size() == 2);
  CHECK(s.pellets[0].state == PelletState::Inserted);
  CHECK(s.pellets[0].insertions == 2);
  CHECK(s.pellets[0].time == Approx(2 + 8));
  CHECK(s.pellets[1].state == PelletState::Dropped);
  CHECK(s.pellets[1].picks == 1);
}

TEST_CASE("force, impulse and jerk are those of a motion that is known") {
  JobSamples samples;
  const int n = 500;
  const double dt = 0.012, jerk = 0.7;
  samples.time = Eigen::VectorXd::LinSpaced(n, 0, dt * (n - 1));
  samples.position = Eigen::Matrix3Xd::Zero(3, n);
  samples.position.row(0) = jerk / 6 * samples.time.transpose().array().cube();
  samples.force = Eigen::Matrix3Xd::Zero(3, n);
  samples.force.row(1).segment(100, 50).setConstant(-4.0);
  samples.force.row(2).segment(200, 100).setConstant(0.5);  // no contact
  samples.pellet.assign(n, 1);
  const JobStatistics s = job_statistics(two_pellets(), samples);
  CHECK(s.peak_force == Approx(4.0));
  CHECK(s.impulse == Approx(4.0 * 50 * dt));
  CHECK(s.peak_jerk == Approx(jerk).epsilon(1e-4));
  CHECK(s.rms_jerk == Approx(jerk).epsilon(1e-4));
  CHECK(s.pellets[0].impulse == Approx(s.impulse));
  CHECK(s.pellets[1].peak_force == 0.0);
}

TEST_CASE("a gap of time is no jerk") {
  JobSamples samples;
  samples.time = Eigen::VectorXd::LinSpaced(10, 0, 0.9);
  samples.time.tail(5).array() += 10;
  samples.position = Eigen::Matrix3Xd::Zero(3, 10);
  samples.position.row(0).tail(5).setConstant(5.0);
  CHECK(job_statistics({}, samples).peak_jerk == 0.0);
}

TEST_CASE("samples that do not fit are refused by name") {
  JobSamples samples;
  samples.time = Eigen::VectorXd::LinSpaced(3, 0, 1);
  samples.force = Eigen::Matrix3Xd::Zero(3, 2);
  CHECK_THROWS_WITH(job_statistics({}, samples), "force: must have a column for each time");
  samples.force.resize(3, 0);
  samples.time[2] = samples.time[1];
  CHECK_THROWS_WITH(job_statistics({}, samples), "time: must rise [s]");
  CHECK_THROWS_WITH(job_statistics({}, {}, {.contact_force = -1}), "contact_force must not be negative [N]");
}

}  // namespace job_statistics_test
