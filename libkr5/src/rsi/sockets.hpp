// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

/// @file
/// Sockets of IPv4, of which none waits: whoever uses them polls.

namespace kr5::rsi {

/// A file descriptor that is closed with its owner.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) noexcept : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  ~Descriptor();
  int get() const noexcept { return number_; }
  explicit operator bool() const noexcept { return number_ >= 0; }

 private:
  int number_ = -1;
};

/// An address with its port, which is a number that tells senders apart.
struct Endpoint {
  std::uint32_t address = 0;
  std::uint16_t port = 0;
  std::uint64_t number() const noexcept { return std::uint64_t{address} << 16 | port; }
};

/// @throws InvalidArgument for a text that is no address.
Endpoint endpoint(const std::string& address, int port);

/// Bound sockets. @throws IoError when that fails, with the reason.
Descriptor udp_socket(const Endpoint& at);
Descriptor tcp_listener(const Endpoint& at);
/// Port that a socket is bound to.
int bound_port(const Descriptor& socket) noexcept;

/// A datagram with its sender and its arrival; nothing is there when `size` is negative.
struct Datagram {
  std::int64_t size = -1;
  Endpoint from;
  std::int64_t waited = 0;  ///< Since it came to the kernel, as far as that tells [ns].
};
Datagram receive(const Descriptor& socket, std::span<char> to) noexcept;
bool send_to(const Descriptor& socket, std::string_view bytes, const Endpoint& to) noexcept;

/// A TCP connection that has begun to be made; none when it cannot.
Descriptor begin_connection(const Endpoint& to) noexcept;
enum class Connection { Coming, Made, Refused };
Connection state_of(const Descriptor& connection) noexcept;
/// The next connection; none when there is none.
Descriptor accept_connection(const Descriptor& listener) noexcept;
/// Bytes that were read; 0 when none are there, -1 when the connection is over.
std::int64_t read_some(const Descriptor& connection, std::span<char> to) noexcept;
/// False when not all of it could be sent at once.
bool write_all(const Descriptor& connection, std::string_view bytes) noexcept;

/// By a clock that never jumps [ns].
std::int64_t steady_now() noexcept;
/// By the clock of the computer, since 1970 [ns].
std::int64_t wall_now() noexcept;

/// "192.168.1.60:49152"
std::string endpoint_text(const Endpoint& at);
/// Whether a card of this computer has the address.
bool is_own_address(const std::string& address);
/// Datagrams that came so far to ports on which nobody listens; none: the kernel does not tell.
std::optional<std::uint64_t> datagrams_without_listener();

}  // namespace kr5::rsi
