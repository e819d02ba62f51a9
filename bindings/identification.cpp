// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/identification/base_parameters.hpp>
#include <kr5/identification/contact_stiffness.hpp>
#include <kr5/identification/current_limits.hpp>
#include <kr5/identification/current_model.hpp>
#include <kr5/identification/drives.hpp>
#include <kr5/identification/dynamics.hpp>
#include <kr5/identification/excitation.hpp>
#include <kr5/identification/force_loop_design.hpp>
#include <kr5/identification/force_torque.hpp>
#include <kr5/identification/gravity_model.hpp>
#include <kr5/identification/joint_elasticity.hpp>
#include <kr5/identification/joint_motion.hpp>
#include <kr5/identification/keep_out.hpp>
#include <kr5/identification/log_conditioning.hpp>
#include <kr5/identification/payload.hpp>
#include <kr5/identification/planar_gravity.hpp>
#include <kr5/identification/servo.hpp>
#include <kr5/identification/torque_smoothing.hpp>
#include <kr5/identification/zero_phase.hpp>
#include <kr5/physics/identified_cell.hpp>

#include "python_simulator.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::identification;
using kr5::python::bind_enum;
using kr5::python::bind_struct;

namespace {

void bind_logs(py::module_& m) {
  bind_enum<LogFault>(m, "LogFault", "What may be wrong with a log.");
  bind_enum<LogSeverity>(m, "LogSeverity", "What a finding means for an estimate.");
  bind_enum<SpeedSource>(m, "SpeedSource", "Where speeds come from.");
  bind_enum<ClockModel>(m, "ClockModel", "What time stamps of uneven steps mean.");
  bind_struct<JointLog>(m, "JointLog", "What a controller logged of a motion, as it came.");
  bind_struct<LogFinding>(m, "LogFinding", "One thing that is wrong with a log.");
  bind_struct<ConditioningOptions>(m, "ConditioningOptions", "Options of condition_log and check_log.");
  bind_struct<ConditionedMotion>(m, "ConditionedMotion", "A motion to estimate from, and the faults of its log.")
      .def_property_readonly("usable", &ConditionedMotion::usable, "Whether there is a motion to estimate from.");
  m.def("split_log", &split_log, py::arg("log"), py::arg("last"),
        "The log before its last part, and that part, a share of its span of time.");
  m.def("check_log", &check_log, py::arg("log"), py::arg("options") = ConditioningOptions{},
        "The faults of a log, errors first; empty for a sound one.");
  m.def("condition_log", &condition_log, py::arg("log"), py::arg("options") = ConditioningOptions{},
        "The motion of a log: clock repaired, smoothed without delay, speeds and accelerations by central differences, "
        "decimated (Hayat et al. 2022, section 4.4.3.2). Empty when the log has an error.");
  m.def(
      "conditioning_like",
      [](const std::vector<ConditionedMotion>& motions, const ConditioningOptions& options) {
        return conditioning_like(motions, options);
      },
      py::arg("motions"), py::arg("options") = ConditioningOptions{},
      "Options by which further logs are conditioned as these were: the medians of their cutoffs and decimations, "
      "where\n"
      "the options leave both to the log.");
  bind_struct<TorqueSmoothing>(m, "TorqueSmoothing", "Whether torques are smoothed, and how well both ways predict.");
  m.def(
      "choose_torque_smoothing",
      [](const std::vector<JointLog>& logs, const ConditioningOptions& options, const DynamicsModel& model) {
        return choose_torque_smoothing(logs, options, model);
      },
      py::arg("logs"), py::arg("options"), py::arg("model"), py::call_guard<py::gil_scoped_release>(),
      "Whether torques are fitted smoothed or as they were logged: as the last third of each log is predicted better "
      "from\nthe rest.");
  m.def("motion_bandwidth", &motion_bandwidth, py::arg("q"), py::arg("step"),
        "Frequency below which 99 % of the power of the speeds lies [Hz]; q: samples x joints at even steps [s].");
  m.def("zero_phase_low_pass", &zero_phase_low_pass, py::arg("values"), py::arg("step"), py::arg("cutoff"),
        py::arg("order") = 4,
        "Zero-phase Butterworth low-pass of each column, run forward and backward; step [s], cutoff [Hz].");
  m.def("central_differences", &central_differences, py::arg("values"), py::arg("step"),
        "First derivative of each column by central differences; step [s].");
  m.def("second_differences", &second_differences, py::arg("values"), py::arg("step"),
        "Second derivative of each column by central differences; step [s].");
}

void bind_drives(py::module_& m) {
  bind_struct<DriveReadings>(m, "DriveReadings", "Readings of encoders and joints, a row a posture.");
  bind_struct<DriveOptions>(m, "DriveOptions", "Options of identify_drives.");
  bind_struct<DriveOutlier>(m, "DriveOutlier", "A reading that contradicts the others.");
  bind_struct<DriveCoupling>(m, "DriveCoupling", "An element of the structure matrix beside its diagonal.");
  bind_struct<UnseenCoupling>(m, "UnseenCoupling", "An element of the structure matrix that the readings cannot show.");
  bind_struct<DriveResult>(m, "DriveResult", "Structure matrix of the drives with its couplings.");
  m.def("identify_drives", &identify_drives, py::arg("readings"), py::arg("options") = DriveOptions{},
        "Structure matrix, counts per turn and couplings from encoder counts and joint angles (Hayat et al. 2022, eq. "
        "4.44 to 4.54).");
  bind_struct<CurrentModelOptions>(m, "CurrentModelOptions", "Options of identify_current_model.");
  bind_struct<CurrentModel>(m, "CurrentModel", "Current of a joint over its torque, with hysteresis (eq. 5.8).")
      .def("current", &CurrentModel::current, py::arg("torque"), py::arg("speed"),
           "Current that a torque asks for at a speed [A].")
      .def("torque", &CurrentModel::torque, py::arg("current"), py::arg("speed"),
           "Torque that a current gives at a speed [N m or N].");
  m.def("identify_current_model", &identify_current_model, py::arg("current"), py::arg("torque"), py::arg("speed"),
        py::arg("options") = CurrentModelOptions{},
        "Torque constant, offset and hysteresis of a joint by least squares (Hayat et al. 2022, eq. 5.8).");
}

}  // namespace

