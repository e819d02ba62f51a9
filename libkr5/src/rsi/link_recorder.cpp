// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/link_recorder.hpp>

#include <utility>

#include <kr5/core/error.hpp>

#include "rsi/exchange_ring.hpp"
#include "rsi/sockets.hpp"

namespace kr5::rsi {
namespace {

constexpr std::size_t ring_bytes = std::size_t{8} << 20;

std::string sender_text(std::uint64_t number, Transport transport) {
  if (transport == Transport::Tcp) return "connection " + std::to_string(number);
  return endpoint_text({static_cast<std::uint32_t>(number >> 16), static_cast<std::uint16_t>(number & 0xFFFFU)});
}

double since(std::int64_t now, std::int64_t then) { return 1e-9 * static_cast<double>(now - then); }

}  // namespace

struct LinkRecorder::Record {
  Record(const TelegramLayout& of, const LinkOptions& options, const std::optional<TestMotionOptions>& wanted)
      : layout(of),
        answering(options.answer),
        motion(test_motion(of, options, wanted)),
        link(of, {}, options, step_function(), [this](const ExchangeView& e) noexcept {
          const std::int64_t wall = wall_now() - (steady_now() - e.arrival);
          if (!ring.put(e, wall)) dropped.fetch_add(1, std::memory_order_relaxed);
        }) {}

  static std::unique_ptr<TestMotion> test_motion(const TelegramLayout& of, const LinkOptions& options,
                                                 const std::optional<TestMotionOptions>& wanted) {
    if (!wanted) return nullptr;
    require(options.answer, "answer: an arm is moved by answers only");
    return std::make_unique<TestMotion>(of, options.frame, *wanted);
  }
  CycleFunction step_function() {
    if (!motion) return {};
    return [this](const robot::RobotReading& reading) noexcept { return motion->step(reading); };
  }

  TelegramLayout layout;
  bool answering;
  std::int64_t begun = steady_now();
  std::optional<std::uint64_t> elsewhere = datagrams_without_listener();
  ExchangeRing ring{ring_bytes};
  std::atomic<std::uint64_t> dropped{0};
  std::unique_ptr<TestMotion> motion;
  Link link;  // last: its thread ends first
};

LinkRecorder::LinkRecorder(const TelegramLayout& layout, const LinkOptions& options,
                           const std::optional<TestMotionOptions>& motion)
    : record_(std::make_unique<Record>(layout, options, motion)) {}
LinkRecorder::~LinkRecorder() = default;
LinkRecorder::LinkRecorder(LinkRecorder&&) noexcept = default;

LinkObservations LinkRecorder::take() {
  Record& r = *record_;
  LinkObservations out;
  out.port = r.link.port();
  out.answering = r.answering;
  out.own_address = is_own_address(r.layout.address);
  ExchangeRing::Head head;
  Exchange e;
  while (r.ring.take(head, e.telegram, e.answer)) {
    e.time = since(head.arrival, r.begun);
    e.wall_time = since(head.wall, 0);
    e.sender = sender_text(head.sender, r.layout.transport);
    e.duration.reset();
    if (!e.answer.empty()) e.duration = since(head.duration, 0);
    out.exchanges.push_back(e);
  }
  out.duration = since(steady_now(), r.begun);
  out.dropped = r.dropped.load(std::memory_order_relaxed);
  const auto elsewhere = datagrams_without_listener();
  if (r.layout.transport == Transport::Udp && elsewhere && r.elsewhere)
    out.datagrams_elsewhere = *elsewhere - *r.elsewhere;
  return out;
}

LinkStatistics LinkRecorder::statistics() const noexcept { return record_->link.statistics(); }
RealTimeStatus LinkRecorder::real_time() const noexcept { return record_->link.real_time(); }
int LinkRecorder::port() const noexcept { return record_->link.port(); }
bool LinkRecorder::aborted() const noexcept { return record_->motion && record_->motion->aborted(); }

}  // namespace kr5::rsi
