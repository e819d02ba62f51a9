// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/work_options.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

#include <kr5/cell/sensor_model.hpp>
#include <kr5/core/error.hpp>
#include <kr5/sim/insertion_options.hpp>

#include "work/reach.hpp"

namespace kr5::work {
namespace {

using Eigen::Translation3d;
using Eigen::Vector3d;

constexpr double seat_distance = 0.05;   // of the two seats on the stand [m]
constexpr double scan_margin = 0.05;     // of the scan beyond the walls of the bin [m]
constexpr double stand_reach = 0.05;     // of a scan of the stand from its middle to either side [m]
constexpr double tube_reach = 0.025;     // the same of the tube [m]
constexpr double look_height = 0.09;     // from which the camera beside the tool has the tube in view [m]
constexpr double travel_margin = 0.02;   // of travel, with the tallest pellet, above what stands in the cell [m]
constexpr double approach_speed = 0.12;  // to the face of a tube that was seen [m/s]
constexpr double scan_turn = 3.0;        // of the scanner for another scan; half a turn has no direction [rad]
constexpr double below_lowest = 0.002;   // of the fingers below the upper end of the lowest pellet [m]

Pose upside_down(const Vector3d& place) {
  return Translation3d(place) * Pose(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX()));
}

/// Ends of a pass along Y of the bin with the middle of the scanner's range on the floor, and of one with the scanner
/// turned by nearly half a turn, whose receiver looks behind the walls that hide something from it otherwise.
void set_scan(job::JobPlaces& places, const sim::WorkCell& cell) {
  const sim::WorkCellOptions& o = cell.options();
  const Pose T_scanner_tool = o.scanner.T_flange_scanner.inverse() * cell.believed().tool->T_flange_tool;
  const double reach = 0.5 * o.bin.size.y() + scan_margin;
  const auto tool_at = [&](double y, double turn) {
    const Pose T_base_scanner = o.bin.T_base_bin * upside_down({0.0, y, o.scanner.stand_off});
    return Pose(T_base_scanner * Eigen::AngleAxisd(turn, Vector3d::UnitZ()) * T_scanner_tool);
  };
  places.T_base_scan = tool_at(-reach, 0.0);
  places.T_base_scan_end = tool_at(reach, 0.0);
  const Pose begin = tool_at(reach, scan_turn), end = tool_at(-reach, scan_turn);
  const Reach arm(cell.believed());
  if (!arm.of(begin) || !arm.of(end)) return;
  places.T_base_rescan = begin;
  places.T_base_rescan_end = end;
}

/// A pass over the middle of a place along the Y of the scanner, turned as the arm reaches both ends; none: it does
/// not.
std::optional<job::ScanLine> place_scan(const sim::WorkCell& cell, const Pose& T_base_place, double reach) {
  const sim::BinScannerOptions& scanner = cell.options().scanner;
  const Pose T_scanner_tool = scanner.T_flange_scanner.inverse() * cell.believed().tool->T_flange_tool;
  const Reach arm(cell.believed());
  for (const double turn : {0.0, scan_turn, 0.5 * std::numbers::pi, -0.5 * std::numbers::pi}) {
    const auto tool_at = [&](double y) {
      return Pose(T_base_place * upside_down({0.0, 0.0, scanner.stand_off}) *
                  Eigen::AngleAxisd(turn, Vector3d::UnitZ()) * Translation3d(0.0, y, 0.0) * T_scanner_tool);
    };
    const job::ScanLine out{tool_at(-reach), tool_at(reach)};
    if (arm.of(out.T_base_begin) && arm.of(out.T_base_end)) return out;
  }
  return std::nullopt;
}

/// Where the longest pellet passes over bin, stand and tubes, and the camera has the tube in view.
double travel_height(const sim::WorkCell& cell, double grip_height) {
  const sim::WorkCellOptions& o = cell.options();
  const double tube = cell.believed().tube->T_base_tube.translation().z();
  const double rim = (o.bin.T_base_bin * Vector3d(0, 0, o.bin.size.z())).z();
  const double highest = std::max({rim, tube, o.stand.T_base_stand.translation().z()});
  return std::max(highest + o.pour.height_max + travel_margin, tube + look_height + grip_height);
}

job::JobOptions job_options(const sim::WorkCell& cell, double grip_height) {
  const cell::Cell& believed = cell.believed();
  job::JobOptions out;
  out.cycle = cell.cycle();
  set_scan(out.places, cell);
  out.places.T_base_tube = believed.tube->T_base_tube;
  out.places.station_scan = place_scan(cell, cell.options().stand.T_base_stand, stand_reach);
  out.places.tube_scan = place_scan(cell, believed.tube->T_base_tube, tube_reach);
  out.stack.depth = believed.tube->depth;
  out.stack.min_height = cell.options().pour.height_min;
  out.stack.max_height = cell.options().pour.height_max;
  out.places.T_tool_peg = upside_down({0.0, 0.0, grip_height});
  out.places.look_height = look_height;
  out.places.travel_height = travel_height(cell, grip_height);
  out.places.approach = 0.005;
  out.places.overtravel = 5e-4;
  out.motion = {
      .speed = 0.8, .acceleration = 4.0, .turning_speed = 3.5, .turning_acceleration = 20.0, .contact_speed = 0.03};
  sim::InsertionSetup setup;
  setup.clearance = cell.options().clearance;
  setup.noise = cell.options().noise;
  out.insertion = sim::insertion_options(believed, setup);
  out.insertion.grip.height = grip_height;
  out.insertion.hole.reset();
  if (!believed.servo->correction) out.insertion.motion.approach_speed = approach_speed;  // else as it permits
  out.arm = cell::sensor_model(believed);
  out.settle_time = 1.5;
  out.grip_time = 0.6;
  if (believed.robot.limits) {
    out.lowest_joints = believed.robot.limits->lower;
    out.highest_joints = believed.robot.limits->upper;
  }
  return out;
}

}  // namespace

