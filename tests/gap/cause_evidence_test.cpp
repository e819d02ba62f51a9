#include <kr5/gap/cause_evidence.hpp>

#include <cmath>
#include <limits>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>

#include "gap/protocol.hpp"

namespace cause_evidence_test {

using namespace kr5;
using Catch::Contains;

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The motions of the protocol, by their names, to fit or to check.
cell::Recording motions(const std::vector<cell::Split>& splits) {
  Random random(5);
  cell::Recording out = protocol::only(protocol::record(protocol::nominal(), random), cell::Kind::Motion);
  const cell::Experiment one = out.experiments.at(0);
  out.experiments.assign(splits.size(), one);
  for (std::size_t k = 0; k < splits.size(); ++k) {
    out.experiments[k].name = "motion-" + std::to_string(k + 1);
    out.experiments[k].split = splits[k];
  }
  return out;
}

/// Residuals of white noise of this size at each cell.
gap::ResidualColumn noise(const cell::Recording& r, std::size_t e, const std::string& column,
                          const std::vector<double>& sizes, Random& random) {
  const Eigen::Index rows = r.experiments[e].data.values.rows();
  Eigen::MatrixXd residuals(rows, std::ssize(sizes));
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index k = 0; k < residuals.cols(); ++k)
      residuals(i, k) = sizes[static_cast<std::size_t>(k)] * random.normal();
  return {r.experiments[e].name, column, 1.0, residuals};
}

}  // namespace

TEST_CASE("the experiments to check judge a column, and all where none is") {
  Random random(7);
  const cell::Recording r = motions({cell::Split::Fit, cell::Split::Check});
  const std::vector<gap::ResidualColumn> columns = {noise(r, 0, "i1", {2.0}, random), noise(r, 1, "i1", {5.0}, random),
                                                    noise(r, 0, "i2", {3.0}, random)};
  const auto found = gap::judged_columns(r, columns);
  REQUIRE(found.size() == 2);
  CHECK(found[0].column == "motion.i1");
  CHECK(found[0].experiments == std::vector<std::string>{"motion-2"});
  CHECK(found[0].gap == Approx(gap::residual_gap(columns[1].residuals.col(0))));
  CHECK(found[0].rows == columns[1].residuals.rows());
  CHECK(found[0].limit == Approx(gap::noise_limit(found[0].rows)));
  CHECK(found[1].experiments == std::vector<std::string>{"motion-1"});
  CHECK(found[1].gap == Approx(gap::residual_gap(columns[2].residuals.col(0))));
}

TEST_CASE("rows without a number do not count in the gap of residuals") {
  CHECK(gap::residual_gap(Eigen::Vector4d(3, nan, -4, nan)) == Approx(std::sqrt(12.5)));
  CHECK(std::isnan(gap::residual_gap(Eigen::Vector2d(nan, nan))));
  CHECK(std::isnan(gap::residual_gap({})));
}

TEST_CASE("the column of which a cause takes the most squares comes first") {
  Random random(11);
  const cell::Recording r = motions({cell::Split::Fit});
  // At the cell of the recording, with all causes, and without this one.
  const std::vector<gap::ResidualColumn> columns = {
      noise(r, 0, "i1", {4, 1, 2}, random), noise(r, 0, "i2", {4, 1, 4}, random), noise(r, 0, "i3", {4, 3, 1}, random)};
  const auto found = gap::cause_evidence(r, columns, 2, 1).columns;
  REQUIRE(found.size() == 3);
  CHECK(found[0].column == "motion.i2");
  CHECK(found[1].column == "motion.i1");
  CHECK(found[2].share < 0);  // it makes this one worse
  CHECK(found[0].share + found[1].share == Approx(1));
  CHECK(found[0].without == Approx(gap::residual_gap(columns[1].residuals.col(2))));
  CHECK(found[0].with_all == Approx(gap::residual_gap(columns[1].residuals.col(1))));
}

