// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/json.hpp>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>

namespace kr5::io {
namespace {

void json_string(std::string& out, const std::string& text) {
  out += '"';
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      char buffer[8];
      std::snprintf(buffer, sizeof buffer, "\\u%04x", static_cast<unsigned>(c));
      out += buffer;
    } else {
      out += c;
    }
  }
  out += '"';
}

/// Whole numbers keep their digits; others are written anew, for YAML allows numbers such as `.5` that JSON does not.
std::string json_number(const std::string& text, double value) {
  const std::string_view digits = std::string_view(text).substr(text.starts_with('-') ? 1 : 0);
  const bool whole = digits.find_first_not_of("0123456789") == std::string_view::npos;
  return whole && (digits.size() == 1 || digits[0] != '0') ? text : Node::make_scalar(value).scalar;
}

void json_scalar(std::string& out, const Node& node) {
  const std::string& s = node.scalar;
  double value = 0;
  const auto [end, error] = std::from_chars(s.data(), s.data() + s.size(), value);
  const bool number = !s.empty() && error == std::errc{} && end == s.data() + s.size() && std::isfinite(value);
  if (node.quoted)
    json_string(out, s);
  else if (s == ".nan" || s == ".inf" || s == "-.inf")
    out += "null";
  else if (number)
    out += json_number(s, value);
  else if (s == "true" || s == "false")
    out += s;
  else
    json_string(out, s);
}

void json(std::string& out, const Node& node, int indent, int depth) {
  const auto line = [&](int d) {
    if (indent > 0 && !node.flow) out += '\n' + std::string(static_cast<std::size_t>(indent * d), ' ');
  };
  if (node.kind == Node::Kind::Null) {
    out += "null";
  } else if (node.kind == Node::Kind::Scalar) {
    json_scalar(out, node);
  } else if (node.kind == Node::Kind::Sequence) {
    out += '[';
    for (std::size_t i = 0; i < node.items.size(); ++i) {
      if (i) out += node.flow ? ", " : ",";
      line(depth + 1);
      json(out, node.items[i], indent, depth + 1);
    }
    if (!node.items.empty()) line(depth);
    out += ']';
  } else {
    out += '{';
    for (std::size_t i = 0; i < node.entries.size(); ++i) {
      if (i) out += node.flow ? ", " : ",";
      line(depth + 1);
      json_string(out, node.entries[i].first);
      out += ": ";
      json(out, node.entries[i].second, indent, depth + 1);
    }
    if (!node.entries.empty()) line(depth);
    out += '}';
  }
}

}  // namespace

std::string to_json(const Node& node, int indent) {
  std::string out;
  json(out, node, indent, 0);
  return out + "\n";
}

}  // namespace kr5::io
