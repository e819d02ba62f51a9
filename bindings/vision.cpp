// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>

#include <kr5/vision/camera_calibration.hpp>
#include <kr5/vision/family.hpp>
#include <kr5/vision/find_hole.hpp>
#include <kr5/vision/find_target.hpp>
#include <kr5/vision/hand_eye_closed_form.hpp>
#include <kr5/vision/laser_line.hpp>
#include <kr5/vision/marker_map.hpp>
#include <kr5/vision/render.hpp>
#include <kr5/vision/tag_grid.hpp>
#include <kr5/vision/target_pose.hpp>
#include <kr5/vision/visual_servo.hpp>

#include "grey_array.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5;
using namespace kr5::vision;

static void bind_camera_calibration(py::module_& m) {
  python::bind_enum<CameraMethod>(m, "CameraMethod", "Method of a camera calibration.");
  python::bind_struct<CameraOptions>(m, "CameraOptions", "Options of calibrate_camera.");
  python::bind_struct<CameraViewReport>(m, "CameraViewReport", "Agreement of one view with a camera calibration.");
  python::bind_struct<CameraModelScore>(m, "CameraModelScore", "Score of one of the compared camera models.");
  python::bind_struct<CameraCoverage>(m, "CameraCoverage", "Coverage of the image and of the directions by the views.");
  python::bind_struct<CameraFinding>(m, "CameraFinding", "Finding of a camera calibration, with its remedy.");
  python::bind_struct<CameraCalibration>(m, "CameraCalibration", "Result of calibrate_camera.");
  m.def(
      "calibrate_camera",
      [](const std::vector<View>& views, int width, int height, const CameraOptions& options) {
        return calibrate_camera(views, width, height, options);
      },
      py::arg("views"), py::arg("width"), py::arg("height"), py::arg("options") = CameraOptions(),
      py::call_guard<py::gil_scoped_release>(),
      "Calibrates a camera from views of targets by robust bundle adjustment; names contradicting views and "
      "chooses\nthe model by the error on held-out views. Check `fit.usable` and `findings` before using `camera`.");
}

using python::GreyArray;
using python::view_of;

static GreyArray to_array(const Image& image) {
  GreyArray out({image.height, image.width});
  std::copy(image.pixels.begin(), image.pixels.end(), out.mutable_data());
  return out;
}

static void bind_images(py::module_& m) {
  m.def(
      "load_image", [](const std::filesystem::path& file) { return to_array(load_image(file)); }, py::arg("file"),
      "Reads an image as grey levels, uint8 of shape (height, width).");
  m.def(
      "save_image", [](const GreyArray& image, const std::filesystem::path& file) { save_image(view_of(image), file); },
      py::arg("image"), py::arg("file"), "Writes an image in the format of the file extension, such as PNG.");
}

static void bind_render(py::module_& m) {
  python::bind_struct<RenderOptions>(m, "RenderOptions", "Options of render and draw_target.");
  m.def(
      "render",
      [](const std::vector<PlacedTarget>& targets, const Pinhole& camera, const RenderOptions& options,
         const std::vector<PlacedSolid>& solids) {
        Image image;
        {
          py::gil_scoped_release release;
          image = render(targets, solids, camera, options);
        }
        return to_array(image);
      },
      py::arg("targets"), py::arg("camera"), py::arg("options") = RenderOptions(),
      py::arg("solids") = std::vector<PlacedSolid>(),
      "Renders the camera image of targets and solids, uint8 of shape (height, width); edges lie where Pinhole.project "
      "says.");
  m.def("visible_points", &visible_points, py::arg("target"), py::arg("T_camera_target"), py::arg("camera"),
        "True points of a rendered image: those that face the camera and lie inside the image, with their pixels.");
  m.def("printed_area", &printed_area, py::arg("target"), py::arg("options") = RenderOptions(),
        "Lowest and highest x, y of a planar target with its margin, in columns [m].");
  m.def(
      "draw_target",
      [](const Target& target, double pixels_per_metre, const RenderOptions& options) {
        Image image;
        {
          py::gil_scoped_release release;
          image = draw_target(target, pixels_per_metre, options);
        }
        return to_array(image);
      },
      py::arg("target"), py::arg("pixels_per_metre"), py::arg("options") = RenderOptions(),
      "Draws a target to scale for a printer, uint8 of shape (height, width).");
}

