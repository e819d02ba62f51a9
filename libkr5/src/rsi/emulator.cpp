// SPDX-License-Identifier: BSD-3-Clause
#include <kr5/rsi/emulator.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <ctime>
#include <mutex>

#include <poll.h>

#include <kr5/core/error.hpp>

#include "rsi/emulator_line.hpp"
#include "rsi/real_time_thread.hpp"

namespace kr5::rsi {
namespace {

constexpr double in_second = 1e9;  // [ns]

TelegramLayout validated(const TelegramLayout& layout, const EmulatorOptions& options) {
  layout.validate();
  options.validate();
  return layout;
}

}  // namespace

void EmulatorOptions::validate() const {
  controller.validate();
  telegram_faults.validate();
  answer_faults.validate();
  require(own_port >= 0 && own_port <= 65535, "own_port: must lie between 0 and 65535");
  require(!restart || (*restart >= 0 && *restart <= 3600), "restart: must lie between 0 and an hour [s]");
  real_time.validate();
}

class Emulator::Machine {
 public:
  Machine(const TelegramLayout& layout, const robot::SensorModel& model, const EmulatorOptions& options,
          robot::Robot& robot)
      : controller_(validated(layout, options), model, options.controller, robot),
        line_(layout, options.telegram_faults, options.answer_faults, options.own_port),
        restart_(options.restart),
        cycle_(std::llround(in_second * options.controller.rules.cycle)),
        thread_("the emulator") {
    thread_.begin(options.real_time, [this] { run(); });
  }
  Machine(const Machine&) = delete;
  Machine& operator=(const Machine&) = delete;

  template <class Use>
  auto with_controller(Use use) {
    const std::lock_guard held(lock_);
    return use(controller_);
  }
  void reset() noexcept { reset_.store(true); }
  RealTimeStatus real_time() const noexcept { return thread_.status(); }
  int own_port() {
    const std::lock_guard held(lock_);
    return line_.own_port();
  }

  EmulatorStatistics statistics() {
    const std::lock_guard held(lock_);
    EmulatorStatistics out;
    out.controller = controller_.statistics();
    out.telegram_faults = line_.telegram_counts();
    out.answer_faults = line_.answer_counts();
    out.period = period_.summary();
    out.lateness = lateness_.summary();
    out.answer = answer_.summary();
    out.overruns = overruns_;
    out.unsent = line_.unsent();
    out.strangers = line_.strangers();
    out.connected = line_.connected();
    out.failure = failure_;
    return out;
  }

 private:
  void run() noexcept {
    due_ = steady_now() + cycle_;
    try {
      while (wait()) {
        const std::lock_guard held(lock_);
        const std::int64_t now = steady_now();
        line_.flush(now);
        hear(now);
        if (now >= due_) tick(now);
      }
    } catch (const std::exception& e) {
      const std::lock_guard held(lock_);
      failure_ = e.what();
      line_.close();  // a client sees that it is over
    }
  }

  /// Until something is due or comes; false when the emulator ends.
  bool wait() noexcept {
    const std::int64_t left = std::max<std::int64_t>(std::min(due_, line_.next_time()) - steady_now(), 0);
    std::array<pollfd, 2> watched = {{{thread_.ending(), POLLIN, 0}, {line_.descriptor(), POLLIN, 0}}};
    const timespec patience{left / 1'000'000'000, left % 1'000'000'000};
    ppoll(watched.data(), watched.size(), &patience, nullptr);
    return watched[0].revents == 0;
  }

  void hear(std::int64_t now) noexcept {
    line_.read(now);
    for (EmulatorLine::Heard heard = line_.next(now); heard.any; heard = line_.next(now)) {
      const std::int64_t since = heard.arrival - sent_;
      if (controller_.receive(heard.bytes, static_cast<double>(since) / in_second) == AnswerVerdict::Good)
        answer_.add(since);
    }
  }

  void tick(std::int64_t now) {
    const std::int64_t missed = (now - due_) / cycle_;
    if (missed > 0) {
      overruns_ += static_cast<std::uint64_t>(missed);
      controller_.note_overrun(static_cast<std::uint64_t>(missed));
      due_ += missed * cycle_;
    }
    take_connection(now);
    const bool ended = controller_.statistics().phase == ControllerPhase::Ended;
    if (line_.connected() || ended) cycle();
    due_ += cycle_;
  }

  void cycle() {
    const bool ended = controller_.statistics().phase == ControllerPhase::Ended;
    const std::string_view telegram = controller_.cycle();
    used_ = true;
    const std::int64_t now = steady_now();
    if (!telegram.empty()) {
      if (sent_ > 0) period_.add(now - sent_);
      lateness_.add(now - due_);
      sent_ = now;
      line_.send(telegram, now);
    }
    if (!ended && controller_.statistics().phase == ControllerPhase::Ended) {
      ended_ = now;
      line_.close();
    }
  }

  /// The line comes and goes, and the program with it.
  void take_connection(std::int64_t now) {
    if (line_.over()) controller_.disconnect(), ended_ = now, line_.close();
    const bool ended = controller_.statistics().phase == ControllerPhase::Ended;
    const bool again = ended && restart_ && now - ended_ >= std::llround(in_second * *restart_);
    if (reset_.exchange(false) || again) {
      line_.close();
      start();
    } else if (!ended && line_.open(now) && used_) {
      start();
    }
  }

  void start() {
    controller_.reset_program();
    used_ = false;
    sent_ = 0;
  }

  std::mutex lock_;  ///< Of all but the thread itself.
  EmulatedController controller_;
  EmulatorLine line_;
  std::optional<double> restart_;
  std::int64_t cycle_, due_ = 0, sent_ = 0, ended_ = 0;  ///< [ns]
  bool used_ = false;                                    ///< The program has moved.
  std::atomic<bool> reset_{false};
  DurationHistogram period_, lateness_, answer_;
  std::uint64_t overruns_ = 0;
  std::string failure_;
  RealTimeThread thread_;
};

Emulator::Emulator(const TelegramLayout& layout, const robot::SensorModel& model, const EmulatorOptions& options,
                   robot::Robot& robot)
    : machine_(std::make_unique<Machine>(layout, model, options, robot)) {}

Emulator::~Emulator() = default;

void Emulator::set_drives(bool on) {
  machine_->with_controller([on](EmulatedController& c) { c.set_drives(on); });
}
void Emulator::emergency_stop() {
  machine_->with_controller([](EmulatedController& c) { c.emergency_stop(); });
}
void Emulator::set_override(double share) {
  machine_->with_controller([share](EmulatedController& c) { c.set_override(share); });
}
void Emulator::reset_program() { machine_->reset(); }

EmulatorStatistics Emulator::statistics() const { return machine_->statistics(); }
std::vector<ControllerEvent> Emulator::events() const {
  return machine_->with_controller([](const EmulatedController& c) { return c.events(); });
}
robot::RobotReading Emulator::reading() const {
  return machine_->with_controller([](const EmulatedController& c) { return c.reading(); });
}
robot::JointVector Emulator::joint_correction() const {
  return machine_->with_controller([](const EmulatedController& c) { return c.correction().joints(); });
}
Pose Emulator::tool_correction() const {
  return machine_->with_controller([](const EmulatedController& c) { return c.correction().tool(); });
}
int Emulator::own_port() const noexcept { return machine_->own_port(); }
RealTimeStatus Emulator::real_time() const noexcept { return machine_->real_time(); }

}  // namespace kr5::rsi
