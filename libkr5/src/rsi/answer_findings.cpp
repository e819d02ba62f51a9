// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/answer_findings.hpp"

#include <algorithm>
#include <cmath>

#include "rsi/timing_findings.hpp"

namespace kr5::rsi {
namespace {

/// What stands between two texts; nothing where they are not there.
std::string between(const std::string& bytes, const std::string& before, const std::string& after) {
  const std::size_t begin = bytes.find(before);
  if (begin == bytes.npos) return {};
  const std::size_t end = bytes.find(after, begin + before.size());
  return end == bytes.npos ? std::string() : bytes.substr(begin + before.size(), end - begin - before.size());
}

std::uint64_t answers_of(const ReadObservations& read) {
  return static_cast<std::uint64_t>(
      std::ranges::count_if(read.telegrams, [](const ReadTelegram& t) { return !t.exchange->answer.empty(); }));
}

bool is_late(const ReadTelegram& t, double deadline) {
  return t.exchange->answer.empty() || t.exchange->duration.value_or(0.0) > deadline;
}

void find_late(const ReadObservations& read, Findings& to) {
  LinkFinding out{.kind = LinkFindingKind::LateAnswers, .of = answers_of(read), .expected_time = read.deadline};
  std::vector<double> durations;
  for (const ReadTelegram& t : read.telegrams) {
    if (t.exchange->answer.empty()) continue;
    durations.push_back(t.exchange->duration.value_or(0.0));
    if (durations.back() <= read.deadline) continue;
    if (out.count++ == 0) out.first = t.exchange->time;
  }
  if (out.count == 0) return;
  out.measured_time = quantile(std::move(durations), 0.99);
  out.severity = severity_by_share(out.count, out.of);
  to.push_back(out);
}

/// A part of the answers that is not what it should be.
void find_wrong_part(const ReadObservations& read, LinkFindingKind kind, auto&& found, auto&& expected, Findings& to) {
  LinkFinding out{.kind = kind, .of = answers_of(read), .names = {"answers"}};
  for (const ReadTelegram& t : read.telegrams) {
    if (t.exchange->answer.empty() || found(t) == expected(t)) continue;
    if (out.count++ > 0) continue;
    out.first = t.exchange->time;
    out.found = found(t);
    out.expected = expected(t);
  }
  if (out.count > 0) to.push_back(out);
}

/// The controller counts more answers as late than those that were, or that it got none for.
void find_rejected(const ReadObservations& read, Findings& to) {
  double counted = 0.0;
  std::uint64_t late = 0, in_time = 0;
  LinkFinding out{.kind = LinkFindingKind::AnswersRejected};
  for (std::size_t i = 0; i + 1 < read.telegrams.size(); ++i) {
    const ReadTelegram &t = read.telegrams[i], &next = read.telegrams[i + 1];
    if (!t.state.late_packets || !next.state.late_packets) continue;
    const double more = *next.state.late_packets - *t.state.late_packets;
    if (more > 0 && !out.first) out.first = next.exchange->time;
    counted += std::max(more, 0.0);  // it begins at 0 with each program
    is_late(t, read.deadline) ? ++late : ++in_time;
  }
  const double rejected = counted - static_cast<double>(late) - static_cast<double>(missing_telegrams(read));
  if (rejected < 1 + 0.01 * static_cast<double>(in_time) || in_time == 0) return;
  out.count = static_cast<std::uint64_t>(std::llround(rejected));
  out.of = in_time;
  to.push_back(out);
}

}  // namespace

Findings answer_findings(const ReadObservations& read) {
  Findings out;
  find_late(read, out);
  find_wrong_part(
      read, LinkFindingKind::WrongType,
      [](const ReadTelegram& t) { return between(t.exchange->answer, "Type=\"", "\""); },
      [&](const ReadTelegram&) { return read.layout.sensor_type; }, out);
  find_wrong_part(
      read, LinkFindingKind::IpocNotEchoed,
      [](const ReadTelegram& t) { return between(t.exchange->answer, "<IPOC>", "</IPOC>"); },
      [](const ReadTelegram& t) { return std::string(t.ipoc.text()); }, out);
  find_rejected(read, out);
  return out;
}

}  // namespace kr5::rsi
