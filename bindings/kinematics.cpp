// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/kinematics/axis_chain.hpp>
#include <kr5/kinematics/denoc.hpp>
#include <kr5/kinematics/deviated_arm.hpp>
#include <kr5/kinematics/dh_chain.hpp>
#include <kr5/kinematics/inertial_regressor.hpp>
#include <kr5/kinematics/inverse.hpp>
#include <kr5/kinematics/jacobian.hpp>
#include <kr5/kinematics/newton_euler.hpp>
#include <kr5/kinematics/workspace_map.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::kinematics;
using kr5::python::bind_enum;
using kr5::python::bind_struct;

static void bind_chain(py::module_& m) {
  bind_enum<JointType>(m, "JointType", "Type of a joint.");
  bind_struct<DhJoint>(m, "DhJoint", "Joint and the link behind it.")
      .def("transform", &DhJoint::transform, py::arg("q"),
           "Pose of the link in the previous one [joint value in rad or m].");
  bind_struct<DhChain>(m, "DhChain", "Open chain from the robot base B to the flange F.")
      .def(py::init([](std::vector<DhJoint> joints, const kr5::Pose& T_base_0) {
             return DhChain{T_base_0, std::move(joints)};
           }),
           py::arg("joints"), py::arg("T_base_0") = kr5::Pose::Identity())
      .def("link_poses", &DhChain::link_poses, py::arg("q"), "Poses of link frames 1..n in B for q [rad or m].")
      .def("flange", &DhChain::flange, py::arg("q"), "T_base_flange for q [rad or m].")
      .def(
          "flanges",
          [](const DhChain& self, const Eigen::Ref<const Rows>& q) {
            auto* T = new Rows;
            const py::capsule owner(T, [](void* p) { delete static_cast<Rows*>(p); });
            {
              const py::gil_scoped_release free;
              *T = self.flanges(q);
            }
            return py::array_t<double>({q.rows(), Eigen::Index{4}, Eigen::Index{4}}, T->data(), owner);
          },
          py::arg("q"), "T_base_flange of every row of q (N x n) [rad or m]: N x 4 x 4.");
}

static void bind_deviated_arm(py::module_& m) {
  bind_enum<DhParameter>(m, "DhParameter", "Parameter of a Denavit-Hartenberg row.");
  bind_struct<JointParameter>(m, "JointParameter", "Parameter of one joint.")
      .def_property_readonly("label", &JointParameter::label, "As in tables: b1, theta1, a1, alpha1, beta1.")
      .def_property_readonly("is_length", &JointParameter::is_length, "Whether it is b or a.");
  m.def("joint_parameters", &joint_parameters, py::arg("chain"),
        "The parameters b, theta, a and alpha of every joint of a chain.");
  bind_struct<DeviatedArm>(m, "DeviatedArm", "Arm of which parameters are off, beside the nominal one.")
      .def(
          "errors",
          [](const DeviatedArm& self, const Eigen::Ref<const Rows>& deviations) { return self.errors(deviations); },
          py::arg("deviations"), py::call_guard<py::gil_scoped_release>(),
          "Errors of the flange (N x 6), position [m] and rotation vector [rad] in B, for the deviations in each row.");
}

static void bind_axes(py::module_& m) {
  bind_struct<AxisLine>(m, "AxisLine", "Joint axis as a line.");
  m.def(
      "chain_from_axes",
      [](const std::vector<AxisLine>& axes, const Eigen::VectorXd& q, const kr5::Pose& T_base_flange, double parallel) {
        return chain_from_axes(axes, q, T_base_flange, parallel);
      },
      py::arg("axes"), py::arg("q"), py::arg("T_base_flange"), py::arg("parallel") = near_parallel_sine,
      "Chain of revolute joints whose axes lie so in the base at joint values q, by dual vectors.");
  m.def(
      "has_near_parallel_axes", &has_near_parallel_axes, py::arg("joint"), py::arg("parallel") = near_parallel_sine,
      "Whether the axes before and behind a link are near-parallel, as chain_from_axes takes it: beta is then one of\n"
      "its parameters, and b is 0 by choice.");
  m.def("axes_of", &axes_of, py::arg("chain"), py::arg("q"), "Axes of a chain at joint values q, in the base.");
}

