// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/dart_simulator.hpp>
#include <kr5/sim/driven_arm.hpp>
#include <kr5/sim/insertion.hpp>
#include <kr5/sim/insertion_options.hpp>
#include <kr5/sim/scene.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::sim;
using kr5::python::bind_enum;
using kr5::python::bind_struct;

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Steps an arm once a row and reads it after each: motor-side positions, currents, wrenches.
template <class Step>
static py::tuple each_row(DrivenArm& arm, const Rows& rows, Step step) {
  Rows q(rows.rows(), rows.cols()), current(rows.rows(), arm.drives().motors ? rows.cols() : 0);
  Rows wrench(rows.rows(), 6);
  {
    const py::gil_scoped_release free;
    for (Eigen::Index k = 0; k < rows.rows(); ++k) {
      step(Eigen::VectorXd(rows.row(k)));
      const ArmReading& now = arm.read();
      q.row(k) = now.position;
      if (current.cols() > 0) current.row(k) = now.current;
      wrench.row(k) = now.wrench;
    }
  }
  return py::make_tuple(q, current, wrench);
}

static void bind_arm(py::module_& m) {
  bind_struct<DrivenArmOptions>(m, "DrivenArmOptions", "Step and current limits of an arm.");
  py::class_<ArmReading>(m, "ArmReading", "What drives and sensor know at one instant, noise and sensor effects apart.")
      .def_readonly("t", &ArmReading::t, "Time [s].")
      .def_readonly("limited", &ArmReading::limited, "A motor stood at its current limit in the last step.")
      .def_property_readonly(
          "position", [](const ArmReading& r) { return r.position; }, "Motor side [rad or m].")
      .def_property_readonly(
          "velocity", [](const ArmReading& r) { return r.velocity; }, "[rad/s or m/s]")
      .def_property_readonly(
          "acceleration", [](const ArmReading& r) { return r.acceleration; }, "[rad/s^2 or m/s^2]")
      .def_property_readonly(
          "link", [](const ArmReading& r) { return r.link; }, "True joint values [rad or m].")
      .def_property_readonly(
          "torque", [](const ArmReading& r) { return r.torque; }, "Through the gears [N m or N].")
      .def_property_readonly(
          "current", [](const ArmReading& r) { return r.current; }, "Of the motors [A].")
      .def_property_readonly(
          "wrench", [](const ArmReading& r) { return r.wrench; }, "On the sensor, in S [N, N m].");
  py::class_<DrivenArm>(m, "DrivenArm", "The arm of a cell with motors, gears and joint servos, stepped through time.")
      .def(py::init<const kr5::cell::Cell&, const DrivenArmOptions&>(), py::arg("cell"),
           py::arg("options") = DrivenArmOptions{})
      .def_property_readonly("step", &DrivenArm::step, "Step of the integration [s].")
      .def("stable_step", &DrivenArm::stable_step, py::arg("position"), "Largest stable step of the gears there [s].")
      .def("reset", &DrivenArm::reset, py::arg("position"), py::arg("t") = 0.0, "At rest at motor-side joint values.")
      .def("follow", &DrivenArm::follow, py::arg("command"), "One step of the ideal joint servos.")
      .def("follow_limited", &DrivenArm::follow_limited, py::arg("command"), "The same within the current limit.")
      .def("drive", &DrivenArm::drive, py::arg("current"), "One step under motor currents [A].")
      .def(
          "follow_rows",
          [](DrivenArm& arm, const Rows& commands) {
            return each_row(arm, commands, [&](const Eigen::VectorXd& command) { arm.follow(command); });
          },
          py::arg("commands"), "A step of `follow` for each row; (positions, currents, wrenches), a row each step.")
      .def(
          "drive_rows",
          [](DrivenArm& arm, const Rows& currents) {
            return each_row(arm, currents, [&](const Eigen::VectorXd& current) { arm.drive(current); });
          },
          py::arg("currents"), "A step of `drive` for each row; (positions, currents, wrenches), a row each step.")
      .def("read", &DrivenArm::read, py::return_value_policy::copy, "The present instant.")
      .def("energy", &DrivenArm::energy, "Of links, rotors and gear springs [J].");
}

