#include "gap/comparison_data.hpp"

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/cell/known_directions.hpp>
#include <kr5/core/error.hpp>

#include "gap/linear_world.hpp"

/// @file
/// What is compared, and how it is stacked.

namespace comparison_data_test {

using namespace kr5;
using namespace linear_world;

namespace {

cell::Experiment poses(const std::vector<Eigen::Quaterniond>& turns) {
  cell::Experiment e = experiment("poses-1", cell::Kind::Poses, cell::Split::Check);
  const auto rows = static_cast<Eigen::Index>(turns.size());
  for (const char* column : {"pose", "t", "q1", "q2", "q3", "q4", "q5", "q6"})
    add_column(e, column, Eigen::VectorXd::Zero(rows));
  Eigen::MatrixXd q(rows, 4);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Quaterniond& turn = turns[static_cast<std::size_t>(i)];
    q.row(i) << turn.w(), turn.x(), turn.y(), turn.z();
  }
  const char* names[] = {"qw", "qx", "qy", "qz"};
  for (int k = 0; k < 4; ++k) add_column(e, names[k], q.col(k));
  return e;
}

cell::Experiment with_current(const std::string& name, cell::Split split, int rows, double value) {
  cell::Experiment e = motion(name, split, rows);
  add_column(e, "i2", Eigen::VectorXd::Constant(rows, value));
  return e;
}

/// Knows nothing of currents.
class NoCurrents : public Zeros {
 public:
  io::Table simulate(const cell::Cell& cell, const cell::Experiment& e) const override {
    require(e.kind != cell::Kind::Poses, "there is no arm");
    io::Table out = Zeros::simulate(cell, e);
    out.columns[static_cast<std::size_t>(out.find("i2"))] = "other";
    return out;
  }
};

}  // namespace

TEST_CASE("residuals are stacked experiment by experiment, each over the noise of its column") {
  cell::Cell cell = unit_noise();
  cell.noise.joint_current = {1, 2, 1, 1, 1, 1};
  cell.noise.pose_rotation = 0.5;
  const Eigen::Vector3d turn(0.3, -0.2, 0.1);
  const Eigen::Quaterniond q(Eigen::AngleAxisd(turn.norm(), turn.normalized()));
  const World world({with_current("motion-1", cell::Split::Fit, 5, 8.0), poses({q, Eigen::Quaterniond(-q.coeffs())})},
                    cell);
  const gap::ComparisonData& data = world.data;
  REQUIRE(data.blocks.size() == 4);
  REQUIRE(data.size == 5 + 3 * 2);
  CHECK(data.blocks_of[0] == std::vector<int>{0});
  CHECK(data.blocks_of[1] == std::vector<int>{1, 2, 3});
  CHECK(data.blocks[0].noise == "joint_current");
  CHECK(world.base.head(5) == Eigen::VectorXd::Constant(5, 4.0));
  for (Eigen::Index axis = 0; axis < 3; ++axis) {
    const gap::Block& block = data.blocks[static_cast<std::size_t>(1 + axis)];
    CHECK(block.orientation);
    for (Eigen::Index row = 0; row < 2; ++row)  // whatever the sign of the quaternion
      CHECK(block.rows_of(world.base)(row) == Approx(turn(axis) / 0.5));
  }
  const gap::Sum fit = gap::sum_of(data, world.base, cell::Split::Fit),
                 check = gap::sum_of(data, world.base, cell::Split::Check);
  CHECK(fit.chi2 == Approx(5 * 16.0));
  CHECK(fit.samples == 5.0);
  CHECK(check.chi2 == Approx(2 * turn.squaredNorm() / 0.25));
  CHECK(check.samples == 6.0);
}

TEST_CASE("spikes count as nothing, what cannot be compared as three sigma") {
  World world({with_current("motion-1", cell::Split::Fit, 4, 2.0)});
  world.data.use(1) = 0.0;
  world.base(2) = std::numeric_limits<double>::quiet_NaN();
  const Eigen::Vector4d expected(2.0, 0.0, 3.0, 2.0);
  CHECK(gap::counted_residual(world.data, world.base) == expected);
  CHECK(gap::sum_of(world.data, expected, cell::Split::Fit).samples == 3.0);
}

TEST_CASE("loads are not compared where the direction of their joint is not known") {
  cell::Recording r;
  r.cell = unit_noise();
  cell::Experiment e = motion("motion-1", cell::Split::Fit, 84);  // half a period of joint 1
  add_column(e, "i1", Eigen::VectorXd::Ones(84));
  add_column(e, "i2", Eigen::VectorXd::Ones(84));
  e.joint_reference = cell::JointReference::Measured;
  e.speed_noise = Eigen::VectorXd::Zero(6);
  e.speed_noise[0] = 0.5;  // rad/s, of a joint that swings at up to pi rad/s
  r.experiments = {e};
  const Zeros simulator;
  gap::ComparisonData data = gap::compare_columns(r, simulator);
  gap::compare_nominal(data);
  REQUIRE(data.blocks.size() == 2);
  const Eigen::ArrayXd known = cell::known_directions(e, 6).col(0);
  REQUIRE(known.sum() > 40);
  REQUIRE(known.sum() < 80);
  CHECK((data.blocks[0].rows_of(Eigen::VectorXd(data.use.matrix())).array() == known).all());
  CHECK(data.blocks[1].rows_of(Eigen::VectorXd(data.use.matrix())) == Eigen::VectorXd::Ones(84));
}