static void bind_inverse(py::module_& m) {
  m.def("jacobian", &jacobian, py::arg("chain"), py::arg("q"), py::arg("T_flange_x") = kr5::Pose::Identity(),
        "Geometric Jacobian, 6 x n, linear first, of frame X on the flange, in axes of B.");
  bind_struct<Manipulability>(m, "Manipulability", "Distance of a posture from a singularity.");
  m.def(
      "parameter_jacobian", [](const DhChain& chain, const Eigen::VectorXd& q) { return parameter_jacobian(chain, q); },
      py::arg("chain"), py::arg("q"),
      "Derivative of the pose of the flange by b, theta_offset, a, alpha and beta of every joint, 6 x 5n, right\n"
      "perturbation of T_base_flange, linear first [m, rad].");
  m.def("manipulability", &manipulability, py::arg("J"), py::arg("length") = 1.0,
        "Singular values of a Jacobian whose linear rows are divided by `length` [m].");
  m.def("outside_limits", &outside_limits, py::arg("q"), py::arg("lower"), py::arg("upper"),
        py::arg("tolerance") = 1e-9, "Joints, counted from 0, outside their limits.");
  bind_enum<InverseStatus>(m, "InverseStatus", "Status of an inverse problem.");
  bind_enum<Singularity>(m, "Singularity", "Singularity of a posture.");
  bind_struct<Posture>(m, "Posture", "Posture: joint values that reach a pose.")
      .def_property_readonly("usable", &Posture::usable, "True when all joints are within their limits.");
  bind_struct<InverseOptions>(m, "InverseOptions", "Options of inverse_kinematics.");
  bind_struct<InverseResult>(m, "InverseResult", "Postures that reach a pose.")
      .def("nearest", &InverseResult::nearest,
           "Joint values within the limits that are nearest to `near` of the options; None where no posture is usable "
           "[rad or m].");
  m.def("has_closed_form", &has_closed_form, py::arg("chain"),
        "True for six revolute joints whose last three axes intersect in one point.");
  m.def("inverse_kinematics", &inverse_kinematics, py::arg("chain"), py::arg("T_base_flange"),
        py::arg("options") = InverseOptions{}, py::call_guard<py::gil_scoped_release>(),
        "Postures that bring the flange to a pose; all of them when the chain has a closed form.");
}

static void bind_workspace(py::module_& m) {
  bind_struct<WorkspaceOptions>(m, "WorkspaceOptions", "Options of workspace_map.");
  bind_struct<WorkspaceMap>(m, "WorkspaceMap", "Reach and dexterity over radius and height.");
  m.def("workspace_map", &workspace_map, py::arg("chain"), py::arg("lower"), py::arg("upper"),
        py::arg("options") = WorkspaceOptions(), py::call_guard<py::gil_scoped_release>(),
        "Where an arm can put a point of the flange within its limits [rad or m], and how well it moves it there.");
  m.def("wrist_centre", &wrist_centre, py::arg("chain"),
        "Centre of a spherical wrist in the flange frame [m]; None for other arms.");
}

static Eigen::VectorXd torques(Dynamics& self, const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
                               const Eigen::VectorXd& qdd, const std::vector<kr5::Vector6>& external) {
  Eigen::VectorXd tau(self.joints());
  self.torques(q, qd, qdd, tau, external);
  return tau;
}

static void bind_dynamics(py::module_& m) {
  bind_struct<Body>(m, "Body", "Mass of one rigid body.").def("inertia_matrix", &Body::inertia_matrix, "3x3 [kg m^2].");
  m.def("transformed_body", &transformed_body, py::arg("T_a_b"), py::arg("body"),
        "The same body, given in frame b, described in frame a; T_a_b is 4x4 [m].");
  m.def("merged_body", &merged_body, py::arg("a"), py::arg("b"), "Two bodies of one frame, welded together.");
  m.def("body_without", &body_without, py::arg("whole"), py::arg("part"),
        "What is left of a body when a part of it is taken away; None where that could not be a real body.");
  m.def("is_real", &is_real, py::arg("body"),
        "Whether a body could be real: with a mass, and principal moments of which two add up to no less than the "
        "third.");
  py::class_<SensorCut>(m, "SensorCut", "A body fixed to a link, cut off at frame S.")
      .def(py::init([](const Body& body, const kr5::Pose& T_link_sensor, int link) {
             return SensorCut{link, T_link_sensor, body};
           }),
           py::arg("body"), py::arg("T_link_sensor") = kr5::Pose::Identity(), py::arg("link") = -1);
  py::class_<Dynamics>(m, "Dynamics", "Equations of motion of a chain with massive links, counted from 0.")
      .def(py::init<const DhChain&, const std::vector<Body>&, const Eigen::Vector3d&>(), py::arg("chain"),
           py::arg("bodies"), py::arg("gravity") = Eigen::Vector3d(0.0, 0.0, -9.81))
      .def("set_body", &Dynamics::set_body, py::arg("link"), py::arg("body"))
      .def("add_body", &Dynamics::add_body, py::arg("link"), py::arg("body"),
           py::arg("T_link_body") = kr5::Pose::Identity(), "Adds a body to a link.")
      .def("set_gravity", &Dynamics::set_gravity, py::arg("gravity"), "Sets gravity in B [m/s^2].")
      .def("torques", &torques, py::arg("q"), py::arg("qd"), py::arg("qdd"),
           py::arg("external") = std::vector<kr5::Vector6>(),
           "Joint torques of a motion; `external` is the wrench of the environment on each link, force first.")
      .def("gravity_torques", &Dynamics::gravity_torques, py::arg("q"), "Torques that hold the arm still.")
      .def("wrench", &Dynamics::wrench, py::arg("cut"),
           "Wrench through the cut on everything below it, for the motion of the last call of torques.")
      .def("joint_wrench", &Dynamics::joint_wrench, py::arg("link"),
           "Wrench on a link from the previous one, for the last call of torques.")
      .def(
          "loads",
          [](Dynamics& self, const Eigen::Ref<const Rows>& q, const Eigen::Ref<const Rows>& qd,
             const Eigen::Ref<const Rows>& qdd, const std::optional<SensorCut>& cut) {
            MotionLoads out = self.loads(q, qd, qdd, cut);
            return std::pair{std::move(out.tau), std::move(out.wrench)};
          },
          py::arg("q"), py::arg("qd"), py::arg("qdd"), py::arg("cut") = std::nullopt,
          py::call_guard<py::gil_scoped_release>(), "Torques (N x n) and wrench through the cut (N x 6) of every row.")
      .def("mass_matrix", py::overload_cast<const Eigen::VectorXd&>(&Dynamics::mass_matrix), py::arg("q"),
           "M(q), n x n.")
      .def("mass_diagonal", &Dynamics::mass_diagonal, py::arg("q"), "Diagonal of M(q).");
}