static void bind_carried_masses(py::module_& m) {
  using kr5::python::bind_struct;
  bind_struct<CarriedMass>(m, "CarriedMass", "Mass that a joint carries.");
  m.def(
      "carried_masses",
      [](const kr5::kinematics::DhChain& chain, const std::vector<kr5::kinematics::Body>& bodies,
         const Eigen::VectorXd& q) { return carried_masses(chain, bodies, q); },
      py::arg("chain"), py::arg("bodies"), py::arg("q"),
      "Backward recursion of the static mass moment over the links (Hayat et al. 2022, eqs. 5.1 to 5.4), one a joint,\n"
      "for joint values q [rad or m].");
  m.def(
      "holding_torques",
      [](const kr5::kinematics::DhChain& chain, const std::vector<CarriedMass>& carried, const Eigen::VectorXd& q,
         const Eigen::Vector3d& gravity) { return holding_torques(chain, carried, q, gravity); },
      py::arg("chain"), py::arg("carried"), py::arg("q"), py::arg("gravity") = Eigen::Vector3d(0.0, 0.0, -9.81),
      "Torques that hold these masses [N m or N]; gravity in B [m/s^2].");
}

static void bind_gravity(py::module_& m) {
  using kr5::python::bind_struct;
  bind_struct<GravityOptions>(m, "GravityOptions", "Options of identify_gravity.");
  bind_struct<GravityPrediction>(m, "GravityPrediction", "Torques that hold a posture.");
  bind_struct<GravityModel>(m, "GravityModel", "Mass moments of an arm that its joint torques determine.")
      .def("predict", &GravityModel::predict, py::arg("q"), "Torques that hold the posture q [rad or m].")
      .def(
          "bodies",
          [](const GravityModel& self, const std::vector<kr5::kinematics::Body>& nominal) {
            return self.bodies(nominal);
          },
          py::arg("nominal"),
          "The given bodies, one a link, with the first moments of the model; masses that it does not determine stay.");
  bind_struct<GravityResult>(m, "GravityResult", "Identified gravity with friction and errors.");
  m.def("identify_gravity", &identify_gravity, py::arg("chain"), py::arg("motion"),
        py::arg("options") = GravityOptions{}, py::call_guard<py::gil_scoped_release>(),
        "Identifies the mass moments of any arm from slow motions, friction separated by the two directions (Hayat et "
        "al.\n"
        "2022, section 5.2).");
}

