// SPDX-License-Identifier: BSD-3-Clause
#include "rsi/telegram_reader.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace kr5::rsi {
namespace {

constexpr double greatest_long = 9007199254740992.0;  // 2^53: every smaller integer is a double

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

constexpr std::array<bool, 256> name_characters = [] {
  std::array<bool, 256> out{};
  for (const char c : std::string_view("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.:"))
    out[static_cast<unsigned char>(c)] = true;
  return out;
}();

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && is_blank(text.back())) text.remove_suffix(1);
  return text;
}

template <class T>
bool parsed(std::string_view text, T& value) noexcept {
  if (text.starts_with('+') && text.size() > 1 && text[1] != '-') text.remove_prefix(1);
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  return error == std::errc() && stop == end;
}

/// A plain decimal of at most 15 digits: its digits and the power of ten are doubles, so that their quotient is the
/// nearest one. Anything else is left to from_chars, which takes twice as long.
bool parsed_plain(std::string_view text, double& value) noexcept {
  constexpr std::array<double, 16> powers = {1,   1e1, 1e2,  1e3,  1e4,  1e5,  1e6,  1e7,
                                             1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15};
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  if (text.empty() || text.size() > powers.size()) return false;
  std::int64_t digits = 0;
  std::size_t point = text.size();
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] >= '0' && text[i] <= '9') {
      digits = 10 * digits + (text[i] - '0');
    } else if (text[i] == '.' && point == text.size()) {
      point = i;
    } else {
      return false;
    }
  }
  const std::size_t decimals = point == text.size() ? 0 : text.size() - point - 1;
  if (text.size() == powers.size() && point == text.size()) return false;  // 16 digits
  if (text.size() == 1 && point == 0) return false;                        // a point alone
  value = static_cast<double>(digits) / powers[decimals];
  if (negative) value = -value;
  return true;
}

bool parsed_value(ValueType type, std::string_view text, double& value) noexcept {
  text = trimmed(text);
  if (type == ValueType::Bool) {
    const bool yes = text == "1" || text == "TRUE" || text == "true" || text == "True";
    value = yes ? 1.0 : 0.0;
    return yes || text == "0" || text == "FALSE" || text == "false" || text == "False";
  }
  if (type == ValueType::Long) {
    long long whole = 0;
    if (!parsed(text, whole)) return false;
    value = static_cast<double>(whole);
    return std::abs(value) < greatest_long;
  }
  return parsed_plain(text, value) || (parsed(text, value) && std::isfinite(value));
}

bool is_type(std::string_view name) { return name == "Type" || name == "TYPE" || name == "type"; }

}  // namespace

bool TelegramReader::fail(TelegramFault fault) noexcept {
  if (fault_ == TelegramFault::None) fault_ = fault;
  return false;
}

void TelegramReader::skip_blanks() noexcept {
  while (!left_.empty() && is_blank(left_.front())) left_.remove_prefix(1);
}

bool TelegramReader::skip_past(std::string_view end) noexcept {
  const std::size_t at = left_.find(end);
  if (at == left_.npos) return fail(TelegramFault::Truncated);
  left_.remove_prefix(at + end.size());
  return true;
}

bool TelegramReader::expect(char c) noexcept {
  if (left_.empty()) return fail(TelegramFault::Truncated);
  if (left_.front() != c) return fail(TelegramFault::Malformed);
  left_.remove_prefix(1);
  return true;
}

bool TelegramReader::name(std::string_view& out) noexcept {
  std::size_t size = 0;
  while (size < left_.size() && name_characters[static_cast<unsigned char>(left_[size])]) ++size;
  if (size == left_.size()) return fail(TelegramFault::Truncated);
  if (size == 0) return fail(TelegramFault::Malformed);
  out = left_.substr(0, size);
  left_.remove_prefix(size);
  return true;
}

bool TelegramReader::quoted(std::string_view& out) noexcept {
  if (left_.empty()) return fail(TelegramFault::Truncated);
  const char quote = left_.front();
  if (quote != '"' && quote != '\'') return fail(TelegramFault::Malformed);
  std::size_t end = 1;
  for (; end < left_.size() && left_[end] != quote; ++end)
    if (left_[end] == '<') return fail(TelegramFault::Malformed);  // a lost quote, not a value
  if (end == left_.size()) return fail(TelegramFault::Truncated);
  out = left_.substr(1, end - 1);
  left_.remove_prefix(end + 1);
  return true;
}

bool TelegramReader::attribute(std::string_view& name, std::string_view& value) noexcept {
  if (!this->name(name)) return false;
  skip_blanks();
  if (!expect('=')) return false;
  skip_blanks();
  return quoted(value);
}

/// `>` or `/>`.
bool TelegramReader::tag_end(bool& closed) noexcept {
  closed = left_.starts_with('/');
  return (!closed || expect('/')) && expect('>');
}

/// `</name>`
bool TelegramReader::closing(std::string_view name) noexcept {
  std::string_view found;
  if (!expect('<') || !expect('/') || !this->name(found)) return false;
  if (found != name) return fail(TelegramFault::Malformed);
  skip_blanks();
  return expect('>');
}

