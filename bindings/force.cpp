// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/error.hpp>
#include <kr5/force/compliance.hpp>
#include <kr5/force/contact_wrench.hpp>
#include <kr5/force/depth_profile.hpp>
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
std::vector<ContactPoint> listed(const PegTubeShape& shape, const kr5::Pose& T_T_peg) {
  shape.validate();
  const Contacts found = function(shape, T_T_peg);
  return {found.begin(), found.end()};
}

void bind_rest(py::module_& m) {
  bind_enum<Rest>(m, "Rest", "What carries a peg on a tube.");
  bind_struct<PegTube>(m, "PegTube", "Radii of a peg and a tube, sharp-edged.");
  bind_struct<PegRest>(m, "PegRest", "Where a peg rests, with the derivatives of its height.");
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
         py::array_t<double> cy, const kr5::Pose& T_T_tube) {
        bodies.validate();
        const auto height = [&](double a, double b, double x, double y) {
          return resting_height(bodies, T_T_tube, a, b, {x, y});
        };
        return py::vectorize(height)(std::move(tilt), std::move(alpha), std::move(cx), std::move(cy));
      },
      py::arg("bodies"), py::arg("tilt"), py::arg("alpha"), py::arg("cx"), py::arg("cy"),
      py::arg("T_T_tube") = kr5::Pose::Identity(),
      "Resting heights over arrays that broadcast [rad, m], on a tube at `T_T_tube`; NaN where nothing carries the "
      "peg.");
}

void bind_contacts(py::module_& m) {
  bind_enum<Touch>(m, "Touch", "Which features touch.");
  bind_struct<PegTubeShape>(m, "PegTubeShape", "Peg and tube with 45 degree chamfers.");
  bind_struct<ContactPoint>(m, "ContactPoint",
                            "One point of contact: moving the peg along `normal` by `depth` ends it.");
  bind_struct<ContactLaw>(m, "ContactLaw", "How contacts push back.");
  bind_struct<Stiction>(m, "Stiction", "What friction remembers from call to call.");
  bind_struct<ContactForce>(m, "ContactForce", "What the contacts do to the peg.");
  m.def("peg_tube_contacts", &listed<&peg_tube_contacts>, py::arg("shape"), py::arg("T_T_peg"),
        "Every contact of a peg (origin: bottom centre, Z: axis) with a tube, at any depth of insertion.");
  m.def("peg_bench_contacts", &listed<&peg_bench_contacts>, py::arg("shape"), py::arg("T_T_peg"),
        "Every contact of a peg with a flat bench at z = 0.");
  m.def(
      "contact_wrench",
      [](const std::vector<ContactPoint>& contacts, const ContactLaw& law, const kr5::Pose& T_T_peg,
         const kr5::Vector6& twist, double dt, Stiction& stiction) {
        law.validate();
        return contact_wrench(packed(contacts), law, T_T_peg, twist, dt, stiction);
      },
      py::arg("contacts"), py::arg("law"), py::arg("T_T_peg"), py::arg("twist"), py::arg("dt"), py::arg("stiction"),
      "Wrench of the contacts on a peg that moves with `twist` (bottom centre, then turning) in T; `stiction` is "
      "changed.");
}

void bind_profile(py::module_& m) {
  bind_struct<DepthMinimum>(m, "DepthMinimum", "A place in the turn at which the peg rests lower than beside it.");
  bind_struct<TubeFitOptions>(m, "TubeFitOptions", "Options of fit_tube.");
  bind_struct<TubeFit>(m, "TubeFit", "Where the peg stood on the tube, from the whole profile.");
  m.def(
      "depth_minima", &depth_minima, py::arg("bodies"), py::arg("tilt"), py::arg("centre"),
      "The minima of the depth profile, the hole's first; tilt [rad], centre of the peg's bottom from that of the tube "
      "[m]. Closed form (Hayat et al. 2022, eqs 5.35, 5.38).");
  m.def("critical_offset", &critical_offset, py::arg("bodies"), py::arg("tilt"),
        "Distance of the axes [m] below which the lowest of the two minima is that of the hole (eq. 5.39).");
  m.def("azimuth_error", &azimuth_error, py::arg("bodies"), py::arg("tilt"), py::arg("centre"), py::arg("depth_error"),
        "By how much the azimuth of the hole is off when depth is read wrongly by `depth_error` [m]: [rad].");
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
      "Least squares of heights [m] over azimuths [rad] by the exact profile: where the hole is, and how far.");
  bind_struct<TurnRow>(m, "TurnRow", "What is felt at one azimuth of a turn at a constant height.");
  bind_struct<TurnDirection>(m, "TurnDirection", "Azimuth of the hole, and how well it is known.");
  m.def("locate_by_force", &locate_by_force, py::arg("bodies"), py::arg("tilt"), py::arg("stiffness"), py::arg("rows"),
        "From the forces of a turn at a constant height: what gives way turns them into heights.");
  m.def("locate_by_moment", &locate_by_moment, py::arg("rows"),
        "From the moments of a turn: over the cusp the point of contact changes sides.");
}

