"""Why the model of an arm and a log of it disagree: a CSV log, a URDF, the library alone."""

import kr5
from kr5 import arm_log, cell

folder = kr5.share("data/arm_log")
model = cell.import_urdf(folder / "arm.urdf").cell

# Columns are found by the names of the joints; LogColumns names them where they have others.
log = arm_log.read_log(folder / "joint_states.csv", model)
found = arm_log.diagnose_log(log, model)

print(f"{len(log.t)} rows of {model.robot.joints} joints")
for note in found.notes:
    print(f"- {note.text(found.recording.cell)}")
diagnosis = found.diagnosis
print(f"verdict: {diagnosis.verdict}")
for cause in diagnosis.causes:
    for p in cause.parameters:
        print(f"{cause.effect} of {cause.target}: {p.name} {p.value[0]:.2f} +- {p.std[0]:.2f} {p.unit}")
print(f"gap: {diagnosis.reduction.before:.1f} before, {diagnosis.reduction.after:.1f} after")

# What does not fit the model is refused, with field and remedy.
wrong = arm_log.ArmLog(t=log.t, q=log.q, effort=log.effort[:, :5])
try:
    arm_log.diagnose_log(wrong, model)
except kr5.InvalidArgument as error:
    print(f"refused: {error}")
