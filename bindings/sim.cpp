// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/functional.h>

#include <kr5/sim/bin_image.hpp>
#include <kr5/sim/bin_rays.hpp>
#include <kr5/sim/bin_scan.hpp>
#include <kr5/sim/cell_robot.hpp>
#include <kr5/sim/cup_seat.hpp>
#include <kr5/sim/dart_simulator.hpp>
#include <kr5/sim/driven_arm.hpp>
#include <kr5/sim/insertion.hpp>
#include <kr5/sim/insertion_options.hpp>
#include <kr5/sim/pellet_bin.hpp>
#include <kr5/sim/scene.hpp>
#include <kr5/sim/work_cell.hpp>

#include "effect_conversion.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::sim;
using kr5::python::bind_enum;
using kr5::python::bind_struct;

using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Steps an arm once a row and reads it after each: motor-side positions, currents, wrenches.
template <class Step>
static py::tuple each_row(DrivenArm& arm, const Rows& rows, Step step) {
  Rows q(rows.rows(), rows.cols()), current(rows.rows(), arm.drives().motors ? rows.cols() : 0);
  Rows wrench(rows.rows(), 6);
  {
    const py::gil_scoped_release free;
    for (Eigen::Index k = 0; k < rows.rows(); ++k) {
      step(Eigen::VectorXd(rows.row(k)));
      const ArmReading& now = arm.read();
      q.row(k) = now.position;
      if (current.cols() > 0) current.row(k) = now.current;
      wrench.row(k) = now.wrench;
    }
  }
  return py::make_tuple(q, current, wrench);
}

static void bind_arm(py::module_& m) {
  bind_struct<DrivenArmOptions>(m, "DrivenArmOptions", "Step and current limits of an arm.");
  py::class_<ArmReading>(m, "ArmReading",
                         "State of drives and sensor at one instant, without noise and sensor effects.")
      .def_readonly("t", &ArmReading::t, "Time [s].")
      .def_readonly("limited", &ArmReading::limited, "True when a motor was at its current limit in the last step.")
      .def_property_readonly(
          "position", [](const ArmReading& r) { return r.position; }, "Position, motor side [rad or m].")
      .def_property_readonly(
          "velocity", [](const ArmReading& r) { return r.velocity; }, "Speed, motor side [rad/s or m/s].")
      .def_property_readonly(
          "acceleration", [](const ArmReading& r) { return r.acceleration; },
          "Acceleration, motor side [rad/s^2 or m/s^2].")
      .def_property_readonly(
          "link", [](const ArmReading& r) { return r.link; }, "True joint values [rad or m].")
      .def_property_readonly(
          "torque", [](const ArmReading& r) { return r.torque; }, "Torque through the gears [N m or N].")
      .def_property_readonly(
          "current", [](const ArmReading& r) { return r.current; }, "Current of the motors [A].")
      .def_property_readonly(
          "wrench", [](const ArmReading& r) { return r.wrench; }, "Wrench on the sensor, in S [N, N m].");
  py::class_<DrivenArm>(m, "DrivenArm", "Arm of a cell with motors, gears and joint servos, stepped through time.")
      .def(py::init<const kr5::cell::Cell&, const DrivenArmOptions&>(), py::arg("cell"),
           py::arg("options") = DrivenArmOptions{})
      .def_property_readonly("step", &DrivenArm::step, "Step of the integration [s].")
      .def("stable_step", &DrivenArm::stable_step, py::arg("position"),
           "Largest stable step of the gears at this position [s].")
      .def("reset", &DrivenArm::reset, py::arg("position"), py::arg("t") = 0.0,
           "Resets the arm to rest at motor-side joint values.")
      .def("follow", &DrivenArm::follow, py::arg("command"), "One step with ideal joint servos.")
      .def("follow_limited", &DrivenArm::follow_limited, py::arg("command"),
           "One step with joint servos within the current limit.")
      .def("drive", &DrivenArm::drive, py::arg("current"), "One step under motor currents [A].")
      .def(
          "follow_rows",
          [](DrivenArm& arm, const Rows& commands) {
            return each_row(arm, commands, [&](const Eigen::VectorXd& command) { arm.follow(command); });
          },
          py::arg("commands"),
          "One step of `follow` for each row; returns (positions, currents, wrenches), one row per step.")
      .def(
          "drive_rows",
          [](DrivenArm& arm, const Rows& currents) {
            return each_row(arm, currents, [&](const Eigen::VectorXd& current) { arm.drive(current); });
          },
          py::arg("currents"),
          "One step of `drive` for each row; returns (positions, currents, wrenches), one row per step.")
      .def("read", &DrivenArm::read, py::return_value_policy::copy, "State at the present instant.")
      .def("energy", &DrivenArm::energy, "Energy of links, rotors and gear springs [J].");
}

