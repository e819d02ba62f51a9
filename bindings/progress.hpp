// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>

#include "python_simulator.hpp"

namespace kr5::python {

/// A Python callable that hears of the progress of a long call, from any thread, without the interpreter held.
inline std::function<void(const std::string&, double)> shared_progress(const py::object& progress) {
  if (progress.is_none()) return {};
  return [progress = Shared(progress)](const std::string& stage, double fraction) {
    call_python("progress", [&] { (*progress)(stage, fraction); });
  };
}

/// The same of a call with one stage.
inline std::function<void(double)> fraction_of(const std::function<void(const std::string&, double)>& progress) {
  if (!progress) return {};
  return [progress](double fraction) { progress("fitting all joints", fraction); };
}

}  // namespace kr5::python
