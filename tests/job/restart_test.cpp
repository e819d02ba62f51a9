#include <kr5/job/restart.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "job_run.hpp"

namespace restart_test {

using namespace kr5;
using namespace kr5::job;
using namespace kr5::test;

int count(const JobBelief& belief, PelletState state) {
  return static_cast<int>(std::count_if(belief.pellets.begin(), belief.pellets.end(),
                                        [state](const PelletEntry& p) { return p.state == state; }));
}

/// Nothing was done twice, nothing was lost: what the journal says is what the cell knows.
void check_truth(const FakeCell& cell, const JobBelief& belief, int pellets) {
  CHECK(cell.collisions() == 0);
  CHECK(belief.phase == Phase::Done);
  CHECK(cell.count(Place::Tube) == belief.inserted);
  CHECK(count(belief, PelletState::Inserted) == belief.inserted);
  CHECK(cell.count(Place::Gripper) + cell.count(Place::Station) == 0);
  CHECK(cell.count(Place::Floor) <= count(belief, PelletState::Dropped) + count(belief, PelletState::Lost));
  CHECK(cell.count(Place::Tube) + cell.count(Place::Floor) + cell.count(Place::Bin) == pellets);
}

/// Runs the job from where it is to its end, without another interruption.
JobBelief finish(FakeCell& cell, const std::filesystem::path& file, const JobOptions& options) {
  Program program(cell, file, options);
  if (program.decision().status != RestartStatus::Finished) {
    INFO(name_of(program.decision().status) << ": " << name_of(program.decision().finding));
    REQUIRE(goes_on(program.decision().status));
    REQUIRE(program.run());
    INFO(name_of(program.supervisor().state().stop) << " in " << name_of(program.supervisor().state().stopped_in)
                                                    << " by " << name_of(program.supervisor().state().cell_fault));
    CHECK(program.supervisor().state().phase == Phase::Done);
    CHECK(program.first_gap() == 0.0);
  }
  return program.journal().belief();
}

TEST_CASE("a job killed at any of its records, before or behind it, goes on and does nothing twice") {
  constexpr int pellets = 2;
  const JobOptions options = FakeCell::options(pellets);
  for (std::uint64_t kill = 1;; ++kill) {
    bool ended = false;
    for (const bool written : {false, true}) {
      Folder folder;
      FakeCell cell(pellets, 3);
      {
        Program program(cell, folder / "job.db", options);
        if (!written) program.unwritable = kill;
        ended = program.run(
            [&] { return written ? program.ring().written() >= kill : program.ring().after(kill - 1) != nullptr; });
      }
      if (ended) break;
      cell.interrupt();
      INFO("record " << kill << (written ? ", written" : ", not written"));
      Program again(cell, folder / "job.db", options);
      if (kill == 1 && !written) {
        CHECK(again.decision().status == RestartStatus::Fresh);
      } else if (again.decision().status != RestartStatus::Finished) {
        CHECK(again.decision().status != RestartStatus::Fresh);
        CHECK(goes_on(again.decision().status));
      }
      if (again.decision().status != RestartStatus::Finished) REQUIRE(again.run());
      check_truth(cell, again.journal().belief(), pellets);
      CHECK(cell.count(Place::Tube) == pellets);
    }
    if (ended) {
      CHECK(kill > 2 * 9);
      break;
    }
  }
}

/// Jobs that are killed again and again, until as many kills are made.
void kill_often(int kills, const Misfortune& misfortune, bool all_arrive) {
  constexpr int pellets = 12;
  Random random(11);
  int made = 0, gaps = 0, refused = 0;
  std::set<Phase> killed_in;
  for (std::uint64_t run = 1; made < kills; ++run) {
    Folder folder;
    FakeCell cell(pellets, run, misfortune);
    const JobOptions options = FakeCell::options(pellets);
    bool ended = false;
    while (!ended && made < kills) {
      Program program(cell, folder / "job.db", options, 1000 * run + static_cast<std::uint64_t>(made));
      const RestartStatus status = program.decision().status;
      if (status == RestartStatus::Finished) break;
      if (!goes_on(status)) {
        ++refused;
        UNSCOPED_INFO(name_of(program.decision().finding) << " in run " << run);
        break;
      }
      int left = random.integer(1500);
      ended = program.run([&left] { return left-- <= 0; });
      gaps += program.first_gap() > 0.0;
      if (ended) break;
      ++made;
      killed_in.insert(program.supervisor().state().phase);
      cell.interrupt();
    }
    check_truth(cell, finish(cell, folder / "job.db", options), pellets);
    if (all_arrive) CHECK(cell.count(Place::Tube) == pellets);
  }
  CHECK(killed_in.size() == 10);  // all but stopped and done
  CHECK(refused == 0);
  CHECK(gaps == 0);
}

TEST_CASE("a job killed at 1000 instants does nothing twice and loses nothing", "[long]") {
  kill_often(1000, {}, true);
}

TEST_CASE("neither does one whose gripper fails and drops pellets, also while no program runs") {
  kill_often(300, {.no_grip = 0.1, .no_hole = 0.1, .slip = 2e-5, .outage_slip = 0.05}, false);
}

namespace {

JobBelief belief_in(Phase phase, PelletState state, int inserted = 0) {
  JobBelief out;
  out.begun = true;
  out.phase = phase;
  out.inserted = inserted;
  out.pellet = inserted + 1;
  for (int k = 1; k <= inserted; ++k) out.pellets.push_back({.number = k, .state = PelletState::Inserted});
  out.pellets.push_back({.number = inserted + 1, .state = state});
  return out;
}

RestartMeasurements measured(bool gripped, std::optional<bool> station, std::optional<int> tube) {
  RestartMeasurements out{{}, station, tube};
  out.reading.T_base_tool = pointing_down({0.3, 0.0, 0.3});
  out.reading.status.gripped = gripped;
  return out;
}

void check_decision(const JobBelief& belief, const RestartMeasurements& m, RestartStatus status, RestartFinding finding,
                    Phase phase, bool looks = false) {
  RestartOptions options = FakeCell::restart_options();
  options.sees_station = options.sees_tube = looks;
  const RestartDecision d = decide_restart(belief, m, options);
  CHECK(d.status == status);
  CHECK(d.finding == finding);
  CHECK(d.phase == phase);
  CHECK(d.gripped == m.reading.status.gripped);
}

}  // namespace

TEST_CASE("what is measured decides where the journal can be behind") {
  using enum RestartFinding;
  constexpr auto go = RestartStatus::Continue;
  const JobBelief pick = belief_in(Phase::Pick, PelletState::Waiting),
                  stand = belief_in(Phase::Stand, PelletState::Picked),
                  regrip = belief_in(Phase::Regrip, PelletState::Stood),
                  insert = belief_in(Phase::Insert, PelletState::Regripped, 2);
  check_decision(pick, measured(true, false, 0), go, WasPicked, Phase::Stand);
  check_decision(pick, measured(false, false, 0), go, AsBelieved, Phase::Scan);
  check_decision(stand, measured(false, true, 0), go, WasStood, Phase::Regrip);
  check_decision(stand, measured(false, false, 0), go, WasDropped, Phase::Next);
  check_decision(regrip, measured(true, false, 0), go, WasRegripped, Phase::Approach);
  check_decision(regrip, measured(false, false, 0), go, WasDropped, Phase::Next);
  check_decision(insert, measured(true, false, 2), go, AsBelieved, Phase::Approach);
  check_decision(insert, measured(false, false, 3), go, WasInserted, Phase::Next);
  check_decision(insert, measured(false, false, 2), go, WasDropped, Phase::Next);
  CHECK(decide_restart(insert, measured(false, false, 3)).inserted == 3);
  CHECK(decide_restart(insert, measured(false, false, 2)).inserted == 2);
}

TEST_CASE("a seated pellet that is held is let go where it is, and inserted again where the tool is elsewhere") {
  const JobBelief seated = belief_in(Phase::Next, PelletState::Seated);
  RestartMeasurements m = measured(true, false, 0);
  check_decision(seated, m, RestartStatus::Continue, RestartFinding::AsBelieved, Phase::Approach);
  const Pose depth(Eigen::Translation3d(0, 0, -FakeCell::depth));
  m.reading.T_base_tool = FakeCell::believed_tube() * depth * FakeCell::T_tool_peg().inverse();
  check_decision(seated, m, RestartStatus::Continue, RestartFinding::AsBelieved, Phase::Next);
}

TEST_CASE("what cannot be is not decided: a person must look") {
  using enum RestartFinding;
  constexpr auto no = RestartStatus::Contradiction;
  const JobBelief scan = belief_in(Phase::Scan, PelletState::Waiting),
                  stand = belief_in(Phase::Stand, PelletState::Picked),
                  insert = belief_in(Phase::Insert, PelletState::Regripped, 2);
  check_decision(scan, measured(true, false, 0), no, GripUnexpected, Phase::Stopped);
  check_decision({}, measured(true, false, 0), no, GripUnexpected, Phase::Stopped);
  check_decision(stand, measured(true, true, 0), no, StationOccupied, Phase::Stopped);
  check_decision(insert, measured(false, true, 2), no, StationOccupied, Phase::Stopped);
  check_decision(insert, measured(true, false, 1), no, TubeCount, Phase::Stopped);
  check_decision(insert, measured(false, false, 4), no, TubeCount, Phase::Stopped);
  check_decision(scan, measured(false, false, 1), no, TubeCount, Phase::Stopped);
  RestartMeasurements nowhere = measured(false, false, 0);
  nowhere.reading.T_base_tool.translation().x() = std::nan("");
  check_decision(scan, nowhere, no, PoseInvalid, Phase::Stopped);
}

TEST_CASE("what must be seen first is named") {
  const JobBelief stand = belief_in(Phase::Stand, PelletState::Picked),
                  insert = belief_in(Phase::Insert, PelletState::Regripped);
  check_decision(stand, measured(false, std::nullopt, 0), RestartStatus::Unseen, RestartFinding::StationUnseen,
                 Phase::Stopped);
  check_decision(insert, measured(false, false, std::nullopt), RestartStatus::Unseen, RestartFinding::TubeUnseen,
                 Phase::Stopped);
}

TEST_CASE("what nobody said is looked at, and the job goes on by what is seen") {
  using enum RestartFinding;
  const TubeStack stack = FakeCell::options(1).stack;
  const JobBelief stand = belief_in(Phase::Stand, PelletState::Picked),
                  regrip = belief_in(Phase::Regrip, PelletState::Stood),
                  insert = belief_in(Phase::Insert, PelletState::Regripped, 2);
  const RestartMeasurements unsaid = measured(false, std::nullopt, std::nullopt);
  check_decision(stand, unsaid, RestartStatus::Look, StationUnseen, Phase::Look, true);
  check_decision(regrip, unsaid, RestartStatus::Look, StationUnseen, Phase::Look, true);
  check_decision(insert, unsaid, RestartStatus::Look, TubeUnseen, Phase::Look, true);
  check_decision(insert, measured(true, std::nullopt, std::nullopt), RestartStatus::Continue, AsBelieved,
                 Phase::Approach, true);
  const auto seen = [&](const JobBelief& belief, const PlaceResult& place) {
    return decide_after_look(decide_restart(belief, unsaid, FakeCell::restart_options()), place, stack);
  };
  const auto filled = [&](int pellets) {
    return PlaceResult{.seen = true, .depth = stack.depth - pellets * stack.min_height};
  };
  const PlaceResult empty{.seen = true}, full{.seen = true, .occupied = true}, stuck{.seen = true, .depth = 0.003};
  CHECK(seen(stand, full).phase == Phase::Regrip);
  CHECK(seen(stand, full).finding == WasStood);
  CHECK(seen(stand, empty).pellet_state == PelletState::Dropped);
  CHECK(seen(regrip, full).finding == AsBelieved);
  CHECK(seen(regrip, empty).pellet_state == PelletState::Lost);
  CHECK(seen(insert, filled(3)).pellet_state == PelletState::Inserted);
  CHECK(seen(insert, filled(3)).inserted == 3);
  CHECK(seen(insert, filled(2)).pellet_state == PelletState::Dropped);
  CHECK(seen(insert, filled(2)).inserted == 2);
  for (const PlaceResult& place : {stuck, full}) {
    CHECK(seen(insert, place).status == RestartStatus::Contradiction);
    CHECK(seen(insert, place).finding == TubeStuck);
  }
}

TEST_CASE("a pellet that was lost in the mouth of the bore is in a tube of which no ground is seen") {
  const PlaceResult dark{.seen = true};
  JobBelief lost = belief_in(Phase::Next, PelletState::MissingInBore);
  const auto decided = [&] {
    const RestartMeasurements unsaid = measured(false, std::nullopt, std::nullopt);
    return decide_after_look(decide_restart(lost, unsaid, FakeCell::restart_options()), dark, {});
  };
  CHECK(decided().finding == RestartFinding::WasInserted);
  lost.pellets.back().state = PelletState::Missing;
  CHECK(decided().finding == RestartFinding::WasDropped);
}

TEST_CASE("a stop that nobody has released is not passed by, and no job begins without a decision for it") {
  JobBelief stopped = belief_in(Phase::Insert, PelletState::Regripped);
  stopped.stop = StopReason::Force;
  const RestartDecision d = decide_restart(stopped, measured(true, false, 0));
  CHECK(d.status == RestartStatus::Latched);
  CHECK(d.stop == StopReason::Force);
  RecordRing ring;
  CHECK_THROWS_WITH(Supervisor(FakeCell::options(1), d, ring), "start: the job cannot go on: latched (as_believed)");
  CHECK_THROWS_AS(decide_restart(stopped, measured(true, false, 0), {.bore = 0.0}), InvalidArgument);
}

}  // namespace restart_test
