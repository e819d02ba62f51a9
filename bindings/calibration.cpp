// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/calibration/circle_point.hpp>
#include <kr5/calibration/dataset.hpp>
#include <kr5/calibration/evaluate.hpp>
#include <kr5/calibration/hand_eye.hpp>
#include <kr5/calibration/hand_eye_diagnosis.hpp>
#include <kr5/calibration/kinematics.hpp>
#include <kr5/calibration/parallel_planes.hpp>
#include <kr5/calibration/pose_file.hpp>
#include <kr5/calibration/pose_format.hpp>
#include <kr5/calibration/posture_choice.hpp>
#include <kr5/calibration/timed_hand_eye.hpp>
#include <kr5/calibration/tool.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::calibration;
using kr5::Mount;

static void bind_hand_eye(py::module_& m) {
  kr5::python::bind_struct<HandEyeView>(m, "HandEyeView", "Robot pose with the view of the target from it.");
  kr5::python::bind_struct<HandEyeOptions>(m, "HandEyeOptions", "Options of calibrate_hand_eye.");
  kr5::python::bind_struct<HandEyeViewReport>(m, "HandEyeViewReport", "Agreement of one view with the result.");
  kr5::python::bind_struct<HandEyeResult>(m, "HandEyeResult", "Pose of the camera with its covariance.");
  m.def(
      "calibrate_hand_eye",
      [](const std::vector<HandEyeView>& views, const kr5::Pinhole& camera, const HandEyeOptions& options) {
        py::gil_scoped_release release;
        return calibrate_hand_eye(views, camera, options);
      },
      py::arg("views"), py::arg("camera"), py::arg("options") = HandEyeOptions(),
      "Estimates camera and target pose together from pixels and robot poses, both with their noise.\n\n"
      "Parameters\n----------\nviews : list of HandEyeView\ncamera : kr5.Pinhole\noptions : HandEyeOptions\n\n"
      "Returns\n-------\nHandEyeResult\n    Check `fit.usable` before using the poses.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Fewer than three views, a view with fewer than four points, or NaN.");
}

static void bind_evaluation(py::module_& m) {
  kr5::python::bind_struct<HeldOutView>(m, "HeldOutView", "One view, predicted from a calibration made without it.");
  kr5::python::bind_struct<HandEyeEvaluation>(m, "HandEyeEvaluation", "Accuracy of a method on held-out views.");
  m.def(
      "evaluate_hand_eye",
      [](const std::vector<HandEyeView>& views, const kr5::Pinhole& camera, const HandEyeOptions& options, int folds) {
        return evaluate_hand_eye(views, camera, options, folds);
      },
      py::arg("views"), py::arg("camera"), py::arg("options") = HandEyeOptions(), py::arg("folds") = 0,
      py::call_guard<py::gil_scoped_release>(),
      "Error of calibrate_hand_eye on held-out views; folds 0: each view alone.");
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
      "Error of any method on held-out views. `solver(views, T_camera_target)` gets the views and the poses of the\n"
      "target seen in them and returns T_mount_camera (4x4), or None. T_fixed_target is the mean over the views.");
}

static void bind_pose_format(py::module_& m) {
  kr5::python::bind_enum<LengthUnit>(m, "LengthUnit", "Unit of the positions.");
  kr5::python::bind_enum<AngleUnit>(m, "AngleUnit", "Unit of the angles.");
  kr5::python::bind_enum<RotationForm>(m, "RotationForm", "Form of the rotation in a row.");
  kr5::python::bind_enum<PoseMeaning>(m, "PoseMeaning", "Meaning of a pose row.");
  kr5::python::bind_struct<PoseFormat>(m, "PoseFormat", "Convention of pose rows.");
  m.def("to_poses", &to_poses, py::arg("rows"), py::arg("format"), "Poses T_base_flange (4x4) from rows of numbers.");
  m.def("to_row", &to_row, py::arg("T_base_flange"), py::arg("format"),
        "Row of numbers of a pose; inverse of to_poses.");
  m.def("format_objections", &format_objections, py::arg("rows"), py::arg("format"),
        "Reasons against reading the rows in this format; empty when there are none.");
  m.def("plausible_formats", &plausible_formats, py::arg("rows"),
        "Every format without objections, common ones first.");
}

static void bind_tool(py::module_& m) {
  kr5::python::bind_struct<ToolOptions>(m, "ToolOptions", "Options of calibrate_tool.");
  kr5::python::bind_struct<ToolPoseReport>(m, "ToolPoseReport", "Agreement of one pose with the result.");
  kr5::python::bind_struct<ToolResult>(m, "ToolResult", "Position of the tool tip with its covariance.");
  m.def(
      "calibrate_tool",
      [](const std::vector<kr5::Pose>& poses, const ToolOptions& options) { return calibrate_tool(poses, options); },
      py::arg("T_base_flange"), py::arg("options") = ToolOptions(), py::call_guard<py::gil_scoped_release>(),
      "Tool centre point from poses of the flange (list of 4x4) whose tip touches one fixed point.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Fewer than four poses, or a pose that is not finite or not proper.");
}

