// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <kr5/core/fields.hpp>

/// @file
/// What was seen at the port of a link for some time: datagrams as they came, and the answers to them.

namespace kr5::rsi {

/// A datagram, and the answer to it.
struct Exchange {
  double time = 0.0;                    ///< Of its arrival, since listening began, by a clock that never jumps [s].
  double wall_time = 0.0;               ///< The same by the clock of the computer, since 1970 [s].
  std::string sender;                   ///< Address and port.
  std::string telegram;                 ///< Bytes as they came.
  std::string answer;                   ///< Bytes as they were sent; empty: it got none.
  std::optional<double> duration = {};  ///< From the arrival to when the answer was sent [s].
};

struct LinkObservations {
  double duration = 0.0;                             ///< [s]
  int port = 0;                                      ///< Port that was listened on.
  bool answering = true;                             ///< Telegrams were answered, as far as they could be.
  bool own_address = true;                           ///< The layout's address is one of this computer.
  std::optional<std::uint64_t> datagrams_elsewhere;  ///< Datagrams to ports of this computer without a listener.
  std::uint64_t dropped = 0;                         ///< Exchanges that there was no room for.
  std::vector<Exchange> exchanges = {};              ///< In the order of arrival.

  /// Adds what was seen later.
  void append(LinkObservations later);

  static void each_field(auto& self, auto&& visit) {
    visit("duration", self.duration, "Time of listening [s].");
    visit("port", self.port, "Port that was listened on.");
    visit("answering", self.answering, "True where telegrams were answered.");
    visit("own_address", self.own_address, "True where the layout's address is one of this computer.");
    visit("datagrams_elsewhere", self.datagrams_elsewhere,
          "Datagrams to ports of this computer on which nobody listens; none: the kernel does not tell.");
    visit("dropped", self.dropped, "Telegrams that were answered, and for whose record there was no room.");
  }
};

}  // namespace kr5::rsi
