// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/read_observations.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <kr5/rsi/telegram_codec.hpp>

namespace kr5::rsi {
namespace {

/// Good telegrams of one sender.
struct SenderTimes {
  std::string sender;
  double first = 0.0, last = 0.0;
  std::size_t count = 0;
};

bool is_readable(TelegramFault fault) { return fault == TelegramFault::None || fault == TelegramFault::Incomplete; }

std::vector<SenderTimes> sender_times(const LinkObservations& seen, const std::vector<TelegramFault>& faults) {
  std::map<std::string, SenderTimes> found;
  for (std::size_t i = 0; i < faults.size(); ++i) {
    const Exchange& e = seen.exchanges[i];
    if (!is_readable(faults[i])) continue;
    SenderTimes& of = found.try_emplace(e.sender, SenderTimes{e.sender, e.time, e.time, 0}).first->second;
    of.last = e.time;
    ++of.count;
  }
  std::vector<SenderTimes> out;
  for (const auto& [name, times] : found) out.push_back(times);
  return out;
}

/// The sender of most telegrams is the controller, under each of the ports that it had one after the other; who sends
/// between its telegrams is another.
void assign_senders(std::vector<SenderTimes> all, ReadObservations& read) {
  std::ranges::sort(all, std::greater(), &SenderTimes::count);
  std::vector<SenderTimes> controller;
  std::vector<std::string> others;
  for (const SenderTimes& s : all) {
    const bool alone =
        std::ranges::all_of(controller, [&](const SenderTimes& c) { return s.first > c.last || s.last < c.first; });
    if (alone)
      controller.push_back(s);
    else
      others.push_back(s.sender);
  }
  for (const SenderTimes& s : controller) read.senders.push_back(s.sender);
  read.controllers = controller.size();
  read.senders.insert(read.senders.end(), others.begin(), others.end());
}

bool is_controller(const ReadObservations& read, const std::string& sender) {
  const auto end = read.senders.begin() + static_cast<std::ptrdiff_t>(read.controllers);
  return std::find(read.senders.begin(), end, sender) != end;
}

bool is_whole(const std::string& bytes) {
  return bytes.find("<IPOC>") != bytes.npos &&
         (bytes.find("</Rob>") != bytes.npos || bytes.find("</Sen>") != bytes.npos);
}

}  // namespace

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  std::ranges::sort(values);
  const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size())));
  return values[std::max<std::size_t>(rank, 1) - 1];
}

FindingSeverity severity_by_share(std::uint64_t count, std::uint64_t of) {
  return 100 * count > of ? FindingSeverity::Fault : FindingSeverity::Caution;
}

std::string shown_bytes(const std::string& bytes) {
  constexpr std::size_t longest = 60;
  std::string out = bytes.substr(0, longest);
  for (char& c : out)
    if (c < ' ' || c > '~') c = '.';
  return bytes.size() > longest ? out + "..." : out;
}

ReadObservations read_observations(const LinkObservations& seen, const TelegramLayout& layout,
                                   const DiagnosisOptions& options) {
  options.validate();
  ReadObservations out{.seen = seen, .layout = layout, .options = options};
  out.cycle = options.cycle_of(layout.controller);
  out.deadline = options.deadline.value_or(out.cycle * 10 / 12);
  const TelegramCodec reader(layout, Sender::Controller), answers(layout, Sender::Computer);
  const TelegramUnits units(layout);
  Telegram telegram;
  for (const Exchange& e : seen.exchanges) {
    out.faults.push_back(reader.decode(e.telegram, telegram));
    out.counts.count(out.faults.back());
    if (is_whole(e.telegram)) out.of_telegrams.push_back(&e);
  }
  assign_senders(sender_times(seen, out.faults), out);
  for (std::size_t i = 0; i < out.faults.size(); ++i) {
    const Exchange& e = seen.exchanges[i];
    if (!is_readable(out.faults[i]) || !is_controller(out, e.sender)) continue;
    reader.decode(e.telegram, telegram);
    out.telegrams.push_back({&e, telegram.ipoc, units.state(telegram), out.faults[i] == TelegramFault::None});
    if (!e.answer.empty() && is_readable(answers.decode(e.answer, telegram)))
      out.telegrams.back().correction = units.correction(telegram);
  }
  return out;
}

}  // namespace kr5::rsi
