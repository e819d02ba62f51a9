// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/job/supervisor.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

#include "job/machine.hpp"

namespace kr5::job {
namespace {

constexpr double steep = 0.3;  // of a direction along which the tool gains height: its part along Z of B [-]

void require_pose(const Pose& T, const char* message) {
  require(T.matrix().allFinite() && is_rotation(T.linear()), message);
}

void check_places(const JobPlaces& p) {
  require_pose(p.T_base_scan, "places.T_base_scan is no rigid motion");
  require_pose(p.T_base_scan_end, "places.T_base_scan_end is no rigid motion");
  require(p.T_base_rescan.has_value() == p.T_base_rescan_end.has_value(),
          "places.T_base_rescan and places.T_base_rescan_end must both be given, or neither");
  if (p.T_base_rescan) require_pose(*p.T_base_rescan, "places.T_base_rescan is no rigid motion");
  for (const auto* scan : {&p.station_scan, &p.tube_scan})
    if (*scan) {
      require_pose((*scan)->T_base_begin, "places: T_base_begin of a scan is no rigid motion");
      require_pose((*scan)->T_base_end, "places: T_base_end of a scan is no rigid motion");
    }
  if (p.T_base_rescan_end) require_pose(*p.T_base_rescan_end, "places.T_base_rescan_end is no rigid motion");
  require_pose(p.T_base_tube, "places.T_base_tube is no rigid motion");
  require_pose(p.T_tool_peg, "places.T_tool_peg is no rigid motion");
  require(std::isfinite(p.travel_height), "places.travel_height is no number [m]");
  require(p.approach >= 0 && p.approach <= 1, "places.approach must lie between 0 and 1 m");
  require(p.overtravel >= 0 && p.overtravel <= 0.1, "places.overtravel must lie between 0 and 0.1 m");
  require(p.look_height > 0 && p.look_height <= 1, "places.look_height must lie between 0 and 1 m");
  require(p.near_tube > 0 && p.near_tube <= 1, "places.near_tube must lie between 0 and 1 m");
}

}  // namespace

Pose JobPlaces::lifted(const Pose& T_base_tool, const Eigen::Vector3d& direction) const noexcept {
  const Eigen::Vector3d along = direction.z() > steep ? direction : Eigen::Vector3d::UnitZ();
  const double missing = travel_height - T_base_tool.translation().z();
  Pose out = T_base_tool;
  if (missing > 0) out.translation() += missing / along.z() * along;
  return out;
}

Pose JobPlaces::look(const Pose& T_base_tube) const noexcept {
  return T_base_tube * Eigen::Translation3d(0, 0, look_height) * T_tool_peg.inverse();
}

void JobOptions::validate() const {
  require(pellets >= 0, "pellets must not be negative");
  require(cycle > 0 && cycle <= 1, "cycle must lie between 0 and 1 s");
  check_places(places);
  stack.validate();
  motion.validate();
  if (arm) arm->validate();
  stop.validate();
  phases.validate();
  require(motion.speed < stop.speed, "motion.speed must be less than stop.speed [m/s]");
  require(motion.turning_speed < stop.turning_speed,
          "motion.turning_speed must be less than stop.turning_speed [rad/s]");
  require(settle_time >= 0 && settle_time <= 60, "settle_time must lie between 0 and 60 s");
  require(settled > 0 && std::isfinite(settled), "settled must be positive [m]");
  require(grip_time > 0 && grip_time <= 60, "grip_time must lie between 0 and 60 s");
  require(record_time > 0 && record_time <= 600, "record_time must lie between 0 and 600 s");
  require(check_time >= 0 && check_time <= 60, "check_time must lie between 0 and 60 s");
  require(check_force > 0 && std::isfinite(check_force), "check_force must be positive [N]");
  require(pose_mismatch > 0 && std::isfinite(pose_mismatch), "pose_mismatch must be positive [m]");
  require(hole_moved > 0 && std::isfinite(hole_moved), "hole_moved must be positive [m]");
  require(lowest_joints.size() == highest_joints.size(), "highest_joints must have as many values as lowest_joints");
  require((lowest_joints.array() < highest_joints.array()).all(), "highest_joints must lie above lowest_joints");
}

Supervisor::Supervisor(const JobOptions& options, const RestartDecision& start, RecordRing& ring)
    : machine_(std::make_unique<Machine>(options, start, ring)) {}

Supervisor::~Supervisor() = default;
Supervisor::Supervisor(Supervisor&&) noexcept = default;
Supervisor& Supervisor::operator=(Supervisor&&) noexcept = default;

robot::RobotCommand Supervisor::step(const robot::RobotReading& reading) noexcept { return machine_->step(reading); }

const PerceptionRequest& Supervisor::request() const noexcept { return machine_->request; }

bool Supervisor::deliver(const ScanResult& result) noexcept {
  if (machine_->request.kind != RequestKind::Scan || result.stamp != machine_->request.stamp) return false;
  machine_->scan = result;
  machine_->answered = true;
  machine_->request = {};
  return true;
}

bool Supervisor::deliver(const HoleResult& result) noexcept {
  if (machine_->request.kind != RequestKind::Hole || result.stamp != machine_->request.stamp) return false;
  machine_->hole = result;
  machine_->answered = true;
  machine_->request = {};
  return true;
}

bool Supervisor::deliver(const PlaceResult& result) noexcept {
  const RequestKind kind = machine_->request.kind;
  if (kind != RequestKind::Station && kind != RequestKind::Tube) return false;
  if (result.stamp != machine_->request.stamp) return false;
  machine_->place = result;
  machine_->answered = true;
  machine_->request = {};
  return true;
}

/// A way that does not begin and end where it was asked to is none.
bool Supervisor::deliver(const WayResult& result) noexcept {
  if (machine_->request.kind != RequestKind::Way || result.stamp != machine_->request.stamp) return false;
  machine_->no_way = !result.found || !machine_->path.set_joint_way(result.way);
  machine_->request = {};
  return true;
}

void Supervisor::stop_by_operator() noexcept { machine_->latch.stop_by_operator(); }

void Supervisor::note_lost_link() noexcept { machine_->latch.note_lost_link(); }

const JobState& Supervisor::state() const noexcept { return machine_->state; }

const force::InsertionState& Supervisor::insertion() const noexcept { return machine_->insertion.state(); }

bool Supervisor::finished() const noexcept {
  return machine_->state.phase == Phase::Done || machine_->state.phase == Phase::Stopped;
}

}  // namespace kr5::job
