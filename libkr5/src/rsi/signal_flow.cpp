// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/signal_flow.hpp"

#include <algorithm>

#include "rsi/number_text.hpp"
#include "rsi/wire_units.hpp"

namespace kr5::rsi {
namespace {

constexpr double wide = 1.2;  // a monitor, which stops the program, lies beyond the limit, which holds the correction

/// What is wired to the channels of one meaning: an object with an input a component.
struct Wiring {
  SignalFlow& flow;
  const std::vector<TelegramElement>& elements;

  /// Elements of a meaning with their component, in the order of the layout.
  std::vector<std::pair<int, const TelegramElement*>> of(Meaning meaning) const {
    std::vector<std::pair<int, const TelegramElement*>> out;
    for (const TelegramElement& e : elements) {
      if (!e.index) continue;
      const TelegramField field = telegram_fields({e}).front();
      if (field.meaning == meaning) out.emplace_back(field.component, &e);
    }
    return out;
  }
};

SignalParameter limit(const std::string& name, int number, int number_rsi3, double value) {
  return {name, number, number_rsi3, number_text(value)};
}

const std::string ethernet_id = "ETHERNET1";

void add_corrected_axes(const Wiring& wiring, Meaning meaning, const SignalObject& object, char letter, double most,
                        int first) {
  SignalObject out = object;
  for (const auto& [component, element] : wiring.of(meaning)) {
    out.inputs.push_back({component, ethernet_id, *element->index - 1});
    const std::string axis = letter + std::to_string(component + 1);
    const bool external = letter == 'E';
    out.parameters.push_back(limit("LowerLim" + axis, component, first + component, -most));
    out.parameters.push_back(limit("UpperLim" + axis, component + 6, first + 12 + component, most));
    if (external && std::ranges::find(wiring.flow.unconfirmed, object.id) == wiring.flow.unconfirmed.end())
      wiring.flow.unconfirmed.push_back(object.id);
  }
  if (!out.inputs.empty()) wiring.flow.objects.push_back(out);
}

void add_axis_monitor(const Wiring& wiring, const ProgramOptions& options) {
  const bool axes = !wiring.of(Meaning::AxisCorrection).empty();
  const bool externals = !wiring.of(Meaning::ExternalCorrection).empty();
  if (!axes && !externals) return;
  SignalObject out{"AxisCorrMon", 82, "AXISCORRMON1"};
  for (int i = 0; i < 12; ++i) {
    const bool external = i >= 6;
    const bool used = external ? externals : axes;
    const double most = wide * (external ? options.external_limit / millimetre : options.axis_limit / degree);
    out.parameters.push_back(
        limit("Max" + std::string(external ? "E" : "A") + std::to_string(i % 6 + 1), i, i + 1, used ? most : 6.0));
  }
  wiring.flow.objects.push_back(out);
}

void add_corrected_pose(const Wiring& wiring, const ProgramOptions& options, bool rsi3) {
  SignalObject out{"PosCorr", 27, "POSCORR1"};
  for (const auto& [component, element] : wiring.of(Meaning::CartesianCorrection))
    out.inputs.push_back({component, ethernet_id, *element->index - 1});
  if (out.inputs.empty()) return;
  int number = 0;
  for (const char* name : {"LowerLimX", "LowerLimY", "LowerLimZ", "UpperLimX", "UpperLimY", "UpperLimZ"}) {
    const double most = options.translation_limit / millimetre;
    out.parameters.push_back(limit(name, number, number + 1, number < 3 ? -most : most));
    ++number;
  }
  out.parameters.push_back(limit("MaxRotAngle", 6, 7, options.rotation_limit / degree));
  const bool tool = options.frame == robot::CommandFrame::Tool;
  out.parameters.push_back({"RefCorrSys", 0, 1, tool ? "3" : "1", false});  // World, Base, RobRoot, Tool, TTS
  SignalObject monitor{"PosCorrMon", 81, "POSCORRMON1"};
  monitor.parameters = {limit("MaxTrans", 0, 1, 2 * wide * options.translation_limit / millimetre),
                        limit("MaxRotAngle", 1, 2, wide * options.rotation_limit / degree)};
  if (rsi3) wiring.flow.unconfirmed.insert(wiring.flow.unconfirmed.end(), {out.id, monitor.id});
  wiring.flow.objects.insert(wiring.flow.objects.end(), {out, monitor});
}

/// Objects of one input each.
void add_sinks(const Wiring& wiring) {
  for (const auto& [component, element] : wiring.of(Meaning::DigitalOutputs)) {
    SignalObject out{"Map2DigOut", 14, "MAP2DIGOUT1", {{0, ethernet_id, *element->index - 1}}};
    out.parameters = {{"Index", 0, 1, "1"}, {"DataType", 1, 2, "1"}};  // byte 1: $OUT[1] to $OUT[8]
    wiring.flow.objects.push_back(out);
  }
  for (const auto& [component, element] : wiring.of(Meaning::StopMove)) {
    SignalObject out{"Stop", 18, "STOP1", {{0, ethernet_id, *element->index - 1}}};
    out.parameters = {{"Mode", 0, 1, "4"}, {"Channel", 1, 2, "0"}};  // 4: leaves RSI_MOVECORR
    wiring.flow.objects.push_back(out);
  }
}

/// What feeds the inputs of the Ethernet object.
void add_sources(const Wiring& wiring, SignalObject& ethernet) {
  const auto add = [&](Meaning meaning, const SignalObject& object) {
    const auto elements = wiring.of(meaning);
    for (const auto& [component, element] : elements)
      ethernet.inputs.push_back({*element->index - 1, object.id, component});
    if (!elements.empty()) wiring.flow.objects.push_back(object);
  };
  add(Meaning::GearTorque, {"GearTorque", 46, "GEARTORQUE1", {}, {{"Type", 0, 1, "0"}}});
  add(Meaning::ProgramState, {"Status", 62, "STATUS1", {}, {{"Type", 0, 1, "2"}}});
  add(Meaning::Override, {"Ov_Pro", 63, "OV_PRO1"});
  add(Meaning::DigitalInputs, {"DigIn", 29, "DIGIN1", {}, {{"Index", 0, 1, "1"}, {"DataType", 1, 2, "1"}}});
}

bool is_wired(const std::vector<SignalObject>& objects, const TelegramElement& e, bool sent) {
  for (const SignalObject& object : objects)
    for (const SignalInput& input : object.inputs)
      if (sent ? object.id == ethernet_id && input.input == *e.index - 1
               : input.object == ethernet_id && input.output == *e.index - 1)
        return true;
  return false;
}

std::string capitals(std::string text) {
  for (char& c : text)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return text;
}

std::string inputs_text(const SignalObject& object, int base, const std::string& id) {
  if (object.inputs.empty()) return {};
  std::string out = "      <Inputs>\n";
  for (const SignalInput& in : object.inputs)
    out += "        <Input InIdx=\"" + std::to_string(in.input + base) + "\" OutObj" + id + "=\"" + in.object +
           "\" OutIdx=\"" + std::to_string(in.output + base) + "\" />\n";
  return out + "      </Inputs>\n";
}

}  // namespace

SignalFlow signal_flow(const TelegramLayout& layout, const ProgramOptions& options, const std::string& config_file) {
  SignalFlow flow;
  const Wiring in{flow, layout.receive}, out{flow, layout.send};
  SignalObject ethernet{"Ethernet", 64, ethernet_id};
  ethernet.parameters = {{"ConfigFile", 0, 1, config_file, false},
                         {"Timeout", 0, 1, std::to_string(options.timeout)},
                         {"Flag", 3, 4, std::to_string(options.flag > 0 ? options.flag : -1)},
                         {"Precision", 7, 8, std::to_string(layout.decimals)}};
  add_corrected_axes(in, Meaning::AxisCorrection, {"AxisCorr", 33, "AXISCORR1"}, 'A', options.axis_limit / degree, 1);
  add_corrected_axes(in, Meaning::ExternalCorrection, {"AxisCorrExt", 33, "AXISCORREXT1"}, 'E',
                     options.external_limit / millimetre, 7);
  add_axis_monitor(in, options);
  add_corrected_pose(in, options, layout.controller == Controller::Krc4Rsi3);
  add_sinks(in);
  add_sources(out, ethernet);
  flow.objects.insert(flow.objects.begin(), ethernet);
  for (const TelegramElement& e : layout.send)
    if (e.index && !is_wired(flow.objects, e, true)) flow.unwired.push_back(e.tag);
  for (const TelegramElement& e : layout.receive)
    if (e.index && !is_wired(flow.objects, e, false)) flow.unwired.push_back(e.tag);
  return flow;
}

std::string signal_flow_rsi3(const SignalFlow& flow) {
  std::string out =
      "<?xml version=\"1.0\" encoding=\"UTF-8\" standalone=\"yes\"?>\n"
      "<RSIObjects xsi:noNamespaceSchemaLocation=\"/Roboter/Config/System/Common/Schemes/RSIContext.xsd\" "
      "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\">\n";
  for (const SignalObject& object : flow.objects) {
    out += "  <RSIObject ObjType=\"" + capitals(object.type) + "\" ObjTypeID=\"" + std::to_string(object.type_id) +
           "\" ObjID=\"" + object.id + "\">\n" + inputs_text(object, 1, "ID");
    if (!object.parameters.empty()) out += "    <Parameters>\n";
    for (const SignalParameter& p : object.parameters)
      out += "      <Parameter Name=\"" + p.name + "\" ParamID=\"" + std::to_string(p.number_rsi3) +
             "\" ParamValue=\"" + p.value + "\"" + (p.runtime ? "" : " IsRuntime=\"false\"") + " />\n";
    out += std::string(object.parameters.empty() ? "" : "    </Parameters>\n") + "  </RSIObject>\n";
  }
  return out + "</RSIObjects>\n";
}

std::string signal_flow_rsix(const SignalFlow& flow, Controller controller) {
  const bool rsi4 = controller == Controller::Krc4;
  std::string out =
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<RsiContext xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\"";
  out += rsi4 ? " xmlns:xsd=\"http://www.w3.org/2001/XMLSchema\" Version=\"0.1.0\">\n  <RsiObjects>\n"
              : " xsi:schemaLocation=\"RsiContext RsiContext.xsd\" SchemaVersion=\"2.0.0\" xmlns=\"RsiContext\">\n"
                "  <RsiObjects xmlns=\"RsiDriver\">\n";
  for (const SignalObject& object : flow.objects) {
    out += "    <RsiObject ObjTypeId=\"" + std::to_string(object.type_id) + "\" ObjType=\"" + object.type +
           "\" ObjId=\"" + object.id + "\">\n" + inputs_text(object, 0, "Id");
    if (!object.parameters.empty()) out += "      <Parameters>\n";
    for (const SignalParameter& p : object.parameters)
      out += std::string("        <Parameter ") + (p.runtime ? "" : "IsRuntime=\"false\" ") + "Name=\"" + p.name +
             "\" ParamId=\"" + std::to_string(p.number) + "\" ParamValue=\"" + p.value + "\" />\n";
    out += std::string(object.parameters.empty() ? "" : "      </Parameters>\n") + "    </RsiObject>\n";
  }
  return out + "  </RsiObjects>\n</RsiContext>\n";
}

}  // namespace kr5::rsi
