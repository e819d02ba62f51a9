// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/base_parameters.hpp>
#include <kr5/identification/dynamics.hpp>
#include <kr5/identification/joint_motion.hpp>
#include <kr5/identification/payload.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::identification;

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
  kr5::python::bind_struct<JointMotion>(m, "JointMotion", "Measured motion of an arm with its joint torques.")
      .def("validate", &JointMotion::validate, "Raises InvalidArgument naming field and row.");
  bind_base_parameters(m);
  bind_dynamics(m);
}
