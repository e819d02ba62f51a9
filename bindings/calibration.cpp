// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/evaluate.hpp>
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

static void bind_evaluation(py::module_& m) {
  kr5::python::bind_struct<HeldOutView>(m, "HeldOutView", "One view, predicted from a calibration made without it.");
  kr5::python::bind_struct<HandEyeEvaluation>(m, "HandEyeEvaluation", "How good a method is on views left out.");
  m.def(
      "evaluate_hand_eye",
      [](const std::vector<HandEyeView>& views, const kr5::Pinhole& camera, const HandEyeOptions& options, int folds) {
        return evaluate_hand_eye(views, camera, options, folds);
      },
      py::arg("views"), py::arg("camera"), py::arg("options") = HandEyeOptions(), py::arg("folds") = 0,
      py::call_guard<py::gil_scoped_release>(),
      "Error of calibrate_hand_eye on views left out; folds 0: every view alone.");
  m.def(
      "evaluate_hand_eye_method",
      [](const std::vector<HandEyeView>& views, const kr5::Pinhole& camera, const py::function& solver, Mount mount,
         int folds) {
        const HandEyeSolver call = [&](std::span<const HandEyeView> rest, std::span<const kr5::Pose> targets) {
          std::optional<HandEyePoses> out;
          const py::object found = solver(std::vector<HandEyeView>(rest.begin(), rest.end()),
                                          std::vector<kr5::Pose>(targets.begin(), targets.end()));
          if (!found.is_none()) out = HandEyePoses{found.cast<kr5::Pose>(), std::nullopt};
          return out;
        };
        return evaluate_hand_eye(views, camera, call, {.mount = mount, .folds = folds});
      },
      py::arg("views"), py::arg("camera"), py::arg("solver"), py::arg("mount") = Mount::EyeInHand, py::arg("folds") = 0,
      "Error of any method on views left out. `solver(views, T_camera_target)` gets the views and the poses of the\n"
      "target seen in them and returns T_mount_camera (4x4), or None. T_fixed_target is the mean over the views.");
}

void bind_calibration(py::module_& m) {
  m.doc() = "Hand-eye, tool and clock calibration, and their evaluation.";
  bind_hand_eye(m);
  bind_evaluation(m);
}