static void bind_postures(py::module_& m) {
  m.def("identify_gravity_at_rest", &identify_gravity_at_rest, py::arg("chain"), py::arg("q"), py::arg("tau"),
        py::arg("options") = GravityOptions{}, py::call_guard<py::gil_scoped_release>(),
        "Identifies the mass moments of any arm from postures at rest, samples x joints each [rad or m], [N m or N]. "
        "Friction, whose direction is not known there, is part of the residuals, so that postures are best approached "
        "from all sides.");
  m.def(
      "are_postures", &are_postures, py::arg("q"), py::arg("timed") = true,
      "Whether rows of joint values (samples x joints) are postures one after the other rather than samples of a "
      "motion: from row to row they jump by more than 0.05 rad or m, and, where they have times, now here, now there.");
}

static void bind_planar_gravity(py::module_& m) {
  using kr5::python::bind_struct;
  bind_struct<GravityAngle>(m, "GravityAngle", "Angle of which the gravity torque of a joint is a harmonic.");
  m.def(
      "gravity_angles", &gravity_angles, py::arg("chain"), py::arg("q"),
      py::arg("gravity") = Eigen::Vector3d(0.0, 0.0, -9.81),
      "The largest set of joints whose axes are horizontal and parallel at q, the joint nearest to the flange first.");
  bind_struct<GravityHarmonic>(m, "GravityHarmonic", "Gravity torque of one joint.");
  bind_struct<PlanarGravity>(m, "PlanarGravity", "Gravity of an arm in a plane.")
      .def("predict", &PlanarGravity::predict, py::arg("q"), "Torques of its joints in their order for q [rad].");
  m.def(
      "identify_planar_gravity",
      [](const JointMotion& motion, const std::vector<GravityAngle>& angles, const GravityOptions& options) {
        const py::gil_scoped_release released;
        return identify_planar_gravity(motion, angles, options);
      },
      py::arg("motion"), py::arg("angles"), py::arg("options") = GravityOptions{},
      "Fits one harmonic a joint to slow motions, the joint nearest to the flange first (Hayat et al. 2022, eqs. 5.5\n"
      "to 5.7).");
}

static void bind_passive_limits(py::module_& m) {
  using kr5::python::bind_struct;
  bind_struct<PassiveLimitOptions>(m, "PassiveLimitOptions", "Options of passive_limits.");
  bind_struct<PassiveLimits>(m, "PassiveLimits", "Current limits with which an obstructed arm gives way.");
  m.def(
      "passive_limits",
      [](const GravityModel& model, const Eigen::VectorXd& coulomb, const kr5::cell::Cell& cell,
         const Eigen::MatrixXd& postures, const PassiveLimitOptions& options) {
        kr5::require(cell.drives.has_value(), "cell.drives: the cell has none, so torques have no currents");
        return passive_limits(model, coulomb, kr5::physics::Motors(cell), postures, options);
      },
      py::arg("model"), py::arg("coulomb"), py::arg("cell"), py::arg("postures"),
      py::arg("options") = PassiveLimitOptions{},
      "Current limits a margin above what gravity and friction take in all postures (rows, [rad or m]), and the "
      "contact\n"
      "forces at which the arm gives way (Hayat et al. 2022, section 5.2). `coulomb`: half the width of the "
      "hysteresis\n"
      "of each joint [N m or N]; gears and motors are those of the cell.");
}