/// A function of Python has no use for the C++ classes' noexcept.
void bind_control(py::module_& m) {
  bind_enum<CorrectionOf>(m, "CorrectionOf", "What a correction adds to.");
  bind_struct<ForceLoopOptions>(m, "ForceLoopOptions", "Options of ForceLoop.")
      .def("compensator", &ForceLoopOptions::compensator, "What the wish is multiplied by (eq. 5.17).")
      .def("contact_speed", &ForceLoopOptions::contact_speed, py::arg("wish"), py::arg("cycle"),
           "The fastest contact after which the first cycle is no harder than the wish [m/s].");
  py::class_<ForceLoop>(m, "ForceLoop", "Force along one axis by corrections of the path (section 5.3).")
      .def(py::init<const ForceLoopOptions&>(), py::arg("options") = ForceLoopOptions{})
      .def("reset", &ForceLoop::reset, "Begins anew from no correction.")
      .def("step", &ForceLoop::step, py::arg("wish"), py::arg("measured"), "Correction of this cycle; [N], [N] to [m].")
      .def_property_readonly("limited", &ForceLoop::limited, "A limit holds the correction back.")
      .def_property_readonly("correction", &ForceLoop::correction, "The last one [m].");
  bind_struct<GuardedMoveOptions>(m, "GuardedMoveOptions", "Options of GuardedMove.")
      .def("safe_speed", &GuardedMoveOptions::safe_speed, "The fastest contact that ends within `most` [m/s].");
  py::class_<GuardedMove>(m, "GuardedMove", "Moving until something is touched, no faster than the loop can stop.")
      .def(py::init<const GuardedMoveOptions&>(), py::arg("options") = GuardedMoveOptions{})
      .def("step", &GuardedMove::step, py::arg("way"), py::arg("force"), "Speed of this cycle; [m], [N] to [m/s].")
      .def("reset", &GuardedMove::reset, "Begins anew.")
      .def_property_readonly("touched", &GuardedMove::touched, "Something was touched.");
  bind_struct<ComplianceOptions>(m, "ComplianceOptions", "Options of give_way.")
      .def("stable", &ComplianceOptions::stable, py::arg("stiffness"), py::arg("turning_stiffness"), py::arg("delay"),
           "Whether the loop comes to rest; [N/m], [N m/rad], [s].");
  m.def("give_way", &give_way, py::arg("wrench"), py::arg("wish"), py::arg("options") = ComplianceOptions{},
        "Twist with which a tool goes where it is pushed, away from a wished wrench [N, N m] to [m/s, rad/s].");
  bind_struct<WrenchConditionerOptions>(m, "WrenchConditionerOptions", "Options of WrenchConditioner.");
  py::class_<WrenchConditioner>(m, "WrenchConditioner", "From what a wrist sensor reads to what touches the tool.")
      .def(py::init<const WrenchConditionerOptions&>(), py::arg("options") = WrenchConditionerOptions{})
      .def("step", &WrenchConditioner::step, py::arg("reading"), py::arg("R_B_S"),
           "Wrench of the environment, without weight, filtered, in S [N, N m].")
      .def("tare", &WrenchConditioner::tare, "What the last reading held beside the weight is zero from now on.")
      .def("reset", &WrenchConditioner::reset, "Forgets what was filtered.")
      .def("weight", &WrenchConditioner::weight, py::arg("R_B_S"),
           "What the sensor reads of the weight, in S [N, N m].")
      .def_property_readonly("delay", &WrenchConditioner::delay, "Of the filter [s].");
  bind_struct<SafetyLimits>(m, "SafetyLimits", "Limits of SafetyStop.");
  bind_enum<Violation>(m, "Violation", "What stopped the arm.");
  py::class_<SafetyStop>(m, "SafetyStop", "Watches every cycle; the first violation stays until reset().")
      .def(py::init<const SafetyLimits&>(), py::arg("limits") = SafetyLimits{})
      .def(
          "step",
          [](SafetyStop& self, const kr5::Vector6& raw, const kr5::Vector6& wrench, const std::vector<double>& current,
             bool saturated) { return self.step(raw, wrench, current, saturated); },
          py::arg("raw"), py::arg("wrench"), py::arg("current") = std::vector<double>{}, py::arg("saturated") = false,
          "Judges a cycle; [N, N m], [N, N m], [A].")
      .def("reset", &SafetyStop::reset, "Lets the arm move again.")
      .def_property_readonly("violation", &SafetyStop::violation, "The first one.");
  bind_struct<CurrentLimitOptions>(m, "CurrentLimitOptions", "Options of current_limits.");
  m.def("current_limits", &current_limits, py::arg("gravity"), py::arg("friction"),
        py::arg("options") = CurrentLimitOptions{},
        "Limit of each motor [A]: a margin above what holding the posture and sliding needs (section 5.2).");
}

