#pragma once

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <kr5/rsi/telegram_layout.hpp>

namespace kr5::test {

/// A computer that listens for a controller on a port of its own: sockets alone, nothing of the library.
class PlainComputer {
 public:
  explicit PlainComputer(rsi::Transport transport, int port = 0)
      : transport_(transport),
        listener_(socket(AF_INET, transport == rsi::Transport::Udp ? SOCK_DGRAM : SOCK_STREAM, 0)) {
    const int yes = 1;
    if (transport == rsi::Transport::Tcp) setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in at = local(port);
    socklen_t size = sizeof at;
    const bool bound = bind(listener_, reinterpret_cast<const sockaddr*>(&at), size) == 0 &&
                       (transport == rsi::Transport::Udp || listen(listener_, 1) == 0);
    if (!bound) throw std::runtime_error(std::strerror(errno));
    getsockname(listener_, reinterpret_cast<sockaddr*>(&at), &size);
    port_ = ntohs(at.sin_port);
  }
  ~PlainComputer() {
    hang_up();
    close(listener_);
  }
  PlainComputer(const PlainComputer&) = delete;

  int port() const { return port_; }
  rsi::Transport transport() const { return transport_; }
  int peer_port() const { return ntohs(peer_.sin_port); }

  /// The next connection of TCP, within two seconds.
  bool accept() {
    hang_up();
    pending_.clear();
    if (!readable(listener_, 2000)) return false;
    connection_ = ::accept(listener_, nullptr, nullptr);
    return connection_ >= 0;
  }
  void hang_up() {
    if (connection_ >= 0) close(connection_);
    connection_ = -1;
  }

  /// The next telegram; empty when none comes in that time.
  std::string receive(int milliseconds = 2000) {
    if (transport_ == rsi::Transport::Udp) {
      socklen_t size = sizeof peer_;
      if (!readable(listener_, milliseconds)) return {};
      return taken(recvfrom(listener_, bytes_.data(), bytes_.size(), 0, reinterpret_cast<sockaddr*>(&peer_), &size));
    }
    const std::string end = "</Rob>";
    while (pending_.find(end) == pending_.npos) {
      if (!readable(connection_, milliseconds)) return {};
      const std::string more = taken(recv(connection_, bytes_.data(), bytes_.size(), 0));
      if (more.empty()) return {};
      pending_ += more;
    }
    const std::size_t at = pending_.find(end) + end.size();
    const std::string out = pending_.substr(0, at);
    pending_.erase(0, at);
    return out;
  }
  /// To where the last telegram came from.
  void answer(const std::string& bytes) const {
    if (transport_ == rsi::Transport::Udp)
      sendto(listener_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&peer_), sizeof peer_);
    else
      (void)::send(connection_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  }

 private:
  static sockaddr_in local(int port) {
    sockaddr_in out{};
    out.sin_family = AF_INET;
    out.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    out.sin_port = htons(static_cast<std::uint16_t>(port));
    return out;
  }
  static bool readable(int socket, int milliseconds) {
    pollfd watched{socket, POLLIN, 0};
    return poll(&watched, 1, milliseconds) > 0;
  }
  std::string taken(ssize_t size) const {
    return size > 0 ? std::string(bytes_.data(), static_cast<std::size_t>(size)) : std::string();
  }

  rsi::Transport transport_;
  int listener_, connection_ = -1, port_ = 0;
  sockaddr_in peer_{};
  std::string pending_;
  std::array<char, 8192> bytes_{};
};

}  // namespace kr5::test
