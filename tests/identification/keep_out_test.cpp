#include <algorithm>
#include <cmath>
#include <fstream>

#include <catch2/catch.hpp>

#include <kr5/cell/cell.hpp>
#include <kr5/core/error.hpp>
#include <kr5/core/random.hpp>
#include <kr5/identification/excitation.hpp>
#include <support/arm_cells.hpp>

namespace keep_out_test {

using namespace kr5;
using namespace kr5::identification;
using Catch::Matchers::Contains;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

Pose random_pose(Random& random) {
  Pose out = Pose::Identity();
  out.translate(0.3 * Vector3d(random.normal_vector(3)));
  out.rotate(Eigen::AngleAxisd(random.uniform(-3.0, 3.0), Vector3d(random.normal_vector(3)).normalized()));
  return out;
}

/// Distance of one point, by the definition of each zone.
double point_distance(const KeepOut& zone, const Vector3d& point) {
  const Vector3d p = zone.T_base_object.inverse() * point;
  if (zone.kind == KeepOutKind::Ball) return p.norm() - zone.radius;
  if (zone.kind == KeepOutKind::Floor) return p.z();
  Vector3d outside;
  for (int axis = 0; axis < 3; ++axis) outside[axis] = std::max(0.0, std::abs(p[axis]) - 0.5 * zone.size[axis]);
  return outside.norm();
}

/// Least distance of points all along a segment.
double sampled_distance(const KeepOut& zone, const LineSegment& segment) {
  double out = 1e9;
  for (int k = 0; k <= 2000; ++k)
    out = std::min(out, point_distance(zone, segment.from + k / 2000.0 * (segment.to - segment.from)));
  return out;
}

cell::Cell limited_arm(const std::string& joints) {
  cell::Cell cell = test::arm_cell({joints});
  const auto n = static_cast<Index>(joints.size());
  cell.robot.limits = cell::Limits{VectorXd::Constant(n, -2.0), VectorXd::Constant(n, 2.2), VectorXd(n), {}};
  cell.robot.limits->velocity.setConstant(2.0);
  for (Index j = 0; j < n; ++j)
    if (joints[static_cast<std::size_t>(j)] == 'p') {
      cell.robot.limits->lower[j] = -0.1, cell.robot.limits->upper[j] = 0.3, cell.robot.limits->velocity[j] = 0.5;
    }
  return cell;
}

/// Least clearance by frames of the links written out, at a fine step: without what the first joint does not move.
double sampled_clearance(const cell::Cell& cell, const JointMotion& fine, const ExcitationOptions& options,
                         const std::vector<double>& radii) {
  double out = 1e9;
  const kinematics::DhChain chain = cell::nominal_chain(cell);
  for (Index k = 0; k < fine.samples(); ++k) {
    Pose T = chain.T_base_0;
    for (std::size_t j = 0; j < chain.joints.size(); ++j) {
      const kinematics::DhJoint& joint = chain.joints[j];
      const double q = fine.q(k, Index(j));
      const bool slides = joint.type == kinematics::JointType::Prismatic;
      const Pose corner = T * Eigen::AngleAxisd(joint.theta_offset + (slides ? 0.0 : q), Vector3d::UnitZ()) *
                          Eigen::Translation3d(0.0, 0.0, joint.b + (slides ? q : 0.0));
      const Pose end = corner * Eigen::Translation3d(joint.a, 0.0, 0.0);
      for (const KeepOut& zone : options.keep_out) {
        if (j > 0) out = std::min(out, zone.distance({T.translation(), corner.translation()}) - radii[j]);
        if (j > 0 || joint.a != 0.0)
          out = std::min(out, zone.distance({corner.translation(), end.translation()}) - radii[j]);
      }
      T = T * joint.transform(q);
    }
    for (const KeepOut& zone : options.keep_out)
      out = std::min(out, zone.distance({T.translation(), T * Vector3d(options.points.col(0))}) - radii.back());
  }
  return out;
}

}  // namespace

TEST_CASE("the distance of a segment from a zone is the least one of its points") {
  Random random(5);
  int apart = 0;
  for (int trial = 0; trial < 400; ++trial) {
    KeepOut zone{.name = "zone", .kind = static_cast<KeepOutKind>(trial % 3), .T_base_object = random_pose(random)};
    zone.size = {random.uniform(0.0, 0.6), random.uniform(0.05, 0.6), trial % 4 ? random.uniform(0.05, 0.6) : 0.0};
    zone.radius = random.uniform(0.05, 0.4);
    LineSegment segment{0.8 * random.normal_vector(3), 0.8 * random.normal_vector(3)};
    if (trial % 7 == 0) segment.to = segment.from;                                             // a point
    if (trial % 5 == 0) segment.to = segment.from + 0.7 * zone.T_base_object.linear().col(1);  // along a side
    const double found = zone.distance(segment), sampled = sampled_distance(zone, segment);
    CAPTURE(trial);
    CHECK(found <= sampled + 1e-12);
    CHECK(found >= sampled - 2e-3);  // of points 1 mm apart
    if (found > 0.0) {               // then the nearest point is met to second order
      CHECK(found >= sampled - 1e-6 / found - 1e-9);
      ++apart;
    }
  }
  CHECK(apart > 150);
}

