#pragma once

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <regex>
#include <stdexcept>
#include <string>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace kr5::test {

inline constexpr std::array<double, 6> home = {0, -90, 90, 0, 90, 0};

/// A telegram of a controller, written from the description of the interface, not with our codec.
inline std::string plain_rob(std::uint64_t ipoc, const std::array<double, 6>& axes, int delay = 0,
                             const std::array<double, 6>& setpoints = home) {
  std::array<char, 1024> out;
  const auto &a = axes, &s = setpoints;
  std::snprintf(out.data(), out.size(),
                "<Rob Type=\"KUKA\">\r\n<RIst X=\"445.0\" Y=\"0.0\" Z=\"790.0\" A=\"0.0\" B=\"90.0\" C=\"0.0\"/>"
                "<RSol X=\"445.0\" Y=\"0.0\" Z=\"790.0\" A=\"0.0\" B=\"90.0\" C=\"0.0\"/>"
                "<AIPos A1=\"%.4f\" A2=\"%.4f\" A3=\"%.4f\" A4=\"%.4f\" A5=\"%.4f\" A6=\"%.4f\"/>"
                "<ASPos A1=\"%.4f\" A2=\"%.4f\" A3=\"%.4f\" A4=\"%.4f\" A5=\"%.4f\" A6=\"%.4f\"/>"
                "<Delay D=\"%d\"/><IPOC>%llu</IPOC>\r\n</Rob>",
                a[0], a[1], a[2], a[3], a[4], a[5], s[0], s[1], s[2], s[3], s[4], s[5], delay,
                static_cast<unsigned long long>(ipoc));
  return out.data();
}

/// A number of an answer; it throws where there is none.
inline double plain_value(const std::string& sen, const std::string& element, const std::string& attribute) {
  std::smatch found;
  if (!std::regex_search(sen, found, std::regex("<" + element + "\\s[^>]*\\b" + attribute + "=\"([^\"]*)\"")))
    throw std::runtime_error("no " + element + " " + attribute + " in " + sen);
  return std::stod(found[1]);
}

inline std::string plain_ipoc_of(const std::string& sen) {
  std::smatch found;
  return std::regex_search(sen, found, std::regex("<IPOC>(.*?)</IPOC>")) ? found[1].str() : std::string();
}

/// One end of a socket to a port of this computer.
class PlainClient {
 public:
  PlainClient(int type, int port) : socket_(socket(AF_INET, type, 0)) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    if (connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0)
      throw std::runtime_error(std::strerror(errno));
  }
  ~PlainClient() { close(socket_); }
  PlainClient(const PlainClient&) = delete;

  void send(const std::string& bytes) const { (void)::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  /// What comes within a time; nothing when nothing does.
  std::string receive(int milliseconds = 2000) const {
    pollfd watched{socket_, POLLIN, 0};
    std::array<char, 4096> bytes;
    if (poll(&watched, 1, milliseconds) <= 0) return {};
    const ssize_t size = recv(socket_, bytes.data(), bytes.size(), 0);
    return size > 0 ? std::string(bytes.data(), static_cast<std::size_t>(size)) : std::string();
  }
  std::string ask(const std::string& bytes, int milliseconds = 2000) const {
    send(bytes);
    return receive(milliseconds);
  }

 private:
  int socket_;
};

/// A port on which nobody listens.
inline int free_port(int type) {
  const int probe = socket(AF_INET, type, 0);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof at;
  if (bind(probe, reinterpret_cast<const sockaddr*>(&at), size) != 0) throw std::runtime_error("no free port");
  getsockname(probe, reinterpret_cast<sockaddr*>(&at), &size);
  close(probe);
  return ntohs(at.sin_port);
}

}  // namespace kr5::test
