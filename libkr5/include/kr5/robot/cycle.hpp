// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace kr5::robot {

/// Period of a controller that states none: of corrections over KUKA's RobotSensorInterface 2 [s].
inline constexpr double usual_cycle = 0.012;

}  // namespace kr5::robot