static void bind_excitation(py::module_& m) {
  using kr5::python::bind_enum;
  using kr5::python::bind_struct;
  bind_enum<ExcitationKind>(m, "ExcitationKind", "Kind of an exciting motion.");
  bind_enum<ExcitationProfile>(m, "ExcitationProfile", "Profile of a motion from point to point.");
  bind_enum<ExcitationCriterion>(m, "ExcitationCriterion", "What a design makes good.");
  bind_struct<ExcitationMotion>(m, "ExcitationMotion", "Motion that is given by harmonics or points.")
      .def("duration", &ExcitationMotion::duration, "Duration [s].")
      .def("states", &ExcitationMotion::states, py::arg("times"), "JointMotion at these times [s], without torques.")
      .def("sampled", &ExcitationMotion::sampled, py::arg("interval"),
           "JointMotion from 0 to the end at this interval [s], without torques.");
  bind_enum<KeepOutKind>(m, "KeepOutKind", "Shape of a keep-out zone.");
  bind_struct<KeepOut>(m, "KeepOut", "Zone of a cell that an arm must stay clear of.")
      .def(
          "distance",
          [](const KeepOut& self, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
            return self.distance({from, to});
          },
          py::arg("start"), py::arg("end"),
          "Distance of the straight line between two points of the base from the zone [m].");
  m.def("keep_out_of", &keep_out_of, py::arg("object"),
        "The zone of a PlacedObject: a ball as it is, of a tube and a plate the box about it.");
  m.def("load_keep_out", &load_keep_out, py::arg("file"), "Zones of a YAML file whose key `keep_out` lists them.");
  bind_struct<MotionLimits>(m, "MotionLimits", "What joints may do.");
  bind_struct<ExcitationOptions>(m, "ExcitationOptions", "Options of design_excitation.");
  bind_struct<Excitation>(m, "Excitation", "Designed motion with its figures.");
  m.def("nominal_torques", &nominal_torques, py::arg("cell"), py::arg("states"),
        py::call_guard<py::gil_scoped_release>(),
        "Torques of the drives of a cell in a motion, samples x joints: links, tool, friction, rotors [N m or N].");
  m.def("motion_limits", &motion_limits, py::arg("cell"),
        "Limits that a cell states: positions, speeds and torques; no accelerations.");
  m.def(
      "design_excitation",
      [](const kr5::cell::Cell& cell, const MotionLimits& limits, ExcitationOptions options,
         const py::object& progress) {
        // Asks for signals, so that Ctrl-C ends a long design.
        options.progress = [progress = kr5::python::Shared(progress)](double fraction) {
          kr5::python::call_python("progress", [&] {
            if (PyErr_CheckSignals() != 0) throw py::error_already_set();
            if (!(*progress).is_none()) (*progress)(fraction);
          });
        };
        const py::gil_scoped_release released;
        return design_excitation(cell, limits, options);
      },
      py::arg("cell"), py::arg("limits"), py::arg("options") = ExcitationOptions{}, py::arg("progress") = py::none(),
      "Designs a motion whose torques determine the base parameters of the arm best, within its limits (Hayat et al. "
      "2022,\n"
      "sections 4.3 and 4.4.3; Swevers et al. 1997). `progress(fraction)` is called meanwhile.");
}

static void bind_elasticity(py::module_& m) {
  using kr5::python::bind_struct;
  bind_struct<ElasticityReadings>(m, "ElasticityReadings", "Angles on both sides of the gears, a row a reading.");
  bind_struct<ElasticityOptions>(m, "ElasticityOptions", "Options of identify_elasticity.");
  bind_struct<JointSpring>(m, "JointSpring", "Stiffness and play of one joint.");
  bind_struct<ElasticityResult>(m, "ElasticityResult", "Springs of the joints of an arm.");
  m.def("identify_elasticity", &identify_elasticity, py::arg("readings"), py::arg("options") = ElasticityOptions(),
        py::call_guard<py::gil_scoped_release>(),
        "Stiffness and play of each joint by least squares with noise in angles and torques (Fuller 1987, section\n"
        "1.2).\n\nParameters\n----------\nreadings : ElasticityReadings\noptions : ElasticityOptions\n\n"
        "Returns\n-------\nElasticityResult\n    Check `fit.usable`, and `told` of each joint.\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    Sizes that differ, angles that are not over the gear ratio, torques "
        "of the\n    opposite sign, invalid options.");
}

static void bind_servo(py::module_& m) {
  kr5::python::bind_enum<CommandShape>(m, "CommandShape", "The command between two samples.");
  kr5::python::bind_struct<ServoLog>(m, "ServoLog", "Commands to one axis and where it was.");
  kr5::python::bind_struct<ServoOptions>(m, "ServoOptions", "Options of identify_servo.");
  kr5::python::bind_struct<OvershootReading>(m, "OvershootReading", "Formula of the overshoot on a measured step.");
  kr5::python::bind_struct<ServoResult>(m, "ServoResult", "Servo with its covariance.");
  m.def(
      "servo_from_overshoot", &servo_from_overshoot, py::arg("step"), py::arg("overshoot"), py::arg("period"),
      "Damping ratio and natural frequency from the overshoot of a step and the period of the damped oscillation [s]\n"
      "(Hayat et al. 2022, eq. 5.11 and 5.12).");
  m.def("identify_servo", &identify_servo, py::arg("log"), py::arg("options") = ServoOptions(),
        py::call_guard<py::gil_scoped_release>(),
        "Natural frequency, damping ratio, delay, gain and offset of a servo by least squares over the whole\n"
        "response.\n\nParameters\n----------\nlog : ServoLog\noptions : ServoOptions\n\n"
        "Returns\n-------\nServoResult\n    Check `fit.usable` before using the servo.\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    An invalid log or option.");
}