TEST_CASE("an object of a cell lies within its zone and touches its sides") {
  Random random(6);
  cell::PlacedObject tube;
  tube.kind = SolidKind::Tube;
  tube.radius = 0.1, tube.inner_radius = 0.05, tube.depth = 0.3;
  tube.T_base_object = random_pose(random);
  const KeepOut box = keep_out_of(tube);
  CHECK(box.name == "tube");
  for (const Vector3d& edge : {Vector3d(0.1, 0.0, 0.0), Vector3d(0.0, -0.1, -0.3)}) {
    CHECK(point_distance(box, tube.T_base_object * edge) == Approx(0.0).margin(1e-12));
    CHECK(point_distance(box, tube.T_base_object * (edge + Vector3d(0.0, 0.0, edge.z() < 0 ? -0.02 : 0.02))) ==
          Approx(0.02).epsilon(1e-9));
  }
  cell::PlacedObject plate;
  plate.kind = SolidKind::Plate;
  plate.name = "bench";
  plate.width = 1.0, plate.height = 0.5;
  CHECK(keep_out_of(plate).distance({Vector3d(0.2, 0.25, 0.1), Vector3d(0.2, 0.9, 0.04)}) > 0.04);
  CHECK(keep_out_of(plate).distance({Vector3d(0.2, 0.1, 0.1), Vector3d(0.2, 0.2, 0.04)}) == Approx(0.04));
  cell::PlacedObject ball;
  ball.kind = SolidKind::Ball;
  ball.radius = 0.2;
  CHECK(keep_out_of(ball).distance({Vector3d(1.0, -1.0, 0.0), Vector3d(1.0, 1.0, 0.0)}) == Approx(0.8));
}

TEST_CASE("links and tool stay clear of zones between the samples, for any arm") {
  struct Trial {
    const char* joints;
    ExcitationKind kind;
  };
  for (const Trial& trial : {Trial{"rrrr", ExcitationKind::Fourier}, Trial{"rrrr", ExcitationKind::PointToPoint},
                             Trial{"rrp", ExcitationKind::Fourier}, Trial{"prr", ExcitationKind::PointToPoint}}) {
    INFO(trial.joints << " " << name_of(trial.kind));
    const cell::Cell cell = limited_arm(trial.joints);
    ExcitationOptions options{.kind = trial.kind, .duration = 12.0, .points = Vector3d(0.0, 0.0, 0.15)};
    options.starts = 4, options.exchanges = 80;
    options.margin = 0.03;
    options.link_radii = Eigen::Vector3d(0.08, 0.06, 0.04);  // the last holds for all further ones
    std::vector<double> radii(cell.robot.dh.size() + 1, 0.04);
    radii[0] = 0.08, radii[1] = 0.06;
    // In the middle of where the unbound motion goes, so that it binds.
    const Excitation unbound = design_excitation(cell, motion_limits(cell), options);
    REQUIRE(unbound.fit.usable());
    CHECK(unbound.nearest.empty());
    const JointMotion path = unbound.motion.sampled(0.05);
    Vector3d mean = Vector3d::Zero();
    for (Index k = 0; k < path.samples(); ++k)
      mean += cell::nominal_chain(cell).flange(VectorXd(path.q.row(k))).translation() / double(path.samples());
    const Vector3d base = cell.robot.T_base_0.translation();
    const Vector3d away = (mean - base).normalized() * 0.9;
    KeepOut box{.name = "table", .size = {0.3, 0.2, 0.4}};
    box.T_base_object.translation() = base + away;
    KeepOut ball{.name = "lamp", .kind = KeepOutKind::Ball, .radius = 0.15};
    ball.T_base_object.translation() = base + Vector3d(away.y(), -away.x(), 0.2);
    KeepOut floor{.name = "floor", .kind = KeepOutKind::Floor};
    floor.T_base_object.translation().z() = -0.3;
    options.keep_out = {box, ball, floor};
    CHECK(sampled_clearance(cell, unbound.motion.sampled(0.01), options, radii) < options.margin);
    const Excitation bound = design_excitation(cell, motion_limits(cell), options);
    INFO(bound.fit.message);
    REQUIRE(bound.fit.usable());
    const double least = sampled_clearance(cell, bound.motion.sampled(3.1e-4), options, radii);
    CHECK(least >= options.margin);
    CHECK(bound.clearance <= least + 1e-12);
    CHECK(bound.clearance >= least - 0.03);  // 2 ms of a fast arm
    CHECK_THAT(bound.nearest, Contains(" to "));
  }
}

