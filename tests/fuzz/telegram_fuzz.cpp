// Any bytes as a telegram of either sender: a fault, or values that are written and read again as they were.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include <kr5/rsi/telegram_codec.hpp>

using namespace kr5::rsi;

namespace {

void check(const TelegramCodec& codec, std::string_view bytes) {
  Telegram t, back;
  const TelegramFault fault = codec.decode(bytes, t);
  if (fault != TelegramFault::None && fault != TelegramFault::Incomplete) return;
  if (t.ipoc.empty() || bytes.find(t.ipoc.text()) == bytes.npos) std::abort();
  for (const double value : t.values)
    if (!std::isfinite(value)) std::abort();
  std::array<char, max_telegram> text;
  const std::size_t size = codec.encode(t, text);
  if (size == 0) return;  // a value beyond those that are written
  if (codec.decode({text.data(), size}, back) != TelegramFault::None || !(back.ipoc == t.ipoc)) std::abort();
  for (std::size_t i = 0; i < codec.fields().size(); ++i)
    if (std::abs(back.values[i] - t.values[i]) > 1e-4 && codec.fields()[i].type != ValueType::Bool) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const TelegramCodec rob(book_layout(), Sender::Controller), sen(book_layout(), Sender::Computer);
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  check(rob, bytes);
  check(sen, bytes);
  return 0;
}
