// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <kr5/geometry/pose.hpp>

#include "points_caster.hpp"

namespace pybind11::detail {

/// A pose is a 4x4 array in Python. What is not rigid is refused with ValueError.
template <>
struct type_caster<kr5::Pose> {
  PYBIND11_TYPE_CASTER(kr5::Pose, const_name("numpy.ndarray"));

  bool load(handle source, bool convert) {
    if (!convert && !isinstance<array>(source)) return false;
    const auto values = array_t<double, array::c_style | array::forcecast>::ensure(source);
    if (!values) {
      PyErr_Clear();
      return false;
    }
    if (values.ndim() != 2 || values.shape(0) != 4 || values.shape(1) != 4)
      throw value_error("a pose is a 4x4 array, found one of shape " + str(values.attr("shape")).cast<std::string>());
    using RowMajor = Eigen::Matrix<double, 4, 4, Eigen::RowMajor>;
    const Eigen::Matrix4d m = Eigen::Map<const RowMajor>(values.data());
    if (m.row(3) != Eigen::RowVector4d(0, 0, 0, 1) || !kr5::is_rotation(m.topLeftCorner<3, 3>()) ||
        !m.col(3).allFinite())
      throw value_error("a pose is a 4x4 array with a proper rotation and the last row 0 0 0 1; found " +
                        repr(values.attr("tolist")()).cast<std::string>());
    value.matrix() = m;
    return true;
  }

  static handle cast(const kr5::Pose& source, return_value_policy, handle) {
    return eigen_array_cast<EigenProps<Eigen::Matrix4d>>(Eigen::Matrix4d(source.matrix()));
  }
};

}  // namespace pybind11::detail
