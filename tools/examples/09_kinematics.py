"""True DH parameters of an arm from places of its tool that a tracker measured."""

import kr5
import numpy as np
from kr5 import calibration, cell, kinematics

nominal = cell.load_cell(kr5.share("cells/kr5_arc.yaml")).nominal_chain()
joints = list(nominal.joints)
joints[1].a += 0.8e-3  # what the tracker will find [m]
joints[2].theta_offset += 2e-3  # [rad]
true = kinematics.DhChain(joints, nominal.T_base_0)
ball = np.array([0.05, -0.02, 0.12])  # on the flange [m]

postures = []
for k in range(40):
    q = np.array([1.2 * np.sin((3 + j) * k + j) for j in range(6)])
    T = true.flange(q)
    seen = T[:3, :3] @ ball + T[:3, 3] + 1e-4 * np.array([np.sin(7.0 * k), np.sin(11.0 * k), np.sin(13.0 * k)])
    postures.append(calibration.ArmPosture(q=q, points=seen[:, None]))

result = calibration.calibrate_kinematics(nominal, postures)
for p in result.coordinates:
    if p.name in ("arm.joint2.a", "arm.joint3.theta_offset"):
        print(f"{p.name} {1e3 * (p.value - p.nominal):+.3f} +- {1e3 * p.std:.3f} 1e-3 {p.unit}")
print(f"noise {1e3 * result.sigma_position:.3f} mm")
