#include <kr5/work/arm_ways.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

#include <catch2/catch.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/robot/quintic_profile.hpp>
#include <kr5/work/job_runner.hpp>

#include "linked_cell.hpp"

namespace arm_ways_test {

using namespace kr5;
using Catch::Contains;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

struct Arm {
  Arm() : cell(test::small_cell(871, 1)), options(work::work_options(cell)) {
    work::place_over_bin(cell, options);
    home = cell.read().joints;
  }
  Pose tool(const VectorXd& q) const {
    return cell::nominal_chain(cell.believed()).flange(q) * cell.believed().tool->T_flange_tool;
  }
  /// The least distance from a limit.
  double margin(const VectorXd& q) const {
    const auto& limits = *cell.believed().robot.limits;
    return std::min((q - limits.lower).minCoeff(), (limits.upper - q).minCoeff());
  }
  sim::WorkCell cell;
  work::WorkOptions options;
  VectorXd home;
};

Pose down(const Vector3d& place, double turn, double lean = 0.0) {
  return Eigen::Translation3d(place) * Eigen::AngleAxisd(turn, Vector3d::UnitZ()) *
         Eigen::AngleAxisd(lean, Vector3d::UnitY()) * Pose(Eigen::AngleAxisd(M_PI, Vector3d::UnitX()));
}

/// A pick as one that is planned, with any turn of the tool at each place.
job::PlannedPick drawn_pick(Random& random, const work::WorkOptions& o) {
  job::PlannedPick out;
  const auto turn = [&] { return random.uniform(-M_PI, M_PI); };
  const Vector3d grasp = o.bin.T_base_bin * Vector3d(random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), 0.02);
  out.T_base_grasp = down(grasp, turn(), random.uniform(0, 0.5));
  out.visits = random.integer(3) == 0 ? 2 : 1;
  for (job::StationVisit* visit : {&out.first, &out.second}) {
    visit->T_base_put = down(o.T_base_lying_seat.translation() + Vector3d(0, 0, 0.02), turn(), random.uniform(0, 0.5));
    visit->T_base_take = down(o.T_base_standing_seat.translation() + Vector3d(0, 0, 0.02), turn());
  }
  return out;
}

job::WayRequest cycle_of(const job::PlannedPick& pick, const work::WorkOptions& options) {
  job::WayRequest out;
  out.phase = job::Phase::Pick;
  out.pick = pick;
  out.T_base_tube = options.job.places.T_base_tube;
  return out;
}

/// What the ways of a plan show.
void check_ways(const Arm& arm, const work::WayPlan& plan, const std::vector<work::ArmStop>& stops,
                const VectorXd& from) {
  constexpr int samples = 200;
  REQUIRE(plan.ways.size() == stops.size());
  const work::ArmWayOptions& o = arm.options.ways;
  VectorXd at = from;
  for (std::size_t k = 0; k < stops.size(); ++k) {
    const job::JointWay& way = plan.ways[k];
    CHECK(VectorXd(way.begin).isApprox(at));
    CHECK((arm.tool(way.end).translation() - stops[k].T_base_over.translation()).norm() < 1e-6);
    CHECK(arm.tool(way.end).isApprox(stops[k].T_base_over, 1e-6));
    CHECK(arm.margin(way.end) >= o.margin);
    double margin = HUGE_VAL, sag = 0.0, speed = 0.0;
    const double begin = arm.tool(way.begin).translation().z(), end = arm.tool(way.end).translation().z();
    Vector3d before = arm.tool(way.begin).translation();
    for (int s = 1; s <= samples; ++s) {
      const double share = robot::quintic_profile(static_cast<double>(s) / samples).x;
      const VectorXd q = way.at(share);
      const Vector3d place = arm.tool(q).translation();
      margin = std::min(margin, arm.margin(q));
      sag = std::max(sag, begin + share * (end - begin) - place.z());
      speed = std::max(speed, (place - before).norm() * samples / way.duration);
      before = place;
    }
    CHECK(margin >= std::min(arm.margin(way.begin), o.margin) - 1e-9);
    CHECK(sag < 1.5 * o.sag);  // checked at a few places by the planner
    CHECK(speed < 1.05 * arm.options.job.motion.speed);
    at = way.end;
  }
}

}  // namespace

