// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>

#include <kr5/rsi/link_session.hpp>

namespace kr5::rsi {

/// The computer's end of the sensor interface: waits on the layout's port for a controller, reads what it tells, steps
/// a controller function and answers to the port of the sender, in a thread of its own. Over UDP or, for a KR C2, TCP.
class Link {
 public:
  /// Listens at once. @param step Called in the thread of the link, once a telegram.
  /// @throws InvalidArgument as LinkSession; IoError when the port is not free or the address is none of this computer.
  Link(const TelegramLayout& layout, const robot::SensorModel& model, const LinkOptions& options, CycleFunction step);
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
