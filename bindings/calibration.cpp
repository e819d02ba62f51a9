// SPDX-License-Identifier: BSD-3-Clause
#include <filesystem>
#include <numbers>

#include <kr5/calibration/arm_axes.hpp>
#include <kr5/calibration/camera_agreement.hpp>
#include <kr5/calibration/cell_calibration.hpp>
#include <kr5/calibration/circle_point.hpp>
#include <kr5/calibration/dataset.hpp>
#include <kr5/calibration/evaluate.hpp>
#include <kr5/calibration/further_postures.hpp>
#include <kr5/calibration/hand_eye.hpp>
#include <kr5/calibration/hand_eye_diagnosis.hpp>
#include <kr5/calibration/hand_eye_pairs.hpp>
#include <kr5/calibration/kinematics.hpp>
#include <kr5/calibration/moved_device.hpp>
#include <kr5/calibration/pair_readings.hpp>
#include <kr5/calibration/parallel_planes.hpp>
#include <kr5/calibration/pose_columns.hpp>
#include <kr5/calibration/pose_convention.hpp>
#include <kr5/calibration/pose_file.hpp>
#include <kr5/calibration/pose_format.hpp>
#include <kr5/calibration/posture_checks.hpp>
#include <kr5/calibration/posture_choice.hpp>
#include <kr5/calibration/profile_cloud.hpp>
#include <kr5/calibration/profile_features.hpp>
#include <kr5/calibration/repeatability.hpp>
#include <kr5/calibration/scan_error.hpp>
#include <kr5/calibration/scanner.hpp>
#include <kr5/calibration/scanner_points.hpp>
#include <kr5/calibration/sphere_fit.hpp>
#include <kr5/calibration/target_size.hpp>
#include <kr5/calibration/timed_hand_eye.hpp>
#include <kr5/calibration/tool.hpp>
#include <kr5/calibration/turn_agreement.hpp>
#include <kr5/calibration/turn_findings.hpp>
#include <kr5/calibration/turn_split.hpp>
#include <kr5/calibration/upright_lengths.hpp>

#include "interruptible.hpp"
#include "python_simulator.hpp"
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

static void bind_hand_eye_pairs(py::module_& m) {
  kr5::python::bind_struct<PosePair>(m, "PosePair", "Robot pose with the pose of the target seen from it.");
  kr5::python::bind_struct<HandEyePairsOptions>(m, "HandEyePairsOptions", "Options of calibrate_hand_eye_pairs.");
  kr5::python::bind_struct<PairReading>(m, "PairReading", "One way of reading pairs of poses.");
  kr5::python::bind_struct<PairReadings>(m, "PairReadings", "Which way round poses are.");
  m.def(
      "calibrate_hand_eye_pairs",
      [](const std::vector<PosePair>& pairs, const HandEyePairsOptions& options) {
        return calibrate_hand_eye_pairs(pairs, options);
      },
      py::arg("pairs"), py::arg("options") = HandEyePairsOptions(), py::call_guard<py::gil_scoped_release>(),
      "Estimates camera and target pose together from pairs of poses, both with their noise.\n\n"
      "Parameters\n----------\npairs : list of PosePair\noptions : HandEyePairsOptions\n\n"
      "Returns\n-------\nHandEyeResult\n    Check `fit.usable` before using the poses.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Fewer than three pairs, a pair given twice, or an invalid pose.");
  m.def(
      "compare_pair_readings",
      [](const std::vector<PosePair>& pairs, Mount mount) { return compare_pair_readings(pairs, mount); },
      py::arg("pairs"), py::arg("mount"), py::call_guard<py::gil_scoped_release>(),
      "Which way round the poses are: as given, or inverted.");
  m.def(
      "read_pairs",
      [](const std::vector<PosePair>& pairs, const PairReading& reading) { return read_pairs(pairs, reading); },
      py::arg("pairs"), py::arg("reading"), "The pairs in one reading.");
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
      "evaluate_hand_eye_pairs",
      [](const std::vector<PosePair>& pairs, const HandEyePairsOptions& options, int folds) {
        return evaluate_hand_eye_pairs(pairs, options, folds);
      },
      py::arg("pairs"), py::arg("options") = HandEyePairsOptions(), py::arg("folds") = 0,
      py::call_guard<py::gil_scoped_release>(),
      "Error of calibrate_hand_eye_pairs on held-out pairs; folds 0: each pair alone.");
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

