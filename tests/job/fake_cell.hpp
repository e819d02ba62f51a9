#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include <kr5/core/random.hpp>
#include <kr5/force/peg_on_tube.hpp>
#include <kr5/job/job_options.hpp>
#include <kr5/job/perception.hpp>
#include <kr5/job/restart.hpp>
#include <kr5/kinematics/inverse.hpp>

/// @file
/// A kinematic cell: the tool is where it was told to be a cycle ago, a pellet is where it was let go. It knows where
/// every pellet really is, which no supervisor asks.

namespace kr5::test {

inline Pose pointing_down(const Eigen::Vector3d& place, double lean = 0.0, double towards = 0.0) {
  return Eigen::Translation3d(place) * Eigen::AngleAxisd(towards, Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()) *
         Pose::Identity();
}

/// What goes wrong in the cell, as probabilities.
struct Misfortune {
  double no_grip = 0.0;      ///< Of each closing of the gripper.
  double no_hole = 0.0;      ///< Of each look at the tube.
  double no_place = 0.0;     ///< Of each scan of station or tube.
  double slip = 0.0;         ///< Of each cycle, that what is held falls.
  double outage_slip = 0.0;  ///< Of each interruption, the same.
};

enum class Place { Bin, Gripper, Station, Tube, Floor };

class FakeCell {
 public:
  static constexpr double depth = 0.012, height = 0.015;
  static constexpr force::PegTube bodies{.peg_radius = 9.42e-3, .inner_radius = 9.7e-3, .outer_radius = 12.65e-3};

  FakeCell(int pellets, std::uint64_t seed, const Misfortune& misfortune = {})
      : random_(seed), misfortune_(misfortune), places_(static_cast<std::size_t>(pellets), Place::Bin) {
    for (int k = 0; k < pellets; ++k)
      grasps_.push_back(pointing_down({0.35 + 0.025 * (k % 5), -0.05 + 0.025 * (k / 5), 0.02}, random_.uniform(0, 0.4),
                                      random_.uniform(0, 2 * M_PI)));
    tool_ = coming_ = pointing_down({0.3, 0.0, 0.3});
  }

  static job::JobOptions options(int pellets) {
    job::JobOptions out;
    out.pellets = pellets;
    out.places.T_base_scan = pointing_down({0.4, 0.0, 0.3});
    out.places.T_base_scan_end = pointing_down({0.4, 0.05, 0.3});
    out.places.T_base_tube = believed_tube();
    out.places.station_scan = job::ScanLine{pointing_down({0.3, 0.27, 0.3}), pointing_down({0.3, 0.33, 0.3})};
    out.places.tube_scan = job::ScanLine{pointing_down({0.2, -0.33, 0.3}), pointing_down({0.2, -0.27, 0.3})};
    out.stack = {.depth = 1.0, .min_height = height, .max_height = height};
    out.places.T_tool_peg = T_tool_peg();
    out.insertion.bodies = bodies;
    out.insertion.entry = force::EntryAttitude::Upright;
    out.insertion.hole = Eigen::Vector3d::Zero();
    out.insertion.motion.depth = depth;
    return out;
  }
  /// An arm of the shape of a KR5 behind the places of the cell.
  static robot::SensorModel arm() {
    robot::SensorModel out;
    out.arm.T_base_0 = Pose(Eigen::Translation3d(-0.4, 0.0, -0.2));
    const auto joint = [&](double b, double offset, double a, double alpha) {
      out.arm.joints.push_back({.b = b, .theta_offset = offset, .a = a, .alpha = alpha});
    };
    joint(0.4, 0.0, 0.18, M_PI_2);
    joint(0.0, M_PI_2, 0.6, M_PI);
    joint(0.0, 0.0, 0.12, M_PI_2);
    joint(0.62, M_PI, 0.0, M_PI_2);
    joint(0.0, -M_PI_2, 0.0, M_PI_2);
    joint(0.115, M_PI_2, 0.0, 0.0);
    return out;
  }
  static job::RestartOptions restart_options() {
    return {.T_base_tube = believed_tube(), .T_tool_peg = T_tool_peg(), .sees_station = true, .sees_tube = true};
  }

  robot::RobotReading read() {
    robot::RobotReading out;
    out.time = time_;
    out.T_base_tool = out.T_base_flange = tool_;
    for (int i = 0; i < 6; ++i) out.sensor[i] = random_.normal(i < 3 ? 0.05 : 0.002);
    out.wrench = out.sensor + contact() + push;
    out.status.gripped = held().has_value();
    return out;
  }
  void send(const robot::RobotCommand& command) {
    time_ += robot::usual_cycle;
    tool_ = coming_;
    if (!command.stop) coming_ = robot::commanded_tool(command, coming_);
    if (command.gripper.hold != hold_) since_ = 0;
    hold_ = command.gripper.hold;
    ++since_;
    if (since_ == 4) hold_ ? close() : let_go();
    if (held() && random_.uniform() < misfortune_.slip) fall();
  }
  /// The program ends, and the arm stands where it is; then another one begins.
  void interrupt() {
    coming_ = tool_;
    time_ = random_.uniform(0, 100);
    if (held() && random_.uniform() < misfortune_.outage_slip) fall();
  }

