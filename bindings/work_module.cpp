// SPDX-License-Identifier: BSD-3-Clause
#include <pybind11/pybind11.h>

#include "_kr5_work_modules.hpp"
#include "field_table.hpp"

PYBIND11_MODULE(_kr5_work, m) {
  pybind11::module_::import("kr5._kr5");          // jobs, cells, tables and exceptions are bound there,
  pybind11::module_::import("kr5._kr5_sim");      // work cells there,
  pybind11::module_::import("kr5._kr5_picking");  // and clouds, bins and pellets there
  m.doc() = "The work from bin to tube, of the C++ library. Import it as kr5.work.";
  kr5::python::bind_with_displays(m, bind_modules);
}
