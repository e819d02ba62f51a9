// SPDX-License-Identifier: BSD-3-Clause
// Time to read a controller's telegram and to write the answer, without and with what a link does between the two.
//
//   cmake -G Ninja -B build -DKR5_BUILD_BENCH=ON && ninja -C build rsi_speed
//   build/tools/benchmarks/rsi_speed [repetitions]
//
// The last line is the figures as JSON. Each figure is the median of blocks of telegrams, of which each is another one.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include <kr5/rsi/link_session.hpp>

namespace {

using namespace kr5;
using namespace kr5::rsi;

constexpr std::size_t block = 1000;

/// Telegrams of a layout in motion, as its controller writes them.
std::vector<std::string> telegrams(const TelegramLayout& layout) {
  const TelegramCodec codec(layout, Sender::Controller);
  std::vector<std::string> out;
  std::array<char, max_telegram> bytes;
  for (std::size_t i = 0; i < block; ++i) {
    Telegram t;
    for (std::size_t k = 0; k < codec.fields().size(); ++k)
      t.values[k] =
          codec.fields()[k].type == ValueType::Double ? 100 * std::sin(0.01 * static_cast<double>(i + 37 * k)) : 1;
    t.ipoc = Ipoc(4208163634 + 4 * i);
    out.emplace_back(bytes.data(), codec.encode(t, bytes));
  }
  return out;
}

/// Median microseconds of processor time of one call over blocks of them.
template <class F>
double microseconds(int repetitions, F&& call) {
  std::vector<double> times;
  for (int r = 0; r < repetitions; ++r) {
    const std::clock_t start = std::clock();
    for (std::size_t i = 0; i < block; ++i) call(i);
    times.push_back(1e6 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / block);
  }
  std::nth_element(times.begin(), times.begin() + repetitions / 2, times.end());
  return times[static_cast<std::size_t>(repetitions / 2)];
}

struct Figures {
  double codec, session;
  std::size_t bytes;
};

Figures measured(const TelegramLayout& layout, int repetitions) {
  const std::vector<std::string> in = telegrams(layout);
  const TelegramCodec reader(layout, Sender::Controller), writer(layout, Sender::Computer);
  Telegram t, answer;
  std::array<char, max_telegram> bytes;
  std::size_t faults = 0;
  Figures out{};
  out.bytes = in.front().size();
  out.codec = microseconds(repetitions, [&](std::size_t i) {
    faults += reader.decode(in[i], t) != TelegramFault::None;
    answer.ipoc = t.ipoc;
    answer.values[0] = 1e-3 * t.values[0];
    faults += writer.encode(answer, bytes) == 0;
  });
  LinkSession session(layout, {}, {}, [](const robot::RobotReading& r) noexcept {
    robot::RobotCommand command;
    command.space = robot::CommandSpace::Joints;
    command.joints = r.joints;
    return command;
  });
  out.session = microseconds(repetitions, [&](std::size_t i) {
    faults += session.answer(in[i], 1, static_cast<std::int64_t>(4'000'000 * i)).empty();
  });
  if (faults > 0) std::fprintf(stderr, "%zu telegrams were not answered\n", faults), std::exit(1);
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  const int repetitions = argc > 1 ? std::max(1, std::atoi(argv[1])) : 500;
  TelegramLayout book = book_layout();
  book.transport = Transport::Udp;
  std::string json;
  for (const auto& [name, layout] : {std::pair{"krc4", usual_layout(Controller::Krc4)}, std::pair{"book", book}}) {
    const Figures f = measured(layout, repetitions);
    std::printf("%-5s %4zu bytes: decode + encode %.2f us, all of a cycle %.2f us\n", name, f.bytes, f.codec,
                f.session);
    char entry[160];
    std::snprintf(entry, sizeof entry, R"(%s{"layout": "%s", "bytes": %zu, "codec_us": %.3f, "session_us": %.3f})",
                  json.empty() ? "" : ", ", name, f.bytes, f.codec, f.session);
    json += entry;
  }
  std::printf("[%s]\n", json.c_str());
}
