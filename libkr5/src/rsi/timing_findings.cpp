// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/timing_findings.hpp"

#include <algorithm>
#include <cmath>

namespace kr5::rsi {
namespace {

constexpr double oldest_overtaken = 1.0;   // telegram, by IPOC [s]
constexpr double usual_scale = 1e-3;       // of IPOC [s/ms]
constexpr double rate_tolerance = 0.2;     // of the cycle [-]
constexpr std::size_t overtaken_most = 2;  // telegrams in succession that one may overtake

/// From the newest telegram so far to another one.
struct TelegramStep {
  double time = 0.0;      ///< Of the other one [s].
  double arrival = 0.0;   ///< Time between both arrivals [s].
  std::int64_t ipoc = 0;  ///< [ms]
  bool back = false;      ///< IPOC began anew.

  bool is_newer() const { return ipoc > 0 && !back; }
};

/// Whether IPOC stays behind a telegram that is newer, so that it was set and nothing was overtaken.
bool stays_behind(const std::vector<ReadTelegram>& all, std::size_t newest, std::size_t from) {
  if (from + overtaken_most >= all.size()) return false;
  for (std::size_t i = from; i <= from + overtaken_most; ++i)
    if (ipoc_step(all[newest].ipoc, all[i].ipoc) >= 0) return false;
  return true;
}

std::vector<TelegramStep> steps_of(const ReadObservations& read) {
  std::vector<TelegramStep> out;
  const std::vector<ReadTelegram>& all = read.telegrams;
  for (std::size_t newest = 0, i = 1; i < all.size(); ++i) {
    const double time = all[i].exchange->time;
    TelegramStep step{time, time - all[newest].exchange->time, ipoc_step(all[newest].ipoc, all[i].ipoc)};
    step.back = step.ipoc < 0 && (static_cast<double>(step.ipoc) < -1000 * oldest_overtaken ||
                                  step.arrival > read.options.silence || stays_behind(all, newest, i));
    if (step.ipoc > 0 || step.back) newest = i;
    out.push_back(step);
  }
  return out;
}

/// IPOC against the arrivals [s]. @param scale [s/ms].
double jump_of(const TelegramStep& s, double scale) { return static_cast<double>(s.ipoc) * scale - s.arrival; }

/// Of telegrams that follow each other without interruption or jump.
struct CycleEstimate {
  double ipoc = 0.0;   ///< Cycle by IPOC; 0: too few telegrams [ms].
  double scale = 0.0;  ///< Time of the arrivals over IPOC [s/ms].
};

CycleEstimate estimate_cycle(const ReadObservations& read, const std::vector<TelegramStep>& steps) {
  constexpr double cycle_share = 0.25;  // of the steps; three of four may be longer, by losses
  std::vector<double> ipoc;
  double arrivals = 0.0, sum = 0.0;  // which no telegrams change that come late and then all at once
  for (const TelegramStep& s : steps) {
    if (!s.is_newer() || s.arrival > read.options.silence || jump_of(s, usual_scale) > read.options.clock_jump)
      continue;
    ipoc.push_back(static_cast<double>(s.ipoc));
    arrivals += s.arrival;
    sum += ipoc.back();
  }
  if (ipoc.size() < 3) return {};
  return {quantile(std::move(ipoc), cycle_share), arrivals / sum};
}

/// A finding of one kind, counted with its longest time.
class TimedFinding {
 public:
  TimedFinding(LinkFindingKind kind, std::uint64_t of) : finding_{.kind = kind, .of = of} {}
  void add(double when, double time, std::uint64_t count = 1) {
    if (finding_.count == 0) finding_.first = when;
    finding_.count += count;
    finding_.measured_time = std::max(finding_.measured_time.value_or(0.0), time);
  }
  void put(Findings& to) const {
    if (finding_.count > 0) to.push_back(finding_);
  }