static void bind_cell_robot(py::module_& m) {
  bind_struct<CellRobotOptions>(m, "CellRobotOptions", "Options of CellRobot.");
  py::class_<CellRobot, kr5::robot::Robot>(
      m, "CellRobot",
      "The arm of a cell with servos, gears, links, encoders and wrist sensor, with the effects of the cell, as the "
      "other end of a controller: read, step, send, once a cycle.")
      .def(py::init<const kr5::cell::Cell&, const CellRobotOptions&>(), py::arg("cell"),
           py::arg("options") = CellRobotOptions{})
      .def("set_environment", &CellRobot::set_environment, py::arg("environment"),
           "Function of T_base_sensor, velocity of the sensor in B and time, to the wrench of the environment on the "
           "tool at the origin of S, in B [N, N m].")
      .def("actual", &CellRobot::actual, py::return_value_policy::copy,
           "State of drives and links as it really is, which no controller knows.")
      .def_property_readonly("gripper", &CellRobot::gripper, py::return_value_policy::copy, "State of the gripper.");
}

static void bind_scene(py::module_& m) {
  bind_enum<Statistic>(m, "Statistic", "Statistic of the rows of a column.");
  bind_struct<Expectation>(m, "Expectation", "Expectation on a column of a scene.");
  bind_struct<SceneCheck>(m, "SceneCheck", "Result of an expectation.");
  bind_struct<ScenePictures>(m, "ScenePictures", "Pictures that the camera of a scene takes.");
  bind_struct<SceneScan>(m, "SceneScan", "Profiles that the line scanner of a scene takes.");
  bind_struct<WayPoint>(m, "WayPoint", "Place on the way of an arm: joint values, or a pose of its tool or camera.");
  bind_enum<ControllerKind>(m, "ControllerKind", "Kind of the controller of a scene.");
  bind_struct<Controller>(m, "Controller", "Controller of a scene.");
  bind_struct<Objects>(m, "Objects", "Objects that the arm of a scene can touch or see.");
  bind_struct<SceneEvent>(m, "SceneEvent", "Change of the effects during a scene.");
  bind_struct<Scene>(m, "Scene", "Cell, objects, controller, duration and expected results (kr5-scene/1).");
  bind_struct<ScenePicture>(m, "ScenePicture", "Picture of a scene: camera pose and the scene before the camera.");
  py::class_<SceneResult>(m, "SceneResult", "Result of a scene.")
      .def_readonly("passed", &SceneResult::passed, "True when every expectation is met.")
      .def_readonly("steps", &SceneResult::steps, "Steps of the integration.")
      .def_property_readonly(
          "checks", [](const SceneResult& r) { return r.checks; }, "Result of each expectation (a copy).")
      .def_property_readonly(
          "rows", [](const SceneResult& r) { return r.rows; }, "Rows, one per cycle (a copy).")
      .def_property_readonly(
          "cell", [](const SceneResult& r) { return r.cell; },
          "Cell with its effects at the end of the scene (a copy).")
      .def_property_readonly(
          "solids", [](const SceneResult& r) { return r.solids; }, "Solids of the scene, including its bench (copies).")
      .def_property_readonly(
          "camera", [](const SceneResult& r) { return r.camera; }, "Options of the pictures, or None.")
      .def_property_readonly(
          "pictures", [](const SceneResult& r) { return r.pictures; },
          "Camera pose and scene of each picture, for kr5.vision.render (copies).")
      .def_property_readonly(
          "profiles", [](const SceneResult& r) { return r.profiles; },
          "Profiles of the scanner, with the columns of the kind `scan` (a copy).");
  m.def("load_scene", &load_scene, py::arg("file"), "Reads a scene file. IoError names file, line and field.");
  m.def(
      "run_scene", [](const std::filesystem::path& file) { return run_scene(file); }, py::arg("file"),
      py::call_guard<py::gil_scoped_release>(),
      "Runs a scene file (kr5-scene/1) and evaluates its expectations. Exceptions name file and field.");
}

