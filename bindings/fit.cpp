// SPDX-License-Identifier: BSD-3-Clause
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <kr5/core/error.hpp>
#include <kr5/fit/measurements/distance.hpp>
#include <kr5/fit/measurements/pixels.hpp>
#include <kr5/fit/measurements/plane_point.hpp>
#include <kr5/fit/measurements/plane_profile.hpp>
#include <kr5/fit/measurements/pose.hpp>
#include <kr5/fit/measurements/position.hpp>
#include <kr5/fit/measurements/sphere_section.hpp>
#include <kr5/fit/pipeline/second_minimum.hpp>
#include <kr5/fit/problem.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::fit;
using kr5::python::bind_struct;

namespace {

using AnyPoint = std::variant<FitBlock, Eigen::VectorXd>;
using AnyNumber = std::variant<FitBlock, double>;
using AnyFactor = std::variant<FitBlock, kr5::Pose>;
using OptionalBlock = std::optional<FitBlock>;

FitPoint point_of(const AnyPoint& point) {
  if (const auto* block = std::get_if<FitBlock>(&point)) return *block;
  const auto& known = std::get<Eigen::VectorXd>(point);
  kr5::require(known.size() == 3,
               "a point has three coordinates or is a FitBlock, found " + std::to_string(known.size()) + " numbers");
  return Eigen::Vector3d(known);
}

FitNumber number_of(const AnyNumber& number) {
  if (const auto* block = std::get_if<FitBlock>(&number)) return *block;
  return std::get<double>(number);
}

void bind_handles(py::module_& m) {
  py::class_<FitBlock>(m, "FitBlock", "A block of parameters of a Problem, as the add_ methods return it.")
      .def(py::init<>(), "No block.")
      .def_readonly("index", &FitBlock::index, "Number within its Problem; -1: no block.")
      .def("exists", &FitBlock::exists, "Whether it is a block of a Problem.")
      .def("__repr__", [](FitBlock b) { return "FitBlock(index=" + std::to_string(b.index) + ")"; });
  py::class_<FitMeasurement>(m, "FitMeasurement", "A measurement of a Problem, as its add method returns it.")
      .def_readonly("index", &FitMeasurement::index, "Number within its Problem.")
      .def("__repr__", [](FitMeasurement o) { return "FitMeasurement(index=" + std::to_string(o.index) + ")"; });
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
  bind_struct<pipeline::SecondMinimum>(m, "SecondMinimum",
                                       "Another answer that explains the measurements nearly as well.");
  bind_struct<SolveOptions>(m, "SolveOptions", "Options of Problem.solve.");
  py::class_<Agreement>(m, "Agreement", "How measurements agree with the others.")
      .def_readonly("squared_distance", &Agreement::squared_distance,
                    "Squared distance from what all others say, in its own uncertainty: chi-square of `dof` [-].")
      .def_readonly("dof", &Agreement::dof, "Degrees of freedom.")
      .def_readonly("residuals", &Agreement::residuals,
                    "Residuals over their standard deviations, the nuisance eliminated [-].")
      .def_readonly("redundancy", &Agreement::redundancy,
                    "Share of each residual that the parameters do not take up [-].");
  py::class_<SquaredResiduals>(m, "SquaredResiduals",
                               "Sum of squared residuals as a function of the change d of the coordinates:\n"
                               "squares + 2 gradient' d + d' information d.")
      .def_readonly("squares", &SquaredResiduals::squares, "Sum at the result [-].")
      .def_readonly("rows", &SquaredResiduals::rows, "Number of residuals in the sum.")
      .def_readonly("gradient", &SquaredResiduals::gradient, "In the order of the coordinates.")
      .def_readonly("information", &SquaredResiduals::information, "Likewise.");
  py::class_<Solution>(m, "Solution", "Result of Problem.solve. Look at fit.usable first.")
      .def_readonly("fit", &Solution::fit, "Report of the estimation.")
      .def_readonly("coordinates", &Solution::coordinates,
                    "Free parameters, nuisances apart, with their units, such as \"arm.joint2.a [m]\".")
      .def_readonly("covariance", &Solution::covariance, "Covariance, in the order and units of `coordinates`.")
      .def_readonly("unidentifiable", &Solution::unidentifiable,
                    "Combinations that the measurements alone, without priors, do not determine.")
      .def_readonly("cost", &Solution::cost, "Sum of squared whitened residuals, priors included [-].")
      .def_readonly("undetermined", &Solution::undetermined,
                    "Coordinates with a part that not even a prior holds: of infinite variance.")
      .def_readonly("residuals", &Solution::residuals, "Number of residuals, priors not counted.")
      .def("places", &Solution::places, py::arg("block"),
           "Places of the coordinates of a block in `coordinates`; -1 for one that is held.")
      .def(
          "agreement",
          [](const Solution& self, const Problem& problem,
             const std::variant<FitMeasurement, std::vector<FitMeasurement>>& which) {
            if (const auto* one = std::get_if<FitMeasurement>(&which)) return self.agreement(problem, *one);
            return self.agreement(problem, std::get<std::vector<FitMeasurement>>(which));
          },
          py::arg("problem"), py::arg("measurements"),
          "How a measurement, or several made at once, agree with all others, at the problem's present values.")
      .def(
          "squared_residuals",
          [](const Solution& self, const Problem& problem, const std::vector<FitMeasurement>& measurements,
             int first_row, int end_row) { return self.squared_residuals(problem, measurements, first_row, end_row); },
          py::arg("problem"), py::arg("measurements"), py::arg("first_row"), py::arg("end_row"),
          "Sum over rows first_row up to, not including, end_row of the residuals of some measurements, near the\n"
          "solution.\n\nRaises\n------\nkr5.InvalidArgument\n    A measurement with a nuisance.")
      .def("prior_redundancy", &Solution::prior_redundancy, py::arg("problem"), py::arg("block"),
           "Share of the prior's information on each coordinate that agrees with the data [-].");
}

void bind_blocks(py::class_<Problem>& fit) {
  fit.def("add_pose", &Problem::add_pose, py::arg("name"), py::arg("start"),
          "Adds a pose (4 x 4), with the coordinates x y z [m] rx ry rz [rad] of a right perturbation.")
      .def("add_nuisance_pose", &Problem::add_nuisance_pose, py::arg("name"),
           py::arg("start") = kr5::Pose(kr5::Pose::Identity()),
           "Adds a pose that belongs to one measurement, such as the error of a robot pose. It is eliminated from the\n"
           "equations and not in the result; a measurement may have one.")
      .def("add_nuisance_vector", &Problem::add_nuisance_vector, py::arg("name"), py::arg("start"),
           py::arg("coordinates"), "The same of numbers, named with their units, such as \"q3 [rad]\".")
      .def("add_arm", &Problem::add_arm, py::arg("name"), py::arg("start"),
           "Adds an arm, with five coordinates a joint: b [m] theta_offset [rad] a [m] alpha [rad] beta [rad].")
      .def("add_point", &Problem::add_point, py::arg("name"), py::arg("start"), "Adds a point, (3,) [m].")
      .def("add_vector", &Problem::add_vector, py::arg("name"), py::arg("start"), py::arg("coordinates"),
           "Adds numbers, named with their units, such as \"joint2.compliance [rad/(N m)]\".")
      .def("add_camera", &Problem::add_camera, py::arg("name"), py::arg("start"),
           "Adds a camera, with the coordinates of kr5.Pinhole [px or -].")
      .def("hold", py::overload_cast<FitBlock, int>(&Problem::hold), py::arg("block"), py::arg("coordinate") = -1,
           "Keeps a coordinate of a block, counted from 0, at its start; -1: all of them.")
      .def("tie", &Problem::tie, py::arg("block"), py::arg("leader"), py::arg("follower"), py::arg("ratio") = 1.0,
           "Lets a coordinate of a block change as another one does, times `ratio`: square pixels tie fy to fx.")
      .def("hold", py::overload_cast<const std::string&>(&Problem::hold), py::arg("name"),
           "Keeps a block, or one coordinate such as \"arm.joint2.a\", at its start; False when there is none.")
      .def("any_free", &Problem::any_free,
           "Whether a measurement that takes part depends on a coordinate that is not held.")
      .def("set_prior", &Problem::set_prior, py::arg("block"), py::arg("sigma"),
           "Standard deviation of each coordinate about its start, in its unit; infinite where nothing is known.")
      .def("begin_at", py::overload_cast<FitBlock, const Eigen::VectorXd&>(&Problem::begin_at), py::arg("block"),
           py::arg("values"),
           "Values, as values() gives them, from which the next solve begins; a prior stays about the block's start.")
      .def("begin_at", py::overload_cast<FitBlock, const kr5::Pose&>(&Problem::begin_at), py::arg("block"),
           py::arg("pose"), "Pose (4 x 4) from which the next solve begins.");
}

/// A kind of measurement, and the overload of Problem.add that takes it.
template <class Kind>
py::class_<Kind> bind_measurement(py::module_& m, py::class_<Problem>& problem, const char* name, const char* doc) {
  py::class_<Kind> kind(m, name, doc);
  problem.def(
      "add", [](Problem& self, const Kind& measurement) { return self.add(measurement); }, py::arg("measurement"),
      "Adds a measurement.\n\nRaises\n------\nkr5.InvalidArgument\n    It does not fit the blocks that it depends on.");
  return kind;
}

void bind_pose(py::module_& m, py::class_<Problem>& problem) {
  bind_measurement<PoseMeasurement>(m, problem, "PoseMeasurement", "Whole pose of the last frame of a chain.")
      .def(py::init<PoseChain, const kr5::Pose&, double, double>(), py::arg("chain"), py::arg("seen"),
           py::arg("sigma_position"), py::arg("sigma_rotation"),
           "Where it was seen (4 x 4), with standard deviations per axis [m] and [rad].")
      .def(py::init<PoseChain, const kr5::Pose&, const kr5::Matrix6&>(), py::arg("chain"), py::arg("seen"),
           py::arg("covariance"), "The same with the covariance of the pose, right perturbation (6 x 6 [m, rad]).");
}

void bind_position(py::module_& m, py::class_<Problem>& problem) {
  bind_measurement<PositionMeasurement>(m, problem, "PositionMeasurement",
                                        "Place of a point of the last frame of a chain.")
      .def(py::init([](const PoseChain& chain, const AnyPoint& point, const AnyPoint& seen,
                       const std::variant<double, Eigen::MatrixXd>& noise) {
             if (const auto* sigma = std::get_if<double>(&noise))
               return PositionMeasurement(chain, point_of(point), point_of(seen), *sigma);
             const auto& covariance = std::get<Eigen::MatrixXd>(noise);
             kr5::require(covariance.rows() == 3 && covariance.cols() == 3,
                          "noise must be a standard deviation [m] or a covariance, 3 x 3 [m^2]");
             return PositionMeasurement(chain, point_of(point), point_of(seen), Eigen::Matrix3d(covariance));
           }),
           py::arg("chain"), py::arg("point"), py::arg("seen"), py::arg("noise"),
           "Parameters\n----------\npoint\n    Known point, (3,) [m], or a block made by add_point.\n"
           "seen\n    Where it was seen in the first frame, (3,) [m], or a block: a place that measurements share.\n"
           "noise\n    Standard deviation per axis [m], or covariance, 3 x 3 [m^2].");
}

void bind_distance(py::module_& m, py::class_<Problem>& problem) {
  bind_measurement<DistanceMeasurement>(m, problem, "DistanceMeasurement",
                                        "Distance of a point of the last frame of a chain from one of its first.")
      .def(py::init([](const PoseChain& chain, const AnyPoint& point, const AnyPoint& other, const AnyNumber& distance,
                       double sigma) {
             return DistanceMeasurement(chain, point_of(point), point_of(other), number_of(distance), sigma);
           }),
           py::arg("chain"), py::arg("point"), py::arg("other"), py::arg("distance"), py::arg("sigma"),
           "With its standard deviation [m]. `distance` [m] may be a block of one number, that several measurements\n"
           "share: points on a sphere.");
}

void bind_plane(py::module_& m, py::class_<Problem>& problem) {
  bind_measurement<PlanePointMeasurement>(m, problem, "PlanePointMeasurement",
                                          "A point of the last frame of a chain on the plane z = 0 of its first frame.")
      .def(py::init([](const PoseChain& chain, const AnyPoint& point, double sigma) {
             return PlanePointMeasurement(chain, point_of(point), sigma);
           }),
           py::arg("chain"), py::arg("point"), py::arg("sigma"), "With its standard deviation [m].");
  bind_measurement<PlaneProfileMeasurement>(m, problem, "PlaneProfileMeasurement",
                                            "Points of the last frame of a chain on the plane z = 0 of its first.")
      .def(py::init<PoseChain, Eigen::Matrix3Xd, const Eigen::MatrixXd&>(), py::arg("chain"), py::arg("points"),
           py::arg("covariance"),
           "Points (3 x n or n x 3 [m]), with the covariance of their distances from the plane (n x n [m^2]).");
}

void bind_sphere_section(py::module_& m, py::class_<Problem>& problem) {
  bind_measurement<SphereSectionMeasurement>(m, problem, "SphereSectionMeasurement",
                                             "The circle that a scanner, at the first frame, sees of a sphere.")
      .def(py::init([](const PoseChain& chain, const AnyPoint& centre, const AnyNumber& radius,
                       const Eigen::VectorXd& section, const Eigen::MatrixXd& covariance) {
             kr5::require(section.size() == 3 && covariance.rows() == 3 && covariance.cols() == 3,
                          "section must be x, z and radius [m], and covariance theirs, 3 x 3 [m^2]");
             return SphereSectionMeasurement(chain, point_of(centre), number_of(radius), Eigen::Vector3d(section),
                                             Eigen::Matrix3d(covariance));
           }),
           py::arg("chain"), py::arg("centre"), py::arg("radius"), py::arg("section"), py::arg("covariance"),
           "x, z and radius [m] of the section by the plane y = 0 of the first frame, with their covariance\n"
           "(3 x 3 [m^2]). `centre` is that of the sphere, in the last frame; `radius` [m] may be a block of one "
           "number.");
}

void bind_pixels(py::module_& m, py::class_<Problem>& problem) {
  bind_measurement<PixelMeasurement>(m, problem, "PixelMeasurement",
                                     "Pixels of points of the last frame of a chain that begins in the camera.")
      .def(py::init([](const PoseChain& T_camera_target, FitBlock camera, const Eigen::Matrix3Xd& points,
                       const Eigen::Matrix2Xd& pixels, double sigma, FitBlock amounts,
                       const Eigen::MatrixXd& displacements) {
             return PixelMeasurement(T_camera_target, camera, points, pixels, sigma, {amounts, displacements});
           }),
           py::arg("T_camera_target"), py::arg("camera"), py::arg("points"), py::arg("pixels"), py::arg("sigma"),
           py::arg("amounts") = FitBlock(), py::arg("displacements") = Eigen::MatrixXd(),
           "Pixels (2 x n or n x 2) of points (3 x n or n x 3 [m]), with their standard deviation per axis [px]. Point "
           "k\n"
           "of a target that departs from its nominal points is moved by rows 3 k to 3 k + 2 of `displacements`\n"
           "(3 n x m [m per unit]) times the numbers of the block `amounts`.");
}

void bind_noise(py::class_<Problem>& problem) {
  problem
      .def("set_weight", &Problem::set_weight, py::arg("measurement"), py::arg("weight"),
           "Takes a measurement out (0) or gives it another weight [-].")
      .def("set_covariance", &Problem::set_covariance, py::arg("measurement"), py::arg("covariance"),
           "Gives a measurement of a pose, a position, points on a plane or a sphere's section another covariance.")
      .def(
          "set_pixel_sigmas",
          [](Problem& self, FitMeasurement measurement, const Eigen::VectorXd& sigmas) {
            self.measurement<PixelMeasurement>(measurement).set_sigmas(sigmas);
          },
          py::arg("measurement"), py::arg("sigmas"),
          "Standard deviation of each point of a measurement of pixels, (n,) [px]; infinite: it has no part.");
}

void bind_evaluation(py::class_<Problem>& fit) {
  fit.def("solve", &Problem::solve, py::arg("options") = SolveOptions{}, py::call_guard<py::gil_scoped_release>(),
          "Minimises from the present values and keeps what it found.\n\n"
          "Raises\n------\nkr5.InvalidArgument\n    Nothing is free.")
      .def("pose", &Problem::pose, py::arg("block"), "Present pose of a block, 4 x 4 [m].")
      .def("arm", &Problem::arm, py::arg("block"), "Present arm of a block.")
      .def("camera", &Problem::camera, py::arg("block"), "Present camera of a block.")
      .def("values", &Problem::values, py::arg("block"), "Present numbers of a block, as stored; of a pose see pose().")
      .def("residuals", &Problem::residuals, py::arg("measurement"),
           "Residuals of a measurement over their standard deviations, at the present values [-].")
      .def("change", &Problem::change, py::arg("block"), "Change of each coordinate from its start, in its unit.");
}

}  // namespace

void bind_fit(py::module_& m) {
  m.doc() = "Fit of a cell to any mixture of measurements.";
  bind_handles(m);
  bind_chain(m);
  py::class_<Problem> fit(
      m, "Problem",
      "Least-squares problem of a cell: blocks of parameters (add_), measurements along chains of poses (add),\n"
      "their solution (solve). Residuals are whitened by the given standard deviations.");
  fit.def(py::init<>());
  bind_results(m);
  bind_blocks(fit);
  bind_pose(m, fit);
  bind_position(m, fit);
  bind_distance(m, fit);
  bind_plane(m, fit);
  bind_sphere_section(m, fit);
  bind_pixels(m, fit);
  bind_noise(fit);
  bind_evaluation(fit);
}
