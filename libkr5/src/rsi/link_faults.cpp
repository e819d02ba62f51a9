// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/link_faults.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::rsi {

void LinkFaults::validate() const {
  double sum = 0.0;
  for (const auto& [value, name] : {std::pair{late, "late"}, std::pair{lose, "lose"}, std::pair{doubled, "doubled"},
                                    std::pair{reorder, "reorder"}, std::pair{truncate, "truncate"}}) {
    require(value >= 0 && value <= 1, std::string(name) + ": must be a share from 0 to 1 [-]");
    sum += value;
  }
  require(sum <= 1 + 1e-9, "late, lose, doubled, reorder, truncate: the shares are more than 1 together [-]");
  require(delay > 0 && delay <= 10, "delay: must be positive and at most 10 s [s]");
  require(jitter >= 0 && jitter <= 10, "jitter: must lie between 0 and 10 s [s]");
  for (std::size_t i = 0; i < timed.size(); ++i) {
    const std::string field = "timed[" + std::to_string(i) + "].";
    require(timed[i].time >= 0 && std::isfinite(timed[i].time), field + "time: must not be negative [s]");
    require(timed[i].count >= 1, field + "count: must be positive");
  }
}

FaultyWay::FaultyWay(const LinkFaults& faults) : faults_(faults), random_(faults.seed), messages_(most) {
  faults_.validate();
}

/// The fault of the next message, if it has one. A draw a message, whatever comes of it, so that faults at given times
/// do not change the others.
std::optional<LinkFault> FaultyWay::next_fault(double time) noexcept {
  double draw = random_.uniform();
  for (TimedFault& at : faults_.timed)
    if (at.count > 0 && time >= at.time) return --at.count, at.fault;
  for (const auto& [share, fault] :
       {std::pair{faults_.late, LinkFault::Late}, std::pair{faults_.lose, LinkFault::Lose},
        std::pair{faults_.doubled, LinkFault::Double}, std::pair{faults_.reorder, LinkFault::Reorder},
        std::pair{faults_.truncate, LinkFault::Truncate}}) {
    if (draw < share) return fault;
    draw -= share;
  }
  return std::nullopt;
}

FaultyWay::Message* FaultyWay::put(std::string_view bytes, double arrival) noexcept {
  const auto free = std::ranges::find(messages_, false, &Message::here);
  if (free == messages_.end() || bytes.size() > max_telegram) return ++counts_.lost, nullptr;
  free->arrival = arrival;
  free->order = order_++;
  free->size = bytes.size();
  free->here = true;
  free->overtaken = false;
  std::ranges::copy(bytes, free->bytes.begin());
  return &*free;
}

void FaultyWay::pass(std::string_view bytes, double time) noexcept {
  ++counts_.passed;
  const double arrival = time + random_.uniform() * faults_.jitter, part = random_.uniform(0.1, 0.9);
  const std::optional<LinkFault> fault = next_fault(time);
  if (fault == LinkFault::Reorder) {  // it waits for the next one, and overtakes nothing itself
    Message* waiting = put(bytes, std::numeric_limits<double>::infinity());
    if (waiting) waiting->overtaken = true, ++counts_.reordered;
    return;
  }
  if (fault == LinkFault::Truncate) {
    ++counts_.truncated;
    bytes = bytes.substr(0, static_cast<std::size_t>(part * static_cast<double>(bytes.size())));
  }
  if (fault == LinkFault::Late) ++counts_.late;
  if (fault == LinkFault::Lose) ++counts_.lost;
  if (fault != LinkFault::Lose) put(bytes, arrival + (fault == LinkFault::Late ? faults_.delay : 0.0));
  if (fault == LinkFault::Double) ++counts_.doubled, put(bytes, arrival);
  overtake(arrival);
}

/// Those that wait to be overtaken come behind this one.
void FaultyWay::overtake(double arrival) noexcept {
  for (Message& m : messages_) {
    if (!m.here || !m.overtaken) continue;
    m.overtaken = false;
    m.arrival = arrival;
    m.order = order_++;
  }
}

const FaultyWay::Message* FaultyWay::first() const noexcept {
  const Message* out = nullptr;
  for (const Message& m : messages_)
    if (m.here && (!out || std::pair(m.arrival, m.order) < std::pair(out->arrival, out->order))) out = &m;
  return out;
}

double FaultyWay::next_time() const noexcept {
  const Message* m = first();
  return m ? m->arrival : std::numeric_limits<double>::infinity();
}

std::string_view FaultyWay::next(double time) noexcept {
  const Message* found = first();
  if (!found || found->arrival > time) return {};
  Message& m = messages_[static_cast<std::size_t>(found - messages_.data())];
  m.here = false;
  return {m.bytes.data(), m.size};
}

void FaultyWay::clear() noexcept {
  for (Message& m : messages_) m.here = false;
}

}  // namespace kr5::rsi
