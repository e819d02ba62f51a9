// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/emulator_line.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <kr5/core/error.hpp>

namespace kr5::rsi {
namespace {

constexpr std::int64_t between_tries = 200'000'000;  // to be connected [ns]
constexpr int most_datagrams = 64;                   // of datagrams: a flood does not keep the clock from ticking

}  // namespace

EmulatorLine::EmulatorLine(const TelegramLayout& layout, const LinkFaults& telegrams, const LinkFaults& answers,
                           int own_port)
    : datagrams_(layout.transport == Transport::Udp),
      given_port_(own_port),
      computer_(endpoint(layout.address, layout.port)),
      telegrams_(telegrams),
      answers_(answers) {
  if (datagrams_) socket_ = udp_socket(endpoint("0.0.0.0", own_port));
}

bool EmulatorLine::open(std::int64_t now) noexcept {
  if (datagrams_ || made_) return false;
  if (connection_) {
    const Connection state = state_of(connection_);
    if (state == Connection::Refused) connection_ = Descriptor(), retry_ = now + between_tries;
    made_ = state == Connection::Made;
    return made_;
  }
  if (now < retry_) return false;
  over_ = false;
  connection_ = begin_connection(computer_);
  if (!connection_) retry_ = now + between_tries;
  return false;
}

void EmulatorLine::close() noexcept {
  telegrams_.clear();
  answers_.clear();
  framer_.clear();
  connection_ = Descriptor();
  made_ = over_ = false;
  if (!datagrams_ || given_port_ > 0) return;
  try {
    socket_ = udp_socket(endpoint("0.0.0.0", 0));
  } catch (const Error&) {
    return;  // the old one does as well
  }
}

void EmulatorLine::send(std::string_view telegram, std::int64_t now) noexcept {
  telegrams_.pass(telegram, seconds(now));
  flush(now);
}

void EmulatorLine::flush(std::int64_t now) noexcept {
  while (telegrams_.next_time() <= seconds(now)) {
    const std::string_view bytes = telegrams_.next(seconds(now));
    const bool sent = datagrams_ ? send_to(socket_, bytes, computer_) : made_ && write_all(connection_, bytes);
    if (!sent) ++unsent_;
  }
}

void EmulatorLine::read(std::int64_t now) noexcept {
  if (datagrams_)
    read_datagrams(now);
  else if (made_)
    read_stream(now);
}

void EmulatorLine::read_datagrams(std::int64_t now) noexcept {
  for (int i = 0; i < most_datagrams; ++i) {
    const Datagram got = receive(socket_, buffer_);
    if (got.size < 0) return;
    if (got.from.address != computer_.address) {
      ++strangers_;
      continue;
    }
    const auto size = std::min(static_cast<std::size_t>(got.size), max_telegram);
    answers_.pass({buffer_.data(), size}, seconds(now - got.waited));
  }
}

void EmulatorLine::read_stream(std::int64_t now) noexcept {
  const std::int64_t size = read_some(connection_, framer_.room());
  if (size < 0) {
    over_ = true;
    made_ = false;
    connection_ = Descriptor();
    return;
  }
  framer_.added(static_cast<std::size_t>(size));
  for (std::string_view answer = framer_.next(); !answer.empty(); answer = framer_.next())
    answers_.pass(answer.substr(0, max_telegram), seconds(now));
}

EmulatorLine::Heard EmulatorLine::next(std::int64_t now) noexcept {
  const double arrival = answers_.next_time();
  if (arrival > seconds(now)) return {};
  return {answers_.next(seconds(now)), at(arrival), true};
}

std::int64_t EmulatorLine::at(double seconds) const noexcept {
  constexpr double never = 1e9;  // [s]
  return seconds < never ? begun_ + std::llround(1e9 * seconds) : std::numeric_limits<std::int64_t>::max();
}

std::int64_t EmulatorLine::next_time() const noexcept {
  return at(std::min(telegrams_.next_time(), answers_.next_time()));
}

}  // namespace kr5::rsi
