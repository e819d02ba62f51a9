// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/dh_chain.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::kinematics;

void bind_kinematics(py::module_& m) {
  m.doc() = "Chains of joints in Denavit-Hartenberg parameters.";
  kr5::python::bind_enum<JointType>(m, "JointType", "What a joint does.");
  kr5::python::bind_struct<DhJoint>(m, "DhJoint", "One joint and the link behind it.")
      .def("transform", &DhJoint::transform, py::arg("q"),
           "Pose of the link in the one before [joint value in rad or m].");
  py::class_<DhChain>(m, "DhChain", "An open chain from the robot base B to the flange F.")
      .def(py::init([](std::vector<DhJoint> joints, const kr5::Pose& T_B_0) {
             return DhChain{T_B_0, std::move(joints)};
           }),
           py::arg("joints"), py::arg("T_B_0") = kr5::Pose::Identity())
      .def_readwrite("joints", &DhChain::joints, "The joints, from the base.")
      .def_property(
          "T_B_0", [](const DhChain& c) { return c.T_B_0; }, [](DhChain& c, const kr5::Pose& T) { c.T_B_0 = T; },
          "Frame of the first joint in the base.")
      .def("link_poses", &DhChain::link_poses, py::arg("q"), "Poses of link frames 1..n in B for q [rad or m].")
      .def("flange", &DhChain::flange, py::arg("q"), "T_B_F for q [rad or m].");
}
