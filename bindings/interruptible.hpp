// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <stdexcept>

#include <kr5/cell/simulator.hpp>

#include "conversion.hpp"

/// @file
/// Long calls that hear Ctrl-C. Python's signals reach only the main thread, and only when it asks for them.

namespace kr5::python {

/// A simulator that ends the call it serves, by an exception, once that is asked for.
class InterruptibleSimulator : public cell::Simulator {
 public:
  explicit InterruptibleSimulator(const cell::Simulator& simulator) : simulator_(simulator) {}

  io::Table simulate(const cell::Cell& cell, const cell::Experiment& experiment) const override {
    if (interrupted_) throw std::runtime_error("interrupted");
    return simulator_.predict_unchecked(cell, experiment);
  }

  void interrupt() { interrupted_ = true; }

 private:
  const cell::Simulator& simulator_;
  std::atomic<bool> interrupted_{false};
};

/// Calls `compute(simulator)` in another thread, with the interpreter let go, and asks for signals meanwhile. What a
/// signal's handler raises, KeyboardInterrupt as a rule, ends the computation at its next prediction.
template <class Compute>
auto compute_interruptibly(const std::shared_ptr<const cell::Simulator>& simulator, const Compute& compute) {
  InterruptibleSimulator with(*simulator);
  auto result = [&] {
    const py::gil_scoped_release released;
    return std::async(std::launch::async, [&] { return compute(static_cast<const cell::Simulator&>(with)); });
  }();
  const auto ready = [&](std::chrono::milliseconds time) {
    const py::gil_scoped_release released;
    return result.wait_for(time) == std::future_status::ready;
  };
  while (!ready(std::chrono::milliseconds(100))) {
    if (PyErr_CheckSignals() == 0) continue;
    const py::error_already_set raised;
    with.interrupt();
    while (!ready(std::chrono::milliseconds(100))) {
    }
    throw raised;
  }
  return result.get();
}

}  // namespace kr5::python
