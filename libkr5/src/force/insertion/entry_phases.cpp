// SPDX-License-Identifier: BSD-3-Clause
/// @file The phases in which the peg goes into the hole, or back from it.
#include <algorithm>
#include <cmath>

#include "force/insertion/machine.hpp"

namespace kr5::force {
namespace {

constexpr double near = 1e-4;         // of a slide's end [m]
constexpr double dropped = 3e-4;      // below its level an upright peg is in the bore [m]
constexpr double entered = 1e-3;      // deep enough in it to be pushed [m]
constexpr double settled = 0.2;       // for which an upright peg shall not sink any more [s]
constexpr double mouth = 1.0;         // that an upright peg may take to sink into the bore [s]
constexpr double release = 2.0;       // for which a peg may take to be let go, and to go in then [s]
constexpr double quiet = 0.1;         // for which forces across are small before it is let go [s]
constexpr double loose = 1.0;         // [N]
constexpr double creeping = 2e-3;     // with which the wanted depth is come to [m/s]
constexpr double elsewhere = 1.5e-3;  // more than the play of a bore: there is none [m]
constexpr double seeking = 4e-3;      // towards the far wall, until it is met [m/s]
constexpr double stuck = 0.8;         // for which a pushed peg may stand still [s]
constexpr double friction = 0.7;      // more of the press than any friction across takes, up an edge, too [-]

}  // namespace

/// The rim is below the face with the tilt towards `azimuth`: in the bore, or, as long as no turn has told, beside the
/// tube.
void Insertion::Machine::begin_entry(double azimuth) noexcept {
  toward = azimuth;
  doubtful = !known && state.hole_std == 0;
  probing = doubtful;
  begun = path.p.head<2>();
  enter_phase(Phase::Upright);
}

void Insertion::Machine::slide(const ContactEstimate& now) noexcept {
  options.entry == EntryAttitude::Tilted ? slide_tilted(now) : slide_upright(now);
}

/// Rim first, until it falls into the bore or meets its far wall. Across the way the peg follows the forces: on the
/// cusp two points of the edge guide it.
void Insertion::Machine::slide_tilted(const ContactEstimate& now) noexcept {
  const Eigen::Vector2d d = direction(), along_wall = {-d.y(), d.x()};
  const Eigen::Vector2d gives = now.peg.head<2>() - now.arm.head<2>();
  const Eigen::Vector2d target = state.hole.head<2>() - 0.7 * capture_offset() * d - gives;
  const InsertionMotion& m = options.motion;
  const Eigen::Vector3d reference = path.towards({target.x(), target.y(), path.p.z()}, m.slide_speed, m.acceleration);
  const double guided = along_wall.dot(lateral_admittance(now, Eigen::Vector2d::Zero()));
  drive(d * d.dot(reference.head<2>()) + along_wall * (0.5 * along_wall.dot(reference.head<2>()) + guided),
        press_speed(options.forces.slide, now));
  plan_tilt(0.0, 0.0);
  const bool wall = -d.dot(now.across()) > options.forces.lean + friction * std::max(now.press(), 0.0);
  const bool there = settled_for(settled, d.dot(target - path.p.head<2>()) < near);
  if (wall || captured(now) || there) begin_entry(toward);
}

/// Until the force drops, or the peg (5.41).
void Insertion::Machine::slide_upright(const ContactEstimate& now) noexcept {
  drive(options.motion.slide_speed * direction(), press_speed(options.forces.slide, now));
  plan_tilt(0.0, 0.0);
  const bool released = seconds() > 2 * settled && now.press() < options.forces.drop;
  if (released || now.peg.z() < level - dropped) {
    feed = 0.0;
    face = level;
    return enter_phase(Phase::Push);
  }
  const double most = options.limits.travel > 0 ? options.limits.travel : options.bodies.peg_radius;
  if ((path.p.head<2>() - begun).norm() > most) end_attempt(Reason::NoDrop);
}

/// Takes the tilt away while the peg leans on the far wall of the bore: so its near side clears the edge, however small
/// the clearance is. Before it leans, or has gone farther than any far wall is, it keeps its tilt: one that is set
/// upright halfway stands on the near edge, over which a rough one does not slide.
void Insertion::Machine::upright(const ContactEstimate& now) noexcept {
  const Eigen::Vector2d d = direction();
  const InsertionForces& f = options.forces;
  const double pushed_back = -d.dot(now.across());
  const bool begun_upright = lean.v < 0;
  const double rubs = begun_upright ? 0.0 : friction * std::max(now.press(), 0.0);
  const bool leans = pushed_back > 0.5 * f.lean + rubs;
  const Eigen::Vector2d seek = leans || begun_upright ? Eigen::Vector2d::Zero() : Eigen::Vector2d(seeking * d);
  const bool deep = probing && now.peg.z() < face - options.limits.descent;
  drive(lateral_admittance(now, -f.lean * d) + seek,
        deep ? 0.0 : press_speed(begun_upright ? f.slide : std::min(f.lean, f.slide), now));
  const double load = now.across().norm() / (4 * f.lean);
  const double pace = options.motion.upright_speed * std::clamp(1.5 - load, 0.0, 1.0);
  const bool far = d.dot(path.p.head<2>() - begun) > capture_offset() + elsewhere;
  if (far && !leans && !begun_upright && !probing && !felt_again) return feel_again();
  const bool begin = leans || (far && !probing);
  if (begin) probing = false;
  plan_tilt(begin || lean.v < 0 ? std::max(lean.towards(0.0, pace, options.motion.turning, options.cycle), -pace) : 0.0,
            0.0);
  if (probing) {
    if ((path.p.head<2>() - begun).norm() > 2 * options.bodies.inner_radius) end_attempt(Reason::NoContact);
    return;
  }
  if (lean.x > 5e-3) {
    cycles = begin && lean.v < 0 ? 0 : cycles;
    return;
  }
  settle_upright(now);
}

/// There is no wall where one should be: much friction can mislead a turn by millimetres. Another one, from where the
/// peg is, tells better.
void Insertion::Machine::feel_again() noexcept {
  felt_again = true;
  turn.clear();
  angle_swept = 0.0;
  enter_phase(Phase::Roll);
}

/// An upright peg sinks into the mouth of the bore, or stands beside it.
void Insertion::Machine::settle_upright(const ContactEstimate& now) noexcept {
  const bool sunk = now.peg.z() < face - entered;
  if (sunk && lean.x < 1e-3) {
    feed = 0.0;
    begun = path.p.head<2>();
    return enter_phase(doubtful ? Phase::Confirm : Phase::Push);
  }
  if (seconds() < waiting(mouth, entered)) return;
  if (spiralled || options.entry != EntryAttitude::Tilted) return end_attempt(Reason::NoDrop);
  spiralled = true;
  begin_spiral(now);
}

void Insertion::Machine::begin_spiral(const ContactEstimate& now) noexcept {
  level = now.peg.z();
  begun = path.p.head<2>();
  angle_swept = 0.0;
  enter_phase(Phase::Spiral);
}

/// A peg that was let down without a turn leans on a wall: that of the bore, or the tube's from outside. In the bore
/// there is one on the other side as well.
void Insertion::Machine::confirm(const ContactEstimate& now) noexcept {
  const Eigen::Vector2d d = direction();
  drive(lateral_admittance(now, options.forces.lean * d) - seeking * d, 0.0);
  plan_tilt(0.0, 0.0);
  if (d.dot(now.across()) > 0.5 * options.forces.lean) return enter_phase(Phase::Push);
  const double play = 2 * (options.bodies.inner_radius - options.bodies.peg_radius);
  if ((path.p.head<2>() - begun).norm() > play + elsewhere) end_attempt(Reason::NoContact);
}

/// An upright peg beside a hole that is near: round and round it, outwards.
void Insertion::Machine::spiral(const ContactEstimate& now) noexcept {
  const InsertionMotion& m = options.motion;
  const double radius = m.spiral_pitch * angle_swept / (2 * M_PI);
  angle_swept += 0.5 * m.slide_speed / std::max(radius, 2 * m.spiral_pitch) * options.cycle;
  const Eigen::Vector2d next = begun + radius * Eigen::Vector2d(std::cos(angle_swept), std::sin(angle_swept));
  drive(path.towards({next.x(), next.y(), path.p.z()}, m.slide_speed, m.acceleration).head<2>(),
        press_speed(options.forces.slide, now));
  plan_tilt(0.0, 0.0);
  if (now.peg.z() < level - dropped || now.peg.z() < face - entered) {
    feed = 0.0;
    return enter_phase(Phase::Push);
  }
  if (radius < m.spiral_radius) return;
  if (!known) return end_attempt(Reason::NoDrop);
  known = false;  // the hole is not where it was: feel for it
  enter_phase(Phase::Retreat);
}

void Insertion::Machine::finish_inserted(const ContactEstimate& now) noexcept {
  state.stopped_in = Phase::Push;
  state.reason = Reason::Inserted;
  state.hole = {now.peg.x(), now.peg.y(), face};
  last_hole = state.hole;
  enter_phase(Phase::Done);
}

/// A peg that is pushed by its weight or by air: nobody can tell how deep it is, but that the grip is empty.
void Insertion::Machine::let_go(const PegReading& reading, const ContactEstimate& now) noexcept {
  plan_tilt(0.0, 0.0);
  drive(holding ? lateral_admittance(now, Eigen::Vector2d::Zero()) : Eigen::Vector2d::Zero(), 0.0);
  if (holding) {
    if (!settled_for(quiet, now.across().norm() < loose) && seconds() < release) return;
    holding = false;
    air = options.insert_by == InsertBy::Air;
    cycles = 0;
    return;
  }
  if (!reading.told.status.gripped) {
    air = false;
    return finish_inserted(now);
  }
  if (seconds() > release) stop_for(Reason::Blocked);  // it has slid in the grip: nobody knows by how much
}

/// Deeper, giving way to forces and moments across.
void Insertion::Machine::push(const PegReading& reading, const ContactEstimate& now) noexcept {
  const InsertionForces& f = options.forces;
  const InsertionMotion& m = options.motion;
  if (!holding || (options.insert_by != InsertBy::Arm && state.depth > entered)) return let_go(reading, now);
  Vector6 wrench;
  wrench << now.force, now.moment;
  const Vector6 gives = admittance_twist(wrench, Vector6::Zero(), {f.lateral_gain, f.angular_gain, m.slide_speed, 0.1});
  const bool meets = std::max(now.press(), sharp.press()) > met_part * f.push;
  feed = meets ? 0.0 : std::min(feed + m.acceleration * options.cycle, most_push);
  const double left = std::max(m.depth - state.depth, 0.0);
  const double most = std::min(most_push, creeping + std::sqrt(m.acceleration * left));
  const double along = std::max(-feed + f.axial_gain * (now.press() - f.push), -most);
  path.drive({gives.x(), gives.y(), along}, meets ? m.braking : m.acceleration);
  path.turn(gives.segment<2>(3), m.turning);
  plan_from_path();
  if (state.depth >= m.depth) return finish_inserted(now);
  if (settled_cycles == 0) level = now.peg.z();
  const bool held_up = now.press() > 0.7 * f.push && level - now.peg.z() < dropped;
  if (settled_for(stuck, held_up)) end_attempt(Reason::Blocked);
}

void Insertion::Machine::retreat(const ContactEstimate& now) noexcept {
  const InsertionMotion& m = options.motion;
  const double height = tilted_height();
  const double speed = sharp.force.norm() > options.forces.obstacle ? m.contact_speed : careful;
  path.drive(path.towards({path.p.x(), path.p.y(), height + m.height}, speed, m.acceleration), m.acceleration);
  if (lean.x > 0)
    plan_tilt(0.0, 0.0);
  else
    path.turn(Eigen::Vector2d::Zero(), m.turning);
  if (now.arm.z() < height) return;
  plan_from_path();
  // Not where it failed, but where the peg feels most: beside the hole as far as it is known.
  if (state.hole_std > 0)
    place = state.hole.head<2>() - 0.4 * options.bodies.peg_radius * direction();
  else if (state.reason == Reason::ProfileFlat)  // as where the bore is right below the peg
    place = path.p.head<2>() - 0.4 * options.bodies.peg_radius * direction();
  else
    place = path.p.head<2>();
  spiralled = felt_again = false;
  enter_phase(Phase::Approach);
}

}  // namespace kr5::force
