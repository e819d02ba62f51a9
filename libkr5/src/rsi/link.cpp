// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/link.hpp>

#include <array>

#include <poll.h>

#include <kr5/core/error.hpp>

#include "rsi/real_time_thread.hpp"
#include "rsi/sockets.hpp"
#include "rsi/stream_framer.hpp"

namespace kr5::rsi {

namespace {

/// The memory is locked before: what a controller sends meanwhile would wait in the socket, and count as late.
Descriptor bound_socket(const TelegramLayout& layout, const LinkOptions& options) {
  lock_memory(options.real_time);
  const auto at = endpoint(options.listen, layout.port);
  return layout.transport == Transport::Udp ? udp_socket(at) : tcp_listener(at);
}

}  // namespace

class Link::Server {
 public:
  Server(const TelegramLayout& layout, const robot::SensorModel& model, const LinkOptions& options, CycleFunction step,
         ExchangeFunction observe)
      : session_(layout, model, options, std::move(step)),
        observe_(std::move(observe)),
        answering_(options.answer),
        datagrams_(layout.transport == Transport::Udp),
        socket_(bound_socket(layout, options)),
        thread_("the link") {
    thread_.begin(options.real_time, [this] { run(); });
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  LinkSession& session() noexcept { return session_; }
  int port() const noexcept { return bound_port(socket_); }
  RealTimeStatus real_time() const noexcept { return thread_.status(); }

 private:
  void run() noexcept {
    constexpr int patience = 50;      // [ms]
    constexpr int most_at_once = 64;  // a flood of datagrams does not keep it from ending
    while (true) {
      std::array<pollfd, 3> watched = {{{thread_.ending(), POLLIN, 0},
                                        {socket_.get(), POLLIN, 0},
                                        {connection_.get(), POLLIN, 0}}};  // -1 is not watched
      if (poll(watched.data(), watched.size(), patience) == 0) session_.note_silence(steady_now());
      if (watched[0].revents) return;
      if (datagrams_) {
        for (int i = 0; i < most_at_once && answer_datagram();) ++i;
      } else {
        if (watched[1].revents) take_connection();
        if (connection_ && watched[2].revents) answer_stream();
      }
    }
  }

  /// False when there is none.
  bool answer_datagram() noexcept {
    const Datagram got = receive(socket_, buffer_);
    if (got.size < 0) return false;
    const std::int64_t now = steady_now(), arrival = now - got.waited;
    const auto size = static_cast<std::size_t>(got.size);
    answer({buffer_.data(), size}, got.from.number(), arrival, now - arrival,
           [&](std::string_view bytes) { return send_to(socket_, bytes, got.from); });
    return true;
  }

  void answer(std::string_view telegram, std::uint64_t sender, std::int64_t arrival, std::int64_t lateness,
              auto&& send) noexcept {
    const std::string_view answer = session_.answer(telegram, sender, arrival);
    const bool wanted = answering_ && !answer.empty(), sent = wanted && send(answer);
    const std::int64_t duration = steady_now() - arrival;
    if (wanted) session_.note_sent(sent, lateness, duration);
    observe_({sender, arrival, telegram, sent ? answer : std::string_view(), duration});
  }

  void take_connection() noexcept {
    Descriptor next = accept_connection(socket_);
    if (!next) return;
    if (connection_) return session_.note_stranger();  // and it is closed
    connection_ = std::move(next);
    framer_.clear();
    ++connections_;
  }

  void answer_stream() noexcept {
    const std::int64_t size = read_some(connection_, framer_.room());
    const std::int64_t arrival = steady_now();
    if (size < 0) {
      connection_ = Descriptor();
      return session_.end();
    }
    framer_.added(static_cast<std::size_t>(size));
    for (std::string_view telegram = framer_.next(); !telegram.empty(); telegram = framer_.next())
      answer(telegram, connections_, arrival, 0, [&](std::string_view bytes) { return write_all(connection_, bytes); });
  }

  LinkSession session_;
  ExchangeFunction observe_;
  bool answering_, datagrams_;
  Descriptor socket_, connection_;
  std::uint64_t connections_ = 0;
  StreamFramer framer_{"</Rob>"};
  std::array<char, max_telegram + 1> buffer_{};  // one more, so that what is too long is seen to be
  RealTimeThread thread_;
};

Link::Link(const TelegramLayout& layout, const robot::SensorModel& model, const LinkOptions& options,
           CycleFunction step, ExchangeFunction observe)
    : server_(std::make_unique<Server>(layout, model, options, std::move(step), std::move(observe))) {}

Link::~Link() = default;

int Link::port() const noexcept { return server_->port(); }
RealTimeStatus Link::real_time() const noexcept { return server_->real_time(); }
LinkStatistics Link::statistics() const noexcept { return server_->session().statistics(); }
void Link::resume() noexcept { server_->session().resume(); }

}  // namespace kr5::rsi
