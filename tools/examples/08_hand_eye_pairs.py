"""Where the camera sits on the arm, from pairs of poses without images."""

import kr5
import numpy as np
from kr5 import calibration, io

table = np.asarray(io.load_csv(kr5.share("data/pairs/pairs.csv")).values)
robot = calibration.to_poses(table[:, :7], calibration.PoseFormat())
seen = calibration.to_poses(table[:, 7:], calibration.PoseFormat())
pairs = [
    calibration.PosePair(name=f"pair {i + 1}", T_base_flange=T, T_camera_target=M)
    for i, (T, M) in enumerate(zip(robot, seen))
]
readings = calibration.compare_pair_readings(pairs, "eye_in_hand")
print("as written:", "yes" if readings.certain and not readings.readings[0].robot_inverted else "no")
result = calibration.calibrate_hand_eye_pairs(pairs)
sigma = 1e3 * np.sqrt(np.trace(result.covariance[:3, :3]))
place = "{:.1f} {:.1f} {:.1f}".format(*1e3 * result.T_mount_camera[:3, 3])
print(f"camera on flange at {place} mm, known to {sigma:.1f} mm")
for view in result.views:
    if view.outlier:
        print("left out:", view.name)
