// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/arm_log/compare_recordings.hpp>

/// @file
/// A comparison of recordings in sentences, for terminal, page and JSON alike; read back by nothing.

namespace kr5::arm_log {

/// What differs, how much of the difference it explains, and what the recordings have in common.
std::string text(const RecordingComparison& comparison);
/// An effect that differs, with its values in both recordings.
std::string change_text(const EffectChange& change);

}  // namespace kr5::arm_log
