// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <sstream>

#include <Eigen/Eigenvalues>

#include <kr5/cell/import_urdf.hpp>
#include <kr5/core/error.hpp>
#include <kr5/io/diagnostic.hpp>
#include <kr5/io/node.hpp>

#include "cell/check/diagnostic_collector.hpp"
#include "cell/urdf/frames.hpp"
#include "cell/urdf/model.hpp"

namespace kr5::cell {
namespace {

using kinematics::JointType;

class Importer {
 public:
  Importer(const UrdfModel& model, const UrdfOptions& options) : model_(model) {
    out_.base = options.base.empty() ? root() : existing(options.base, "base");
    out_.tip = options.tip.empty() ? only_end() : existing(options.tip, "tip");
  }

  UrdfImport run() {
    find_path();
    place(out_.base, Pose::Identity(), 0);
    build_chain();
    build_links();
    build_limits();
    write_notes();
    build_friction();
    out_.cell.name = model_.name;
    return std::move(out_);
  }

 private:
  std::string root() const {
    std::vector<std::string> roots;
    for (const auto& [name, body] : model_.links)
      if (!model_.parent_of(name)) roots.push_back(name);
    if (roots.size() != 1)
      model_.fail(roots.empty() ? "no link is the root"
                                : "several links are roots (" + listed(roots) + "); name the base");
    return roots[0];
  }

  std::string existing(const std::string& link, const char* what) const {
    if (model_.links.contains(link)) return link;
    std::vector<std::string> names;
    for (const auto& [name, body] : model_.links) names.push_back(name);
    const std::string near = io::nearest_name(link, names);
    model_.fail("there is no link \"" + link + "\" for the " + what +
                (near.empty() ? "; the links are " + listed(names) : "; is it " + near + "?"));
  }

  bool carries_joints(const std::string& link) const {
    const auto children = model_.children_of(link);
    return std::any_of(children.begin(), children.end(),
                       [&](const UrdfJoint* j) { return j->moves() || carries_joints(j->child); });
  }

  /// Follows the moving joints, then the fixed links behind the last of them, as long as there is one way.
  std::string only_end() const {
    std::string at = out_.base;
    while (true) {
      std::vector<const UrdfJoint*> ways = model_.children_of(at);
      if (carries_joints(at))
        std::erase_if(ways, [&](const UrdfJoint* j) { return !j->moves() && !carries_joints(j->child); });
      if (ways.empty()) return at;
      if (ways.size() > 1) {
        std::vector<std::string> names;
        for (const UrdfJoint* j : ways) names.push_back(j->child);
        model_.fail("behind link " + at + " the robot branches to " + listed(names) +
                    "; name the link that is the tip (--tip)");
      }
      at = ways[0]->child;
    }
  }

  void find_path() {
    std::string at = out_.tip;
    for (std::size_t steps = 0; at != out_.base; ++steps) {
      const UrdfJoint* joint = model_.parent_of(at);
      if (!joint || steps > model_.joints.size())
        model_.fail("the tip " + out_.tip + " is not connected to the base " + out_.base);
      if (joint->moves()) path_.insert(path_.begin(), joint);
      at = joint->parent;
    }
    if (path_.empty()) model_.fail("no joint moves between " + out_.base + " and " + out_.tip);
    for (const UrdfJoint* joint : path_) {
      if (joint->type == "floating" || joint->type == "planar")
        model_.fail("joint " + joint->name + " is " + joint->type + "; an arm has revolute and prismatic joints");
      if (joint->mimic)
        model_.fail("joint " + joint->name + " mimics another; the joints of an arm must be independent");
      out_.joints.push_back(joint->name);
    }
  }

  void require_body(const std::string& link, const kinematics::Body& body) const {
    std::ostringstream found;
    if (body.mass < 0.0) {
      found << body.mass;
      model_.fail("link " + link + ": found a mass of " + found.str() + " kg, expected none or a positive one");
    }
    const Eigen::Vector3d principal =
        kinematics::inertia_matrix(body.inertia).selfadjointView<Eigen::Lower>().eigenvalues();
    if (principal.minCoeff() >= -1e-12 * principal.cwiseAbs().maxCoeff()) return;
    found << principal.transpose();
    model_.fail("link " + link + ": the inertia is not positive, its principal moments are " + found.str() +
                " kg m^2; correct ixx ... izz of the link");
  }

  /// Adds up what every chain joint carries, all in the base at zero.
  void place(const std::string& link, const Pose& T, std::size_t carrier) {
    if (link == out_.tip) T_base_tip_ = T;
    carried_.resize(path_.size() + 1);
    if (carrier > 0) {
      require_body(link, model_.links.at(link));
      carried_[carrier] = merged_body(carried_[carrier], transformed_body(T, model_.links.at(link)));
    }
    for (const UrdfJoint* joint : model_.children_of(link)) {
      const Pose T_child = T * joint->T_parent_child;
      const bool next = carrier < path_.size() && joint == path_[carrier];
      if (next) axes_.push_back(axis(*joint, T_child));
      if (joint->moves() && !next && carrier > 0) held_.push_back(joint->name);
      place(joint->child, T_child, carrier + next);
    }
  }

