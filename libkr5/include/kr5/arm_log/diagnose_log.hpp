// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include <kr5/arm_log/arm_log.hpp>
#include <kr5/arm_log/best_arm.hpp>
#include <kr5/arm_log/log_note.hpp>
#include <kr5/arm_log/log_recording.hpp>
#include <kr5/cell/recording.hpp>
#include <kr5/gap/diagnose.hpp>
#include <kr5/predict/fast_simulator.hpp>

/// @file
/// From the log of a real arm and its model to a diagnosis, in stages: parts to try (model_parts.hpp), experiments
/// (log_recording.hpp), torque constants (torque_constants.hpp), noise (reading_noise.hpp), error of the best arm with
/// the delay of its loads, width of the search (best_arm.hpp), diagnosis (kr5/gap/diagnose.hpp).

namespace kr5::arm_log {

struct LogDiagnosisOptions {
  gap::DiagnoseOptions search;  ///< Of the diagnosis; what stands at its default is set for the log of a real arm.
  /// Whether the torque constants of the model hold although they are all 1, as those of a description, which states
  /// none. Otherwise such are estimated from a log of currents.
  bool constants_stated = false;
  bool trust = false;  ///< Whether numbers that are implausible (log_problem.hpp) are compared nevertheless.
};

/// A diagnosis, and what it was made of.
struct LogDiagnosis {
  gap::Diagnosis diagnosis;
  cell::Recording recording;  ///< Experiments of the log; its cell is the model with what the log tells of it.
  BestArmErrors best_arm;
  std::vector<LogNote> notes;        ///< What was taken of the log or added to the model, in the order of the stages.
  std::vector<LogProblem> problems;  ///< What speaks against the log, where it was trusted nevertheless.
};

/// Completes a model by what a recording of it tells: torque constants, where the model states none and currents were
/// logged, and the noise of columns for which it states none. Returns notes of it, and of the scale of the torques
/// where no loads were logged.
/// @param readings As of add_reading_noise.
/// @throws InvalidArgument naming the joint whose torque constant the motions do not tell.
std::vector<LogNote> complete_model(cell::Recording& recording, const Readings& readings = {},
                                    bool constants_stated = false);

/// The recording of a log with a model that is completed by it: all stages before the diagnosis.
/// @throws InvalidArgument as record_log and complete_model, and with everything that speaks against the numbers of the
/// log, unless they are trusted.
LogRecording prepare_log(const ArmLog& log, const cell::Cell& model, const LogDiagnosisOptions& options = {});

/// Why a model and a recorded cell disagree: gap::diagnose, for motions on measured positions with the errors of the
/// best arm and a search as wide as the log of a real arm needs; for motions by torque servos from servos, friction and
/// rotors as identify_servos() fits them, where those of the model are far off. Any other recording is diagnosed as it
/// is.
gap::Diagnosis diagnose(const cell::Recording& recording, const cell::Simulator& simulator,
                        const gap::DiagnoseOptions& options = {});

/// Why a model and the arm of a log disagree: all stages. @param simulator By which hypotheses are tried.
/// @throws InvalidArgument for a log that does not suffice or does not fit the model, naming field and remedy.
LogDiagnosis diagnose_log(const ArmLog& log, const cell::Cell& model, const LogDiagnosisOptions& options = {},
                          const cell::Simulator& simulator = predict::FastSimulator());

}  // namespace kr5::arm_log