  job::ScanResult scan(std::int64_t stamp) const {
    job::ScanResult out;
    out.stamp = stamp;
    for (std::size_t k = 0; k < places_.size(); ++k)
      if (places_[k] == Place::Bin)
        out.add({grasps_[k], {station(), station()}, {beside(), beside()}, lies(k) ? 2 : 1});
    out.bin_empty = out.count == 0;
    return out;
  }
  job::HoleResult look(std::int64_t stamp) {
    job::HoleResult out;
    out.stamp = stamp;
    out.found = random_.uniform() >= misfortune_.no_hole;
    out.T_base_tube = true_tube();
    for (int i = 0; i < 3; ++i) out.T_base_tube.translation()[i] += random_.normal(2e-5);
    out.position_std = 2e-5;
    return out;
  }
  /// What a scan of the station or of the tube shows.
  job::PlaceResult place(const job::PerceptionRequest& asked) {
    job::PlaceResult out;
    out.stamp = asked.stamp;
    out.seen = random_.uniform() >= misfortune_.no_place;
    if (asked.kind == job::RequestKind::Tube)
      out.depth = 1.0 - height * count(Place::Tube);
    else
      out.occupied = count(Place::Station) > 0;
    return out;
  }
  /// A slow way between the first postures of both places.
  static job::WayResult way(const job::PerceptionRequest& asked) {
    constexpr double slow = 4.0;  // [s]
    const kinematics::DhChain chain = arm().arm;
    const auto begin = kinematics::inverse_kinematics(chain, asked.way.T_base_from);
    const auto end = kinematics::inverse_kinematics(chain, asked.way.T_base_to);
    job::WayResult out;
    out.stamp = asked.stamp;
    out.found = !begin.postures.empty() && !end.postures.empty();
    if (!out.found) return out;
    out.way.begin = begin.postures.front().q;
    out.way.end = end.postures.front().q;
    out.way.bow = robot::JointVector::Zero(out.way.begin.size());
    out.way.duration = slow;
    return out;
  }
  job::RestartMeasurements measure() { return {read(), {}, {}}; }

  int count(Place place) const {
    int out = 0;
    for (const Place p : places_) out += p == place;
    return out;
  }
  const Pose& tool() const { return tool_; }
  /// How often a pellet was put where one was already.
  int collisions() const { return collisions_; }
  void fall() { let_go(); }
  static Pose beside() { return pointing_down({0.33, 0.3, 0.05}, 0.3); }
  /// Such a pellet cannot be stood up in one go.
  static bool lies(std::size_t pellet) { return pellet % 3 == 1; }
  static Pose station() { return pointing_down({0.3, 0.3, 0.05}); }
  static Pose believed_tube() { return Pose(Eigen::Translation3d(0.2, -0.3, 0.1)); }
  static Pose true_tube() { return Pose(Eigen::Translation3d(0.202, -0.299, 0.1)); }
  static Pose T_tool_peg() {
    return Eigen::Translation3d(0, 0, 0.01) * Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()) * Pose::Identity();
  }

  Vector6 push = Vector6::Zero();  ///< On the tool, beside the contacts [N, N m].

 private:
  static constexpr double reach = 4e-3, stiffness = 2e4;

  std::optional<std::size_t> held() const { return first(Place::Gripper); }
  std::optional<std::size_t> first(Place place) const {
    for (std::size_t k = 0; k < places_.size(); ++k)
      if (places_[k] == place) return k;
    return std::nullopt;
  }
  bool at(const Pose& pose) const { return (tool_.translation() - pose.translation()).norm() < reach; }
  bool on_station() const { return at(station()) || at(beside()); }
  Pose peg() const { return true_tube().inverse() * tool_ * T_tool_peg(); }

  void close() {
    if (held() || random_.uniform() < misfortune_.no_grip) return;
    if (const auto k = first(Place::Station); k && on_station()) places_[*k] = Place::Gripper;
    for (std::size_t k = 0; k < places_.size() && !held(); ++k)
      if (places_[k] == Place::Bin && at(grasps_[k])) places_[k] = Place::Gripper;
  }
  void let_go() {
    const auto k = held();
    if (!k) return;
    const Eigen::Vector3d p = peg().translation();
    if (p.head<2>().norm() < 1e-3 && p.z() < -0.9 * depth) {
      places_[*k] = Place::Tube;
    } else if (on_station()) {
      collisions_ += count(Place::Station);
      places_[*k] = Place::Station;
    } else {
      places_[*k] = at(grasps_[*k]) ? Place::Bin : Place::Floor;
    }
  }
  /// The top of the tube pushes a pellet up where it stands on it, the wall of the bore one that is inside.
  Vector6 contact() const {
    Vector6 out = Vector6::Zero();
    const Eigen::Vector3d p = peg().translation();
    if (!held() || p.z() > 1e-3) return out;
    const double off = p.head<2>().norm(), play = bodies.inner_radius - bodies.peg_radius;
    if (off > bodies.outer_radius) return out;
    if (p.z() < -1e-3 && off > play) out.head<2>() = -stiffness * (off - play) / off * p.head<2>();
    if (p.z() >= -1e-3 && off > play) out.z() = -stiffness * std::min(p.z(), 0.0);
    const Eigen::Vector3d arm = tool_.linear() * T_tool_peg().translation();
    out.tail<3>() = arm.cross(Eigen::Vector3d(out.head<3>()));
    return out;
  }

  Random random_;
  Misfortune misfortune_;
  std::vector<Place> places_;
  std::vector<Pose> grasps_;
  Pose tool_, coming_;
  double time_ = 0.0;
  bool hold_ = false;
  int since_ = 100, collisions_ = 0;
};

}  // namespace kr5::test
