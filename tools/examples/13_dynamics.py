"""Dynamics of an arm from a log of positions and torques: check, smooth, identify, predict."""

import kr5
import numpy as np
from kr5 import cell, identification

arm = cell.load_cell(kr5.share("cells/kr5_arc.yaml"))
n = arm.robot.joints

# A log as a controller writes it, every 12 ms; here the motion of each joint is two sines within its limits.
t = 0.012 * np.arange(2500)
middle = 0.5 * (arm.robot.limits.lower + arm.robot.limits.upper)
q, qd, qdd = np.tile(middle, (len(t), 1)), np.zeros((len(t), n)), np.zeros((len(t), n))
for joint in range(n):
    for amplitude, w in ((0.5, 0.9 + 0.23 * joint), (0.25, 2.6 + 0.31 * joint)):
        q[:, joint] += amplitude * np.sin(w * t)
        qd[:, joint] += amplitude * w * np.cos(w * t)
        qdd[:, joint] -= amplitude * w * w * np.sin(w * t)
states = identification.JointMotion(t=t, q=q, qd=qd, qdd=qdd, tau=np.zeros_like(q))
log = identification.JointLog(t=t, q=q, tau=identification.nominal_torques(arm, states))

conditioned = identification.condition_log(log, identification.ConditioningOptions(smooth_torques=False))
print(f"{len(conditioned.findings)} findings about the log")
model = identification.DynamicsModel(
    chain=arm.nominal_chain(), gravity=arm.robot.gravity, structure=arm.drives.structure
)
found = identification.identify_dynamics(conditioned.motion, model)
print(
    f"{found.base.size} base parameters of {len(found.base.parameters)}, usable: {'yes' if found.fit.usable else 'no'}"
)
print(f"torques held out predicted within 2 %: {'yes' if found.held_out.total < 0.02 else 'no'}")
print(f"friction of joint 3: {found.parameter('fc3')[0]:.1f} N m, in the cell {arm.drives.friction.coulomb[2]:.1f} N m")

# Torques of joint 2 with the wrong sign: the log is refused, and the column named.
log.tau = np.asarray(log.tau) * np.where(np.arange(n) == 1, -1.0, 1.0)
refused = identification.condition_log(log)
print(f"usable: {'yes' if refused.usable else 'no'}; {refused.findings[0].column}: {refused.findings[0].fault}")
