// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/arm_log/column_words.hpp>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>
#include <string_view>

#include <kr5/io/column_unit.hpp>

namespace kr5::arm_log {
namespace {

using Words = std::set<std::string>;

/// What tells a quantity; of several in one name the first of this order is meant.
const std::vector<std::pair<ColumnWord, Words>> word_lists = {
    {ColumnWord::Velocity, {"v", "vel", "velocity", "velocities", "speed", "speeds", "qd", "dq", "qdot", "rate"}},
    {ColumnWord::Effort,
     {"tau", "taum", "torque", "torques", "eff", "effort", "efforts", "trq", "moment", "force", "forces", "mom"}},
    {ColumnWord::Current, {"i", "cur", "curr", "current", "currents", "amp", "amps", "strom", "ma"}},
    {ColumnWord::Acceleration, {"acc", "accel", "acceleration", "accelerations", "qdd", "ddq", "qddot"}},
    {ColumnWord::Position,
     {"q", "qm", "theta", "pos", "position", "positions", "angle", "angles", "joint", "axis", "j", "deg", "rad"}},
    {ColumnWord::Command,
     {"c", "qc", "cmd", "command", "commanded", "commands", "des", "desired", "target", "ref", "reference", "set",
      "setpoint", "setpoints", "soll", "goal", "trajectory", "action", "actions"}},
    {ColumnWord::Measured,
     {"act", "actual", "meas", "measured", "ist", "state", "states", "feedback", "fb", "real", "observation",
      "observations", "obs"}},
    {ColumnWord::Other,
     {"ext",    "external",    "error",     "err",   "diff",   "std",      "temp",   "temperature",  "temperatur",
      "status", "mode",        "cartesian", "eef",   "tcp",    "computed", "prev",   "previous",     "gripper",
      "env",    "environment", "sin",       "cos",   "enable", "enabled",  "model",  "limit",        "limits",
      "min",    "max",         "voltage",   "brake", "stamp",  "seq",      "header", "effectiveness"}}};

/// Words that tell a quantity only where nothing else does: they may as well be those of a joint, a unit, a message.
const Words vague_words = {"joint", "axis", "j", "deg", "rad", "rate", "c", "v", "i", "ma"};
const Words motor_words = {"qm", "taum", "motor", "rotor"};
const Words publisher_words = {"state", "states"};  // of messages, which hold commands, too
const std::map<std::string, std::string> run_together = {
    {"qcmd", "qc"}, {"qdes", "qc"}, {"qref", "qc"}, {"qset", "qc"}, {"qsoll", "qc"},
    {"qact", "q"},  {"qmeas", "q"}, {"qist", "q"},  {"qpos", "q"},  {"qvel", "qd"}};
const std::map<std::string, std::string> unit_words = {{"deg", "deg"},   {"rad", "rad"}, {"ma", "mA"},
                                                       {"mm", "mm"},     {"nm", "N m"},  {"nmm", "N mm"},
                                                       {"percent", "%"}, {"pct", "%"},   {"%", "%"}};
const Words gripper_words = {"gripper", "finger", "jaw", "claw"};  // parts of words
const Words time_names = {"t",    "time",     "timestamp", "stamp",   "clock", "zeit",
                          "date", "datetime", "utc",       "seconds", "sec"};
const Words short_time_units = {"s", "ms", "us", "ns"};

bool is_small(char c) { return c >= 'a' && c <= 'z'; }
bool is_capital(char c) { return c >= 'A' && c <= 'Z'; }

std::string small_letters(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

/// Letters of the word that begins at a place of a name; 0 where none does.
std::size_t word_length(const std::string& name, std::size_t at) {
  const auto letter = [&](std::size_t k) { return k < name.size() ? name[k] : '\0'; };
  if (letter(at) == '#' || letter(at) == '%') return 1;
  if (letter(at) == 'm' && letter(at + 1) == 'A' && !is_small(letter(at + 2))) return 2;  // milliamperes
  std::size_t end = at;
  while (is_capital(letter(end))) ++end;
  if (end > at && !is_small(letter(end))) return end - at;  // all capitals
  if (end > at + 1) return end - at - 1;                    // up to the capital that begins the next word
  while (is_small(letter(end))) ++end;
  return end - at;
}

Words word_set(const std::string& part) {
  const std::vector<std::string> words = words_of(part);
  Words out(words.begin(), words.end());
  out.erase("#");
  return out;
}

/// A stem as it widens: the field, with the last part of its topic, all of it. A topic ends with a colon, or in an
/// export with the last but one of the parts between slashes.
std::vector<std::string> widening_parts(const std::string& stem) {
  if (const std::size_t colon = stem.rfind(':'); colon != std::string::npos) {
    const std::string topic = stem.substr(0, colon), field = stem.substr(colon + 1);
    return {field, topic.substr(topic.rfind('/') + 1) + ":" + field, stem};
  }
  std::vector<std::string> parts;
  for (std::size_t from = 0, to = 0; to != std::string::npos; from = to + 1) {
    to = stem.find('/', from);
    const std::string part = stem.substr(from, to == std::string::npos ? to : to - from);
    if (part.find_first_not_of("[]._# ") != std::string::npos) parts.push_back(part);
  }
  if (parts.size() < 2) return {stem};
  return {parts.back(), parts[parts.size() - 2] + "/" + parts.back(), stem};
}

bool holds(const Words& words, ColumnWord meaning) {
  return std::ranges::any_of(words, [&](const std::string& word) { return meaning_of(word) == meaning; });
}

ColumnFamily family_of_words(const Words& words, bool command) {
  const auto unless_commanded = [&](ColumnFamily family) { return command ? ColumnFamily::None : family; };
  if (holds(words, ColumnWord::Velocity)) return unless_commanded(ColumnFamily::Velocity);
  if (holds(words, ColumnWord::Effort)) return unless_commanded(ColumnFamily::Effort);
  if (holds(words, ColumnWord::Current)) return unless_commanded(ColumnFamily::Current);
  if (holds(words, ColumnWord::Acceleration)) return ColumnFamily::None;
  if (command) return ColumnFamily::Command;
  const bool only_measured =
      std::ranges::all_of(words, [](const std::string& word) { return meaning_of(word) == ColumnWord::Measured; });
  return holds(words, ColumnWord::Position) || only_measured ? ColumnFamily::Position : ColumnFamily::None;
}

Words without_vague(Words words) {
  for (const std::string& word : vague_words) words.erase(word);
  return words;
}

bool is_command(const std::vector<Words>& levels) {
  for (const Words& words : levels) {
    if (!holds(words, ColumnWord::Command) && !holds(words, ColumnWord::Measured)) continue;
    const bool measured = std::ranges::any_of(words, [](const std::string& word) {
      return meaning_of(word) == ColumnWord::Measured && !publisher_words.contains(word);
    });
    return holds(words, ColumnWord::Command) && !measured;
  }
  return false;
}

/// Whether a text ends in the name of a time, which is a word of its own or follows `bag`.
bool ends_in_time(std::string_view text) {
  return std::ranges::any_of(time_names, [&](const std::string& word) {
    if (!text.ends_with(word)) return false;
    const std::string_view before = text.substr(0, text.size() - word.size());
    return before.empty() || !is_small(before.back()) || before.ends_with("bag");
  });
}

std::string_view without_last(std::string_view text, std::string_view any_of) {
  return !text.empty() && any_of.find(text.back()) != std::string_view::npos ? text.substr(0, text.size() - 1) : text;
}

}  // namespace

ColumnWord meaning_of(const std::string& word) {
  for (const auto& [meaning, words] : word_lists)
    if (words.contains(word)) return meaning;
  return ColumnWord::None;
}

std::vector<std::string> words_of(const std::string& name) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at < name.size();) {
    const std::size_t length = word_length(name, at);
    if (length > 0) {
      const std::string word = small_letters(name.substr(at, length));
      const auto merged = run_together.find(word);
      out.push_back(merged == run_together.end() ? word : merged->second);
    }
    at += std::max<std::size_t>(length, 1);
  }
  return out;
}

