// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/layout_settings.hpp>

#include <kr5/core/error.hpp>
#include <kr5/io/fields.hpp>

namespace kr5::rsi {
namespace {

/// The element of a tag: "Force" of "Force.Fx" and "DEF_Force".
std::string_view name_of_tag(std::string_view tag) {
  constexpr std::string_view internal = "DEF_";
  if (tag.starts_with(internal)) tag.remove_prefix(internal.size());
  return tag.substr(0, tag.find('.'));
}

/// Whether an element of this name was there.
bool set_meaning(std::vector<TelegramElement>& elements, const std::string& name, Meaning meaning) {
  bool found = false;
  for (TelegramElement& e : elements) {
    if (e.tag != name && name_of_tag(e.tag) != name) continue;
    e.meaning = meaning;
    found = true;
  }
  return found;
}

std::string names_of(const TelegramLayout& layout) {
  std::string out;
  for (const auto* elements : {&layout.send, &layout.receive})
    for (const TelegramElement& e : *elements) out += (out.empty() ? "" : ", ") + e.tag;
  return out;
}

}  // namespace

LayoutSettings load_layout_settings(const std::filesystem::path& file) {
  LayoutSettings out = io::load<LayoutSettings>(file);
  if (out.format != LayoutSettings().format)
    throw IoError(file.string() + ": format: found '" + out.format + "', expected " + LayoutSettings().format);
  return out;
}

TelegramLayout with_settings(const TelegramLayout& layout, const LayoutSettings& settings) {
  TelegramLayout out = layout;
  if (settings.axes) out.axes = settings.axes;
  if (!settings.current_units.empty()) out.current_units = settings.current_units;
  if (settings.gripper) out.gripper = *settings.gripper;
  if (!settings.linear_externals.empty()) out.linear_externals = settings.linear_externals;
  for (const auto& [name, meaning] : settings.meanings) {
    const bool sent = set_meaning(out.send, name, meaning), received = set_meaning(out.receive, name, meaning);
    require(sent || received, "meanings." + name + ": the layout has no such element; it has " + names_of(layout));
  }
  out.validate();
  return out;
}

}  // namespace kr5::rsi