static void bind_pose_convention(py::module_& m) {
  kr5::python::bind_struct<PoseRows>(m, "PoseRows", "Rows of robot poses, read in one form of rotation.");
  kr5::python::bind_struct<ViewOfPose>(m, "ViewOfPose", "View of the target at one of the poses.");
  kr5::python::bind_struct<PoseConvention>(m, "PoseConvention",
                                           "Reading of the poses, and how well robot and camera agree under it.");
  m.def(
      "rank_conventions", &rank_conventions, py::arg("readings"), py::arg("views"), py::arg("camera"),
      py::call_guard<py::gil_scoped_release>(),
      "Every reading of robot poses with which a hand-eye calibration succeeds: list of PoseConvention, the one under "
      "which robot and camera agree best first. `readings`: list of PoseRows; `views`: list of ViewOfPose. Inverted "
      "poses with the other mount agree equally well, so that the meaning is T_base_flange. Raises InvalidArgument for "
      "a view of a row that is not there.");
}

static void bind_target_size(py::module_& m) {
  kr5::python::bind_struct<TargetSize>(m, "TargetSize", "Size of a target that the robot poses tell.");
  m.def(
      "size_from_poses",
      [](const std::vector<PoseRows>& readings, const std::vector<ViewOfPose>& views, const kr5::Pinhole& camera,
         const std::vector<PoseConvention>& conventions) {
        return size_from_poses(readings, views, camera, conventions);
      },
      py::arg("readings"), py::arg("views"), py::arg("camera"), py::arg("conventions"),
      py::call_guard<py::gil_scoped_release>(),
      "The size of the target with which robot and camera agree best, as TargetSize; None when no size agrees better\n"
      "than the stated one. `conventions`: as rank_conventions gives them for the stated size.");
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
  kr5::python::bind_struct<ArmPosture>(m, "ArmPosture", "Posture of an arm with what was measured of it.");
  kr5::python::bind_struct<SocketDistance>(m, "SocketDistance", "Known distance of two sockets.");
  kr5::python::bind_struct<KinematicsOptions>(m, "KinematicsOptions", "Options of calibrate_kinematics.");
  kr5::python::bind_struct<EstimatedParameter>(m, "EstimatedParameter", "Estimated number with its uncertainty.");
  kr5::python::bind_struct<ArmPostureReport>(m, "ArmPostureReport", "Agreement of one posture with the result.");
  kr5::python::bind_struct<KinematicsResult>(m, "KinematicsResult", "Identified arm with its covariance.")
      .def(
          "corrected", &KinematicsResult::corrected, py::arg("q"), py::arg("torques") = Eigen::VectorXd(),
          "Joint values at which the arm stands when the controller reports q [rad or m] and the joints bear torques,\n"
          "which are needed where compliances were estimated [N m or N].")
      .def("flange", &KinematicsResult::flange, py::arg("q"), py::arg("torques") = Eigen::VectorXd(),
           "T_base_flange (4x4) for reported joint values and torques of the joints.");
  kr5::python::bind_struct<CameraAgreement>(m, "CameraAgreement",
                                            "Whether camera and target stand where a calibration puts them.");
  m.def("camera_agreement", &camera_agreement, py::arg("found"), py::arg("stated"), py::arg("false_alarm") = 1e-3,
        "Compares the camera and the target of the options with a calibration in which both were free; None where\n"
        "neither was estimated.");
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

static void bind_posture_checks(py::module_& m) {
  kr5::python::bind_struct<PostureCheckOptions>(m, "PostureCheckOptions", "Options of check_postures.");
  kr5::python::bind_struct<StillJoint>(m, "StillJoint", "Joint that stood still, or hardly moved.");
  kr5::python::bind_enum<DeviceUnit>(m, "DeviceUnit", "Unit that a factor of all lengths is known for.");
  kr5::python::bind_struct<ScaledPlaces>(m, "ScaledPlaces", "Places farther apart, or nearer, than the arm's.");
  kr5::python::bind_struct<MirroredPlaces>(m, "MirroredPlaces", "Places of the other handedness.");
  kr5::python::bind_struct<ShiftedPlaces>(m, "ShiftedPlaces",
                                          "Places that belong to the row before or after their own.");
  kr5::python::bind_struct<ReorderedRows>(m, "ReorderedRows", "Places beside the joint values of another row.");
  kr5::python::bind_struct<UnrelatedPlaces>(m, "UnrelatedPlaces", "Places that fit the joint values in no order.");
  kr5::python::bind_struct<PostureFindings>(m, "PostureFindings", "What speaks against measured postures.");
  kr5::python::bind_struct<MovedDevice>(m, "MovedDevice", "Row from which on all measured places are elsewhere.");
  m.def(
      "find_still_joints",
      [](const kr5::kinematics::DhChain& nominal, const std::vector<ArmPosture>& postures,
         const PostureCheckOptions& options) { return find_still_joints(nominal, postures, options); },
      py::arg("nominal"), py::arg("postures"), py::arg("options") = PostureCheckOptions(),
      "Joints that stood still or hardly moved over all postures (list of ArmPosture): list of StillJoint.");
  m.def(
      "check_postures",
      [](const kr5::kinematics::DhChain& nominal, const std::vector<ArmPosture>& postures,
         const PostureCheckOptions& options) { return check_postures(nominal, postures, options); },
      py::arg("nominal"), py::arg("postures"), py::arg("options") = PostureCheckOptions(),
      py::call_guard<py::gil_scoped_release>(),
      "Faults of measured postures that leave their mark on all rows together, by the nominal arm.\n\n"
      "Parameters\n----------\nnominal : kr5.kinematics.DhChain\npostures : list of ArmPosture\n"
      "options : PostureCheckOptions\n\nReturns\n-------\nPostureFindings\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Joint values that do not fit the arm, or NaN.");
  m.def(
      "find_moved_device",
      [](const KinematicsResult& result, const std::vector<ArmPosture>& postures, double max_chi_square) {
        return find_moved_device(result, postures, max_chi_square);
      },
      py::arg("result"), py::arg("postures"), py::arg("max_chi_square") = 60.0,
      "The row from which on the residuals of a calibration are others; None where there is none. `max_chi_square`:\n"
      "greatest chi-square, over all rows, that chance gives [-].");
}

static void bind_further_postures(py::module_& m) {
  kr5::python::bind_struct<FurtherPostures>(m, "FurtherPostures", "Errors of an arm on postures beside its fit.");
  m.attr("MIN_POSTURES_TO_PLACE") = min_postures_to_place;
  m.def(
      "need_placing",
      [](const std::vector<ArmPosture>& fitted, const std::vector<ArmPosture>& further) {
        return need_placing(fitted, further);
      },
      py::arg("fitted"), py::arg("further"),
      "Whether a fit does not say where the device of further postures, or the point that it measures, is.");
  m.def(
      "evaluate_arm",
      [](const KinematicsResult& result, const kr5::kinematics::DhChain& nominal, const std::vector<ArmPosture>& fitted,
         const std::vector<ArmPosture>& further, const std::vector<SocketDistance>& distances,
         const KinematicsOptions& options) {
        return evaluate_arm(result, nominal, fitted, further, distances, options);
      },
      py::arg("result"), py::arg("nominal"), py::arg("fitted"), py::arg("further"),
      py::arg("distances") = std::vector<SocketDistance>{}, py::arg("options") = KinematicsOptions(),
      py::call_guard<py::gil_scoped_release>(),
      "Errors of an identified and of the nominal arm on postures that took no part in the fit.\n\n"
      "Parameters\n----------\nresult : KinematicsResult\nnominal : kr5.kinematics.DhChain\n"
      "fitted, further : list of ArmPosture\ndistances : list of SocketDistance\n"
      "options : KinematicsOptions\n    Those of the fit.\n\nReturns\n-------\nFurtherPostures\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    A result that is not usable, or postures that it cannot predict.");
}

static void bind_cell_calibration(py::module_& m) {
  kr5::python::bind_struct<CellStop>(m, "CellStop", "Robot stop with what the camera saw.");
  kr5::python::bind_struct<CellGeometry>(m, "CellGeometry", "Camera, markers and arm of a cell.");
  kr5::python::bind_struct<CellScan>(m, "CellScan", "What a line scanner on the flange saw.");
  kr5::python::bind_struct<CellCalibrationOptions>(m, "CellCalibrationOptions", "Options of calibrate_cell.");
  kr5::python::bind_struct<CellCalibrationResult>(m, "CellCalibrationResult", "Calibrated cell with its covariance.");
  kr5::python::bind_struct<CellHeldOutView>(m, "CellHeldOutView", "Error with which a view left out is predicted.");
  m.def(
      "calibrate_cell",
      [](const std::vector<CellStop>& stops, const CellGeometry& believed, const CellCalibrationOptions& options,
         const CellScan& scan) { return calibrate_cell(stops, believed, options, scan); },
      py::arg("stops"), py::arg("believed"), py::arg("options") = CellCalibrationOptions(),
      py::arg("scan") = CellScan(), py::call_guard<py::gil_scoped_release>(),
      "Camera, hand-eye poses, marker map and arm from the same images and postures, in one solve.\n\n"
      "Parameters\n----------\nstops : list of CellStop\nbelieved : CellGeometry\n"
      "options : CellCalibrationOptions\nscan : CellScan\n\nReturns\n-------\nCellCalibrationResult\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Fewer than three stops, joint values that do not fit the arm, NaN.");
  m.def(
      "evaluate_cell",
      [](const std::vector<CellStop>& stops, const CellGeometry& believed, const CellCalibrationOptions& options,
         int folds) { return evaluate_cell(stops, believed, options, folds); },
      py::arg("stops"), py::arg("believed"), py::arg("options") = CellCalibrationOptions(), py::arg("folds") = 5,
      py::call_guard<py::gil_scoped_release>(),
      "Errors with which views left out are predicted, the cell calibrated together and one after another.");
  kr5::python::bind_struct<TurnAgreement>(m, "TurnAgreement", "Whether joint values and poses are of the same stops.");
  m.def(
      "compare_turns",
      [](const kr5::kinematics::DhChain& arm, const kr5::kinematics::Rows& q, const std::vector<kr5::Pose>& poses,
         double limit) { return compare_turns(arm, q, poses, limit); },
      py::arg("arm"), py::arg("q"), py::arg("T_base_flange"), py::arg("limit") = std::numbers::pi / 90,
      "Compares the angles by which the flange turns from stop to stop, by joint values (a row a stop) and by poses;\n"
      "`limit`: of their median difference [rad].");
}

static void bind_circle_point(py::module_& m) {
  kr5::python::bind_struct<JointSample>(m, "JointSample", "What was seen at one value of a joint.");
  kr5::python::bind_struct<JointAxisOptions>(m, "JointAxisOptions", "Options of identify_joint_axis.");
  kr5::python::bind_struct<SystematicResiduals>(m, "SystematicResiduals", "Points that leave their circles.");
  kr5::python::bind_struct<ScaledReadings>(m, "ScaledReadings", "Joint that turned by another angle than it reads.");
  kr5::python::bind_struct<AxisFindings>(m, "AxisFindings", "Reasons to doubt that one joint alone moved.")
      .def_property_readonly("empty", &AxisFindings::empty, "Whether nothing was found.");
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
        "Reason why the distances of parallel axes do not determine the lengths of an arm; empty when they do.");
}

