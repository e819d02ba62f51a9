// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/physics/effective_arm.hpp>
#include <kr5/physics/friction.hpp>
#include <kr5/physics/motors.hpp>
#include <kr5/physics/second_order.hpp>
#include <kr5/physics/tool.hpp>

#include <kr5/core/error.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::physics;
using kr5::cell::Cell;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

static Eigen::VectorXd friction(const Cell& cell, int joint, const Eigen::VectorXd& speed,
                                const Eigen::VectorXd& torque, const Eigen::VectorXd& t) {
  kr5::require(joint >= 0 && joint < cell.robot.joints(),
               "joint: expected 0 to " + std::to_string(cell.robot.joints() - 1) + ", found " + std::to_string(joint));
  kr5::require(speed.size() == torque.size() && speed.size() == t.size(),
               "speed, torque, t: expected equal numbers of values");
  return joint_friction<Eigen::ArrayXd>(JointFriction(cell, joint), speed, torque, t);
}

static Rows currents(const Cell& cell, const Rows& acceleration, const Rows& torque) {
  const int n = cell.robot.joints();
  kr5::require(acceleration.cols() == n && torque.cols() == n && acceleration.rows() == torque.rows(),
               "acceleration, torque: expected a column a joint, and as many rows of each");
  return Motors(cell).currents(Eigen::MatrixXd(acceleration), Eigen::MatrixXd(torque));
}

void bind_physics(py::module_& m) {
  m.doc() = "Physical laws of a cell with its effects, shared by every simulator.";
  m.def(
      "effective_chain", [](const Cell& cell, double t) { return EffectiveArm(cell).chain(t); }, py::arg("cell"),
      py::arg("t") = 0.0,
      "Arm with the effects base_tilt, link_length, link_twist and thermal_growth, at time t [s] of the session.");
  m.def("joint_friction", &friction, py::arg("cell"), py::arg("joint"), py::arg("speed"), py::arg("torque"),
        py::arg("t"),
        "Friction of a joint (from 0) at motor-side speeds [rad/s or m/s], under the torques through its gear [N m or "
        "N], at times t [s]: an array of N values each. Raises InvalidArgument for another number of values.");
  m.def("motor_currents", &currents, py::arg("cell"), py::arg("acceleration"), py::arg("torque"),
        "Motor currents [A], N x n, of motor-side accelerations [rad/s^2 or m/s^2] and joint torques [N m or N], "
        "friction included. Raises InvalidArgument for a cell without drives and for other sizes.");
  m.def("tool_weight", &tool_weight, py::arg("cell"), py::arg("rows") = 1,
        "Wrench of tool and payload on the force sensor when the tool points down and rests, rows x 6 [N, N m].");
  m.def("servo_transition", &transition, py::arg("servo"), py::arg("h"),
        "Decay of position and speed of a servo within h [s] under a command of 0, 2 x 2.");
}
