// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/contact_stiffness.hpp>
#include <kr5/identification/force_loop_design.hpp>
#include <kr5/identification/force_torque.hpp>
#include <kr5/identification/joint_motion.hpp>
#include <kr5/identification/servo.hpp>
#include <kr5/physics/identified_cell.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::identification;

static void bind_servo(py::module_& m) {
  kr5::python::bind_enum<CommandShape>(m, "CommandShape", "The command between two samples.");
  kr5::python::bind_struct<ServoLog>(m, "ServoLog", "Commands to one axis and where it was.");
  kr5::python::bind_struct<ServoOptions>(m, "ServoOptions", "Options of identify_servo.");
  kr5::python::bind_struct<OvershootReading>(m, "OvershootReading", "Formula of the overshoot on a measured step.");
  kr5::python::bind_struct<ServoResult>(m, "ServoResult", "Servo with its covariance.");
  m.def(
      "servo_from_overshoot", &servo_from_overshoot, py::arg("step"), py::arg("overshoot"), py::arg("period"),
      "Damping ratio and natural frequency from the overshoot of a step and the period of the damped oscillation [s]\n"
      "(Hayat et al. 2022, eq. 5.11 and 5.12).");
  m.def("identify_servo", &identify_servo, py::arg("log"), py::arg("options") = ServoOptions(),
        py::call_guard<py::gil_scoped_release>(),
        "Natural frequency, damping ratio, delay, gain and offset of a servo by least squares over the whole\n"
        "response.\n\nParameters\n----------\nlog : ServoLog\noptions : ServoOptions\n\n"
        "Returns\n-------\nServoResult\n    Check `fit.usable` before using the servo.\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    An invalid log or option.");
}

static void bind_contact(py::module_& m) {
  kr5::python::bind_struct<ContactLog>(m, "ContactLog", "Force against depth, both positive into the contact.");
  kr5::python::bind_struct<ContactStiffnessOptions>(m, "ContactStiffnessOptions",
                                                    "Options of identify_contact_stiffness.");
  kr5::python::bind_struct<ContactStiffnessResult>(m, "ContactStiffnessResult", "Contact with its covariance.");
  m.def("identify_contact_stiffness", &identify_contact_stiffness, py::arg("log"),
        py::arg("options") = ContactStiffnessOptions(), py::call_guard<py::gil_scoped_release>(),
        "Stiffness and position of a contact from force against depth (Hayat et al. 2022, eq. 5.14).\n\n"
        "Parameters\n----------\nlog : ContactLog\noptions : ContactStiffnessOptions\n\n"
        "Returns\n-------\nContactStiffnessResult\n    Check `fit.usable` before using the stiffness.\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    Invalid readings or options.");
}

static void bind_force_loop_design(py::module_& m) {
  kr5::python::bind_struct<ForceLoopPlant>(m, "ForceLoopPlant", "Servo, cycle and contact that a force loop acts on.");
  kr5::python::bind_struct<ForceLoopDesignOptions>(m, "ForceLoopDesignOptions", "Options of design_force_loop.");
  kr5::python::bind_struct<ForceLoopPoint>(m, "ForceLoopPoint", "A force loop at one stiffness.");
  kr5::python::bind_struct<ForceLoopDesign>(m, "ForceLoopDesign", "Design of a force loop over a range of stiffness.");
  m.def("design_force_loop", &design_force_loop, py::arg("plant"), py::arg("loop"),
        py::arg("options") = ForceLoopDesignOptions(), py::call_guard<py::gil_scoped_release>(),
        "Compensator, errors, margins and response of the sampled force loop over a range of stiffness\n"
        "(Hayat et al. 2022, section 5.3.2), from the eigenvalues of the loop.\n\n"
        "Parameters\n----------\nplant : ForceLoopPlant\nloop : kr5.force.ForceLoopOptions\n"
        "options : ForceLoopDesignOptions\n\nReturns\n-------\nForceLoopDesign\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    A field that cannot be.");
  m.def("force_loop_matrix", &force_loop_matrix, py::arg("plant"), py::arg("correction"), py::arg("gain"),
        "Matrix of the sampled closed loop: position [m], speed [m/s], then the commands on their way [m].");
}