TEST_CASE("an experiment counts by its columns above the noise without the cause") {
  Random random(13);
  const cell::Recording r = motions({cell::Split::Fit, cell::Split::Fit, cell::Split::Fit});
  std::vector<gap::ResidualColumn> columns = {
      noise(r, 0, "i1", {4, 1, 4}, random), noise(r, 1, "i1", {1, 1, 1}, random), noise(r, 2, "i1", {4, 2, 4}, random)};
  columns[1].residuals.col(2) *= 0.9 / gap::residual_gap(columns[1].residuals.col(2));  // surely below its limit
  const auto found = gap::cause_evidence(r, columns, 2, 1).experiments;
  REQUIRE(found.size() == 2);
  CHECK(found[0].experiment == "motion-1");
  const double rows = static_cast<double>(columns[0].residuals.rows());
  const double without = columns[0].residuals.col(2).squaredNorm(), with = columns[0].residuals.col(1).squaredNorm();
  CHECK(found[0].closed == Approx((without - with) / (without - rows)));
  CHECK(found[1].experiment == "motion-3");
  CHECK(found[1].closed < found[0].closed);
}

TEST_CASE("residuals of another recording, or of a cell that is not there, are refused") {
  Random random(17);
  const cell::Recording r = motions({cell::Split::Fit});
  std::vector<gap::ResidualColumn> columns = {noise(r, 0, "i1", {1, 1}, random)};
  CHECK_THROWS_WITH(gap::cause_evidence(r, columns, 2, 1), Contains("2 cells, not of cell 2"));
  CHECK_THROWS_WITH(gap::judged_columns(r, columns, -1), Contains("not of cell -1"));
  columns[0].experiment = "motion-9";
  CHECK_THROWS_WITH(gap::judged_columns(r, columns), Contains("motion-9"));
  CHECK_THROWS_WITH(gap::cause_evidence(r, columns, 0, 1), Contains("motion-9"));
}

TEST_CASE("a size is measured from where its effect is off, by the best known number") {
  const cell::Cell cell = protocol::nominal();
  const double stated = cell.drives->friction.coulomb(1);
  const gap::EffectName friction = {"coulomb_friction", "joint2"};
  const auto of = [&](double value, double std) {
    return gap::deviations_from_off(cell, friction, {{"coulomb", {value}, {std}, "N m"}});
  };
  CHECK(*of(stated + 0.6, 0.2) == Approx(3));
  CHECK(*of(stated - 1.0, 0.2) == Approx(5));
  CHECK_FALSE(of(stated + 0.6, 0.0));  // not known

  const gap::EffectName tool = {"tool_offset", "tool"};  // an addition
  CHECK(*gap::deviations_from_off(cell, tool, {{"offset", {1e-3, 0, -2e-3}, {1e-3, 1e-3, 1e-4}, "m"}}) == Approx(20));
  CHECK_THROWS_WITH(gap::deviations_from_off(cell, {"coulomb_fricton", "joint2"}, {{"coulomb", {1}, {1}, "N m"}}),
                    Contains("coulomb_friction"));
}

TEST_CASE("a mounted pose is measured from that of the cell") {
  const cell::Cell cell = protocol::nominal();
  const gap::EffectName mount = {"laser_mount", "laser"};
  const auto nominal = cell::nominal_value(cell, mount.effect, mount.target, "T_E_L");
  REQUIRE(nominal);
  Vector6 moved = Vector6::Zero();
  moved[1] = 2e-3;
  moved[5] = 0.01;
  const Pose found = std::get<Pose>(*nominal) * to_pose(moved);
  gap::ParameterEstimate pose = {"T_E_L", {}, {1e-3, 1e-3, 1e-3, 1e-3, 1e-3, 1e-3}, ""};
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) pose.value.push_back(found.matrix()(row, column));
  CHECK(*gap::deviations_from_off(cell, mount, {pose}) == Approx(10));
}

}  // namespace cause_evidence_test
