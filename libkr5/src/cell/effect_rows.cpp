// SPDX-License-Identifier: BSD-3-Clause
#include "cell/effect_rows.hpp"

#include <algorithm>
#include <array>
#include <charconv>

#include <kr5/core/error.hpp>
#include <kr5/io/diagnostic.hpp>

#include "cell/check/diagnostic_collector.hpp"

namespace kr5::cell {
namespace {

constexpr std::array<const char*, 6> wrench_names = {"fx", "fy", "fz", "tx", "ty", "tz"};
constexpr int most_joints = 100;

bool counted(EffectTarget kind) { return kind == EffectTarget::Joint || kind == EffectTarget::Motor; }

/// The rows of the library, then those that were registered.
std::deque<Effect>& all_rows() {
  // Never destroyed: a registered law may belong to an interpreter that is gone by then.
  static auto* const all = [] {
    auto* const out = new std::deque<Effect>;
    for (const auto& part : {drive_rows(), servo_rows(), arm_rows(), sensor_rows(), task_rows()})
      for (const Effect& row : part) out->push_back(completed(row));
    return out;
  }();
  return *all;
}

}  // namespace

Effect completed(Effect row) {
  for (EffectParameter& p : row.parameters) {
    p.nominal_when_off = static_cast<bool>(p.nominal);
    if (!p.size && p.usual_size > 0) p.size = [size = p.usual_size](const EffectSite&) { return size; };
    if (p.nominal_when_off || !p.off.empty()) continue;
    const std::size_t size = p.kind == EffectValueKind::Vector3 ? 3 : p.kind == EffectValueKind::Vector2 ? 2 : 1;
    p.off.assign(size, 0.0);
  }
  return row;
}

const std::deque<Effect>& effect_rows() { return all_rows(); }

void add_row(Effect row) { all_rows().push_back(std::move(row)); }

void remove_row(const std::string& id) {
  std::erase_if(all_rows(), [&](const Effect& row) { return row.id == id; });
}

const Effect* find_row(std::string_view id) {
  const auto& rows = effect_rows();
  const auto found = std::find_if(rows.begin(), rows.end(), [&](const Effect& r) { return r.id == id; });
  return found == rows.end() ? nullptr : &*found;
}

const Effect& required_row(std::string_view id) {
  if (const Effect* row = find_row(id)) return *row;
  std::vector<std::string> known;
  for (const Effect& row : effect_rows()) known.push_back(row.id);
  const std::string near = io::nearest_name(std::string(id), known);
  throw InvalidArgument("no effect '" + std::string(id) + "'; " +
                        (near.empty() ? "there are " + listed(known) : "did you mean '" + near + "'?"));
}

const EffectParameter& required_parameter(const Effect& row, std::string_view parameter) {
  std::vector<std::string> known;
  for (const EffectParameter& p : row.parameters) {
    if (p.name == parameter) return p;
    known.push_back(p.name);
  }
  throw InvalidArgument("the effect '" + row.id + "' has no parameter '" + std::string(parameter) + "'; there are " +
                        listed(known));
}

int required_index(const Effect& row, const std::string& target) {
  const int index = target_index(row.target, target);
  require(index >= 0, "the effect '" + row.id + "' sits on " + target_text(row.target) + ", found '" + target + "'");
  return index;
}

int target_index(EffectTarget kind, const std::string& target) {
  if (kind == EffectTarget::WrenchComponent) {
    const auto found = std::find(wrench_names.begin(), wrench_names.end(), target);
    return found == wrench_names.end() ? -1 : static_cast<int>(found - wrench_names.begin());
  }
  const std::string name(name_of(kind));
  if (!counted(kind)) return target == name ? 0 : -1;
  int number = 0;
  const char* end = target.data() + target.size();
  if (!target.starts_with(name) || target.size() == name.size()) return -1;
  const auto [stop, error] = std::from_chars(target.data() + name.size(), end, number);
  const bool plain = error == std::errc{} && stop == end && number >= 1 && number <= most_joints;
  return plain && target == target_name(kind, number - 1) ? number - 1 : -1;
}

std::string target_name(EffectTarget kind, int index) {
  if (kind == EffectTarget::WrenchComponent) return wrench_names.at(static_cast<std::size_t>(index));
  const std::string name(name_of(kind));
  return counted(kind) ? name + std::to_string(index + 1) : name;
}

std::string target_text(EffectTarget kind) {
  if (kind == EffectTarget::WrenchComponent) return "fx | fy | fz | tx | ty | tz";
  const std::string name(name_of(kind));
  return counted(kind) ? name + "1, " + name + "2, ..." : name;
}

int target_count(EffectTarget kind, const Cell& cell) {
  if (counted(kind)) return cell.robot.joints();
  return kind == EffectTarget::WrenchComponent ? static_cast<int>(wrench_names.size()) : 1;
}

}  // namespace kr5::cell
