// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/core/error.hpp>
#include <kr5/force/contact_wrench.hpp>
#include <kr5/force/peg_on_tube.hpp>

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

}  // namespace

void bind_force(py::module_& m) {
  m.doc() = "Contact of peg, tube and bench.";
  bind_rest(m);
  bind_contacts(m);
}
