// SPDX-License-Identifier: BSD-3-Clause
#include "held_tool.hpp"

#include <cmath>

#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/PrismaticJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/WeldJoint.hpp>

#include <kr5/core/error.hpp>
#include <kr5/physics/tool.hpp>

namespace kr5::sim {
namespace {

namespace dd = dart::dynamics;
constexpr double hand_mass = 1e-6;  // DART wants one; what the arm weighs is no part of the sensor's load [kg]

}  // namespace

struct HeldTool::Body {
  dd::SkeletonPtr skeleton = dd::Skeleton::create("held tool");
  dd::Joint* slide = nullptr;
  dd::BodyNode* tool = nullptr;
  Eigen::Vector3d axis, gravity;
  double mass = 0.0;
  Vector6 wrench = Vector6::Zero();

  void read() {
    const Eigen::Vector6d& F = tool->getBodyForce();
    wrench << -F.tail<3>(), -F.head<3>();
  }
};

HeldTool::HeldTool(const cell::Cell& cell, const Pose& T_base_slide) : body_(std::make_unique<Body>()) {
  Body& b = *body_;
  const kinematics::Body load = physics::payload(cell);
  require(load.mass > 0.0, "tool.mass: must be positive for a tool that is pushed [kg]");
  require(load.mass <= 1e6 && load.com.cwiseAbs().maxCoeff() <= 1e3 && load.inertia.cwiseAbs().maxCoeff() <= 1e9,
          "tool: mass, com or inertia is implausibly large; are the units kg, m and kg m^2?");
  require(cell.robot.gravity.norm() <= 1e4, "robot.gravity: is implausibly large; is it in m/s^2?");
  b.mass = load.mass + hand_mass;
  b.axis = T_base_slide.linear().col(2);
  dd::PrismaticJoint::Properties slide;
  slide.mName = "slide";
  slide.mT_ParentBodyToJoint = T_base_slide;
  // The hand is S with the tool down, however the slide lies.
  Pose T_base_hand = T_base_slide;
  T_base_hand.linear() = physics::R_base_sensor_down();
  slide.mT_ChildBodyToJoint = T_base_hand.inverse() * T_base_slide;
  slide.mAxis = Eigen::Vector3d::UnitZ();
  dd::BodyNode::Properties hand, tool;
  hand.mName = "hand";
  hand.mInertia = dd::Inertia(hand_mass, Eigen::Vector3d::Zero(), hand_mass * Eigen::Matrix3d::Identity());
  tool.mName = "tool";
  tool.mInertia = dd::Inertia(load.mass, load.com, kinematics::inertia_matrix(load.inertia));
  const auto pair = b.skeleton->createJointAndBodyNodePair<dd::PrismaticJoint>(nullptr, slide, hand);
  b.slide = pair.first;
  b.tool = b.skeleton->createJointAndBodyNodePair<dd::WeldJoint>(pair.second, dd::WeldJoint::Properties(), tool).second;
  // The formats give these kinds along Z of B, gravity against it.
  b.gravity = Eigen::Vector3d(0, 0, -cell.robot.gravity.norm());
  b.skeleton->setGravity(b.gravity);
}
HeldTool::~HeldTool() = default;

double HeldTool::mass() const { return body_->mass; }

void HeldTool::place(double z, double speed) {
  if (!(std::abs(z) <= 1e6 && std::abs(speed) <= 1e6)) throw InvalidArgument("path of the tool: has diverged");
  body_->slide->setPosition(0, z);
  body_->slide->setVelocity(0, speed);
}

double HeldTool::z() const { return body_->slide->getPosition(0); }
double HeldTool::speed() const { return body_->slide->getVelocity(0); }

void HeldTool::touch(const Eigen::Vector3d& force) {
  if (!(force.cwiseAbs().maxCoeff() <= 1e12))
    throw InvalidArgument("force on the tool: must be finite and at most 1e12 N");
  body_->tool->setExtForce(force, Eigen::Vector3d::Zero(), false, true);
}

void HeldTool::push(double force, double step) {
  Body& b = *body_;
  place(z(), this->speed());  // refuses a state that has run away
  b.slide->setActuatorType(dd::Joint::FORCE);
  b.slide->setCommand(0, force - b.mass * b.gravity.dot(b.axis));
  b.skeleton->computeForwardDynamics();
  b.read();
  b.skeleton->integrateVelocities(step);
  b.skeleton->integratePositions(step);
}

Vector6 HeldTool::wrench_at_rest() {
  Body& b = *body_;
  const double speed = b.slide->getVelocity(0);
  b.slide->setVelocity(0, 0.0);
  b.slide->setAcceleration(0, 0.0);
  b.skeleton->computeInverseDynamics(true, false, false);
  b.read();
  b.slide->setVelocity(0, speed);
  return b.wrench;
}

Vector6 HeldTool::wrench() const { return body_->wrench; }

}  // namespace kr5::sim
