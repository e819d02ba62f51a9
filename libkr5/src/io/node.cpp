// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/io/node.hpp>

#include <charconv>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <system_error>

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <kr5/core/error.hpp>
#include <kr5/core/file.hpp>

#include "io/utf8.hpp"

namespace kr5::io {
namespace {

constexpr std::size_t max_copied_nodes = 100'000;  // bounds what nested aliases can blow up to

std::size_t count_nodes(const Node& node) {
  std::size_t n = 1;
  for (const Node& item : node.items) n += count_nodes(item);
  for (const auto& [key, entry] : node.entries) n += count_nodes(entry);
  return n;
}

/// Builds a tree from yaml-cpp's events; its own node class would drop lines and duplicate keys.
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(std::string source) : source_(std::move(source)) {}
  Node root;

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { add(Node{}, mark, anchor); }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchors_.find(anchor);
    if (found == anchors_.end()) fail(mark, "an alias to a node that is not complete");
    copied_nodes_ += count_nodes(found->second);
    if (copied_nodes_ > max_copied_nodes) fail(mark, "the aliases make the document too large");
    add(found->second, mark, 0);
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    if (!is_utf8(value)) fail(mark, "an escape sequence that is not a character; write the character itself");
    Node node = Node::make_scalar(value, tag == "!");  // yaml-cpp tags quoted scalars "!"
    if (!node.quoted && (value == "~" || value == "null")) node = Node{};
    add(std::move(node), mark, anchor);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value style) override {
    open(Node::Kind::Sequence, mark, anchor, style);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value style) override {
    open(Node::Kind::Map, mark, anchor, style);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

 private:
  struct Open {
    Node node;
    YAML::anchor_t anchor = 0;
    bool has_key = false;
    int key_line = 0;  // a complaint about `camera` points at its key, not at the first line below it
    std::string key;
    std::set<std::string> keys;
  };

  [[noreturn]] void fail(const YAML::Mark& mark, const std::string& what) const {
    throw IoError(source_ + ":" + std::to_string(mark.line + 1) + ": " + what);
  }

  void open(Node::Kind kind, const YAML::Mark& mark, YAML::anchor_t anchor, YAML::EmitterStyle::value style) {
    Open o;
    o.node.kind = kind;
    o.node.line = mark.line + 1;
    o.node.flow = style == YAML::EmitterStyle::Flow;
    o.anchor = anchor;
    stack_.push_back(std::move(o));
  }

  void close() {
    Open o = std::move(stack_.back());
    stack_.pop_back();
    YAML::Mark mark;
    mark.line = o.node.line - 1;
    add(std::move(o.node), mark, o.anchor);
  }

  void add(Node node, const YAML::Mark& mark, YAML::anchor_t anchor) {
    node.line = mark.line + 1;
    if (anchor) anchors_[anchor] = node;
    if (stack_.empty()) {
      root = std::move(node);
      return;
    }
    Open& top = stack_.back();
    if (top.node.kind == Node::Kind::Sequence) {
      top.node.items.push_back(std::move(node));
    } else if (!top.has_key) {
      if (node.kind != Node::Kind::Scalar) fail(mark, "a key must be a scalar");
      if (!top.keys.insert(node.scalar).second) fail(mark, "the key '" + node.scalar + "' occurs twice");
      top.key = node.scalar;
      top.key_line = node.line;
      top.has_key = true;
    } else {
      node.line = top.key_line;
      top.node.entries.emplace_back(std::move(top.key), std::move(node));
      top.has_key = false;
    }
  }

  std::string source_;
  std::vector<Open> stack_;
  std::map<YAML::anchor_t, Node> anchors_;
  std::size_t copied_nodes_ = 0;
};

void emit(YAML::Emitter& out, const Node& node) {
  switch (node.kind) {
    case Node::Kind::Null:
      out << YAML::Null;
      break;
    case Node::Kind::Scalar:
      if (node.quoted) out << YAML::DoubleQuoted;
      out << node.scalar;
      break;
    case Node::Kind::Sequence:
      if (node.flow || node.items.empty()) out << YAML::Flow;
      out << YAML::BeginSeq;
      for (const Node& item : node.items) emit(out, item);
      out << YAML::EndSeq;
      break;
    case Node::Kind::Map:
      if (node.flow || node.entries.empty()) out << YAML::Flow;
      out << YAML::BeginMap;
      for (const auto& [key, entry] : node.entries) {
        out << YAML::Key << key << YAML::Value;
        emit(out, entry);
      }
      out << YAML::EndMap;
      break;
  }
}

}  // namespace