static void bind_insertion(py::module_& m) {
  bind_enum<Strategy>(m, "Strategy", "Strategy by which the hole is found.");
  bind_struct<InsertionSetup>(m, "InsertionSetup", "Task of an insertion, and the uncertainty of the cell.");
  bind_struct<PegOutcome>(m, "PegOutcome", "Outcome of one peg.");
  py::class_<InsertionResult>(m, "InsertionResult", "Result of an insertion.")
      .def_readonly("inserted", &InsertionResult::inserted, "True when every peg is inserted.")
      .def_readonly("time", &InsertionResult::time, "Time of all pegs, including the motions between them [s].")
      .def_property_readonly(
          "pegs", [](const InsertionResult& r) { return r.pegs; }, "Outcome of each peg (copies).")
      .def_property_readonly(
          "rows", [](const InsertionResult& r) { return r.rows; },
          "Rows, one per cycle: t; peg, phase (index in kr5.force.Phase), attempt; x y z tilt azimuth of the peg "
          "according to the arm, in T; fx..tz on the peg, unfiltered, in T; true_x true_y true_z true_tilt of the peg "
          "in the actual tube; q1..n [s, m, rad, N, N m]. Empty without `log` (a copy).")
      .def_property_readonly(
          "profile", [](const InsertionResult& r) { return r.profile; },
          "Profile of the last turn: azimuth, tilt, x, y, height as measured; closed_form, the height at the true "
          "position of the peg; force, moment_x, moment_y about its bottom centre [rad, m, N, N m] (a copy).")
      .def_property_readonly(
          "T_tube_actual", [](const InsertionResult& r) { return r.T_tube_actual; },
          "True pose of the tube in its assumed frame [m].")
      .def_property_readonly(
          "cell", [](const InsertionResult& r) { return r.cell; },
          "Setup of the run, with bore and position of the tube (a copy).");
  m.def("insertion_options", &insertion_options, py::arg("cell"), py::arg("setup") = InsertionSetup{},
        "Options of kr5.force.Insertion for a cell: bodies, servo and grip as the cell states them. Exceptions name a "
        "missing part.");
  m.def(
      "run_insertion",
      [](const kr5::cell::Cell& cell, const InsertionSetup& setup,
         const std::optional<kr5::force::InsertionOptions>& options) {
        return run_insertion(cell, setup, options ? *options : insertion_options(cell, setup));
      },
      py::arg("cell"), py::arg("setup") = InsertionSetup{}, py::arg("options") = py::none(),
      py::call_guard<py::gil_scoped_release>(),
      "Inserts pegs in the simulated cell. The tube stands where it is believed unless `setup.offset` says otherwise; "
      "`kr5 insert` draws the offset from its seed. An insertion that fails is an outcome, with phase and reason; "
      "exceptions name the field of an invalid setup or option, or the missing part of the cell.");
}

/// Progress for Python, which hears Ctrl-C meanwhile also without a callback.
static PileProgress heard(std::function<void(double)> callback) {
  return [callback = std::move(callback)](double share) {
    const py::gil_scoped_acquire held;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (callback) callback(share);
  };
}

static py::array_t<double> poses_array(const std::vector<kr5::Pose>& poses) {
  py::array_t<double> out({static_cast<py::ssize_t>(poses.size()), py::ssize_t{4}, py::ssize_t{4}});
  auto view = out.mutable_unchecked<3>();
  for (std::size_t k = 0; k < poses.size(); ++k)
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 4; ++c) view(static_cast<py::ssize_t>(k), r, c) = poses[k].matrix()(r, c);
  return out;
}

