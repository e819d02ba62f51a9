// SPDX-License-Identifier: BSD-3-Clause
#include "window.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include <dart/dynamics/BoxShape.hpp>
#include <dart/dynamics/CylinderShape.hpp>
#include <dart/dynamics/SimpleFrame.hpp>
#include <dart/dynamics/SphereShape.hpp>
#include <dart/gui/osg/Viewer.hpp>
#include <dart/gui/osg/WorldNode.hpp>
#include <dart/simulation/World.hpp>

#include <kr5/core/error.hpp>
#include <kr5/geometry/pose.hpp>
#include <kr5/predict/cell_objects.hpp>

namespace kr5::sim {
namespace {

using dart::dynamics::CylinderShape;
using dart::dynamics::SimpleFrame;
using dart::dynamics::SimpleFramePtr;
using Eigen::Vector3d;

SimpleFramePtr part(const dart::simulation::WorldPtr& world, dart::dynamics::ShapePtr shape, const Vector3d& colour) {
  const std::string name = "part " + std::to_string(world->getNumSimpleFrames());  // DART tells of names it must change
  const auto frame = std::make_shared<SimpleFrame>(dart::dynamics::Frame::World(), name);
  frame->setShape(std::move(shape));
  frame->createVisualAspect()->setColor(colour);
  world->addSimpleFrame(frame);
  return frame;
}

/// A cylinder from a to b; DART's lies about its own middle, along Z.
Pose between(const Vector3d& a, const Vector3d& b) {
  Pose T = Pose::Identity();
  T.translation() = (a + b) / 2;
  T.linear() = rotation_from_z(b - a);
  return T;
}

/// The arm as cylinders: one about each axis, one along it, one along a.
class ArmParts {
 public:
  ArmParts(const dart::simulation::WorldPtr& world, const cell::Cell& cell)
      : chain_(cell::nominal_chain(cell)), cell_(cell) {
    const int n = cell.robot.joints();
    double reach = 0.1;
    for (const auto& row : cell.robot.dh) reach += std::abs(row.a) + std::abs(row.b);
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(n);
    for (int i = 0; i < n; ++i) {
      thick_.push_back(reach * (0.046 - 0.028 * i / n));
      const Vector3d grey(0.62, 0.69, 0.76);
      joints_.push_back(
          part(world, std::make_shared<CylinderShape>(1.2 * thick_[i], 2.3 * thick_[i]), {0.88, 0.64, 0.26}));
      for (auto* list : {&along_, &across_})
        list->push_back(part(world, std::make_shared<CylinderShape>(0.85 * thick_[i], 1e-4), grey));
    }
    tool_ = part(world, std::make_shared<CylinderShape>(0.5 * thick_.back(), 1e-4), {0.42, 0.45, 0.5});
    if (cell.peg)
      peg_ = part(world, std::make_shared<CylinderShape>(cell.peg->radius, cell.peg->length), {0.12, 0.16, 0.22});
  }

  void move(const Eigen::VectorXd& q) {
    Pose T = chain_.T_base_0;
    const std::vector<Pose> links = chain_.link_poses(q);
    for (std::size_t i = 0; i < links.size(); ++i) {
      const Vector3d start = T.translation(), end = links[i].translation(), z = T.linear().col(2);
      const Vector3d knee = start + z * z.dot(end - start);  // first along the axis, then along a
      joints_[i]->setTransform(T);
      stretch(along_[i], start, knee);
      stretch(across_[i], knee, end);
      T = links[i];
    }
    const Pose T_base_tool = T * (cell_.tool ? cell_.tool->T_flange_tool : Pose::Identity());
    // The peg sticks out of the grip by what is seen of it.
    const Vector3d shown = T_base_tool.linear().col(2) * (cell_.peg ? 0.7 * cell_.peg->length : 0.0);
    stretch(tool_, T.translation(), T_base_tool.translation() - shown);
    if (peg_) peg_->setTransform(T_base_tool * Eigen::Translation3d(0.0, 0.0, -cell_.peg->length / 2));
  }

 private:
  static void stretch(const SimpleFramePtr& frame, const Vector3d& a, const Vector3d& b) {
    const double length = std::max((b - a).norm(), 1e-4);
    std::static_pointer_cast<CylinderShape>(frame->getShape())->setHeight(length);
    frame->setTransform(length > 1e-4 ? between(a, b) : Pose(Eigen::Translation3d(a)));
  }