static void bind_turn_split(py::module_& m) {
  kr5::python::bind_struct<TurnSplitOptions>(m, "TurnSplitOptions", "Options of split_turns.");
  kr5::python::bind_struct<JointsAway>(m, "JointsAway", "Joints that are away from home in one row together.");
  kr5::python::bind_struct<TurnSplit>(m, "TurnSplit", "Rows of the turns of single joints.")
      .def_property_readonly("usable", &TurnSplit::usable, "Whether each joint turned, and always alone.");
  m.def("split_turns", &split_turns, py::arg("q"), py::arg("options") = TurnSplitOptions(),
        "Splits joint values (a row a sample, a column a joint) [rad] into the turns of single joints.\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    No joint values, or some that are not finite.");
}

static void bind_arm_axes(py::module_& m) {
  kr5::python::bind_enum<TurnEnd>(m, "TurnEnd", "End of a turn.");
  kr5::python::bind_enum<NominalMismatchKind>(m, "NominalMismatchKind", "What contradicts the nominal arm.");
  kr5::python::bind_struct<TurnFindingOptions>(m, "TurnFindingOptions", "Limits beyond which something is found.");
  kr5::python::bind_struct<UnevenNoise>(m, "UnevenNoise", "Turn whose samples scatter more than those of the others.");
  kr5::python::bind_struct<ShiftedRows>(m, "ShiftedRows", "Measurements shifted by a row.");
  kr5::python::bind_struct<HomeJump>(m, "HomeJump", "Jump of the measured point between two turns.");
  kr5::python::bind_struct<ImplausibleLength>(m, "ImplausibleLength", "Arm that is too long or too short for one.");
  kr5::python::bind_struct<NominalMismatch>(m, "NominalMismatch", "What contradicts the nominal arm as a whole.");
  kr5::python::bind_struct<TurnFindings>(m, "TurnFindings", "Reasons to doubt several turns together.")
      .def_property_readonly("empty", &TurnFindings::empty, "Whether nothing was found.");
  kr5::python::bind_struct<ArmAxesOptions>(m, "ArmAxesOptions", "Options of identify_arm_axes.");
  kr5::python::bind_struct<ArmParameter>(m, "ArmParameter", "Identified parameter of an arm.");
  kr5::python::bind_struct<ArmAxesResult>(m, "ArmAxesResult", "Axes and arm from turns of single joints.");
  m.def(
      "identify_arm_axes",
      [](const std::vector<std::vector<JointSample>>& turns, const Eigen::VectorXd& home,
         const ArmAxesOptions& options) { return identify_arm_axes(turns, home, options); },
      py::arg("turns"), py::arg("home"), py::arg("options") = ArmAxesOptions(),
      py::call_guard<py::gil_scoped_release>(),
      "Axes and Denavit-Hartenberg parameters of an arm from turns of single joints, without nominal values.\n\n"
      "Parameters\n----------\nturns : list of list of JointSample\n    Of each joint, from the base.\n"
      "home : numpy.ndarray\n    Joint values at which the others stood [rad].\noptions : ArmAxesOptions\n\n"
      "Returns\n-------\nArmAxesResult\n    Check `fit.usable` before using the arm.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    A turn of fewer than four samples, or one without a measurement.");
}