static void bind_kinematics_calibration(py::module_& m) {
  kr5::python::bind_struct<UnidentifiableDirection>(m, "UnidentifiableDirection",
                                                    "Combination of parameters that the measurements leave open.");
  kr5::python::bind_struct<ArmPosture>(m, "ArmPosture", "Posture of an arm with what was measured of it.");
  kr5::python::bind_struct<SocketDistance>(m, "SocketDistance", "Known distance of two sockets.");
  kr5::python::bind_struct<KinematicsOptions>(m, "KinematicsOptions", "Options of calibrate_kinematics.");
  kr5::python::bind_struct<KinematicCoordinate>(m, "KinematicCoordinate", "Estimated number with its uncertainty.");
  kr5::python::bind_struct<ArmPostureReport>(m, "ArmPostureReport", "Agreement of one posture with the result.");
  kr5::python::bind_struct<KinematicsResult>(m, "KinematicsResult", "Identified arm with its covariance.")
      .def(
          "corrected", &KinematicsResult::corrected, py::arg("q"), py::arg("torques") = Eigen::VectorXd(),
          "Joint values at which the arm stands when the controller reports q [rad or m] and the joints bear torques,\n"
          "which are needed where compliances were estimated [N m or N].")
      .def("flange", &KinematicsResult::flange, py::arg("q"), py::arg("torques") = Eigen::VectorXd(),
           "T_base_flange (4x4) for reported joint values and torques of the joints.");
  m.def(
      "calibrate_kinematics",
      [](const kr5::kinematics::DhChain& nominal, const std::vector<ArmPosture>& postures,
         const std::vector<SocketDistance>& distances,
         const KinematicsOptions& options) { return calibrate_kinematics(nominal, postures, distances, options); },
      py::arg("nominal"), py::arg("postures"), py::arg("distances") = std::vector<SocketDistance>{},
      py::arg("options") = KinematicsOptions(), py::call_guard<py::gil_scoped_release>(),
      "Parameters of an arm from postures measured from outside, or resting in sockets.\n\n"
      "Parameters\n----------\nnominal : kr5.kinematics.DhChain\npostures : list of ArmPosture\n"
      "distances : list of SocketDistance\noptions : KinematicsOptions\n\n"
      "Returns\n-------\nKinematicsResult\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Fewer than six postures, one without a measurement, or NaN.");
}

static void bind_circle_point(py::module_& m) {
  kr5::python::bind_struct<JointSample>(m, "JointSample", "What was seen at one value of a joint.");
  kr5::python::bind_struct<JointAxisOptions>(m, "JointAxisOptions", "Options of identify_joint_axis.");
  kr5::python::bind_struct<JointAxisResult>(m, "JointAxisResult", "Axis of a joint with its covariance.");
  m.def(
      "identify_joint_axis",
      [](const std::vector<JointSample>& samples, const JointAxisOptions& options) {
        return identify_joint_axis(samples, options);
      },
      py::arg("samples"), py::arg("options") = JointAxisOptions(), py::call_guard<py::gil_scoped_release>(),
      "Axis of a joint from points or poses traced while only that joint moved.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Fewer than four samples, or one without a measurement.");
}

static void bind_parallel_planes(py::module_& m) {
  kr5::python::bind_struct<ParallelPlaneAxes>(m, "ParallelPlaneAxes", "Axes of an arm moved in parallel planes.");
  kr5::python::bind_struct<ParallelPlaneDistances>(m, "ParallelPlaneDistances", "Distances of parallel axes.");
  kr5::python::bind_struct<ParallelPlaneOptions>(m, "ParallelPlaneOptions", "Options of lengths_from_parallel_planes.");
  kr5::python::bind_struct<ParallelPlaneLengths>(m, "ParallelPlaneLengths", "Lengths of an arm with their covariance.");
  m.def("parallel_plane_distances", &parallel_plane_distances, py::arg("axes"),
        "Distances of identified axes that should be parallel, with their covariance.");
  m.def("lengths_from_parallel_planes", &lengths_from_parallel_planes, py::arg("distances"),
        py::arg("options") = ParallelPlaneOptions(),
        "Lengths a1, a2, a3 and b4 from distances of parallel axes, with the choice of the right solution.");
  m.def("parallel_plane_objection", &parallel_plane_objection, py::arg("arm"), py::arg("tolerance") = 0.01,
        "Why the distances of parallel axes do not tell the lengths of an arm; empty when they do.");
}