static void bind_pile(py::module_& m) {
  bind_struct<BinShape>(m, "BinShape", "An open box with four walls: origin at the centre of the inner floor, Z up.");
  bind_struct<Pellet>(m, "Pellet", "A solid cylinder: origin in its middle, Z along its axis.");
  bind_struct<PelletScene>(m, "PelletScene", "A bin with pellets.");
  bind_struct<PileOptions>(m, "PileOptions", "Bodies and steps of a simulated pile.");
  bind_struct<PourOptions>(m, "PourOptions", "What is poured into a bin.");
  bind_struct<PileState>(m, "PileState", "How a pile came to rest.");
  bind_struct<SettledPile>(m, "SettledPile", "A pile with the pellets where they came to rest.");
  bind_struct<RemovalOptions>(m, "RemovalOptions", "How a suction gripper pulls a pellet out of the pile.");
  bind_struct<Removal>(m, "Removal", "What picking a pellet did.");
  m.def(
      "pour_pellets",
      [](const BinShape& bin, const PourOptions& pour, const PileOptions& options,
         std::function<void(double)> progress) { return pour_pellets(bin, pour, options, heard(std::move(progress))); },
      py::arg("bin"), py::arg("pour") = PourOptions{}, py::arg("options") = PileOptions{},
      py::arg("progress") = py::none(), py::call_guard<py::gil_scoped_release>(),
      "Pours pellets of random height and orientation into a bin and lets them settle. The same seed gives the same "
      "pile. `progress` is called with the share of the work done, 0 to 1. InvalidArgument names the field, also when "
      "the pellets do not fit below the rim.");
  m.def(
      "settle",
      [](const PelletScene& scene, const PileOptions& options, std::function<void(double)> progress) {
        return settle(scene, options, heard(std::move(progress)));
      },
      py::arg("scene"), py::arg("options") = PileOptions{}, py::arg("progress") = py::none(),
      py::call_guard<py::gil_scoped_release>(),
      "Lets the pellets of a scene fall from where they are until they lie still.");
  m.def("remove_pellet", &remove_pellet, py::arg("scene"), py::arg("pellet"), py::arg("approach"),
        py::arg("removal") = RemovalOptions{}, py::arg("options") = PileOptions{},
        py::call_guard<py::gil_scoped_release>(),
        "Pulls pellet number `pellet` out of the pile with a suction cup of limited force: along `approach` (shape "
        "(3,), in the bin, out of the surface), then up. What it touches moves, what loses its support settles again.");
  m.def("deepest_overlap", &deepest_overlap, py::arg("scene"),
        "Deepest overlap of two pellets, or of a pellet and the bin, by points on all surfaces; 0: none [m].");
  m.def("exposed_shares", &exposed_shares, py::arg("scene"), py::arg("spacing") = 2.5e-4,
        "Share of each pellet that is seen from above, shape (n,) [-]: the area of its projection along Z of the bin "
        "that no other pellet hides, over the whole; by vertical rays `spacing` apart [m].");
}

