// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <kr5/core/fields.hpp>

namespace kr5::rsi {

/// What can be wrong with a link, and which numbers of its finding say so.
enum class LinkFindingKind {
  NoTelegrams,          ///< Nothing came; measured_time: of listening.
  WrongPort,            ///< Nothing came, but `count` datagrams for ports on which nobody listens.
  OtherPort,            ///< The layout has another port than the one that was listened on: found, expected.
  OtherAddress,         ///< The layout's address is none of this computer: found.
  ForeignDatagrams,     ///< No telegrams: names are the senders, found is the beginning of one.
  WrongType,            ///< Type of telegrams or answers: found, expected; names: "telegrams" or "answers".
  MissingElements,      ///< Of the layout: names.
  UnknownElements,      ///< That the layout does not have: names.
  OtherOrder,           ///< Order of the elements: found, expected.
  DamagedTelegrams,     ///< names: their faults.
  WrongRate,            ///< measured_time, expected_time: cycle.
  LostTelegrams,        ///< `count` by the gaps of IPOC.
  RepeatedTelegrams,    ///< The same IPOC again.
  ReorderedTelegrams,   ///< IPOC less than before.
  Jitter,               ///< measured_time: what 1 % of the telegrams exceed.
  Interrupted,          ///< measured_time: the longest pause.
  StoppedSending,       ///< first: when; measured_time: until the end of listening.
  ControllerRestarted,  ///< IPOC began anew after a pause; measured_time: the pause.
  ControllerClockJump,  ///< IPOC against the arrivals; measured_time: the largest jump.
  ComputerClockJump,    ///< The clock of this computer was set; measured_time: the largest jump.
  SecondSender,         ///< names: the controller's address, then the others.
  LateAnswers,          ///< Answers of this computer; measured_time: what 1 % exceed; expected_time: the deadline.
  IpocNotEchoed,        ///< Answers with another IPOC than their telegram: found, expected.
  AnswersRejected,      ///< `count` the controller counts as late, while `of` answers left in time.
  RadianAxes,           ///< Axis values are radians: distance, other_distance.
  PoseMismatch,         ///< Pose and axis values do not agree with the cell: distance.
  CorrectionIgnored,    ///< names: what did not follow.
  CorrectionSign,       ///< names: what moved the other way; gain.
  CorrectionAxis,       ///< names: what was corrected, what moved instead; gain.
  CorrectionUnit,       ///< names: what moved as by another unit, which is `found`; gain.
  CorrectionScale,      ///< names: what moved otherwise than corrected; gain.
};
constexpr auto enum_names(LinkFindingKind) {
  using enum LinkFindingKind;
  return names<LinkFindingKind>({{NoTelegrams, "no_telegrams"},
                                 {WrongPort, "wrong_port"},
                                 {OtherPort, "other_port"},
                                 {OtherAddress, "other_address"},
                                 {ForeignDatagrams, "foreign_datagrams"},
                                 {WrongType, "wrong_type"},
                                 {MissingElements, "missing_elements"},
                                 {UnknownElements, "unknown_elements"},
                                 {OtherOrder, "other_order"},
                                 {DamagedTelegrams, "damaged_telegrams"},
                                 {WrongRate, "wrong_rate"},
                                 {LostTelegrams, "lost_telegrams"},
                                 {RepeatedTelegrams, "repeated_telegrams"},
                                 {ReorderedTelegrams, "reordered_telegrams"},
                                 {Jitter, "jitter"},
                                 {Interrupted, "interrupted"},
                                 {StoppedSending, "stopped_sending"},
                                 {ControllerRestarted, "controller_restarted"},
                                 {ControllerClockJump, "controller_clock_jump"},
                                 {ComputerClockJump, "computer_clock_jump"},
                                 {SecondSender, "second_sender"},
                                 {LateAnswers, "late_answers"},
                                 {IpocNotEchoed, "ipoc_not_echoed"},
                                 {AnswersRejected, "answers_rejected"},
                                 {RadianAxes, "radian_axes"},
                                 {PoseMismatch, "pose_mismatch"},
                                 {CorrectionIgnored, "correction_ignored"},
                                 {CorrectionSign, "correction_sign"},
                                 {CorrectionAxis, "correction_axis"},
                                 {CorrectionUnit, "correction_unit"},
                                 {CorrectionScale, "correction_scale"}});
}

/// Whether a link can work with what is wrong.
enum class FindingSeverity { Fault, Caution };
constexpr auto enum_names(FindingSeverity) {
  return names<FindingSeverity>({{FindingSeverity::Fault, "fault"}, {FindingSeverity::Caution, "caution"}});
}

}  // namespace kr5::rsi
