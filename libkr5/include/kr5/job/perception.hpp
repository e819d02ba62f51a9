// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/job/joint_way.hpp>
#include <kr5/job/phase.hpp>

/// @file
/// What a supervisor asks of cameras, scanners and a planner of ways, and what it is told. Whoever answers takes all
/// the time it needs, in a thread of its own; the stamp of a request comes back in its result, and a result with
/// another stamp is old. Of fixed size: copying it allocates nothing.

namespace kr5::job {

enum class RequestKind {
  None,
  Sweep,    ///< Profiles are to be taken from now on, while the arm moves over a place; nothing is answered.
  Scan,     ///< What can be picked from the bin; the arm stands where its way over it ends.
  Station,  ///< Whether a pellet is on the station; likewise.
  Tube,     ///< What is in the tube; likewise.
  Hole,     ///< Where the tube is; the arm stands over where it is believed.
  Way,      ///< How the joints go from place to place; the arm lifts off meanwhile, and then stands.
};
constexpr auto enum_names(RequestKind) {
  using enum RequestKind;
  return names<RequestKind>({{None, "none"},
                             {Sweep, "sweep"},
                             {Scan, "scan"},
                             {Station, "station"},
                             {Tube, "tube"},
                             {Hole, "hole"},
                             {Way, "way"}});
}

/// A pellet is put on the station and taken up again in another way.
struct StationVisit {
  Pose T_base_put = Pose::Identity();
  Pose T_base_take = Pose::Identity();

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_put", self.T_base_put, "Tool that puts the pellet on the station [m].");
    visit("T_base_take", self.T_base_take, "Tool that takes it there, with the fingers where there are any [m].");
  }
};

/// How one pellet goes from the bin to where the tube's gripper takes it: over the station once, or twice when it has
/// to be laid down before it can be stood up. Whoever plans it keeps the gripper clear of bin and pile
/// (kr5/picking/grasp.hpp, placing.hpp); the approach of each pose is along Z of the tool.
struct PlannedPick {
  Pose T_base_grasp = Pose::Identity();
  StationVisit first, second;
  int visits = 1;

  const StationVisit& visit(int number) const noexcept { return number == 0 ? first : second; }

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_grasp", self.T_base_grasp, "Tool that grips the pellet in the bin [m].");
    visit("first", self.first, "First visit of the station.");
    visit("second", self.second, "Second visit.");
    visit("visits", self.visits, "Number of visits: 1 | 2.");
  }
};

/// A way that is asked for, and what is to follow it until the pellet is in the tube: its end is to be a good beginning
/// of the rest.
struct WayRequest {
  Pose T_base_from = Pose::Identity();
  Pose T_base_to = Pose::Identity();
  Phase phase = Phase::CheckCell;
  PlannedPick pick;
  int visit = 0;
  Pose T_base_tube = Pose::Identity();

  static void each_field(auto& self, auto&& visit) {
    visit("T_base_from", self.T_base_from, "Tool where it begins [m].");
    visit("T_base_to", self.T_base_to, "Tool where it ends [m].");
    visit("phase", self.phase, "Phase that it belongs to.");
    visit("pick", self.pick, "How the pellet in work goes to the tube.");
    visit("visit", self.visit, "Number of the visit of the station that is due or under way, from 0.");
    visit("T_base_tube", self.T_base_tube, "Tube, as far as its place is known [m].");
  }
};

struct PerceptionRequest {
  RequestKind kind = RequestKind::None;
  std::int64_t stamp = 0;
  int pellet = 0;
  WayRequest way = {};

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "What is asked for: none | sweep | scan | station | tube | hole | way.");
    visit("stamp", self.stamp, "Cycle in which it was asked.");
    visit("pellet", self.pellet, "Number of the pellet it is for; 0: none.");
    visit("way", self.way, "Way that is asked for.");
  }
};

struct ScanResult {
  static constexpr int capacity = 64;

  std::int64_t stamp = 0;
  bool bin_empty = false;
  int unreachable = 0;  ///< Pellets that can be gripped, and that the arm cannot bring to the tube.
  int count = 0;
  std::array<PlannedPick, capacity> picks;

  /// Adds a pick, the next best; those beyond the capacity are for the next scan.
  void add(const PlannedPick& pick) noexcept {
    if (count < capacity) picks[static_cast<std::size_t>(count++)] = pick;
  }
};

struct HoleResult {
  std::int64_t stamp = 0;
  bool found = false;
  Pose T_base_tube = Pose::Identity();
  double position_std = 0.0;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("stamp", self.stamp, "Stamp of the request.");
    visit("found", self.found, "Whether the tube was seen.");
    visit("T_base_tube", self.T_base_tube, "Tube: centre of its top face, Z out of it [m].");
    visit("position_std", self.position_std, "Standard deviation of its centre, per axis [m].");
  }
};

/// What was seen at a place where a pellet may be: at the station, or at the tube.
struct PlaceResult {
  std::int64_t stamp = 0;
  bool seen = false;
  bool occupied = false;
  std::optional<double> depth;  ///< [m]

  static void each_field(auto& self, auto&& visit) {
    visit("stamp", self.stamp, "Stamp of the request.");
    visit("seen", self.seen, "Whether the place was seen.");
    visit("occupied", self.occupied, "Whether a pellet is on the station, or stands out of the tube.");
    visit("depth", self.depth,
          "Of a tube: depth below its face of what is uppermost in the bore; empty: deeper than can be seen [m].");
  }
};

struct WayResult {
  std::int64_t stamp = 0;
  bool found = false;
  JointWay way;

  static void each_field(auto& self, auto&& visit) {
    visit("stamp", self.stamp, "Stamp of the request.");
    visit("found", self.found, "Whether the arm can go there, and on from there, within the limits of its joints.");
    visit("way", self.way, "Way of the joints.");
  }
};

}  // namespace kr5::job
