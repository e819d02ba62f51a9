// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/wrench_sensor.hpp>

#include <cmath>

#include <catch2/catch.hpp>

#include <kr5/cell/effect.hpp>
#include <kr5/core/error.hpp>

namespace wrench_sensor_test {

using namespace kr5;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using physics::WrenchSensor;

namespace {

cell::Cell cell_with(const std::vector<std::pair<std::string, double>>& of_fx) {
  cell::Cell cell = cell::load_cell(KR5_SHARE_DIR "/cells/kr5_arc.yaml");
  for (const auto& [name, value] : of_fx) {
    const auto dot = name.find('.');
    cell::set_effect(cell, name.substr(0, dot), "fx", name.substr(dot + 1), value);
  }
  return cell;
}

}  // namespace

TEST_CASE("a sound sensor shows the wrench") {
  MatrixXd wrench = MatrixXd::Random(4, 6);
  const MatrixXd before = wrench;
  physics::apply_sensor_effects(WrenchSensor(cell_with({})), VectorXd::LinSpaced(4, 0, 1), {{0, 4}}, wrench);
  CHECK(wrench == before);
}

TEST_CASE("scale, crosstalk, bias and drift add up, in the rows and at one instant") {
  const WrenchSensor sensor(cell_with({{"ft_gain.gain", 1.1},
                                       {"ft_crosstalk.source", 4.0},
                                       {"ft_crosstalk.gain", 0.3},
                                       {"ft_bias.bias", 2.0},
                                       {"ft_drift.rate", 0.5}}));
  MatrixXd wrench(1, 6);
  wrench << 10.0, 1.0, 2.0, 3.0, 4.0, 5.0;
  const Vector6 instant = sensor.distorted(wrench.row(0), 6.0);
  physics::apply_sensor_effects(sensor, VectorXd::Constant(1, 6.0), {{0, 1}}, wrench);
  CHECK(wrench(0, 0) == Approx(1.1 * 10.0 + 0.3 * 4.0 + 2.0 + 0.5 * 6.0).epsilon(1e-14));
  CHECK(wrench.rightCols(5) == (Eigen::RowVectorXd(5) << 1.0, 2.0, 3.0, 4.0, 5.0).finished());
  CHECK((instant - wrench.row(0).transpose()).cwiseAbs().maxCoeff() < 1e-13);
}

TEST_CASE("the filter answers a step as a first-order lag does, and starts anew with each run") {
  cell::Cell cell = cell_with({});
  cell::set_effect(cell, "ft_lag", "force_torque", "time_constant", 0.04);
  const VectorXd t = VectorXd::LinSpaced(41, 0.0, 0.4);
  MatrixXd wrench = MatrixXd::Zero(41, 6);
  wrench.bottomRows(40).setOnes();
  MatrixXd second = wrench;
  physics::apply_sensor_effects(WrenchSensor(cell), t, {{0, 41}}, wrench);
  for (Eigen::Index k = 0; k < 41; ++k) CHECK(wrench(k, 2) == Approx(1.0 - std::exp(-t[k] / 0.04)).margin(1e-12));
  physics::apply_sensor_effects(WrenchSensor(cell), t, {{0, 1}, {1, 41}}, second);
  CHECK(second.bottomRows(40) == MatrixXd::Ones(40, 6));
}

TEST_CASE("a filter that is stepped shows what it shows of a whole run") {
  cell::Cell cell = cell_with({});
  cell::set_effect(cell, "ft_lag", "force_torque", "time_constant", 0.04);
  const WrenchSensor sensor(cell);
  const VectorXd t = VectorXd::LinSpaced(20, 1.0, 1.5);
  const MatrixXd wrench = MatrixXd::Random(20, 6);
  MatrixXd whole = wrench;
  physics::apply_sensor_effects(sensor, t, {{0, 20}}, whole);
  physics::WrenchFilter filter(sensor.time_constant), none(0.0);
  for (Eigen::Index k = 0; k < 20; ++k) {
    CHECK(filter.pass(wrench.row(k), t[k]) == whole.row(k).transpose());
    CHECK(none.pass(wrench.row(k), t[k]) == wrench.row(k).transpose());
  }
}

}  // namespace wrench_sensor_test
