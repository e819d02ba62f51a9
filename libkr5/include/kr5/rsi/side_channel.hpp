// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <kr5/rsi/side_receiver.hpp>

namespace kr5::rsi {

/// Port of the side channel unless another is stated.
inline constexpr int usual_side_port = 49160;

/// Sends results to another computer, or to all of a network (an address that ends in .255).
class SideSender {
 public:
  /// @throws InvalidArgument for no address; IoError where there is no socket.
  explicit SideSender(const std::string& address, int port = usual_side_port);
  ~SideSender();
  SideSender(SideSender&&) noexcept;

  /// False where the result holds no finite numbers or the network does not take it.
  /// @param time Of the measurement, by `side_now` [ns].
  bool send(const VisionResult& result, std::int64_t time) noexcept;
  bool send(const ForceResult& result, std::int64_t time) noexcept;

 private:
  struct Socket;
  bool send(SideMessage& message, std::int64_t time) noexcept;

  std::unique_ptr<Socket> socket_;
  std::uint32_t source_ = 0;
  std::uint32_t vision_ = 0, force_ = 0;  ///< Next sequences.
};

/// Receives results; it never waits.
class SidePort {
 public:
  /// @throws InvalidArgument for no address; IoError when the port is not free.
  explicit SidePort(int port = usual_side_port, const std::string& listen = "0.0.0.0");
  ~SidePort();
  SidePort(SidePort&&) noexcept;

  /// Takes what has come; whether there is a newer result.
  bool receive() noexcept;
  const SideReceiver& results() const noexcept { return receiver_; }
  int port() const noexcept;

 private:
  struct Socket;
  std::unique_ptr<Socket> socket_;
  SideReceiver receiver_;
};

/// The clock of both: one that does not jump [ns].
std::int64_t side_now() noexcept;

}  // namespace kr5::rsi
