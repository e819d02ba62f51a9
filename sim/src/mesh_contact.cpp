// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/sim/mesh_contact.hpp>

#include <array>
#include <cmath>
#include <mutex>
#include <numbers>
#include <sstream>

#include <assimp/cimport.h>
#include <assimp/postprocess.h>

#include <dart/collision/CollisionGroup.hpp>
#include <dart/collision/CollisionObject.hpp>
#include <dart/collision/CollisionOption.hpp>
#include <dart/collision/CollisionResult.hpp>
#include <dart/collision/ode/OdeCollisionDetector.hpp>
#include <dart/dynamics/CylinderShape.hpp>
#include <dart/dynamics/MeshShape.hpp>
#include <dart/dynamics/SimpleFrame.hpp>

#include <kr5/core/error.hpp>

namespace kr5::sim {
namespace {

namespace dc = dart::collision;
namespace dd = dart::dynamics;

/// ODE counts its users without a lock.
std::mutex& ode() {
  static std::mutex mutex;
  return mutex;
}

/// A ring of the tube's section, from the inside out round it.
struct Ring {
  double radius, z;
};

/// The tube as text of an OBJ file, outsides counter-clockwise.
std::string tube_text(const force::PegTubeShape& s, int segments) {
  std::vector<Ring> rings = {{s.inner_radius, -s.tube_depth}};
  if (s.tube_chamfer > 0.0) rings.push_back({s.inner_radius, -s.tube_chamfer});
  rings.insert(rings.end(),
               {{s.inner_radius + s.tube_chamfer, 0.0}, {s.outer_radius, 0.0}, {s.outer_radius, -s.tube_depth}});
  std::ostringstream text;
  text.precision(12);
  for (const Ring& ring : rings)
    for (int i = 0; i < segments; ++i) {
      const double angle = 2.0 * std::numbers::pi * i / segments;
      text << "v " << ring.radius * std::cos(angle) << ' ' << ring.radius * std::sin(angle) << ' ' << ring.z << '\n';
    }
  const int count = static_cast<int>(rings.size());
  for (int r = 0; r < count; ++r)
    for (int i = 0; i < segments; ++i) {
      const int next = (i + 1) % segments, a = r * segments + 1, b = (r + 1) % count * segments + 1;
      text << "f " << a + i << ' ' << b + i << ' ' << b + next << "\nf " << a + i << ' ' << b + next << ' ' << a + next
           << '\n';
    }
  return text.str();
}

const aiScene* tube_scene(const force::PegTubeShape& shape, int segments) {
  const std::string text = tube_text(shape, segments);
  const aiScene* scene = aiImportFileFromMemory(text.data(), static_cast<unsigned>(text.size()), aiProcess_GenNormals,
                                                "obj");  // DART reads normals
  require(scene != nullptr, std::string("tube: cannot be meshed: ") + aiGetErrorString());
  return scene;
}

}  // namespace

struct MeshContact::Bodies {
  force::PegTubeShape shape;
  MeshContactOptions options;
  dd::SimpleFramePtr peg = std::make_shared<dd::SimpleFrame>(dd::Frame::World(), "peg");
  dd::SimpleFramePtr tube = std::make_shared<dd::SimpleFrame>(dd::Frame::World(), "tube");
  std::shared_ptr<dc::OdeCollisionDetector> detector;
  dc::CollisionGroupPtr group;

  Bodies(const force::PegTubeShape& given, const MeshContactOptions& chosen) : shape(given), options(chosen) {
    peg->setShape(std::make_shared<dd::CylinderShape>(shape.peg_radius, shape.peg_length));
    tube->setShape(std::make_shared<dd::MeshShape>(Eigen::Vector3d::Ones(), tube_scene(shape, options.segments)));
    const std::lock_guard lock(ode());
    detector = dc::OdeCollisionDetector::create();
    group = detector->createCollisionGroup(peg.get(), tube.get());
  }
  ~Bodies() {
    const std::lock_guard lock(ode());
    group.reset();
    detector.reset();
  }
  Bodies(const Bodies&) = delete;
  Bodies& operator=(const Bodies&) = delete;
};

void MeshContactOptions::validate() const { require(segments >= 3, "segments: must be 3 or more"); }

MeshContact::MeshContact(const force::PegTubeShape& shape, const MeshContactOptions& options) {
  shape.validate();
  options.validate();
  require(shape.peg_chamfer == 0.0, "peg.chamfer: must be 0 for contact by mesh");
  bodies_ = std::make_unique<Bodies>(shape, options);
}
MeshContact::~MeshContact() = default;
MeshContact::MeshContact(MeshContact&&) noexcept = default;
MeshContact& MeshContact::operator=(MeshContact&&) noexcept = default;

double MeshContact::sagitta() const {
  return bodies_->shape.outer_radius * (1.0 - std::cos(std::numbers::pi / bodies_->options.segments));
}

force::Contacts MeshContact::contacts(const Pose& T_tube_peg) {
  Bodies& b = *bodies_;
  b.peg->setTransform(T_tube_peg * Eigen::Translation3d(0.0, 0.0, 0.5 * b.shape.peg_length));
  const dc::CollisionOption option(true, force::Contacts::capacity);
  dc::CollisionResult result;
  b.group->collide(option, &result);
  force::Contacts out;
  for (const dc::Contact& c : result.getContacts()) {
    // DART's normals point to its first object.
    const double sign = c.collisionObject1->getShapeFrame() == b.peg.get() ? 1.0 : -1.0;
    if (c.penetrationDepth > 0.0) out.add({c.point, sign * c.normal, c.penetrationDepth});
  }
  return out;
}

}  // namespace kr5::sim
