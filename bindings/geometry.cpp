// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/functional.h>

#include <kr5/geometry/marker_family.hpp>
#include <kr5/geometry/mount.hpp>
#include <kr5/geometry/pinhole.hpp>
#include <kr5/geometry/placed.hpp>
#include <kr5/geometry/point_alignment.hpp>
#include <kr5/geometry/projection_matrix.hpp>
#include <kr5/geometry/single_image_calibration.hpp>
#include <kr5/geometry/target.hpp>
#include <kr5/geometry/uncertain_pose.hpp>
#include <kr5/geometry/view.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5;

static void bind_poses(py::module_& m) {
  m.def("skew", &skew, py::arg("v"), "Cross-product matrix: skew(a) @ b = a x b.");
  m.def("exp_rotation", &exp_rotation, py::arg("w"), "Rotation matrix of the rotation vector w [rad].");
  m.def("log_rotation", &log_rotation, py::arg("R"), "Rotation vector of a rotation matrix [rad], angle in [0, pi].");
  m.def("to_pose", &to_pose, py::arg("d"), "4x4 pose of [x y z, rotation vector] [m, rad], taken separately.");
  m.def("to_vector", &to_vector, py::arg("T"), "Inverse of to_pose.");
  m.def("pose_difference", &pose_difference, py::arg("T_a"), py::arg("T_b"),
        "Right perturbation that takes T_a to T_b: T_b = T_a @ to_pose(d) [m, rad].");
  m.def("adjoint", &adjoint, py::arg("T"), "Moves a right perturbation across a pose: T d = (adjoint(T) d) T.");
  m.def("from_xyzrpy", &from_xyzrpy, py::arg("v"), "4x4 pose of x y z roll pitch yaw [m, rad], R = Rz Ry Rx.");
  m.def("to_xyzrpy", &to_xyzrpy, py::arg("T"), "Inverse of from_xyzrpy.");
  m.def("nearest_rotation", &nearest_rotation, py::arg("M"), "Proper rotation nearest to M.");
  m.def("is_rotation", &is_rotation, py::arg("R"), py::arg("tolerance") = 1e-6,
        "True for an orthonormal matrix with determinant +1.");
  m.def(
      "mean_pose", [](const std::vector<Pose>& poses) { return mean_pose(poses); }, py::arg("poses"),
      "Mean of the translations with the chordal mean of the rotations.");
}

static void bind_point_alignment(py::module_& m) {
  python::bind_struct<PointAlignmentOptions>(m, "PointAlignmentOptions", "Options of align_points.");
  python::bind_struct<PointAlignment>(m, "PointAlignment", "Where points of one frame lie in another.");
  m.def("align_points", &align_points, py::arg("points"), py::arg("to"), py::arg("options") = PointAlignmentOptions(),
        "Rotation, shift and, if asked for, scale that carry points (3 x n or n x 3) to others.\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    No points, sets of different sizes, or NaN.");
}

/// Pixels of many points, 3 x n, or their rays.
static Eigen::Matrix2Xd project(const Pinhole& camera, const Eigen::Matrix3Xd& points) {
  Eigen::Matrix2Xd pixels(2, points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) pixels.col(i) = camera.project(points.col(i));
  return pixels;
}

static Eigen::Matrix3Xd rays(const Pinhole& camera, const Eigen::Matrix2Xd& pixels) {
  Eigen::Matrix3Xd out(3, pixels.cols());
  for (Eigen::Index i = 0; i < pixels.cols(); ++i)
    out.col(i) = camera.ray(pixels.col(i)).value_or(Eigen::Vector3d::Constant(std::nan("")));
  return out;
}

static void bind_two_plane(py::module_& m) {
  python::bind_struct<SingleImageOptions>(m, "SingleImageOptions", "Options of calibrate_single_image.");
  python::bind_struct<SingleImageResult>(m, "SingleImageResult", "Pose of the camera from one image.");
  m.def(
      "calibrate_single_image",
      [](const std::vector<View>& views, const Pinhole& camera, const SingleImageOptions& options) {
        return calibrate_single_image(views, camera, options);
      },
      py::arg("views"), py::arg("camera"), py::arg("options") = SingleImageOptions(),
      py::call_guard<py::gil_scoped_release>(),
      "Pose of the camera from views of a grid on two planes, whose points are given in the flange frame.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    No view, fewer than six points, unequal sizes, or NaN.");
}

static void bind_targets(py::module_& m) {
  m.def("marker_families", &marker_families, "Every marker family by name.");
  m.def("marker_family", &marker_family, py::arg("name"),
        "The name of a family by any that it has elsewhere: tag36h11, tagStandard41h12, DICT_APRILTAG_36h11, "
        "DICT_4X4_50.");
  m.def("marker_count", &marker_count, py::arg("family"), "Number of markers of a family.");
  python::bind_enum<TargetKind>(m, "TargetKind", "Kind of a target.");
  python::bind_struct<MapMarker>(m, "MapMarker", "Marker of a map.");
  python::bind_struct<Target>(m, "Target", "Target of a camera; X along the columns, Y down, Z into the board.");
  m.def("parse_target", &parse_target, py::arg("text"), "Target from its short form, such as chessboard:6x9:0.0236.");
  m.def(
      "target_points",
      [](const Target& target) {
        TargetPoints all = target_points(target);
        return std::make_pair(std::move(all.points), std::move(all.ids));
      },
      py::arg("target"), "Points of a target (3 x n) [m] and their ids.");
  m.def("target_markers", &target_markers, py::arg("target"), "Markers of a target, with their poses in its frame.");
}

