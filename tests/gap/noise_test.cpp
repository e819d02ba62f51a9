#include "gap/screening/noise.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <catch2/catch.hpp>

#include "gap/linear_world.hpp"

/// @file
/// Noise read from neighbouring samples, and samples that stand out of it.

namespace noise_test {

using namespace kr5;
using namespace linear_world;

namespace {

/// A motion with one current: noise of a size and what is smooth beside it.
cell::Experiment current(double noise, double smooth, int rows = 2000, std::uint64_t seed = 41) {
  Random random(seed);
  cell::Experiment e = motion("motion-1", cell::Split::Fit, rows);
  add_column(e, "i1",
             random.normal_vector(rows, noise) + smooth * at_times(e, [](double t) { return std::sin(2 * t); }));
  return e;
}

cell::Experiment press(double noise, int rows) {
  Random random(42);
  cell::Experiment e = experiment("press-1", cell::Kind::Press, cell::Split::Fit);
  add_column(e, "run", Eigen::VectorXd::Zero(rows));
  add_column(e, "t", Eigen::VectorXd::LinSpaced(rows, 0.0, step * (rows - 1)));
  add_column(e, "zc", Eigen::VectorXd::Zero(rows));
  for (const char* column : {"fx", "fy", "fz", "tx", "ty", "tz"})
    add_column(e, column, random.normal_vector(rows, noise));
  return e;
}

/// Views of nine markers each, in a grid over the image.
cell::Experiment views(int count) {
  cell::Experiment e = experiment("views-1", cell::Kind::Views, cell::Split::Fit);
  const Eigen::Index rows = count * 36;
  Eigen::MatrixXd m(rows, 6);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Index view = i / 36, marker = (i / 4) % 9, corner = i % 4;
    m.row(i) << static_cast<double>(view), 20.0 * static_cast<double>(view), static_cast<double>(marker),
        static_cast<double>(corner), 100.0 * static_cast<double>(marker % 3) + (corner == 1 || corner == 2 ? 40 : 0),
        100.0 * static_cast<double>(marker / 3) + (corner > 1 ? 40 : 0);
  }
  const char* names[] = {"view", "t", "marker", "corner", "u", "v"};
  for (int k = 0; k < 6; ++k) add_column(e, names[k], m.col(k));
  for (int j = 1; j <= 6; ++j) add_column(e, "q" + std::to_string(j), Eigen::VectorXd::Zero(rows));
  return e;
}

const gap::NoiseScale* of(const std::vector<gap::NoiseScale>& all, const std::string& key) {
  const auto found = std::ranges::find(all, key, &gap::NoiseScale::key);
  return found == all.end() ? nullptr : &*found;
}

}  // namespace

TEST_CASE("noise is seen whatever smooth gap lies beside it") {
  for (const double noise : {0.5, 1.0, 3.0})
    for (const double smooth : {0.0, 200.0}) {
      const World world({current(noise, smooth)});
      std::vector<gap::ColumnName> coarse;
      const std::vector<gap::NoiseScale> found = gap::noise_scales(world.data, world.base, coarse);
      CHECK(coarse.empty());
      REQUIRE(found.size() == 1);
      CHECK(found[0].key == "current");
      CHECK_FALSE(found[0].kind);
      CHECK(found[0].samples == 1998.0);
      CHECK(std::abs(found[0].ratio - noise) < 4 * found[0].std);
      CHECK(found[0].std < 0.05 * noise);
      CHECK(gap::wrong(found[0]) == (noise != 1.0));
    }
}

TEST_CASE("noise that differs between kinds of experiments is told kind by kind") {
  cell::Experiment moving = current(1.0, 0.0);
  Random random(44);
  for (const char* column : {"fx", "fy", "fz", "tx", "ty", "tz"})
    add_column(moving, column, random.normal_vector(2000));
  for (const double of_press : {1.0, 2.0}) {
    const World world({moving, press(of_press, 2000)});
    std::vector<gap::ColumnName> coarse;
    const std::vector<gap::NoiseScale> found = gap::noise_scales(world.data, world.base, coarse);
    const auto forces = std::ranges::count(found, std::string("force"), &gap::NoiseScale::key);
    CHECK(forces == (of_press == 1.0 ? 1 : 2));
    CHECK(of(found, "force")->kind.has_value() == (of_press != 1.0));
    for (const gap::NoiseScale& s : found)
      if (s.kind) CHECK(s.ratio == Approx(*s.kind == cell::Kind::Press ? 2.0 : 1.0).epsilon(0.1));
  }
}

TEST_CASE("a column that shows almost no noise is coarse, and does not make that of its like seem small") {
  cell::Experiment e = current(1.0, 0.0);
  add_column(e, "i2", Eigen::VectorXd::Constant(2000, 3.0));
  const World world({e});
  std::vector<gap::ColumnName> coarse;
  const std::vector<gap::NoiseScale> found = gap::noise_scales(world.data, world.base, coarse);
  REQUIRE(coarse.size() == 1);
  CHECK(coarse[0].experiment == "motion-1");
  CHECK(coarse[0].column == "i2");
  REQUIRE(found.size() == 1);
  CHECK(found[0].ratio == Approx(1.0).epsilon(0.1));
  const World brief({current(1.0, 0.0, 45)});  // too few differences tell nothing
  CHECK(gap::noise_scales(brief.data, brief.base, coarse).empty());
}