  kinematics::DhChain chain_;
  const cell::Cell& cell_;
  std::vector<double> thick_;
  std::vector<SimpleFramePtr> joints_, along_, across_;
  SimpleFramePtr tool_, peg_;
};

/// A tube is drawn as boxes in a ring, as DART has no hollow cylinder.
void add_tube(const dart::simulation::WorldPtr& world, const cell::PlacedObject& tube) {
  constexpr int sides = 36;
  const double middle = (tube.radius + tube.inner_radius) / 2, wall = tube.radius - tube.inner_radius;
  const double width = 2.0 * tube.radius * std::tan(M_PI / sides);
  for (int k = 0; k < sides; ++k) {
    const auto frame =
        part(world, std::make_shared<dart::dynamics::BoxShape>(Vector3d(wall, width, tube.depth)), {0.84, 0.54, 0.37});
    frame->setTransform(tube.T_base_object * Eigen::AngleAxisd(2.0 * M_PI * k / sides, Vector3d::UnitZ()) *
                        Eigen::Translation3d(middle, 0.0, -tube.depth / 2));
  }
}

/// Of a bench without end, the part below `tip` is drawn.
void add(const dart::simulation::WorldPtr& world, const cell::PlacedObject& object, const Vector3d& tip) {
  constexpr double thin = 1e-3, widest = 0.6;
  if (object.kind == SolidKind::Tube) return add_tube(world, object);
  if (object.kind == SolidKind::Ball) {
    part(world, std::make_shared<dart::dynamics::SphereShape>(object.radius), {0.5, 0.7, 0.84})
        ->setTransform(object.T_base_object);
    return;
  }
  const bool floor = object.width > 10.0 * widest;
  const Vector3d size(std::min(object.width, widest), std::min(object.height, widest), thin);
  Pose T = object.T_base_object;
  if (floor) T.translation() = Vector3d(tip.x(), tip.y(), T.translation().z() - 2 * thin);
  part(world, std::make_shared<dart::dynamics::BoxShape>(size), floor ? Vector3d(0.9, 0.88, 0.84) : Vector3d::Ones())
      ->setTransform(T);
}

Eigen::VectorXd posture(const Motion& motion, double t) {
  const auto after = std::upper_bound(motion.t.begin(), motion.t.end(), t) - motion.t.begin();
  if (after == 0) return motion.q.row(0);
  if (after == motion.t.size()) return motion.q.row(after - 1);
  const double part = (t - motion.t[after - 1]) / (motion.t[after] - motion.t[after - 1]);
  return motion.q.row(after - 1) + part * (motion.q.row(after) - motion.q.row(after - 1));
}

}  // namespace

void show_window(const cell::Cell& cell, const std::vector<cell::PlacedObject>& objects, const Motion& motion,
                 const std::string& picture) {
  require(motion.t.size() > 0 && motion.q.rows() == motion.t.size() && motion.q.cols() == cell.robot.joints(),
          "motion: expected a row of joint values each time");
  const auto world = dart::simulation::World::create();
  ArmParts arm(world, cell);
  const Vector3d tip = cell::T_base_tool(cell, motion.q.row(0).transpose()).translation();
  for (const cell::PlacedObject& object : predict::scanner_objects(cell)) add(world, object, tip);
  for (const cell::PlacedObject& object : objects) add(world, object, tip);
  ::osg::ref_ptr<dart::gui::osg::Viewer> viewer = new dart::gui::osg::Viewer;
  const ::osg::ref_ptr<dart::gui::osg::WorldNode> node = new dart::gui::osg::WorldNode(world);
  viewer->addWorldNode(node);
  viewer->setUpViewInWindow(0, 0, 1000, 750);
  viewer->getCameraManipulator()->setHomePosition({2.0, -2.2, 1.6}, {0.45, 0.0, 0.45}, {0.0, 0.0, 1.0});
  viewer->setCameraManipulator(viewer->getCameraManipulator());
  viewer->realize();
  if (!viewer->isRealized()) throw IoError("window: no display is available");
  const double begin = motion.t[0], length = std::max(motion.t[motion.t.size() - 1] - begin, 1e-3);
  const auto started = std::chrono::steady_clock::now();
  for (int frame = 0; !viewer->done(); ++frame) {
    const double passed = std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
    arm.move(posture(motion, begin + (picture.empty() ? std::fmod(passed, length) : length / 2)));
    if (!picture.empty() && frame == 2) viewer->captureScreen(picture);  // the first frames may be empty
    viewer->frame();
    if (!picture.empty() && frame == 4) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(12));
  }
}

}  // namespace kr5::sim
