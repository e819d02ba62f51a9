// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/core/error.hpp>
#include <kr5/robot/joint_vector.hpp>

#include "conversion.hpp"

namespace kr5::python {

/// One number a joint; more than a robot may have are refused.
template <>
struct Convert<robot::JointVector> {
  static std::string text() { return "numpy.ndarray"; }
  static std::string argument() { return "numpy.typing.ArrayLike"; }
  static std::string shape() { return "(n,)"; }
  static py::object to_plain(const robot::JointVector& value) {
    return py::cast(Eigen::VectorXd(value)).attr("tolist")();
  }
  static robot::JointVector from_python(const py::handle& value, const std::string& where) {
    const auto values = Convert<Eigen::VectorXd>::from_python(value, where);
    try {
      return robot::joint_vector(values);
    } catch (const InvalidArgument& e) {
      throw InvalidArgument(where + ": " + e.what());
    }
  }
};

}  // namespace kr5::python