ColumnFamily family_of(const std::string& stem) {
  std::vector<Words> levels;
  for (const std::string& part : widening_parts(stem)) levels.push_back(word_set(part));
  if (holds(levels.size() > 1 ? levels[levels.size() - 2] : levels.back(), ColumnWord::Other))
    return ColumnFamily::None;
  const bool command = is_command(levels);
  for (std::size_t k = 0; k + 1 < levels.size(); ++k) {
    const Words clear = without_vague(levels[k]);
    for (const ColumnWord quantity : {ColumnWord::Velocity, ColumnWord::Effort, ColumnWord::Current,
                                      ColumnWord::Acceleration, ColumnWord::Position})
      if (holds(clear, quantity)) return family_of_words(clear, command);
  }
  return family_of_words(levels.back(), command);
}

bool on_motor_side(const std::string& stem) {
  const Words words = word_set(stem);
  return family_of(stem) != ColumnFamily::Current &&
         std::ranges::any_of(motor_words, [&](const std::string& word) { return words.contains(word); });
}

std::string unit_in(const std::string& stem) {
  for (const std::string& word : words_of(stem))
    if (const auto unit = unit_words.find(word); unit != unit_words.end()) return unit->second;
  return "";
}

bool names_gripper(const std::string& name) {
  const std::string text = small_letters(name);
  return std::ranges::any_of(gripper_words,
                             [&](const std::string& word) { return text.find(word) != std::string::npos; });
}

bool names_time(const std::string& name) {
  const std::string small = small_letters(name.substr(name.rfind(':') + 1));
  const std::size_t first = small.find_first_not_of("% ");
  if (first == std::string::npos) return false;
  const std::string_view text = std::string_view(small).substr(first, small.find_last_not_of("% ") - first + 1);
  if (ends_in_time(text)) return true;
  const std::string_view open = without_last(text, "])");
  return std::ranges::any_of(short_time_units, [&](const std::string& unit) {
    if (!open.ends_with(unit)) return false;
    const std::string_view bare = without_last(open.substr(0, open.size() - unit.size()), "[(");
    return ends_in_time(bare) || ends_in_time(without_last(bare, "_ "));
  });
}

std::string time_unit_in(const std::string& name) {
  const std::string text = small_letters(std::string(without_last(name, "])")));
  const std::size_t before = text.find_last_of("_[( \t");
  if (before == std::string::npos) return "";
  const io::ColumnUnit* unit = io::find_unit(text.substr(before + 1));
  return unit && unit->quantity == "time" ? unit->name : "";
}

}  // namespace kr5::arm_log