static void bind_contact(py::module_& m) {
  kr5::python::bind_struct<ContactLog>(m, "ContactLog", "Force against depth, both positive into the contact.");
  kr5::python::bind_struct<ContactStiffnessOptions>(m, "ContactStiffnessOptions",
                                                    "Options of identify_contact_stiffness.");
  kr5::python::bind_struct<ContactStiffnessResult>(m, "ContactStiffnessResult", "Contact with its covariance.");
  m.def("identify_contact_stiffness", &identify_contact_stiffness, py::arg("log"),
        py::arg("options") = ContactStiffnessOptions(), py::call_guard<py::gil_scoped_release>(),
        "Stiffness and position of a contact from force against depth (Hayat et al. 2022, eq. 5.14).\n\n"
        "Parameters\n----------\nlog : ContactLog\noptions : ContactStiffnessOptions\n\n"
        "Returns\n-------\nContactStiffnessResult\n    Check `fit.usable` before using the stiffness.\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    Invalid readings or options.");
}

static void bind_force_loop_design(py::module_& m) {
  kr5::python::bind_struct<ForceLoopPlant>(m, "ForceLoopPlant", "Servo, cycle and contact that a force loop acts on.");
  kr5::python::bind_struct<ForceLoopDesignOptions>(m, "ForceLoopDesignOptions", "Options of design_force_loop.");
  kr5::python::bind_struct<ForceLoopPoint>(m, "ForceLoopPoint", "A force loop at one stiffness.");
  kr5::python::bind_struct<ForceLoopDesign>(m, "ForceLoopDesign", "Design of a force loop over a range of stiffness.");
  m.def("design_force_loop", &design_force_loop, py::arg("plant"), py::arg("loop"),
        py::arg("options") = ForceLoopDesignOptions(), py::call_guard<py::gil_scoped_release>(),
        "Compensator, errors, margins and response of the sampled force loop over a range of stiffness\n"
        "(Hayat et al. 2022, section 5.3.2), from the eigenvalues of the loop.\n\n"
        "Parameters\n----------\nplant : ForceLoopPlant\nloop : kr5.force.ForceLoopOptions\n"
        "options : ForceLoopDesignOptions\n\nReturns\n-------\nForceLoopDesign\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    A field that cannot be.");
  m.def("force_loop_matrix", &force_loop_matrix, py::arg("plant"), py::arg("correction"), py::arg("gain"),
        "Matrix of the sampled closed loop: position [m], speed [m/s], then the commands on their way [m].");
}

static void bind_force_torque(py::module_& m) {
  kr5::python::bind_enum<GainModel>(m, "GainModel", "Entries of the gain that are estimated.");
  kr5::python::bind_struct<ForceTorqueReading>(m, "ForceTorqueReading", "Reading of a force/torque sensor.");
  kr5::python::bind_struct<ForceTorqueOptions>(m, "ForceTorqueOptions", "Options of identify_force_torque.");
  kr5::python::bind_struct<SensorParameter>(m, "SensorParameter", "One number of the sensor or the tool.");
  kr5::python::bind_struct<ForceTorqueResult>(m, "ForceTorqueResult", "Sensor and tool with their covariance.");
  m.def(
      "identify_force_torque",
      [](const std::vector<ForceTorqueReading>& readings, const ForceTorqueOptions& options) {
        return identify_force_torque(readings, options);
      },
      py::arg("readings"), py::arg("options") = ForceTorqueOptions(), py::call_guard<py::gil_scoped_release>(),
      "Bias, tool and, when asked for, drift, orientation, gain and crosstalk of a force/torque sensor.\n\n"
      "Parameters\n----------\nreadings : list of ForceTorqueReading\noptions : ForceTorqueOptions\n\n"
      "Returns\n-------\nForceTorqueResult\n    Check `fit.usable`; its message names what the readings do not "
      "determine.\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    Invalid readings or options.");
  m.def("posture_readings", &posture_readings, py::arg("cell"), py::arg("q"), py::arg("wrench"),
        py::arg("t") = Eigen::VectorXd(),
        "Readings of postures that rest: q (N x n) [rad or m] and wrench (N x 6) [N, N m] a row each, times [s] or "
        "none.");
  m.def("motion_readings", &motion_readings, py::arg("cell"), py::arg("t"), py::arg("command"), py::arg("wrench"),
        "Readings of a motion with the accelerations that the joint servos of the cell make of the commands (N x n).");
}

