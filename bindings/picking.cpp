// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/picking/bin.hpp>
#include <kr5/picking/clearance.hpp>
#include <kr5/picking/cloud.hpp>
#include <kr5/picking/cylinder_fit.hpp>
#include <kr5/picking/grasp.hpp>
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

void bind_grasp(py::module_& m) {
  bind_struct<GripperPart>(m, "GripperPart", "A length of the gripper: a cylinder about its axis.");
  bind_struct<BookClearance>(m, "BookClearance", "What the formula of the book says of a rod (eqs 6.1 to 6.3).");
  m.def("cylinder_box_distance", &cylinder_box_distance, py::arg("T_base_cylinder"), py::arg("radius"),
        py::arg("height"), py::arg("T_base_box"), py::arg("half"),
        "Distance between a solid cylinder (centre, Z its axis) and a solid box of half sides `half` [m]; never more "
        "than "
        "the true one.");
  m.def(
      "gripper_clearance",
      [](const Eigen::Vector3d& tip, const Eigen::Vector3d& outwards, const std::vector<GripperPart>& parts,
         const Bin& bin, bool with_floor) {
        return gripper_clearance({tip, outwards}, parts, bin, with_floor);
      },
      py::arg("tip"), py::arg("outwards"), py::arg("parts"), py::arg("bin"), py::arg("with_floor") = true,
      "Least distance between the gripper and the walls and the floor [m]; 0 when it touches.");
  m.def(
      "book_clearance",
      [](const Eigen::Vector3d& tip, const Eigen::Vector3d& outwards, double radius, const Bin& bin) {
        return book_clearance({tip, outwards}, radius, bin);
      },
      py::arg("tip"), py::arg("outwards"), py::arg("radius"), py::arg("bin"),
      "The formula as printed (Hayat et al. 2022, eq. 6.3); unsafe where the rod leans aslant to a wall.");
  bind_struct<GraspOptions>(m, "GraspOptions", "Options of plan_picks.");
  bind_enum<GraspFinding>(m, "GraspFinding", "Whether a cylinder can be picked, or what keeps it from that.");
  bind_struct<Grasp>(m, "Grasp", "One cylinder of a plan.");
  m.def("plan_picks", &plan_picks, py::arg("pellets"), py::arg("cloud"), py::arg("bin"),
        py::arg("options") = GraspOptions{}, py::call_guard<py::gil_scoped_release>(),
        "Judges every cylinder and orders them, what disturbs the others least first.");
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
  bind_grasp(m);
}
