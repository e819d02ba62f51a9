// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/layout_file.hpp>

#include <algorithm>
#include <charconv>
#include <utility>

#include <pugixml.hpp>

#include <kr5/core/error.hpp>
#include <kr5/io/diagnostic.hpp>
#include <kr5/io/node.hpp>

namespace kr5::rsi {
namespace {

std::string lower(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

std::string upper(std::string_view text) {
  std::string out(text);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return out;
}

/// Reads one configuration; every complaint has its line and element.
class LayoutReader {
 public:
  LayoutReader(std::string_view xml, const std::string& source) : xml_(xml), source_(source) {}

  TelegramLayout read() {
    pugi::xml_document document;
    const pugi::xml_parse_result parsed = document.load_buffer(xml_.data(), xml_.size());
    if (!parsed) fail(parsed.offset, std::string("is no XML: ") + parsed.description());
    const pugi::xml_node root = document.child("ROOT");
    if (!root)
      fail(0, "expected <ROOT> with <CONFIG>, <SEND> and <RECEIVE>, the configuration of the Ethernet object of RSI" +
                  std::string(document.child("RSIObjects") || document.child("RsiContext")
                                  ? "; this is the signal flow, which names that file as its ConfigFile"
                                  : ""));
    read_config(child(root, "CONFIG"));
    read_elements(child(child(root, "SEND"), "ELEMENTS"), layout_.send);
    if (!layout_.only_send || root.child("RECEIVE"))
      read_elements(child(child(root, "RECEIVE"), "ELEMENTS"), layout_.receive);
    try {
      layout_.validate();
    } catch (const InvalidArgument& e) {
      throw IoError(source_ + ": " + e.what());
    }
    return std::move(layout_);
  }

 private:
  [[noreturn]] void fail(std::ptrdiff_t offset, const std::string& what) const {
    const auto end = xml_.begin() + std::clamp<std::ptrdiff_t>(offset, 0, static_cast<std::ptrdiff_t>(xml_.size()));
    throw IoError(source_ + ":" + std::to_string(1 + std::count(xml_.begin(), end, '\n')) + ": " + what);
  }
  [[noreturn]] void fail(const pugi::xml_node& node, const std::string& found, const std::string& expected) const {
    fail(node.offset_debug(),
         "<" + std::string(node.name()) + ">: found \"" + io::shortened(found) + "\", expected " + expected);
  }

  pugi::xml_node child(const pugi::xml_node& node, const char* name) const {
    const pugi::xml_node out = node.child(name);
    if (!out) fail(node.offset_debug(), "<" + std::string(node.name()) + ">: has no <" + name + ">");
    return out;
  }

  int number(const pugi::xml_node& node, std::string_view text, const std::string& expected) const {
    int value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) fail(node, std::string(text), expected);
    return value;
  }

  static std::string text_of(const pugi::xml_node& node) {
    std::string text = node.text().as_string();
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
    while (!text.empty() && blank(text.back())) text.pop_back();
    text.erase(text.begin(), std::ranges::find_if_not(text, blank));
    return text;
  }

  void read_config(const pugi::xml_node& config) {
    layout_.address = text_of(child(config, "IP_NUMBER"));
    const pugi::xml_node port = child(config, "PORT");
    layout_.port = number(port, text_of(port), "a port");
    layout_.sensor_type = text_of(child(config, "SENTYPE"));
    if (const pugi::xml_node protocol = config.child("PROTOCOL")) {
      layout_.controller = Controller::Krc2;
      const std::string name = lower(text_of(protocol));
      if (name != "udp" && name != "tcp") fail(protocol, text_of(protocol), "TCP or UDP");
      layout_.transport = name == "tcp" ? Transport::Tcp : Transport::Udp;
    }
    for (const char* name : {"PROTCOLLENGTH", "PROTOCOLLENGTH"})
      if (const pugi::xml_node length = config.child(name); length && lower(text_of(length)) != "off")
        fail(length, text_of(length), "Off: telegrams with their length in front are not read");
    if (const pugi::xml_node only = config.child("ONLYSEND")) {
      const std::string value = lower(text_of(only));
      if (value != "true" && value != "false") fail(only, text_of(only), "TRUE or FALSE");
      layout_.only_send = value == "true";
    }
  }

  void read_elements(const pugi::xml_node& list, std::vector<TelegramElement>& to) const {
    for (const pugi::xml_node& node : list.children("ELEMENT")) to.push_back(read_element(node));
  }

  TelegramElement read_element(const pugi::xml_node& node) const {
    TelegramElement out;
    out.tag = node.attribute("TAG").as_string();
    if (out.tag.empty()) fail(node.offset_debug(), "<ELEMENT>: has no TAG");
    const std::string type = node.attribute("TYPE").as_string();
    bool known = false;
    for (const auto& [value, name] : enum_names(ValueType{}))
      if (lower(type) == name) out.type = value, known = true;
    if (!known) fail(node, type, "a TYPE that is BOOL, LONG, FLOAT, DOUBLE or STRING");
    const std::string index = node.attribute("INDX").as_string();
    if (lower(index) != "internal") out.index = number(node, index, "an INDX that is INTERNAL or a number");
    out.unit = node.attribute("UNIT").as_string();
    if (const pugi::xml_attribute hold = node.attribute("HOLDON"))
      out.hold = number(node, hold.as_string(), "a HOLDON that is 0 or 1") != 0;
    return out;
  }

  std::string_view xml_;
  const std::string& source_;
  TelegramLayout layout_;
};

void append_element(std::string& to, const TelegramElement& e, bool rsi2) {
  to += "         <ELEMENT TAG=\"" + e.tag + "\" TYPE=\"" + upper(name_of(e.type)) + "\" INDX=\"" +
        (e.index ? std::to_string(*e.index) : "INTERNAL") + "\"";
  if (rsi2) to += " UNIT=\"" + (e.unit.empty() ? "0" : e.unit) + "\"";
  if (e.hold) to += std::string(" HOLDON=\"") + (*e.hold ? '1' : '0') + "\"";
  to += " />\n";
}

void append_elements(std::string& to, const char* name, const std::vector<TelegramElement>& elements, bool rsi2) {
  to += std::string("   <") + name + ">\n      <ELEMENTS>\n";
  for (const TelegramElement& e : elements) append_element(to, e, rsi2);
  to += std::string("      </ELEMENTS>\n   </") + name + ">\n";
}

bool is_plain(std::string_view text) { return text.find_first_of("<>&\"") == text.npos; }

}  // namespace

TelegramLayout parse_layout(std::string_view xml, const std::string& source) {
  return LayoutReader(xml, source).read();
}

TelegramLayout load_layout(const std::filesystem::path& file) {
  return parse_layout(io::read_text(file), file.string());
}

std::string layout_xml(const TelegramLayout& layout) {
  layout.validate();
  require(is_plain(layout.address), "address: must not hold < > & or quotes");
  for (const TelegramElement& e : layout.send) require(is_plain(e.unit), e.tag + ": a unit holds no < > & or quotes");
  for (const TelegramElement& e : layout.receive)
    require(is_plain(e.unit), e.tag + ": a unit holds no < > & or quotes");
  const bool rsi2 = layout.controller == Controller::Krc2;
  std::string out = "<ROOT>\n   <CONFIG>\n      <IP_NUMBER>" + layout.address + "</IP_NUMBER>\n      <PORT>" +
                    std::to_string(layout.port) + "</PORT>\n";
  if (rsi2) out += "      <PROTOCOL>" + upper(name_of(layout.transport)) + "</PROTOCOL>\n";
  out += "      <SENTYPE>" + layout.sensor_type + "</SENTYPE>\n";
  if (rsi2) out += "      <PROTCOLLENGTH>Off</PROTCOLLENGTH>\n";
  out += std::string("      <ONLYSEND>") + (layout.only_send ? "TRUE" : "FALSE") + "</ONLYSEND>\n   </CONFIG>\n";
  append_elements(out, "SEND", layout.send, rsi2);
  append_elements(out, "RECEIVE", layout.receive, rsi2);
  return out + "</ROOT>\n";
}

}  // namespace kr5::rsi
