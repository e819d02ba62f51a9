// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/content_findings.hpp"

#include <algorithm>
#include <cstring>

#include <pugixml.hpp>

namespace kr5::rsi {
namespace {

/// Names of the values of a telegram, as they stand in it: "RIst.X", "EStr".
struct Outline {
  std::string root, type;
  std::vector<std::string> names;
};

std::string value_name(const std::string& element, const std::string& attribute) {
  return attribute.empty() ? element : element + "." + attribute;
}

/// Empty for bytes that are no XML.
Outline outline_of(const std::string& bytes) {
  pugi::xml_document document;
  Outline out;
  if (!document.load_buffer(bytes.data(), bytes.size())) return out;
  const pugi::xml_node root = document.document_element();
  out.root = root.name();
  for (const char* name : {"Type", "TYPE", "type"})
    if (const pugi::xml_attribute type = root.attribute(name)) out.type = type.value();
  for (const pugi::xml_node& child : root.children()) {
    if (child.type() != pugi::node_element || std::strcmp(child.name(), "IPOC") == 0) continue;
    for (const pugi::xml_attribute& a : child.attributes()) out.names.push_back(value_name(child.name(), a.name()));
    if (child.attributes().empty()) out.names.emplace_back(child.name());
  }
  return out;
}

std::vector<std::string> layout_names(const std::vector<TelegramElement>& elements) {
  std::vector<std::string> out;
  for (const TelegramField& f : telegram_fields(elements)) out.push_back(value_name(f.element, f.attribute));
  return out;
}

std::string element_of(const std::string& name) { return name.substr(0, name.find('.')); }

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

/// What `of` has and `other` has not; an element that is absent as a whole is named once.
std::vector<std::string> difference(const std::vector<std::string>& of, const std::vector<std::string>& other) {
  std::vector<std::string> out;
  for (const std::string& name : of) {
    if (holds(other, name)) continue;
    const std::string element = element_of(name);
    const bool partly = std::ranges::any_of(other, [&](const std::string& n) { return element_of(n) == element; });
    if (!holds(out, partly ? name : element)) out.push_back(partly ? name : element);
  }
  return out;
}

/// Elements in their order, without those that `other` lacks.
std::string common_order(const std::vector<std::string>& of, const std::vector<std::string>& other) {
  std::string out, last;
  for (const std::string& name : of) {
    const std::string element = element_of(name);
    if (!holds(other, name) || element == last) continue;
    out += (out.empty() ? "" : " ") + element;
    last = element;
  }
  return out;
}

void note_names(LinkFindingKind kind, const Exchange& e, std::size_t of, const std::vector<std::string>& names,
                Findings& to) {
  if (names.empty()) return;
  auto at = std::ranges::find(to, kind, &LinkFinding::kind);
  if (at == to.end()) {
    const bool fault = kind == LinkFindingKind::MissingElements || kind == LinkFindingKind::WrongType;
    to.push_back({.kind = kind,
                  .severity = fault ? FindingSeverity::Fault : FindingSeverity::Caution,
                  .of = of,
                  .first = e.time});
    at = to.end() - 1;
  }
  ++at->count;
  for (const std::string& name : names)
    if (!holds(at->names, name)) at->names.push_back(name);
}

void compare_telegram(const Exchange& e, const ReadObservations& read, const std::vector<std::string>& expected,
                      Findings& to) {
  const Outline found = outline_of(e.telegram);
  const std::size_t of = read.of_telegrams.size();
  if (found.root != "Rob" || found.type != "KUKA") {
    note_names(LinkFindingKind::WrongType, e, of, {"telegrams"}, to);
    LinkFinding& finding = *std::ranges::find(to, LinkFindingKind::WrongType, &LinkFinding::kind);
    finding.found = found.root + " Type=" + found.type;
    finding.expected = "Rob Type=KUKA";
    return;
  }
  note_names(LinkFindingKind::MissingElements, e, of, difference(expected, found.names), to);
  note_names(LinkFindingKind::UnknownElements, e, of, difference(found.names, expected), to);
  const std::string order = common_order(found.names, expected), usual = common_order(expected, found.names);
  if (order == usual) return;
  note_names(LinkFindingKind::OtherOrder, e, of, {"telegrams"}, to);
  LinkFinding& finding = *std::ranges::find(to, LinkFindingKind::OtherOrder, &LinkFinding::kind);
  finding.found = order;
  finding.expected = usual;
}

}  // namespace

Findings content_findings(const ReadObservations& read) {
  Findings out;
  const std::vector<std::string> expected = layout_names(read.layout.send);
  for (const Exchange* e : read.of_telegrams)
    if (!outline_of(e->telegram).root.empty()) compare_telegram(*e, read, expected, out);
  return out;
}

}  // namespace kr5::rsi
