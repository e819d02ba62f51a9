// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <kr5/core/fields.hpp>
#include <kr5/core/random.hpp>
#include <kr5/rsi/telegram.hpp>

/// @file
/// A network that misbehaves as it is told: the same seed and the same messages give the same faults.

namespace kr5::rsi {

enum class LinkFault {
  Late,      ///< It arrives some time later.
  Lose,      ///< It does not arrive.
  Double,    ///< It arrives twice.
  Reorder,   ///< The next one overtakes it.
  Truncate,  ///< Only a part of it arrives.
};
constexpr auto enum_names(LinkFault) {
  using enum LinkFault;
  return names<LinkFault>(
      {{Late, "late"}, {Lose, "lose"}, {Double, "double"}, {Reorder, "reorder"}, {Truncate, "truncate"}});
}

/// A fault at a given time.
struct TimedFault {
  LinkFault fault = LinkFault::Lose;
  double time = 0.0;  ///< [s]
  int count = 1;

  static void each_field(auto& self, auto&& visit) {
    visit("fault", self.fault, "What happens: late | lose | double | reorder | truncate.");
    visit("time", self.time, "Time from which on the next messages have it [s].");
    visit("count", self.count, "Number of these messages.");
  }
};

/// Which messages of a link are faulty. Rates are shares of all messages; one message has one of these faults at most.
struct LinkFaults {
  double late = 0.0;      ///< [-]
  double lose = 0.0;      ///< [-]
  double doubled = 0.0;   ///< [-]
  double reorder = 0.0;   ///< [-]
  double truncate = 0.0;  ///< [-]
  double delay = 0.02;    ///< [s]
  double jitter = 0.0;    ///< [s]
  std::vector<TimedFault> timed = {};
  std::uint64_t seed = 1;

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("late", self.late, "Share of the messages that are late by the delay [-].");
    visit("lose", self.lose, "Share that is lost [-].");
    visit("doubled", self.doubled, "Share that arrives twice [-].");
    visit("reorder", self.reorder, "Share that the next message overtakes [-].");
    visit("truncate", self.truncate, "Share of which only a part arrives [-].");
    visit("delay", self.delay, "By how much a late message is late [s].");
    visit("jitter", self.jitter, "Every message is late by up to this, evenly distributed [s].");
    visit("timed", self.timed, "Faults at given times, beside those by their share.");
    visit("seed", self.seed, "Random seed.");
  }
};

/// Messages by the fault that they had.
struct LinkFaultCounts {
  std::uint64_t passed = 0;
  std::uint64_t late = 0;
  std::uint64_t lost = 0;
  std::uint64_t doubled = 0;
  std::uint64_t reordered = 0;
  std::uint64_t truncated = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("passed", self.passed, "Messages in all.");
    visit("late", self.late, "Messages that were late by the delay.");
    visit("lost", self.lost, "Messages that were lost.");
    visit("doubled", self.doubled, "Messages that arrived twice.");
    visit("reordered", self.reordered, "Messages that the next one overtook.");
    visit("truncated", self.truncated, "Messages that arrived in part.");
  }
};

/// A way on which messages have faults. It has no clock: what is on its way comes out when it is asked for at a time.
/// Once made, it allocates nothing and throws nothing; more than fit on the way are lost.
class FaultyWay {
 public:
  /// @throws InvalidArgument as LinkFaults::validate.
  explicit FaultyWay(const LinkFaults& faults);

  /// A message starts. @param time [s].
  void pass(std::string_view bytes, double time) noexcept;
  /// A message that has arrived by now, in the order of arrival; good until the next call of anything. Empty: none.
  std::string_view next(double time) noexcept;
  /// When the next one arrives; infinite: none is on its way [s].
  double next_time() const noexcept;
  /// All that is on its way is lost: the connection is closed.
  void clear() noexcept;

  const LinkFaultCounts& counts() const noexcept { return counts_; }

 private:
  static constexpr std::size_t most = 64;
  struct Message {
    double arrival = 0.0;
    std::uint64_t order = 0;  ///< Among those that arrive at the same time.
    std::size_t size = 0;
    bool here = false, overtaken = false;
    std::array<char, max_telegram> bytes{};
  };

  std::optional<LinkFault> next_fault(double time) noexcept;
  Message* put(std::string_view bytes, double arrival) noexcept;
  void overtake(double arrival) noexcept;
  const Message* first() const noexcept;

  LinkFaults faults_;
  Random random_;
  std::vector<Message> messages_;
  std::uint64_t order_ = 0;
  LinkFaultCounts counts_;
};

}  // namespace kr5::rsi