 private:
  LinkFinding finding_;
};

void find_rate(const ReadObservations& read, const CycleEstimate& cycle, Findings& to) {
  const double measured = cycle.ipoc * cycle.scale;
  if (measured == 0.0 || std::abs(measured - read.cycle) <= rate_tolerance * read.cycle) return;
  to.push_back({.kind = LinkFindingKind::WrongRate, .measured_time = measured, .expected_time = read.cycle});
}

/// Telegrams that are missing in front of one, where IPOC and arrivals agree.
std::int64_t gap_before(const ReadObservations& read, const TelegramStep& s, const CycleEstimate& cycle) {
  const bool ordinary = s.is_newer() && s.arrival <= read.options.silence &&
                        jump_of(s, cycle.scale) <= read.options.clock_jump && cycle.ipoc > 0;
  return ordinary ? std::max<std::int64_t>(std::llround(static_cast<double>(s.ipoc) / cycle.ipoc) - 1, 0) : 0;
}

/// Of the controller, so that they are missing among its telegrams.
std::int64_t unreadable(const ReadObservations& read) {
  const auto end = read.senders.begin() + static_cast<std::ptrdiff_t>(read.controllers);
  std::int64_t out = 0;
  for (std::size_t i = 0; i < read.faults.size(); ++i)
    out += read.faults[i] != TelegramFault::None && read.faults[i] != TelegramFault::Incomplete &&
           std::find(read.senders.begin(), end, read.seen.exchanges[i].sender) != end;
  return out;
}

/// Telegrams that are lost, come twice or late.
void find_sequence(const ReadObservations& read, const std::vector<TelegramStep>& steps, const CycleEstimate& cycle,
                   Findings& to) {
  std::int64_t missing = 0, repeated = 0, overtaken = 0;
  std::optional<double> first_missing, first_repeated, first_overtaken;
  for (const TelegramStep& s : steps) {
    const std::int64_t gap = gap_before(read, s, cycle);
    if (gap > 0) first_missing = first_missing.value_or(s.time);
    if (s.ipoc == 0) first_repeated = first_repeated.value_or(s.time);
    if (s.ipoc < 0 && !s.back) first_overtaken = first_overtaken.value_or(s.time);
    missing += gap;
    repeated += s.ipoc == 0;
    overtaken += s.ipoc < 0 && !s.back;
  }
  const std::uint64_t of = read.telegrams.size();
  const auto put = [&](LinkFindingKind kind, std::int64_t count, const std::optional<double>& first) {
    if (count <= 0) return;
    const auto found = static_cast<std::uint64_t>(count);
    to.push_back({.kind = kind, .severity = severity_by_share(found, of), .count = found, .of = of, .first = first});
  };
  put(LinkFindingKind::LostTelegrams, missing - overtaken - unreadable(read), first_missing);
  put(LinkFindingKind::RepeatedTelegrams, repeated, first_repeated);
  put(LinkFindingKind::ReorderedTelegrams, overtaken, first_overtaken);
}

void find_jitter(const ReadObservations& read, const std::vector<TelegramStep>& steps, const CycleEstimate& cycle,
                 Findings& to) {
  std::vector<double> deviations;
  for (const TelegramStep& s : steps)
    if (s.is_newer() && s.arrival <= read.options.silence && jump_of(s, cycle.scale) <= read.options.clock_jump)
      deviations.push_back(std::abs(jump_of(s, cycle.scale)));
  const double limit = read.options.jitter * read.cycle, jitter = quantile(deviations, 0.99);
  if (static_cast<int>(deviations.size()) < read.options.min_telegrams || jitter <= limit) return;
  to.push_back({.kind = LinkFindingKind::Jitter,
                .severity = jitter > read.cycle ? FindingSeverity::Fault : FindingSeverity::Caution,
                .of = deviations.size(),
                .measured_time = jitter,
                .expected_time = limit});
}

/// Pauses, restarts and clocks that were set.
void find_breaks(const ReadObservations& read, const std::vector<TelegramStep>& steps, const CycleEstimate& cycle,
                 Findings& to) {
  const std::uint64_t of = read.telegrams.size();
  TimedFinding pauses(LinkFindingKind::Interrupted, of), restarts(LinkFindingKind::ControllerRestarted, of),
      jumps(LinkFindingKind::ControllerClockJump, of);
  for (const TelegramStep& s : steps) {
    const bool pause = s.arrival > read.options.silence;
    const double jump = jump_of(s, cycle.scale);
    if (s.back)
      pause ? restarts.add(s.time, s.arrival) : jumps.add(s.time, std::abs(jump));
    else if (pause)
      pauses.add(s.time, s.arrival);
    if (!s.back && cycle.ipoc > 0 && jump > read.options.clock_jump) jumps.add(s.time, jump);
  }
  pauses.put(to);
  restarts.put(to);
  jumps.put(to);
}

void find_end(const ReadObservations& read, Findings& to) {
  if (read.telegrams.empty()) return;
  const double last = read.telegrams.back().exchange->time;
  if (read.seen.duration - last <= read.options.silence) return;
  to.push_back({.kind = LinkFindingKind::StoppedSending,
                .severity = read.seen.answering ? FindingSeverity::Fault : FindingSeverity::Caution,
                .first = last,
                .measured_time = read.seen.duration - last});
}

void find_set_clock(const ReadObservations& read, Findings& to) {
  const std::vector<Exchange>& all = read.seen.exchanges;
  TimedFinding jumps(LinkFindingKind::ComputerClockJump, all.size());
  for (std::size_t i = 1; i < all.size(); ++i) {
    const double jump = std::abs(all[i].wall_time - all[i - 1].wall_time - (all[i].time - all[i - 1].time));
    if (jump > read.options.clock_jump) jumps.add(all[i].time, jump);
  }
  const std::size_t before = to.size();
  jumps.put(to);
  if (to.size() > before) to.back().severity = FindingSeverity::Caution;  // the link goes by one that does not jump
}

}  // namespace

std::optional<double> measured_cycle(const ReadObservations& read) {
  const CycleEstimate cycle = estimate_cycle(read, steps_of(read));
  return cycle.ipoc > 0 ? std::optional(cycle.ipoc * cycle.scale) : std::nullopt;
}

std::int64_t missing_telegrams(const ReadObservations& read) {
  const std::vector<TelegramStep> steps = steps_of(read);
  const CycleEstimate cycle = estimate_cycle(read, steps);
  std::int64_t out = 0;
  for (const TelegramStep& s : steps) out += gap_before(read, s, cycle);
  return out;
}

Findings timing_findings(const ReadObservations& read) {
  const std::vector<TelegramStep> steps = steps_of(read);
  const CycleEstimate cycle = estimate_cycle(read, steps);
  Findings out;
  find_rate(read, cycle, out);
  find_sequence(read, steps, cycle, out);
  find_jitter(read, steps, cycle, out);
  find_breaks(read, steps, cycle, out);
  find_end(read, out);
  find_set_clock(read, out);
  return out;
}

}  // namespace kr5::rsi
