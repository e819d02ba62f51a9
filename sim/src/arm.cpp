// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/arm.hpp>

#include <cmath>
#include <string>
#include <vector>

#include <dart/dynamics/BodyNode.hpp>
#include <dart/dynamics/PrismaticJoint.hpp>
#include <dart/dynamics/RevoluteJoint.hpp>
#include <dart/dynamics/Skeleton.hpp>
#include <dart/dynamics/WeldJoint.hpp>
#include <dart/math/Geometry.hpp>

#include <kr5/core/error.hpp>
#include <kr5/core/linear.hpp>
#include <kr5/io/node.hpp>
#include <kr5/physics/effective_arm.hpp>
#include <kr5/physics/tool.hpp>

namespace kr5::sim {
namespace {

namespace dd = dart::dynamics;
using kinematics::DhJoint;
using kinematics::JointType;

std::string brief(double value) { return io::Node::make_scalar(value).scalar; }

void check_mass(const std::string& field, double mass, const Eigen::Matrix3d& inertia, bool may_be_bare) {
  const double least = symmetric_eigen(inertia).values[0];

  const bool good = may_be_bare ? mass >= 0.0 && least >= 0.0 : mass > 0.0 && least > 0.0;
  const std::string positive = may_be_bare ? "not be negative" : "be positive";
  require(mass > 0.0 || (may_be_bare && mass == 0.0),
          field + ".mass: must " + positive + ", found " + brief(mass) + " kg");
  require(good, field + ".inertia: every principal moment must " + positive + ", the least found is " + brief(least) +
                    " kg m^2");
}

constexpr double longest = 1e3;     // of what is a robot cell [m]
constexpr double heaviest = 1e6;    // [kg]
constexpr double fastest = 1e6;     // motion that has run away [rad, m, rad/s or m/s]
constexpr double strongest = 1e12;  // [N or N m]

/// DART ends the process on numbers that are none: what reaches it is checked before.
template <class Field, class Derived>
void check_numbers(const Field& field, const Eigen::DenseBase<Derived>& values, double most) {
  for (Eigen::Index i = 0; i < values.size(); ++i)
    if (!(std::abs(values(i)) <= most))  // no text is made in a step that goes well
      throw InvalidArgument(std::string(field) + ": found " + brief(values(i)) + ", expected a number of at most " +
                            brief(most));
}

void check_pose(const std::string& field, const Pose& T) {
  check_numbers(field, T.translation(), longest);
  require((T.linear() * T.linear().transpose()).isIdentity(1e-6), field + ": is not a rigid motion");
}

void check_body(const std::string& field, const kinematics::Body& body) {
  require(body.mass <= heaviest, field + ".mass: found " + brief(body.mass) + ", expected at most " + brief(heaviest));
  check_numbers(field + ".com", body.com, longest);
  check_numbers(field + ".inertia", body.inertia, heaviest * longest);
}

dd::BodyNode::Properties body(const std::string& name, const kinematics::Body& m) {
  dd::BodyNode::Properties properties;
  properties.mName = name;
  properties.mInertia = dd::Inertia(m.mass, m.com, kinematics::inertia_matrix(m.inertia));
  return properties;
}

template <class Joint>
dd::BodyNode* add_joint(const dd::SkeletonPtr& skeleton, dd::BodyNode* parent, int number, const Pose& place,
                        const Pose& T_joint_link, const kinematics::Body& mass) {
  typename Joint::Properties properties;
  properties.mName = "joint" + std::to_string(number);
  properties.mAxis = Eigen::Vector3d::UnitZ();
  properties.mT_ParentBodyToJoint = place;
  properties.mT_ChildBodyToJoint = T_joint_link.inverse();
  return skeleton->createJointAndBodyNodePair<Joint>(parent, properties, body("link" + std::to_string(number), mass))
      .second;
}

}  // namespace

struct Arm::Body {
  cell::Cell cell;
  physics::EffectiveArm effective;
  dd::SkeletonPtr skeleton = dd::Skeleton::create("arm");
  std::vector<dd::BodyNode*> links;
  dd::BodyNode* tool = nullptr;
  std::vector<kinematics::Body> bodies;  ///< Of the links, with their effects.
  bool masses = false;
  Eigen::VectorXd q, v, bias;
  Eigen::MatrixXd inertia;
  Vector6 contact = Vector6::Zero();
  ArmForces forces;

  explicit Body(const cell::Cell& given) : cell(given), effective(cell) {
    check();
    const int n = cell.robot.joints();
    const kinematics::DhChain chain = effective.chain(0.0);
    for (int i = 0; i < n; ++i) add_link(i, chain);
    add_tool();
    skeleton->setGravity(cell.robot.gravity);
    q = v = forces.torque = forces.acceleration = Eigen::VectorXd::Zero(n);
    for (int i = 0; i < n; ++i)
      skeleton->getJoint(static_cast<std::size_t>(i))->setActuatorType(dd::Joint::ACCELERATION);
  }

