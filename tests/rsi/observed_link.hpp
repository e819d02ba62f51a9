#pragma once

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include <kr5/core/random.hpp>
#include <kr5/rsi/link_observations.hpp>

namespace kr5::test {

/// A cycle of a made-up controller: what it sends, and what it gets.
struct MadeCycle {
  double time = 0.0;       ///< Of the arrival [s].
  std::uint64_t ipoc = 0;  ///< [ms]
  std::string sender = "192.168.1.20:49152";
  std::array<double, 6> pose{}, path{};       ///< X Y Z A B C [mm, deg].
  std::array<double, 6> axes{}, axis_path{};  ///< [deg]
  int delay = 0;
  double answer_time = 0.0;            ///< [s]
  std::array<double, 6> correction{};  ///< [deg]
  std::string answer_ipoc, answer_type = "ImFree";
  bool answered = true;
};

/// A link as it is seen at the computer, with all that differs from controller to controller drawn at random.
/// Telegrams and answers are written from the description of the interface.
class MadeLink {
 public:
  explicit MadeLink(Random& random, int cycles = 800, double cycle = 0.004) : random_(random) {
    const auto first = static_cast<std::uint64_t>(1000 + random.integer(2'000'000'000));
    for (int i = 0; i < 6; ++i) home_[static_cast<std::size_t>(i)] = random.uniform(-90, 90);
    begin_ = random.uniform(0.0, 0.02);
    for (int i = 0; i < cycles; ++i)
      add(begin_ + i * cycle, first + static_cast<std::uint64_t>(std::lround(1000 * i * cycle)));
    cycle_ = cycle;
  }

  std::vector<MadeCycle> cycles;
  bool answering = true;
  std::vector<Exchange> between;  ///< Of others.
  std::function<std::string(std::string, std::size_t)> change = [](std::string text, std::size_t) { return text; };
  double clock_set = 0.0, clock_set_at = 1e9;  ///< [s]
  double tail = 0.0;                           ///< Time of listening after the last telegram [s].

  /// Each axis one after the other, there and back, the arm following as a first-order lag of `gains`: rows are what
  /// moves, columns what is corrected.
  void move(const std::array<std::array<double, 6>, 6>& gains, double lag) {
    std::array<double, 6> moved{};
    for (std::size_t k = 0; k < cycles.size(); ++k) {
      MadeCycle& c = cycles[k];
      const double time = static_cast<double>(k) * cycle_, within = std::fmod(time, 1.2) - 0.4;
      const auto axis = static_cast<std::size_t>(time / 1.2);
      for (std::size_t i = 0; i < 6; ++i) {
        c.axes[i] = std::round(1e4 * (c.axis_path[i] + moved[i])) / 1e4;
        c.correction[i] = 0.0;
      }
      if (axis < 6 && within > 0 && within < 0.4) c.correction[axis] = 0.1 * std::pow(std::sin(M_PI * within / 0.4), 2);
      for (std::size_t i = 0; i < 6; ++i) {
        double demand = 0.0;
        for (std::size_t j = 0; j < 6; ++j) demand += gains[i][j] * c.correction[j];
        moved[i] += (demand - moved[i]) * (1 - std::exp(-cycle_ / lag));
      }
    }
  }

  LinkObservations seen() const {
    LinkObservations out{.duration = begin_ + tail, .port = 49152, .answering = answering};
    for (std::size_t k = 0; k < cycles.size(); ++k) {
      const MadeCycle& c = cycles[k];
      Exchange e{.time = c.time, .wall_time = wall(c.time), .sender = c.sender, .telegram = change(rob(c), k)};
      if (answering && c.answered) {
        e.answer = sen(c);
        e.duration = c.answer_time;
      }
      out.exchanges.push_back(e);
      out.duration = std::max(out.duration, c.time + tail);
    }
    for (Exchange e : between) {
      e.wall_time = wall(e.time);
      out.exchanges.push_back(e);
    }
    std::ranges::stable_sort(out.exchanges, {}, &Exchange::time);
    return out;
  }

  static std::string rob(const MadeCycle& c) {
    const auto six = [](const char* element, const char* names, const std::array<double, 6>& v) {
      std::string out = std::string("<") + element;
      for (std::size_t i = 0; i < 6; ++i) {
        std::array<char, 64> text;
        const std::string name = std::string(names) == "A1" ? "A" + std::to_string(i + 1) : std::string(1, names[i]);
        std::snprintf(text.data(), text.size(), " %s=\"%.4f\"", name.c_str(), v[i]);
        out += text.data();
      }
      return out + " />";
    };
    return "<Rob TYPE=\"KUKA\">" + six("RIst", "XYZABC", c.pose) + six("RSol", "XYZABC", c.path) +
           six("AIPos", "A1", c.axes) + six("ASPos", "A1", c.axis_path) + "<Delay D=\"" + std::to_string(c.delay) +
           "\" /><IPOC>" + std::to_string(c.ipoc) + "</IPOC></Rob>";
  }

  static std::string sen(const MadeCycle& c) {
    std::string out = "<Sen Type=\"" + c.answer_type + "\"><AK";
    for (std::size_t i = 0; i < 6; ++i) {
      std::array<char, 64> text;
      std::snprintf(text.data(), text.size(), " A%zu=\"%.6f\"", i + 1, c.correction[i]);
      out += text.data();
    }
    return out + " /><IPOC>" + (c.answer_ipoc.empty() ? std::to_string(c.ipoc) : c.answer_ipoc) + "</IPOC></Sen>";
  }

 private:
  void add(double time, std::uint64_t ipoc) {
    MadeCycle c;
    c.time = time + std::abs(random_.normal(1e-4));
    c.ipoc = ipoc;
    c.axes = c.axis_path = home_;
    c.pose = c.path = {445.0, 0.0, 790.0, 0.0, 90.0, 0.0};
    c.answer_time = random_.uniform(5e-5, 8e-4);
    cycles.push_back(c);
  }
  double wall(double time) const { return 1.7e9 + time + (time > clock_set_at ? clock_set : 0.0); }

  Random& random_;
  std::array<double, 6> home_{};
  double begin_ = 0.0, cycle_ = 0.004;
};

}  // namespace kr5::test