static void bind_upright_lengths(py::module_& m) {
  kr5::python::bind_struct<UprightLengths>(m, "UprightLengths", "Lengths by parallel planes, with their distances.");
  m.def("identify_upright_lengths", &identify_upright_lengths, py::arg("arm"), py::arg("axis6_upright"),
        py::arg("options") = ParallelPlaneOptions(), py::call_guard<py::gil_scoped_release>(),
        "Lengths of an identified arm with one more turn of joint 6, the forearm along axis 1.");
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
      "The most informative of `candidates` (list of joint values) for the parameters of an arm.");
}

static void bind_profiles(py::module_& m) {
  kr5::python::bind_enum<ScanTargetKind>(m, "ScanTargetKind", "What a scanner looks at when it is calibrated.");
  kr5::python::bind_struct<LineProfile>(m, "LineProfile", "Points of one line of a scanner.");
  kr5::python::bind_struct<ProfileFeatureOptions>(m, "ProfileFeatureOptions", "Options of find_profile_feature.");
  kr5::python::bind_struct<ProfileFeature>(m, "ProfileFeature", "Tip, arc or line in a profile, with its covariance.");
  m.def("find_profile_feature", &find_profile_feature, py::arg("profile"), py::arg("kind"),
        py::arg("options") = ProfileFeatureOptions(),
        "Tip, arc of a sphere or line of a plane in a profile; check `fit.usable`, whose message says why there is "
        "none.\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    x and z of different lengths, or coordinates above 5 m.");
  kr5::python::bind_struct<TimedProfile>(m, "TimedProfile", "Profile and when it was taken.");
  kr5::python::bind_struct<ProfileCloudOptions>(m, "ProfileCloudOptions", "Options of profiles_to_cloud.");
  kr5::python::bind_struct<ProfileCloud>(m, "ProfileCloud", "Points of profiles in the base.");
  m.def(
      "interpolate_poses",
      [](const std::vector<double>& t, const std::vector<kr5::Pose>& poses, const std::vector<double>& times,
         double max_gap) {
        const InterpolatedPoses found = interpolate_poses(t, poses, times, max_gap);
        return py::make_tuple(found.poses, found.inside);
      },
      py::arg("t"), py::arg("poses"), py::arg("times"), py::arg("max_gap") = ProfileCloudOptions().max_gap,
      "Poses (list of 4x4) at `times` between poses at the times `t`, and whether each lies inside the stamps.");
  m.def(
      "profiles_to_cloud",
      [](const std::vector<LineProfile>& profiles, const std::vector<kr5::Pose>& poses, const kr5::Pose& scanner) {
        return profiles_to_cloud(profiles, poses, scanner);
      },
      py::arg("profiles"), py::arg("T_base_flange"), py::arg("T_flange_scanner"),
      "Cloud in the base of profiles (list of LineProfile) whose flange poses (list of 4x4) are known, one each.");
  m.def(
      "timed_profiles_to_cloud",
      [](const std::vector<TimedProfile>& profiles, const std::vector<double>& t, const std::vector<kr5::Pose>& poses,
         const kr5::Pose& scanner,
         const ProfileCloudOptions& options) { return profiles_to_cloud(profiles, t, poses, scanner, options); },
      py::arg("profiles"), py::arg("t"), py::arg("T_base_flange"), py::arg("T_flange_scanner"),
      py::arg("options") = ProfileCloudOptions(),
      "The same of profiles (list of TimedProfile) between poses at the times `t`, interpolated.");
}

