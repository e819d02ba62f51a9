// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <kr5/robot/sensing.hpp>
#include <kr5/rsi/duration_histogram.hpp>
#include <kr5/rsi/link_finding_kind.hpp>
#include <kr5/rsi/link_observations.hpp>
#include <kr5/rsi/link_options.hpp>

/// @file
/// What is wrong with a link, by what was seen at its port.

namespace kr5::rsi {

struct DiagnosisOptions {
  std::optional<double> cycle = {};
  std::optional<double> deadline = {};
  double silence = 0.5;
  double jitter = 0.25;
  double clock_jump = 0.1;
  int min_telegrams = 50;
  robot::CommandMode mode = robot::CommandMode::Absolute;
  robot::CommandFrame frame = robot::CommandFrame::Base;
  std::optional<robot::SensorModel> model = {};
  double position_tolerance = 0.02;
  double gain_tolerance = 0.2;

  /// @throws InvalidArgument naming the field.
  void validate() const;
  /// Of a controller, where none is stated [s].
  double cycle_of(Controller controller) const noexcept;

  static void each_field(auto& self, auto&& visit) {
    visit("cycle", self.cycle, "Cycle of the controller; none: 12 ms of a KR C2, 4 ms of the others [s].");
    visit("deadline", self.deadline, "Time within which an answer is due; none: ten twelfths of the cycle [s].");
    visit("silence", self.silence, "Time without a telegram that is an interruption [s].");
    visit("jitter", self.jitter, "Jitter, as a share of the cycle, that 1 % of the telegrams may exceed [-].");
    visit("clock_jump", self.clock_jump, "Least jump of a clock that is reported [s].");
    visit("min_telegrams", self.min_telegrams, "Telegrams without which a link is not called sound.");
    visit("mode", self.mode, "Corrections, as in the controller's program: absolute | relative.");
    visit("frame", self.frame, "Axes of Cartesian corrections, as in the controller's program: base | tool.");
    visit("model", self.model, "Arm and tool, with which axis values are compared with the pose; none: they are not.");
    visit("position_tolerance", self.position_tolerance,
          "Distance between the pose that the controller tells and that of its axis values, up to which they agree "
          "[m].");
    visit("gain_tolerance", self.gain_tolerance, "Relative error of the motion per correction that is no fault [-].");
  }
};

/// One thing that is wrong. Which numbers are set depends on the kind (`LinkFindingKind`).
struct LinkFinding {
  LinkFindingKind kind = LinkFindingKind::NoTelegrams;
  FindingSeverity severity = FindingSeverity::Fault;
  std::uint64_t count = 0;
  std::uint64_t of = 0;
  std::optional<double> first = {};
  std::optional<double> measured_time = {};
  std::optional<double> expected_time = {};
  std::optional<double> distance = {};
  std::optional<double> other_distance = {};
  std::optional<double> gain = {};
  std::vector<std::string> names = {};
  std::string found = {};
  std::string expected = {};

  static void each_field(auto& self, auto&& visit) {
    visit("kind", self.kind, "What is wrong.");
    visit("severity", self.severity, "Whether a link can work with it: fault (no) | caution (yes).");
    visit("count", self.count, "How often it was seen.");
    visit("of", self.of, "Among how many datagrams or answers.");
    visit("first", self.first, "When it was seen first, since listening began [s].");
    visit("measured_time", self.measured_time, "Measured cycle, jitter, pause, jump or time of answer [s].");
    visit("expected_time", self.expected_time, "What it should be at most, or be [s].");
    visit("distance", self.distance, "Between the pose told and that of the axis values in degrees [m].");
    visit("other_distance", self.other_distance, "The same where axis values are taken as radians [m].");
    visit("gain", self.gain, "Motion over correction [-].");
    visit("names", self.names, "Elements, faults of telegrams, senders or axes.");
    visit("found", self.found, "What stood there.");
    visit("expected", self.expected, "What should stand there.");
  }
};

enum class LinkVerdict {
  Sound,
  Faulty,     ///< There is a finding that is a fault.
  Undecided,  ///< No fault was seen, in too few telegrams.
};
constexpr auto enum_names(LinkVerdict) {
  using enum LinkVerdict;
  return names<LinkVerdict>({{Sound, "sound"}, {Faulty, "faulty"}, {Undecided, "undecided"}});
}

struct LinkDiagnosis {
  LinkVerdict verdict = LinkVerdict::Undecided;
  std::vector<LinkFinding> findings;
  TelegramCounts telegrams;
  std::vector<std::string> senders;
  std::optional<double> cycle;
  Distribution period;
  Distribution answer;
  bool pose_compared = false;
  bool motion_compared = false;

  static void each_field(auto& self, auto&& visit) {
    visit("verdict", self.verdict, "Verdict: sound | faulty | undecided.");
    visit("findings", self.findings, "What is wrong, faults first.");
    visit("telegrams", self.telegrams, "Telegrams by what was wrong with them.");
    visit("senders", self.senders, "Who sent telegrams, the controller first.");
    visit("cycle", self.cycle, "Measured cycle; none: too few telegrams [s].");
    visit("period", self.period, "Time from telegram to telegram.");
    visit("answer", self.answer, "Time from the arrival of a telegram to its answer.");
    visit("pose_compared", self.pose_compared, "True where axis values were compared with the pose.");
    visit("motion_compared", self.motion_compared, "True where motions were compared with corrections.");
  }
};

/// What is wrong with the link of a layout. It knows what was observed, the layout and the options, nothing else.
/// @throws InvalidArgument as layout and options.
LinkDiagnosis examine_link(const LinkObservations& observations, const TelegramLayout& layout,
                           const DiagnosisOptions& options = {});

}  // namespace kr5::rsi
