// SPDX-License-Identifier: BSD-3-Clause
/// @file The phases in which the peg feels where the hole is.
#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "force/insertion/machine.hpp"
#include "force/search/azimuth.hpp"

namespace kr5::force {
namespace {

constexpr double zeroing = 0.12;      // for which an untouched sensor is averaged [s]
constexpr double tilting = 1.0;       // greatest speed of a planned tilt in the air [rad/s]
constexpr double come_within = 3e-4;  // of the end of the approach an arm has come to it [m]
constexpr double come_for = 0.12;     // when it has been there for so long [s]
constexpr double come_timeout = 2.0;  // after which it goes on all the same [s]
constexpr double min_press = 1.0;     // from which on a row of the profile counts [N]
constexpr double settling = 0.1;      // [s]
constexpr double overlap = 0.1;       // of the turn, so that its end meets its beginning [rad]
constexpr int evaluations = 8;        // of the fit in a cycle
constexpr int min_rows = 40;

}  // namespace

double Insertion::Machine::press_speed(double reference, const ContactEstimate& now) const noexcept {
  const double most = options.motion.contact_speed;
  return std::clamp(options.forces.axial_gain * (now.press() - reference), -most, most);
}

void Insertion::Machine::drive(const Eigen::Vector2d& across, double along) noexcept {
  path.drive({across.x(), across.y(), along}, options.motion.acceleration);
}

void Insertion::Machine::plan_from_path() noexcept {
  lean.rest_at(path.rho.norm());
  round.rest_at(lean.x > 1e-6 ? std::atan2(-path.rho.x(), path.rho.y()) : toward);
}

double Insertion::Machine::nearest_turn() const noexcept {
  return round.x + std::remainder(toward - round.x, 2 * M_PI);
}

void Insertion::Machine::plan_tilt(double lean_speed, double round_speed) noexcept {
  lean.drive(lean_speed, options.motion.turning, options.cycle);
  round.drive(round_speed, 4 * options.motion.turning, options.cycle);
  path.turn_to(tilt_vector(lean.x, round.x));
}

Eigen::Vector2d Insertion::Machine::lateral_admittance(const ContactEstimate& now,
                                                       const Eigen::Vector2d& reference) const noexcept {
  Vector6 wrench = Vector6::Zero(), wanted = Vector6::Zero();
  wrench.head<2>() = now.across();
  wanted.head<2>() = reference;
  return admittance_twist(wrench, wanted, {options.forces.lateral_gain, 0.0, options.motion.slide_speed, 1.0})
      .head<2>();
}

double Insertion::Machine::capture_offset() const noexcept {
  const PegTube& b = options.bodies;
  return std::sqrt(std::max(b.inner_radius * b.inner_radius - b.peg_radius * b.peg_radius, 0.0));
}

double Insertion::Machine::tilted_height() const noexcept {
  return face + options.motion.height + options.bodies.peg_radius * std::sin(options.tilt);
}

/// What an untouched sensor tells is zero from now on, and how much that wavers is kept for the uncertainty of a fit.
void Insertion::Machine::tare() noexcept {
  Vector6 wrench;
  wrench << sharp.force, sharp.moment;
  sum += wrench;
  squares += wrench.cwiseProduct(wrench);
  drive(Eigen::Vector2d::Zero(), 0.0);
  if (seconds() < zeroing) return;
  const double n = cycles;
  zero = sum / n;
  const Vector6 variance = (squares / n - zero.cwiseProduct(zero)).cwiseMax(0.0) / std::max(n - 1, 1.0);
  zero_std = std::sqrt(0.5 * (variance[0] + variance[1])) / options.grip.lateral;
  plan_from_path();
  enter_phase(Phase::Approach);
}

/// Fast where nothing can be in the way, since a peg went in there before; else no faster than the arm can be stopped.
double Insertion::Machine::approach_speed() const noexcept {
  const InsertionMotion& m = options.motion;
  if (!known) return careful;
  const double clear = std::max(path.p.z() - face - m.clear_height, 0.0);
  return std::min(m.approach_speed, std::sqrt(careful * careful + 1.2 * m.acceleration * clear));
}

/// What a tilted peg meets on the way down may be the face, where tube, base or servo are other than believed: it is
/// felt there as anywhere. Else the arm stands at once.
void Insertion::Machine::meet() noexcept {
  if (known || std::abs(lean.x - options.tilt) > 2e-3) return stop_for(Reason::Obstructed);
  face = std::max(face, sharp.peg.z() - options.bodies.peg_radius * std::sin(sharp.tilt));
  met = true;
  descent.reset();
  enter_phase(Phase::Touch);
}

/// Whether the arm is where its path has come to. Behind a servo other than believed it is late: still on its way down
/// it would touch many times faster than it should.
bool Insertion::Machine::come() noexcept {
  const bool there = settled_for(come_for, (sharp.arm - path.p).norm() < come_within);
  return there || ++late_cycles * options.cycle > come_timeout;
}

/// Above the place, tilted. A remembered hole is entered rim first at once, or from above by an upright peg. Where the
/// tube was not felt yet, the peg goes down when it is tilted: one that is tilted in a bore wedges.
void Insertion::Machine::approach() noexcept {
  if (sharp.force.norm() > options.forces.obstacle) return meet();
  const bool tilted = !known || options.entry == EntryAttitude::Tilted;
  Eigen::Vector2d over = place;
  if (known && tilted) over -= 0.7 * capture_offset() * direction();
  const double wanted = tilted ? options.tilt : 0.0, height = tilted ? tilted_height() : face + options.motion.height;
  const InsertionMotion& m = options.motion;
  if (lean.x < 1e-3) round.rest_at(toward);
  const double turned = nearest_turn();
  plan_tilt(lean.towards(wanted, tilting, m.turning, options.cycle),
            round.towards(turned, 2 * tilting, 4 * m.turning, options.cycle));
  const bool leans = std::abs(lean.x - wanted) < 2e-3 && std::abs(round.x - turned) < 1e-2;
  const double rim = options.bodies.peg_radius * std::sin(wanted);
  const double level = leans || known ? height : std::max(height, std::min(begun_height + rim, face + m.clear_height));
  const Eigen::Vector3d target(over.x(), over.y(), level);
  path.drive(path.towards(target, approach_speed(), m.acceleration), m.acceleration);
  if (!leans || (path.p - target).norm() > 2e-4 || !come()) return;
  met = false;
  descent.reset();
  enter_phase(Phase::Touch);
}

void Insertion::Machine::touch(const ContactEstimate& now) noexcept {
  plan_tilt(0.0, 0.0);
  if (!descent.touched()) {
    const double way = now.peg.z() - options.bodies.peg_radius * std::sin(lean.x) - face - options.limits.face_error;
    const double force = met ? std::max(now.force.norm(), sharp.force.norm()) : now.force.norm();
    drive(Eigen::Vector2d::Zero(), -descent.step(way, force));
    if (now.peg.z() < face - options.limits.descent) begin_entry(round.x);
    return;
  }
  const Eigen::Vector3d along(0.0, 0.0, press_speed(options.forces.roll, now));
  path.drive(along, met ? options.motion.braking : options.motion.acceleration);
  if (captured(now) || (known && options.entry == EntryAttitude::Tilted && seconds() > settling))
    return begin_entry(round.x);
  const bool held = std::abs(now.press() - options.forces.roll) < 0.2 * options.forces.roll;
  if (!settled_for(settling, held) && seconds() < settle_timeout()) return;
  if (now.press() < min_press) return end_attempt(Reason::NoContact);
  if (known) return begin_spiral(now);  // upright on the face beside a remembered hole, or in it
  turn.clear();
  angle_swept = 0.0;
  enter_phase(Phase::Roll);
}

void Insertion::Machine::roll(const ContactEstimate& now) noexcept {
  drive(Eigen::Vector2d::Zero(), press_speed(options.forces.roll, now));
  const double whole = 2 * M_PI + overlap, speed = 2 * M_PI / options.motion.roll_time;
  const double before = round.x;
  Axis left = round;
  left.x = angle_swept;
  plan_tilt(0.0, left.towards(whole, speed, 4 * options.motion.turning, options.cycle));
  angle_swept += round.x - before;
  if (sharp.press() > min_press)
    turn.add({sharp.azimuth, sharp.tilt, sharp.peg.head<2>(), sharp.peg.z(), sharp.press(), sharp.moment.head<2>()});
  if (captured(now)) return begin_entry(round.x);
  if (angle_swept < whole - 1e-2) return;
  turn.finish();
  if (turn.rows().size() < static_cast<std::size_t>(min_rows)) return end_attempt(Reason::NoContact);
  search.begin(turn.rows(), turn.centre());
  enter_phase(Phase::Locate);
}

void Insertion::Machine::locate(const ContactEstimate& now) noexcept {
  drive(Eigen::Vector2d::Zero(), press_speed(options.forces.roll, now));
  plan_tilt(0.0, 0.0);
  if (options.localisation == Localisation::Fit) {
    if (search.advance(evaluations)) accept_location(true);
    return;
  }
  const auto azimuth = options.localisation == Localisation::Cusp ? turn.cusp() : turn.minimum();
  if (!azimuth) return end_attempt(Reason::ProfileFlat);
  toward = *azimuth;
  accept_location(false);
}

double Insertion::Machine::fit_std() const noexcept {
  const NormalEquations<4>& best = search.best().normal;
  const double left = best.cost / (static_cast<double>(turn.rows().size()) - 3);  // what is believed before is a row
  const Eigen::Matrix4d information = best.information.selfadjointView<Eigen::Lower>();
  const Eigen::Matrix<double, 4, 2> leaned = options.grip.tilt_uncertainty * search.by_tilt();
  const Eigen::Matrix4d spread = left * information.inverse() + leaned * leaned.transpose();
  const double mean = 0.5 * (spread(0, 0) + spread(1, 1)), half = 0.5 * (spread(0, 0) - spread(1, 1));
  const double most = mean + std::hypot(half, spread(0, 1));
  return std::sqrt(most + zero_std * zero_std + options.grip.position_uncertainty * options.grip.position_uncertainty);
}

void Insertion::Machine::accept_location(bool fitted) noexcept {
  state.hole_std = 0.0;
  if (fitted) {
    const TubeSearch::Solution& best = search.best();
    const double std = fit_std();
    if (!best.converged || !(std < 0.2 * options.bodies.peg_radius)) return end_attempt(Reason::ProfileFlat);
    state.hole = best.place.head<3>();
    state.hole_std = std;
    compliance_error += best.place[3];
    face = best.place.z();
    const Eigen::Vector2d way = best.place.head<2>() - turn.centre();
    toward = std::atan2(way.y(), way.x());
  }
  begun = path.p.head<2>();
  enter_phase(Phase::Aim);
}

void Insertion::Machine::aim(const ContactEstimate& now) noexcept {
  drive(Eigen::Vector2d::Zero(), press_speed(options.forces.slide, now));
  const InsertionMotion& m = options.motion;
  const double turned = nearest_turn();
  if (options.entry == EntryAttitude::Tilted) {
    plan_tilt(0.0, round.towards(turned, 2 * tilting, 4 * m.turning, options.cycle));
    if (std::abs(turned - round.x) > 1e-2) return;
  } else {
    plan_tilt(lean.towards(0.0, 2 * m.upright_speed, m.turning, options.cycle), 0.0);
    const bool flat = lean.x < 1e-4 && std::abs(now.press() - options.forces.slide) < 0.3 * options.forces.slide;
    if (!settled_for(settling, flat) && seconds() < 2 * settle_timeout()) return;
    level = now.peg.z();
  }
  enter_phase(Phase::Slide);
}

}  // namespace kr5::force
