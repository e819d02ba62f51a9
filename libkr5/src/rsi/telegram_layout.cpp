// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/telegram_layout.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include <kr5/core/error.hpp>

namespace kr5::rsi {
namespace {

using enum Meaning;

constexpr int channels = 64;              // of an Ethernet object
constexpr std::size_t longest_name = 31;  // of an element or attribute

constexpr std::array<std::pair<std::string_view, Meaning>, 24> usual_meanings = {{
    {"RIst", CartesianActual},
    {"RSol", CartesianSetpoint},
    {"AIPos", AxisActual},
    {"ASPos", AxisSetpoint},
    {"EIPos", ExternalActual},
    {"ESPos", ExternalSetpoint},
    {"MACur", MotorCurrent},
    {"MECur", ExternalCurrent},
    {"GearTorque", GearTorque},
    {"AITor", GearTorque},
    {"Delay", LatePackets},
    {"Tech", Technology},
    {"EStr", Message},
    {"ProgStatus", ProgramState},
    {"OvPro", Override},
    {"DiL", DigitalInputs},
    {"DiO", DigitalOutputs},
    {"Stop", StopMove},
    {"RKorr", CartesianCorrection},
    {"AKorr", AxisCorrection},
    {"AK", AxisCorrection},
    {"EKorr", ExternalCorrection},
    {"EK", ExternalCorrection},
    {"FT", SensorWrench},
}};

bool is_name(std::string_view text) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const auto inner = [&](char c) { return letter(c) || (c >= '0' && c <= '9') || c == '-'; };
  return !text.empty() && text.size() <= longest_name && letter(text.front()) && std::ranges::all_of(text, inner);
}

bool is_cartesian(Meaning meaning) {
  return meaning == CartesianActual || meaning == CartesianSetpoint || meaning == CartesianCorrection;
}

bool is_of_axes(Meaning meaning) {
  switch (meaning) {
    case AxisActual:
    case AxisSetpoint:
    case ExternalActual:
    case ExternalSetpoint:
    case MotorCurrent:
    case ExternalCurrent:
    case GearTorque:
    case AxisCorrection:
    case ExternalCorrection:
      return true;
    default:
      return false;
  }
}

/// The six components of a wrench; -1 for none.
int wrench_component(std::string_view attribute) {
  constexpr std::array<std::string_view, 6> names = {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"};
  const auto* const found = std::ranges::find(names, attribute);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

/// What the attributes of a meaning with several components are called.
std::string attribute_names(Meaning meaning) {
  if (is_cartesian(meaning)) return "X, Y, Z, A, B or C";
  return meaning == SensorWrench ? "Fx, Fy, Fz, Tx, Ty or Tz" : "that ends in 1 to 6";
}

/// Which component an attribute is: X Y Z A B C, Fx to Tz, or the digit at its end; -1 for none.
int component_of(Meaning meaning, std::string_view attribute) {
  if (is_cartesian(meaning)) {
    const std::size_t at = attribute.size() == 1 ? std::string_view("XYZABC").find(attribute) : std::string_view::npos;
    return at == std::string_view::npos ? -1 : static_cast<int>(at);
  }
  if (meaning == SensorWrench) return wrench_component(attribute);
  if (!is_of_axes(meaning)) return 0;
  const char last = attribute.empty() ? '0' : attribute.back();
  return last >= '1' && last <= '6' ? last - '1' : -1;
}

std::vector<std::string> numbered(const std::string& letters, int count) {
  std::vector<std::string> out;
  for (int i = 1; i <= count; ++i) out.push_back(letters + std::to_string(i));
  return out;
}

/// Attributes of an internal element; nothing for a text.
std::vector<std::string> internal_attributes(const TelegramElement& element, std::string_view name) {
  switch (usual_meaning(name)) {
    case CartesianActual:
    case CartesianSetpoint:
      return {"X", "Y", "Z", "A", "B", "C"};
    case AxisActual:
    case AxisSetpoint:
    case MotorCurrent:
      return numbered("A", 6);
    case ExternalActual:
    case ExternalSetpoint:
    case ExternalCurrent:
      return numbered("E", 6);
    case LatePackets:
      return {"D"};
    case Message:
      return {};
    default:
      if (name == "MAPos") return numbered("A", 6);  // motor angles, handed on under their names
      if (name == "MEPos") return numbered("E", 6);
      throw InvalidArgument(element.tag +
                            ": not known as an internal element; expected DEF_RIst, DEF_RSol, DEF_AIPos, DEF_ASPos, "
                            "DEF_EIPos, DEF_ESPos, DEF_MACur, DEF_MECur, DEF_MAPos, DEF_MEPos, DEF_Delay, DEF_EStr, "
                            "DEF_Tech.C1 or .T1 to 6");
  }
}

/// The values of one element, with its name in front of each.
std::vector<TelegramField> fields_of(const TelegramElement& e) {
  constexpr std::string_view internal = "DEF_";
  const bool defined = e.tag.starts_with(internal);
  const std::string name = defined ? e.tag.substr(internal.size()) : e.tag;
  const std::size_t dot = name.find('.');
  TelegramField field{name.substr(0, dot), dot == name.npos ? "" : name.substr(dot + 1), e.type};
  field.meaning = e.meaning.value_or(usual_meaning(field.element));
  require(is_name(field.element) && (dot == name.npos || is_name(field.attribute)),
          e.tag + ": is no name of an element, or of an element and an attribute, of at most 31 characters each");
  require(field.element != "IPOC", e.tag + ": IPOC belongs to every telegram and is not listed");
  std::vector<std::string> attributes = {field.attribute};
  if (defined && dot != name.npos) {
    const std::string& g = field.attribute;
    require(field.element == "Tech" && g.size() == 2 && (g[0] == 'C' || g[0] == 'T') && g[1] >= '1' && g[1] <= '6',
            e.tag + ": expected DEF_Tech.C1 to C6 or DEF_Tech.T1 to T6");
    attributes = numbered(g, 10);
  } else if (defined) {
    attributes = internal_attributes(e, field.element);
    if (attributes.empty()) attributes = {""};
  }
  std::vector<TelegramField> out;
  for (const std::string& attribute : attributes) {
    field.attribute = attribute;
    field.component = component_of(field.meaning, attribute);
    require(field.component >= 0, e.tag + ": a " + std::string(name_of(field.meaning)) + " needs an attribute " +
                                      attribute_names(field.meaning));
    out.push_back(field);
  }
  return out;
}

void check_elements(const std::vector<TelegramElement>& elements, const std::string& where) {
  std::set<int> used;
  for (const TelegramElement& e : elements) {
    const bool internal = e.tag.starts_with("DEF_");
    require(internal == !e.index, where + ": " + e.tag + ": elements DEF_... are internal, all others have an index");
    if (!e.index) continue;
    require(*e.index >= 1 && *e.index <= channels, where + ": " + e.tag + ": the index must lie between 1 and 64");
    require(used.insert(*e.index).second, where + ": " + e.tag + ": its index belongs to another element");
  }
  telegram_fields(elements);
}

TelegramElement internal(std::string tag, ValueType type = ValueType::Double) { return {std::move(tag), type}; }

void add_channels(std::vector<TelegramElement>& to, const std::string& element, const std::vector<std::string>& names,
                  bool hold, int first) {
  for (const std::string& name : names) to.push_back({.tag = element + "." + name, .index = first++, .hold = hold});
}

}  // namespace

Meaning usual_meaning(std::string_view element) noexcept {
  for (const auto& [name, meaning] : usual_meanings)
    if (name == element) return meaning;
  return Other;
}

std::vector<TelegramField> telegram_fields(const std::vector<TelegramElement>& elements) {
  std::vector<std::vector<TelegramField>> joined;
  std::set<std::pair<std::string, std::string>> seen;
  for (const TelegramElement& e : elements)
    for (TelegramField& field : fields_of(e)) {
      require(seen.emplace(field.element, field.attribute).second, e.tag + ": is listed twice");
      const auto same = std::ranges::find_if(joined, [&](const auto& g) { return g[0].element == field.element; });
      require(same == joined.end() || (!field.attribute.empty() && !same->front().attribute.empty()),
              e.tag + ": an element has a text or attributes, not both");
      (same == joined.end() ? joined.emplace_back() : *same).push_back(std::move(field));
    }
  std::vector<TelegramField> out;
  for (const auto& group : joined) out.insert(out.end(), group.begin(), group.end());
  require(out.size() <= max_values, "the telegram has more than 160 values");
  return out;
}

void TelegramLayout::validate() const {
  require(!address.empty(), "address: must not be empty");
  require(port >= 1 && port <= 65535, "port: must lie between 1 and 65535");
  require(transport == Transport::Udp || controller == Controller::Krc2, "transport: TCP is that of a KR C2 alone");
  require(is_name(sensor_type), "sensor_type: must be a name of letters and digits, at most 31");
  require(decimals >= 1 && decimals <= 9, "decimals: must lie between 1 and 9");
  require(externals >= 0 && externals <= 6, "externals: must lie between 0 and 6");
  for (const int axis : linear_externals)
    require(axis >= 1 && axis <= 6, "linear_externals: external axes are numbered from 1 to 6");
  require(current_units.size() <= 12, "current_units: at most six axes and six external ones");
  for (const double unit : current_units) require(std::isfinite(unit), "current_units: must be finite [A]");
  for (const int bit : {gripper.hold, gripper.air, gripper.fingers.value_or(0), gripper.gripped.value_or(0)})
    require(bit >= 0 && bit <= 31, "gripper: bits are numbered from 0 to 31");
  if (axes) axes->validate(6 + externals);
  check_elements(send, "send");
  check_elements(receive, "receive");
}

TelegramLayout usual_layout(Controller controller, CorrectionSpace space) {
  TelegramLayout out;
  out.controller = controller;
  for (const char* tag : {"DEF_RIst", "DEF_RSol", "DEF_AIPos", "DEF_ASPos", "DEF_MACur"})
    out.send.push_back(internal(tag));
  out.send.push_back(internal("DEF_Delay", ValueType::Long));
  if (space == CorrectionSpace::Axes)
    add_channels(out.receive, "AKorr", numbered("A", 6), true, 1);
  else
    add_channels(out.receive, "RKorr", {"X", "Y", "Z", "A", "B", "C"}, true, 1);
  out.receive.push_back({.tag = "DiO", .type = ValueType::Long, .index = 7, .hold = true});
  return out;
}

TelegramLayout job_layout(Controller controller) {
  TelegramLayout out = usual_layout(controller, CorrectionSpace::Cartesian);
  int channel = 0;
  for (const char* name : {"Fx", "Fy", "Fz", "Tx", "Ty", "Tz"})
    out.send.push_back({.tag = std::string("FT.") + name, .index = ++channel});
  out.send.push_back({.tag = "DiL", .type = ValueType::Long, .index = ++channel});
  out.send.push_back({.tag = "ProgStatus", .type = ValueType::Long, .index = ++channel});
  out.receive.push_back({.tag = "Stop", .type = ValueType::Bool, .index = 8, .hold = true});
  out.gripper.gripped = 0;
  out.gripper.fingers = 2;
  return out;
}

TelegramLayout book_layout() {
  TelegramLayout out;
  out.controller = Controller::Krc2;
  out.port = 6008;
  out.transport = Transport::Tcp;
  for (const char* tag :
       {"DEF_RIst", "DEF_RSol", "DEF_AIPos", "DEF_ASPos", "DEF_EIPos", "DEF_ESPos", "DEF_MACur", "DEF_MECur"})
    out.send.push_back(internal(tag));
  out.send.push_back(internal("DEF_Delay", ValueType::Long));
  out.send.push_back(internal("DEF_Tech.C1"));
  out.send.push_back({.tag = "DiL", .type = ValueType::Long, .index = 1});
  for (int i = 1; i <= 3; ++i)
    out.send.push_back({.tag = "Digout.o" + std::to_string(i), .type = ValueType::Bool, .index = 1 + i});
  out.send.push_back({.tag = "ST_Source", .index = 5, .unit = "3601"});
  out.receive.push_back(internal("DEF_EStr", ValueType::String));
  add_channels(out.receive, "RKorr", {"X", "Y", "Z", "A", "B", "C"}, true, 1);
  add_channels(out.receive, "AKorr", numbered("A", 6), false, 7);
  out.receive.push_back(internal("DEF_Tech.T2"));
  out.receive.push_back({.tag = "DiO", .type = ValueType::Long, .index = 19, .hold = true});
  return out;
}

}  // namespace kr5::rsi
