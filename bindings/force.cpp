// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/error.hpp>
#include <kr5/force/axis_force_control.hpp>
#include <kr5/force/compliance.hpp>
#include <kr5/force/contact_wrench.hpp>
#include <kr5/force/depth_profile.hpp>
#include <kr5/force/fit_tube.hpp>
#include <kr5/force/force_loop.hpp>
#include <kr5/force/guarded_move.hpp>
#include <kr5/force/insertion.hpp>
#include <kr5/force/localise.hpp>
#include <kr5/force/peg_on_tube.hpp>
#include <kr5/force/safety_stop.hpp>
#include <kr5/force/wrench_conditioner.hpp>

#include <pybind11/numpy.h>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::force;
using kr5::python::bind_enum;
using kr5::python::bind_struct;

namespace {

Contacts packed(const std::vector<ContactPoint>& points) {
  kr5::require(points.size() <= Contacts::capacity, "contact_wrench: found " + std::to_string(points.size()) +
                                                        " contacts, expected at most " +
                                                        std::to_string(Contacts::capacity));
  Contacts out;
  for (const ContactPoint& p : points) out.add(p);
  return out;
}

using ContactFunction = Contacts (*)(const PegTubeShape&, const kr5::Pose&) noexcept;

/// The list of contacts of a shape that has been checked.
template <ContactFunction function>
std::vector<ContactPoint> listed(const PegTubeShape& shape, const kr5::Pose& T_tube_peg) {
  shape.validate();
  const Contacts found = function(shape, T_tube_peg);
  return {found.begin(), found.end()};
}

void bind_rest(py::module_& m) {
  bind_enum<RestContact>(m, "RestContact", "Contact that carries a peg on a tube.");
  bind_struct<PegTube>(m, "PegTube", "Radii of a peg and a tube, sharp-edged.");
  bind_struct<PegRest>(m, "PegRest", "Resting pose of a peg, with the derivatives of its height.");
  m.def(
      "rest_peg_on_tube",
      [](const PegTube& bodies, double tilt, double alpha, const Eigen::Vector2d& centre) {
        bodies.validate();
        return rest_peg_on_tube(bodies, tilt, alpha, centre);
      },
      py::arg("bodies"), py::arg("tilt"), py::arg("alpha"), py::arg("centre"),
      "Resting height of a peg that leans by `tilt` towards the azimuth `alpha` [rad] with its bottom centre over "
      "`centre` [m], seen from the tube; exact.");
  m.def(
      "resting_heights",
      [](const PegTube& bodies, py::array_t<double> tilt, py::array_t<double> alpha, py::array_t<double> cx,
         py::array_t<double> cy, const kr5::Pose& T_tube_actual) {
        bodies.validate();
        const auto height = [&](double a, double b, double x, double y) {
          return resting_height(bodies, T_tube_actual, a, b, {x, y});
        };
        return py::vectorize(height)(std::move(tilt), std::move(alpha), std::move(cx), std::move(cy));
      },
      py::arg("bodies"), py::arg("tilt"), py::arg("alpha"), py::arg("cx"), py::arg("cy"),
      py::arg("T_tube_actual") = kr5::Pose::Identity(),
      "Resting heights over arrays that broadcast [rad, m], on a tube at `T_tube_actual`; NaN where nothing carries "
      "the peg.");
}

void bind_contacts(py::module_& m) {
  bind_enum<ContactFeature>(m, "ContactFeature", "Features in contact.");
  bind_struct<PegTubeShape>(m, "PegTubeShape", "Peg and tube with 45 degree chamfers.");
  bind_struct<ContactPoint>(m, "ContactPoint", "Point of contact; moving the peg along `normal` by `depth` ends it.");
  bind_struct<ContactLaw>(m, "ContactLaw", "Contact law: normal force and friction.");
  bind_struct<Stiction>(m, "Stiction", "State of friction between calls.");
  bind_struct<ContactForce>(m, "ContactForce", "Wrench of the contacts on the peg.");
  m.def("peg_tube_contacts", &listed<&peg_tube_contacts>, py::arg("shape"), py::arg("T_tube_peg"),
        "Every contact of a peg (origin: bottom centre, Z: axis) with a tube, at any depth of insertion.");
  m.def("peg_bench_contacts", &listed<&peg_bench_contacts>, py::arg("shape"), py::arg("T_tube_peg"),
        "Every contact of a peg with a flat bench at z = 0.");
  m.def(
      "contact_wrench",
      [](const std::vector<ContactPoint>& contacts, const ContactLaw& law, const kr5::Pose& T_tube_peg,
         const kr5::Vector6& twist, double dt, Stiction& stiction) {
        law.validate();
        return contact_wrench(packed(contacts), law, T_tube_peg, twist, dt, stiction);
      },
      py::arg("contacts"), py::arg("law"), py::arg("T_tube_peg"), py::arg("twist"), py::arg("dt"), py::arg("stiction"),
      "Wrench of the contacts on a peg that moves with `twist` (bottom centre, then turning) in T; `stiction` is "
      "changed.");
}

void bind_profile(py::module_& m) {
  bind_struct<DepthMinimum>(m, "DepthMinimum", "Minimum of the depth profile over a turn.");
  bind_struct<TubeFitOptions>(m, "TubeFitOptions", "Options of fit_tube.");
  bind_struct<TubeFit>(m, "TubeFit", "Position of the peg on the tube, fitted to the whole profile.");
  m.def(
      "depth_minima", &depth_minima, py::arg("bodies"), py::arg("tilt"), py::arg("centre"),
      "The minima of the depth profile, the hole's first; tilt [rad], centre of the peg's bottom from that of the tube "
      "[m]. Closed form (Hayat et al. 2022, eqs 5.35, 5.38).");
  m.def("critical_offset", &critical_offset, py::arg("bodies"), py::arg("tilt"),
        "Distance of the axes [m] below which the lowest of the two minima is that of the hole (eq. 5.39).");
  m.def("azimuth_error", &azimuth_error, py::arg("bodies"), py::arg("tilt"), py::arg("centre"), py::arg("depth_error"),
        "Error of the azimuth of the hole [rad] caused by an error `depth_error` of the depth [m].");
  m.def(
      "depth_map",
      [](const PegTube& bodies, double tilt, double azimuth, const std::vector<double>& x,
         const std::vector<double>& y) { return depth_map(bodies, tilt, azimuth, x, y); },
      py::arg("bodies"), py::arg("tilt"), py::arg("azimuth"), py::arg("x"), py::arg("y"),
      "Resting heights over a grid of peg centres, (len(y), len(x)) [m]; NaN where nothing carries the peg.");
  m.def(
      "fit_tube",
      [](const PegTube& bodies, double tilt, const std::vector<double>& azimuth, const std::vector<double>& height,
         const TubeFitOptions& options) { return fit_tube(bodies, tilt, azimuth, height, options); },
      py::arg("bodies"), py::arg("tilt"), py::arg("azimuth"), py::arg("height"), py::arg("options") = TubeFitOptions{},
      "Least-squares fit of heights [m] over azimuths [rad] by the exact profile: direction and distance of the hole.");
  bind_struct<TurnRow>(m, "TurnRow", "Force and moment at one azimuth of a turn at constant height.");
  bind_struct<TurnDirection>(m, "TurnDirection", "Azimuth of the hole with its standard deviation.");
  m.def("locate_by_force", &locate_by_force, py::arg("bodies"), py::arg("tilt"), py::arg("stiffness"), py::arg("rows"),
        "Direction of the hole from the forces of a turn at constant height, converted to heights by the stiffness.");
  m.def("locate_by_moment", &locate_by_moment, py::arg("rows"),
        "Direction of the hole from the moments of a turn: over the cusp the point of contact changes sides.");
}

void bind_force_loops(py::module_& m) {
  bind_enum<CorrectionReference>(m, "CorrectionReference", "Reference pose of a correction: start | actual.");
  bind_struct<ForceLoopOptions>(m, "ForceLoopOptions", "Options of ForceLoop.")
      .def("compensator", &ForceLoopOptions::compensator, "Factor on the reference (eq. 5.17).")
      .def("contact_speed", &ForceLoopOptions::contact_speed, py::arg("reference"), py::arg("cycle"),
           "Greatest contact speed at which the force of the first cycle stays within the reference [m/s].");
  py::class_<ForceLoop>(m, "ForceLoop", "Control of the force along one axis by corrections of the path (section 5.3).")
      .def(py::init<const ForceLoopOptions&>(), py::arg("options") = ForceLoopOptions{})
      .def("reset", &ForceLoop::reset, "Resets the correction to zero.")
      .def("step", &ForceLoop::step, py::arg("reference"), py::arg("measured"),
           "Correction of this cycle; [N], [N] to [m].")
      .def_property_readonly("limited", &ForceLoop::limited,
                             "True when a limit, or an argument that is not finite, holds the correction back.")
      .def_property_readonly("correction", &ForceLoop::correction, "Last correction [m].");
  bind_struct<AxisForceOptions>(m, "AxisForceOptions", "Options of AxisForceControl.");
  py::class_<AxisForceControl>(m, "AxisForceControl",
                               "The force loop on a robot: from readings to commands that hold a force along one axis.")
      .def(py::init<const AxisForceOptions&>(), py::arg("options") = AxisForceOptions{})
      .def("step", &AxisForceControl::step, py::arg("reading"), py::arg("reference"),
           "Command of this cycle, towards a force of the tool into the contact [N].")
      .def("measured", &AxisForceControl::measured, py::arg("reading"),
           "Force of the tool into the contact, by a reading; 0 before the first step [N].")
      .def("reset", &AxisForceControl::reset, "Begins anew, where the tool is at the next reading.")
      .def_property_readonly(
          "limited", [](const AxisForceControl& self) { return self.loop().limited(); },
          "True when a limit, or a reading that is not finite, holds the correction back.")
      .def_property_readonly(
          "correction", [](const AxisForceControl& self) { return self.loop().correction(); }, "Last correction [m].");
}

void bind_compliance(py::module_& m) {
  bind_struct<GuardedMoveOptions>(m, "GuardedMoveOptions", "Options of GuardedMove.")
      .def("safe_speed", &GuardedMoveOptions::safe_speed,
           "Greatest contact speed for which the force stays within `max_force` [m/s].");
  py::class_<GuardedMove>(m, "GuardedMove", "Motion until contact, no faster than the loop can stop.")
      .def(py::init<const GuardedMoveOptions&>(), py::arg("options") = GuardedMoveOptions{})
      .def("step", &GuardedMove::step, py::arg("way"), py::arg("force"),
           "Speed of this cycle [m/s] for the distance left [m] and the force [N]; 0 from contact, or a number that is "
           "not finite, on.")
      .def("reset", &GuardedMove::reset, "Resets the detection of contact.")
      .def_property_readonly("touched", &GuardedMove::touched, "True after contact was detected.");
  bind_struct<ComplianceOptions>(m, "ComplianceOptions", "Options of admittance_twist.")
      .def("stable", &ComplianceOptions::stable, py::arg("stiffness"), py::arg("turning_stiffness"), py::arg("delay"),
           "True for a stable loop with these stiffnesses [N/m], [N m/rad] and this delay [s].");
  m.def("admittance_twist", &admittance_twist, py::arg("wrench"), py::arg("reference"),
        py::arg("options") = ComplianceOptions{},
        "Twist with which a tool yields to a wrench, away from a reference wrench: [N, N m] to [m/s, rad/s].");
  bind_struct<WrenchConditionerOptions>(m, "WrenchConditionerOptions", "Options of WrenchConditioner.");
  py::class_<WrenchConditioner>(
      m, "WrenchConditioner",
      "Wrench of the environment from readings of a wrist sensor: weight removed, noise filtered.")
      .def(py::init<const WrenchConditionerOptions&>(), py::arg("options") = WrenchConditionerOptions{})
      .def("step", &WrenchConditioner::step, py::arg("reading"), py::arg("R_base_sensor"),
           "Wrench of the environment, without weight, filtered, in S [N, N m].")
      .def("tare", &WrenchConditioner::tare, "Takes the last finite reading, less the weight, as zero.")
      .def("reset", &WrenchConditioner::reset, "Resets the filter.")
      .def("weight", &WrenchConditioner::weight, py::arg("R_base_sensor"),
           "Reading of the weight alone, in S [N, N m].")
      .def_property_readonly("delay", &WrenchConditioner::delay, "Delay of the filter [s].");
}

void bind_safety(py::module_& m) {
  bind_struct<SafetyLimits>(m, "SafetyLimits", "Limits of SafetyStop.");
  bind_enum<Violation>(m, "Violation", "Reason for a stop of the arm.");
  py::class_<SafetyStop>(m, "SafetyStop", "Monitoring of every cycle; the first violation stays until reset().")
      .def(py::init<const SafetyLimits&>(), py::arg("limits") = SafetyLimits{})
      .def(
          "step",
          [](SafetyStop& self, const kr5::Vector6& raw, const kr5::Vector6& wrench, const std::vector<double>& current,
             bool saturated) { return self.step(raw, wrench, current, saturated); },
          py::arg("raw"), py::arg("wrench"), py::arg("current") = std::vector<double>{}, py::arg("saturated") = false,
          "Violation of a cycle: raw reading [N, N m], wrench [N, N m], currents [A].")
      .def("reset", &SafetyStop::reset, "Clears the violation.")
      .def_property_readonly("violation", &SafetyStop::violation, "First violation since the last reset().");
  bind_struct<CurrentLimitOptions>(m, "CurrentLimitOptions", "Options of current_limits.");
  m.def("current_limits", &current_limits, py::arg("gravity"), py::arg("friction"),
        py::arg("options") = CurrentLimitOptions{},
        "Current limit of each motor [A]: a margin above the current that holds the posture and overcomes friction "
        "(section 5.2).");
}

void bind_insertion(py::module_& m) {
  bind_enum<Localisation>(m, "Localisation", "Localisation of the hole: fit | cusp | minimum.");
  bind_enum<EntryAttitude>(m, "EntryAttitude", "Entry of the peg: tilted | upright.");
  bind_enum<InsertBy>(m, "InsertBy", "Drive of the insertion: arm | gravity | air.");
  bind_enum<Phase>(m, "Phase", "Phase of an insertion.");
  bind_enum<Reason>(m, "Reason", "Reason for the end of an attempt, or of the insertion.");
  bind_struct<GripModel>(m, "GripModel", "Believed compliance between arm and peg.");
  bind_struct<InsertionForces>(m, "InsertionForces", "Forces and gains of an insertion.");
  bind_struct<InsertionMotion>(m, "InsertionMotion", "Speeds and distances of an insertion.");
  bind_struct<InsertionLimits>(m, "InsertionLimits", "Limits that stop an insertion.");
  bind_struct<InsertionOptions>(m, "InsertionOptions", "Options of Insertion.");
  bind_struct<InsertionState>(m, "InsertionState", "State of an insertion.");
  bind_struct<ProfileRow>(m, "ProfileRow", "Measurement at one azimuth of the turn.");
  bind_struct<InsertionFrames>(m, "InsertionFrames", "Tube in the base and peg in the tool, as they are believed.");
  m.def("T_tube_peg", &T_tube_peg, py::arg("frames"), py::arg("reading"),
        "Pose of the peg against the tube, according to the arm [m].");
  m.def("wrench_on_peg", &wrench_on_peg, py::arg("frames"), py::arg("reading"),
        "Wrench of the environment on the peg about its bottom centre, in axes of T, without weight [N, N m].");
  m.def("T_base_tool", &T_base_tool, py::arg("frames"), py::arg("T_tube_peg"),
        "Pose of the tool that holds the peg at a pose in T [m].");
  py::class_<Insertion>(m, "Insertion", "Insertion of a peg into a tube by force control; call `step` once per cycle.")
      .def(py::init<const InsertionOptions&, const InsertionFrames&>(), py::arg("options"),
           py::arg("frames") = InsertionFrames{})
      .def("step", &Insertion::step, py::arg("reading"),
           "One cycle of the controller: the pose at which the tool shall be, and what the gripper does.")
      .def_property_readonly("state", &Insertion::state, py::return_value_policy::copy, "State (a copy).")
      .def_property_readonly("finished", &Insertion::finished, "True when done or stopped.")
      .def_property_readonly(
          "profile",
          [](const Insertion& self) { return std::vector<ProfileRow>(self.profile().begin(), self.profile().end()); },
          "Measured profile of the last turn, by azimuth (copies).")
      .def("restart", &Insertion::restart, "Restarts, with the hole of the last success as the initial estimate.");
}

}  // namespace

void bind_force(py::module_& m) {
  m.doc() = "Contact of peg and tube, force control, and insertion.";
  bind_rest(m);
  bind_contacts(m);
  bind_profile(m);
  bind_force_loops(m);
  bind_compliance(m);
  bind_safety(m);
  bind_insertion(m);
}
