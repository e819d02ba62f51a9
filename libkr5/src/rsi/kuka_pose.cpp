// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/kuka_pose.hpp>

#include "rsi/wire_units.hpp"

namespace kr5::rsi {

Pose from_kuka(const Vector6& xyzabc) noexcept {
  Vector6 v;
  v << millimetre * xyzabc.head<3>(), degree * xyzabc.tail<3>().reverse();
  return from_xyzrpy(v);
}

Vector6 to_kuka(const Pose& T) noexcept {
  const Vector6 v = to_xyzrpy(T);
  Vector6 out;
  out << v.head<3>() / millimetre, v.tail<3>().reverse() / degree;
  return out;
}

}  // namespace kr5::rsi
