// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include <kr5/core/fields.hpp>
#include <kr5/force/peg_tube_contact.hpp>

/// @file
/// Contact of peg and tube by a collision library, as a check of kr5/force/peg_tube_contact.hpp: nothing is shared.

namespace kr5::sim {

/// What finds the contacts of a peg on its tube.
enum class ContactBy {
  ClosedForm,  ///< kr5/force/peg_tube_contact.hpp.
  Mesh,        ///< ODE's collision of a cylinder with triangles: several times slower, and as exact as the triangles.
};
constexpr auto enum_names(ContactBy) {
  return names<ContactBy>({{ContactBy::ClosedForm, "closed_form"}, {ContactBy::Mesh, "mesh"}});
}

struct MeshContactOptions {
  int segments = 64;

  /// @throws InvalidArgument naming the field.
  void validate() const;
  static void each_field(auto& self, auto&& visit) {
    visit("segments", self.segments, "Number of corners of the polygons that approximate the circles of the tube.");
  }
};

/// A round peg without chamfer on a tube of triangles, by DART's ODE collision detector. The corners of the triangles
/// lie on the circles, so that the tube's walls are up to `sagitta` inside them. Where the peg first touches is as
/// exact as that; where edges cross, ODE pushes along the normal of one of the triangles, which may lie flat.
class MeshContact {
 public:
  /// @throws InvalidArgument naming the field; for a peg with a chamfer, which is no cylinder.
  explicit MeshContact(const force::PegTubeShape& shape, const MeshContactOptions& options = {});
  ~MeshContact();
  MeshContact(MeshContact&&) noexcept;
  MeshContact& operator=(MeshContact&&) noexcept;

  /// As force::peg_tube_contacts; the features in contact are not distinguished.
  force::Contacts contacts(const Pose& T_tube_peg);
  /// How far the middle of an edge of the outer polygon lies inside its circle [m].
  double sagitta() const;

 private:
  struct Bodies;
  std::unique_ptr<Bodies> bodies_;
};

}  // namespace kr5::sim
