"""Which parameter of an arm moves its flange most, at a pose."""

import kr5
import numpy as np
from kr5 import cell, kinematics, uncertainty

chain = cell.load_cell(kr5.share("cells/kr5_arc_printed.yaml")).nominal_chain()
degree = np.pi / 180
parameters = kinematics.joint_parameters(chain)
q = np.array([0, 70, 12, 0, 0, 0]) * degree
arm = kinematics.DeviatedArm(nominal=chain, parameters=parameters, q=q)
inputs = [uncertainty.UncertainInput(name=p.label, sigma=1e-3 if p.is_length else degree) for p in parameters]

options = uncertainty.SobolOptions(samples=4096, resolution=1e-12)
result = uncertainty.sobol_indices(arm.errors, inputs, options)
for axis, variance, indices in zip("XYZ", result.variance, result.total.T):
    shares = "".join(f" {item.name} {index:.2f}" for item, index in zip(inputs, indices) if index > 0.1)
    print(f"{axis} varies by {1e3 * np.sqrt(variance):.1f} mm:{shares}")
