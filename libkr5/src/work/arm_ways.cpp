// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/work/arm_ways.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <kr5/core/error.hpp>
#include <kr5/robot/quintic_profile.hpp>

#include "work/arm_postures.hpp"

namespace kr5::work {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int checks = 12;            // of a way between its ends
constexpr int time_steps = 48;        // by which speed and acceleration of the tool are found
constexpr int wrist_joints = 3;       // the last ones, which are light
constexpr double worth_a_bow = 0.25;  // of the sag that a way may have

class WayPlanner {
 public:
  WayPlanner(const cell::Cell& believed, const WorkOptions& options)
      : arm_(believed, options.ways.margin), ways_(options.ways), motion_(options.job.motion) {
    const Eigen::Index n = believed.robot.joints(), wrist = std::min<Eigen::Index>(n, wrist_joints);
    speed_ = VectorXd::Constant(n, ways_.joint_speed);
    speed_.tail(wrist).setConstant(ways_.wrist_speed);
    if (believed.robot.limits && believed.robot.limits->velocity.size() == n)
      speed_ = speed_.cwiseMin(believed.robot.limits->velocity);
  }

  WayPlan plan(const VectorXd& joints, std::span<const ArmStop> stops) const;

 private:
  /// A posture at a place, and the best of the place before.
  struct Step {
    VectorXd q;
    double time = 0.0;  ///< Since the beginning, as far as the joints take it [s].
    std::size_t from = 0;
  };
  using Layer = std::vector<Step>;

  Layer layer(const Layer& before, const ArmStop& stop) const;
  double joint_time(const VectorXd& from, const VectorXd& to) const;
  std::optional<job::JointWay> way(const VectorXd& from, const VectorXd& to) const;
  VectorXd bow(const VectorXd& from, const VectorXd& to) const;
  bool sound(const job::JointWay& way) const;
  double duration(const job::JointWay& way) const;

  ArmPostures arm_;
  ArmWayOptions ways_;
  job::PathLimits motion_;
  VectorXd speed_;  ///< [rad/s or m/s]
};

double WayPlanner::joint_time(const VectorXd& from, const VectorXd& to) const {
  return robot::quintic_profile_peak.v * ((to - from).cwiseAbs().array() / speed_.array()).maxCoeff();
}

/// By how much the joints leave their straight line so that the tool does not sag between two places.
VectorXd WayPlanner::bow(const VectorXd& from, const VectorXd& to) const {
  const VectorXd middle = 0.5 * (from + to);
  Pose T = arm_.tool(middle);
  const double height = 0.5 * (arm_.tool(from).translation().z() + arm_.tool(to).translation().z());
  if (T.translation().z() > height - worth_a_bow * ways_.sag) return VectorXd::Zero(to.size());
  T.translation().z() = height;
  const auto raised = arm_.posture_near(T, middle);
  return raised ? VectorXd(*raised - middle) : VectorXd(VectorXd::Zero(to.size()));
}

bool WayPlanner::sound(const job::JointWay& way) const {
  const Pose begin = arm_.tool(way.begin), end = arm_.tool(way.end);
  for (int k = 1; k < checks; ++k) {
    const double share = static_cast<double>(k) / checks;
    const VectorXd q = way.at(share);
    if (!arm_.within(q, way.begin, way.end)) return false;
    const Pose T = arm_.tool(q);
    const double height = begin.translation().z() + share * (end.translation().z() - begin.translation().z());
    if (T.translation().z() < height - ways_.sag) return false;
    const Vector3d axis = ((1 - share) * begin.linear().col(2) + share * end.linear().col(2)).normalized();
    if (axis.dot(T.linear().col(2)) < std::cos(ways_.swing)) return false;
  }
  return true;
}

std::optional<job::JointWay> WayPlanner::way(const VectorXd& from, const VectorXd& to) const {
  job::JointWay out{robot::joint_vector(from), robot::joint_vector(to), robot::joint_vector(bow(from, to))};
  if (!sound(out)) return std::nullopt;
  return out;
}

/// As long as the joints take, and longer where the tool would be too fast.
double WayPlanner::duration(const job::JointWay& way) const {
  const double time = joint_time(way.begin, way.end), step = time / time_steps;
  if (time == 0.0) return 0.0;
  Pose before = arm_.tool(way.begin);
  Vector6 last = Vector6::Zero();
  double slower = 1.0;
  for (int k = 1; k <= time_steps; ++k) {
    const Pose T = arm_.tool(way.at(robot::quintic_profile(static_cast<double>(k) / time_steps).x));
    Vector6 speed;
    speed << T.translation() - before.translation(), log_rotation(T.linear() * before.linear().transpose());
    speed /= step;
    const Vector6 acceleration = (speed - last) / step;
    slower = std::max({slower, speed.head<3>().norm() / motion_.speed, speed.tail<3>().norm() / motion_.turning_speed,
                       std::sqrt(acceleration.head<3>().norm() / motion_.acceleration),
                       std::sqrt(acceleration.tail<3>().norm() / motion_.turning_acceleration)});
    before = T;
    last = speed;
  }
  return slower * time;
}

/// The postures at a place to which a sound way leads, each by the quickest one.
WayPlanner::Layer WayPlanner::layer(const Layer& before, const ArmStop& stop) const {
  Layer out;
  for (const VectorXd& q : arm_.postures(stop)) {
    std::vector<Step> steps;
    for (std::size_t i = 0; i < before.size(); ++i)
      steps.push_back({q, before[i].time + joint_time(before[i].q, q), i});
    std::sort(steps.begin(), steps.end(), [](const Step& a, const Step& b) { return a.time < b.time; });
    const auto best =
        std::find_if(steps.begin(), steps.end(), [&](const Step& s) { return way(before[s.from].q, q).has_value(); });
    if (best != steps.end()) out.push_back(*best);
  }
  return out;
}

WayPlan WayPlanner::plan(const VectorXd& joints, std::span<const ArmStop> stops) const {
  WayPlan out;
  std::vector<Layer> layers{{{joints}}};
  for (const ArmStop& stop : stops) {
    layers.push_back(layer(layers.back(), stop));
    if (!layers.back().empty()) continue;
    out.unreachable = static_cast<int>(layers.size()) - 2;
    return out;
  }
  const Layer& last = layers.back();
  auto at = static_cast<std::size_t>(
      std::min_element(last.begin(), last.end(), [](const Step& a, const Step& b) { return a.time < b.time; }) -
      last.begin());
  for (std::size_t k = stops.size(); k > 0; --k) {
    const Step& step = layers[k][at];
    job::JointWay found = *way(layers[k - 1][step.from].q, step.q);
    found.duration = duration(found);
    out.duration += found.duration;
    out.ways.insert(out.ways.begin(), found);
    at = step.from;
  }
  return out;
}

/// The mouth of a tube: where the camera looks, the pellet tilted to every side on the face, and at its depth.
ArmStop tube_stop(const Pose& T_base_tube, const WorkOptions& options) {
  constexpr int sides = 8;
  const force::InsertionOptions& insertion = options.job.insertion;
  const Pose T_peg_tool = options.job.places.T_tool_peg.inverse(), look = options.job.places.look(T_base_tube);
  ArmStop out{options.job.places.over(look), {look}, false};
  for (int k = 0; k < sides; ++k) {
    const double towards = 2 * std::numbers::pi * k / sides;
    const Vector3d axis(std::cos(towards), std::sin(towards), 0.0);
    out.near.emplace_back(T_base_tube * Eigen::AngleAxisd(insertion.tilt, axis) * T_peg_tool);
  }
  out.near.emplace_back(T_base_tube * Eigen::Translation3d(0, 0, -insertion.motion.depth) * T_peg_tool);
  return out;
}

/// A place that is touched, with the overtravel.
ArmStop touched_stop(const Pose& T_base_tool, const job::JobPlaces& places) {
  return {places.over(T_base_tool), {T_base_tool * Eigen::Translation3d(0, 0, places.overtravel)}, false};
}

ArmStop scan_stop(const job::JobPlaces& places, bool again) {
  const Pose& begin = again ? *places.T_base_rescan : places.T_base_scan;
  const Pose& end = again ? *places.T_base_rescan_end : places.T_base_scan_end;
  return {places.over(begin), {begin, end}, true};
}

}  // namespace

