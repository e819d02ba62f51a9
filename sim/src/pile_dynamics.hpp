// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include <Eigen/Core>

#include <kr5/sim/pellet_bin.hpp>

#include "cylinder_contact.hpp"

namespace kr5::sim {

/// A pellet in motion, in the frame of the bin.
struct PileBody {
  CylinderBody shape;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();         ///< [m/s]
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();             ///< [rad/s]
  double inverse_mass = 0.0;                                  ///< [1/kg]
  Eigen::Vector3d inverse_inertia = Eigen::Vector3d::Zero();  ///< About its own axes [1/(kg m^2)].
  double quiet = 0.0;                                         ///< Time since it last moved [s].
  bool asleep = false;

  double rim_speed() const { return velocity.norm() + spin.norm() * shape.reach(); }
};

/// An impulse that the next step begins with.
struct PileImpulse {
  int body = 0, other = 0, feature = 0;
  Eigen::Vector3d impulse = Eigen::Vector3d::Zero();  ///< [N s]

  static void each_field(auto& self, auto&& visit) {
    visit("body", self.body, "Number of the body.");
    visit("other", self.other, "Number of the other one, or of a plane.");
    visit("feature", self.feature, "Number of the parts that touch.");
    visit("impulse", self.impulse, "Impulse of the last step [N s].");
  }
};

/// A body of a pile in motion.
struct PileBodyMotion {
  Pellet pellet;
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  Eigen::Vector3d spin = Eigen::Vector3d::Zero();      ///< [rad/s]
  double quiet = 0.0;                                  ///< [s]
  bool asleep = false;

  static void each_field(auto& self, auto&& visit) {
    visit("pellet", self.pellet, "Pellet.");
    visit("velocity", self.velocity, "Velocity of its centre [m/s].");
    visit("spin", self.spin, "Angular velocity in the bin [rad/s].");
    visit("quiet", self.quiet, "Time since it last moved [s].");
    visit("asleep", self.asleep, "Whether it lies still.");
  }
};

/// A pile in motion: all that its next step depends on, a grip apart.
struct PileMotion {
  std::vector<PileBodyMotion> bodies;
  std::vector<PileImpulse> impulses;
  double time = 0.0;  ///< [s]

  static void each_field(auto& self, auto&& visit) {
    visit("bodies", self.bodies, "Bodies.");
    visit("impulses", self.impulses, "Impulses between them.");
    visit("time", self.time, "Time [s].");
  }
};

/// Rigid pellets between planes, stepped through time. Gyroscopic torques are left out: pellets are nearly as wide as
/// high, and what matters is where they come to rest.
class PileDynamics {
 public:
  PileDynamics(const BinShape& bin, const PileOptions& options);

  void add(const Pellet& pellet, bool asleep = false);
  /// Takes a body away; those after it move up by one.
  void remove(int body);
  std::vector<PileBody>& bodies() { return bodies_; }
  Pellet pellet(int body) const;
  double time() const { return time_; }

  /// Wakes what is nearer than `margin` [m] to a body.
  void wake_neighbours(int body, double margin);
  /// A gripper that drives a body at a velocity [m/s], without turning it, with limited force [N] and torque [N m].
  void hold(int body, const Eigen::Vector3d& velocity, double force, double torque);
  void release() { grip_.reset(); }
  /// Force and torque of the gripper on the body that it holds, in the last substep [N, N m].
  Vector6 grip_wrench() const;
  /// Whether nothing is nearer than `margin` [m] to a body.
  bool alone(int body, double margin) const;

  /// Multiplies the damping of pellets in contact the more, the longer a pile that was disturbed at `start` [s] rattles
  /// on, so that it comes to rest.
  void damp_since(double start);

  void step();
  bool at_rest() const;
  PileState state() const;
  PileMotion motion() const;
  void restore(const PileMotion& motion);

 private:
  static constexpr int nobody = -1;
  struct Contact {
    int a = nobody, b = nobody;  ///< b is `nobody` for a plane.
    std::uint64_t key = 0;       ///< The same in the next step, if the same parts touch.
    Eigen::Vector3d normal, tangent1, tangent2, arm_a, arm_b;
    Eigen::Vector3d turn_a[3], turn_b[3];  ///< Change of spin by a unit impulse along normal and tangents.
    double mass[3] = {};                   ///< Effective mass along normal and tangents [kg].
    double gap = 0.0, approach = 0.0;      ///< When the step began [m, m/s].
    double impulse[3] = {};                ///< Along normal and tangents [N s].
    double largest = 0.0;                  ///< Along the normal [N s].
  };
  struct Grip {
    int body;
    Eigen::Vector3d velocity;
    double force, torque;
    Eigen::Vector3d impulse = Eigen::Vector3d::Zero(), twist = Eigen::Vector3d::Zero();
  };
  struct Delta {
    Eigen::Vector3d shift = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
  };

  void find_contacts();
  void wake_touched();
  void add_contact(int a, int b, const CylinderContact& found);
  void prepare(Contact& contact);
  void warm_start();
  void solve(double h, bool push);
  void solve_grip(double h);
  void bounce();
  void integrate(double h);
  void move(double h);
  void finish_step();
  double inverse_mass(int body) const;
  Eigen::Vector3d turned(int body, const Eigen::Vector3d& torque) const;
  double speed_along(const Contact& c, const Eigen::Vector3d& direction) const;
  void push_apart(const Contact& c, int axis, double impulse);

  PileOptions options_;
  std::vector<PlaneBody> planes_;
  std::vector<PileBody> bodies_;
  std::vector<Eigen::Matrix3d> world_inverse_inertia_;
  std::vector<Delta> deltas_;
  std::vector<Contact> contacts_;
  std::unordered_map<std::uint64_t, Eigen::Vector3d> remembered_;  ///< Impulses of the step before, in the bin [N s].
  std::optional<Grip> grip_;
  double time_ = 0.0;
  double damping_ = 1.0;
};

}  // namespace kr5::sim