/// What puts identified values into a cell, effects that would replace them aside.
static void bind_identified_cell(py::module_& m) {
  using kr5::cell::Cell;
  m.def("set_path_servo", &kr5::physics::set_path_servo, py::arg("cell"), py::arg("servo"), py::arg("cycle"),
        "Puts the servo of the path correction into a cell; `cycle` [s] is for a cell that states none.");
  m.def("set_joint_servo", &kr5::physics::set_joint_servo, py::arg("cell"), py::arg("joint"), py::arg("servo"),
        py::arg("cycle"), "Puts the servo of a joint (from 0) into a cell; the others keep theirs.");
  m.def("set_joint_spring", &kr5::physics::set_joint_spring, py::arg("cell"), py::arg("joint"), py::arg("stiffness"),
        py::arg("gap"),
        "Puts stiffness [N m/rad or N/m] and play [rad or m] of the gear of a joint (from 0) into a cell.");
  m.def("set_contact_stiffness", &kr5::physics::set_contact_stiffness, py::arg("cell"), py::arg("stiffness"),
        "Puts the stiffness of the contact [N/m] into a cell.");
  m.def("set_tool_mass", &kr5::physics::set_tool_mass, py::arg("cell"), py::arg("mass"), py::arg("com"),
        "Puts mass [kg] and centre [m] of all below the sensor, a payload included, into a cell.");
  m.def(
      "set_wrench_sensor",
      [](Cell& cell, const ForceTorqueResult& found) {
        kr5::physics::WrenchSensor sensor;
        sensor.gain = found.gain, sensor.bias = found.bias, sensor.rate = found.rate;
        kr5::physics::set_wrench_sensor(cell, sensor);
      },
      py::arg("cell"), py::arg("result"), "Puts bias, drift, gain and crosstalk of a ForceTorqueResult into a cell.");
}

static void bind_base_parameters(py::module_& m) {
  using kr5::python::bind_struct;
  bind_struct<JointTerms>(m, "JointTerms", "Terms of a joint beside the loads of the links.");
  bind_struct<DynamicsModel>(m, "DynamicsModel", "Arm whose dynamic parameters are to be found.");
  py::class_<DynamicsRegressor>(
      m, "DynamicsRegressor",
      "Regressor Y of a model, tau = Y chi: 13 parameters a joint in the order of Hayat et al. 2022, eq. 4.36\n"
      "(Ixx Ixy Ixz Iyy Iyz Izz, m cx, m cy, m cz, m, Coulomb, viscous, rotor inertia), then further terms [SI].")
      .def(py::init<DynamicsModel>(), py::arg("model"))
      .def_property_readonly("joints", &DynamicsRegressor::joints, "Number of joints n.")
      .def_property_readonly("names", &DynamicsRegressor::names, "Names of the parameters.")
      .def_property_readonly("units", &DynamicsRegressor::units, "Units of the parameters.")
      .def("evaluate", &DynamicsRegressor::evaluate, py::arg("motion"), py::arg("load") = Eigen::MatrixXd(),
           py::call_guard<py::gil_scoped_release>(), "Y stacked: row k n + i of sample k and joint i.")
      .def("torques", &DynamicsRegressor::torques, py::arg("motion"), py::arg("parameters"),
           py::call_guard<py::gil_scoped_release>(), "Torques of a motion, samples x joints [N m or N].")
      .def("link_torques", &DynamicsRegressor::link_torques, py::arg("motion"), py::arg("parameters"),
           py::call_guard<py::gil_scoped_release>(), "Torques of the links alone, samples x joints [N m or N].");
  bind_struct<BaseParameterOptions>(m, "BaseParameterOptions", "Options of base_parameters.");
  bind_struct<BaseParameters>(m, "BaseParameters", "Combinations of parameters that motions can determine.")
      .def_property_readonly("size", &BaseParameters::size, "Number of base parameters.")
      .def("base_values", &BaseParameters::values, py::arg("chi"), "Base parameters of standard ones.")
      .def("standard", &BaseParameters::standard, py::arg("base"),
           "Standard parameters that have these base parameters: the independent ones, and zeros.")
      .def("identifiable", &BaseParameters::identifiable, py::arg("combination"), py::arg("tolerance") = 1e-6,
           "Whether motions can determine a combination of standard parameters.");
  bind_struct<Observability>(m, "Observability", "Base parameters that one motion determines.");
  m.def("base_parameters", &base_parameters, py::arg("model"), py::arg("options") = BaseParameterOptions{},
        py::call_guard<py::gil_scoped_release>(), "Base parameters of a model, from the regressor of random states.");
  m.def("observability", &observability, py::arg("model"), py::arg("base"), py::arg("motion"),
        py::arg("tolerance") = 1e-6, py::call_guard<py::gil_scoped_release>(),
        "Base parameters that a motion determines.");
}