void ArmWayOptions::validate() const {
  require(joint_speed > 0 && joint_speed <= 100, "joint_speed must lie between 0 and 100 rad/s");
  require(wrist_speed > 0 && wrist_speed <= 100, "wrist_speed must lie between 0 and 100 rad/s");
  require(margin >= 0 && margin <= 1, "margin must lie between 0 and 1 rad");
  require(sag >= 0 && sag <= 1, "sag must lie between 0 and 1 m");
  require(swing >= 0 && swing <= std::numbers::pi, "swing must lie between 0 and pi");
}

void WorkOptions::validate() const {
  job.validate();
  ways.validate();
  bin.validate();
  pellets.validate();
  grasp.validate();
  regrip.validate();
  for (const Pose* T : {&T_base_lying_seat, &T_base_standing_seat})
    require(T->matrix().allFinite() && is_rotation(T->linear()),
            "T_base_lying_seat and T_base_standing_seat must be rigid motions");
  require(grip_height > 0 && grip_height < pellets.min_height,
          "grip_height must lie between 0 and pellets.min_height [m]");
  require(hole_search > 0 && hole_search <= 1, "hole_search must lie between 0 and 1 m");
  require(face_std >= 0 && std::isfinite(face_std), "face_std must not be negative [m]");
}

WorkOptions work_options(const sim::WorkCell& cell) {
  const sim::WorkCellOptions& o = cell.options();
  require(cell.believed().camera.has_value(), "camera: the cell has none, and the tube is looked for with it");
  WorkOptions out;
  out.bin = {o.bin.T_base_bin, o.bin.size, o.bin.wall};
  out.pellets.radius = o.pour.radius;
  out.pellets.min_height = o.pour.height_min;
  out.pellets.max_height = o.pour.height_max;
  out.grip_height = o.pour.height_min - below_lowest;
  const Pose& stand = o.stand.T_base_stand;
  out.T_base_lying_seat = stand * Translation3d(-0.5 * seat_distance, 0, 0);
  out.T_base_standing_seat = stand * Translation3d(0.5 * seat_distance, 0, 0);
  out.job = job_options(cell, out.grip_height);
  out.validate();
  return out;
}

job::RestartOptions restart_options(const WorkOptions& options) {
  const job::JobPlaces& places = options.job.places;
  return {.T_base_tube = places.T_base_tube,
          .T_tool_peg = places.T_tool_peg,
          .sees_station = places.station_scan.has_value(),
          .sees_tube = places.tube_scan.has_value()};
}

}  // namespace kr5::work
