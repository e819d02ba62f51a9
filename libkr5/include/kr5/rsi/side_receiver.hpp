// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include <kr5/rsi/side_message.hpp>

namespace kr5::rsi {

struct SideStatistics {
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
  std::uint64_t reordered = 0;
  std::uint64_t repeated = 0;
  std::uint64_t restarts = 0;
  std::uint64_t foreign = 0;
  std::uint64_t other_version = 0;
  std::uint64_t damaged = 0;

  static void each_field(auto& self, auto&& visit) {
    visit("received", self.received, "Good datagrams.");
    visit("lost", self.lost, "Datagrams that did not come, by the gaps of their sequence.");
    visit("reordered", self.reordered, "Datagrams that a later one overtook; the later one stays.");
    visit("repeated", self.repeated, "Datagrams that came twice.");
    visit("restarts", self.restarts, "How often the sender began anew.");
    visit("foreign", self.foreign, "Datagrams of another program.");
    visit("other_version", self.other_version, "Datagrams of another version of the form.");
    visit("damaged", self.damaged, "Datagrams with another length, checksum, kind or value than they should have.");
  }
};

/// Keeps the newest result of each kind, whatever is lost, overtaken, doubled or damaged on the way. Knows no socket
/// and no clock; allocates and throws nothing.
class SideReceiver {
 public:
  /// True for a result that is newer than what there was. @param arrival By any clock that does not jump [ns].
  bool take(std::string_view bytes, std::int64_t arrival) noexcept;

  /// The newest one; null when there was none.
  const SideMessage* latest(SideKind kind) const noexcept;
  /// Time from its measurement to `now`, by the clock of the arrivals [s]. The clocks of the two computers need not
  /// agree: the quickest of the last datagrams is taken to have been under way for no time.
  std::optional<double> age(SideKind kind, std::int64_t now) const noexcept;
  const SideStatistics& statistics() const noexcept { return statistics_; }

 private:
  struct Stream {
    bool begun = false;
    SideMessage latest;
    std::uint32_t former_source = 0;       ///< Of the run before; its datagrams may still arrive.
    std::uint64_t window = 0;              ///< Bit i: sequence `latest.sequence - i` has come.
    std::array<std::int64_t, 2> offset{};  ///< Least arrival - sent of this stretch of time and the one before [ns].
    std::int64_t stretch_begin = 0;
  };

  bool take_good(Stream& stream, const SideMessage& message, std::int64_t arrival) noexcept;
  void begin(Stream& stream, const SideMessage& message, std::int64_t arrival) noexcept;
  void take_older(Stream& stream, std::uint32_t back) noexcept;
  static void note_offset(Stream& stream, std::int64_t offset, std::int64_t arrival) noexcept;

  std::array<Stream, 2> streams_;
  SideStatistics statistics_;
};

}  // namespace kr5::rsi
