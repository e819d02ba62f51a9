// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/robot/loopback.hpp>

#include <pybind11/functional.h>

#include "joint_vector_conversion.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::robot;
using kr5::python::bind_enum;
using kr5::python::bind_struct;

namespace {

void bind_exchange(py::module_& m) {
  m.attr("usual_cycle") = usual_cycle;
  m.attr("max_joints") = max_joints;
  bind_struct<RobotStatus>(m, "RobotStatus", "What a robot says of itself besides numbers.");
  bind_struct<RobotReading>(m, "RobotReading", "What a robot tells in one cycle.");
  bind_enum<CommandSpace>(m, "CommandSpace", "What a command moves: none | joints | tool.");
  bind_enum<CommandMode>(m, "CommandMode", "Meaning of the values of a command: absolute | relative.");
  bind_enum<CommandFrame>(m, "CommandFrame", "Axes of a relative motion of the tool: base | tool.");
  bind_struct<CommandLimits>(m, "CommandLimits", "Greatest motion in one cycle.");
  bind_struct<GripperCommand>(m, "GripperCommand", "Command to the gripper.");
  bind_struct<RobotCommand>(m, "RobotCommand", "What a robot is told in one cycle.");
  m.def("tool_command", &tool_command, py::arg("T_base_tool"), "Command that brings the tool tip to a pose in B [m].");
  m.def("tool_motion", &tool_motion, py::arg("motion"), py::arg("frame"),
        "Command that moves the tool tip from where it is, in axes of base or tool [m].");
  m.def("commanded_tool", &commanded_tool, py::arg("command"), py::arg("T_base_tool"),
        "Where the tool is asked to be after a cycle, within the command's limits, when it is at `T_base_tool` [m].");
  m.def(
      "commanded_joints",
      [](const RobotCommand& command, const Eigen::VectorXd& joints) {
        return Eigen::VectorXd(commanded_joints(command, joint_vector(joints)));
      },
      py::arg("command"), py::arg("joints"),
      "Where the joints are asked to be after a cycle, within the command's limits [rad or m].");
}

void bind_sensing(py::module_& m) {
  bind_struct<SensorModel>(m, "SensorModel", "The arm as it is believed, and what hangs on it.");
  bind_struct<SensorValues>(m, "SensorValues", "What the sensors of one instant tell.");
  m.def("sensed_weight", &sensed_weight, py::arg("mass"), py::arg("com"), py::arg("gravity"), py::arg("R_base_sensor"),
        "Reading of a sensor of the weight of a body alone, in its own axes [N, N m].");
  m.def("sensed_wrench", &sensed_wrench, py::arg("model"), py::arg("T_base_flange"), py::arg("wrench"),
        "Reading of the sensor of a wrench on the tool about the origin of E, in axes of B, weight included [N, N m].");
  m.def(
      "robot_reading",
      [](const SensorModel& model, const SensorValues& values, const std::optional<kr5::Pose>& T_base_flange) {
        model.validate();
        return T_base_flange ? robot_reading(model, values, *T_base_flange) : robot_reading(model, values);
      },
      py::arg("model"), py::arg("values"), py::arg("T_base_flange") = std::nullopt,
      "Reading of an instant; `T_base_flange` for a robot that tells the pose of its flange itself [m].");
}

void bind_loopback(py::module_& m) {
  py::class_<Robot>(m, "Robot",
                    "A robot, cycle by cycle: read it, step a controller, send what the controller gives. Robots are "
                    "LoopbackRobot and kr5.sim.CellRobot.")
      .def("read", &Robot::read, py::call_guard<py::gil_scoped_release>(), "Reading of this cycle.")
      .def("send", &Robot::send, py::arg("command"), py::call_guard<py::gil_scoped_release>(),
           "Command of this cycle, which ends it.")
      .def_property_readonly("cycle", &Robot::cycle, "Time between two readings [s].");
  bind_struct<LoopbackOptions>(m, "LoopbackOptions", "Options of LoopbackRobot.");
  py::class_<LoopbackRobot, Robot>(
      m, "LoopbackRobot",
      "A robot that does what it is told, after its delay and within its limits, for tests of controllers: read, step, "
      "send, once a cycle. Without joints its tool flies.")
      .def(py::init<const LoopbackOptions&, const SensorModel&>(), py::arg("options") = LoopbackOptions{},
           py::arg("model") = SensorModel{})
      .def(
          "place_joints", [](LoopbackRobot& self, const Eigen::VectorXd& joints) { self.place(joint_vector(joints)); },
          py::arg("joints"), "Stands at joint values, with no command on its way [rad or m].")
      .def(
          "place_tool", [](LoopbackRobot& self, const kr5::Pose& T_base_tool) { self.place(T_base_tool); },
          py::arg("T_base_tool"), "Stands with its tool at a pose, with no command on its way [m].")
      .def("set_environment", &LoopbackRobot::set_environment, py::arg("environment"),
           "Function from T_base_tool to the wrench of the environment on the tool about the origin of E, in axes of B "
           "[N, N m].")
      .def("set_status", &LoopbackRobot::set_status, py::arg("saturated"), py::arg("gripped"),
           "Status of sensor and gripper from now on.")
      .def_property_readonly(
          "T_base_tool", [](const LoopbackRobot& self) { return self.T_base_tool(); },
          "Pose of the tool, without noise [m].")
      .def_property_readonly(
          "joints", [](const LoopbackRobot& self) { return Eigen::VectorXd(self.joints()); },
          "Joint values, without noise [rad or m].")
      .def_property_readonly("gripper", &LoopbackRobot::gripper, py::return_value_policy::copy,
                             "State of the gripper.");
}

}  // namespace

void bind_robot(py::module_& m) {
  m.doc() = "Readings and commands of a robot, cycle by cycle.";
  bind_exchange(m);
  bind_sensing(m);
  bind_loopback(m);
}