TEST_CASE("ways of a cycle end at its places, keep their distance from the limits, and bring the wrist back") {
  const Arm arm;
  Random random(41);
  VectorXd from = arm.home;
  for (int run = 0; run < 12; ++run) {
    const auto stops = work::stops_ahead(cycle_of(drawn_pick(random, arm.options), arm.options), arm.options);
    const work::WayPlan plan = work::plan_ways(arm.cell.believed(), from, stops, arm.options);
    INFO("run " << run << ", unreachable " << plan.unreachable);
    REQUIRE(plan.possible());
    check_ways(arm, plan, stops, from);
    from = plan.ways.back().end;
    CHECK((from - arm.home).cwiseAbs().maxCoeff() < M_PI);
  }
}

TEST_CASE("a wrist at the end of its range is brought back, with every way within the limits") {
  const Arm arm;
  Random random(42);
  for (const int joint : {3, 5})
    for (const double turns : {-1.0, 1.0}) {
      VectorXd from = arm.home;
      from[joint] += 2 * M_PI * turns;
      if (arm.margin(from) < 0) continue;
      const auto stops = work::stops_ahead(cycle_of(drawn_pick(random, arm.options), arm.options), arm.options);
      const work::WayPlan plan = work::plan_ways(arm.cell.believed(), from, stops, arm.options);
      REQUIRE(plan.possible());
      check_ways(arm, plan, stops, from);
      CHECK(std::abs(plan.ways.back().end[joint]) <= M_PI);
    }
}

TEST_CASE("a place that the arm does not come to is named, and there is no way to it") {
  const Arm arm;
  Random random(43);
  job::PlannedPick far = drawn_pick(random, arm.options);
  far.visits = 1;
  far.first.T_base_take = down({1.6, 0.0, 0.3}, 0.0);
  const auto stops = work::stops_ahead(cycle_of(far, arm.options), arm.options);
  const work::WayPlan plan = work::plan_ways(arm.cell.believed(), arm.home, stops, arm.options);
  CHECK(plan.unreachable == 2);
  CHECK(plan.ways.empty());
}

TEST_CASE("a tube in which the arm could not tilt the pellet is no place for it") {
  Arm arm;
  job::WayRequest asked;
  asked.phase = job::Phase::Approach;
  asked.T_base_tube = arm.options.job.places.T_base_tube;
  const auto possible = [&] {
    return work::plan_ways(arm.cell.believed(), arm.home, work::stops_ahead(asked, arm.options), arm.options)
        .possible();
  };
  CHECK(possible());
  arm.options.job.insertion.tilt = 2.8;
  CHECK_FALSE(possible());
}

TEST_CASE("a supervisor is given the first way of what lies ahead, or told that there is none") {
  const Arm arm;
  Random random(44);
  job::PerceptionRequest asked;
  asked.kind = job::RequestKind::Way;
  asked.stamp = 17;
  asked.way = cycle_of(drawn_pick(random, arm.options), arm.options);
  asked.way.T_base_from = arm.tool(arm.home);
  asked.way.T_base_from.translation().z() += 0.03;
  asked.way.T_base_to = arm.options.job.places.over(asked.way.pick.T_base_grasp);
  const job::WayResult found = work::plan_way(asked, arm.cell.believed(), arm.home, arm.options);
  REQUIRE(found.found);
  CHECK(found.stamp == 17);
  CHECK(arm.tool(found.way.begin).isApprox(asked.way.T_base_from, 1e-6));
  CHECK(arm.tool(found.way.end).isApprox(asked.way.T_base_to, 1e-6));
  asked.way.T_base_tube.translation().x() += 1.0;
  CHECK_FALSE(work::plan_way(asked, arm.cell.believed(), arm.home, arm.options).found);
}

TEST_CASE("joints and options that do not fit are refused") {
  Arm arm;
  CHECK_THROWS_WITH(work::plan_ways(arm.cell.believed(), VectorXd::Zero(5), {}, arm.options), Contains("joints: 6"));
  arm.options.ways.joint_speed = 0.0;
  CHECK_THROWS_WITH(work::plan_ways(arm.cell.believed(), arm.home, {}, arm.options), Contains("joint_speed"));
}

}  // namespace arm_ways_test
