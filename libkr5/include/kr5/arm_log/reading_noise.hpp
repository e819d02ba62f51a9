// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <kr5/arm_log/log_note.hpp>
#include <kr5/cell/recording.hpp>

namespace kr5::arm_log {

/// Readings of columns at the rate at which a motion needs them, before long experiments are thinned: a vector an
/// uninterrupted part.
using Readings = std::map<std::string, std::vector<Eigen::VectorXd>>;

/// Standard deviation of one reading by third differences, in which what is smooth cancels; of coarse numbers, that of
/// their step. 1e-9 at least.
double noise_of_readings(const std::vector<Eigen::VectorXd>& parts);

/// States the noise of the columns of a recording for which its cell has none, as neighbouring rows show it; notes of
/// what was stated. Noise of joint torques follows from that of the currents, where the cell states this.
/// @param readings Columns whose neighbours stand nearer in time than the rows of the recording; may be empty.
std::vector<LogNote> add_reading_noise(cell::Recording& recording, const Readings& readings = {});

}  // namespace kr5::arm_log