  void check() {
    const auto& robot = cell.robot;
    bodies = effective.bodies();
    require(robot.joints() > 0, "robot.dh: an arm needs at least one joint");
    masses = !robot.links.empty();
    require(!masses || robot.links.size() == robot.dh.size(),
            "robot.links: found " + std::to_string(robot.links.size()) +
                ", expected one a joint: " + std::to_string(robot.dh.size()));
    for (std::size_t i = 0; i < robot.links.size(); ++i)
      check_mass("robot.links[" + std::to_string(i) + "]", bodies[i].mass, bodies[i].inertia_matrix(), false);
    if (cell.tool) check_mass("tool", cell.tool->mass, cell.tool->inertia_matrix(), true);
    if (cell.tool) {
      physics::check_payload(cell);
      check_body("tool with what hangs on it", physics::payload(cell));
      check_pose("tool.T_F_S", cell.tool->T_flange_sensor);
    }
    for (std::size_t i = 0; i < robot.links.size(); ++i)
      check_body("robot.links[" + std::to_string(i) + "]", bodies[i]);
    check_numbers("robot.gravity", robot.gravity, 1e4);
    const kinematics::DhChain chain = effective.chain(0.0);
    check_pose("robot.T_B_0", chain.T_base_0);
    for (std::size_t i = 0; i < chain.joints.size(); ++i) {
      const DhJoint& j = chain.joints[i];
      check_numbers("robot.dh[" + std::to_string(i) + "]", Eigen::Vector3d(j.a, j.b, 0.0), longest);
      check_numbers("robot.dh[" + std::to_string(i) + "]", Eigen::Vector3d(j.theta_offset, j.alpha, j.beta), 1e3);
    }
  }

  void add_link(int i, const kinematics::DhChain& chain) {
    const auto index = static_cast<std::size_t>(i);
    const DhJoint& joint = chain.joints[index];
    kinematics::Body mass{1.0, Eigen::Vector3d::Zero(), Vector6::Ones()};  // any will do for kinematics alone
    if (masses) mass = bodies[index];
    const Pose place = i == 0 ? chain.T_base_0 : Pose::Identity();
    dd::BodyNode* parent = i == 0 ? nullptr : links.back();
    links.push_back(joint.type == JointType::Revolute
                        ? add_joint<dd::RevoluteJoint>(skeleton, parent, i + 1, place, joint.transform(0.0), mass)
                        : add_joint<dd::PrismaticJoint>(skeleton, parent, i + 1, place, joint.transform(0.0), mass));
  }

  void add_tool() {
    if (!cell.tool) return;
    dd::WeldJoint::Properties weld;
    weld.mName = "sensor";
    weld.mT_ParentBodyToJoint = cell.tool->T_flange_sensor;
    tool = skeleton->createJointAndBodyNodePair<dd::WeldJoint>(links.back(), weld, body("tool", physics::payload(cell)))
               .second;
  }

  void need_masses() const {
    require(masses, "robot.links: this cell has no masses, so there are no forces to simulate");
  }

  /// Composite bodies from the tip (Featherstone 2008, table 6.2): DART's own takes a pass over the arm for each joint.
  void read_mass_matrix() {
    const auto n = static_cast<Eigen::Index>(links.size());
    inertia.resize(n, n);
    Eigen::Matrix6d composite = Eigen::Matrix6d::Zero();
    if (tool) composite = carried(*tool);
    for (std::size_t i = links.size(); i-- > 0;) {
      composite += links[i]->getSpatialInertia();
      const auto row = static_cast<Eigen::Index>(i);
      Eigen::Vector6d force = composite * motion(i);
      inertia(row, row) = motion(i).dot(force);
      for (std::size_t j = i; j-- > 0;) {
        force = dart::math::dAdInvT(links[j + 1]->getRelativeTransform(), force);
        const auto column = static_cast<Eigen::Index>(j);
        inertia(row, column) = inertia(column, row) = motion(j).dot(force);
      }
      composite = dart::math::transformInertia(links[i]->getRelativeTransform().inverse(), composite);
    }
  }

  /// Inertia of a body, in the frame of the one that carries it.
  static Eigen::Matrix6d carried(const dd::BodyNode& body) {
    return dart::math::transformInertia(body.getRelativeTransform().inverse(), body.getSpatialInertia());
  }

  Eigen::Vector6d motion(std::size_t joint) const { return skeleton->getJoint(joint)->getRelativeJacobian().col(0); }