static void bind_scan_error(py::module_& m) {
  kr5::python::bind_struct<SphereFit>(m, "SphereFit", "Centre of a sphere with its covariance.");
  m.def("fit_sphere", &fit_sphere, py::arg("points"), py::arg("radius"), py::arg("start"),
        "Centre of a sphere of known radius [m] from points of its surface (3 x n or n x 3), on the side of `start`.");
  kr5::python::bind_struct<ScanErrorOptions>(m, "ScanErrorOptions", "Options of simulate_scan_error.");
  kr5::python::bind_struct<ScanError>(m, "ScanError", "Error of points on a sphere of known place.");
  kr5::python::bind_struct<ScanErrorResult>(m, "ScanErrorResult", "Error of simulated scans of a sphere.");
  m.def(
      "simulate_scan_error",
      [](const kr5::cell::Cell& cell, double stand_off, double speed, const ScanErrorOptions& options,
         const py::object& simulator) {
        return kr5::python::compute_interruptibly(kr5::python::simulator_from(simulator),
                                                  [&](const kr5::cell::Simulator& with) {
                                                    return simulate_scan_error(cell, with, stand_off, speed, options);
                                                  });
      },
      py::arg("cell"), py::arg("stand_off"), py::arg("speed"), py::arg("options") = ScanErrorOptions(),
      py::arg("simulator") = py::none(),
      "Errors of scans of the sphere of a cell, at a stand-off [m] and a speed along Y of the scanner [m/s].\n\n"
      "Parameters\n----------\ncell : kr5.cell.Cell\nstand_off : float\nspeed : float\n"
      "options : ScanErrorOptions\nsimulator : object with `predict(cell, experiment)`\n"
      "    By default kr5.predict.FastSimulator().\n\nReturns\n-------\nScanErrorResult\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    A cell without scanner, target or limits, or a pass out of reach.");
}

