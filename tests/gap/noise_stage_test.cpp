#include "gap/stages/noise_stage.hpp"

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>

#include "gap/staged.hpp"

/// @file
/// Noise that counts: as declared, as seen, or beside what the simulator is known to be off.

namespace noise_stage_test {

using namespace kr5;
using namespace staged;

namespace {

gap::CompareOutput compared(const cell::Recording& r) {
  static const Zeros simulator;
  return gap::compare_stage(r, simulator, {});
}

}  // namespace

TEST_CASE("noise as declared changes nothing") {
  const cell::Recording r = Recorded{}.recording();
  const gap::CompareOutput before = compared(r);
  const gap::NoiseOutput after = gap::noise_stage(before, {});
  CHECK(after.base == before.base);
  CHECK(after.corrected.empty());
  CHECK(after.coarse.empty());
  CHECK(after.excused.empty());
  CHECK(after.spikes == 0);
}

TEST_CASE("noise that is seen takes the place of the declared one, and spikes are marked by it") {
  Recorded noisy{.noise = 3.0};
  cell::Recording r = noisy.recording();
  for (cell::Experiment& e : r.experiments) e.data.values.col(e.data.find("i1")) = 3.0 * e.data.column("i1");
  r.experiments[0].data.values(100, r.experiments[0].data.find("i1")) += 60.0;
  const gap::CompareOutput before = compared(r);
  const gap::NoiseOutput after = gap::noise_stage(before, {});
  REQUIRE(after.corrected.size() == 1);
  CHECK(after.corrected[0].key == "current");
  CHECK(after.corrected[0].ratio == Approx(3.0).epsilon(0.1));
  CHECK(after.spikes == 1);
  CHECK(after.data.use(100) == 0.0);
  for (const gap::Block& block : after.data.blocks) CHECK(block.sigma == Approx(after.corrected[0].ratio));
  CHECK((after.base * after.corrected[0].ratio - before.base).norm() < 1e-9 * before.base.norm());
  CHECK(before.data.blocks[0].sigma == 1.0);  // the input stays
}

TEST_CASE("noise that is alike in neighbouring rows keeps its size, and says less") {
  constexpr double correlation = 0.8;
  cell::Recording r = Recorded{}.recording();
  for (cell::Experiment& e : r.experiments) {
    auto i2 = e.data.values.col(e.data.find("i2"));
    for (Eigen::Index i = 1; i < i2.size(); ++i)
      i2[i] = correlation * i2[i - 1] + std::sqrt(1 - correlation * correlation) * i2[i];
  }
  gap::DiagnoseOptions options;
  options.noise_correlations = {{"motion.i2", correlation}};
  const gap::NoiseOutput after = gap::noise_stage(compared(r), options);
  CHECK(after.corrected.empty());
  CHECK(after.excused.empty());
  for (const gap::Block& block : after.data.blocks)
    CHECK(block.inflation == Approx(block.column == "i2" ? 3.0 : 1.0));  // (1 + 0.8) / (1 - 0.8) = 9
  options.noise_correlations = {{"motion.i9", correlation}};
  CHECK_THROWS_WITH(gap::noise_stage(compared(r), options),
                    Catch::Contains("noise_correlations") && Catch::Contains("motion.i9"));
  options.noise_correlations = {{"motion.i2", 1.0}};
  CHECK_THROWS_WITH(options.validate(), Catch::Contains("motion.i2"));
}

TEST_CASE("a known error counts as noise beside that of the sensor, in its column alone") {
  const cell::Recording r = Recorded{}.recording();
  const gap::CompareOutput before = compared(r);
  gap::DiagnoseOptions options;
  options.simulator_errors = {{"motion.i2", 2.0}};
  const gap::NoiseOutput after = gap::noise_stage(before, options);
  REQUIRE(after.excused.size() == 1);  // once, of two experiments
  CHECK(after.excused[0].column == "motion.i2");
  for (std::size_t b = 0; b < after.data.blocks.size(); ++b) {
    const gap::Block& block = after.data.blocks[b];
    const double inflation = block.column == "i2" ? std::sqrt(5.0) : 1.0;
    CHECK(block.inflation == Approx(inflation));
    CHECK(block.sigma == Approx(inflation));
    CHECK((block.rows_of(after.base) * inflation - block.rows_of(before.base)).norm() < 1e-9);
  }
  options.simulator_errors = {{"motion.i9", 2.0}};
  CHECK_THROWS_WITH(gap::noise_stage(before, options),
                    Catch::Contains("found column 'motion.i9'") && Catch::Contains("motion.i1, motion.i2"));
}

TEST_CASE("with known errors a spike is what stands out of noise and error together") {
  cell::Recording r = Recorded{}.recording();
  r.experiments[0].data.values(100, r.experiments[0].data.find("i2")) = 12.0;
  const gap::CompareOutput before = compared(r);
  CHECK(gap::noise_stage(before, {}).spikes == 1);
  gap::DiagnoseOptions options;
  options.simulator_errors = {{"motion.i2", 20.0}};
  CHECK(gap::noise_stage(before, options).spikes == 0);
}

}  // namespace noise_stage_test