static void bind_scene(py::module_& m) {
  bind_enum<Statistic>(m, "Statistic", "What is taken of the rows of a column.");
  bind_struct<Expectation>(m, "Expectation", "What a column of a scene must show.");
  bind_struct<SceneCheck>(m, "SceneCheck", "What came of an expectation.");
  bind_struct<ScenePictures>(m, "ScenePictures", "Pictures that the camera of a scene takes.");
  bind_struct<ScenePicture>(m, "ScenePicture", "Where a picture was taken from, and what was there.");
  py::class_<SceneResult>(m, "SceneResult", "What came of a scene.")
      .def_readonly("passed", &SceneResult::passed, "All that was expected came true.")
      .def_readonly("steps", &SceneResult::steps, "Steps of the integration.")
      .def_property_readonly(
          "checks", [](const SceneResult& r) { return r.checks; }, "One an expectation (a copy).")
      .def_property_readonly(
          "rows", [](const SceneResult& r) { return r.rows; }, "A row every cycle (a copy).")
      .def_property_readonly(
          "cell", [](const SceneResult& r) { return r.cell; }, "With the effects it carried in the end (a copy).")
      .def_property_readonly(
          "things", [](const SceneResult& r) { return r.things; }, "Solids of the scene, its bench too (copies).")
      .def_property_readonly(
          "camera", [](const SceneResult& r) { return r.camera; }, "How pictures are taken, or None.")
      .def_property_readonly(
          "pictures", [](const SceneResult& r) { return r.pictures; },
          "Where each picture was taken from and what was there, for kr5.vision.render (copies).")
      .def_property_readonly(
          "profiles", [](const SceneResult& r) { return r.profiles; },
          "What the scanner measured, columns of the kind `scan` (a copy).");
  m.def(
      "run_scene", [](const std::filesystem::path& file) { return run_scene(file); }, py::arg("file"),
      py::call_guard<py::gil_scoped_release>(),
      "Runs a scene file (kr5-scene/1) and judges what it expects. Raises naming file and field.");
}

static void bind_insertion(py::module_& m) {
  bind_enum<Strategy>(m, "Strategy", "How a peg finds its hole.");
  bind_struct<InsertionSetup>(m, "InsertionSetup", "A task of insertion, and how well the cell knows itself.");
  bind_struct<PegOutcome>(m, "PegOutcome", "How one peg fared.");
  py::class_<InsertionResult>(m, "InsertionResult", "What came of an insertion.")
      .def_readonly("inserted", &InsertionResult::inserted, "Every peg is in.")
      .def_readonly("time", &InsertionResult::time, "Of all pegs, ways between them too [s].")
      .def_property_readonly(
          "pegs", [](const InsertionResult& r) { return r.pegs; }, "How each fared (copies).")
      .def_property_readonly(
          "rows", [](const InsertionResult& r) { return r.rows; },
          "A row each cycle: t; peg, phase (index in kr5.force.Phase), attempt; x y z tilt azimuth of the peg as the "
          "arm "
          "believes, in T; fx..tz on the peg, unfiltered, in T; true_x true_y true_z true_tilt of the peg in the tube "
          "as it "
          "really stands; q1..n [s, m, rad, N, N m]. Empty without `log` (a copy).")
      .def_property_readonly(
          "profile", [](const InsertionResult& r) { return r.profile; },
          "Of the last turn: azimuth, tilt, x, y, height as felt; closed_form, where the peg really stood; force, "
          "moment_x, moment_y about its bottom centre [rad, m, N, N m] (a copy).")
      .def_property_readonly(
          "T_tube_actual", [](const InsertionResult& r) { return r.T_tube_actual; },
          "The tube as it really stood, from where it is believed [m].")
      .def_property_readonly(
          "cell", [](const InsertionResult& r) { return r.cell; },
          "As it was run: bore and place of the tube (a copy).");
  m.def("insertion_options", &insertion_options, py::arg("cell"), py::arg("setup") = InsertionSetup{},
        "What kr5.force.Insertion is told in a cell: bodies, servo and grip as the cell believes them. Raises naming "
        "what "
        "is not there.");
  m.def(
      "run_insertion",
      [](const kr5::cell::Cell& cell, const InsertionSetup& setup,
         const std::optional<kr5::force::InsertionOptions>& options) {
        return run_insertion(cell, setup, options ? *options : insertion_options(cell, setup));
      },
      py::arg("cell"), py::arg("setup") = InsertionSetup{}, py::arg("options") = py::none(),
      py::call_guard<py::gil_scoped_release>(),
      "Inserts pegs in the simulated cell. What the cell cannot do is an outcome, with phase and reason; raises naming "
      "the "
      "field for a setup or options that are not valid, and for a cell that lacks something.");
}

void bind_sim(py::module_& m) {
  bind_enum<ContactBy>(m, "ContactBy", "What finds the contacts of peg, tube and bench.");
  bind_struct<DartSimulatorOptions>(m, "DartSimulatorOptions", "Step of the integration.");
  py::class_<DartSimulator, kr5::cell::Simulator>(
      m, "DartSimulator", "The full grade of a simulator: arm, drives and contacts stepped through time in DART.")
      .def(py::init<const DartSimulatorOptions&>(), py::arg("options") = DartSimulatorOptions{})
      .def("__repr__", [](const DartSimulator&) { return "DartSimulator()"; });
  bind_arm(m);
  bind_scene(m);
  bind_insertion(m);
}
