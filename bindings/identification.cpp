// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/base_parameters.hpp>
#include <kr5/identification/current_model.hpp>
#include <kr5/identification/drives.hpp>
#include <kr5/identification/dynamics.hpp>
#include <kr5/identification/joint_motion.hpp>
#include <kr5/identification/log_conditioning.hpp>
#include <kr5/identification/payload.hpp>
#include <kr5/identification/zero_phase.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::identification;
using kr5::python::bind_enum;
using kr5::python::bind_struct;

namespace {

void bind_logs(py::module_& m) {
  bind_enum<LogFault>(m, "LogFault", "What may be wrong with a log.");
  bind_enum<LogSeverity>(m, "LogSeverity", "What a finding means for an estimate.");
  bind_enum<SpeedSource>(m, "SpeedSource", "Where speeds come from.");
  bind_enum<ClockModel>(m, "ClockModel", "What time stamps of uneven steps mean.");
  bind_struct<JointLog>(m, "JointLog", "What a controller logged of a motion, as it came.");
  bind_struct<LogFinding>(m, "LogFinding", "One thing that is wrong with a log.");
  bind_struct<ConditioningOptions>(m, "ConditioningOptions", "Options of condition_log and check_log.");
  bind_struct<ConditionedMotion>(m, "ConditionedMotion", "A motion to estimate from, and the faults of its log.")
      .def_property_readonly("usable", &ConditionedMotion::usable, "Whether there is a motion to estimate from.");
  m.def("check_log", &check_log, py::arg("log"), py::arg("options") = ConditioningOptions{},
        "The faults of a log, errors first; empty for a sound one.");
  m.def("condition_log", &condition_log, py::arg("log"), py::arg("options") = ConditioningOptions{},
        "The motion of a log: clock repaired, smoothed without delay, speeds and accelerations by central differences, "
        "decimated (Hayat et al. 2022, section 4.4.3.2). Empty when the log has an error.");
  m.def("motion_bandwidth", &motion_bandwidth, py::arg("q"), py::arg("step"),
        "Frequency below which 99 % of the power of the speeds lies [Hz]; q: samples x joints at even steps [s].");
  m.def("zero_phase_low_pass", &zero_phase_low_pass, py::arg("values"), py::arg("step"), py::arg("cutoff"),
        py::arg("order") = 4,
        "Zero-phase Butterworth low-pass of each column, run forward and backward; step [s], cutoff [Hz].");
  m.def("central_differences", &central_differences, py::arg("values"), py::arg("step"),
        "First derivative of each column by central differences; step [s].");
  m.def("second_differences", &second_differences, py::arg("values"), py::arg("step"),
        "Second derivative of each column by central differences; step [s].");
}

void bind_drives(py::module_& m) {
  bind_struct<DriveReadings>(m, "DriveReadings", "Readings of encoders and joints, a row a posture.");
  bind_struct<DriveOptions>(m, "DriveOptions", "Options of identify_drives.");
  bind_struct<DriveOutlier>(m, "DriveOutlier", "A reading that contradicts the others.");
  bind_struct<DriveCoupling>(m, "DriveCoupling", "An element of the structure matrix beside its diagonal.");
  bind_struct<DriveResult>(m, "DriveResult", "Structure matrix of the drives with its couplings.");
  m.def("identify_drives", &identify_drives, py::arg("readings"), py::arg("options") = DriveOptions{},
        "Structure matrix, counts per turn and couplings from encoder counts and joint angles (Hayat et al. 2022, eq. "
        "4.44 to 4.54).");
  bind_struct<CurrentModelOptions>(m, "CurrentModelOptions", "Options of identify_current_model.");
  bind_struct<CurrentModel>(m, "CurrentModel", "Current of a joint over its torque, with hysteresis (eq. 5.8).")
      .def("current", &CurrentModel::current, py::arg("torque"), py::arg("speed"),
           "Current that a torque asks for at a speed [A].")
      .def("torque", &CurrentModel::torque, py::arg("current"), py::arg("speed"),
           "Torque that a current gives at a speed [N m or N].");
  m.def("identify_current_model", &identify_current_model, py::arg("current"), py::arg("torque"), py::arg("speed"),
        py::arg("options") = CurrentModelOptions{},
        "Torque constant, offset and hysteresis of a joint by least squares (Hayat et al. 2022, eq. 5.8).");
}

}  // namespace