static void bind_placed(py::module_& m) {
  python::bind_struct<PlacedTarget>(m, "PlacedTarget", "Target in front of a camera.");
  python::bind_enum<SolidKind>(m, "SolidKind", "Form of a solid.");
  python::bind_struct<Solid>(m, "Solid", "Solid of simple shape that a camera or a scanner can see.");
  python::bind_struct<PlacedSolid>(m, "PlacedSolid", "Solid in front of a camera.");
}

static void bind_uncertain_poses(py::module_& m) {
  python::bind_struct<UncertainPose>(m, "UncertainPose", "Pose with the covariance of its error.")
      .def("__matmul__", [](const UncertainPose& a, const UncertainPose& b) { return a * b; })
      .def(
          "inverse", [](const UncertainPose& self) { return inverse(self); }, "T_b_a from T_a_b.");
  python::bind_struct<UncertainVector>(m, "UncertainVector", "Quantity with the covariance of its error.");
  m.def("transform_point", &transform_point, py::arg("T_a_b"), py::arg("p_b"), py::arg("covariance"),
        py::arg("rotation_errors") = true,
        "Point p_a = T_a_b p_b with its covariance [m^2]; without `rotation_errors` as eq. 3.49 has it.");
  m.def("propagate", &propagate, py::arg("f"), py::arg("mean"), py::arg("covariance"),
        "f of a normal variable, to first order.");
  m.def("propagate_unscented", &propagate_unscented, py::arg("f"), py::arg("mean"), py::arg("covariance"),
        "f of a normal variable, by the unscented transform.");
  m.def(
      "fuse", [](const std::vector<UncertainVector>& measurements) { return fuse(measurements); },
      py::arg("measurements"), "Most probable value of independent measurements of one quantity.");
  m.def(
      "propagate_chain", [](const std::vector<UncertainPose>& chain) { return propagate_chain(chain); },
      py::arg("chain"), "Product of a chain of uncertain poses, to first order.");
  m.def(
      "propagate_chain_unscented",
      [](const std::vector<UncertainPose>& chain) { return propagate_chain_unscented(chain); }, py::arg("chain"),
      "Product of a chain of uncertain poses, by the unscented transform.");
  m.def(
      "chain_contributions", [](const std::vector<UncertainPose>& chain) { return chain_contributions(chain); },
      py::arg("chain"), "Covariance of the product of a chain by the error of each pose alone, to first order.");
  m.def("deviation_change", &deviation_change, py::arg("first"), py::arg("second"),
        "Largest change of a standard deviation from the first to the second covariance, over that of the first [-].");
  m.def("covariance_defect", &covariance_defect, py::arg("matrix"), py::arg("tolerance") = 1e-9,
        "Why a matrix is no covariance, with the offending eigenvalue; empty when it is one.");
  m.def("is_covariance", &is_covariance, py::arg("matrix"),
        "Whether a matrix is symmetric and without a negative eigenvalue.");
}

static void bind_projection_matrix(py::module_& m) {
  python::bind_struct<Plane>(m, "Plane", "Plane: normal . p = distance.");
  m.def("projection_matrix", &projection_matrix, py::arg("camera"), py::arg("T_camera_grid"),
        "Projection matrix (3 x 4) of a camera without its lens distortion.");
  m.def("estimate_projection_matrix", &estimate_projection_matrix, py::arg("points"), py::arg("pixels"),
        "Projection matrix (3 x 4) from points (3 x n or n x 3) and pixels (2 x n or n x 2) by linear least squares.");
  m.def("back_project", &back_project, py::arg("M"), py::arg("pixel"), py::arg("plane"),
        "Point of a plane that is seen at a pixel [m].");
  python::bind_struct<BackProjectionOptions>(m, "BackProjectionOptions", "Options of back_projection_uncertainty.");
  python::bind_struct<BackProjectedCorner>(m, "BackProjectedCorner", "Corner projected back.");
  python::bind_struct<BackProjectionResult>(m, "BackProjectionResult", "Uncertainty of corners projected back.");
  m.def("back_projection_uncertainty", &back_projection_uncertainty, py::arg("points"), py::arg("pixels"),
        py::arg("plane"), py::arg("options") = BackProjectionOptions(), py::call_guard<py::gil_scoped_release>(),
        "Uncertainty of points on a plane that are projected back by a matrix estimated from noisy pixels.");
}

void bind_geometry(py::module_& m) {
  bind_poses(m);
  bind_point_alignment(m);
  bind_uncertain_poses(m);
  python::bind_enum<Mount>(m, "Mount", "Part of the cell that carries the camera.");
  python::bind_enum<LensModel>(m, "LensModel", "Lens model: the coefficients of a Pinhole that are used.");
  python::bind_struct<Pinhole>(m, "Pinhole", "Pinhole camera with the rational lens model; z out of the lens, x right.")
      .def("project", &project, py::arg("points"), "Pixels (2 x n) of points in the camera frame (3 x n or n x 3) [m].")
      .def("rays", &rays, py::arg("pixels"),
           "Directions (3 x n, z = 1) of pixels (2 x n or n x 2); NaN where there is none.");
  bind_projection_matrix(m);
  python::bind_struct<View>(m, "View", "View: points of a target in one image.");
  bind_two_plane(m);
  bind_targets(m);
  bind_placed(m);
}