static void bind_force_torque(py::module_& m) {
  kr5::python::bind_enum<GainModel>(m, "GainModel", "Entries of the gain that are estimated.");
  kr5::python::bind_struct<ForceTorqueReading>(m, "ForceTorqueReading", "Reading of a force/torque sensor.");
  kr5::python::bind_struct<ForceTorqueOptions>(m, "ForceTorqueOptions", "Options of identify_force_torque.");
  kr5::python::bind_struct<SensorParameter>(m, "SensorParameter", "One number of the sensor or the tool.");
  kr5::python::bind_struct<ForceTorqueResult>(m, "ForceTorqueResult", "Sensor and tool with their covariance.");
  m.def(
      "identify_force_torque",
      [](const std::vector<ForceTorqueReading>& readings, const ForceTorqueOptions& options) {
        return identify_force_torque(readings, options);
      },
      py::arg("readings"), py::arg("options") = ForceTorqueOptions(), py::call_guard<py::gil_scoped_release>(),
      "Bias, tool and, when asked for, drift, orientation, gain and crosstalk of a force/torque sensor.\n\n"
      "Parameters\n----------\nreadings : list of ForceTorqueReading\noptions : ForceTorqueOptions\n\n"
      "Returns\n-------\nForceTorqueResult\n    Check `fit.usable`; its message names what the readings do not "
      "tell.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Invalid readings or options.");
  m.def("posture_readings", &posture_readings, py::arg("cell"), py::arg("q"), py::arg("wrench"),
        py::arg("t") = Eigen::VectorXd(),
        "Readings of postures that rest: q (N x n) [rad or m] and wrench (N x 6) [N, N m] a row each, times [s] or "
        "none.");
  m.def("motion_readings", &motion_readings, py::arg("cell"), py::arg("t"), py::arg("command"), py::arg("wrench"),
        "Readings of a motion with the accelerations that the joint servos of the cell make of the commands (N x n).");
}

/// What puts identified values into a cell, effects that would replace them aside.
static void bind_identified_cell(py::module_& m) {
  using kr5::cell::Cell;
  m.def("set_path_servo", &kr5::physics::set_path_servo, py::arg("cell"), py::arg("servo"), py::arg("cycle"),
        "Puts the servo of the path correction into a cell; `cycle` [s] is for a cell that states none.");
  m.def("set_joint_servo", &kr5::physics::set_joint_servo, py::arg("cell"), py::arg("joint"), py::arg("servo"),
        py::arg("cycle"), "Puts the servo of a joint (from 0) into a cell; the others keep theirs.");
  m.def("set_contact_stiffness", &kr5::physics::set_contact_stiffness, py::arg("cell"), py::arg("stiffness"),
        "Puts the stiffness of the contact [N/m] into a cell.");
  m.def("set_tool_mass", &kr5::physics::set_tool_mass, py::arg("cell"), py::arg("mass"), py::arg("com"),
        "Puts mass [kg] and centre [m] of all below the sensor, a payload included, into a cell.");
  m.def(
      "set_wrench_sensor",
      [](Cell& cell, const ForceTorqueResult& found) {
        kr5::physics::WrenchSensor sensor;
        sensor.gain = found.gain, sensor.bias = found.bias, sensor.rate = found.rate;
        kr5::physics::set_wrench_sensor(cell, sensor);
      },
      py::arg("cell"), py::arg("result"), "Puts bias, drift, gain and crosstalk of a ForceTorqueResult into a cell.");
}

void bind_identification(py::module_& m) {
  m.doc() = "Identification of an arm's dynamics, drives and sensors from its logs.";
  kr5::python::bind_struct<JointMotion>(m, "JointMotion", "Measured motion of an arm with its joint torques.")
      .def("validate", &JointMotion::validate, "Raises InvalidArgument naming field and row.");
  bind_servo(m);
  bind_contact(m);
  bind_force_loop_design(m);
  bind_force_torque(m);
  bind_identified_cell(m);
}
