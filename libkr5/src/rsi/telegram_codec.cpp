// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/telegram_codec.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include <kr5/core/error.hpp>

#include "rsi/telegram_reader.hpp"

namespace kr5::rsi {
namespace {

constexpr double greatest = 1e9;  // of a value that is written
constexpr std::array<std::int64_t, 10> powers = {1,      10,      100,      1000,      10000,
                                                 100000, 1000000, 10000000, 100000000, 1000000000};

/// Writes into a given space; once something does not fit, nothing does.
class ByteWriter {
 public:
  explicit ByteWriter(std::span<char> to) noexcept : at_(to.data()), end_(to.data() + to.size()), first_(at_) {}

  void text(std::string_view text) noexcept {
    if (!room(text.size())) return;
    at_ = std::copy(text.begin(), text.end(), at_);
  }
  void plain(std::string_view text) noexcept {
    if (!room(text.size())) return;
    for (const char c : text)
      *at_++ = c == '<' || c == '>' || c == '&' || c == '"' || static_cast<unsigned char>(c) < ' ' ? ' ' : c;
  }
  /// A number of fixed decimals, rounded.
  void number(double value, int decimals) noexcept {
    if (!(std::abs(value) <= greatest)) return fail();
    const std::int64_t scale = powers[static_cast<std::size_t>(decimals)];
    std::int64_t scaled = std::llround(value * static_cast<double>(scale));
    if (scaled < 0) {
      text("-");
      scaled = -scaled;
    }
    whole(scaled / scale);
    if (decimals == 0 || !room(static_cast<std::size_t>(decimals) + 1)) return;
    *at_ = '.';
    std::int64_t rest = scaled % scale;
    for (int i = decimals; i > 0; --i, rest /= 10) at_[i] = static_cast<char>('0' + rest % 10);
    at_ += decimals + 1;
  }
  void fail() noexcept { good_ = false; }
  /// How much was written; 0 unless everything was.
  std::size_t size() const noexcept { return good_ ? static_cast<std::size_t>(at_ - first_) : 0; }

 private:
  bool room(std::size_t size) noexcept {
    good_ = good_ && static_cast<std::size_t>(end_ - at_) >= size;
    return good_;
  }
  void whole(std::int64_t value) noexcept {
    const auto [stop, error] = std::to_chars(at_, end_, value);
    if (error != std::errc()) return fail();
    if (good_) at_ = stop;
  }

  char* at_;
  char* end_;
  char* first_;
  bool good_ = true;
};

}  // namespace

TelegramCodec::TelegramCodec(const TelegramLayout& layout, Sender sender) {
  layout.validate();
  const bool controller = sender == Sender::Controller;
  root_ = controller ? "Rob" : "Sen";
  type_ = controller ? "KUKA" : layout.sensor_type;
  if (controller) decimals_ = layout.decimals;
  fields_ = telegram_fields(controller ? layout.send : layout.receive);
  require(std::ranges::count(fields_, ValueType::String, &TelegramField::type) <= 1,
          "the telegram has more than one text");
  make_elements();
  make_pieces(controller && layout.controller != Controller::Krc2);
}

void TelegramCodec::make_elements() {
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    const TelegramField& f = fields_[i];
    if (elements_.empty() || elements_.back().name != f.element) elements_.push_back({f.element, {}});
    elements_.back().attributes.push_back({f.attribute, f.type, static_cast<int>(i)});
  }
}

void TelegramCodec::make_pieces(bool capital_type) {
  std::string text = "<" + root_ + (capital_type ? " TYPE=\"" : " Type=\"") + type_ + "\">";
  for (const Element& element : elements_) {
    const bool plain = element.attributes.front().name.empty();
    text += "<" + element.name + (plain ? ">" : "");
    for (const Attribute& a : element.attributes) {
      if (!plain) text += " " + a.name + "=\"";
      pieces_.push_back({text, a.type, a.value});
      text = plain ? "" : "\"";
    }
    text += plain ? "</" + element.name + ">" : " />";
  }
  before_ipoc_ = text + "<IPOC>";
  after_ipoc_ = "</IPOC></" + root_ + ">";
}

TelegramFault TelegramCodec::decode(std::string_view bytes, Telegram& out) const noexcept {
  out = Telegram();
  return TelegramReader(*this, bytes, out).read();
}

std::size_t TelegramCodec::encode(const Telegram& telegram, std::span<char> out) const noexcept {
  ByteWriter to(out);
  for (const Piece& piece : pieces_) {
    to.text(piece.text);
    const double value = telegram.values[static_cast<std::size_t>(piece.value)];
    switch (piece.type) {
      case ValueType::Bool:
        to.text(value != 0.0 ? "1" : "0");
        break;
      case ValueType::Long:
        to.number(value, 0);
        break;
      case ValueType::String:
        to.plain(telegram.message.text());
        break;
      default:
        to.number(value, decimals_);
    }
  }
  if (telegram.ipoc.empty()) to.fail();
  to.text(before_ipoc_);
  to.text(telegram.ipoc.text());
  to.text(after_ipoc_);
  return to.size();
}

}  // namespace kr5::rsi
