// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/arrival_findings.hpp"

#include <algorithm>
#include <set>

namespace kr5::rsi {
namespace {

std::uint64_t datagrams(const ReadObservations& read) { return read.seen.exchanges.size(); }

/// Nothing came at all: because it goes to another port, or because it never came here.
void find_absence(const ReadObservations& read, Findings& to) {
  if (datagrams(read) > 0) return;
  const double cycles = read.seen.duration / read.cycle;
  const std::uint64_t elsewhere = read.seen.datagrams_elsewhere.value_or(0);
  const bool to_another = static_cast<double>(elsewhere) > 0.5 * cycles && elsewhere > 0;
  LinkFinding finding{.kind = to_another ? LinkFindingKind::WrongPort : LinkFindingKind::NoTelegrams};
  if (to_another) finding.count = elsewhere;
  finding.measured_time = read.seen.duration;
  finding.found = std::to_string(read.seen.port);
  to.push_back(finding);
}

/// What the layout says of the socket. With telegrams it is a caution: they may pass a router.
void find_other_socket(const ReadObservations& read, Findings& to) {
  const FindingSeverity severity = read.telegrams.empty() ? FindingSeverity::Fault : FindingSeverity::Caution;
  if (read.seen.port != read.layout.port)
    to.push_back({.kind = LinkFindingKind::OtherPort,
                  .severity = FindingSeverity::Caution,
                  .found = std::to_string(read.layout.port),
                  .expected = std::to_string(read.seen.port)});
  if (!read.seen.own_address)
    to.push_back({.kind = LinkFindingKind::OtherAddress, .severity = severity, .found = read.layout.address});
}

/// Datagrams of certain faults, with the first of them; nothing where there are none.
std::optional<LinkFinding> counted(const ReadObservations& read, LinkFindingKind kind, auto&& is_of) {
  LinkFinding out{.kind = kind, .of = datagrams(read)};
  std::set<std::string> senders;
  for (std::size_t i = 0; i < read.faults.size(); ++i) {
    const Exchange& e = read.seen.exchanges[i];
    if (!is_of(i)) continue;
    if (out.count++ == 0) {
      out.first = e.time;
      out.found = shown_bytes(e.telegram);
    }
    senders.insert(e.sender);
  }
  if (out.count == 0) return std::nullopt;
  out.names.assign(senders.begin(), senders.end());
  return out;
}

void find_foreign(const ReadObservations& read, Findings& to) {
  const auto telegram = [&](std::size_t i) { return std::ranges::count(read.of_telegrams, &read.seen.exchanges[i]); };
  const auto foreign = counted(read, LinkFindingKind::ForeignDatagrams, [&](std::size_t i) {
    return (read.faults[i] == TelegramFault::Foreign && !telegram(i)) || read.faults[i] == TelegramFault::Empty;
  });
  if (!foreign) return;
  to.push_back(*foreign);
  if (!read.telegrams.empty()) to.back().severity = FindingSeverity::Caution;
}

void find_damaged(const ReadObservations& read, Findings& to) {
  const auto is_damage = [](TelegramFault f) {
    return f != TelegramFault::None && f != TelegramFault::Incomplete && f != TelegramFault::Foreign &&
           f != TelegramFault::Empty;
  };
  auto damaged =
      counted(read, LinkFindingKind::DamagedTelegrams, [&](std::size_t i) { return is_damage(read.faults[i]); });
  if (!damaged) return;
  damaged->names.clear();
  for (const auto& [fault, name] : enum_names(TelegramFault{}))
    if (is_damage(fault) && std::ranges::count(read.faults, fault) > 0) damaged->names.emplace_back(name);
  damaged->severity = severity_by_share(damaged->count, damaged->of);
  to.push_back(*damaged);
}

void find_second_sender(const ReadObservations& read, Findings& to) {
  if (read.senders.size() == read.controllers) return;
  LinkFinding out{.kind = LinkFindingKind::SecondSender, .of = datagrams(read), .names = {read.senders.front()}};
  out.names.insert(out.names.end(), read.senders.begin() + static_cast<std::ptrdiff_t>(read.controllers),
                   read.senders.end());
  for (std::size_t i = 0; i < read.faults.size(); ++i) {
    const Exchange& e = read.seen.exchanges[i];
    if (std::find(out.names.begin() + 1, out.names.end(), e.sender) == out.names.end()) continue;
    if (out.count++ == 0) out.first = e.time;
  }
  to.push_back(out);
}

}  // namespace

Findings arrival_findings(const ReadObservations& read) {
  Findings out;
  find_absence(read, out);
  find_other_socket(read, out);
  find_foreign(read, out);
  find_damaged(read, out);
  find_second_sender(read, out);
  return out;
}

}  // namespace kr5::rsi
