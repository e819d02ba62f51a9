// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/plan_work.hpp>

#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Eigenvalues>

#include <kr5/physics/camera.hpp>
#include <kr5/vision/find_hole.hpp>

#include "work/reach.hpp"

namespace kr5::work {
namespace {

using Eigen::Translation3d;
using Eigen::Vector3d;
using picking::GripperAction;

/// Whether the arm reaches all poses that a pick needs.
bool reaches(const Reach& reach, const job::PlannedPick& pick) {
  bool out = reach.of(pick.T_base_grasp);
  for (int k = 0; out && k < pick.visits; ++k)
    out = reach.of(pick.visit(k).T_base_put) && reach.of(pick.visit(k).T_base_take);
  return out;
}

/// Poses of the steps in which a gripper lets go or takes hold, as visits of the stand.
job::PlannedPick pick_of(const Pose& T_base_grasp, const picking::HandlingPlan& plan) {
  job::PlannedPick out;
  out.T_base_grasp = T_base_grasp;
  int visit = -1;
  for (const picking::HandlingStep& step : plan.steps) {
    if (step.action == GripperAction::Release) ++visit;
    job::StationVisit& at = visit == 0 ? out.first : out.second;
    if (step.action == GripperAction::Release) at.T_base_put = step.T_base_tool;
    if (step.action == GripperAction::Grip) at.T_base_take = step.T_base_tool;
  }
  out.visits = visit + 1;
  return out;
}

/// Over the stand with the seats turned about their normals by an angle.
std::optional<job::PlannedPick> plan_at(const picking::HeldPellet& held, const picking::Grasp& grasp, double turn,
                                        const WorkOptions& o) {
  const Eigen::AngleAxisd about(turn, Vector3d::UnitZ());
  const Pose lying = o.T_base_lying_seat * about, standing = o.T_base_standing_seat * about;
  const picking::HandlingPlan plan =
      grasp.on_face ? picking::regrip_steps(held, standing, picking::PelletPosture::Standing, o.regrip)
                    : picking::stand_up_steps(held, lying, standing, o.regrip);
  if (!plan.possible) return std::nullopt;
  job::PlannedPick out = pick_of(grasp.T_base_gripper, plan);
  // The fingers take every pellet at one height above its lower end, whatever its own is.
  job::StationVisit& last = out.visits == 1 ? out.first : out.second;
  last.T_base_take =
      standing * Translation3d(0, 0, o.grip_height) * Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX());
  return out;
}

}  // namespace

job::ScanResult plan_work(const picking::Cloud& cloud, const cell::Cell& believed, const WorkOptions& options) {
  constexpr int turns = 4;
  options.validate();
  const picking::PelletResult found = picking::find_pellets(cloud, options.bin, options.pellets);
  job::ScanResult out;
  out.bin_empty = found.check.finding == picking::CloudFinding::NoPellets;
  if (found.check.finding != picking::CloudFinding::Good) return out;
  const Reach reach(believed);
  for (const picking::Grasp& grasp : picking::plan_picks(found.pellets, cloud, options.bin, options.grasp)) {
    if (!grasp.graspable()) continue;
    // The tool goes on by the overtravel when it feels nothing.
    const Pose T_base_tool = grasp.T_base_gripper * Translation3d(0, 0, options.job.places.overtravel);
    const auto& pellet = found.pellets[static_cast<std::size_t>(grasp.pellet)];
    const picking::HeldPellet held = picking::hold(pellet, T_base_tool, options.regrip.grip_covariance);
    for (int k = 0; k < turns; ++k) {
      const auto pick = plan_at(held, grasp, 2 * std::numbers::pi * k / turns, options);
      if (!pick || !reaches(reach, *pick)) continue;
      out.add(*pick);
      break;
    }
  }
  return out;
}

job::HoleResult find_tube(ImageView picture, const cell::Cell& believed, const Pose& T_base_flange,
                          const WorkOptions& options) {
  const physics::EffectiveCamera camera(believed);
  const Pose T_base_camera = camera.T_base_camera(T_base_flange);
  vision::HoleOptions hole;
  hole.radius = believed.tube->inner_radius;
  hole.search = options.hole_search;
  hole.sigma_height = options.face_std;
  const vision::HoleDetection seen =
      vision::find_hole(picture, camera.lens(), T_base_camera.inverse() * options.job.places.T_base_tube, hole);
  job::HoleResult out;
  out.found = seen.found();
  if (!out.found) return out;
  out.T_base_tube = T_base_camera * seen.T_camera_hole;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(seen.covariance);
  out.position_std = std::sqrt(axes.eigenvalues().maxCoeff());
  return out;
}

}  // namespace kr5::work