static py::array_t<double> regressor_rows(InertialRegressor& self, const Eigen::Ref<const Rows>& q,
                                          const Eigen::Ref<const Rows>& qd, const Eigen::Ref<const Rows>& qdd) {
  auto* Y = new Rows;
  const py::capsule owner(Y, [](void* p) { delete static_cast<Rows*>(p); });
  {
    const py::gil_scoped_release free;
    *Y = self.evaluate(q, qd, qdd);
  }
  return py::array_t<double>({Y->rows(), Y->cols()}, Y->data(), owner);
}

static void bind_regressor(py::module_& m) {
  py::class_<InertialRegressor>(
      m, "InertialRegressor",
      "Regressor Y with tau = Y chi; chi holds for each link m, m cx, m cy, m cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz, the\n"
      "inertia about the origin of the link frame [kg, kg m, kg m^2] (Hayat et al. 2022, eqs. 4.29-4.31).")
      .def(py::init<const DhChain&, const Eigen::Vector3d&>(), py::arg("chain"),
           py::arg("gravity") = Eigen::Vector3d(0.0, 0.0, -9.81))
      .def_property_readonly("joints", &InertialRegressor::joints, "Number of joints n.")
      .def_property_readonly("parameters", &InertialRegressor::parameters, "Number of columns, 10 n.")
      .def("evaluate", &regressor_rows, py::arg("q"), py::arg("qd"), py::arg("qdd"),
           "Y of every row of q, qd and qdd (N x n), stacked: (N n) x 10 n, row k n + i of sample k and joint i.");
  m.def(
      "inertial_parameters", [](const Body& body) { return inertial_parameters(body); }, py::arg("body"),
      "The ten standard inertial parameters of a body, in the order of InertialRegressor.");
  m.def(
      "body_from_parameters", [](const InertialParameters& p) { return to_body(to_moments(p)); }, py::arg("parameters"),
      "The body with these ten standard inertial parameters.");
  py::class_<Denoc>(m, "Denoc", "Factors of the regressor: Y = N_d^T N_l^T V (Hayat et al. 2022, eq. 4.29).")
      .def_readonly("N_l", &Denoc::N_l, "6n x 6n, twists of the links from those of the joints alone.")
      .def_readonly("N_d", &Denoc::N_d, "6n x n, twists of the joints from their rates.")
      .def_readonly("V", &Denoc::V, "6n x 10n, wrenches from standard inertial parameters.")
      .def("regressor", &Denoc::regressor, "Y, n x 10 n.")
      .def("twists", &Denoc::twists, py::arg("qd"), "Twists of the links, linear first, for joint rates.");
  m.def("denoc", &denoc, py::arg("chain"), py::arg("q"), py::arg("qd"), py::arg("qdd"),
        py::arg("gravity") = Eigen::Vector3d(0.0, 0.0, -9.81),
        "Decoupled natural orthogonal complement of a chain in motion.");
  m.def(
      "denoc_torques",
      [](const DhChain& chain, const std::vector<Body>& bodies, const Eigen::VectorXd& q, const Eigen::VectorXd& qd,
         const Eigen::VectorXd& qdd, const Eigen::Vector3d& g) { return denoc_torques(chain, bodies, q, qd, qdd, g); },
      py::arg("chain"), py::arg("bodies"), py::arg("q"), py::arg("qd"), py::arg("qdd"),
      py::arg("gravity") = Eigen::Vector3d(0.0, 0.0, -9.81), "Joint torques by the recursions of DeNOC.");
}

void bind_kinematics(py::module_& m) {
  m.doc() = "Chains of joints in Denavit-Hartenberg parameters: poses, inverse, masses.";
  bind_chain(m);
  bind_deviated_arm(m);
  bind_axes(m);
  bind_inverse(m);
  bind_workspace(m);
  bind_dynamics(m);
  bind_regressor(m);
}
