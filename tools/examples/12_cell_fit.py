"""An own calibration from mixed measurements: a tracker sees a ball on the arm, and a camera on the flange sees a
board."""

import kr5
import numpy as np
from kr5 import cell, fit, kinematics

nominal = cell.load_cell(kr5.share("cells/kr5_arc.yaml")).nominal_chain()
joints = list(nominal.joints)
joints[1].a += 0.8e-3  # what will be found [m]
joints[2].theta_offset += 2e-3  # [rad]
truth = kinematics.DhChain(joints, nominal.T_base_0)
ball = np.array([0.05, -0.02, 0.12])  # on the flange [m]
T_tracker_base = kr5.to_pose([2, 1, 0.5, 0, 0, 1])
T_flange_camera = kr5.to_pose([0.1, 0, 0.05, 0, 0, 0.3])
lens = kr5.Pinhole(width=1280, height=960, fx=1000, fy=1000, cx=640, cy=480)
board = np.array([[0, 0.2, 0.2, 0], [0, 0, 0.15, 0.15], [0, 0, 0, 0]])  # [m]

cell_fit = fit.Problem()
arm, base = cell_fit.add_arm("arm", nominal), cell_fit.add_pose("base", T_tracker_base)
tip, camera = cell_fit.add_point("ball", np.zeros(3)), cell_fit.add_camera("lens", lens)
hand_eye = cell_fit.add_pose("hand_eye", T_flange_camera)
# Spread of b, theta_offset, a, alpha, beta of each joint about nominal [m or rad].
cell_fit.set_prior(arm, np.tile([1e-3, 2e-3, 1e-3, 2e-3, 2e-3], 6))
cell_fit.hold(camera)
for j in range(6):  # between near-parallel axes beta replaces b
    cell_fit.hold(arm, 5 * j + (0 if j == 1 else 4))

for k in range(40):
    q = np.array([1.2 * np.sin((3 + j) * k + j) for j in range(6)])
    noise = np.array([np.sin(7.0 * k), np.sin(11.0 * k), np.sin(13.0 * k)])
    T_tracker_flange = T_tracker_base @ truth.flange(q)
    seen = T_tracker_flange[:3, :3] @ ball + T_tracker_flange[:3, 3] + 1e-4 * noise
    cell_fit.add(fit.PositionMeasurement(fit.PoseChain().then(base).then_arm(arm, q), tip, seen, 1e-4))

    # The board stands half a metre before the camera, wherever that is: a pose of its own for every view, which the
    # tracker measures, too.
    T_camera_board = kr5.to_pose([-0.1, -0.07, 0.5, *(0.2 * noise)])
    T_tracker_board = T_tracker_flange @ T_flange_camera @ T_camera_board
    pixels = lens.project(T_camera_board[:3, :3] @ board + T_camera_board[:3, 3:])
    chain = fit.PoseChain().then_inverse(hand_eye).then_inverse_arm(arm, q).then_inverse(base).then(T_tracker_board)
    cell_fit.add(fit.PixelMeasurement(chain, camera, board, pixels, 0.2))

result = cell_fit.solve()
usable = "usable" if result.fit.usable else "not usable"
print(f"{usable}, {result.residuals} residuals, {len(result.coordinates)} parameters")
change, places = cell_fit.change(arm), result.places(arm)
for k in (7, 11):
    at = places[k]
    print(f"{result.coordinates[at]}: {1e3 * change[k]:+.2f} +- {1e3 * np.sqrt(result.covariance[at, at]):.2f}, 1e-3")
x, y, z = 1e3 * cell_fit.values(tip)
print(f"ball: {x:.1f} {y:.1f} {z:.1f} mm")
