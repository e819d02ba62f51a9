// SPDX-License-Identifier: BSD-3-Clause
#include <optional>

#include <kr5/physics/effective_arm.hpp>
#include <kr5/physics/fold_effects.hpp>
#include <kr5/physics/friction.hpp>
#include <kr5/physics/joint_drive.hpp>
#include <kr5/physics/motors.hpp>
#include <kr5/physics/second_order.hpp>
#include <kr5/physics/tool.hpp>

#include <kr5/core/error.hpp>

#include "effect_conversion.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::physics;
using kr5::cell::Cell;
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

static Eigen::VectorXd friction(const Cell& cell, int joint, const Eigen::VectorXd& speed,
                                const Eigen::VectorXd& torque, const Eigen::VectorXd& t,
                                const std::optional<Eigen::VectorXd>& position) {
  kr5::require(joint >= 0 && joint < cell.robot.joints(),
               "joint: expected 0 to " + std::to_string(cell.robot.joints() - 1) + ", found " + std::to_string(joint));
  kr5::require(speed.size() == torque.size() && speed.size() == t.size(),
               "speed, torque, t: expected equal numbers of values");
  const JointFriction law(cell, joint);
  kr5::require(position ? position->size() == speed.size() : law.angle_amplitude == 0.0,
               "position: expected a value for each speed");
  return joint_friction<Eigen::ArrayXd>(law, {position.value_or(Eigen::VectorXd()), speed, torque, t});
}

static Rows currents(const Cell& cell, const Rows& acceleration, const Rows& torque) {
  const int n = cell.robot.joints();
  kr5::require(acceleration.cols() == n && torque.cols() == n && acceleration.rows() == torque.rows(),
               "acceleration, torque: expected a column a joint, and as many rows of each");
  return Motors(cell).currents(Eigen::MatrixXd(acceleration), Eigen::MatrixXd(torque));
}

static Rows torques(const Cell& cell, const Rows& currents) {
  return reported_torques(cell, Eigen::MatrixXd(currents));
}

static Eigen::MatrixX2d cable_springs(const Cell& cell) {
  Eigen::MatrixX2d out(cell.robot.joints(), 2);
  Eigen::Index i = 0;
  for (const JointDrive& drive : joint_drives(cell)) out.row(i++) << drive.cable.stiffness, drive.cable.rest;
  return out;
}

template <class T>
static py::class_<T> bind_effect(py::module_& m, const char* name, const char* doc) {
  return py::class_<T>(m, name, doc)
      .def_property_readonly(
          "effect", [](const T& self) { return self.effect.id; }, "Id of the effect.")
      .def_property_readonly(
          "target", [](const T& self) { return self.effect.target; }, "Target of the effect.")
      .def_property_readonly(
          "parameters", [](const T& self) { return kr5::python::values_of(self.effect); },
          "Values by the name of the parameter, in its unit.");
}

static void bind_fold_effects(py::module_& m) {
  bind_effect<FoldedEffect>(m, "FoldedEffect", "Effect that is in the nominal parameters of a cell now.")
      .def_readonly("field", &FoldedEffect::field, "Field of the cell that holds it; empty for a registered effect.");
  bind_effect<RemainingEffect>(m, "RemainingEffect", "Effect for which a cell has no nominal parameter.")
      .def_readonly("reason", &RemainingEffect::reason, "Reason, in words.");
  py::class_<FoldedCell>(m, "FoldedCell", "Cell with the effects in its nominal parameters.")
      .def_property_readonly(
          "cell", [](const FoldedCell& self) { return self.cell; }, "Cell with the remaining effects (a copy).")
      .def_readonly("folded", &FoldedCell::folded, "Effects that were folded.")
      .def_readonly("remaining", &FoldedCell::remaining, "Effects that are effects still.");
  m.def(
      "fold_effects", [](const Cell& cell, bool add_drives) { return fold_effects(cell, {.add_drives = add_drives}); },
      py::arg("cell"), py::kw_only(), py::arg("add_drives") = false,
      "Cell with every effect in its nominal parameters for which they have a place; a simulator predicts the same "
      "before and after, to rounding.\n\nadd_drives: a cell without drives gets some of unit gear (a current is then a "
      "joint torque), in which friction has a place.");
}

void bind_physics(py::module_& m) {
  m.doc() = "Physical laws of a cell with its effects, shared by every simulator.";
  bind_fold_effects(m);
  m.def(
      "cable_springs", &cable_springs, py::arg("cell"),
      "Spring of the dress pack of every joint, n x 2: stiffness [N m/rad or N/m] and joint value without pull [rad or "
      "m].");
  m.def(
      "effective_chain", [](const Cell& cell, double t) { return EffectiveArm(cell).chain(t); }, py::arg("cell"),
      py::arg("t") = 0.0,
      "Arm with the effects base_tilt, link_length, link_twist and thermal_growth, at time t [s] of the session.");
  m.def(
      "joint_friction", &friction, py::arg("cell"), py::arg("joint"), py::arg("speed"), py::arg("torque"), py::arg("t"),
      py::kw_only(), py::arg("position") = py::none(),
      "Friction of a joint (from 0) at motor-side speeds [rad/s or m/s], under the torques through its gear [N m or "
      "N], at times t [s], and at motor-side positions [rad or m], which friction that depends on the angle needs: an "
      "array of N values each. Raises InvalidArgument for another number of values.");
  m.def("motor_currents", &currents, py::arg("cell"), py::arg("acceleration"), py::arg("torque"),
        "Motor currents [A], N x n, of motor-side accelerations [rad/s^2 or m/s^2] and joint torques [N m or N], "
        "friction included. Raises InvalidArgument for a cell without drives and for other sizes.");
  m.def("reported_torques", &torques, py::arg("cell"), py::arg("currents"),
        "Joint torques [N m or N], N x n, that a controller makes of motor currents [A] by the nominal constants: what "
        "it logs as torques or efforts. Raises InvalidArgument for a cell without drives and for another size.");
  m.def("tool_weight", &tool_weight, py::arg("cell"), py::arg("rows") = 1,
        "Wrench of tool and payload on the force sensor when the tool points down and rests, rows x 6 [N, N m].");
  m.def("servo_transition", &transition, py::arg("servo"), py::arg("h"),
        "Decay of position and speed of a servo within h [s] under a command of 0, 2 x 2.");
}