static void bind_detect(py::module_& m) {
  python::bind_enum<Refinement>(m, "Refinement", "Method of refinement of the points.");
  python::bind_enum<DetectStatus>(m, "DetectStatus", "Whether a target was found, or why not.");
  python::bind_struct<TagOptions>(m, "TagOptions", "Options of find_tags.");
  python::bind_struct<TagDetection>(m, "TagDetection", "Marker found in an image.");
  python::bind_struct<DetectOptions>(m, "DetectOptions", "Options of find_target.");
  python::bind_struct<Detection>(m, "Detection", "Result of the search for a target.")
      .def_property_readonly("found", &Detection::found);
  m.def(
      "find_tags",
      [](const GreyArray& image, const TagOptions& options) {
        const ImageView view = view_of(image);
        py::gil_scoped_release release;
        return find_tags(view, options);
      },
      py::arg("image"), py::arg("options") = TagOptions(),
      "Every marker of the families in a grey image (uint8, height x width); several with the same id are all "
      "returned.");
  python::bind_struct<TagGridOptions>(m, "TagGridOptions", "Options of guess_tag_grid.");
  python::bind_struct<TagGrid>(m, "TagGrid", "Board of tags numbered row by row from 0, told from images of it.");
  m.def(
      "guess_tag_grid",
      [](const std::vector<std::vector<TagDetection>>& images, const TagGridOptions& options) {
        return guess_tag_grid(images, options);
      },
      py::arg("images"), py::arg("options") = TagGridOptions(),
      "Rows, columns and gap of the board of tags that images show, from the markers found in each of them (lists of\n"
      "TagDetection). Check fit.usable.");
  m.def(
      "find_target",
      [](const GreyArray& image, const Target& target, const DetectOptions& options) {
        const ImageView view = view_of(image);
        py::gil_scoped_release release;
        return find_target(view, target, options);
      },
      py::arg("image"), py::arg("target"), py::arg("options") = DetectOptions(),
      "Searches for one target in a grey image (uint8, height x width). When it is not found, `status` and `message` "
      "give the reason.");
}

static void bind_explanation(py::module_& m) {
  m.def(
      "explain_no_tags",
      [](const GreyArray& image, const TagOptions& options) {
        const ImageView view = view_of(image);
        py::gil_scoped_release release;
        return explain_no_tags(view, options);
      },
      py::arg("image"), py::arg("options"),
      "Why a grey image (uint8, height x width) shows no marker of options.families, as status and message: they are "
      "mirrored or inverted, of another family, or the picture is too dark, overexposed or blurred.");
}

static void bind_laser_line(py::module_& m) {
  python::bind_struct<LaserLineOptions>(m, "LaserLineOptions", "Options of compare_laser_line.");
  python::bind_struct<LaserLineComparison>(m, "LaserLineComparison", "Points of a profile beside a laser line.");
  m.def(
      "compare_laser_line",
      [](const GreyArray& image, const Pinhole& camera, const UncertainPose& T_camera_scanner,
         const Eigen::Matrix3Xd& points, const LaserLineOptions& options) {
        return compare_laser_line(view_of(image), camera, T_camera_scanner, points, options);
      },
      py::arg("image"), py::arg("camera"), py::arg("T_camera_scanner"), py::arg("points"),
      py::arg("options") = LaserLineOptions(),
      "Distances of the laser line in a grey image (uint8, height x width) from the points of a profile, which are\n"
      "given in the scanner (3 x n or n x 3, in their order along the profile; NaN where none was measured).");
}

static void bind_poses(py::module_& m) {
  python::bind_struct<TargetPoseOptions>(m, "TargetPoseOptions", "Options of estimate_target_pose.");
  python::bind_struct<TargetPose>(m, "TargetPose", "Pose of a target in the camera.");
  m.def(
      "estimate_target_pose",
      [](const View& view, const Pinhole& camera, const TargetPoseOptions& options) {
        return estimate_target_pose(view, camera, options);
      },
      py::arg("view"), py::arg("camera"), py::arg("options") = TargetPoseOptions(),
      py::call_guard<py::gil_scoped_release>(),
      "Pose of a target from one view, with covariance and, for a flat one, the second pose. Check fit.usable.");
  m.def(
      "estimate_target_pose",
      [](const Detection& detection, const Pinhole& camera) { return estimate_target_pose(detection, camera); },
      py::arg("detection"), py::arg("camera"), py::call_guard<py::gil_scoped_release>(),
      "The same of what find_target found, with the noise and the correlation of its points.");
  m.def("estimate_tag_pose", &estimate_tag_pose, py::arg("tag"), py::arg("size"), py::arg("camera"),
        py::call_guard<py::gil_scoped_release>(), "The same of one marker whose side is `size` [m].");
  m.def("tag_view", &tag_view, py::arg("tag"), py::arg("size"),
        "View of the corners of a marker whose side is `size` [m], in its own frame.");
  python::bind_struct<MarkerSighting>(m, "MarkerSighting", "Markers seen in one image.");
  python::bind_struct<MarkerMapOptions>(m, "MarkerMapOptions", "Options of estimate_marker_map.");
  python::bind_struct<MarkerMapResult>(m, "MarkerMapResult", "Result of estimate_marker_map.");
  m.def(
      "estimate_marker_map",
      [](const std::vector<MarkerSighting>& images, const Pinhole& camera, const MarkerMapOptions& options) {
        return estimate_marker_map(images, camera, options);
      },
      py::arg("images"), py::arg("camera"), py::arg("options"), py::call_guard<py::gil_scoped_release>(),
      "Estimates the relative poses of markers from images that show several at once. Check fit.usable.");
}

