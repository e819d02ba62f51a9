// SPDX-License-Identifier: BSD-3-Clause
#include <optional>
#include <vector>

#include <kr5/picking/bin.hpp>
#include <kr5/picking/clearance.hpp>
#include <kr5/picking/cloud.hpp>
#include <kr5/picking/cycle.hpp>
#include <kr5/picking/cylinder_fit.hpp>
#include <kr5/picking/disturbance.hpp>
#include <kr5/picking/grasp.hpp>
#include <kr5/picking/moved_region.hpp>
#include <kr5/picking/patches.hpp>
#include <kr5/picking/pcl_peers.hpp>
#include <kr5/picking/pellet_image.hpp>
#include <kr5/picking/pellets.hpp>
#include <kr5/picking/placing.hpp>

#include "grey_array.hpp"
#include "interruptible.hpp"
#include "struct_binder.hpp"

namespace py = pybind11;
using namespace kr5::picking;
using kr5::python::bind_enum;
using kr5::python::bind_struct;
using kr5::python::GreyArray;
using kr5::python::view_of;

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

void bind_changes(py::module_& m) {
  bind_struct<ImageNoiseOptions>(m, "ImageNoiseOptions", "Options of learn_image_noise.");
  bind_struct<ImageNoise>(m, "ImageNoise", "How the image of a scene at rest scatters.");
  m.def(
      "learn_image_noise",
      [](const std::vector<GreyArray>& images, const ImageNoiseOptions& options) {
        std::vector<kr5::ImageView> views;
        for (const GreyArray& image : images) views.push_back(view_of(image));
        const py::gil_scoped_release released;
        return learn_image_noise(views, options);
      },
      py::arg("images"), py::arg("options") = ImageNoiseOptions{},
      "Learns the noise of each pixel from repeated grey images (uint8, height x width) of a scene at rest, better ten "
      "than three; check fit.usable (Hayat et al. 2022, section 2.4.1).");
  bind_struct<ChangeOptions>(m, "ChangeOptions", "Options of find_changes.");
  bind_enum<ChangeFinding>(m, "ChangeFinding", "Whether something moved, or why that cannot be said.");
  bind_struct<ChangeRegion>(m, "ChangeRegion", "A connected region of changed pixels.");
  bind_struct<ImageChange>(m, "ImageChange", "What changed between two images; check `usable` before the mask.")
      .def_property_readonly("usable", &ImageChange::usable, "Whether the mask may be used; if not, scan again.");
  m.def(
      "find_changes",
      [](const GreyArray& before, const GreyArray& after, const ImageNoise& noise, const ChangeOptions& options) {
        return find_changes(view_of(before), view_of(after), noise, options);
      },
      py::arg("before"), py::arg("after"), py::arg("noise"), py::arg("options") = ChangeOptions{},
      "What changed from one grey image to another (uint8, height x width), both from the pose of the camera at which "
      "the noise was learnt (Hayat et al. 2022, section 2.4.1).");
  bind_struct<PrunedCloud>(m, "PrunedCloud", "A cloud from which what moved has been taken.");
  m.def("remove_changed", &remove_changed, py::arg("cloud"), py::arg("changed"), py::arg("camera"),
        py::arg("T_camera_base"), py::arg("margin") = 0.002,
        "Takes out of a cloud the points that project into changed pixels, or would if moved by up to `margin` [m].");
  m.def("disturbed_pellets", &disturbed_pellets, py::arg("pellets"), py::arg("changed"), py::arg("camera"),
        py::arg("T_camera_base"), py::arg("margin") = 0.002,
        "Numbers of the cylinders that show a changed pixel within `margin` [m].");
  bind_struct<CycleState>(m, "CycleState", "Counts of a cycle, which lasts from one scan to the next.");
  bind_struct<CycleOptions>(m, "CycleOptions", "Options of decide_cycle.");
  bind_enum<CycleAction>(m, "CycleAction", "What to do after a pick.");
  bind_struct<CycleDecision>(m, "CycleDecision", "What to do after a pick, and why.");
  m.def("decide_cycle", &decide_cycle, py::arg("state"), py::arg("options") = CycleOptions{},
        "Decides whether to pick on, scan, shake the bin, stop or ask (Hayat et al. 2022, section 2.4.3).");
}

