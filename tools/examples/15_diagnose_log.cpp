// SPDX-License-Identifier: BSD-3-Clause
// Why the model of an arm and a log of it disagree: a CSV log, a URDF, libkr5 alone.  15_diagnose_log SHARE
#include <cstdio>
#include <filesystem>
#include <string>

#include <kr5/arm_log/diagnose_log.hpp>
#include <kr5/arm_log/read_log.hpp>
#include <kr5/cell/import_urdf.hpp>

using namespace kr5;

int main(int, char** argv) {
  const auto folder = std::filesystem::path(argv[1]) / "data/arm_log";
  const cell::Cell model = cell::import_urdf(folder / "arm.urdf").cell;

  // Columns are found by the names of the joints; LogColumns names them where they have others.
  const arm_log::ArmLog log = arm_log::read_log(folder / "joint_states.csv", model);
  const arm_log::LogDiagnosis found = arm_log::diagnose_log(log, model);

  std::printf("%d rows of %d joints\n", static_cast<int>(log.t.size()), model.robot.joints());
  for (const arm_log::LogNote& note : found.notes)
    std::printf("- %s\n", arm_log::text(note, found.recording.cell).c_str());
  const gap::Diagnosis& diagnosis = found.diagnosis;
  std::printf("verdict: %s\n", std::string(name_of(diagnosis.verdict)).c_str());
  for (const gap::Cause& cause : diagnosis.causes)
    for (const gap::ParameterEstimate& p : cause.parameters)
      std::printf("%s of %s: %s %.2f +- %.2f %s\n", cause.effect.c_str(), cause.target.c_str(), p.name.c_str(),
                  p.value[0], p.std[0], p.unit.c_str());
  std::printf("gap: %.1f before, %.1f after\n", diagnosis.reduction.before, diagnosis.reduction.after);

  // What does not fit the model is refused, with field and remedy.
  arm_log::ArmLog wrong = log;
  wrong.effort.conservativeResize(Eigen::NoChange, 5);
  try {
    arm_log::diagnose_log(wrong, model);
  } catch (const InvalidArgument& error) {
    std::printf("refused: %s\n", error.what());
  }
}