static void bind_scanner(py::module_& m) {
  kr5::python::bind_struct<ScannerFromPoints>(m, "ScannerFromPoints", "Pose of a scanner from points.");
  m.def("scanner_from_points", &scanner_from_points, py::arg("points_scanner"), py::arg("points_flange"),
        "T_flange_scanner from three points or more: x and z in profiles (2 x n or n x 2), and on the\n"
        "flange (3 x n or n x 3).");
  m.def(
      "hayat2022_scanner_rotation", &hayat2022_scanner_rotation, py::arg("x1"), py::arg("x2"), py::arg("x3"),
      py::arg("tip_is_nearer") = false,
      "Rotation of the scanner in the flange from two points of a surface and a tip (Hayat et al. 2022, eq. 2.1-2.5).");
  m.def("camera_scanner", &camera_scanner, py::arg("T_flange_camera"), py::arg("T_flange_scanner"),
        py::arg("cross") = kr5::Matrix6(kr5::Matrix6::Zero()),
        "T_camera_scanner with its covariance from two UncertainPose; `cross` is the covariance between their errors.");
  kr5::python::bind_struct<ScanTarget>(m, "ScanTarget", "Tip, sphere or plane that is scanned.");
  kr5::python::bind_struct<ScannerView>(m, "ScannerView", "What one profile shows, and where the flange was.");
  kr5::python::bind_struct<ScannerOptions>(m, "ScannerOptions", "Options of calibrate_scanner.");
  kr5::python::bind_struct<ScannerViewReport>(m, "ScannerViewReport", "Agreement of one profile with the result.");
  kr5::python::bind_struct<ScannerCause>(m, "ScannerCause", "Finding about the data, with what to do.");
  kr5::python::bind_struct<ScannerResult>(m, "ScannerResult", "Pose of a scanner with its covariance.");
  m.def(
      "calibrate_scanner",
      [](const std::vector<ScannerView>& views, const std::vector<ScanTarget>& targets, const ScannerOptions& options,
         const std::optional<kr5::kinematics::DhChain>& arm) {
        return calibrate_scanner(views, targets, options, arm);
      },
      py::arg("views"), py::arg("targets"), py::arg("options") = ScannerOptions(), py::arg("arm") = py::none(),
      py::call_guard<py::gil_scoped_release>(),
      "Pose of a line scanner on the flange from profiles of targets that stand still in the base.\n\n"
      "Parameters\n----------\nviews : list of ScannerView\ntargets : list of ScanTarget\n"
      "options : ScannerOptions\narm : kr5.kinematics.DhChain, optional\n    Nominal arm, which is refined, too.\n\n"
      "Returns\n-------\nScannerResult\n    Check `fit.usable` before using the pose.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Fewer than four profiles, one without a usable feature, or NaN.");
}