static void bind_bin_scan(py::module_& m) {
  m.attr("BIN_WALL") = py::int_(static_cast<int>(BinWall));
  m.attr("BIN_FLOOR") = py::int_(static_cast<int>(BinFloor));
  m.attr("BIN_NOTHING") = py::int_(static_cast<int>(BinNothing));
  bind_struct<BinScannerOptions>(m, "BinScannerOptions",
                                 "A triangulating line scanner: laser in the origin of its frame, its fan in the X-Z "
                                 "plane about Z, the receiver on Y.");
  bind_struct<ScanPath>(m, "ScanPath", "Poses of the flange over time.");
  py::class_<BinScan>(m, "BinScan",
                      "Profiles with the poses of the arm at their time stamps, and what each point is of.")
      .def_property_readonly(
          "x", [](const BinScan& s) { return s.x; },
          "X in the frame of the scanner, shape (profiles, points), NaN without a reading [m].")
      .def_property_readonly(
          "z", [](const BinScan& s) { return s.z; },
          "Z in the frame of the scanner, shape (profiles, points), NaN without a reading [m].")
      .def_property_readonly(
          "surface", [](const BinScan& s) { return s.surface; },
          "What each point is of, shape (profiles, points): number of the pellet, BIN_WALL, BIN_FLOOR, or BIN_NOTHING "
          "for no reading and for a false one.")
      .def_property_readonly(
          "times", [](const BinScan& s) { return s.times; }, "Stamps of the profiles, shape (profiles,) [s].")
      .def_property_readonly(
          "T_base_flange", [](const BinScan& s) { return poses_array(s.T_base_flange); },
          "Poses that the arm reports at these times, shape (profiles, 4, 4) [m].")
      .def_property_readonly(
          "T_flange_scanner", [](const BinScan& s) { return s.T_flange_scanner; }, "Scanner in the flange [m].")
      .def_property_readonly(
          "seen", [](const BinScan& s) { return s.seen; },
          "Share of each pellet that the scan sees, shape (pellets,) [-]: rays that laser and receiver see on it, over "
          "those they would see on it alone; shiny spots count as seen.")
      .def(
          "cloud",
          [](const BinScan& s) {
            std::vector<int> surfaces;
            auto points = s.cloud(&surfaces);
            return py::make_tuple(points, py::array_t<int>(static_cast<py::ssize_t>(surfaces.size()), surfaces.data()));
          },
          "Readings in the base, shape (n, 3) [m], and what each is of, shape (n,).")
      .def("origins", &BinScan::origins,
           "Place of the laser in the base for each reading of `cloud`, shape (n, 3) [m].");
  m.def("scan_path", &scan_path, py::arg("bin"), py::arg("scanner") = BinScannerOptions{},
        "A straight pass over a bin along its Y, the scanner level and looking down, its X along that of the bin.");
  m.def(
      "scan_bin",
      [](const PelletScene& scene, const ScanPath& path, const BinScannerOptions& scanner) {
        return scan_bin(scene, path, scanner);
      },
      py::arg("scene"), py::arg("path"), py::arg("scanner") = BinScannerOptions{},
      py::call_guard<py::gil_scoped_release>(),
      "Scans a bin: a profile at each time of a path. A profile with a delay was taken that much earlier, at a pose "
      "interpolated on the path.");
}

static void bind_bin_image(py::module_& m) {
  bind_struct<BinImageOptions>(m, "BinImageOptions", "Light and surfaces of a picture of pellets in a bin.");
  m.def("camera_above", &camera_above, py::arg("bin"), py::arg("height"),
        "Pose in the base of a camera above the middle of a bin, looking straight down, its X along that of the bin; "
        "`height` above the floor [m].");
  m.def(
      "render_bin",
      [](const PelletScene& scene, const kr5::Pinhole& camera, const kr5::Pose& T_base_camera,
         const BinImageOptions& options) {
        BinImage image;
        {
          const py::gil_scoped_release free;
          image = render_bin(scene, camera, T_base_camera, options);
        }
        return py::make_tuple(image.grey, image.surface);
      },
      py::arg("scene"), py::arg("camera"), py::arg("T_base_camera"), py::arg("options") = BinImageOptions{},
      "Renders a bin by one lamp with shadows: grey levels, uint8 of shape (height, width), and what each pixel shows, "
      "int of the same shape: number of the pellet, BIN_WALL, BIN_FLOOR or BIN_NOTHING.");
}

static void bind_work_cell_structs(py::module_& m) {
  bind_enum<ScanPlace>(m, "ScanPlace", "Place where pellets are looked for.");
  bind_enum<PelletPlace>(m, "PelletPlace", "Place where a pellet of a work cell is.");
  bind_struct<GripOptions>(m, "GripOptions", "How one of the grippers of a work cell holds.");
  bind_struct<CupSeat>(m, "CupSeat", "The rim of a suction cup on the surface of a pellet.")
      .def("within_reach", &CupSeat::within_reach, py::arg("cup"), "Whether the cup touches the pellet.")
      .def("sealed", &CupSeat::sealed, py::arg("cup"),
           "Whether the cup touches the pellet squarely enough to hold it.");
  m.def("nearest_cup_seat", &nearest_cup_seat, py::arg("scene"), py::arg("T_bin_tool"),
        "Seat of a suction cup on the pellet of a scene whose surface is nearest; the origin of the tool is the middle "
        "of the rim, Z points out of the cup.");
  bind_struct<StandShape>(m, "StandShape", "A plate on which pellets are put down.");
  bind_struct<WorkCellErrors>(m, "WorkCellErrors",
                              "Differences between a work cell and what its controller is told; standard deviations "
                              "are drawn once a cell.");
  m.def("severe_errors", &severe_errors,
        "Errors of servo, friction, radii and force sensor beside the usual ones of a work cell.");
  bind_struct<WorkCellOptions>(m, "WorkCellOptions", "What stands in a work cell, and how it differs from its model.");
  bind_struct<PelletTruth>(m, "PelletTruth", "Where a pellet of a work cell is.");
  bind_struct<WorkCellTruth>(m, "WorkCellTruth", "What is so in a work cell, whatever its sensors say.");
  py::class_<WorkCellState>(m, "WorkCellState", "The whole state of a work cell between two cycles.")
      .def(
          "save", [](const WorkCellState& self, const std::filesystem::path& file) { save_state(self, file); },
          py::arg("file"), "Writes the state in one go. IoError names the file.")
      .def_static("load", &load_state, py::arg("file"),
                  "Reads a state. IoError names a file that is not there, or is no state of a work cell.");
}

