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
  py::class_<ArmReading>(m, "ArmReading",
                         "State of drives and sensor at one instant, without noise and sensor effects.")
      .def_readonly("t", &ArmReading::t, "Time [s].")
      .def_readonly("limited", &ArmReading::limited, "True when a motor was at its current limit in the last step.")
      .def_property_readonly(
          "position", [](const ArmReading& r) { return r.position; }, "Position, motor side [rad or m].")
      .def_property_readonly(
          "velocity", [](const ArmReading& r) { return r.velocity; }, "Speed, motor side [rad/s or m/s].")
      .def_property_readonly(
          "acceleration", [](const ArmReading& r) { return r.acceleration; },
          "Acceleration, motor side [rad/s^2 or m/s^2].")
      .def_property_readonly(
          "link", [](const ArmReading& r) { return r.link; }, "True joint values [rad or m].")
      .def_property_readonly(
          "torque", [](const ArmReading& r) { return r.torque; }, "Torque through the gears [N m or N].")
      .def_property_readonly(
          "current", [](const ArmReading& r) { return r.current; }, "Current of the motors [A].")
      .def_property_readonly(
          "wrench", [](const ArmReading& r) { return r.wrench; }, "Wrench on the sensor, in S [N, N m].");
  py::class_<DrivenArm>(m, "DrivenArm", "Arm of a cell with motors, gears and joint servos, stepped through time.")
      .def(py::init<const kr5::cell::Cell&, const DrivenArmOptions&>(), py::arg("cell"),
           py::arg("options") = DrivenArmOptions{})
      .def_property_readonly("step", &DrivenArm::step, "Step of the integration [s].")
      .def("stable_step", &DrivenArm::stable_step, py::arg("position"),
           "Largest stable step of the gears at this position [s].")
      .def("reset", &DrivenArm::reset, py::arg("position"), py::arg("t") = 0.0,
           "Resets the arm to rest at motor-side joint values.")
      .def("follow", &DrivenArm::follow, py::arg("command"), "One step with ideal joint servos.")
      .def("follow_limited", &DrivenArm::follow_limited, py::arg("command"),
           "One step with joint servos within the current limit.")
      .def("drive", &DrivenArm::drive, py::arg("current"), "One step under motor currents [A].")
      .def(
          "follow_rows",
          [](DrivenArm& arm, const Rows& commands) {
            return each_row(arm, commands, [&](const Eigen::VectorXd& command) { arm.follow(command); });
          },
          py::arg("commands"),
          "One step of `follow` for each row; returns (positions, currents, wrenches), one row per step.")
      .def(
          "drive_rows",
          [](DrivenArm& arm, const Rows& currents) {
            return each_row(arm, currents, [&](const Eigen::VectorXd& current) { arm.drive(current); });
          },
          py::arg("currents"),
          "One step of `drive` for each row; returns (positions, currents, wrenches), one row per step.")
      .def("read", &DrivenArm::read, py::return_value_policy::copy, "State at the present instant.")
      .def("energy", &DrivenArm::energy, "Energy of links, rotors and gear springs [J].");
}

static void bind_scene(py::module_& m) {
  bind_enum<Statistic>(m, "Statistic", "Statistic of the rows of a column.");
  bind_struct<Expectation>(m, "Expectation", "Expectation on a column of a scene.");
  bind_struct<SceneCheck>(m, "SceneCheck", "Result of an expectation.");
  bind_struct<ScenePictures>(m, "ScenePictures", "Pictures that the camera of a scene takes.");
  bind_struct<ScenePicture>(m, "ScenePicture", "Picture of a scene: camera pose and the scene before the camera.");
  py::class_<SceneResult>(m, "SceneResult", "Result of a scene.")
      .def_readonly("passed", &SceneResult::passed, "True when every expectation is met.")
      .def_readonly("steps", &SceneResult::steps, "Steps of the integration.")
      .def_property_readonly(
          "checks", [](const SceneResult& r) { return r.checks; }, "Result of each expectation (a copy).")
      .def_property_readonly(
          "rows", [](const SceneResult& r) { return r.rows; }, "Rows, one per cycle (a copy).")
      .def_property_readonly(
          "cell", [](const SceneResult& r) { return r.cell; },
          "Cell with its effects at the end of the scene (a copy).")
      .def_property_readonly(
          "solids", [](const SceneResult& r) { return r.solids; }, "Solids of the scene, including its bench (copies).")
      .def_property_readonly(
          "camera", [](const SceneResult& r) { return r.camera; }, "Options of the pictures, or None.")
      .def_property_readonly(
          "pictures", [](const SceneResult& r) { return r.pictures; },
          "Camera pose and scene of each picture, for kr5.vision.render (copies).")
      .def_property_readonly(
          "profiles", [](const SceneResult& r) { return r.profiles; },
          "Profiles of the scanner, with the columns of the kind `scan` (a copy).");
  m.def(
      "run_scene", [](const std::filesystem::path& file) { return run_scene(file); }, py::arg("file"),
      py::call_guard<py::gil_scoped_release>(),
      "Runs a scene file (kr5-scene/1) and evaluates its expectations. Exceptions name file and field.");
}

