#include <catch2/catch.hpp>

#include <kr5/kinematics/newton_euler.hpp>
#include <kr5/physics/cubic_spline.hpp>

#include "predict/world.hpp"

namespace measured_motion_test {

using namespace kr5;
using namespace kr5::test;
using cell::Kind;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// The motion of the world on measured angles, of a cell without servos.
World measured_world() {
  World w;
  w.cell.servo.reset();
  cell::Experiment& e = w.experiments.front();
  e.joint_reference = cell::JointReference::Measured;
  return w;
}

MatrixXd columns_of(const io::Table& table, const std::string& stem) {
  MatrixXd out(table.values.rows(), 6);
  for (int i = 0; i < 6; ++i) out.col(i) = table.column(stem + std::to_string(i + 1));
  return out;
}

}  // namespace

TEST_CASE("a spline passes through its points with the slopes and curvatures of a cubic") {
  VectorXd t(7), y(7);
  t << 0.0, 0.1, 0.25, 0.3, 0.5, 0.6, 0.9;
  const auto cubic = [](double s) { return 1.0 - 2.0 * s + 0.5 * s * s + 3.0 * s * s * s; };
  for (Index k = 0; k < t.size(); ++k) y[k] = cubic(t[k]);
  const auto motion = physics::spline_motion(t, y);
  for (Index k = 0; k < t.size(); ++k) {
    CHECK(motion(k, 0) == Approx(y[k]).epsilon(1e-13));
    CHECK(motion(k, 1) == Approx(-2.0 + t[k] + 9.0 * t[k] * t[k]).epsilon(1e-11));
    CHECK(motion(k, 2) == Approx(1.0 + 18.0 * t[k]).epsilon(1e-9));
  }
}

TEST_CASE("measured angles drive the motors themselves, with no servo between") {
  const World w = measured_world();
  const cell::Experiment& e = w.of(Kind::Motion);
  const io::Table shown = predict::FastSimulator().predict(w.cell, e);
  CHECK(shown.find("q1") < 0);  // what is given is not predicted
  // The motion is start + size (1 - cos(rate t)): its torques by Newton-Euler at analytic speeds and accelerations.
  const VectorXd size = numbers({0.3, 0.15, 0.2, 0.4, 0.5, 0.6}), rate = numbers({2.0, 2.6, 3.1, 3.7, 4.1, 4.6});
  cell::Cell plain = w.cell;
  plain.drives.reset();
  const MatrixXd torque = columns_of(predict::FastSimulator().predict(plain, e), "tau");
  kinematics::Dynamics arm(cell::nominal_chain(w.cell), w.cell.robot.links, w.cell.robot.gravity);
  arm.add_body(5, {w.cell.tool->mass, w.cell.tool->com, w.cell.tool->inertia}, w.cell.tool->T_flange_sensor);
  const MatrixXd q = columns_of(e.data, "qc");
  double most = 0.0;
  for (Index k = 5; k + 5 < q.rows(); ++k) {
    const double t = 0.012 * static_cast<double>(k);
    const VectorXd qd = size.array() * rate.array() * (rate.array() * t).sin();
    const VectorXd qdd = size.array() * rate.array().square() * (rate.array() * t).cos();
    const kinematics::Rows at = q.row(k), speed = qd.transpose(), acceleration = qdd.transpose();
    const VectorXd expected = arm.loads(at, speed, acceleration).tau.row(0).transpose();
    most = std::max(most, (torque.row(k).transpose() - expected).cwiseAbs().maxCoeff());
  }
  CHECK(most < 0.02);  // [N m]: a spline through rows 12 ms apart
}

TEST_CASE("the motion that servos made of commands, given as measured, takes the same currents") {
  const World w;
  const io::Table commanded = predict::FastSimulator().predict(w.cell, w.of(Kind::Motion));
  World measured = w;
  cell::Experiment& e = measured.experiments.front();
  e.joint_reference = cell::JointReference::Measured;
  for (int i = 1; i <= 6; ++i)
    e.data.values.col(e.data.find("qc" + std::to_string(i))) = commanded.column("q" + std::to_string(i));
  const io::Table shown = predict::FastSimulator().predict(measured.cell, e);
  const MatrixXd difference = columns_of(shown, "i") - columns_of(commanded, "i");
  CHECK(difference.middleRows(20, difference.rows() - 40).cwiseAbs().maxCoeff() < 0.02);  // [A], noise is 0.03
}

TEST_CASE("joint torques that were logged beside currents follow from them by the nominal constants") {
  World w = measured_world();
  cell::Experiment& e = w.experiments.front();
  CHECK(predict::FastSimulator().predict(w.cell, e).find("tau1") < 0);
  for (int i = 1; i <= 6; ++i) {
    e.data.columns.push_back("tau" + std::to_string(i));
    e.data.values.conservativeResize(Eigen::NoChange, e.data.values.cols() + 1);
    e.data.values.rightCols<1>().setZero();
  }
  const World off = w.with("torque_constant", "joint2", {{"torque_constant", 0.9 * w.cell.drives->torque_constant[1]}});
  for (const World* world : {static_cast<const World*>(&w), &off}) {
    const io::Table shown = predict::FastSimulator().predict(world->cell, e);
    const MatrixXd expected =
        columns_of(shown, "i") * w.cell.drives->torque_constant.asDiagonal() * w.cell.drives->structure;
    CHECK((columns_of(shown, "tau") - expected).cwiseAbs().maxCoeff() < 1e-9);
  }
}

TEST_CASE("rows after a lead-in are those of the whole simulation") {
  const World w;
  const cell::Experiment& whole = w.of(Kind::Motion);
  const cell::Experiment late = cell::split_lead_in(whole, 2.0);
  CHECK(late.lead_in.values.rows() == 167);
  const io::Table all = predict::FastSimulator().predict(w.cell, whole);
  const io::Table shown = predict::FastSimulator().predict(w.cell, late);
  REQUIRE(shown.values.rows() == late.data.values.rows());
  CHECK((shown.values - all.values.bottomRows(shown.values.rows())).cwiseAbs().maxCoeff() == 0.0);
  cell::Experiment without = late;
  without.lead_in = {};
  const io::Table from_rest = predict::FastSimulator().predict(w.cell, without);
  CHECK((from_rest.column("i2") - shown.column("i2")).cwiseAbs().maxCoeff() > 0.3);  // the wrong beginning shows
}

}  // namespace measured_motion_test
