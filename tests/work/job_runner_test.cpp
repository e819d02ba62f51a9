#include <kr5/work/job_runner.hpp>

#include <filesystem>
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

}  // namespace

TEST_CASE("a job brings the pellets of a small bin into the tube", "[long][not_sanitized]") {
  const std::uint64_t seed = GENERATE(as<std::uint64_t>{}, 831, 832);
  sim::WorkCell cell = cell_of(seed);
  work::WorkOptions options = work::work_options(cell);
  options.job.pellets = 3;
  work::place_over_bin(cell, options);
  job::Journal journal(new_journal("whole"), "test");
  work::JobRunner runner(cell, options, journal);
  const work::JobRun run = runner.run();
  CHECK(run.done());
  CHECK(run.state.inserted == 3);
  for (int k = 0; k < 250; ++k) {  // the last pellet may still fall
    cell.read();
    cell.send({});
  }
  for (const job::JobRecord& r : journal.records())
    UNSCOPED_INFO(r.time << " s, pellet " << r.pellet << ": " << name_of(r.kind) << " " << name_of(r.phase) << " after "
                         << name_of(r.outcome) << ", " << name_of(r.pellet_state) << ", attempt " << r.attempt);
  const work::JobTruth truth = work::judge_job(cell);
  INFO("loose " << truth.loose << ", lost " << truth.lost << ", on the stand " << truth.on_stand);
  for (const sim::PelletTruth& p : cell.truth().pellets)
    UNSCOPED_INFO(name_of(p.place) << ", in tube " << p.tube << ", depth " << p.depth << " m of " << p.height << " m");
  CHECK(truth.in_tube == 3);
  CHECK(run.statistics.peak_force < options.job.insertion.limits.force);
}

TEST_CASE("a job that is killed goes on from its journal with the state of the cell, or says what must be seen first",
          "[long][not_sanitized]") {
  const std::uint64_t seed = GENERATE(as<std::uint64_t>{}, 841, 842, 843, 844);
  sim::WorkCell first = cell_of(seed);
  work::WorkOptions options = work::work_options(first);
  options.job.pellets = 1;
  work::place_over_bin(first, options);
  const auto file = new_journal("killed");
  Random random(seed);
  const int kill = 200 + random.integer(1200);
  {
    job::Journal journal(file, "test");
    work::JobRunner runner(first, options, journal);
    for (int k = 0; k < kill; ++k) runner.step();
  }
  sim::WorkCell second = cell_of(seed);
  second.restore(first.state());
  job::Journal journal(file, "test");
  work::JobRunner runner(second, options, journal);
  INFO("killed in cycle " << kill << ": " << name_of(runner.decision().status) << ", "
                          << name_of(runner.decision().finding));
  CHECK(runner.decision().status != job::RestartStatus::Contradiction);
  CHECK(runner.decision().status != job::RestartStatus::Fresh);
  if (!runner.runs()) return;
  const Eigen::Vector3d before = second.read().T_base_tool.translation();
  runner.step();
  CHECK((runner.command().tool.translation() - before).norm() < 1e-12);
  const work::JobRun run = runner.run();
  CHECK(run.done());
  CHECK(run.state.inserted == 1);
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
  const Eigen::Vector3d before = cell.read().T_base_tool.translation();
  runner.step();
  CHECK((runner.command().tool.translation() - before).norm() < 1e-12);
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
