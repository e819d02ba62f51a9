// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/sockets.hpp"

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <sstream>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <kr5/core/error.hpp>

namespace kr5::rsi {
namespace {

constexpr std::int64_t second = 1'000'000'000;  // [ns]

std::int64_t clock_now(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return second * now.tv_sec + now.tv_nsec;
}

sockaddr_in address_of(const Endpoint& at) noexcept {
  sockaddr_in out{};
  out.sin_family = AF_INET;
  out.sin_addr.s_addr = htonl(at.address);
  out.sin_port = htons(at.port);
  return out;
}

Descriptor bound(int type, const Endpoint& at) {
  Descriptor out(socket(AF_INET, type | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const auto fail = [&](const char* what) {
    const int reason = errno;
    throw IoError(std::string(type == SOCK_DGRAM ? "UDP" : "TCP") + " port " + std::to_string(at.port) + ": " + what +
                  ": " + std::strerror(reason) +
                  (reason == EADDRINUSE ? "; another program listens there: end it, or take another port" : ""));
  };
  if (!out) fail("no socket");
  const int yes = 1;
  if (type == SOCK_STREAM) setsockopt(out.get(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  if (type == SOCK_DGRAM) setsockopt(out.get(), SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes);
  const sockaddr_in address = address_of(at);
  if (bind(out.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) fail("cannot be listened on");
  return out;
}

/// Since the stamp of the kernel; 0 where there is none, or where the wall clock was set in between.
std::int64_t waited_since(msghdr& message) noexcept {
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec stamp{};
    std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
    const std::int64_t since = clock_now(CLOCK_REALTIME) - (second * stamp.tv_sec + stamp.tv_nsec);
    return since > 0 && since < second ? since : 0;
  }
  return 0;
}

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

Endpoint endpoint(const std::string& address, int port) {
  in_addr parsed{};
  require(inet_pton(AF_INET, address.c_str(), &parsed) == 1,
          "address: found \"" + address + "\", expected four numbers such as 192.168.1.60");
  require(port >= 0 && port <= 65535, "port: must lie between 0 and 65535");
  return {ntohl(parsed.s_addr), static_cast<std::uint16_t>(port)};
}

Descriptor udp_socket(const Endpoint& at) { return bound(SOCK_DGRAM, at); }

Descriptor tcp_listener(const Endpoint& at) {
  Descriptor out = bound(SOCK_STREAM, at);
  if (listen(out.get(), 4) != 0) throw IoError("TCP port " + std::to_string(at.port) + ": " + std::strerror(errno));
  return out;
}

int bound_port(const Descriptor& socket) noexcept {
  sockaddr_in address{};
  socklen_t size = sizeof address;
  getsockname(socket.get(), reinterpret_cast<sockaddr*>(&address), &size);
  return ntohs(address.sin_port);
}

Datagram receive(const Descriptor& socket, std::span<char> to) noexcept {
  sockaddr_in from{};
  iovec place{to.data(), to.size()};
  alignas(cmsghdr) std::array<char, 128> extra{};
  msghdr message{};
  message.msg_name = &from;
  message.msg_namelen = sizeof from;
  message.msg_iov = &place;
  message.msg_iovlen = 1;
  message.msg_control = extra.data();
  message.msg_controllen = extra.size();
  Datagram out;
  out.size = recvmsg(socket.get(), &message, MSG_DONTWAIT);
  if (out.size < 0) return out;
  out.from = {ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
  out.waited = waited_since(message);
  return out;
}

bool send_to(const Descriptor& socket, std::string_view bytes, const Endpoint& to) noexcept {
  const sockaddr_in address = address_of(to);
  const auto sent = sendto(socket.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                           reinterpret_cast<const sockaddr*>(&address), sizeof address);
  return sent == static_cast<ssize_t>(bytes.size());
}

Descriptor begin_connection(const Endpoint& to) noexcept {
  Descriptor out(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!out) return out;
  const int yes = 1;
  setsockopt(out.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  const sockaddr_in address = address_of(to);
  const bool made = connect(out.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  return made || errno == EINPROGRESS ? std::move(out) : Descriptor();
}

Connection state_of(const Descriptor& connection) noexcept {
  pollfd watched{connection.get(), POLLOUT, 0};
  if (poll(&watched, 1, 0) <= 0) return Connection::Coming;
  int error = 0;
  socklen_t size = sizeof error;
  getsockopt(connection.get(), SOL_SOCKET, SO_ERROR, &error, &size);
  return error == 0 ? Connection::Made : Connection::Refused;
}

Descriptor accept_connection(const Descriptor& listener) noexcept {
  Descriptor out(accept4(listener.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
  const int yes = 1;
  if (out) setsockopt(out.get(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  return out;
}

std::int64_t read_some(const Descriptor& connection, std::span<char> to) noexcept {
  const ssize_t size = recv(connection.get(), to.data(), to.size(), MSG_DONTWAIT);
  if (size > 0) return size;
  return size < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) ? 0 : -1;
}

bool write_all(const Descriptor& connection, std::string_view bytes) noexcept {
  return send(connection.get(), bytes.data(), bytes.size(), MSG_DONTWAIT | MSG_NOSIGNAL) ==
         static_cast<ssize_t>(bytes.size());
}

std::int64_t steady_now() noexcept { return clock_now(CLOCK_MONOTONIC); }

std::int64_t wall_now() noexcept { return clock_now(CLOCK_REALTIME); }

std::string endpoint_text(const Endpoint& at) {
  std::string out;
  for (int shift = 24; shift >= 0; shift -= 8)
    out += std::to_string(at.address >> shift & 255U) + (shift > 0 ? "." : ":");
  return out + std::to_string(at.port);
}

bool is_own_address(const std::string& address) {
  ifaddrs* all = nullptr;
  in_addr wanted{};
  if (inet_pton(AF_INET, address.c_str(), &wanted) != 1 || getifaddrs(&all) != 0) return false;
  bool found = false;
  for (const ifaddrs* card = all; card; card = card->ifa_next)
    if (card->ifa_addr && card->ifa_addr->sa_family == AF_INET)
      found |= reinterpret_cast<const sockaddr_in*>(card->ifa_addr)->sin_addr.s_addr == wanted.s_addr;
  freeifaddrs(all);
  return found;
}

std::optional<std::uint64_t> datagrams_without_listener() {
  std::ifstream file("/proc/net/snmp");
  std::string names, numbers, name, number;
  while (std::getline(file, names) && std::getline(file, numbers)) {
    if (!names.starts_with("Udp:")) continue;
    std::istringstream each_name(names), each_number(numbers);
    while (each_name >> name && each_number >> number)
      if (name == "NoPorts") return std::stoull(number);
  }
  return std::nullopt;
}

}  // namespace kr5::rsi