bool TelegramReader::text(std::string_view& out) noexcept {
  const std::size_t end = left_.find('<');
  if (end == left_.npos) return fail(TelegramFault::Truncated);
  out = left_.substr(0, end);
  left_.remove_prefix(end);
  return true;
}

TelegramFault TelegramReader::read() noexcept {
  if (left_.empty()) return TelegramFault::Empty;
  if (left_.size() > max_telegram) return TelegramFault::TooLong;
  if (!root() || !children()) return fault_;
  while (!left_.empty() && (is_blank(left_.front()) || left_.front() == '\0')) left_.remove_prefix(1);
  if (!left_.empty()) return TelegramFault::Malformed;
  if (out_.ipoc.empty()) return TelegramFault::NoIpoc;
  return out_.present.count() == codec_.fields_.size() ? TelegramFault::None : TelegramFault::Incomplete;
}

bool TelegramReader::root() noexcept {
  constexpr std::string_view mark = "\xEF\xBB\xBF";
  if (left_.starts_with(mark)) left_.remove_prefix(mark.size());
  skip_blanks();
  if (left_.starts_with("<?") && !skip_past("?>")) return false;
  skip_blanks();
  std::string_view found;
  if (left_.empty()) return fail(TelegramFault::Truncated);
  if (left_.front() != '<') return fail(TelegramFault::Foreign);
  left_.remove_prefix(1);
  if (!name(found)) return false;
  if (found != codec_.root_) return fail(TelegramFault::Foreign);
  bool of_type = false;
  for (skip_blanks(); !left_.empty() && left_.front() != '>'; skip_blanks()) {
    std::string_view attribute_name, value;
    if (!attribute(attribute_name, value)) return false;
    if (!is_type(attribute_name)) continue;
    if (of_type) return fail(TelegramFault::Duplicate);
    if (value != codec_.type_) return fail(TelegramFault::Foreign);
    of_type = true;
  }
  return expect('>') && (of_type || fail(TelegramFault::Foreign));
}

bool TelegramReader::children() noexcept {
  while (true) {
    skip_blanks();
    if (left_.starts_with("</")) return closing(codec_.root_);
    if (left_.starts_with("<!--")) {
      if (!skip_past("-->")) return false;
      continue;
    }
    std::string_view found;
    if (!expect('<') || !name(found) || !child(found)) return false;
  }
}

const TelegramReader::Element* TelegramReader::find(std::string_view name) noexcept {
  const auto& all = codec_.elements_;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t at = (expected_ + i) % all.size();
    if (all[at].name != name) continue;
    expected_ = at + 1;
    return &all[at];
  }
  return nullptr;
}

bool TelegramReader::child(std::string_view name) noexcept {
  if (name == "IPOC") return ipoc();
  const Element* element = find(name);
  if (!element) return unknown(name);
  const auto number = static_cast<std::size_t>(element - codec_.elements_.data());
  if (seen_[number]) return fail(TelegramFault::Duplicate);
  seen_[number] = true;
  return known(*element);
}

bool TelegramReader::ipoc() noexcept {
  std::string_view digits;
  skip_blanks();
  if (!expect('>') || !text(digits)) return false;
  const Ipoc found(trimmed(digits));
  if (found.empty()) return fail(TelegramFault::BadIpoc);
  if (!out_.ipoc.empty()) return fail(TelegramFault::Duplicate);
  out_.ipoc = found;
  return closing("IPOC");
}

bool TelegramReader::known(const Element& element) noexcept {
  const auto& all = element.attributes;
  std::size_t next = 0;
  for (skip_blanks(); !left_.empty() && left_.front() != '>' && left_.front() != '/'; skip_blanks()) {
    std::string_view found, value;
    if (!attribute(found, value)) return false;
    std::size_t tried = 0;
    while (tried < all.size() && all[(next + tried) % all.size()].name != found) ++tried;
    if (tried == all.size()) {
      ++out_.unknown;
      continue;
    }
    const Attribute& a = all[(next + tried) % all.size()];
    next += tried + 1;
    if (!set(a, value)) return false;
  }
  bool closed = false;
  std::string_view content;
  if (!tag_end(closed)) return false;
  if (closed) return true;
  if (!text(content)) return false;
  if (all.front().name.empty()) {
    if (!set(all.front(), content)) return false;
  } else if (!trimmed(content).empty()) {
    return fail(TelegramFault::Malformed);
  }
  return closing(element.name);
}

bool TelegramReader::unknown(std::string_view name) noexcept {
  ++out_.unknown;
  for (skip_blanks(); !left_.empty() && left_.front() != '>' && left_.front() != '/'; skip_blanks()) {
    std::string_view found, value;
    if (!attribute(found, value)) return false;
  }
  bool closed = false;
  std::string_view content;
  return tag_end(closed) && (closed || (text(content) && closing(name)));
}

bool TelegramReader::set(const Attribute& attribute, std::string_view text) noexcept {
  const auto at = static_cast<std::size_t>(attribute.value);
  if (out_.present[at]) return fail(TelegramFault::Duplicate);
  if (attribute.type == ValueType::String)
    out_.message = MessageText(text);
  else if (!parsed_value(attribute.type, text, out_.values[at]))
    return fail(TelegramFault::BadNumber);
  out_.present[at] = true;
  return true;
}

}  // namespace kr5::rsi
