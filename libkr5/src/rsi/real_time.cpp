// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/real_time.hpp>

#include <array>

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>

#include <kr5/core/error.hpp>

namespace kr5::rsi {
namespace {

Grant grant(bool given) noexcept { return given ? Grant::Given : Grant::Denied; }

/// The pages of the stack that the thread will use are there before it needs them.
void touch_stack() noexcept {
  std::array<volatile char, 65536> page;
  for (std::size_t i = 0; i < page.size(); i += 1024) page[i] = 0;
}

}  // namespace

void RealTimeOptions::validate() const {
  require(priority >= 0 && priority <= 99, "priority: must lie between 0 and 99");
  require(!cpu || (*cpu >= 0 && *cpu < CPU_SETSIZE), "cpu: must be the number of a processor");
}

Grant lock_memory(const RealTimeOptions& options) noexcept {
  // With what comes later, a process near its limit could no longer allocate.
  return options.lock_memory ? grant(mlockall(MCL_CURRENT) == 0) : Grant::NotAsked;
}

RealTimeStatus request_real_time(const RealTimeOptions& options) noexcept {
  RealTimeStatus out;
  if (options.priority > 0) {
    sched_param wanted{};
    wanted.sched_priority = options.priority;
    out.priority = grant(pthread_setschedparam(pthread_self(), SCHED_FIFO, &wanted) == 0);
  }
  if (options.cpu) {
    cpu_set_t set;
    CPU_ZERO(&set);
    CPU_SET(static_cast<std::size_t>(*options.cpu), &set);
    out.cpu = grant(pthread_setaffinity_np(pthread_self(), sizeof set, &set) == 0);
  }
  touch_stack();
  out.locked_memory = lock_memory(options);
  return out;
}

std::vector<std::string> real_time_remedies(const RealTimeStatus& status) {
  std::vector<std::string> out;
  if (status.priority == Grant::Denied)
    out.push_back(
        "The thread of the link has no real-time priority, so that other programs may hold up its answers: allow it by "
        "a line \"USER - rtprio 99\" in /etc/security/limits.d/realtime.conf, and log in again.");
  if (status.locked_memory == Grant::Denied)
    out.push_back(
        "Memory of the link may be swapped out, which would hold up an answer: allow it to stay by a line \"USER - "
        "memlock unlimited\" in /etc/security/limits.d/realtime.conf, and log in again.");
  if (status.cpu == Grant::Denied)
    out.push_back(
        "The link does not stay on its processor: there is none of that number, or it is not for this program.");
  return out;
}

}  // namespace kr5::rsi
