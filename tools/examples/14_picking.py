"""Bin picking: poses of cylinders from a cloud, grasps clear of the walls, order."""

import numpy as np
from kr5 import picking

# A bin of 120 x 120 mm as seen from above: two cylinders lie beside each other, one of
# them on a shim of 2 mm, and one stands by the wall.
x, y = np.meshgrid(0.0006 * np.arange(200) - 0.0597, 0.0006 * np.arange(200) - 0.0597, indexing="ij")
z = np.zeros_like(x)
for centre, height in ((-0.02, 0.008), (-0.003, 0.010)):
    lying = (np.abs(x - centre) < 0.008) & (np.abs(y) < 0.0075)
    z[lying] = height + np.sqrt(0.008**2 - (x[lying] - centre) ** 2)
z[np.hypot(x - 0.0515, y - 0.02) < 0.008] = 0.016
cloud = picking.Cloud(points=np.stack([x, y, z]).reshape(3, -1))
bin_ = picking.Bin(size=[0.12, 0.12, 0.08])

found = picking.find_pellets(cloud, bin_)
print(f"the cloud is {found.check.finding}, {len(found.pellets)} cylinders found")
for grasp in picking.plan_picks(found.pellets, cloud, bin_):
    pellet = found.pellets[grasp.pellet]
    cx, cy, cz = 1000 * pellet.centre
    print(f"{'standing' if pellet.axis[2] > 0.9 else 'lying'} at {cx:.0f} {cy:.0f} {cz:.0f} mm: {grasp.reason}")

# A gripper as wide as this touches the wall beside the one that stands.
wide = picking.GraspOptions(gripper=[picking.GripperPart(radius=0.009, start=0.001, end=0.15)], max_tilt=0.0)
for grasp in picking.plan_picks(found.pellets, cloud, bin_, wide):
    if found.pellets[grasp.pellet].axis[2] > 0.9:
        print(f"with a wide gripper: {grasp.finding}")

# In millimetres the cloud is refused.
cloud.points = 1000 * cloud.points
print(picking.find_pellets(cloud, bin_).check.finding)
