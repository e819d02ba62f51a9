// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <kr5/core/fields.hpp>

/// @file
/// What a thread asks of the kernel so that others do not hold it up, and what it was given.

namespace kr5::rsi {

struct RealTimeOptions {
  int priority = 80;
  bool lock_memory = true;
  std::optional<int> cpu = {};

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("priority", self.priority, "Real-time priority of the thread (SCHED_FIFO), 1 to 99; 0: none is asked for.");
    visit("lock_memory", self.lock_memory, "Keep the memory of the process from being swapped out.");
    visit("cpu", self.cpu, "Number of the processor that the thread stays on; none: any.");
  }
};

/// Whether the kernel gave what it was asked for.
enum class Grant { NotAsked, Given, Denied };
constexpr auto enum_names(Grant) {
  return names<Grant>({{Grant::NotAsked, "not_asked"}, {Grant::Given, "given"}, {Grant::Denied, "denied"}});
}

struct RealTimeStatus {
  Grant priority = Grant::NotAsked;
  Grant locked_memory = Grant::NotAsked;
  Grant cpu = Grant::NotAsked;

  static void each_field(auto& self, auto&& visit) {
    visit("priority", self.priority, "Real-time priority: not_asked | given | denied.");
    visit("locked_memory", self.locked_memory, "Locked memory: not_asked | given | denied.");
    visit("cpu", self.cpu, "Processor of its own: not_asked | given | denied.");
  }
};

/// Locks the memory of the process as far as it is there now, which takes tens of milliseconds: before anybody waits.
Grant lock_memory(const RealTimeOptions& options) noexcept;

/// Asks for the calling thread; what is denied changes nothing.
RealTimeStatus request_real_time(const RealTimeOptions& options) noexcept;

/// What was denied, and how it is permitted, a sentence each; nothing where nothing was.
std::vector<std::string> real_time_remedies(const RealTimeStatus& status);

}  // namespace kr5::rsi
