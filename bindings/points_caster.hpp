// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

/// @file
/// Sets of points. In C++, and in what kr5 returns, a point is a column (3 x n); people hold them as rows (n x 3), and
/// OpenCV as n x 1 x 3. All of these are accepted. A square array whose rows are not its columns is refused.

namespace kr5::python {

/// While one lives, arrays of points have a point in each column: those that to_dict wrote.
class PointsAreColumns {
 public:
  PointsAreColumns() { ++depth(); }
  ~PointsAreColumns() { --depth(); }
  PointsAreColumns(const PointsAreColumns&) = delete;
  PointsAreColumns& operator=(const PointsAreColumns&) = delete;

  static bool now() { return depth() > 0; }

 private:
  static int& depth() {
    static thread_local int value = 0;
    return value;
  }
};

using PointArray = pybind11::array_t<double, pybind11::array::c_style | pybind11::array::forcecast>;

/// Points from an array whose shape says where they are. False for any other shape.
/// @throws ValueError for a square array that may be read both ways.
template <int Size>
bool points_from(const PointArray& values, Eigen::Matrix<double, Size, Eigen::Dynamic>& out) {
  using Columns = Eigen::Matrix<double, Size, Eigen::Dynamic>;
  using RowMajor = Eigen::Matrix<double, Size, Eigen::Dynamic, Eigen::RowMajor>;
  const auto ndim = values.ndim();
  const auto shape = [&](int axis) { return values.shape(axis); };
  // Rows of a C array lie in memory as columns of ours do.
  const auto point_by_point = [&] {
    out = Eigen::Map<const Columns>(values.data(), Size, values.size() / Size);
    return true;
  };
  if (ndim == 1 && (shape(0) == Size || shape(0) == 0)) return point_by_point();  // one point, or none
  if (ndim == 3 && shape(1) == 1 && shape(2) == Size) return point_by_point();
  if (ndim != 2 || (shape(0) != Size && shape(1) != Size)) return false;
  if (shape(0) != Size) return point_by_point();
  out = Eigen::Map<const RowMajor>(values.data(), Size, shape(1));
  if (shape(1) != Size || PointsAreColumns::now() || out == out.transpose()) return true;
  const std::string n = std::to_string(Size);
  throw pybind11::value_error("an array of shape (" + n + ", " + n + ") may have its points in its rows or in its " +
                              "columns; say which: kr5.points_from_rows(array) or kr5.points_from_columns(array)");
}

}  // namespace kr5::python

namespace pybind11::detail {

template <int Size>
struct points_caster {
  using Points = Eigen::Matrix<double, Size, Eigen::Dynamic>;
  PYBIND11_TYPE_CASTER(Points, EigenProps<Points>::descriptor);

  bool load(handle source, bool convert) {
    if (!convert && !isinstance<array>(source)) return false;
    const auto values = kr5::python::PointArray::ensure(source);
    if (!values) {
      PyErr_Clear();
      return false;
    }
    return kr5::python::points_from<Size>(values, value);
  }

  static handle cast(const Points& source, return_value_policy, handle) {
    return eigen_array_cast<EigenProps<Points>>(source);
  }
};

template <>
struct type_caster<Eigen::Matrix3Xd> : points_caster<3> {};
template <>
struct type_caster<Eigen::Matrix2Xd> : points_caster<2> {};

}  // namespace pybind11::detail
