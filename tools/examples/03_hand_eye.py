"""Where the camera sits on the arm, and whether to trust it."""

import kr5
from kr5 import calibration, vision

data = calibration.load_dataset(kr5.share("data/demo/dataset.yaml"))
board = kr5.parse_target(data.target)
camera = kr5.Pinhole(
    width=960, height=720, fx=913.2, fy=915.4, cx=491.8, cy=354.9, k1=-0.2018, k2=0.0904, p1=0.0002, p2=-0.0001
)
views = [vision.find_target(vision.load_image(file), board).view for file in data.images]
stops = [calibration.HandEyeView(T_base_flange=T, view=view) for T, view in zip(data.poses(), views)]
result = calibration.calibrate_hand_eye(stops, camera, calibration.HandEyeOptions(mount=data.mount))
diagnosis = calibration.diagnose_hand_eye(stops, camera, result)
print("camera on flange at {:.1f} {:.1f} {:.1f} mm".format(*1e3 * result.T_mount_camera[:3, 3]))
print(diagnosis.verdict)
for cause in diagnosis.causes:
    print(f"cause: {cause.cause}")