static void bind_insertion(py::module_& m) {
  bind_enum<Strategy>(m, "Strategy", "Strategy by which the hole is found.");
  bind_struct<InsertionSetup>(m, "InsertionSetup", "Task of an insertion, and the uncertainty of the cell.");
  bind_struct<PegOutcome>(m, "PegOutcome", "Outcome of one peg.");
  py::class_<InsertionResult>(m, "InsertionResult", "Result of an insertion.")
      .def_readonly("inserted", &InsertionResult::inserted, "True when every peg is inserted.")
      .def_readonly("time", &InsertionResult::time, "Time of all pegs, including the motions between them [s].")
      .def_property_readonly(
          "pegs", [](const InsertionResult& r) { return r.pegs; }, "Outcome of each peg (copies).")
      .def_property_readonly(
          "rows", [](const InsertionResult& r) { return r.rows; },
          "Rows, one per cycle: t; peg, phase (index in kr5.force.Phase), attempt; x y z tilt azimuth of the peg "
          "according to the arm, in T; fx..tz on the peg, unfiltered, in T; true_x true_y true_z true_tilt of the peg "
          "in the actual tube; q1..n [s, m, rad, N, N m]. Empty without `log` (a copy).")
      .def_property_readonly(
          "profile", [](const InsertionResult& r) { return r.profile; },
          "Profile of the last turn: azimuth, tilt, x, y, height as measured; closed_form, the height at the true "
          "position of the peg; force, moment_x, moment_y about its bottom centre [rad, m, N, N m] (a copy).")
      .def_property_readonly(
          "T_tube_actual", [](const InsertionResult& r) { return r.T_tube_actual; },
          "True pose of the tube in its believed frame [m].")
      .def_property_readonly(
          "cell", [](const InsertionResult& r) { return r.cell; },
          "Setup of the run, with bore and position of the tube (a copy).");
  m.def("insertion_options", &insertion_options, py::arg("cell"), py::arg("setup") = InsertionSetup{},
        "Options of kr5.force.Insertion for a cell: bodies, servo and grip as the cell states them. Exceptions name a "
        "missing part.");
  m.def(
      "run_insertion",
      [](const kr5::cell::Cell& cell, const InsertionSetup& setup,
         const std::optional<kr5::force::InsertionOptions>& options) {
        return run_insertion(cell, setup, options ? *options : insertion_options(cell, setup));
      },
      py::arg("cell"), py::arg("setup") = InsertionSetup{}, py::arg("options") = py::none(),
      py::call_guard<py::gil_scoped_release>(),
      "Inserts pegs in the simulated cell. An insertion that fails is an outcome, with phase and reason; exceptions "
      "name the field of an invalid setup or option, or the missing part of the cell.");
}

void bind_sim(py::module_& m) {
  bind_enum<ContactBy>(m, "ContactBy", "Method that finds the contacts of peg, tube and bench.");
  bind_struct<DartSimulatorOptions>(m, "DartSimulatorOptions", "Step of the integration.");
  py::class_<DartSimulator, kr5::cell::Simulator>(
      m, "DartSimulator", "Full simulator: arm, drives and contacts stepped through time in DART.")
      .def(py::init<const DartSimulatorOptions&>(), py::arg("options") = DartSimulatorOptions{})
      .def("__repr__", [](const DartSimulator&) { return "DartSimulator()"; });
  bind_arm(m);
  bind_scene(m);
  bind_insertion(m);
}
