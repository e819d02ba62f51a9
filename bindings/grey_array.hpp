// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>

#include <pybind11/numpy.h>

#include <kr5/geometry/image_view.hpp>

namespace kr5::python {

/// Grey images are arrays of bytes, rows by columns.
using GreyArray = pybind11::array_t<std::uint8_t, pybind11::array::c_style>;

inline ImageView view_of(const GreyArray& image) {
  if (image.ndim() != 2 || image.size() == 0)
    throw pybind11::value_error("image: expected a grey image, an array of uint8 of shape (height, width)");
  return {image.data(), static_cast<int>(image.shape(1)), static_cast<int>(image.shape(0)), image.shape(1)};
}

}  // namespace kr5::python