static void bind_base_parameters(py::module_& m) {
  using kr5::python::bind_struct;
  bind_struct<JointTerms>(m, "JointTerms", "Terms of a joint beside the loads of the links.");
  bind_struct<DynamicsModel>(m, "DynamicsModel", "Arm whose dynamic parameters are to be found.");
  py::class_<DynamicsRegressor>(
      m, "DynamicsRegressor",
      "Regressor Y of a model, tau = Y chi: 13 parameters a joint in the order of Hayat et al. 2022, eq. 4.36\n"
      "(Ixx Ixy Ixz Iyy Iyz Izz, m cx, m cy, m cz, m, Coulomb, viscous, rotor inertia), then further terms [SI].")
      .def(py::init<DynamicsModel>(), py::arg("model"))
      .def_property_readonly("joints", &DynamicsRegressor::joints, "Number of joints n.")
      .def_property_readonly("names", &DynamicsRegressor::names, "Names of the parameters.")
      .def("evaluate", &DynamicsRegressor::evaluate, py::arg("motion"), py::arg("load") = Eigen::MatrixXd(),
           py::call_guard<py::gil_scoped_release>(), "Y stacked: row k n + i of sample k and joint i.")
      .def("torques", &DynamicsRegressor::torques, py::arg("motion"), py::arg("parameters"),
           py::call_guard<py::gil_scoped_release>(), "Torques of a motion, samples x joints [N m or N].")
      .def("link_torques", &DynamicsRegressor::link_torques, py::arg("motion"), py::arg("parameters"),
           py::call_guard<py::gil_scoped_release>(), "Torques of the links alone, samples x joints [N m or N].");
  bind_struct<BaseParameterOptions>(m, "BaseParameterOptions", "Options of base_parameters.");
  bind_struct<BaseParameters>(m, "BaseParameters", "Combinations of parameters that motions can tell.")
      .def_property_readonly("size", &BaseParameters::size, "Number of base parameters.")
      .def("base_values", &BaseParameters::values, py::arg("chi"), "Base parameters of standard ones.")
      .def("standard", &BaseParameters::standard, py::arg("base"),
           "Standard parameters that have these base parameters: the independent ones, and zeros.")
      .def("identifiable", &BaseParameters::identifiable, py::arg("combination"), py::arg("tolerance") = 1e-6,
           "Whether motions can tell a combination of standard parameters.");
  bind_struct<Observability>(m, "Observability", "What one motion tells of the base parameters.");
  m.def("base_parameters", &base_parameters, py::arg("model"), py::arg("options") = BaseParameterOptions{},
        py::call_guard<py::gil_scoped_release>(), "Base parameters of a model, from the regressor of random states.");
  m.def("observability", &observability, py::arg("model"), py::arg("base"), py::arg("motion"),
        py::arg("tolerance") = 1e-6, py::call_guard<py::gil_scoped_release>(), "What a motion tells.");
}

static void bind_dynamics(py::module_& m) {
  using kr5::python::bind_enum;
  using kr5::python::bind_struct;
  bind_enum<Estimator>(m, "Estimator", "Estimator of dynamic parameters.");
  bind_struct<DynamicsOptions>(m, "DynamicsOptions", "Options of identify_dynamics.");
  bind_struct<TorqueError>(m, "TorqueError", "Errors of predicted torques.");
  bind_struct<DynamicsResult>(m, "DynamicsResult", "Identified dynamics.")
      .def("parameter", &DynamicsResult::parameter, py::arg("name"),
           "Value and standard deviation of a base parameter by its expression, such as fc2; None without.");
  m.def(
      "identify_dynamics",
      [](const JointMotion& motion, const DynamicsModel& model, const DynamicsOptions& options,
         const std::optional<JointMotion>& instruments) {
        const py::gil_scoped_release free;
        return identify_dynamics(motion, model, options, instruments ? &*instruments : nullptr);
      },
      py::arg("motion"), py::arg("model"), py::arg("options") = DynamicsOptions{},
      py::arg("instruments") = std::nullopt,
      "The dynamics of an arm from its motion and torques. `instruments`: the same motion with other noise or none.");
  m.def("predict_torques", &predict_torques, py::arg("result"), py::arg("motion"),
        py::call_guard<py::gil_scoped_release>(), "Torques of a motion by an estimate, samples x joints [N m or N].");
  bind_struct<PayloadOptions>(m, "PayloadOptions", "Options of identify_payload.");
  bind_struct<PayloadResult>(m, "PayloadResult", "Identified payload.");
  m.def("identify_payload",
        py::overload_cast<const JointMotion&, const DynamicsModel&, const Eigen::VectorXd&, const PayloadOptions&>(
            &identify_payload),
        py::arg("loaded"), py::arg("model"), py::arg("parameters"), py::arg("options") = PayloadOptions{},
        py::call_guard<py::gil_scoped_release>(), "Payload of an arm whose parameters are known.");
  m.def("identify_payload",
        py::overload_cast<const JointMotion&, const DynamicsResult&, const PayloadOptions&>(&identify_payload),
        py::arg("loaded"), py::arg("arm"), py::arg("options") = PayloadOptions{},
        py::call_guard<py::gil_scoped_release>(), "Payload of an arm that was identified without it.");
}

void bind_identification(py::module_& m) {
  m.doc() = "Identification of an arm's dynamics, drives and sensors from its logs.";
  bind_struct<JointMotion>(m, "JointMotion", "Measured motion of an arm with its joint torques.")
      .def("validate", &JointMotion::validate, "Raises InvalidArgument naming field and row.");
  bind_logs(m);
  bind_drives(m);
  bind_base_parameters(m);
  bind_dynamics(m);
}
