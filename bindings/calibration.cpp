// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/hand_eye.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::calibration;

static void bind_hand_eye(py::module_& m) {
  kr5::python::bind_enum<Mount>(m, "Mount", "What carries the camera.");
  kr5::python::bind_struct<HandEyeView>(m, "HandEyeView", "One robot stop at which the target was seen.");
  kr5::python::bind_struct<HandEyeOptions>(m, "HandEyeOptions", "Options of calibrate_hand_eye.");
  kr5::python::bind_struct<HandEyeViewReport>(m, "HandEyeViewReport", "How one view agrees with the result.");
  kr5::python::bind_struct<HandEyeResult>(m, "HandEyeResult", "Where the camera sits, and how well that is known.");
  m.def(
      "calibrate_hand_eye",
      [](const std::vector<HandEyeView>& views, const kr5::Pinhole& camera, const HandEyeOptions& options) {
        py::gil_scoped_release release;
        return calibrate_hand_eye(views, camera, options);
      },
      py::arg("views"), py::arg("camera"), py::arg("options") = HandEyeOptions(),
      "Estimates camera and target pose together from pixels and robot poses, both with their noise.\n\n"
      "Parameters\n----------\nviews : list of HandEyeView\ncamera : kr5.Pinhole\noptions : HandEyeOptions\n\n"
      "Returns\n-------\nHandEyeResult\n    Look at `fit.usable()` before the poses.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Fewer than three views, a view with fewer than four points, or NaN.");
}

void bind_calibration(py::module_& m) {
  m.doc() = "Hand-eye, tool and clock calibration, and their evaluation.";
  bind_hand_eye(m);
}
