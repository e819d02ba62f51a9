// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/pybind11.h>

#include "_kr5_sim_modules.hpp"
#include "field_table.hpp"

PYBIND11_MODULE(_kr5_sim, m) {
  pybind11::module_::import("kr5._kr5");  // cells, tables, simulators and exceptions are bound there
  m.doc() = "Simulation in DART, of the C++ library. Import it as kr5.sim.";
  kr5::python::bind_with_displays(m, bind_modules);
}