TEST_CASE("a ratio is wrong when it is no chance, and a twelfth at least") {
  const auto scale = [](double ratio, double std) { return gap::NoiseScale{"force", {}, ratio, std, 100.0}; };
  CHECK_FALSE(gap::wrong(scale(1.08, 0.001)));
  CHECK(gap::wrong(scale(1.09, 0.001)));
  CHECK(gap::wrong(scale(0.91, 0.001)));
  CHECK_FALSE(gap::wrong(scale(1.39, 0.1)));
  CHECK(gap::wrong(scale(1.41, 0.1)));
}

TEST_CASE("the noise seen takes the place of the declared one, where it is wrong") {
  cell::Experiment moving = current(1.0, 0.0, 100);
  add_column(moving, "fx", Eigen::VectorXd::Constant(100, 6.0));
  World world({moving, press(1.0, 100)});
  const Eigen::VectorXd before = world.base;
  const auto corrected = gap::correct_wrong(
      world.data, {{"current", {}, 1.01, 0.1, 9}, {"force", cell::Kind::Motion, 2.0, 0.01, 9}}, world.base);
  REQUIRE(corrected.size() == 1);
  CHECK(corrected[0].key == "force");
  for (const gap::Block& block : world.data.blocks) {
    const double ratio = block.column == "fx" && block.kind == cell::Kind::Motion ? 2.0 : 1.0;
    CHECK(block.sigma == ratio);
    CHECK(Eigen::VectorXd(block.rows_of(world.base)) == Eigen::VectorXd(block.rows_of(before) / ratio));
  }
}

TEST_CASE("isolated samples are spikes; steps, bends and the others are none") {
  cell::Experiment e = current(1.0, 50.0);
  const std::set<Eigen::Index> spikes = {0, 700, 701, 1300, 1999};
  auto i1 = e.data.values.col(e.data.find("i1"));
  for (const Eigen::Index i : spikes) i1(i) += i % 2 == 0 ? 40.0 : -40.0;
  i1.tail(1000).array() += 60.0;  // a step
  World world({e});
  CHECK(gap::mark_spikes(world.data, world.base) == static_cast<int>(spikes.size()));
  for (Eigen::Index i = 0; i < 2000; ++i) CHECK((world.data.use(i) == 0.0) == spikes.contains(i));
  CHECK(gap::mark_spikes(world.data, world.base) == 0);  // they are not counted again
}

TEST_CASE("a ray that misses a sphere in the recording alone is no spike near its rim, until the cell is known") {
  cell::Experiment e = experiment("scan-1", cell::Kind::Scan, cell::Split::Fit);
  Random random(45);
  const Eigen::Index rows = 400;
  for (const char* column : {"line", "t", "speed", "q1", "q2", "q3", "q4", "q5", "q6", "x"})
    add_column(e, column, Eigen::VectorXd::Zero(rows));
  add_column(e, "z", random.normal_vector(rows));
  add_column(e, "sphere", Eigen::VectorXd::Zero(rows));
  e.data.values.col(e.data.find("sphere")).tail(200).setOnes();
  e.data.values(198, e.data.find("z")) = 50.0;
  e.data.values(50, e.data.find("z")) = 50.0;
  World world({e});
  world.data.simulator = &world.simulator;
  Eigen::VectorXd residual = e.data.column("z");
  CHECK(gap::mark_spikes(world.data, residual) == 1);
  CHECK(world.data.use(50) == 0.0);
  CHECK(world.data.use(198) == 1.0);
  CHECK(gap::mark_spikes(world.data, residual, true) == 1);
  CHECK(world.data.use(198) == 0.0);
}

TEST_CASE("corners that no smooth shift of their view explains are marked, and the others tell the noise") {
  World world({views(4)});
  const gap::ComparisonData& data = world.data;
  Random random(46);
  Eigen::VectorXd residual = random.normal_vector(data.size, 1.5);
  for (const gap::Block& block : data.blocks) {  // a shift of second order in the image
    const Eigen::ArrayXd u = data.experiment(block).data.column("u") / 100,
                         v = data.experiment(block).data.column("v") / 100;
    block.rows_of(residual).array() += 20 + 9 * u - 4 * v + 3 * u * v - 2 * u.square();
  }
  CHECK(gap::mark_stray_corners(world.data, residual) == 0);
  const gap::Block& of_v = *std::ranges::find(data.blocks, "v", &gap::Block::column);
  const Eigen::Index stray = of_v.first + 2 * 36 + 17;
  residual(stray) += 40.0;
  CHECK(gap::mark_stray_corners(world.data, residual) == 1);
  CHECK(data.use(stray) == 0.0);
  CHECK(data.use.sum() == static_cast<double>(data.size) - 1);
  // The part of a marker's corners that no smooth shift has; that of second order has little of it.
  residual(stray) -= 40.0;
  std::vector<gap::ColumnName> coarse;
  const auto found = gap::noise_scales(data, residual, coarse);
  REQUIRE(found.size() == 1);
  CHECK(found[0].key == "pixel");
  CHECK(std::abs(found[0].ratio - 1.5) < 4 * found[0].std);
}

}  // namespace noise_test
