#include <kr5/job/supervisor.hpp>

#include <set>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "job_run.hpp"

namespace supervisor_test {

using namespace kr5;
using namespace kr5::job;
using namespace kr5::test;

TEST_CASE("every pellet of the bin goes into the tube") {
  Folder folder;
  FakeCell cell(4, 1);
  Program program(cell, folder / "job.db", FakeCell::options(4));
  REQUIRE(program.decision().status == RestartStatus::Fresh);
  REQUIRE(program.run());
  INFO("phase " << name_of(program.supervisor().state().stopped_in) << ", stop "
                << name_of(program.supervisor().state().stop) << ", outcome "
                << name_of(program.supervisor().state().outcome) << ", insertion "
                << name_of(program.supervisor().insertion().phase) << ", reason "
                << name_of(program.supervisor().insertion().reason) << " in "
                << name_of(program.supervisor().insertion().stopped_in));
  CHECK(program.supervisor().state().phase == Phase::Done);
  CHECK(cell.count(Place::Tube) == 4);
  CHECK(cell.collisions() == 0);
  const JobBelief belief = program.journal().belief();
  CHECK(belief.phase == Phase::Done);
  CHECK(belief.inserted == 4);
  REQUIRE(belief.pellets.size() == 4);
  for (const PelletEntry& p : belief.pellets) CHECK(p.state == PelletState::Inserted);
  CHECK(program.first_gap() == 0.0);
  CHECK(program.most_way() <= PathLimits{}.speed * robot::usual_cycle * (1 + 1e-9));
}

/// Runs into a phase, and some cycles further.
void run_into(Program& program, Phase phase, int cycles = 20) {
  program.run([&] { return program.supervisor().state().phase == phase && cycles-- <= 0; });
  REQUIRE(program.supervisor().state().phase == phase);
}

TEST_CASE(
    "whatever stops the arm in any phase holds it in that cycle, and stays over a restart until a person is named") {
  for (const Phase phase : {Phase::Scan, Phase::Pick, Phase::Stand, Phase::Regrip, Phase::Approach, Phase::Search,
                            Phase::Insert, Phase::Next}) {
    INFO(name_of(phase));
    Folder folder;
    FakeCell cell(1, 1);
    {
      Program program(cell, folder / "job.db", FakeCell::options(1));
      run_into(program, phase, 2);
      cell.push[0] = 100;
      const Pose before = cell.tool();
      program.cycle();
      CHECK(program.command().stop);
      CHECK(program.command().tool.isApprox(before));
      CHECK(program.supervisor().state().stop == StopReason::Force);
      CHECK(program.supervisor().state().stopped_in == phase);
      cell.push[0] = 0;
      for (int k = 0; k < 50; ++k) program.cycle();
      CHECK(program.command().stop);
      CHECK(program.command().tool.isApprox(before));
      program.write();
    }
    cell.interrupt();
    {
      Program latched(cell, folder / "job.db", FakeCell::options(1));
      CHECK(latched.decision().status == RestartStatus::Latched);
      CHECK(latched.decision().stop == StopReason::Force);
      latched.journal().release("Ada");
    }
    Program released(cell, folder / "job.db", FakeCell::options(1));
    REQUIRE(goes_on(released.decision().status));
    CHECK(released.decision().status != RestartStatus::Fresh);
    REQUIRE(released.run());
    CHECK(cell.count(Place::Tube) == 1);
  }
}

TEST_CASE("what stands on the way to the station stops the job and is told") {
  Folder folder;
  FakeCell cell(1, 1);
  Program program(cell, folder / "job.db", FakeCell::options(1));
  program.run([&] {
    const Eigen::Vector3d way = cell.tool().translation() - FakeCell::station().translation();
    return program.supervisor().state().phase == Phase::Stand && way.head<2>().norm() < 1e-3 && way.z() < 0.1;
  });
  cell.push[2] = 12.0;
  for (int k = 0; k < 3; ++k) program.cycle();
  CHECK(program.command().stop);
  CHECK(program.supervisor().state().stop == StopReason::Obstructed);
  CHECK(program.supervisor().state().stopped_in == Phase::Stand);
}

TEST_CASE("an operator and a lost link stop the job") {
  for (const bool person : {true, false}) {
    Folder folder;
    FakeCell cell(1, 1);
    Program program(cell, folder / "job.db", FakeCell::options(1));
    run_into(program, Phase::Stand);
    person ? program.supervisor().stop_by_operator() : program.supervisor().note_lost_link();
    program.cycle();
    CHECK(program.command().stop);
    CHECK(program.supervisor().state().stop == (person ? StopReason::Operator : StopReason::LostLink));
    CHECK(program.supervisor().finished());
  }
}

TEST_CASE("a phase that takes too long stops the arm") {
  Folder folder;
  FakeCell cell(1, 1);
  JobOptions options = FakeCell::options(1);
  options.phases.rows[static_cast<std::size_t>(Phase::Stand)].timeout = 0.2;
  Program program(cell, folder / "job.db", options);
  REQUIRE(program.run());
  CHECK(program.supervisor().state().stop == StopReason::TimeOut);
  CHECK(program.supervisor().state().stopped_in == Phase::Stand);
}

TEST_CASE("a record that does not come to the disk keeps the arm standing, then stops it") {
  FakeCell cell(1, 1);
  RecordRing ring;
  JobOptions options = FakeCell::options(1);
  options.record_time = 1.0;
  Supervisor supervisor(options, {}, ring);
  const Pose start = cell.tool();
  int standing = 0;
  while (!supervisor.finished() && standing < 1000) {
    const robot::RobotCommand command = supervisor.step(cell.read());
    CHECK(command.tool.isApprox(start));
    cell.send(command);
    ++standing;
  }
  CHECK(supervisor.state().stop == StopReason::Journal);
  CHECK(standing == static_cast<int>(1.0 / robot::usual_cycle) + 1);
}

TEST_CASE("a gripper that never holds is tried as often as the table says") {
  Folder folder;
  FakeCell cell(12, 1, {.no_grip = 1.0});
  Program program(cell, folder / "job.db", FakeCell::options(12));
  REQUIRE(program.run());
  CHECK(program.supervisor().state().stop == StopReason::Exhausted);
  CHECK(program.supervisor().state().stopped_in == Phase::Pick);
  const JobBelief belief = program.journal().belief();
  REQUIRE(belief.pellets.size() == 1);
  CHECK(belief.pellets[0].picks == usual_phases().row(Phase::Pick).retries + 1);
}

TEST_CASE("a tube that is not seen is looked for as often as the table says") {
  Folder folder;
  FakeCell cell(1, 1, {.no_hole = 1.0});
  Program program(cell, folder / "job.db", FakeCell::options(1));
  REQUIRE(program.run());
  CHECK(program.supervisor().state().stop == StopReason::Exhausted);
  CHECK(program.supervisor().state().stopped_in == Phase::Approach);
  CHECK(program.supervisor().state().attempt == usual_phases().row(Phase::Approach).retries + 1);
}

TEST_CASE("a bin that is empty ends the job") {
  Folder folder;
  FakeCell cell(2, 1);
  Program program(cell, folder / "job.db", FakeCell::options(0));
  REQUIRE(program.run());
  CHECK(program.supervisor().state().phase == Phase::Done);
  CHECK(program.supervisor().state().outcome == Outcome::BinEmpty);
  CHECK(cell.count(Place::Tube) == 2);
}

TEST_CASE("a bin counts as empty once it has been looked into from both sides") {
  Folder folder;
  FakeCell cell(0, 1);
  JobOptions options = FakeCell::options(0);
  const Pose other(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  options.places.T_base_rescan = options.places.T_base_scan * other;
  options.places.T_base_rescan_end = options.places.T_base_scan_end * other;
  Program program(cell, folder / "job.db", options);
  REQUIRE(program.run());
  CHECK(program.supervisor().state().outcome == Outcome::BinEmpty);
  CHECK(program.command().tool.linear().isApprox(options.places.T_base_rescan_end->linear(), 1e-6));
  int scans = 0;
  for (const JobRecord& r : program.journal().records()) scans += r.kind == RecordKind::Enter && r.phase == Phase::Scan;
  CHECK(scans == 2);
  options.places.T_base_rescan_end.reset();
  CHECK_THROWS_WITH(options.validate(), Catch::Contains("places.T_base_rescan_end must both be given, or neither"));
}

TEST_CASE("a pellet that falls is dropped, and the job goes on with the next one") {
  Folder folder;
  FakeCell cell(2, 1);
  Program program(cell, folder / "job.db", FakeCell::options(0));
  program.run(
      [&] { return program.supervisor().state().phase == Phase::Stand && cell.tool().translation().z() > 0.19; });
  cell.fall();
  REQUIRE(program.run());
  CHECK(program.supervisor().state().phase == Phase::Done);
  CHECK(cell.count(Place::Floor) == 1);
  CHECK(cell.count(Place::Tube) == 1);
  const JobBelief belief = program.journal().belief();
  REQUIRE(belief.pellets.size() == 2);
  CHECK(belief.pellets[0].state == PelletState::Dropped);
  CHECK(belief.pellets[1].state == PelletState::Inserted);
}

TEST_CASE("what was not asked for, or no longer, is not taken") {
  Folder folder;
  FakeCell cell(1, 1);
  Program program(cell, folder / "job.db", FakeCell::options(1));
  Supervisor& supervisor = program.supervisor();
  program.answering = false;
  CHECK_FALSE(supervisor.deliver(cell.scan(0)));
  bool swept = false;
  program.run([&] {
    swept = swept || supervisor.request().kind == RequestKind::Sweep;
    return supervisor.request().kind == RequestKind::Scan;
  });
  CHECK(swept);
  const JobOptions options = FakeCell::options(1);
  CHECK((cell.tool().translation() - options.places.T_base_scan_end.translation()).norm() < options.settled);
  const std::int64_t stamp = supervisor.request().stamp;
  CHECK_FALSE(supervisor.deliver(cell.scan(stamp - 1)));
  CHECK_FALSE(supervisor.deliver(cell.look(stamp)));
  CHECK(supervisor.deliver(cell.scan(stamp)));
  CHECK_FALSE(supervisor.deliver(cell.scan(stamp)));
}

TEST_CASE("a cell that is not as it is believed does not move") {
  const auto fault_of = [](const JobOptions& options, const robot::RobotReading& reading) {
    RecordRing ring;
    Supervisor supervisor(options, {}, ring);
    robot::RobotReading now = reading;
    for (int k = 0; k < 20 && !supervisor.finished(); ++k) {
      now.time += options.cycle;
      now.sensor[0] = 0.1 * k;
      const robot::RobotCommand command = supervisor.step(now);
      CHECK(command.stop == supervisor.finished());
      if (supervisor.finished()) CHECK(k == 0);  // it is not even sent to where it says that it is
      ring.note_written(ring.after(ring.written()) ? ring.written() + 1 : ring.written());
    }
    CHECK((supervisor.state().cell_fault == CellFault::None) == !supervisor.finished());
    return supervisor.state().cell_fault;
  };
  JobOptions options = FakeCell::options(1);
  options.lowest_joints = Eigen::VectorXd::Constant(6, -3.2);
  options.highest_joints = Eigen::VectorXd::Constant(6, 3.2);
  robot::RobotReading good;
  good.T_base_tool = pointing_down({0.3, 0, 0.3});
  good.joints = Eigen::VectorXd::Constant(6, 0.5);
  good.status.gripped = false;
  CHECK(fault_of(options, good) == CellFault::None);
  robot::RobotReading bad = good;
  bad.joints *= 180 / M_PI;  // degrees
  CHECK(fault_of(options, bad) == CellFault::Joints);
  bad = good;
  bad.joints.conservativeResize(5);
  CHECK(fault_of(options, bad) == CellFault::Joints);
  bad = good;
  bad.pose_mismatch = 0.05;
  CHECK(fault_of(options, bad) == CellFault::Pose);
  bad.pose_mismatch = std::nan("");
  CHECK(fault_of(options, bad) == CellFault::Pose);
  bad = good;
  bad.joints[2] = std::nan("");
  CHECK(fault_of(options, bad) == CellFault::Numbers);
  bad = good;
  bad.wrench[1] = 15;
  CHECK(fault_of(options, bad) == CellFault::Loaded);
  bad = good;
  bad.status.gripped = true;
  CHECK(fault_of(options, bad) == CellFault::Grip);
}

TEST_CASE("options that cannot be are named") {
  JobOptions options = FakeCell::options(1);
  options.motion.speed = options.stop.speed;
  CHECK_THROWS_WITH(options.validate(), "motion.speed must be less than stop.speed [m/s]");
  options = FakeCell::options(1);
  options.places.T_base_tube.linear() *= 2;
  CHECK_THROWS_WITH(options.validate(), "places.T_base_tube is no rigid motion");
  options = FakeCell::options(-1);
  CHECK_THROWS_WITH(options.validate(), "pellets must not be negative");
  options = FakeCell::options(1);
  options.lowest_joints = Eigen::VectorXd::Zero(6);
  CHECK_THROWS_WITH(options.validate(), "highest_joints must have as many values as lowest_joints");
}

/// Options of a job whose arm is known.
JobOptions with_arm(int pellets) {
  JobOptions out = FakeCell::options(pellets);
  out.arm = FakeCell::arm();
  return out;
}

TEST_CASE("an arm that is known goes from place to place as its joints are told to") {
  Folder folder;
  FakeCell cell(4, 1);
  Program program(cell, folder / "job.db", with_arm(4));
  int ways = 0;
  std::set<Phase> phases;
  program.has_way = [&](const WayRequest& asked) {
    CHECK(asked.phase == program.supervisor().state().phase);
    CHECK(asked.T_base_to.translation().z() >= JobPlaces{}.travel_height - 1e-9);
    phases.insert(asked.phase);
    return ++ways > 0;
  };
  REQUIRE(program.run());
  CHECK(program.supervisor().state().phase == Phase::Done);
  CHECK(cell.count(Place::Tube) == 4);
  CHECK(ways >= 1 + 4 * 4);
  CHECK(phases == std::set<Phase>{Phase::Scan, Phase::Pick, Phase::Stand, Phase::Regrip, Phase::Approach});
}

TEST_CASE("a pellet to which there is no way is left for another one, with nothing touched for it") {
  Folder folder;
  FakeCell cell(3, 1);
  Program program(cell, folder / "job.db", with_arm(2));
  bool refused = false;
  program.has_way = [&](const WayRequest& asked) {
    if (asked.phase != Phase::Pick || refused) return true;
    refused = true;
    return false;
  };
  REQUIRE(program.run());
  CHECK(program.supervisor().state().phase == Phase::Done);
  CHECK(cell.count(Place::Tube) == 2);
  int unreachable = 0;
  for (const JobRecord& r : program.journal().records()) unreachable += r.outcome == Outcome::Unreachable;
  CHECK(unreachable == 1);
  CHECK(program.journal().belief().pellets[0].picks == 2);
}

TEST_CASE("a pellet that cannot be brought on stops the arm as unreachable, before anything is touched") {
  for (const Phase phase : {Phase::Stand, Phase::Regrip, Phase::Approach}) {
    INFO(name_of(phase));
    Folder folder;
    FakeCell cell(1, 1);
    Program program(cell, folder / "job.db", with_arm(1));
    program.has_way = [&](const WayRequest& asked) { return asked.phase != phase; };
    REQUIRE(program.run());
    CHECK(program.supervisor().state().stop == StopReason::Unreachable);
    CHECK(program.supervisor().state().stopped_in == phase);
    CHECK(cell.tool().translation().z() > JobPlaces{}.travel_height - 1e-3);
  }
}

TEST_CASE("pellets that the arm cannot bring to the tube are no reason to call the bin empty") {
  Folder folder;
  FakeCell cell(0, 1);
  Program program(cell, folder / "job.db", with_arm(0));
  program.answering = false;
  ScanResult none;
  none.bin_empty = true;
  none.unreachable = 2;
  REQUIRE(program.run([&] {
    const PerceptionRequest asked = program.supervisor().request();
    none.stamp = asked.stamp;
    if (asked.kind == RequestKind::Way) program.supervisor().deliver(FakeCell::way(asked));
    if (asked.kind == RequestKind::Scan) program.supervisor().deliver(none);
    return false;
  }));
  CHECK(program.supervisor().state().stop == StopReason::Unreachable);
  CHECK(program.supervisor().state().attempt == usual_phases().row(Phase::Scan).retries + 1);
}

TEST_CASE("a way that nobody asked for is refused, and one that does not fit is none") {
  Folder folder;
  FakeCell cell(1, 1);
  Program program(cell, folder / "job.db", with_arm(1));
  program.answering = false;
  CHECK_FALSE(program.supervisor().deliver(WayResult{}));
  program.run([&] { return program.supervisor().request().kind == RequestKind::Way; });
  const PerceptionRequest asked = program.supervisor().request();
  WayResult other = FakeCell::way(asked);
  other.stamp = asked.stamp - 1;
  CHECK_FALSE(program.supervisor().deliver(other));
  other.stamp = asked.stamp;
  other.way.end[0] += 1e-3;
  CHECK(program.supervisor().deliver(other));
  for (int k = 0; k < 20; ++k) program.cycle();
  CHECK(program.supervisor().state().outcome == Outcome::Unreachable);
}

TEST_CASE("an operator stops an arm on its way, which stays where it is") {
  Folder folder;
  FakeCell cell(1, 1);
  Program program(cell, folder / "job.db", with_arm(1));
  run_into(program, Phase::Stand, 150);
  program.supervisor().stop_by_operator();
  const Pose before = cell.tool();
  for (int k = 0; k < 20; ++k) program.cycle();
  CHECK(program.supervisor().state().stop == StopReason::Operator);
  CHECK((cell.tool().translation() - before.translation()).norm() < 2 * PathLimits{}.speed * robot::usual_cycle);
}

}  // namespace supervisor_test
