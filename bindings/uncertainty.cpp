// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/uncertainty/confidence.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::uncertainty;

void bind_uncertainty(py::module_& m) {
  m.doc() = "Confidence regions and intervals.";
  m.def("chi_square_quantile", &chi_square_quantile, py::arg("p"), py::arg("dof"),
        "Value that a chi-square variable stays below with probability p.");
  m.def("chi_square_cdf", &chi_square_cdf, py::arg("x"), py::arg("dof"), "Probability that it stays below x.");
  m.def("normal_factor", &normal_factor, py::arg("confidence") = 0.95,
        "Two-sided factor of a standard normal variable.");
  m.def("student_factor", &student_factor, py::arg("dof"), py::arg("confidence") = 0.95, "The same for Student's t.");
  m.def("covariance_inflation", &covariance_inflation, py::arg("numbers"), py::arg("dof"),
        "Factor for a covariance of so many numbers, estimated on dof degrees of freedom, after which its normal 95 % "
        "region is the one of Fisher's F.");
  kr5::python::bind_struct<Interval>(m, "Interval", "An interval of a number.")
      .def("contains", &Interval::contains, py::arg("x"));
  m.def("binomial_interval", &binomial_interval, py::arg("successes"), py::arg("trials"), py::arg("confidence") = 0.95,
        "Exact (Clopper-Pearson) interval of a rate.");
  m.def(
      "confidence_ellipsoid",
      [](const Eigen::MatrixXd& covariance, double confidence) {
        const Ellipsoid e = confidence_ellipsoid(covariance, confidence);
        return std::make_pair(e.semi_axes, e.directions);
      },
      py::arg("covariance"), py::arg("confidence") = 0.95,
      "Semi-axes (longest first) and their directions (columns) of the region that holds a normal vector.");
}
