// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <kr5/rsi/telegram.hpp>

/// @file
/// Telegrams to bytes and back: a codec for the one form that RSI has, not for XML. Each end has two of them, one that
/// reads what the other end sends and one that writes.

namespace kr5::rsi {

/// Who writes a telegram.
enum class Sender {
  Controller,  ///< <Rob>
  Computer,    ///< <Sen>
};
constexpr auto enum_names(Sender) {
  return names<Sender>({{Sender::Controller, "controller"}, {Sender::Computer, "computer"}});
}

/// The codec of the telegrams of one sender. Once made, it allocates nothing and throws nothing, and several threads
/// may use it. Elements and attributes are read in any order, with any blanks between them; those that the layout does
/// not know are passed over and counted.
class TelegramCodec {
 public:
  /// @throws InvalidArgument as TelegramLayout::validate, or for more than one text in a telegram.
  TelegramCodec(const TelegramLayout& layout, Sender sender);

  /// Whatever the bytes are, nothing outside of them is read. `out` is good without a fault, and, as far as `present`
  /// says, for TelegramFault::Incomplete.
  TelegramFault decode(std::string_view bytes, Telegram& out) const noexcept;

  /// Writes a telegram; its length, or 0 where it does not fit, IPOC is empty or a value is not finite or beyond 1e9.
  /// Characters of a text that XML does not bear are written as blanks.
  std::size_t encode(const Telegram& telegram, std::span<char> out) const noexcept;

  const std::vector<TelegramField>& fields() const noexcept { return fields_; }

 private:
  friend class TelegramReader;
  struct Attribute {
    std::string name;  ///< Empty: the text of the element.
    ValueType type;
    int value;  ///< Its place among the values.
  };
  struct Element {
    std::string name;
    std::vector<Attribute> attributes;
  };
  /// What stands in front of a value.
  struct Piece {
    std::string text;
    ValueType type;
    int value;
  };

  void make_elements();
  void make_pieces(bool capital_type);

  std::string root_, type_;
  int decimals_ = 6;
  std::vector<TelegramField> fields_;
  std::vector<Element> elements_;
  std::vector<Piece> pieces_;
  std::string before_ipoc_, after_ipoc_;
};

}  // namespace kr5::rsi
