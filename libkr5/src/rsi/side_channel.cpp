// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/side_channel.hpp>

#include <array>
#include <random>

#include <sys/socket.h>

#include "rsi/sockets.hpp"

namespace kr5::rsi {

struct SideSender::Socket {
  Descriptor descriptor;
  Endpoint to;
};

struct SidePort::Socket {
  Descriptor descriptor;
};

SideSender::SideSender(const std::string& address, int port)
    : socket_(std::make_unique<Socket>(Socket{udp_socket({}), endpoint(address, port)})),
      source_(std::random_device()()) {
  const int yes = 1;
  setsockopt(socket_->descriptor.get(), SOL_SOCKET, SO_BROADCAST, &yes, sizeof yes);
}

SideSender::~SideSender() = default;
SideSender::SideSender(SideSender&&) noexcept = default;

bool SideSender::send(SideMessage& message, std::int64_t time) noexcept {
  message.source = source_;
  message.time = time;
  message.sent = side_now();
  std::array<char, max_side_message> bytes;
  const std::size_t size = encode_side(message, bytes);
  return size > 0 && send_to(socket_->descriptor, {bytes.data(), size}, socket_->to);
}

bool SideSender::send(const VisionResult& result, std::int64_t time) noexcept {
  SideMessage message;
  message.kind = SideKind::Vision;
  message.sequence = vision_++;
  message.vision = result;
  return send(message, time);
}

bool SideSender::send(const ForceResult& result, std::int64_t time) noexcept {
  SideMessage message;
  message.kind = SideKind::Force;
  message.sequence = force_++;
  message.force = result;
  return send(message, time);
}

SidePort::SidePort(int port, const std::string& listen)
    : socket_(std::make_unique<Socket>(Socket{udp_socket(endpoint(listen, port))})) {}

SidePort::~SidePort() = default;
SidePort::SidePort(SidePort&&) noexcept = default;

bool SidePort::receive() noexcept {
  constexpr int most_at_once = 256;
  std::array<char, max_side_message + 1> bytes;
  bool newer = false;
  for (int i = 0; i < most_at_once; ++i) {
    const Datagram got = rsi::receive(socket_->descriptor, bytes);
    if (got.size < 0) break;
    newer |= receiver_.take({bytes.data(), static_cast<std::size_t>(got.size)}, side_now() - got.waited);
  }
  return newer;
}

int SidePort::port() const noexcept { return bound_port(socket_->descriptor); }

std::int64_t side_now() noexcept { return steady_now(); }

}  // namespace kr5::rsi
