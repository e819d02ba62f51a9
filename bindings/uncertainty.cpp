// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/functional.h>

#include <kr5/uncertainty/confidence.hpp>
#include <kr5/uncertainty/sobol.hpp>
#include <kr5/uncertainty/trials.hpp>

#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::uncertainty;

static void bind_sensitivity(py::module_& m) {
  kr5::python::bind_enum<InputLaw>(m, "InputLaw", "Distribution of an input.");
  kr5::python::bind_struct<UncertainInput>(m, "UncertainInput", "Uncertain input of a model.")
      .def("quantile", &UncertainInput::quantile, py::arg("u"), "Value that it stays below with probability u.");
  kr5::python::bind_struct<SobolOptions>(m, "SobolOptions", "Options of sobol_indices.");
  kr5::python::bind_struct<SobolResult>(m, "SobolResult", "Sobol's indices with their intervals.");
  kr5::python::bind_struct<OneAtATime>(m, "OneAtATime", "Outputs when one input alone is changed.");
  m.def("sobol_indices", &sobol_indices, py::arg("model"), py::arg("inputs"), py::arg("options") = SobolOptions(),
        "Sobol's first-order and total indices. `model` takes inputs (samples x inputs) and gives outputs (samples x\n"
        "outputs).\n\n"
        "Raises\n------\nkr5.InvalidArgument\n    No inputs, or outputs that are not finite or of another size.");
  m.def("sobol_design", &sobol_design, py::arg("inputs"), py::arg("first"), py::arg("rows"),
        py::arg("options") = SobolOptions(), py::call_guard<py::gil_scoped_release>(),
        "Inputs at which the model is to be evaluated for rows of the sample matrices, in the order of SALib.");
  m.def("sobol_estimate", &sobol_estimate, py::arg("outputs"), py::arg("inputs"), py::arg("options") = SobolOptions(),
        py::call_guard<py::gil_scoped_release>(), "Sobol's indices from the outputs at a design.");
  m.def("intervals_within", &intervals_within, py::arg("result"), py::arg("tolerance"),
        "Whether half of every interval is at most the tolerance.");
  m.def("one_at_a_time", &one_at_a_time, py::arg("model"), py::arg("inputs"), py::arg("steps") = 13,
        "Changes of the outputs when one input alone is changed, by a standard deviation and over its range.");
}

static void bind_trials(py::module_& m) {
  kr5::python::bind_struct<Count>(m, "Count", "Number of successes in a number of trials.");
  kr5::python::bind_struct<SuccessRate>(m, "SuccessRate", "Share of successes with its exact intervals.");
  kr5::python::bind_struct<RateTest>(m, "RateTest", "Whether a rate is below the wanted one.");
  kr5::python::bind_struct<SampleMedian>(m, "SampleMedian", "Median of values with its interval.");
  m.def("success_rate", &success_rate, py::arg("count"),
        "Rate of a Count with its exact (Clopper and Pearson) two-sided 95 % interval and one-sided lower bound [-].");
  m.def(
      "test_rates",
      [](const std::vector<Count>& counts, double rate, double level) { return test_rates(counts, rate, level); },
      py::arg("counts"), py::arg("rate"), py::arg("level") = 0.05,
      "Which of the rates are below `rate`: exact one-sided binomial tests, corrected after Holm, so that with the\n"
      "probability `level` at most any of them is called so wrongly.\n\n"
      "Returns\n-------\nlist of RateTest\n\n"
      "Raises\n------\nkr5.InvalidArgument\n    A count without trials, a rate or a level outside 0 to 1.");
  m.def("same_rate_probability", &same_rate_probability, py::arg("one"), py::arg("other"),
        "Probability of two Counts at least as unlikely as these when both have the same rate: Fisher's exact test.");
  m.def("sample_median", &sample_median, py::arg("values"),
        "Median of values with its interval from order statistics (at least 95 %; None of fewer than six values), and\n"
        "the 90 % quantile. Raises InvalidArgument without values, or for one that is not finite.");
}

void bind_uncertainty(py::module_& m) {
  m.doc() = "Confidence regions and intervals.";
  m.def("chi_square_quantile", &chi_square_quantile, py::arg("p"), py::arg("dof"),
        "Quantile of the chi-square distribution: a variable stays below it with probability p.");
  m.def("chi_square_cdf", &chi_square_cdf, py::arg("x"), py::arg("dof"),
        "Distribution function of the chi-square distribution: probability of a value below x.");
  m.def("normal_factor", &normal_factor, py::arg("confidence") = 0.95,
        "Two-sided factor of a standard normal variable.");
  m.def("student_factor", &student_factor, py::arg("dof"), py::arg("confidence") = 0.95,
        "Two-sided factor of a variable of Student's t distribution.");
  m.def("covariance_inflation", &covariance_inflation, py::arg("numbers"), py::arg("dof"),
        "Inflation factor for a covariance of this dimension, estimated with dof degrees of freedom, with which its "
        "normal 95 % region equals that of Fisher's F.");
  kr5::python::bind_struct<Interval>(m, "Interval", "Interval of a number.")
      .def("contains", &Interval::contains, py::arg("x"));
  m.def("binomial_interval", &binomial_interval, py::arg("successes"), py::arg("trials"), py::arg("confidence") = 0.95,
        "Exact (Clopper and Pearson) interval of a rate.");
  m.def(
      "confidence_ellipsoid",
      [](const Eigen::MatrixXd& covariance, double confidence) {
        const Ellipsoid e = confidence_ellipsoid(covariance, confidence);
        return std::make_pair(e.semi_axes, e.directions);
      },
      py::arg("covariance"), py::arg("confidence") = 0.95,
      "Semi-axes (longest first) and their directions (columns) of the confidence region of a normal vector.");
  bind_trials(m);
  bind_sensitivity(m);
}
