"""Tool centre point from touches of one point."""

import kr5
import numpy as np
from kr5 import calibration

data = calibration.load_pose_set(kr5.share("data/touches/dataset.yaml"))
result = calibration.calibrate_tool(data.poses())
for axis, value, variance in zip("xyz", result.tip, np.diag(result.covariance)):
    print(f"{axis} {1e3 * value:.2f} +- {1e3 * np.sqrt(variance):.2f} mm")
for warning in result.warnings:
    print(warning)