static void bind_repeatability(py::module_& m) {
  kr5::python::bind_struct<PoseReturn>(m, "PoseReturn", "Measured return of the arm to a point.");
  kr5::python::bind_struct<CommandedPose>(m, "CommandedPose", "Pose that the arm was sent to.");
  kr5::python::bind_struct<RepeatabilityOptions>(m, "RepeatabilityOptions", "Options of measure_repeatability.");
  kr5::python::bind_struct<BoundedFigure>(m, "BoundedFigure", "Figure with its confidence bounds.");
  kr5::python::bind_struct<PointRepeatability>(m, "PointRepeatability", "Figures of one point, or of all together.");
  kr5::python::bind_struct<SuspectReturn>(m, "SuspectReturn", "Return that stands out.");
  kr5::python::bind_struct<ReturnDrift>(m, "ReturnDrift", "Trend over the returns.");
  kr5::python::bind_struct<RepeatabilityResult>(m, "RepeatabilityResult", "Repeatability and accuracy of poses.");
  m.def(
      "measure_repeatability",
      [](const std::vector<PoseReturn>& returns, const std::vector<CommandedPose>& commanded,
         const RepeatabilityOptions& options) { return measure_repeatability(returns, commanded, options); },
      py::arg("returns"), py::arg("commanded") = std::vector<CommandedPose>{},
      py::arg("options") = RepeatabilityOptions(), py::call_guard<py::gil_scoped_release>(),
      "Pose repeatability and accuracy after ISO 9283, with confidence bounds.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    A point with fewer than three returns, or an invalid pose.");
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
  using std::filesystem::path;
  kr5::python::bind_enum<Pairing>(m, "Pairing", "Pairing of images and poses.");
  kr5::python::bind_struct<Dataset>(m, "Dataset", "Data set with its robot poses.")
      .def("poses", &Dataset::poses, "Poses T_base_flange (list of 4x4), without the tool offset.");
  m.def(
      "load_dataset", [](const path& file, const path& folder) { return load_dataset(file, folder); }, py::arg("file"),
      py::arg("folder") = "",
      "Reads a dataset.yaml and its pose files below `folder` (default: the folder of the file).");
  m.def(
      "load_pose_set", [](const path& file, const path& folder) { return load_pose_set(file, folder); },
      py::arg("file"), py::arg("folder") = "", "Reads only `poses` and `convention`, for use without images.");
  m.def(
      "load_poses", [](const path& file, RotationForm rotation) { return load_poses(file, rotation).rows; },
      py::arg("file"), py::arg("rotation"), "Rows of numbers in a pose file: YAML, JSON, CSV or plain text.");
  m.def("row_length", &row_length, py::arg("rotation"), "Numbers in a row of this form; a matrix row has 12 or 16.");
  m.def("pose_column_names", &pose_column_names, py::arg("rotation"),
        "Names of the numbers of a row of this form in their order, each with its spellings; none of a matrix.");
  m.def("find_pose_columns", &find_pose_columns, py::arg("columns"), py::arg("rotation"), py::arg("prefix") = "",
        "Positions of the columns that make the rows of this form, -1 where there is none.");
  m.def("find_rotation_form", &find_rotation_form, py::arg("columns"), py::arg("prefix") = "",
        "The form whose rotation the columns name; None where they name none.");
  m.def("rotation_form_of_length", &rotation_form_of_length, py::arg("numbers"),
        "The form that rows of so many numbers have; None where several have.");
  m.def("usual_format", &usual_format, py::arg("rotation"), "Units in which controllers print this form.");
  m.def("find_pose_units", &find_pose_units, py::arg("rows"), py::arg("rotation"), py::arg("position") = std::nullopt,
        py::arg("angle") = std::nullopt,
        "The format with the units that the rows do not contradict, the usual ones first; a stated unit is kept. None\n"
        "where every choice is contradicted.");
}

