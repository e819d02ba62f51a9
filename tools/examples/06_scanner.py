"""Line scanner on the flange from profiles of a ball."""

import kr5
import numpy as np
from kr5 import calibration

T_flange_scanner = kr5.to_pose([0.11, 0.045, 0.34, 3.0, 0.2, -0.4])
ball, radius = np.array([0.7, 0.05, 0.2]), 0.02  # in the base
views = []
for k in range(20):
    # The ball in the scanner, and the arc of its section.
    at = np.array([0.015 * np.sin(k), 0.008 * np.cos(2 * k), 0.19 + 0.015 * np.cos(k)])
    x = np.linspace(-0.05, 0.05, 201)
    inside = radius**2 - at[1] ** 2 - (x - at[0]) ** 2
    z = np.where(inside > 0, at[2] - np.sqrt(np.maximum(inside, 0)), np.nan)
    T_base_scanner = kr5.to_pose([0, 0, 0, 0.3 * np.sin(k), 3 + 0.3 * np.cos(3 * k), 0.5 * k])
    T_base_scanner[:3, 3] = ball - T_base_scanner[:3, :3] @ at
    feature = calibration.find_profile_feature(
        calibration.LineProfile(x=x, z=z), "sphere", calibration.ProfileFeatureOptions(radius=radius)
    )
    T_base_flange = T_base_scanner @ np.linalg.inv(T_flange_scanner)
    views.append(calibration.ScannerView(target="ball", T_base_flange=T_base_flange, feature=feature))
result = calibration.calibrate_scanner(views, [calibration.ScanTarget(name="ball", kind="sphere", radius=radius)])
pose = kr5.to_vector(result.T_flange_scanner)
print("position {:.3f} {:.3f} {:.3f} mm".format(*(1e3 * pose[:3])))
print("rotation {:.4f} {:.4f} {:.4f} rad".format(*pose[3:]))
print("ball {:.3f} {:.3f} {:.3f} mm".format(*(1e3 * result.targets[0].position)))
