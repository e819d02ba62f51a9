// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/link_session.hpp>

#include <cmath>

#include <kr5/core/error.hpp>

namespace kr5::rsi {
namespace {

constexpr double nanoseconds = 1e9;          // in a second
constexpr std::int64_t longest_back = 1000;  // of a telegram that was overtaken [ms]
constexpr std::int64_t longest_gap = 10000;  // within a session [ms]

std::int64_t to_nanoseconds(double seconds) { return static_cast<std::int64_t>(std::llround(seconds * nanoseconds)); }

}  // namespace

LinkSession::LinkSession(const TelegramLayout& layout, const robot::SensorModel& model, const LinkOptions& options,
                         CycleFunction step)
    : reader_(layout, Sender::Controller),
      writer_(layout, Sender::Computer),
      units_(layout),
      correction_(layout, options.limits, options.mode, options.frame, options.cycle),
      model_(model),
      options_(options),
      step_(std::move(step)),
      silence_(to_nanoseconds(options.silence)),
      deadline_(to_nanoseconds(options.deadline_or_usual())) {
  model_.validate();
  options_.validate();
  require(!layout.only_send || !options.answer, "only_send: the controller expects no answers");
}

void LinkSession::begin(const Telegram& telegram, const ControllerState& state, std::uint64_t sender) noexcept {
  holding_ = begun_ && options_.reconnect == Reconnect::Hold;
  begun_ = running_ = true;
  stopped_ = false;
  sender_ = sender;
  resume_.store(false);
  time_ = 1e-3 * static_cast<double>(telegram.ipoc.value());
  first_.reset();
  if (correction_.is_told_by(state))
    correction_.begin(state, state);
  else
    first_ = state;
  add(Sessions);
}

/// Whether the telegram of a session is one to be answered.
bool LinkSession::is_in_order(const Telegram& telegram, std::int64_t since, bool& repeated) noexcept {
  repeated = since == 0;
  if (repeated) return add(Repeated), true;
  if (since < 0) return add(Reordered), false;
  const auto cycles = std::llround(1e-3 * static_cast<double>(since) / options_.cycle);
  if (cycles > 1) add(Lost, static_cast<std::uint64_t>(cycles - 1));
  time_ += 1e-3 * static_cast<double>(since);
  last_ipoc_ = telegram.ipoc;
  return true;
}

std::string_view LinkSession::corrected(const Telegram& telegram, const ControllerState& state) noexcept {
  robot::RobotReading reading = robot_reading(state, model_, time_);
  reading.status.stopped = reading.status.stopped || holding_ || stopped_;
  const robot::RobotCommand command = step_(reading);
  stopped_ = command.stop;
  if (holding_ && resume_.exchange(false)) holding_ = false;
  state_.store(holding_ ? LinkState::Holding : LinkState::Running, std::memory_order_relaxed);
  Correction correction = holding_ ? correction_.hold() : correction_.step(command, state);
  correction.stop_move = command.stop;
  if (correction_.outcome() == CommandOutcome::Limited) add(Limited);
  if (correction_.outcome() == CommandOutcome::Refused) add(Refused);
  units_.set_correction(correction, out_);
  out_.ipoc = telegram.ipoc;
  size_ = writer_.encode(out_, bytes_);
  return {bytes_.data(), size_};
}

std::string_view LinkSession::answer(std::string_view bytes, std::uint64_t sender, std::int64_t arrival) noexcept {
  const TelegramFault fault = reader_.decode(bytes, in_);
  telegrams_[static_cast<std::size_t>(fault)].fetch_add(1, std::memory_order_relaxed);
  if (fault != TelegramFault::None) return {};
  const bool over = !running_ || arrival - last_arrival_ > silence_;
  if (!over && sender != sender_) return add(Strangers), std::string_view();
  const std::int64_t since = ipoc_step(last_ipoc_, in_.ipoc);
  const ControllerState state = units_.state(in_);
  if (over || since < -longest_back || since > longest_gap) {
    begin(in_, state, sender);
    last_ipoc_ = in_.ipoc;
  } else {
    bool repeated = false;
    if (!is_in_order(in_, since, repeated)) return {};
    if (repeated) return {bytes_.data(), size_};
    period_.add(arrival - last_arrival_);
    if (first_) correction_.begin(*first_, state);
    first_.reset();
  }
  last_arrival_ = arrival;
  if (state.late_packets) late_packets_.store(*state.late_packets, std::memory_order_relaxed);
  if (first_) return size_ = 0, std::string_view();
  return corrected(in_, state);
}

void LinkSession::note_sent(bool sent, std::int64_t lateness, std::int64_t duration) noexcept {
  add(sent ? Answered : Unsent);
  lateness_.add(lateness);
  answer_.add(duration);
  if (duration > deadline_) add(Late);
}

void LinkSession::end() noexcept {
  running_ = false;
  state_.store(LinkState::Waiting, std::memory_order_relaxed);
}

void LinkSession::note_silence(std::int64_t now) noexcept {
  if (now - last_arrival_ > silence_) state_.store(LinkState::Waiting, std::memory_order_relaxed);
}

LinkStatistics LinkSession::statistics() const noexcept {
  const auto count = [this](Counter counter) { return counters_[counter].load(std::memory_order_relaxed); };
  LinkStatistics out;
  out.state = state_.load(std::memory_order_relaxed);
  out.period = period_.summary();
  out.answer = answer_.summary();
  out.lateness = lateness_.summary();
  for (const auto& [fault, name] : enum_names(TelegramFault{}))
    out.telegrams.of(fault) = telegrams_[static_cast<std::size_t>(fault)].load(std::memory_order_relaxed);
  out.answered = count(Answered);
  out.late = count(Late);
  out.lost = count(Lost);
  out.repeated = count(Repeated);
  out.reordered = count(Reordered);
  out.strangers = count(Strangers);
  out.sessions = count(Sessions);
  out.limited = count(Limited);
  out.refused = count(Refused);
  out.unsent = count(Unsent);
  out.late_packets = late_packets_.load(std::memory_order_relaxed);
  return out;
}

}  // namespace kr5::rsi
