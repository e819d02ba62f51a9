"""URDF of arms whose public logs come without one, of published numbers: geometry of the manufacturers, inertial
parameters of Gaz et al. 2019 (Panda), of the ROS description with its cylinders (UR10)."""

from dataclasses import dataclass

import numpy as np

H = np.pi / 2


@dataclass
class Body:
    """A link and the joint that carries it, in the manner of URDF."""

    joint: str
    xyz: tuple[float, float, float]  # [m]
    rpy: tuple[float, float, float]  # [rad]
    axis: str
    mass: float  # [kg]
    com: tuple[float, float, float]  # [m]
    inertia: tuple[float, float, float, float, float, float]  # xx xy xz yy yz zz about com [kg m^2]


def cylinder(mass: float, radius: float, length: float) -> tuple[float, float, float, float, float, float]:
    """Inertia of a cylinder along z."""
    across = mass * (3 * radius**2 + length**2) / 12
    return (across, 0.0, 0.0, across, 0.0, mass * radius**2 / 2)


def panda() -> list[Body]:
    joints = [
        ((0.0, 0.0, 0.333), (0.0, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (-H, 0.0, 0.0)),
        ((0.0, -0.316, 0.0), (H, 0.0, 0.0)),
        ((0.0825, 0.0, 0.0), (H, 0.0, 0.0)),
        ((-0.0825, 0.384, 0.0), (-H, 0.0, 0.0)),
        ((0.0, 0.0, 0.0), (H, 0.0, 0.0)),
        ((0.088, 0.0, 0.0), (H, 0.0, 0.0)),
    ]
    masses = [4.970684, 0.646926, 3.228604, 3.587895, 1.225946, 1.666555, 0.735522]
    centres = [
        (0.003875, 0.002081, -0.04762),
        (-0.003141, -0.02872, 0.003495),
        (0.027518, 0.039252, -0.066502),
        (-0.05317, 0.104419, 0.027454),
        (-0.011953, 0.041065, -0.038437),
        (0.060149, -0.014117, -0.010517),
        (0.010517, -0.004252, 0.061597),
    ]
    inertias = [
        (0.70337, -0.000139, 0.006772, 0.70661, 0.019169, 0.009117),
        (0.007962, -0.003925, 0.010254, 0.02811, 0.000704, 0.025995),
        (0.037242, -0.004761, -0.011396, 0.036155, -0.012805, 0.01083),
        (0.025853, 0.007796, -0.001332, 0.019552, 0.008641, 0.028323),
        (0.035549, -0.002117, -0.004037, 0.029474, 0.000229, 0.008627),
        (0.001964, 0.000109, -0.001158, 0.004354, 0.000341, 0.005433),
        (0.012516, -0.000428, -0.001196, 0.010027, -0.000741, 0.004815),
    ]
    return [
        Body(f"panda_joint{k + 1}", *joints[k], "0 0 1", masses[k], centres[k], inertias[k]) for k in range(len(joints))
    ]


def ur10() -> list[Body]:
    return [
        Body(
            "shoulder_pan_joint", (0, 0, 0.1273), (0, 0, 0), "0 0 1", 7.778, (0, 0.00244, -0.037),
            cylinder(7.778, 0.075, 0.178),
        ),
        Body(
            "shoulder_lift_joint", (0, 0.220941, 0), (0, H, 0), "0 1 0", 12.93, (0.00001, 0.15061, 0.38757),
            cylinder(12.93, 0.075, 0.612),
        ),
        Body(
            "elbow_joint", (0, -0.1719, 0.612), (0, 0, 0), "0 1 0", 3.87, (-0.00012, 0.06112, 0.1984),
            cylinder(3.87, 0.075, 0.5723),
        ),
        Body(
            "wrist_1_joint", (0, 0, 0.5723), (0, H, 0), "0 1 0", 1.96, (-0.00021, -0.00112, 0.02269),
            cylinder(1.96, 0.075, 0.12),
        ),
        Body(
            "wrist_2_joint", (0, 0.1149, 0), (0, 0, 0), "0 0 1", 1.96, (-0.00021, 0.00112, 0.002269),
            cylinder(1.96, 0.075, 0.12),
        ),
        Body(
            "wrist_3_joint", (0, 0, 0.1157), (0, 0, 0), "0 1 0", 0.202, (0, -0.001156, -0.00149),
            cylinder(0.202, 0.045, 0.0305),
        ),
    ]  # fmt: skip


def urdf(name: str, bodies: list[Body]) -> str:
    numbers = lambda values: " ".join(f"{v:.9g}" for v in values)
    out = ['<link name="link0"/>']
    for k, body in enumerate(bodies):
        inertia = " ".join(f'i{a}="{v:.9g}"' for a, v in zip(("xx", "xy", "xz", "yy", "yz", "zz"), body.inertia))
        out.append(
            f'<link name="link{k + 1}"><inertial><origin xyz="{numbers(body.com)}"/><mass value="{body.mass:.9g}"/>'
            f"<inertia {inertia}/></inertial></link>"
        )
        out.append(
            f'<joint name="{body.joint}" type="continuous">'
            f'<origin xyz="{numbers(body.xyz)}" rpy="{numbers(body.rpy)}"/>'
            f'<parent link="link{k}"/><child link="link{k + 1}"/><axis xyz="{body.axis}"/></joint>'
        )
    return f'<robot name="{name}">' + "".join(out) + "</robot>"
