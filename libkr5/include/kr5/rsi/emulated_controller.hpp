// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <string_view>
#include <vector>

#include <kr5/robot/robot.hpp>
#include <kr5/rsi/correction_total.hpp>
#include <kr5/rsi/emulation_options.hpp>
#include <kr5/rsi/late_answers.hpp>
#include <kr5/rsi/programmed_path.hpp>
#include <kr5/rsi/telegram_codec.hpp>

/// @file
/// The controller's end of the sensor interface without socket and clock: it moves a robot, tells what it measures, and
/// judges the answers by the rules of a controller.

namespace kr5::rsi {

/// What became of an answer.
enum class AnswerVerdict {
  Good,      ///< It corrects the path in the next cycle.
  Faulty,    ///< It is no telegram of the layout.
  Foreign,   ///< Its IPOC is none that was sent.
  Late,      ///< It answers an earlier telegram, or came after the time for it.
  Repeated,  ///< The telegram was answered already.
  Unasked,   ///< There is no telegram to answer.
};
constexpr auto enum_names(AnswerVerdict) {
  using enum AnswerVerdict;
  return names<AnswerVerdict>({{Good, "good"},
                               {Faulty, "faulty"},
                               {Foreign, "foreign"},
                               {Late, "late"},
                               {Repeated, "repeated"},
                               {Unasked, "unasked"}});
}

/// A cycle is a call of `cycle` and then one of `receive` for each answer. The next cycle judges them: without a good
/// one HOLDON decides which corrections stay. What the arm does in a cycle is told at its end. The controller knows of
/// the robot what its readings say.
class EmulatedController {
 public:
  /// Starts the program where the arm stands. @param model The arm as the controller believes it. @param robot Outlives
  /// the controller; its cycle is that of the rules.
  /// @throws InvalidArgument as layout, model and options, and for a robot that does not fit them.
  EmulatedController(const TelegramLayout& layout, const robot::SensorModel& model, const EmulationOptions& options,
                     robot::Robot& robot);

  /// Moves the robot for a cycle; the telegram of its end, good until the next call. Empty: there is none.
  std::string_view cycle();
  /// An answer, some time after the telegram [s].
  AnswerVerdict receive(std::string_view bytes, double since) noexcept;

  /// Off: the arm stops. On: the program goes on, also after an emergency stop.
  void set_drives(bool on);
  void emergency_stop();
  /// @param share 0 to 1. @throws InvalidArgument.
  void set_override(double share);
  /// The program is reset and started again: a new connection, a path from where the arm stands, no correction.
  void reset_program();
  /// The computer has closed the connection.
  void disconnect();
  /// Cycles that were due and did not happen, for the record.
  void note_overrun(std::uint64_t cycles);

  const EmulationStatistics& statistics() const noexcept { return statistics_; }
  /// Since the beginning; the first ten thousand.
  const std::vector<ControllerEvent>& events() const noexcept { return events_; }
  const robot::RobotReading& reading() const noexcept { return reading_; }
  const CorrectionTotal& correction() const noexcept { return total_; }
  const EmulationOptions& options() const noexcept { return options_; }

 private:
  bool relative() const noexcept { return options_.mode == robot::CommandMode::Relative; }
  bool has_arm() const noexcept { return !model_.arm.joints.empty(); }
  std::uint64_t ipoc_now() const noexcept;
  void begin();
  void judge();
  void apply(const Correction& received, bool answered);
  bool idles(const Correction& received, bool answered) noexcept;
  void note_jump(const robot::JointVector& joints, const Pose& tool);
  void move();
  Pose path_tool(const robot::JointVector& joints) const noexcept;
  ProgramStop axis_too_fast(const robot::JointVector& setpoints) const noexcept;
  robot::RobotCommand command(const robot::JointVector& setpoints) const noexcept;
  void take_answer() noexcept;
  std::string_view tell();
  void end(const ProgramStop& stop);
  void note(EventKind kind, double value = 0.0, const ProgramStop& stop = {});

  TelegramCodec writer_, greeter_, reader_;
  TelegramUnits units_;
  robot::SensorModel model_;
  EmulationOptions options_;
  robot::Robot& robot_;
  bool only_send_;
  std::vector<bool> holds_;  ///< Of each value that is received: it stays while no answer comes.
  CorrectionTotal total_;
  LateAnswers late_;
  ProgrammedPath path_;

  robot::RobotReading reading_;
  std::optional<Pose> start_tool_;  ///< Of a robot without joints.
  robot::JointVector setpoints_;    ///< Of the last cycle.
  Telegram answer_, applied_, out_;
  robot::GripperCommand gripper_;
  std::uint64_t cycle_ = 0, begun_at_ = 0, sent_of_program_ = 0;
  int idle_ = 0;  ///< Cycles.
  bool asked_ = false, answered_ = false;
  bool met_ = false;  ///< There was a good answer in this program.
  std::array<char, max_telegram> bytes_{};
  EmulationStatistics statistics_;
  std::vector<ControllerEvent> events_;
};

}  // namespace kr5::rsi