Node::Node() = default;
Node::Node(const Node& other) = default;
Node::Node(Node&& other) noexcept = default;
Node& Node::operator=(const Node& other) = default;
Node& Node::operator=(Node&& other) noexcept = default;
Node::~Node() = default;

bool operator==(const Node& a, const Node& b) {
  if (a.kind != b.kind || a.scalar != b.scalar || a.items.size() != b.items.size() ||
      a.entries.size() != b.entries.size())
    return false;
  for (std::size_t i = 0; i < a.items.size(); ++i)
    if (!(a.items[i] == b.items[i])) return false;
  for (std::size_t i = 0; i < a.entries.size(); ++i)
    if (a.entries[i].first != b.entries[i].first || !(a.entries[i].second == b.entries[i].second)) return false;
  return true;
}

const Node* Node::find(std::string_view key) const {
  for (const auto& [name, entry] : entries)
    if (name == key) return &entry;
  return nullptr;
}

Node& Node::operator[](std::string_view key) {
  if (kind == Kind::Null) kind = Kind::Map;
  for (auto& [name, entry] : entries)
    if (name == key) return entry;
  return entries.emplace_back(std::string(key), Node{}).second;
}

Node Node::make_scalar(std::string text, bool quoted) {
  Node node;
  node.kind = Kind::Scalar;
  node.scalar = std::move(text);
  node.quoted = quoted;
  return node;
}

Node Node::make_scalar(double value) {
  if (std::isnan(value)) return make_scalar(std::string(".nan"));
  if (std::isinf(value)) return make_scalar(std::string(value > 0 ? ".inf" : "-.inf"));
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  std::string text(buffer, end);
  // YAML 1.1 readers take "2e-05" for text: a number needs its point.
  if (text.find('.') == std::string::npos) {
    const std::size_t e = text.find('e');
    text.insert(e == std::string::npos ? text.size() : e, ".0");
  }
  return make_scalar(std::move(text));
}

Node parse_yaml(std::string_view text, const std::string& source) {
  constexpr std::size_t most = 64 << 20;  // a tree takes some fifty times its text
  if (text.size() > most)
    throw IoError(source + ": found " + std::to_string(text.size() >> 20) +
                  " MiB, expected a document of at most 64 MiB");
  require_utf8(text, source);
  TreeBuilder builder(source);
  try {
    std::istringstream stream{std::string(text)};
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(builder)) throw IoError(source + ": the file is empty");
    TreeBuilder second(source);
    if (parser.HandleNextDocument(second))
      throw IoError(source + ":" + std::to_string(second.root.line) + ": a second document (---), expected one");
  } catch (const YAML::Exception& e) {
    throw IoError(source + ":" + std::to_string(e.mark.line + 1) + ": not valid YAML: " + e.msg);
  }
  return std::move(builder.root);
}

Node load_yaml(const std::filesystem::path& file) { return parse_yaml(read_text(file), file.string()); }

std::string to_yaml(const Node& node) {
  YAML::Emitter out;
  out.SetIndent(2);
  emit(out, node);
  return std::string(out.c_str()) + "\n";
}

std::string read_text(const std::filesystem::path& file) {
  check_readable(file);
  std::error_code error;
  constexpr std::uintmax_t most = std::uintmax_t{4} << 30;
  if (std::filesystem::file_size(file, error) > most && !error)
    throw IoError(file.string() + ": found more than 4 GiB, expected a smaller file");
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  if (!stream || !(text << stream.rdbuf() || stream.eof())) {
    if (std::filesystem::file_size(file, error) == 0) return {};
    throw IoError(file.string() + ": cannot be read");
  }
  return std::move(text).str();
}

void write_text(const std::filesystem::path& file, std::string_view text) { write_file(file, text); }

}  // namespace kr5::io