TEST_CASE("strokes whose torques are too great are slowed, not given up") {
  const cell::Cell cell = limited_arm("rrrr");
  MotionLimits limits = motion_limits(cell);
  ExcitationOptions options{.kind = ExcitationKind::PointToPoint, .duration = 15.0, .starts = 3, .exchanges = 40};
  const Excitation fast = design_excitation(cell, limits, options);
  CHECK(fast.slowed_strokes == 0);
  // What weight and friction ask for in any posture, and a tenth of what inertia added.
  JointMotion held = fast.motion.sampled(0.02);
  Random random(9);
  for (Index k = 0; k < held.samples(); ++k)
    for (Index j = 0; j < held.joints(); ++j) held.q(k, j) = random.uniform(limits.lower[j], limits.upper[j]);
  held.qd.setConstant(0.5), held.qdd.setZero();
  const VectorXd slow = nominal_torques(cell, held).cwiseAbs().colwise().maxCoeff();
  limits.torque = 1.05 * slow + 0.1 * (fast.torque_peak - slow).cwiseMax(0.0);
  const Excitation slowed = design_excitation(cell, limits, options);
  INFO(slowed.fit.message);
  REQUIRE(slowed.fit.usable());
  CHECK(slowed.slowed_strokes > 0);
  const JointMotion fine = slowed.motion.sampled(1e-3);
  const VectorXd peak = nominal_torques(cell, fine).cwiseAbs().colwise().maxCoeff();
  CHECK((peak.array() <= limits.torque.array()).all());
  CHECK(slowed.motion.duration() <= options.duration);
  // No point was given up for it: strokes are of the length of those without limits.
  const auto mean_stroke = [](const ExcitationMotion& m) {
    return (m.points.bottomRows(m.points.rows() - 1) - m.points.topRows(m.points.rows() - 1)).rowwise().norm().mean();
  };
  CHECK(mean_stroke(slowed.motion) > 0.4 * mean_stroke(fast.motion));
  CHECK(fine.qd.cwiseAbs().maxCoeff() < fast.motion.sampled(1e-3).qd.cwiseAbs().maxCoeff());
}

TEST_CASE("zones that cannot be used, and a start within one, are named") {
  const cell::Cell cell = limited_arm("rrr");
  const MotionLimits limits = motion_limits(cell);
  const auto refused = [&](const ExcitationOptions& options, const char* text) {
    CHECK_THROWS_WITH(design_excitation(cell, limits, options), Contains(text));
  };
  KeepOut table{.name = "table", .size = {0.4, 0.4, 0.4}};
  const VectorXd start = VectorXd::Zero(3);
  table.T_base_object.translation() = cell::nominal_chain(cell).flange(start).translation();
  refused({.start = start, .keep_out = {table}}, "start: clearance of link 3 to table is -0.1");
  refused({.keep_out = {{.name = "flat"}}}, "keep_out 'flat': size must be three lengths");
  refused({.keep_out = {{.name = "dot", .kind = KeepOutKind::Ball}}}, "keep_out 'dot': radius must be positive");
  refused({.keep_out = {table}, .margin = -0.1}, "margin must not be negative");
  refused({.link_radii = {}}, "link_radii must have at least one value");
  table.size.setConstant(9.0);
  const Excitation nowhere = design_excitation(cell, limits, {.keep_out = {table}, .starts = 2});
  CHECK_FALSE(nowhere.fit.usable());
  CHECK_THAT(nowhere.fit.message, Contains("the clearance of link") && Contains("to table"));
}

TEST_CASE("a file of zones is read, and its mistakes are named") {
  const std::string file = "keep_out_test.yaml";
  const auto write = [&](const char* text) { std::ofstream(file) << text; };
  write(
      "keep_out:\n- {name: table, kind: box, T_B_O: [1, 2, 3, 0, 0, 0], size: [0.5, 0.6, 0.7]}\n"
      "- {name: ground, kind: floor}\n");
  const std::vector<KeepOut> zones = load_keep_out(file);
  REQUIRE(zones.size() == 2);
  CHECK(zones[0].T_base_object.translation() == Vector3d(1.0, 2.0, 3.0));
  CHECK(zones[0].size == Vector3d(0.5, 0.6, 0.7));
  CHECK(zones[1].kind == KeepOutKind::Floor);
  write("keep_out:\n- {name: table, kind: cone}\n");
  CHECK_THROWS_WITH(load_keep_out(file), Contains(file + ":2") && Contains("cone") && Contains("ball"));
  write("keep_out:\n- {name: table, kind: ball, radius: -1}\n");
  CHECK_THROWS_WITH(load_keep_out(file), Contains("keep_out 'table': radius must be positive"));
  write("keep_out: []\n");
  CHECK_THROWS_WITH(load_keep_out(file), Contains("found no zone"));
  write("zones: []\n");
  CHECK_THROWS_WITH(load_keep_out(file), Contains("keep_out"));
  std::remove(file.c_str());
  CHECK_THROWS_AS(load_keep_out("no_such_file.yaml"), IoError);
}

}  // namespace keep_out_test