static void bind_diagnosis(py::module_& m) {
  kr5::python::bind_enum<HandEyeCause>(m, "HandEyeCause", "Fault of a hand-eye recording.");
  kr5::python::bind_enum<CalibrationVerdict>(m, "CalibrationVerdict", "CalibrationVerdict on a result.");
  kr5::python::bind_struct<HandEyeDiagnosisOptions>(m, "HandEyeDiagnosisOptions", "Options of diagnose_hand_eye.");
  kr5::python::bind_struct<NamedCause>(m, "NamedCause", "Cause with its evidence.");
  kr5::python::bind_struct<HandEyeDiagnosis>(m, "HandEyeDiagnosis", "Diagnosis of a calibration.");
  m.def(
      "diagnose_hand_eye",
      [](const std::vector<HandEyeView>& views, const kr5::Pinhole& camera, const HandEyeResult& result,
         const std::vector<double>& times, const HandEyeDiagnosisOptions& options) {
        HandEyeRecording recording = HandEyeRecording::from_views(views, camera, result.mount);
        recording.times = times;
        return diagnose_hand_eye(recording, result, options);
      },
      py::arg("views"), py::arg("camera"), py::arg("result"), py::arg("times") = std::vector<double>{},
      py::arg("options") = HandEyeDiagnosisOptions(), py::call_guard<py::gil_scoped_release>(),
      "Evaluates the result of calibrate_hand_eye and searches for faults of the recording.\n\n"
      "Parameters\n----------\nviews : list of HandEyeView\n    Those that calibrate_hand_eye took.\n"
      "camera : kr5.Pinhole\nresult : HandEyeResult\n"
      "times : list of float, optional\n    Of the views [s]; by default evenly spaced.\n"
      "options : HandEyeDiagnosisOptions, optional\n\n"
      "Returns\n-------\nHandEyeDiagnosis\n\n"
      "The other form takes the robot's poses as its controller wrote them (n x 6, 7, 12 or 16), with the format in\n"
      "which they are believed to be: faults of the format are then stated in its words.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Fewer than three views.");
  m.def(
      "diagnose_hand_eye",
      [](const Eigen::MatrixXd& rows, const PoseFormat& format, const std::vector<kr5::View>& views,
         const kr5::Pinhole& camera, Mount mount, const HandEyeResult& result, const std::vector<double>& times,
         const HandEyeDiagnosisOptions& options) {
        return diagnose_hand_eye({rows, format, views, times, camera, mount}, result, options);
      },
      py::arg("rows"), py::arg("format"), py::arg("views"), py::arg("camera"), py::arg("mount"), py::arg("result"),
      py::arg("times") = std::vector<double>{}, py::arg("options") = HandEyeDiagnosisOptions(),
      py::call_guard<py::gil_scoped_release>());
  m.def(
      "diagnose_hand_eye_pairs",
      [](const std::vector<PosePair>& pairs, const HandEyeResult& result, const std::vector<double>& times,
         const HandEyeDiagnosisOptions& options) {
        HandEyePairsRecording recording = HandEyePairsRecording::from_pairs(pairs, result.mount);
        recording.times = times;
        return diagnose_hand_eye_pairs(recording, result, options);
      },
      py::arg("pairs"), py::arg("result"), py::arg("times") = std::vector<double>{},
      py::arg("options") = HandEyeDiagnosisOptions(), py::call_guard<py::gil_scoped_release>(),
      "Evaluates the result of calibrate_hand_eye_pairs and searches for faults of the pairs (list of PosePair, those\n"
      "that calibrate_hand_eye_pairs took). The other form takes the robot's poses as its controller wrote them.");
  m.def(
      "diagnose_hand_eye_pairs",
      [](const Eigen::MatrixXd& rows, const PoseFormat& format, const std::vector<kr5::Pose>& T_camera_target,
         Mount mount, const HandEyeResult& result, const std::vector<std::string>& names,
         const std::vector<double>& times, const HandEyeDiagnosisOptions& options) {
        return diagnose_hand_eye_pairs({rows, format, T_camera_target, names, times, mount}, result, options);
      },
      py::arg("rows"), py::arg("format"), py::arg("T_camera_target"), py::arg("mount"), py::arg("result"),
      py::arg("names") = std::vector<std::string>{}, py::arg("times") = std::vector<double>{},
      py::arg("options") = HandEyeDiagnosisOptions(), py::call_guard<py::gil_scoped_release>());
}

void bind_calibration(py::module_& m) {
  m.doc() = "Hand-eye, tool, arm, scanner and clock calibration, and their evaluation.";
  bind_pose_format(m);
  bind_hand_eye(m);
  bind_hand_eye_pairs(m);
  bind_dataset(m);
  bind_diagnosis(m);
  bind_evaluation(m);
  bind_pose_convention(m);
  bind_target_size(m);
  bind_tool(m);
  bind_timed_hand_eye(m);
  bind_kinematics_calibration(m);
  bind_posture_checks(m);
  bind_further_postures(m);
  bind_circle_point(m);
  bind_parallel_planes(m);
  bind_turn_split(m);
  bind_arm_axes(m);
  bind_upright_lengths(m);
  bind_posture_choice(m);
  bind_profiles(m);
  bind_scan_error(m);
  bind_scanner(m);
  bind_cell_calibration(m);
  bind_repeatability(m);
}