static void bind_hole(py::module_& m) {
  python::bind_enum<HoleStatus>(m, "HoleStatus", "Whether a bore was found, or why not.");
  python::bind_struct<HoleOptions>(m, "HoleOptions", "Options of find_hole.");
  python::bind_struct<HoleDetection>(m, "HoleDetection",
                                     "Mouth of a bore in an image. The numbers are valid only when it was found.")
      .def_property_readonly("found", &HoleDetection::found);
  m.def(
      "find_hole",
      [](const GreyArray& image, const Pinhole& camera, const Pose& T_camera_plane, const HoleOptions& options) {
        const ImageView view = view_of(image);
        py::gil_scoped_release release;
        return find_hole(view, camera, T_camera_plane, options);
      },
      py::arg("image"), py::arg("camera"), py::arg("T_camera_plane"), py::arg("options"),
      "Searches for the bore of `options.radius` in the plane z = 0 of T_camera_plane (4x4, Z out of the face), which\n"
      "appears dark in the grey image (uint8, height x width). When it is not found, `status` and `message` give the\n"
      "reason.\n\n"
      "Hough circles are selected by their radius in metres, as in Hayat et al. 2022, section 6.3, and then measured\n"
      "at the edge.");
}

static void bind_servo(py::module_& m) {
  python::bind_enum<ServoFeature>(m, "ServoFeature", "Feature that visual servoing regulates.");
  python::bind_enum<ServoState>(m, "ServoState", "State of the approach.");
  python::bind_struct<VisualServoOptions>(m, "VisualServoOptions", "Options of VisualServo.");
  python::bind_struct<TargetObservation>(m, "TargetObservation", "Observation of the target in one image.");
  python::bind_struct<ServoStep>(m, "ServoStep", "Commanded motion of the camera in one step.");
  m.def(
      "observe_target",
      [](const GreyArray& image, const Target& target, const Pinhole& camera, const DetectOptions& options) {
        const ImageView view = view_of(image);
        py::gil_scoped_release release;
        return observe_target(view, target, camera, options);
      },
      py::arg("image"), py::arg("target"), py::arg("camera"), py::arg("options") = DetectOptions(),
      "Observation of a target in a grey image (uint8, height x width), with the lens distortion removed.");
  m.def("observe_hole", &observe_hole, py::arg("hole"),
        "Observation of a bore from the result of find_hole; use `turn_free`.");
  m.def("servo_command", &servo_command, py::arg("step"), py::arg("T_tool_camera"), py::arg("cycle"),
        "Command to the robot for a cycle [s] in which its camera shall move by the twist of a step: a motion of the "
        "tool "
        "in its own axes; none where the twist is zero.");
  py::class_<VisualServo>(m, "VisualServo",
                          "Approach of a camera to a desired pose of the target, by ViSP's control laws\n"
                          "(Chaumette and Hutchinson 2006). Call `step` with the observation of each image until the "
                          "state is no\nlonger moving.")
      .def(py::init<const Pose&, const VisualServoOptions&>(), py::arg("T_camera_target_goal"),
           py::arg("options") = VisualServoOptions(), "Raises InvalidArgument naming the invalid argument.")
      .def("step", &VisualServo::step, py::arg("observation"), py::arg("time"),
           py::call_guard<py::gil_scoped_release>(),
           "Next twist from the observation of the image taken at `time` [s], which must increase.");
}

static void bind_hand_eye(py::module_& m) {
  python::bind_enum<HandEyeMethod>(m, "HandEyeMethod", "Hand-eye solvers of OpenCV and ViSP.");
  python::bind_struct<HandEyeSample>(m, "HandEyeSample", "Robot pose and target pose of one view.");
  m.def(
      "closed_form_hand_eye",
      [](const std::vector<HandEyeSample>& samples, HandEyeMethod method) {
        return closed_form_hand_eye(samples, method);
      },
      py::arg("samples"), py::arg("method"), py::call_guard<py::gil_scoped_release>(),
      "T_flange_camera (4x4), or T_base_camera from inverted robot poses, by a solver of OpenCV or ViSP.");
}

void bind_vision(py::module_& m) {
  bind_hand_eye(m);
  bind_images(m);
  bind_render(m);
  bind_detect(m);
  bind_explanation(m);
  bind_laser_line(m);
  bind_poses(m);
  bind_hole(m);
  bind_servo(m);
  bind_camera_calibration(m);
}
