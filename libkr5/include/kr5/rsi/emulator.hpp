// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <kr5/rsi/duration_histogram.hpp>
#include <kr5/rsi/emulated_controller.hpp>
#include <kr5/rsi/link_faults.hpp>
#include <kr5/rsi/real_time.hpp>

namespace kr5::rsi {

struct EmulatorOptions {
  EmulationOptions controller = {};
  LinkFaults telegram_faults = {};
  LinkFaults answer_faults = {};
  int own_port = 0;
  std::optional<double> restart = {};  ///< [s]
  RealTimeOptions real_time = {};

  /// @throws InvalidArgument naming the field.
  void validate() const;

  static void each_field(auto& self, auto&& visit) {
    visit("controller", self.controller, "The controller and its program.");
    visit("telegram_faults", self.telegram_faults, "Faults of the network with what the controller sends.");
    visit("answer_faults", self.answer_faults, "Faults with the answers.");
    visit("own_port", self.own_port, "UDP port that the controller sends from; 0: any that is free.");
    visit("restart", self.restart,
          "Time after which an ended program is reset and started again; none: it is not [s].");
    visit("real_time", self.real_time, "What the thread asks of the kernel.");
  }
};

/// Since the emulator began.
struct EmulatorStatistics {
  EmulationStatistics controller;
  LinkFaultCounts telegram_faults;
  LinkFaultCounts answer_faults;
  Distribution period;    ///< From telegram to telegram.
  Distribution lateness;  ///< From when a cycle was due to its telegram.
  Distribution answer;    ///< From a telegram to its good answer.
  std::uint64_t overruns = 0;
  std::uint64_t unsent = 0;
  std::uint64_t strangers = 0;
  bool connected = false;
  std::string failure = {};

  static void each_field(auto& self, auto&& visit) {
    visit("controller", self.controller, "What the controller has seen.");
    visit("telegram_faults", self.telegram_faults, "What became of the telegrams on the network.");
    visit("answer_faults", self.answer_faults, "What became of the answers.");
    visit("period", self.period, "From telegram to telegram.");
    visit("lateness", self.lateness, "From when a cycle was due to its telegram.");
    visit("answer", self.answer, "From a telegram to its good answer.");
    visit("overruns", self.overruns,
          "Cycles that this computer missed: nothing of them is to be held against a client.");
    visit("unsent", self.unsent, "Telegrams that the network did not take.");
    visit("strangers", self.strangers, "Datagrams of other computers than that of the layout.");
    visit("connected", self.connected, "True while a TCP connection is there; always with UDP.");
    visit("failure", self.failure, "Why the emulator has ended itself; empty: it runs.");
  }
};

/// A controller with its socket and clock, in a thread of its own: it sends to address and port of the layout, over UDP
/// or, as a KR C2, TCP, for anybody's client. All functions may be called from any thread.
class Emulator {
 public:
  /// Begins at once; over TCP once the computer takes the connection. @param robot Outlives the emulator.
  /// @throws InvalidArgument as EmulatedController; IoError when its own port is not free.
  Emulator(const TelegramLayout& layout, const robot::SensorModel& model, const EmulatorOptions& options,
           robot::Robot& robot);
  ~Emulator();
  Emulator(const Emulator&) = delete;
  Emulator& operator=(const Emulator&) = delete;

  void set_drives(bool on);
  void emergency_stop();
  /// @throws InvalidArgument.
  void set_override(double share);
  /// Closes the connection; the program starts anew.
  void reset_program();

  EmulatorStatistics statistics() const;
  std::vector<ControllerEvent> events() const;
  robot::RobotReading reading() const;
  /// The total correction of each joint [rad or m], and that of the tool.
  robot::JointVector joint_correction() const;
  Pose tool_correction() const;
  /// UDP port that the controller sends from.
  int own_port() const noexcept;
  RealTimeStatus real_time() const noexcept;

 private:
  class Machine;
  std::unique_ptr<Machine> machine_;
};

}  // namespace kr5::rsi
