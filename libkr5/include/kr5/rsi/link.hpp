// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <memory>
#include <string_view>

#include <kr5/rsi/link_session.hpp>

namespace kr5::rsi {

/// A datagram and what became of it. The bytes are good during the call.
struct ExchangeView {
  std::uint64_t sender = 0;           ///< A number that tells senders apart; over UDP address * 65536 + port.
  std::int64_t arrival = 0;           ///< By a steady clock [ns].
  std::string_view telegram, answer;  ///< No answer: it was not sent.
  std::int64_t duration = 0;          ///< From the arrival to when the answer was sent [ns].
};

/// What is called after each datagram, in the thread of the link: any function that throws nothing.
class ExchangeFunction {
 public:
  ExchangeFunction() = default;
  template <class F>
  requires(std::is_nothrow_invocable_v<F&, const ExchangeView&> &&
           !std::is_same_v<std::remove_cvref_t<F>, ExchangeFunction>) ExchangeFunction(F function)
      : function_(std::move(function)) {}

  void operator()(const ExchangeView& exchange) const noexcept {
    if (function_) function_(exchange);
  }

 private:
  std::function<void(const ExchangeView&)> function_;
};

/// The computer's end of the sensor interface: waits on the layout's port for a controller, reads what it tells, steps
/// a controller function and answers to the port of the sender, in a thread of its own. Over UDP or, for a KR C2, TCP.
class Link {
 public:
  /// Listens at once. @param step Called in the thread of the link, once a telegram. @param observe The same, once a
  /// datagram.
  /// @throws InvalidArgument as LinkSession; IoError when the port is not free or the address is none of this computer.
  Link(const TelegramLayout& layout, const robot::SensorModel& model, const LinkOptions& options, CycleFunction step,
       ExchangeFunction observe = {});
  /// Stops answering, upon which a controller stops.
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  /// Port that it listens on; that of the layout.
  int port() const noexcept;
  /// What the kernel gave to the thread.
  RealTimeStatus real_time() const noexcept;
  LinkStatistics statistics() const noexcept;
  /// After Reconnect::Hold: commands count again.
  void resume() noexcept;

 private:
  class Server;
  std::unique_ptr<Server> server_;
};

}  // namespace kr5::rsi