void bind_placing(py::module_& m) {
  bind_struct<HeldPellet>(m, "HeldPellet", "A cylinder in a gripper.");
  m.def("pellet_pose", &pellet_pose, py::arg("pellet"),
        "Pose of a cylinder in the base, Z along its axis, with the covariance of centre and tilts.");
  m.def(
      "hold",
      [](const Pellet& pellet, const kr5::Pose& T_base_tool, const std::optional<kr5::Matrix6>& grip_covariance) {
        return hold(pellet, T_base_tool, grip_covariance.value_or(kr5::Matrix6::Zero()));
      },
      py::arg("pellet"), py::arg("T_base_tool"), py::arg("grip_covariance") = std::nullopt,
      "A cylinder that a tool at T_base_tool takes hold of; grip_covariance (6 x 6 [m, rad], without: zero) of how far "
      "it moves in the grip, in the frame of the cylinder.");
  bind_enum<PelletPosture>(m, "PelletPosture", "Whether a cylinder stands or lies.");
  bind_enum<GridOrder>(m, "GridOrder", "Order of the seats in a layer.");
  bind_struct<StackOptions>(m, "StackOptions", "A grid of seats on a tray, layer by layer.");
  bind_struct<StackSeat>(m, "StackSeat", "A seat of a stack.");
  m.def("plan_stack", &plan_stack, py::arg("T_base_tray"), py::arg("options") = StackOptions{},
        "The seats of a stack in the order to fill them. The tray's origin is the corner of the grid on the surface, X "
        "along the columns, Y along the rows, Z up.");
  bind_struct<PlaceOptions>(m, "PlaceOptions", "Options of place.");
  bind_struct<Placement>(m, "Placement", "How a held cylinder is placed; check `possible`.");
  m.def("place", &place, py::arg("held"), py::arg("T_base_seat"), py::arg("posture"),
        py::arg("options") = PlaceOptions{},
        "Places a held cylinder on a seat, standing or lying, with the tool as straight down as the grip lets it "
        "(Hayat et al. 2022, section 2.4.2).");
  bind_enum<Gripper>(m, "Gripper", "Suction gripper or two fingers.");
  bind_enum<GripperAction>(m, "GripperAction", "What a gripper does at the end of a step.");
  bind_struct<HandlingStep>(m, "HandlingStep", "A motion of one of the tools, and what it does there.");
  bind_struct<RegripOptions>(m, "RegripOptions", "Options of regrip_steps and stand_up_steps.");
  bind_struct<HandlingPlan>(m, "HandlingPlan", "Steps of a sequence; check `possible`.");
  m.def("regrip_steps", &regrip_steps, py::arg("held"), py::arg("T_base_seat"), py::arg("posture"),
        py::arg("options") = RegripOptions{},
        "From suction to two fingers: puts a cylinder down and takes it from above (Hayat et al. 2022, section 6.3).");
  m.def("stand_up_steps", &stand_up_steps, py::arg("held"), py::arg("T_base_lying_seat"),
        py::arg("T_base_standing_seat"), py::arg("options") = RegripOptions{},
        "Makes a cylinder stand that the suction gripper holds by its side (Hayat et al. 2022, section 6.3).");
}

void bind_pellet_image(py::module_& m) {
  bind_struct<PelletImageOptions>(m, "PelletImageOptions", "Options of refine_pellet.");
  bind_enum<PelletImageStatus>(m, "PelletImageStatus", "Whether a pose was refined, or why not.");
  bind_struct<PelletRefinement>(m, "PelletRefinement", "A cylinder refined in an image; check `refined`.")
      .def_property_readonly("refined", &PelletRefinement::refined, "Whether the pose was refined.");
  m.def(
      "refine_pellet",
      [](const GreyArray& image, const kr5::Pinhole& camera, const kr5::UncertainPose& T_camera_base,
         const Pellet& pellet, const std::vector<Pellet>& others, const PelletImageOptions& options) {
        const kr5::ImageView view = view_of(image);
        const py::gil_scoped_release released;
        return refine_pellet(view, camera, T_camera_base, pellet, others, options);
      },
      py::arg("image"), py::arg("camera"), py::arg("T_camera_base"), py::arg("pellet"),
      py::arg("others") = std::vector<Pellet>{}, py::arg("options") = PelletImageOptions{},
      "Refines pose, radius and height of a cylinder by the edges that it should show in a grey image (uint8, height x "
      "width), fused with the estimate from the cloud by covariance. T_camera_base: an UncertainPose; others: "
      "cylinders "
      "that may hide part of it (Hayat et al. 2022, sections 2.3.3 and 3.4.4).");
}

/// For the benches.
void bind_peers(py::module_& m) {
  bind_struct<PclCylinderOptions>(m, "PclCylinderOptions", "Options of pcl_cylinder and pcl_find_cylinders.");
  bind_struct<PclCylinder>(m, "PclCylinder", "A cylinder as PCL finds it.");
  m.def("pcl_cylinder", &pcl_cylinder, py::arg("points"), py::arg("options") = PclCylinderOptions{},
        "PCL's own fit of a cylinder, with refinement, to points, 3 x n or n x 3 [m].");
  m.def("pcl_find_cylinders", &pcl_find_cylinders, py::arg("cloud"), py::arg("bin"),
        py::arg("options") = PclCylinderOptions{}, py::call_guard<py::gil_scoped_release>(),
        "PCL's tutorial on cylinders, repeated over the points of a bin.");
}

}  // namespace

void bind_picking(py::module_& m) {
  bind_cloud(m);
  bind_struct<CylinderFitOptions>(m, "CylinderFitOptions", "Options of fit_cylinder.");
  bind_struct<CylinderFit>(m, "CylinderFit", "Cylinder without ends, fitted to points of its side.");
  m.def("fit_cylinder", &fit_cylinder, py::arg("points"), py::arg("options") = CylinderFitOptions{},
        py::arg("axis") = std::nullopt,
        "Cylinder of least squared distances to points of its side, 3 x n or n x 3 [m]; unbiased, with covariance "
        "(Hayat et al. "
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
  bind_changes(m);
  bind_placing(m);
  bind_pellet_image(m);
  bind_peers(m);
}