static void bind_dynamics(py::module_& m) {
  using kr5::python::bind_enum;
  using kr5::python::bind_struct;
  bind_enum<Estimator>(m, "Estimator", "Estimator of dynamic parameters.");
  bind_struct<DynamicsOptions>(m, "DynamicsOptions", "Options of identify_dynamics.");
  bind_struct<TorqueError>(m, "TorqueError", "Errors of predicted torques.");
  m.def("torque_error", &torque_error, py::arg("measured"), py::arg("predicted"),
        "Errors of predicted torques, samples x joints [N m or N].");
  bind_struct<DynamicsResult>(m, "DynamicsResult", "Identified dynamics.")
      .def("parameter", &DynamicsResult::parameter, py::arg("name"),
           "Value and standard deviation of a base parameter by its expression, such as fc2; None without.");
  m.def(
      "identify_dynamics",
      [](const JointMotion& motion, const DynamicsModel& model, const DynamicsOptions& options,
         const std::optional<JointMotion>& instruments) {
        const py::gil_scoped_release free;
        return identify_dynamics(motion, model, options, instruments ? &*instruments : nullptr);
      },
      py::arg("motion"), py::arg("model"), py::arg("options") = DynamicsOptions{},
      py::arg("instruments") = std::nullopt,
      "The dynamics of an arm from its motion and torques. `instruments`: the same motion with other noise or none.");
  m.def("predict_torques", &predict_torques, py::arg("result"), py::arg("motion"),
        py::call_guard<py::gil_scoped_release>(), "Torques of a motion by an estimate, samples x joints [N m or N].");
  bind_struct<PayloadOptions>(m, "PayloadOptions", "Options of identify_payload.");
  bind_struct<PayloadResult>(m, "PayloadResult", "Identified payload.");
  m.def("identify_payload",
        py::overload_cast<const JointMotion&, const DynamicsModel&, const Eigen::VectorXd&, const PayloadOptions&>(
            &identify_payload),
        py::arg("loaded"), py::arg("model"), py::arg("parameters"), py::arg("options") = PayloadOptions{},
        py::call_guard<py::gil_scoped_release>(), "Payload of an arm whose parameters are known.");
  m.def("identify_payload",
        py::overload_cast<const JointMotion&, const DynamicsResult&, const PayloadOptions&>(&identify_payload),
        py::arg("loaded"), py::arg("arm"), py::arg("options") = PayloadOptions{},
        py::call_guard<py::gil_scoped_release>(), "Payload of an arm that was identified without it.");
}

void bind_identification(py::module_& m) {
  m.doc() = "Identification of an arm's dynamics, drives and sensors from its logs.";
  bind_struct<JointMotion>(m, "JointMotion", "Measured motion of an arm with its joint torques.")
      .def("validate", &JointMotion::validate, "Raises InvalidArgument naming field and row.");
  m.def(
      "merged_motion", [](const std::vector<JointMotion>& motions) { return merged_motion(motions); },
      py::arg("motions"), "Motions of one arm one after the other, each of them at least one run.");
  bind_carried_masses(m);
  bind_gravity(m);
  bind_postures(m);
  bind_planar_gravity(m);
  bind_passive_limits(m);
  bind_excitation(m);
  bind_elasticity(m);
  bind_servo(m);
  bind_contact(m);
  bind_force_loop_design(m);
  bind_force_torque(m);
  bind_identified_cell(m);
  bind_base_parameters(m);
  bind_dynamics(m);
  bind_logs(m);
  bind_drives(m);
}