  /// DART gives torque before force, of the parent on the child: turned, and put in our order.
  void read_wrench() {
    if (!tool) return;
    const Eigen::Vector6d& F = tool->getBodyForce();
    forces.wrench << -F.tail<3>(), -F.head<3>();
  }
};

Arm::Arm(const cell::Cell& cell) : body_(std::make_unique<Body>(cell)) {}
Arm::~Arm() = default;
Arm::Arm(Arm&&) noexcept = default;
Arm& Arm::operator=(Arm&&) noexcept = default;

int Arm::joints() const { return static_cast<int>(body_->links.size()); }
bool Arm::has_masses() const { return body_->masses; }

void Arm::set_clock(double t) {
  if (!body_->effective.grows()) return;
  const kinematics::DhChain chain = body_->effective.chain(t);
  for (const DhJoint& j : chain.joints)
    check_numbers("length of a link that grows", Eigen::Vector2d(j.a, j.b), longest);
  for (std::size_t i = 0; i < chain.joints.size(); ++i)
    body_->skeleton->getJoint(i)->setTransformFromChildBodyNode(chain.joints[i].transform(0.0).inverse());
}

void Arm::set_state(const Eigen::VectorXd& q, const Eigen::VectorXd& v) {
  require(q.size() == joints() && v.size() == joints() && q.allFinite() && v.allFinite(),
          "state of the arm: " + std::to_string(joints()) + " finite joint values and speeds are needed");
  check_numbers("state of the arm, which has diverged", q, fastest);
  check_numbers("speed of the arm, which has diverged", v, fastest);
  body_->q = q;
  body_->v = v;
  body_->skeleton->setPositions(q);
  body_->skeleton->setVelocities(v);
}

const Eigen::VectorXd& Arm::positions() const { return body_->q; }
const Eigen::VectorXd& Arm::velocities() const { return body_->v; }

void Arm::set_actuation(int joint, Actuation actuation) {
  require(joint >= 0 && joint < joints(), "no joint " + std::to_string(joint + 1));
  body_->skeleton->getJoint(static_cast<std::size_t>(joint))
      ->setActuatorType(actuation == Actuation::Driven ? dd::Joint::ACCELERATION : dd::Joint::FORCE);
}

void Arm::set_contact(const Vector6& wrench) {
  require(body_->tool != nullptr, "tool: is missing; a contact needs a tool");
  check_numbers("wrench of a contact", wrench, strongest);
  body_->contact = wrench;
  body_->tool->setExtForce(wrench.head<3>(), Eigen::Vector3d::Zero(), false, true);
  body_->tool->setExtTorque(wrench.tail<3>(), false);
}

const ArmForces& Arm::solve(const Eigen::VectorXd& command) {
  Body& b = *body_;
  b.need_masses();
  check_numbers("command of the arm", command, strongest);
  b.skeleton->setCommands(command);
  b.skeleton->computeForwardDynamics();
  b.forces.acceleration = b.skeleton->getAccelerations();
  for (std::size_t i = 0; i < b.links.size(); ++i) {
    const dd::Joint* joint = b.skeleton->getJoint(i);
    b.forces.torque[static_cast<Eigen::Index>(i)] = joint->getRelativeJacobian().col(0).dot(b.links[i]->getBodyForce());
  }
  b.read_wrench();
  return b.forces;
}

const ArmForces& Arm::inverse_dynamics(const Eigen::VectorXd& acceleration) {
  Body& b = *body_;
  b.need_masses();
  check_numbers("acceleration of the arm", acceleration, strongest);
  b.skeleton->setAccelerations(acceleration);
  b.skeleton->computeInverseDynamics(true, false, false);
  b.forces.acceleration = acceleration;
  b.forces.torque = b.skeleton->getForces();
  b.read_wrench();
  return b.forces;
}

const Eigen::MatrixXd& Arm::mass_matrix() {
  body_->need_masses();
  body_->read_mass_matrix();
  return body_->inertia;
}

const Eigen::VectorXd& Arm::bias_torque() {
  body_->need_masses();
  body_->skeleton->setAccelerations(Eigen::VectorXd::Zero(joints()));
  body_->skeleton->computeInverseDynamics(true, false, false);
  return body_->bias = body_->skeleton->getForces();
}

Eigen::VectorXd Arm::gravity_torque() {
  body_->need_masses();
  return body_->skeleton->getGravityForces();
}

double Arm::energy() {
  body_->need_masses();
  const dd::Skeleton& s = *body_->skeleton;
  return s.computeKineticEnergy() - s.getMass() * s.getGravity().dot(s.getCOM());
}

Pose Arm::T_base_flange() const { return body_->links.back()->getWorldTransform(); }

Pose Arm::T_base_sensor() const {
  require(body_->tool != nullptr, "tool: this cell has no sensor frame");
  return body_->tool->getWorldTransform();
}

Vector6 Arm::sensor_velocity() const {
  require(body_->tool != nullptr, "tool: this cell has no sensor frame");
  Vector6 out;
  out << body_->tool->getLinearVelocity(), body_->tool->getAngularVelocity();
  return out;
}

}  // namespace kr5::sim