void bind_insertion(py::module_& m) {
  bind_enum<Localisation>(m, "Localisation", "What tells where the hole is.");
  bind_enum<Entry>(m, "Entry", "How the peg goes into the hole.");
  bind_enum<InsertBy>(m, "InsertBy", "What pushes the peg in.");
  bind_enum<Phase>(m, "Phase", "What an insertion is at.");
  bind_enum<Reason>(m, "Reason", "Why an attempt, or everything, ended.");
  bind_struct<GripModel>(m, "GripModel", "The believed grip between arm and peg.");
  bind_struct<InsertionForces>(m, "InsertionForces", "Forces and gains of an insertion.");
  bind_struct<InsertionMotion>(m, "InsertionMotion", "Speeds and ways of an insertion.");
  bind_struct<InsertionLimits>(m, "InsertionLimits", "What stops an insertion.");
  bind_struct<InsertionOptions>(m, "InsertionOptions", "What a peg is inserted with.");
  bind_struct<InsertionState>(m, "InsertionState", "Where an insertion stands.");
  bind_struct<ProfileRow>(m, "ProfileRow", "What was felt at one place of the turn.");
  py::class_<InsertionCommand>(m, "InsertionCommand", "What the cell shall do.")
      .def_property_readonly(
          "T_T_P", [](const InsertionCommand& c) { return c.T_T_P; }, "Where the arm shall hold the peg, in T [m].")
      .def_readonly("hold", &InsertionCommand::hold, "The grip holds; otherwise it lets the peg slide along.")
      .def_readonly("air", &InsertionCommand::air, "Compressed air on the peg.")
      .def_readonly("stop", &InsertionCommand::stop, "Stop the arm where it is; stays so.");
  py::class_<Insertion>(m, "Insertion", "A peg feels its way into a tube; `step` once a cycle.")
      .def(py::init<const InsertionOptions&>(), py::arg("options"))
      .def(
          "step",
          [](Insertion& self, const kr5::Pose& T_T_P, const kr5::Vector6& sensor, const kr5::Vector6& wrench,
             const std::vector<double>& current, bool saturated, bool gripped, bool reachable) {
            return self.step({T_T_P, sensor, wrench, current, saturated, gripped, reachable});
          },
          py::arg("T_T_P"), py::arg("sensor"), py::arg("wrench"), py::arg("current") = std::vector<double>{},
          py::arg("saturated") = false, py::arg("gripped") = true, py::arg("reachable") = true,
          "One cycle. T_T_P: the peg as the arm believes [m]. sensor: as it tells [N, N m]. wrench: of the environment "
          "on "
          "the peg about its bottom centre, axes of T, weight taken away [N, N m].")
      .def_property_readonly("state", &Insertion::state, py::return_value_policy::copy, "Where it stands (a copy).")
      .def_property_readonly("finished", &Insertion::finished, "Done or stopped.")
      .def_property_readonly(
          "profile",
          [](const Insertion& self) { return std::vector<ProfileRow>(self.profile().begin(), self.profile().end()); },
          "What was felt in the last turn, by azimuth (copies).")
      .def("again", &Insertion::again, "Begins anew with the hole of the last success remembered.");
}

}  // namespace

void bind_force(py::module_& m) {
  m.doc() = "Contact of peg and tube, force control, and insertion.";
  bind_rest(m);
  bind_contacts(m);
  bind_profile(m);
  bind_control(m);
  bind_insertion(m);
}
