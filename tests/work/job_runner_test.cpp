#include <kr5/work/job_runner.hpp>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>

#include <unistd.h>
#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

namespace job_runner_test {

using namespace kr5;
using Catch::Contains;

namespace {

sim::WorkCellOptions small_bin(std::uint64_t seed) {
  sim::WorkCellOptions out;
  out.pour.pellets = 3;
  out.pour.seed = static_cast<int>(seed);
  out.seed = seed;
  return out;
}

sim::WorkCell cell_of(std::uint64_t seed) {
  return sim::WorkCell(cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml"), small_bin(seed));
}

/// A journal that is not there yet.
std::filesystem::path new_journal(const std::string& name) {
  const auto out =
      std::filesystem::temp_directory_path() / ("kr5_job_runner_" + std::to_string(getpid()) + "_" + name + ".db");
  std::filesystem::remove(out);
  return out;
}

/// The last pellet may still fall.
void settle(sim::WorkCell& cell) {
  for (int k = 0; k < 250; ++k) {
    cell.read();
    cell.send({});
  }
}

/// What happened, for a test that fails.
void tell(const job::Journal& journal, const sim::WorkCell& cell) {
  for (const job::JobRecord& r : journal.records())
    UNSCOPED_INFO(r.time << " s, pellet " << r.pellet << ": " << name_of(r.kind) << " " << name_of(r.phase) << " after "
                         << name_of(r.outcome) << ", " << name_of(r.pellet_state) << ", attempt " << r.attempt);
  for (const sim::PelletTruth& p : cell.truth().pellets)
    UNSCOPED_INFO(name_of(p.place) << ", in tube " << p.tube << ", depth " << p.depth << " m of " << p.height << " m");
}

}  // namespace

TEST_CASE("a job brings the pellets of a small bin into the tube", "[long][not_sanitized]") {
  const std::uint64_t seed = GENERATE(as<std::uint64_t>{}, 8101, 8102);
  sim::WorkCell cell = cell_of(seed);
  work::WorkOptions options = work::work_options(cell);
  options.job.pellets = 3;
  work::place_over_bin(cell, options);
  job::Journal journal(new_journal("whole"), "test");
  work::JobRunner runner(cell, options, journal);
  const work::JobRun run = runner.run();
  CHECK(run.done());
  CHECK(run.state.inserted == 3);
  settle(cell);
  tell(journal, cell);
  CHECK(work::judge_job(cell).in_tube == 3);
  CHECK(run.statistics.peak_force < options.job.insertion.limits.force);
}

TEST_CASE("a job that is killed again and again does nothing twice, and loses nothing", "[long][not_sanitized]") {
  const std::uint64_t seed = GENERATE(as<std::uint64_t>{}, 8111, 8112, 8113, 8114);
  Random random(seed);
  const auto file = new_journal("killed" + std::to_string(seed));
  auto cell = std::make_unique<sim::WorkCell>(cell_of(seed));
  work::WorkOptions options = work::work_options(*cell);
  options.job.pellets = 1;
  work::place_over_bin(*cell, options);
  bool ended = false;
  for (int program = 0; program < 12 && !ended; ++program) {
    job::Journal journal(file, "test");
    work::JobRunner runner(*cell, options, journal);
    INFO("program " << program << ": " << name_of(runner.decision().status) << ", "
                    << name_of(runner.decision().finding));
    REQUIRE(runner.runs());
    const Eigen::Vector3d before = cell->read().T_base_tool.translation();
    runner.step();
    CHECK((runner.command().tool.translation() - before).norm() < 1e-12);
    const int kill = program == 11 ? 5000 : 100 + random.integer(500);
    for (int k = 0; k < kill && !runner.finished(); ++k) runner.step();
    ended = runner.finished();
    auto next = std::make_unique<sim::WorkCell>(cell_of(seed));
    next->restore(cell->state());
    cell = std::move(next);
  }
  job::Journal journal(file, "test");
  settle(*cell);
  tell(journal, *cell);
  CHECK(journal.belief().phase == job::Phase::Done);
  CHECK(journal.belief().inserted == 1);
  const work::JobTruth truth = work::judge_job(*cell);
  CHECK(truth.in_tube == 1);
  CHECK(truth.in_bin == 2);
}

TEST_CASE("what stands in the way is met with less than the limit of force, and the reason is told",
          "[long][not_sanitized]") {
  struct Obstacle {
    const char* what;
    double stand, tube;  ///< By which something stands on the stand, and the tube is higher than believed [m].
  };
  const auto obstacle =
      GENERATE(Obstacle{"low on the stand", 0.01, 0.0}, Obstacle{"as high as two pellets", 0.03, 0.0},
               Obstacle{"high on the stand", 0.065, 0.0}, Obstacle{"a tube that is 7 mm too high", 0.0, 0.007},
               Obstacle{"a tube that is 30 mm too high", 0.0, 0.03});
  const std::uint64_t seed = GENERATE(as<std::uint64_t>{}, 8131, 8132);
  cell::Cell given = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  sim::WorkCellOptions bin = small_bin(seed);
  given.effects.set("tube_shift", "tube", "shift", Eigen::VectorXd(Eigen::Vector3d(0, 0, obstacle.tube)));
  if (obstacle.stand > 0)
    bin.further_tubes.push_back(bin.stand.T_base_stand * Eigen::Translation3d(0.025, 0, obstacle.stand));
  sim::WorkCell cell(given, bin);
  work::WorkOptions options = work::work_options(cell);
  options.job.pellets = 1;
  work::place_over_bin(cell, options);
  job::Journal journal(new_journal("obstacle"), "test");
  work::JobRunner runner(cell, options, journal);
  double most = 0.0;
  while (!runner.finished()) {
    runner.step();
    most = std::max(most, cell.truth().contact.head<3>().norm());
  }
  INFO(obstacle.what << ", seed " << seed << ": " << name_of(runner.state().stop) << " in "
                     << name_of(runner.state().stopped_in) << ", " << most << " N");
  CHECK(most < options.job.insertion.limits.force);
  if (runner.state().phase == job::Phase::Done) return;
  CHECK(runner.state().phase == job::Phase::Stopped);
  if (obstacle.stand > 0) CHECK(runner.state().stopped_in == job::Phase::Stand);
}

TEST_CASE("a pellet that falls at the tube is counted where it is in, and else recorded as lost",
          "[long][not_sanitized]") {
  const auto when = GENERATE(force::Phase::Approach, force::Phase::Roll, force::Phase::Push);
  const std::uint64_t seed = GENERATE(as<std::uint64_t>{}, 8141, 8142);
  sim::WorkCell cell = cell_of(seed);
  work::WorkOptions options = work::work_options(cell);
  options.job.pellets = 1;
  work::place_over_bin(cell, options);
  job::Journal journal(new_journal("fallen"), "test");
  work::JobRunner runner(cell, options, journal);
  const auto at_tube = [&] {
    const job::Phase phase = runner.state().phase;
    const bool inserts = phase == job::Phase::Search || phase == job::Phase::Insert;
    return inserts && (runner.insertion().phase == when || runner.insertion().phase == force::Phase::Push);
  };
  while (!runner.finished() && !at_tube()) runner.step();
  REQUIRE_FALSE(runner.finished());
  cell.read();
  cell.send({.gripper = {.hold = false, .fingers = true}});
  while (!runner.finished()) runner.step();
  settle(cell);
  tell(journal, cell);
  INFO("lost in " << name_of(when) << ", seed " << seed << ": " << name_of(runner.state().stop) << ", "
                  << name_of(runner.state().cell_fault));
  const job::JobBelief belief = journal.belief();
  REQUIRE(!belief.pellets.empty());
  if (belief.phase == job::Phase::Done) {
    CHECK(belief.inserted == work::judge_job(cell).in_tube);
    CHECK(finished(belief.pellets.front().state));
  } else {
    CHECK(runner.state().stop != job::StopReason::None);
    CHECK(runner.state().cell_fault == job::CellFault::Tube);  // it stands on the tube
  }
}

TEST_CASE("a pellet that falls while no program runs is looked for, and no pellet is lost from the journal",
          "[long][not_sanitized]") {
  const std::uint64_t seed = GENERATE(as<std::uint64_t>{}, 8151, 8152, 8153, 8154);
  Random random(seed);
  sim::WorkCell cell = cell_of(seed);
  work::WorkOptions options = work::work_options(cell);
  options.job.pellets = 1;
  work::place_over_bin(cell, options);
  const auto file = new_journal("fell" + std::to_string(seed));
  {
    job::Journal journal(file, "test");
    work::JobRunner runner(cell, options, journal);
    while (!runner.finished() && runner.state().pellet_state < job::PelletState::Picked) runner.step();
    for (int left = random.integer(600); left > 0 && !runner.finished(); --left) runner.step();
    if (runner.finished()) return;
  }
  const bool held = cell.read().status.gripped;
  cell.send({.gripper = {.hold = false, .fingers = true}, .stop = true});
  settle(cell);
  job::Journal journal(file, "test");
  work::JobRunner runner(cell, options, journal);
  INFO("held " << held << ": " << name_of(runner.decision().status) << ", " << name_of(runner.decision().finding));
  REQUIRE(runner.runs());
  while (!runner.finished()) runner.step();
  settle(cell);
  tell(journal, cell);
  if (runner.state().stop == job::StopReason::CellFault) {
    CHECK(runner.state().cell_fault == job::CellFault::Tube);
    return;
  }
  CHECK(journal.belief().phase == job::Phase::Done);
  CHECK(journal.belief().inserted == work::judge_job(cell).in_tube);
}

TEST_CASE("a job that must be looked at says what, and goes on once that is said") {
  sim::WorkCell cell = cell_of(816);
  work::WorkOptions options = work::work_options(cell);
  REQUIRE((options.job.places.station_scan && options.job.places.tube_scan));
  options.job.places.station_scan.reset();
  work::place_over_bin(cell, options);
  job::Journal journal(new_journal("unseen"), "test");
  job::JobRecord regrip;
  regrip.number = 1;
  regrip.kind = job::RecordKind::Enter;
  regrip.phase = job::Phase::Regrip;
  regrip.pellet = 1;
  regrip.pellet_state = job::PelletState::Stood;
  journal.append({&regrip, 1});
  work::JobRunner blind(cell, options, journal);
  CHECK_FALSE(blind.runs());
  CHECK(blind.decision().finding == job::RestartFinding::StationUnseen);
  CHECK_THROWS_WITH(blind.state(), Contains("it cannot go on: unseen"));
  job::RestartMeasurements seen;
  seen.station = true;
  const work::JobRunner told(cell, options, journal, seen);
  CHECK(told.runs());
  CHECK(told.decision().phase == job::Phase::Regrip);
}

TEST_CASE("the arm stands where it was sent as soon as its setpoint does", "[long][not_sanitized]") {
  sim::WorkCell cell = cell_of(817);
  const work::WorkOptions options = work::work_options(cell);
  work::place_over_bin(cell, options);
  job::Journal journal(new_journal("led"), "test");
  work::JobRunner runner(cell, options, journal);
  while (!runner.finished() && runner.state().phase != job::Phase::Regrip) runner.step();
  REQUIRE_FALSE(runner.finished());
  const io::Table rows = runner.result().rows;
  const Eigen::MatrixXd set = rows.values.middleCols(7, 3), tool = rows.values.middleCols(13, 3);
  constexpr int stands = 6;  // cycles, in which delay and hold of the commands are over
  int stops = 0;
  for (Eigen::Index k = stands; k < set.rows(); ++k) {
    const Eigen::MatrixXd last = set.middleRows(k - stands, stands + 1);
    if ((last.rowwise() - last.row(0)).cwiseAbs().maxCoeff() > 1e-6) continue;
    ++stops;
    CHECK((tool.row(k) - set.row(k)).norm() < options.job.settled);
  }
  CHECK(stops > 10);
}

TEST_CASE("equal readings and answers give equal commands") {
  const auto run = [](const std::string& name) {
    sim::WorkCell cell = cell_of(813);
    const work::WorkOptions options = work::work_options(cell);
    work::place_over_bin(cell, options);
    job::Journal journal(new_journal(name), "test");
    work::JobRunner runner(cell, options, journal);
    for (int k = 0; k < 200; ++k) runner.step();
    return runner.result().rows.values;
  };
  const Eigen::MatrixXd once = run("once"), again = run("again");
  CHECK(once.rows() == 200);
  CHECK(once == again);
}

TEST_CASE("the first command of a program is where the arm is measured") {
  sim::WorkCell cell = cell_of(814);
  const work::WorkOptions options = work::work_options(cell);
  work::place_over_bin(cell, options);
  job::Journal journal(new_journal("first"), "test");
  work::JobRunner runner(cell, options, journal);
  const robot::RobotReading before = cell.read();
  runner.step();
  CHECK((runner.command().tool.translation() - before.T_base_tool.translation()).norm() < 1e-12);
  CHECK(runner.reading().time == before.time);
  CHECK(runner.reading().joints == before.joints);
}

TEST_CASE("a cell without camera, and options that do not fit, are refused with what is wrong") {
  cell::Cell blind = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  blind.camera.reset();
  const sim::WorkCell cell(blind, small_bin(815));
  CHECK_THROWS_WITH(work::work_options(cell), Contains("camera: the cell has none"));
  const sim::WorkCell seeing = cell_of(815);
  work::WorkOptions options = work::work_options(seeing);
  options.grip_height = 0.1;
  CHECK_THROWS_WITH(options.validate(), Contains("grip_height"));
}

}  // namespace job_runner_test