WayPlan plan_ways(const cell::Cell& believed, const VectorXd& joints, std::span<const ArmStop> stops,
                  const WorkOptions& options) {
  options.ways.validate();
  options.job.motion.validate();
  require(joints.size() == believed.robot.joints() && joints.allFinite(),
          "joints: " + std::to_string(believed.robot.joints()) + " finite joint values are needed");
  return WayPlanner(believed, options).plan(joints, stops);
}

std::vector<ArmStop> stops_ahead(const job::WayRequest& asked, const WorkOptions& options) {
  const job::JobPlaces& places = options.job.places;
  const bool again = places.T_base_rescan && asked.T_base_to.isApprox(places.over(*places.T_base_rescan));
  if (asked.phase == job::Phase::Scan) return {scan_stop(places, again)};
  for (const auto& line : {places.station_scan, places.tube_scan})
    if (line && asked.T_base_to.isApprox(places.over(line->T_base_begin)))
      return {{asked.T_base_to, {line->T_base_begin, line->T_base_end}, false}};
  std::vector<ArmStop> out;
  const bool pick = asked.phase == job::Phase::Pick, regrip = asked.phase == job::Phase::Regrip;
  if (pick) out.push_back(touched_stop(asked.pick.T_base_grasp, places));
  if (pick || regrip || asked.phase == job::Phase::Stand)
    for (int k = asked.visit; k < asked.pick.visits; ++k) {
      if (!regrip || k > asked.visit) out.push_back(touched_stop(asked.pick.visit(k).T_base_put, places));
      out.push_back(touched_stop(asked.pick.visit(k).T_base_take, places));
    }
  out.push_back(tube_stop(asked.T_base_tube, options));
  out.push_back(scan_stop(places, false));
  return out;
}

job::WayResult plan_way(const job::PerceptionRequest& asked, const cell::Cell& believed, const VectorXd& joints,
                        const WorkOptions& options) {
  job::WayResult out;
  out.stamp = asked.stamp;
  const auto begin = ArmPostures(believed, options.ways.margin).followed(joints, asked.way.T_base_from);
  if (!begin) return out;
  const WayPlan plan = plan_ways(believed, *begin, stops_ahead(asked.way, options), options);
  out.found = plan.possible();
  if (out.found) out.way = plan.ways.front();
  return out;
}

}  // namespace kr5::work
