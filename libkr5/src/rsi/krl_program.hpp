// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

#include <kr5/rsi/controller_files.hpp>

namespace kr5::rsi {

/// The `.src` of a KR C4 or KR C5, which loads a signal flow, switches it on and is guided by it until it ends.
std::string krl_program(const TelegramLayout& layout, const ProgramOptions& options);
/// The `.src` of a KR C2, which makes the objects and wires them itself.
/// @param unwired Tags that it has no objects for are added.
std::string krl_program_rsi2(const TelegramLayout& layout, const ProgramOptions& options,
                             std::vector<std::string>& unwired);

}  // namespace kr5::rsi