static void bind_work_cell(py::module_& m) {
  bind_work_cell_structs(m);
  py::class_<WorkCell>(m, "WorkCell",
                       "A simulated work cell for the way of pellets from a bin to tubes: arm, force/torque sensor, "
                       "suction cup and fingers, scanner and camera; read, step, send, once a cycle.")
      .def(py::init<const kr5::cell::Cell&, const WorkCellOptions&>(), py::arg("cell"),
           py::arg("options") = WorkCellOptions{}, py::call_guard<py::gil_scoped_release>())
      .def_property_readonly("believed", &WorkCell::believed, py::return_value_policy::copy,
                             "Cell as its controller is told it is (a copy).")
      .def_property_readonly("options", &WorkCell::options, py::return_value_policy::copy, "Options (a copy).")
      .def_property_readonly("cycle", &WorkCell::cycle, "Time between two readings [s].")
      .def("place", &WorkCell::place, py::arg("joints"),
           "Stands at joint values, at rest, with no command on its way [rad or m].")
      .def("read", &WorkCell::read, "Reading of this cycle.")
      .def("send", &WorkCell::send, py::arg("command"), py::call_guard<py::gil_scoped_release>(),
           "Command of this cycle, which ends it.")
      .def("start_scan", &WorkCell::start_scan, "Takes a profile each cycle from now on.")
      .def("finish_scan", &WorkCell::finish_scan, py::arg("place"), py::call_guard<py::gil_scoped_release>(),
           "Profiles over the real motion, with the poses that the arm reported.")
      .def(
          "profile",
          [](WorkCell& self) {
            const Profile profile = self.profile();
            return py::make_tuple(profile.x, profile.z);
          },
          "Profile of the line scanner of the cell on stand and tubes at this instant: x and z in its own frame, NaN "
          "without a reading [m].")
      .def(
          "bin_picture",
          [](const WorkCell& self, const BinImageOptions& options) { return self.bin_picture(options).grey; },
          py::arg("options") = BinImageOptions{},
          "Picture of the bin by the camera of the cell, uint8 of shape (height, width).")
      .def("picture", &WorkCell::picture, "What the camera has before it besides pellets, for kr5.vision.render.")
      .def("truth", &WorkCell::truth, "What is so in the cell. Not for controllers.")
      .def("state", &WorkCell::state, "The whole state, after a command and before the next reading.")
      .def("restore", &WorkCell::restore, py::arg("state"),
           "Goes on from a state of a cell of the same options. InvalidArgument names the field that does not fit.");
}

void bind_sim(py::module_& m) {
  bind_enum<ContactBy>(m, "ContactBy", "Method that finds the contacts of peg, tube and bench.");
  bind_struct<DartSimulatorOptions>(m, "DartSimulatorOptions", "Step of the integration.");
  py::class_<DartSimulator, kr5::cell::Simulator>(
      m, "DartSimulator", "Full simulator: arm, drives and contacts stepped through time in DART.")
      .def(py::init<const DartSimulatorOptions&>(), py::arg("options") = DartSimulatorOptions{})
      .def("__repr__", [](const DartSimulator&) { return "DartSimulator()"; });
  bind_arm(m);
  bind_cell_robot(m);
  bind_scene(m);
  bind_insertion(m);
  bind_pile(m);
  bind_bin_scan(m);
  bind_bin_image(m);
  bind_work_cell(m);
}
