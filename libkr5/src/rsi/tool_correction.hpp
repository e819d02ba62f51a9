// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/robot/command.hpp>

namespace kr5::rsi {

/// Translation and rotation vector of the correction that leads from a path to where the tool is [m, rad].
Vector6 tool_correction(const Pose& path, const Pose& corrected, robot::CommandFrame frame) noexcept;

}  // namespace kr5::rsi
