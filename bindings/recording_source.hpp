// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <memory>
#include <variant>
#include <vector>

#include <kr5/cell/recording.hpp>

#include "conversion.hpp"

/// @file
/// A recording as people name it: one that was loaded, or the folder of one. A new kind of source (a log with a model,
/// say) is another alternative here, and then serves every function of kr5.gap.

namespace kr5::python {

using RecordingSource = std::variant<const cell::Recording*, std::filesystem::path>;

/// The recording itself, or the one that stands in the folder.
/// @throws IoError naming file, line and field of every error in form.
inline std::shared_ptr<const cell::Recording> recording_from(const RecordingSource& source) {
  if (const auto* folder = std::get_if<std::filesystem::path>(&source))
    return std::make_shared<const cell::Recording>(cell::load_recording(*folder));
  const cell::Recording* given = std::get<const cell::Recording*>(source);
  if (!given) throw py::type_error("recording: expected a kr5.cell.Recording or the folder of one, found None");
  return {std::shared_ptr<const void>(), given};  // Python owns it, and holds it during the call
}

}  // namespace kr5::python
