"""Calibrates a camera from images of a board, and says how well it is known."""

import kr5
import numpy as np
from kr5 import calibration, vision

data = calibration.load_dataset(kr5.share("data/demo/dataset.yaml"))
board = kr5.parse_target(data.target)
seen = [vision.find_target(vision.load_image(file), board) for file in data.images]
views = [found.view for found in seen if found.found]
result = vision.calibrate_camera(views, 960, 720)
print(f"{len(views)} views, {'usable' if result.fit.usable else result.fit.message}")
print(f"fx {result.camera.fx:.3f} +- {np.sqrt(result.covariance[0, 0]):.3f} px")
print(f"cx {result.camera.cx:.3f} +- {np.sqrt(result.covariance[2, 2]):.3f} px")