TEST_CASE("columns and experiments that cannot be compared are left out with the reason, and all of them is an error") {
  const NoCurrents simulator;
  cell::Recording r;
  r.cell = unit_noise();
  r.experiments = {with_current("motion-1", cell::Split::Fit, 5, 1.0), poses({Eigen::Quaterniond::Identity()})};
  add_column(r.experiments[0], "i3", Eigen::VectorXd::Ones(5));
  gap::ComparisonData data = gap::compare_columns(r, simulator);
  REQUIRE(data.blocks.size() == 5);
  const Eigen::VectorXd base = gap::compare_nominal(data);
  REQUIRE(data.blocks.size() == 1);
  CHECK(data.blocks[0].column == "i3");
  CHECK(data.blocks[0].first == 0);
  CHECK(base == Eigen::VectorXd::Ones(5));
  CHECK(data.blocks_of[1].empty());
  REQUIRE(data.left_out.size() == 2);
  CHECK(data.left_out[0].experiment == "poses-1");
  CHECK(data.left_out[0].reason == gap::LeftOutReason::Refused);
  CHECK(data.left_out[0].detail == "there is no arm");
  CHECK(data.left_out[1].columns == std::vector<std::string>{"i2"});
  CHECK(data.left_out[1].reason == gap::LeftOutReason::NotPredicted);
  r.experiments.erase(r.experiments.begin());
  gap::ComparisonData none = gap::compare_columns(r, simulator);
  CHECK_THROWS_WITH(gap::compare_nominal(none), Catch::Contains("there is no arm"));
  r.cell.noise = {};
  CHECK_THROWS_AS(
      [&] {
        gap::ComparisonData silent = gap::compare_columns(r, simulator);
        gap::compare_nominal(silent);
      }(),
      InvalidArgument);
}

TEST_CASE("clocks that count from long ago begin at the first row of their kind") {
  constexpr double epoch = 1.7e9;
  cell::Recording r;
  r.cell = unit_noise();
  r.experiments = {motion("motion-1", cell::Split::Fit, 5, epoch + 30),
                   motion("motion-2", cell::Split::Check, 5, epoch), poses({Eigen::Quaterniond::Identity()})};
  r.experiments[0].lead_in = r.experiments[0].data;
  r.experiments[0].lead_in.values.col(0).array() -= 40.0;  // the first of all
  const auto reset = gap::from_zero(r);
  REQUIRE(reset);
  CHECK(reset->experiments[0].lead_in.values(0, 0) == Approx(0.0).margin(1e-6));
  CHECK(reset->experiments[0].data.values(0, 0) == Approx(40.0));
  CHECK(reset->experiments[1].data.values(0, 0) == Approx(10.0));
  CHECK(reset->experiments[2].data.values == r.experiments[2].data.values);
  r.experiments = {motion("motion-1", cell::Split::Fit, 5, 9e5)};
  CHECK_FALSE(gap::from_zero(r));
}

TEST_CASE("kinds that are only fitted, or only checked, are told") {
  const World both(
      {with_current("motion-1", cell::Split::Fit, 4, 0.0), with_current("motion-2", cell::Split::Check, 4, 0.0)});
  CHECK(gap::missing_splits(both.data).empty());
  const World world({with_current("motion-1", cell::Split::Fit, 4, 0.0), poses({Eigen::Quaterniond::Identity()})});
  const std::vector<gap::MissingSplit> missing = gap::missing_splits(world.data);
  REQUIRE(missing.size() == 2);
  CHECK(missing[0].kind == cell::Kind::Motion);
  CHECK(missing[0].split == cell::Split::Check);
  CHECK(missing[1].kind == cell::Kind::Poses);
  CHECK(missing[1].split == cell::Split::Fit);
}

TEST_CASE("a setup's changes act on the prediction, and the number of rows must stay") {
  const World world({with_current("motion-1", cell::Split::Fit, 4, 2.0)});
  gap::Setup setup = world.recording.cell;
  setup.changes.emplace_back(
      [](io::Table& table, const cell::Experiment&) { table.values.col(table.find("i2")).setConstant(0.5); });
  CHECK(gap::compare(world.data, 0, setup).front() == Eigen::VectorXd::Constant(4, 1.5));
  setup.changes.emplace_back(
      [](io::Table& table, const cell::Experiment&) { table.values.conservativeResize(3, Eigen::NoChange); });
  CHECK_THROWS_AS(gap::compare(world.data, 0, setup), InvalidArgument);
  cell::Cell seven = world.recording.cell;
  seven.robot.dh.push_back(seven.robot.dh.back());
  CHECK_THROWS_AS(gap::require_joints(world.recording, seven), InvalidArgument);
  CHECK_NOTHROW(gap::require_joints(world.recording, world.recording.cell));
}

TEST_CASE("runs are told apart by the column of their kind, and a motion is one") {
  const cell::Experiment moving = motion("motion-1", cell::Split::Fit, 4);
  CHECK(gap::runs(moving) == Eigen::VectorXd::Zero(4));
  cell::Experiment step = experiment("step-1", cell::Kind::Step, cell::Split::Fit);
  add_column(step, "run", Eigen::Vector4d(0, 0, 1, 1));
  CHECK(gap::runs(step) == Eigen::Vector4d(0, 0, 1, 1));
}

}  // namespace comparison_data_test
