// SPDX-License-Identifier: BSD-3-Clause
#include "work_cell_world.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <kr5/core/error.hpp>
#include <kr5/physics/identified_cell.hpp>
#include <kr5/physics/tube.hpp>

#include "actual_cell.hpp"
#include "insertion_limits.hpp"

namespace kr5::sim {
namespace {

using Eigen::Vector3d;

constexpr double loose_still_way = 1e-4;  // within which a loose pellet stays where it is, though it may rock [m]
constexpr double loose_still_time = 0.2;  // after which it lies; nothing falls so slowly [s]
constexpr double on_plate = 5e-4;         // above a plate on which a pellet lies [m]

/// What the controller is told: peg and bore as they are nominally.
cell::Cell believed_cell(const cell::Cell& given, const WorkCellOptions& options) {
  options.validate();
  cell::Cell cell = given;
  cell.effects = {};
  cell.peg = cell::Peg{.radius = options.pour.radius,
                       .length = 0.5 * (options.pour.height_min + options.pour.height_max),
                       .chamfer = given.peg ? given.peg->chamfer : 0.0};
  require(cell.tube.has_value(), "tube: a work cell needs one");
  const double bore = options.pour.radius + options.clearance;
  cell.tube->outer_radius += bore - cell.tube->inner_radius;
  cell.tube->inner_radius = bore;
  if (options.tube_depth > 0) cell.tube->depth = options.tube_depth;
  check_parts(cell);
  return cell;
}

InsertionSetup setup_of(const WorkCellOptions& options, Random& random) {
  const WorkCellErrors& e = options.errors;
  InsertionSetup out;
  out.clearance = options.clearance;
  out.offset = e.tube_offset;
  if (options.noise) out.offset += Eigen::Vector2d(random.normal(e.tube_position), random.normal(e.tube_position));
  out.tube_tilt = e.tube_tilt;
  out.face_error = e.face;
  out.stiffness_error = e.stiffness;
  out.servo_error = e.servo;
  out.friction_error = e.friction;
  out.noise = options.noise;
  out.seed = options.seed;
  return out;
}

/// The force sensor as it really is: scales, offsets and their drift drawn beside what the cell carries.
void draw_sensor(cell::Cell& cell, const WorkCellErrors& errors, Random& random) {
  constexpr double lever = 0.1;  // of a torque's offset to a force's [m]
  const auto draw = [&](double sigma) { return sigma > 0.0 ? random.normal(sigma) : 0.0; };
  physics::WrenchSensor sensor(cell);
  for (int i = 0; i < 6; ++i) {
    const double share = i < 3 ? 1.0 : lever;
    sensor.gain(i, i) += draw(errors.force_gain);
    sensor.bias[i] += draw(share * errors.force_bias);
    sensor.rate[i] += draw(share * errors.force_drift);
  }
  physics::set_wrench_sensor(cell, sensor);
}

cell::Cell real_cell(const cell::Cell& given, const cell::Cell& believed, const WorkCellOptions& options,
                     Random& random) {
  cell::Cell cell = believed;
  cell.effects = given.effects;
  cell::Cell out = actual_cell(cell, setup_of(options, random));
  if (options.noise) draw_sensor(out, options.errors, random);
  return out;
}

CommandedArmOptions arm_of(const WorkCellOptions& options) {
  return {.repeatability = options.errors.repeatability,
          .force_delay = options.errors.force_delay,
          .noise = options.noise,
          .seed = options.seed * 3 + 5};
}

/// Way of the farthest point of a pellet, at most [m].
double way_between(const Pose& from, const Pose& to, const PelletTruth& pellet) {
  const double turn = log_rotation(to.linear() * from.linear().transpose()).norm();
  return (to.translation() - from.translation()).norm() + turn * std::hypot(pellet.radius, 0.5 * pellet.height);
}

/// Where a further tube really stands.
Pose drawn_tube(const Pose& T_base_tube, const WorkCellOptions& options, Random& random) {
  const WorkCellErrors& e = options.errors;
  Vector6 off = Vector6::Zero();
  off.head<2>() = e.tube_offset;
  if (options.noise)
    for (int i = 0; i < 5; ++i) off[i] += random.normal(i < 2 ? e.tube_position : i == 2 ? e.face : e.tube_tilt);
  return T_base_tube * to_pose(off);
}

CellSolids solids_of(const cell::Cell& real, const WorkCellOptions& options, Random& random) {
  CellSolids out;
  out.bin = options.bin;
  out.stand = options.stand;
  if (options.noise) {
    for (double& x : out.bin.T_base_bin.translation()) x += random.normal(options.errors.bin_position);
    out.stand.T_base_stand.translation().z() += random.normal(options.errors.stand_height);
  }
  out.T_base_tubes.push_back(real.tube->T_base_tube * physics::T_tube_actual(real));
  for (const Pose& T : options.further_tubes) out.T_base_tubes.push_back(drawn_tube(T, options, random));
  out.tube = physics::peg_tube_shape(real);
  out.tube.validate();
  return out;
}

}  // namespace

WorkCell::World::World(const cell::Cell& cell, const WorkCellOptions& given)
    : options(given),
      random(given.seed),
      believed(believed_cell(cell, given)),
      real(real_cell(cell, believed, given, random)),
      arm(real, believed, arm_of(given)),
      solids(solids_of(real, given, random)),
      pile(given.bin, given.pile) {
  if (options.noise) grip_factor = std::max(1 + random.normal(options.errors.stiffness), 0.1);
  const SettledPile poured = pour_pellets(options.bin, options.pour, options.pile);
  for (std::size_t i = 0; i < poured.scene.pellets.size(); ++i) {
    Pellet body = poured.scene.pellets[i];
    if (options.noise) body.radius += random.normal(options.errors.pellet_radius);
    pile.add(body, true);
    now.pile_numbers.push_back(static_cast<int>(i));
    now.pellets.push_back({.radius = body.radius, .height = body.height});
  }
  now.T_base_tool = arm.T_base_tool();
  note_resting();
}

int WorkCell::World::body_in_pile(int number) const {
  const auto at = std::find(now.pile_numbers.begin(), now.pile_numbers.end(), number);
  return at == now.pile_numbers.end() ? -1 : static_cast<int>(at - now.pile_numbers.begin());
}

CylinderBody WorkCell::World::body(int number) const {
  const PelletTruth& p = pellet(number);
  return cylinder_of(p.T_base_pellet, p.radius, p.height);
}

/// Where the pellets of the pile are now, and which pellets are obstacles to others.
void WorkCell::World::note_resting() {
  for (std::size_t i = 0; i < now.pile_numbers.size(); ++i)
    pellet(now.pile_numbers[i]).T_base_pellet = solids.bin.T_base_bin * pile.pellet(static_cast<int>(i)).T_bin_pellet;
  solids.pellets.clear();
  for (int i = 0; i < static_cast<int>(now.pellets.size()); ++i)
    if (pellet(i).place != PelletPlace::Grip || now.gripper.in_pile) solids.pellets.push_back({i, body(i)});
}

void WorkCell::World::send(const robot::RobotCommand& command) {
  tell_gripper(command.gripper);
  const robot::RobotReading told = arm.read(now.gripper.pellet >= 0);
  if (now.scanning) {
    now.scan_times.push_back(arm.time());
    now.scan_real.push_back(arm.T_base_flange());
    now.scan_told.push_back(told.T_base_flange);
  }
  arm.send(command, [this](double passed) { moved(passed); });
}

/// Everything moves on, while the tool goes steadily to where it is now.
void WorkCell::World::moved(double passed) {
  const Pose from = std::exchange(now.T_base_tool, arm.T_base_tool());
  Vector6 velocity;
  velocity << now.T_base_tool.translation() - from.translation(),
      log_rotation(now.T_base_tool.linear() * from.linear().transpose());
  const Vector6 before = std::exchange(now.velocity, velocity / passed);
  close_gripper();
  if (now.gripper.in_pile || !pile.at_rest()) run_pile(passed);
  if (now.gripper.in_pile) {
    watch_in_pile();
  } else if (now.gripper.pellet < 0) {
    arm.touch(Vector6::Zero());
  } else if (now.gripper.rigid) {
    carry(from, before, passed);
  } else {
    press(from, passed);
  }
  if (!loose.empty()) run_loose(passed);
}

/// The pile until now; its clock stands while it lies still.
void WorkCell::World::run_pile(double passed) {
  pile.damp_since(now.disturbed);
  for (now.pile_due += passed; now.pile_due >= 0.5 * options.pile.step; now.pile_due -= options.pile.step) {
    if (now.gripper.in_pile) hold_in_pile();
    pile.step();
  }
  note_resting();
}

void WorkCell::World::run_loose(double passed) {
  for (std::size_t i = 0; i < loose.size();) {
    const Pose T_tool_pellet = now.T_base_tool.inverse() * pellet(now.loose[i].number).T_base_pellet;
    constexpr double nozzle = 0.05;  // up to which the air reaches [m]
    const bool blown = now.gripper.told.air && T_tool_pellet.translation().z() > 0.0 &&
                       T_tool_pellet.translation().z() < nozzle &&
                       T_tool_pellet.translation().head<2>().norm() < pellet(now.loose[i].number).radius;
    HeldPeg& body = *loose[i];
    body.hold(false, blown);
    body.search_anew();
    const int steps = static_cast<int>(std::ceil(passed / body.longest_step() - 1e-6));
    for (int k = 0; k < steps; ++k) body.advance(body.pose(), Vector6::Zero(), passed / steps);
    pellet(now.loose[i].number).T_base_pellet = body.pose() * now.loose[i].T_pellet_peg.inverse();
    if (!settle_loose(i, passed)) ++i;
  }
  note_resting();
}

/// Whether it is loose no more.
bool WorkCell::World::settle_loose(std::size_t index, double passed) {
  LoosePellet& it = now.loose[index];
  PelletTruth& truth = pellet(it.number);
  const CylinderBody there = body(it.number);
  const double cosine = std::min(std::abs(there.rotation(2, 2)), 1.0);
  const double lower = there.centre.z() - there.half * cosine - there.radius * std::sqrt(1 - cosine * cosine);
  const bool in_tube = solids.tube_around(there) >= 0;
  if (solids.in_bin(there)) {
    drop_into_bin(index);
    truth.place = PelletPlace::Bin;
  } else if (lower <= options.table && !in_tube) {
    truth.place = PelletPlace::Lost;
  } else {
    it.quiet += passed;
    if (way_between(it.T_base_quiet, truth.T_base_pellet, truth) > loose_still_way) {
      it.quiet = 0.0;
      it.T_base_quiet = truth.T_base_pellet;
    }
    if (it.quiet < loose_still_time) return false;
    truth.place = in_tube                            ? PelletPlace::Tube
                  : solids.on_stand(there, on_plate) ? PelletPlace::Stand
                                                     : PelletPlace::Lost;
  }
  loose.erase(loose.begin() + static_cast<std::ptrdiff_t>(index));
  now.loose.erase(now.loose.begin() + static_cast<std::ptrdiff_t>(index));
  note_resting();
  return true;
}

void WorkCell::World::drop_into_bin(std::size_t index) {
  const LoosePellet& it = now.loose[index];
  const HeldPegState motion = loose[index]->state();
  const Pose T_bin_base = solids.bin.T_base_bin.inverse();
  pile.add({.T_bin_pellet = T_bin_base * pellet(it.number).T_base_pellet,
            .radius = pellet(it.number).radius,
            .height = pellet(it.number).height});
  PileBody& body = pile.bodies().back();
  body.velocity = T_bin_base.linear() * motion.v;
  body.spin = T_bin_base.linear() * motion.T.linear() * motion.w;
  now.pile_numbers.push_back(it.number);
  now.disturbed = pile.time();
}

WorkCellRecord WorkCell::World::record() const {
  WorkCellRecord out = now;
  out.random = random.state();
  out.arm = arm.state();
  out.pile = pile.motion();
  if (peg) out.peg = peg->state();
  for (std::size_t i = 0; i < loose.size(); ++i) out.loose[i].motion = loose[i]->state();
  return out;
}

void WorkCell::World::restore(const WorkCellRecord& from) {
  const int count = static_cast<int>(from.pellets.size());
  const auto known = [&](int number) { return number >= 0 && number < count; };
  require(from.pellets.size() == now.pellets.size(), "pellets: found " + std::to_string(count) + ", expected " +
                                                         std::to_string(now.pellets.size()) +
                                                         "; the state is one of another cell");
  require(from.pile.bodies.size() == from.pile_numbers.size() &&
              std::all_of(from.pile_numbers.begin(), from.pile_numbers.end(), known),
          "pile_numbers: does not match the bodies of the pile");
  require(from.gripper.pellet == -1 || known(from.gripper.pellet), "gripper.pellet: there is no such pellet");
  for (const LoosePellet& it : from.loose) require(known(it.number), "loose: there is no such pellet");
  arm.restore(from.arm);
  random.restore(from.random);
  pile.restore(from.pile);
  now = from;
  peg.reset();
  loose.clear();
  const GripperState& g = now.gripper;
  if (g.pellet >= 0 && !g.in_pile) {
    peg = peg_of(g.pellet, g.T_pellet_peg, g.T_tool_pellet, g.height);
    peg->restore(from.peg);
  }
  for (const LoosePellet& it : now.loose) {
    loose.push_back(peg_of(it.number, it.T_pellet_peg, Pose::Identity(), 0.0));
    loose.back()->restore(it.motion);
  }
  note_resting();
}

}  // namespace kr5::sim