  static JointAxis axis(const UrdfJoint& joint, const Pose& T) {
    const Eigen::Vector3d d = T.linear() * joint.axis, x = T.linear().col(0);
    // Any direction that is not along the axis will do.
    const Eigen::Vector3d hint = x.cross(d).norm() > 0.1 ? x : Eigen::Vector3d(T.linear().col(1));
    return {joint.type == "prismatic" ? JointType::Prismatic : JointType::Revolute, T.translation(), d, hint};
  }

  void build_chain() {
    const DhFrames frames = dh_frames(axes_, T_base_tip_);
    Robot& robot = out_.cell.robot;
    robot.T_base_0 = frames.chain.T_base_0;
    robot.dh = frames.chain.joints;
    robot.joint_names = out_.joints;
    if (frames.T_flange_tip.translation().isZero(0.0)) return;
    out_.cell.tool = Tool{};
    out_.cell.tool->T_flange_tool = frames.T_flange_tip;
  }

  void build_links() {
    const kinematics::DhChain arm = nominal_chain(out_.cell);
    const std::vector<Pose> T = arm.link_poses(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(path_.size())));
    double mass = 0.0;
    for (std::size_t i = 0; i < T.size(); ++i) mass += carried_[i + 1].mass;
    if (mass == 0.0) {
      out_.notes.push_back("the links have no mass, so the cell has no robot.links");
      return;
    }
    for (std::size_t i = 0; i < T.size(); ++i)
      out_.cell.robot.links.push_back(transformed_body(T[i].inverse(), carried_[i + 1]));
  }

  void build_limits() {
    const auto n = static_cast<Eigen::Index>(path_.size());
    Limits limits{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n)};
    for (Eigen::Index i = 0; i < n; ++i) {
      const UrdfJoint& joint = *path_[static_cast<std::size_t>(i)];
      limits.lower[i] = joint.lower;
      limits.upper[i] = joint.upper;
      limits.velocity[i] = joint.velocity;
      limits.effort[i] = joint.effort;
    }
    const auto none = [](const Eigen::VectorXd& v) { return (v.array().abs() == INFINITY).all(); };
    if (none(limits.velocity)) limits.velocity.resize(0);
    if (none(limits.effort)) limits.effort.resize(0);
    if (!(none(limits.lower) && none(limits.upper) && !limits.velocity.size() && !limits.effort.size()))
      out_.cell.robot.limits = limits;
  }

  /// A cell has friction in its drives; what else they are made of is no part of a URDF.
  void build_friction() {
    const auto n = static_cast<Eigen::Index>(path_.size());
    Friction friction{Eigen::VectorXd(n), Eigen::VectorXd(n)};
    std::vector<std::string> rubbing;
    for (Eigen::Index i = 0; i < n; ++i) {
      const UrdfJoint& joint = *path_[static_cast<std::size_t>(i)];
      friction.coulomb[i] = joint.friction;
      friction.viscous[i] = joint.damping;
      if (joint.damping != 0.0 || joint.friction != 0.0) rubbing.push_back(joint.name);
    }
    if (rubbing.empty()) return;
    out_.cell.drives =
        Drives{Eigen::MatrixXd::Identity(n, n), Eigen::VectorXd::Zero(n), Eigen::VectorXd::Ones(n), friction};
    out_.notes.push_back("damping and friction of " + listed(rubbing) +
                         " are in the drives, with gears of 1, no rotor inertia and 1 N m/A, so that a current is a "
                         "joint torque: a URDF does not describe the motors");
  }

  void write_notes() {
    if (!held_.empty())
      out_.notes.push_back("joints beside the arm are held at 0, their mass is added to the links that carry them: " +
                           listed(held_));
  }

  const UrdfModel& model_;
  UrdfImport out_;
  std::vector<const UrdfJoint*> path_;
  std::vector<JointAxis> axes_;
  std::vector<kinematics::Body> carried_;
  std::vector<std::string> held_;
  Pose T_base_tip_ = Pose::Identity();
};

}  // namespace

UrdfImport parse_urdf(std::string_view xml, const std::string& source, const UrdfOptions& options) {
  const UrdfModel model = read_urdf(xml, source);
  return Importer(model, options).run();
}

UrdfImport import_urdf(const std::filesystem::path& file, const UrdfOptions& options) {
  return parse_urdf(io::read_text(file), file.string(), options);
}

}  // namespace kr5::cell
