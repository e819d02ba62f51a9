// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include <kr5/rsi/link_faults.hpp>
#include <kr5/rsi/telegram_layout.hpp>

#include "rsi/sockets.hpp"
#include "rsi/stream_framer.hpp"

namespace kr5::rsi {

/// What an emulated controller sends through and hears by: datagrams, or a connection that it makes itself, with the
/// faults of its network. One thread uses it; nothing waits.
class EmulatorLine {
 public:
  /// @throws InvalidArgument for an address that is none and for the faults; IoError when the own port is not free.
  EmulatorLine(const TelegramLayout& layout, const LinkFaults& telegrams, const LinkFaults& answers, int own_port);

  /// A line is there to send through; over TCP, after `open` and once the computer has taken the connection.
  bool connected() const noexcept { return datagrams_ || made_; }
  /// Goes on making a connection, where that is needed; true when it has just been made.
  bool open(std::int64_t now) noexcept;
  /// Closes it; of datagrams, the next ones come from another port, if none is given.
  void close() noexcept;
  /// The computer has closed it.
  bool over() const noexcept { return over_; }

  void send(std::string_view telegram, std::int64_t now) noexcept;
  /// Sends what is due.
  void flush(std::int64_t now) noexcept;
  /// Reads what has come.
  void read(std::int64_t now) noexcept;
  struct Heard {
    std::string_view bytes;    ///< Empty: nothing.
    std::int64_t arrival = 0;  ///< [ns]
    bool any = false;
  };
  /// The next answer, good until the next call of anything.
  Heard next(std::int64_t now) noexcept;

  int descriptor() const noexcept { return datagrams_ ? socket_.get() : made_ ? connection_.get() : -1; }
  /// When something is due to be sent or heard [ns].
  std::int64_t next_time() const noexcept;
  int own_port() const noexcept { return datagrams_ ? bound_port(socket_) : 0; }
  std::uint64_t unsent() const noexcept { return unsent_; }
  std::uint64_t strangers() const noexcept { return strangers_; }
  const LinkFaultCounts& telegram_counts() const noexcept { return telegrams_.counts(); }
  const LinkFaultCounts& answer_counts() const noexcept { return answers_.counts(); }

 private:
  double seconds(std::int64_t now) const noexcept { return 1e-9 * static_cast<double>(now - begun_); }
  std::int64_t at(double seconds) const noexcept;
  void read_datagrams(std::int64_t now) noexcept;
  void read_stream(std::int64_t now) noexcept;

  bool datagrams_;
  int given_port_;
  Endpoint computer_;
  std::int64_t begun_ = steady_now();
  Descriptor socket_, connection_;
  bool made_ = false, over_ = false;
  std::int64_t retry_ = 0;
  FaultyWay telegrams_, answers_;
  StreamFramer framer_{"</Sen>"};
  std::uint64_t unsent_ = 0, strangers_ = 0;
  std::array<char, max_telegram + 1> buffer_{};
};

}  // namespace kr5::rsi
