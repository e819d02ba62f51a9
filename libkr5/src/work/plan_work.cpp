// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/plan_work.hpp>

#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Eigenvalues>

#include <kr5/physics/camera.hpp>
#include <kr5/vision/find_hole.hpp>
#include <kr5/work/arm_ways.hpp>

#include "work/reach.hpp"

namespace kr5::work {
namespace {

using Eigen::Translation3d;
using Eigen::Vector3d;
using picking::GripperAction;

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

/// The same for some turns of the seats.
std::vector<job::PlannedPick> plan_turned(const picking::HeldPellet& held, const picking::Grasp& grasp,
                                          const WorkOptions& options) {
  constexpr int turns = 4;
  std::vector<job::PlannedPick> out;
  for (int k = 0; k < turns; ++k)
    if (const auto pick = plan_at(held, grasp, 2 * std::numbers::pi * k / turns, options)) out.push_back(*pick);
  return out;
}

/// The one with the quickest way from the scan into the tube and back; none: the arm cannot go so.
std::optional<job::PlannedPick> quickest(const std::vector<job::PlannedPick>& picks, const cell::Cell& believed,
                                         const WorkOptions& options) {
  const job::JobPlaces& places = options.job.places;
  const auto joints = Reach(believed).posture(places.over(places.T_base_scan_end));
  if (!joints) return std::nullopt;
  job::WayRequest asked;
  asked.phase = job::Phase::Pick;
  asked.T_base_tube = options.job.places.T_base_tube;
  std::optional<job::PlannedPick> out;
  double least = HUGE_VAL;
  for (const job::PlannedPick& pick : picks) {
    asked.pick = pick;
    const WayPlan plan = plan_ways(believed, *joints, stops_ahead(asked, options), options);
    if (!plan.possible() || plan.duration >= least) continue;
    least = plan.duration;
    out = pick;
  }
  return out;
}

}  // namespace

job::ScanResult plan_work(const picking::Cloud& cloud, const cell::Cell& believed, const WorkOptions& options) {
  options.validate();
  const picking::PelletResult found = picking::find_pellets(cloud, options.bin, options.pellets);
  job::ScanResult out;
  out.bin_empty = found.check.finding == picking::CloudFinding::NoPellets;
  if (found.check.finding != picking::CloudFinding::Good) return out;
  for (const picking::Grasp& grasp : picking::plan_picks(found.pellets, cloud, options.bin, options.grasp)) {
    if (!grasp.graspable()) continue;
    // The tool goes on by the overtravel when it feels nothing.
    const Pose T_base_tool = grasp.T_base_gripper * Translation3d(0, 0, options.job.places.overtravel);
    const auto& pellet = found.pellets[static_cast<std::size_t>(grasp.pellet)];
    const picking::HeldPellet held = picking::hold(pellet, T_base_tool, options.regrip.grip_covariance);
    const std::vector<job::PlannedPick> picks = plan_turned(held, grasp, options);
    const auto best = quickest(picks, believed, options);
    if (best) out.add(*best);
    if (!picks.empty() && !best) ++out.unreachable;
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
