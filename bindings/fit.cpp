// SPDX-License-Identifier: BSD-3-Clause
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/fit/cell_fit.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::fit;
using kr5::python::bind_struct;

namespace {

using AnyPoint = std::variant<FitBlock, Eigen::VectorXd>;
using AnyFactor = std::variant<FitBlock, kr5::Pose>;
using OptionalBlock = std::optional<FitBlock>;

FitPoint point_of(const AnyPoint& point) {
  if (const auto* block = std::get_if<FitBlock>(&point)) return *block;
  const auto& known = std::get<Eigen::VectorXd>(point);
  kr5::require(known.size() == 3,
               "a point has three coordinates or is a FitBlock, found " + std::to_string(known.size()) + " numbers");
  return Eigen::Vector3d(known);
}

FitObservation observe_position(CellFit& fit, const PoseChain& chain, const AnyPoint& point, const AnyPoint& seen,
                                const std::variant<double, Eigen::MatrixXd>& noise) {
  if (const auto* sigma = std::get_if<double>(&noise))
    return fit.observe_position(chain, point_of(point), point_of(seen), *sigma);
  const auto& covariance = std::get<Eigen::MatrixXd>(noise);
  kr5::require(covariance.rows() == 3 && covariance.cols() == 3,
               "noise must be a standard deviation [m] or a covariance, 3 x 3 [m^2]");
  return fit.observe_position(chain, point_of(point), point_of(seen), Eigen::Matrix3d(covariance));
}

void bind_handles(py::module_& m) {
  py::class_<FitBlock>(m, "FitBlock", "A block of parameters of a CellFit, as the add_ methods return it.")
      .def(py::init<>(), "No block.")
      .def_readonly("index", &FitBlock::index, "Number within its CellFit; -1: no block.")
      .def("exists", &FitBlock::exists, "Whether it is a block of a CellFit.")
      .def("__repr__", [](FitBlock b) { return "FitBlock(index=" + std::to_string(b.index) + ")"; });
  py::class_<FitObservation>(m, "FitObservation", "A measurement of a CellFit, as the observe_ methods return it.")
      .def_readonly("index", &FitObservation::index, "Number within its CellFit.")
      .def("__repr__", [](FitObservation o) { return "FitObservation(index=" + std::to_string(o.index) + ")"; });
}

void bind_chain(py::module_& m) {
  const auto terms_or_none = [](const OptionalBlock& terms) { return terms.value_or(FitBlock{}); };
  py::class_<PoseChain>(
      m, "PoseChain",
      "Product of poses, from the frame in which something is measured to the frame that is measured. Each method\n"
      "appends a factor to this chain and returns it.")
      .def(py::init<>())
      .def(
          "then",
          [](PoseChain& self, const AnyFactor& pose) -> PoseChain& {
            return std::visit([&](const auto& p) -> PoseChain& { return self.then(p); }, pose);
          },
          py::arg("pose"), "Appends a known pose (4 x 4 [m]) or a block made by add_pose or add_nuisance_pose.")
      .def("then_inverse", py::overload_cast<FitBlock>(&PoseChain::then_inverse), py::arg("pose"),
           "Appends the inverse of the pose of a block.")
      .def(
          "then_arm",
          [terms_or_none](PoseChain& self, FitBlock arm, const Eigen::VectorXd& q, const OptionalBlock& joint_terms,
                          const Eigen::MatrixXd& regressor) -> PoseChain& {
            return self.then_arm(arm, q, terms_or_none(joint_terms), regressor);
          },
          py::arg("arm"), py::arg("q"), py::arg("joint_terms") = py::none(), py::arg("regressor") = Eigen::MatrixXd(),
          "Appends the pose of the flange in frame 0 of an arm.\n\n"
          "Parameters\n----------\narm\n    Block made by add_arm.\nq\n    Joint values, (n,) [rad or m].\n"
          "joint_terms\n    Block of m coefficients c of joint errors, made by add_vector; the arm then stands at\n"
          "    q + regressor c.\nregressor\n    Their effect on the joints, n x m.")
      .def(
          "then_inverse_arm",
          [terms_or_none](PoseChain& self, FitBlock arm, const Eigen::VectorXd& q, const OptionalBlock& joint_terms,
                          const Eigen::MatrixXd& regressor) -> PoseChain& {
            return self.then_inverse_arm(arm, q, terms_or_none(joint_terms), regressor);
          },
          py::arg("arm"), py::arg("q"), py::arg("joint_terms") = py::none(), py::arg("regressor") = Eigen::MatrixXd(),
          "Appends the inverse of what then_arm appends.");
}

void bind_results(py::module_& m) {
  bind_struct<UnidentifiableDirection>(m, "UnidentifiableDirection",
                                       "Combination of parameters that the measurements leave open.");
  bind_struct<CellFitOptions>(m, "CellFitOptions", "Options of CellFit.solve.");
  py::class_<CellFitResult>(m, "CellFitResult", "Result of CellFit.solve. Look at fit.usable first.")
      .def_readonly("fit", &CellFitResult::fit, "Report of the estimation.")
      .def_readonly("coordinates", &CellFitResult::coordinates,
                    "Free parameters, nuisances apart, with their units, such as \"arm.joint2.a [m]\".")
      .def_readonly("covariance", &CellFitResult::covariance, "Covariance, in the order and units of `coordinates`.")
      .def_readonly("unidentifiable", &CellFitResult::unidentifiable,
                    "Combinations that the measurements alone, without priors, do not determine.")
      .def_readonly("cost", &CellFitResult::cost, "Sum of squared whitened residuals, priors included [-].")
      .def_readonly("residuals", &CellFitResult::residuals, "Number of residuals, priors not counted.");
  py::class_<CellFit::Agreement>(m, "Agreement", "How measurements agree with the others, at the last result.")
      .def_readonly("squared_distance", &CellFit::Agreement::squared_distance,
                    "Squared distance from what all others say, in its own uncertainty: chi-square of `dof` [-].")
      .def_readonly("dof", &CellFit::Agreement::dof, "Degrees of freedom.")
      .def_readonly("residuals", &CellFit::Agreement::residuals,
                    "Residuals over their standard deviations, the nuisance eliminated [-].")
      .def_readonly("redundancy", &CellFit::Agreement::redundancy,
                    "Share of each residual that the parameters do not take up [-].");
  py::class_<CellFit::SquaredResiduals>(m, "SquaredResiduals",
                                        "Sum of squared residuals as a function of the change d of the coordinates:\n"
                                        "squares + 2 gradient' d + d' information d.")
      .def_readonly("squares", &CellFit::SquaredResiduals::squares, "Sum at the result [-].")
      .def_readonly("rows", &CellFit::SquaredResiduals::rows, "Number of residuals in the sum.")
      .def_readonly("gradient", &CellFit::SquaredResiduals::gradient, "In the order of the coordinates.")
      .def_readonly("information", &CellFit::SquaredResiduals::information, "Likewise.");
}

void bind_blocks(py::class_<CellFit>& fit) {
  fit.def("add_pose", &CellFit::add_pose, py::arg("name"), py::arg("start"),
          "Adds a pose (4 x 4), with the coordinates x y z [m] rx ry rz [rad] of a right perturbation.")
      .def("add_nuisance_pose", &CellFit::add_nuisance_pose, py::arg("name"),
           py::arg("start") = kr5::Pose(kr5::Pose::Identity()),
           "Adds a pose that belongs to one measurement, such as the error of a robot pose. It is eliminated from the\n"
           "equations and not in the result; a measurement may have one.")
      .def("add_nuisance_vector", &CellFit::add_nuisance_vector, py::arg("name"), py::arg("start"),
           py::arg("coordinates"), "The same of numbers, named with their units, such as \"q3 [rad]\".")
      .def("add_arm", &CellFit::add_arm, py::arg("name"), py::arg("start"),
           "Adds an arm, with five coordinates a joint: b [m] theta_offset [rad] a [m] alpha [rad] beta [rad].")
      .def("add_point", &CellFit::add_point, py::arg("name"), py::arg("start"), "Adds a point, (3,) [m].")
      .def("add_vector", &CellFit::add_vector, py::arg("name"), py::arg("start"), py::arg("coordinates"),
           "Adds numbers, named with their units, such as \"joint2.compliance [rad/(N m)]\".")
      .def("add_camera", &CellFit::add_camera, py::arg("name"), py::arg("start"),
           "Adds a camera, with the coordinates of kr5.Pinhole [px or -].")
      .def("hold", py::overload_cast<FitBlock, int>(&CellFit::hold), py::arg("block"), py::arg("coordinate") = -1,
           "Keeps a coordinate of a block, counted from 0, at its start; -1: all of them.")
      .def("tie", &CellFit::tie, py::arg("block"), py::arg("leader"), py::arg("follower"), py::arg("ratio") = 1.0,
           "Lets a coordinate of a block change as another one does, times `ratio`: square pixels tie fy to fx.")
      .def("hold", py::overload_cast<const std::string&>(&CellFit::hold), py::arg("name"),
           "Keeps a block, or one coordinate such as \"arm.joint2.a\", at its start; False when there is none.")
      .def("any_free", &CellFit::any_free,
           "Whether a measurement that takes part depends on a coordinate that is not held.")
      .def("set_prior", &CellFit::set_prior, py::arg("block"), py::arg("sigma"),
           "Standard deviation of each coordinate about its start, in its unit; infinite where nothing is known.")
      .def("begin_at", py::overload_cast<FitBlock, const Eigen::VectorXd&>(&CellFit::begin_at), py::arg("block"),
           py::arg("values"),
           "Values, as values() gives them, from which the next solve begins; a prior stays about the block's start.")
      .def("begin_at", py::overload_cast<FitBlock, const kr5::Pose&>(&CellFit::begin_at), py::arg("block"),
           py::arg("pose"), "Pose (4 x 4) from which the next solve begins.");
}

void bind_observations(py::class_<CellFit>& fit) {
  fit.def("observe_pose", py::overload_cast<const PoseChain&, const kr5::Pose&, double, double>(&CellFit::observe_pose),
          py::arg("chain"), py::arg("seen"), py::arg("sigma_position"), py::arg("sigma_rotation"),
          "Whole pose of the last frame of a chain (4 x 4), with standard deviations per axis [m] and [rad].")
      .def("observe_pose",
           py::overload_cast<const PoseChain&, const kr5::Pose&, const kr5::Matrix6&>(&CellFit::observe_pose),
           py::arg("chain"), py::arg("seen"), py::arg("covariance"),
           "The same with the covariance of the pose, right perturbation (6 x 6 [m, rad]).")
      .def("observe_position", &observe_position, py::arg("chain"), py::arg("point"), py::arg("seen"), py::arg("noise"),
           "Place of a point of the last frame of a chain.\n\n"
           "Parameters\n----------\npoint\n    Known point, (3,) [m], or a block made by add_point.\n"
           "seen\n    Where it was seen in the first frame, (3,) [m], or a block: a place that measurements share.\n"
           "noise\n    Standard deviation per axis [m], or covariance, 3 x 3 [m^2].")
      .def(
          "observe_distance",
          [](CellFit& self, const PoseChain& chain, const AnyPoint& point, const AnyPoint& other, double distance,
             double sigma, const OptionalBlock& radius) {
            return self.observe_distance(chain, point_of(point), point_of(other), distance, sigma,
                                         radius.value_or(FitBlock{}));
          },
          py::arg("chain"), py::arg("point"), py::arg("other"), py::arg("distance"), py::arg("sigma"),
          py::arg("radius") = py::none(),
          "Distance of a point of the last frame from a point of the first frame, with its standard deviation [m].\n"
          "With `radius`, a block of one number, the distance is that number: a point on a sphere.")
      .def(
          "observe_on_plane",
          [](CellFit& self, const PoseChain& chain, const AnyPoint& point, double sigma) {
            return self.observe_on_plane(chain, point_of(point), sigma);
          },
          py::arg("chain"), py::arg("point"), py::arg("sigma"),
          "A point of the last frame on the plane z = 0 of the first frame, with its standard deviation [m].")
      .def("observe_points_on_plane",
           py::overload_cast<const PoseChain&, const Eigen::Matrix3Xd&, const Eigen::MatrixXd&>(
               &CellFit::observe_on_plane),
           py::arg("chain"), py::arg("points"), py::arg("covariance"),
           "Points (3 x n or n x 3 [m]) of the last frame on that plane, with the covariance of their distances from "
           "it\n"
           "(n x n [m^2]).")
      .def(
          "observe_sphere_section",
          [](CellFit& self, const PoseChain& chain, const AnyPoint& centre, double radius, const Eigen::VectorXd& seen,
             const Eigen::MatrixXd& covariance, const OptionalBlock& radius_block) {
            kr5::require(seen.size() == 3 && covariance.rows() == 3 && covariance.cols() == 3,
                         "seen must be x, z and radius [m], and covariance theirs, 3 x 3 [m^2]");
            return self.observe_sphere_section(chain, point_of(centre), radius, Eigen::Vector3d(seen),
                                               Eigen::Matrix3d(covariance), radius_block.value_or(FitBlock{}));
          },
          py::arg("chain"), py::arg("centre"), py::arg("radius"), py::arg("seen"), py::arg("covariance"),
          py::arg("radius_block") = py::none(),
          "Circle that a scanner sees of a sphere: x, z and radius [m] of the section by the plane y = 0 of the first\n"
          "frame, with their covariance (3 x 3 [m^2]). `centre` is that of the sphere, in the last frame. With\n"
          "`radius_block`, a block of one number, the radius of the sphere is that number.")
      .def(
          "observe_pixels",
          [](CellFit& self, const PoseChain& T_camera_target, FitBlock camera, const Eigen::Matrix3Xd& points,
             const Eigen::Matrix2Xd& pixels, double sigma, FitBlock amounts, const Eigen::MatrixXd& displacements) {
            return self.observe_pixels(T_camera_target, camera, points, pixels, sigma, {amounts, displacements});
          },
          py::arg("T_camera_target"), py::arg("camera"), py::arg("points"), py::arg("pixels"), py::arg("sigma"),
          py::arg("amounts") = FitBlock(), py::arg("displacements") = Eigen::MatrixXd(),
          "Pixels (2 x n or n x 2) of points (3 x n or n x 3 [m]) of the last frame of a chain that begins in the "
          "camera, with their\n"
          "standard deviation per axis [px]. Point k of a target that departs from its nominal points is moved by "
          "rows\n"
          "3 k to 3 k + 2 of `displacements` (3 n x m [m per unit]) times the numbers of the block `amounts`.")
      .def("set_weight", &CellFit::set_weight, py::arg("observation"), py::arg("weight"),
           "Takes a measurement out (0) or gives it another weight [-].")
      .def("set_covariance", &CellFit::set_covariance, py::arg("observation"), py::arg("covariance"),
           "Gives a measurement of a pose, a position, points on a plane or a sphere's section another covariance.")
      .def("set_pixel_sigmas", &CellFit::set_pixel_sigmas, py::arg("observation"), py::arg("sigmas"),
           "Standard deviation of each point of a measurement of pixels, (n,) [px]; infinite: it has no part.");
}

void bind_evaluation(py::class_<CellFit>& fit) {
  fit.def("solve", &CellFit::solve, py::arg("options") = CellFitOptions{}, py::call_guard<py::gil_scoped_release>(),
          "Minimises from the present values and keeps what it found.\n\n"
          "Raises\n------\nkr5.InvalidArgument\n    Nothing is free.")
      .def("pose", &CellFit::pose, py::arg("block"), "Present pose of a block, 4 x 4 [m].")
      .def("arm", &CellFit::arm, py::arg("block"), "Present arm of a block.")
      .def("camera", &CellFit::camera, py::arg("block"), "Present camera of a block.")
      .def("values", &CellFit::values, py::arg("block"), "Present numbers of a block, as stored; of a pose see pose().")
      .def("coordinates", &CellFit::coordinates, py::arg("block"),
           "Places of the free coordinates of a block in the last result; -1 for one that is held.")
      .def("residuals", &CellFit::residuals, py::arg("observation"),
           "Residuals of a measurement over their standard deviations, at the present values [-].")
      .def(
          "squared_residuals",
          [](const CellFit& self, const std::vector<FitObservation>& observations, int first_row, int end_row) {
            return self.squared_residuals(observations, first_row, end_row);
          },
          py::arg("observations"), py::arg("first_row"), py::arg("end_row"),
          "Sum over rows first_row up to, not including, end_row of the residuals of some measurements, near the last\n"
          "result.\n\nRaises\n------\nkr5.InvalidArgument\n    A measurement with a nuisance.")
      .def(
          "agreement",
          [](const CellFit& self, const std::variant<FitObservation, std::vector<FitObservation>>& which) {
            if (const auto* one = std::get_if<FitObservation>(&which)) return self.agreement(*one);
            return self.agreement(std::get<std::vector<FitObservation>>(which));
          },
          py::arg("observations"),
          "How a measurement, or several made at once, agree with all others, at the last result.")
      .def("prior_redundancy", &CellFit::prior_redundancy, py::arg("block"),
           "Share of the prior's information on each coordinate that agrees with the data [-].")
      .def("change", &CellFit::change, py::arg("block"), "Change of each coordinate from its start, in its unit.");
}

}  // namespace

void bind_fit(py::module_& m) {
  m.doc() = "Fit of a cell to any mixture of measurements.";
  bind_handles(m);
  bind_chain(m);
  bind_results(m);
  py::class_<CellFit> fit(
      m, "CellFit",
      "Least-squares problem of a cell: blocks of parameters (add_), measurements along chains of poses (observe_),\n"
      "their solution (solve). Residuals are whitened by the given standard deviations.");
  fit.def(py::init<>());
  bind_blocks(fit);
  bind_observations(fit);
  bind_evaluation(fit);
}
