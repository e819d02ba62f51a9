// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include <kr5/core/fields.hpp>
#include <kr5/geometry/pose.hpp>

/// @file
/// Results of cameras and force sensors as datagrams between computers (`kr5-side/1`). All numbers are little-endian;
/// real numbers are those of IEEE 754 with 64 bits.
///
/// | byte | bytes | what |
/// |---|---|---|
/// | 0 | 4 | `KR5S` |
/// | 4 | 1 | version, 1 |
/// | 5 | 1 | kind: 1 vision, 2 force |
/// | 6 | 2 | bytes of the values: 120 or 56 |
/// | 8 | 4 | source: a number that the sender draws when it starts |
/// | 12 | 4 | sequence: counts the datagrams of this kind, from 0, and begins again after 2^32 - 1 |
/// | 16 | 8 | time of the measurement by the sender's clock [ns] |
/// | 24 | 8 | time of sending by the same clock [ns] |
/// | 32 | | values |
/// | end | 4 | CRC-32 (IEEE 802.3) of everything before |
///
/// Values of vision: target (4 bytes, signed), flags (4; 1: it was found), position [m], quaternion w x y z, standard
/// deviations of position and rotation vector [m, rad], quality [-]. Values of force: flags (4; 1: the sensor is at its
/// limit), nothing (4), force and torque [N, N m].

namespace kr5::rsi {

enum class SideKind : std::uint8_t { Vision = 1, Force = 2 };
constexpr auto enum_names(SideKind) {
  return names<SideKind>({{SideKind::Vision, "vision"}, {SideKind::Force, "force"}});
}

/// Where a camera sees something.
struct VisionResult {
  std::int32_t target = 0;
  bool found = true;
  Pose T_base_target = Pose::Identity();
  Vector6 std = Vector6::Zero();  ///< Standard deviations [m, rad].
  double quality = 1.0;           ///< [-]

  static void each_field(auto& self, auto&& visit) {
    visit("target", self.target, "Number of what is looked for.");
    visit("found", self.found, "Whether it was found; else the pose says nothing.");
    visit("T_base_target", self.T_base_target, "Its pose in B [m].");
    visit("std", self.std, "Standard deviations of position and rotation vector [m, rad].");
    visit("quality", self.quality, "How well it was found, 0 to 1 [-].");
  }
};

struct ForceResult {
  Vector6 wrench = Vector6::Zero();  ///< In the axes that both computers agree on [N, N m].
  bool saturated = false;

  static void each_field(auto& self, auto&& visit) {
    visit("wrench", self.wrench, "Force and torque [N, N m].");
    visit("saturated", self.saturated, "True while the sensor is at its limit.");
  }
};

/// One datagram; of the two results, that of its kind.
struct SideMessage {
  SideKind kind = SideKind::Vision;
  std::uint32_t source = 0;
  std::uint32_t sequence = 0;
  std::int64_t time = 0;  ///< Of the measurement, by the sender's clock [ns].
  std::int64_t sent = 0;  ///< By the same clock [ns].
  VisionResult vision = {};
  ForceResult force = {};

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "Kind: vision | force.");
    visit("source", self.source, "Number of the sender's run.");
    visit("sequence", self.sequence, "Count of the datagrams of this kind.");
    visit("time", self.time, "Time of the measurement by the sender's clock [ns].");
    visit("sent", self.sent, "Time of sending by the same clock [ns].");
    visit("vision", self.vision, "Result of a camera, for the kind vision.");
    visit("force", self.force, "Result of a force sensor, for the kind force.");
  }
};

/// Longest datagram [bytes].
inline constexpr std::size_t max_side_message = 32 + 120 + 4;

enum class SideFault {
  None,
  Foreign,   ///< It does not begin with KR5S.
  Version,   ///< Of another version of the form.
  Size,      ///< Of another length than its kind has.
  Checksum,  ///< Damaged.
  Kind,      ///< Of an unknown kind.
  Value,     ///< A number is not finite, or a quaternion is no rotation.
};
constexpr auto enum_names(SideFault) {
  using enum SideFault;
  return names<SideFault>({{None, "none"},
                           {Foreign, "foreign"},
                           {Version, "version"},
                           {Size, "size"},
                           {Checksum, "checksum"},
                           {Kind, "kind"},
                           {Value, "value"}});
}

/// Length of what was written; 0 where it does not fit or a number is not finite.
std::size_t encode_side(const SideMessage& message, std::span<char> out) noexcept;
/// Whatever the bytes are, nothing outside of them is read; with a fault `out` is as it was.
SideFault decode_side(std::string_view bytes, SideMessage& out) noexcept;

}  // namespace kr5::rsi