static void bind_posture_choice(py::module_& m) {
  kr5::python::bind_enum<PostureCriterion>(m, "PostureCriterion", "What a choice of postures makes small.");
  kr5::python::bind_struct<PostureChoiceOptions>(m, "PostureChoiceOptions", "Options of choose_postures.");
  kr5::python::bind_struct<PostureChoice>(m, "PostureChoice", "Chosen postures.");
  m.def(
      "choose_postures",
      [](const kr5::kinematics::DhChain& arm, const std::vector<Eigen::VectorXd>& candidates,
         const PostureChoiceOptions& options) { return choose_postures(arm, candidates, options); },
      py::arg("arm"), py::arg("candidates"), py::arg("options") = PostureChoiceOptions(),
      py::call_guard<py::gil_scoped_release>(),
      "Postures, of `candidates` (list of joint values), that tell most of an arm's parameters.");
}

static void bind_timed_hand_eye(py::module_& m) {
  kr5::python::bind_struct<PoseStream>(m, "PoseStream", "Poses with their times.");
  kr5::python::bind_struct<TimedHandEyeOptions>(m, "TimedHandEyeOptions", "Options of calibrate_timed_hand_eye.");
  kr5::python::bind_struct<SpeedAlignment>(m, "SpeedAlignment", "Angular speed of both streams.");
  kr5::python::bind_struct<TimedHandEyeResult>(m, "TimedHandEyeResult",
                                               "Clock offset and hand-eye pose with their covariance.");
  m.def("calibrate_timed_hand_eye", &calibrate_timed_hand_eye, py::arg("hand"), py::arg("camera"),
        py::arg("options") = TimedHandEyeOptions(), py::call_guard<py::gil_scoped_release>(),
        "Estimates t_camera = t_hand + offset together with T_hand_camera and T_base_world.\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    A stream of fewer than ten poses, or not finite.");
  m.def("world_in_base", &world_in_base, py::arg("hand"), py::arg("camera"), py::arg("result"),
        py::arg("max_gap") = TimedHandEyeOptions().max_gap, py::call_guard<py::gil_scoped_release>(),
        "Pose of the world in the base from each camera pose, for a given result.");
  m.def("position_spread", &position_spread, py::arg("poses"),
        "Median and RMS distance of positions from their mean [m].");
}

static void bind_dataset(py::module_& m) {
  kr5::python::bind_enum<Pairing>(m, "Pairing", "Pairing of images and poses.");
  kr5::python::bind_struct<Dataset>(m, "Dataset", "Data set with its robot poses.")
      .def("poses", &Dataset::poses, "Poses T_base_flange (list of 4x4), without the tool offset.");
  m.def(
      "load_dataset", [](const std::string& file, const std::string& folder) { return load_dataset(file, folder); },
      py::arg("file"), py::arg("folder") = "",
      "Reads a dataset.yaml and its pose files below `folder` (default: the folder of the file).");
  m.def(
      "load_pose_set", [](const std::string& file, const std::string& folder) { return load_pose_set(file, folder); },
      py::arg("file"), py::arg("folder") = "", "Reads only `poses` and `convention`, for use without images.");
  m.def(
      "load_poses", [](const std::string& file, RotationForm rotation) { return load_poses(file, rotation).rows; },
      py::arg("file"), py::arg("rotation"), "Rows of numbers in a pose file: YAML, JSON, CSV or plain text.");
}

static void bind_diagnosis(py::module_& m) {
  kr5::python::bind_enum<HandEyeCause>(m, "HandEyeCause", "Fault of a hand-eye recording.");
  kr5::python::bind_enum<CalibrationVerdict>(m, "CalibrationVerdict", "CalibrationVerdict on a result.");
  kr5::python::bind_struct<HandEyeDiagnosisOptions>(m, "HandEyeDiagnosisOptions", "Options of diagnose_hand_eye.");
  kr5::python::bind_struct<NamedCause>(m, "NamedCause", "Cause with its evidence.");
  kr5::python::bind_struct<HandEyeDiagnosis>(m, "HandEyeDiagnosis", "Diagnosis of a calibration.");
  m.def(
      "diagnose_hand_eye",
      [](const Eigen::MatrixXd& rows, const PoseFormat& format, const std::vector<kr5::View>& views,
         const kr5::Pinhole& camera, Mount mount, const HandEyeResult& result, const std::vector<double>& times,
         const HandEyeDiagnosisOptions& options) {
        return diagnose_hand_eye({rows, format, views, times, camera, mount}, result, options);
      },
      py::arg("rows"), py::arg("format"), py::arg("views"), py::arg("camera"), py::arg("mount"), py::arg("result"),
      py::arg("times") = std::vector<double>{}, py::arg("options") = HandEyeDiagnosisOptions(),
      py::call_guard<py::gil_scoped_release>(),
      "Evaluates the result of calibrate_hand_eye and searches for faults of the recording.");
}

void bind_calibration(py::module_& m) {
  m.doc() = "Hand-eye, tool and clock calibration, and their evaluation.";
  bind_pose_format(m);
  bind_hand_eye(m);
  bind_dataset(m);
  bind_diagnosis(m);
  bind_evaluation(m);
  bind_tool(m);
  bind_timed_hand_eye(m);
  bind_kinematics_calibration(m);
  bind_circle_point(m);
  bind_parallel_planes(m);
  bind_posture_choice(m);
}
