// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/joint_motion.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::identification;

void bind_identification(py::module_& m) {
  m.doc() = "Identification of an arm's dynamics, drives and sensors from its logs.";
  kr5::python::bind_struct<JointMotion>(m, "JointMotion", "Measured motion of an arm with its joint torques.")
      .def("validate", &JointMotion::validate, "Raises InvalidArgument naming field and row.");
}
