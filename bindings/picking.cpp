// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/bin.hpp>
#include <kr5/picking/cloud.hpp>
#include <kr5/picking/cylinder_fit.hpp>
#include <kr5/picking/patches.hpp>
#include <kr5/picking/pellets.hpp>

#include "interruptible.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::picking;
using kr5::python::bind_enum;
using kr5::python::bind_struct;

namespace {

void bind_cloud(py::module_& m) {
  bind_struct<Bin>(m, "Bin", "An open box: origin at the centre of the inner floor, Z up, walls along X and Y.");
  bind_struct<Cloud>(m, "Cloud", "Points in the frame of the base, with the origins of their rays as far as known.");
  bind_struct<ProfileScan>(m, "ProfileScan", "Profiles of a scanner that moves, and the poses of the arm.");
  bind_enum<CloudFinding>(m, "CloudFinding", "Whether a cloud can be picked from, or why not.");
  bind_struct<CloudCheck>(m, "CloudCheck", "Judgement of a cloud before anything is looked for in it.");
  m.def("cloud_from_profiles", &cloud_from_profiles, py::arg("scan"),
        "Points of a scan, each profile at the pose of the arm when it was exposed (Hayat et al. 2022, eq. 2.3).");
  m.def("check_cloud", &check_cloud, py::arg("cloud"), py::arg("bin"), py::arg("radius"),
        "Says whether cylinders of this radius [m] can be looked for in the cloud.");
  m.def("crop", &crop, py::arg("cloud"), py::arg("bin"), py::arg("floor_margin") = 0.0, py::arg("wall_margin") = 0.0,
        "The points within the walls, between floor and rim, less margins [m].");
}

}  // namespace

void bind_picking(py::module_& m) {
  bind_cloud(m);
  bind_struct<CylinderFitOptions>(m, "CylinderFitOptions", "Options of fit_cylinder.");
  bind_struct<CylinderFit>(m, "CylinderFit", "Cylinder without ends, fitted to points of its side.");
  m.def("fit_cylinder", &fit_cylinder, py::arg("points"), py::arg("options") = CylinderFitOptions{},
        py::arg("axis") = std::nullopt,
        "Cylinder of least squared distances to points of its side, 3 x n [m]; unbiased, with covariance (Hayat et al. "
        "2022, eqs 2.9 to 2.11).");
  bind_enum<PatchKind>(m, "PatchKind", "Kind of a piece of surface.");
  bind_struct<Patch>(m, "Patch", "A piece of surface without edges.");
  bind_struct<PatchOptions>(m, "PatchOptions", "Options of find_patches.");
  m.def("find_patches", &find_patches, py::arg("cloud"), py::arg("up"), py::arg("options") = PatchOptions{},
        "Smooth pieces of surface, greatest first, by PCL's region growing (Hayat et al. 2022, section 2.3.1).");
  bind_struct<PelletOptions>(m, "PelletOptions", "Options of find_pellets.");
  bind_struct<Pellet>(m, "Pellet", "A cylinder that was found.");
  bind_struct<PelletResult>(m, "PelletResult", "Cylinders found in a cloud.");
  m.def("find_pellets", &find_pellets, py::arg("cloud"), py::arg("bin"), py::arg("options") = PelletOptions{},
        py::call_guard<py::gil_scoped_release>(),
        "Finds the cylinders in a bin (Hayat et al. 2022, section 2.3); with a cloud that cannot be used, `check` says "
        "why "
        "and none is listed.");
}
