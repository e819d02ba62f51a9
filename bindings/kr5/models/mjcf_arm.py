"""The serial arm in an MJCF, the XML of MuJoCo: its joints from base to tip, and what each of them carries."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import kr5
from kr5 import cell as kr5_cell
from kr5.kinematics import Body, merged_body, transformed_body
from kr5.models.mjcf_actuators import servo_notes, servos_of

INSTALL = "pip install 'kr5[mujoco]'"
FIXED = 0  # carrier of what no joint of the arm moves


def import_mujoco(file: Path) -> Any:
    """The package mujoco, or an error that says how to install it."""
    try:
        import mujoco
    except ImportError:
        raise kr5.IoError(f"{file}: an MJCF needs the package mujoco, which is not installed: {INSTALL}") from None
    return mujoco


def one_line(error: Exception) -> str:
    return re.sub(r"\s+", " ", str(error)).strip()


def pose(position: npt.ArrayLike, rotation: npt.ArrayLike) -> np.ndarray:
    """4x4 of a position and a rotation: 9 numbers row by row, or w x y z."""
    import mujoco

    T = np.eye(4)
    T[:3, 3] = position
    if np.size(rotation) == 4:
        flat = np.empty(9)
        mujoco.mju_quat2Mat(flat, np.asarray(rotation, float) / np.linalg.norm(rotation))
        rotation = flat
    T[:3, :3] = np.reshape(rotation, (3, 3))
    return T


@dataclass
class MjcfArm:
    """A compiled model with the arm between two of its bodies, every joint of the arm at zero, all else as the model
    begins."""

    file: Path
    spec: Any
    model: Any
    data: Any
    base: str
    tip: str
    base_body: int
    tip_body: int
    tip_site: int | None  # where the tip is a site
    joints: list[int]  # numbers in the model, from the base
    names: list[str]
    carriers: dict[int, int]  # of every body behind the base: number of the joint that moves it, from 1, or FIXED
    held: list[str] = field(default_factory=list)  # joints beside the arm
    ends: list[str] = field(default_factory=list)  # bodies behind the tip, where several follow it and none was named
    fusestatic: bool = False  # as the file has it; bodies are looked up without

    def T_base(self, position: npt.ArrayLike, rotation: npt.ArrayLike) -> np.ndarray:
        """Pose in the base, from one in the world."""
        world = pose(self.data.xpos[self.base_body], self.data.xmat[self.base_body])
        T: np.ndarray = np.linalg.inv(world) @ pose(position, rotation)
        return T

    def T_base_body(self, body: int) -> np.ndarray:
        return self.T_base(self.data.xpos[body], self.data.xmat[body])

    def T_base_tip(self) -> np.ndarray:
        if self.tip_site is None:
            return self.T_base_body(self.tip_body)
        return self.T_base(self.data.site_xpos[self.tip_site], self.data.site_xmat[self.tip_site])

    def axis_line(self, joint: int) -> tuple[np.ndarray, np.ndarray]:
        """A point of the axis of a joint and its direction, in the base."""
        world = pose(self.data.xpos[self.base_body], self.data.xmat[self.base_body])
        R, p = world[:3, :3], world[:3, 3]
        return R.T @ (self.data.xanchor[joint] - p), R.T @ self.data.xaxis[joint]

    def body_of(self, body: int) -> Any:
        """Mass of one body, in its frame."""
        m = self.model
        alone = Body(mass=float(m.body_mass[body]), com=np.zeros(3), inertia=[*m.body_inertia[body], 0.0, 0.0, 0.0])
        return transformed_body(pose(m.body_ipos[body], m.body_iquat[body]), alone)

    def gravity(self) -> np.ndarray:
        """In the base [m/s^2]."""
        import mujoco

        if self.model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_GRAVITY:
            return np.zeros(3)
        R = pose(self.data.xpos[self.base_body], self.data.xmat[self.base_body])[:3, :3]
        return np.asarray(R.T @ self.model.opt.gravity)

    def links(self) -> Any:
        """The arm as `kr5.cell.ArmLinks`."""
        links = [self._link(joint, name) for joint, name in zip(self.joints, self.names)]
        for body, carrier in self.carriers.items():
            if carrier == FIXED:
                continue
            link = links[carrier - 1]
            T = np.linalg.inv(link.T_base_link) @ self.T_base_body(body)
            link.body = merged_body(link.body, transformed_body(T, self.body_of(body)))
        return kr5_cell.ArmLinks(links=links, T_base_tip=self.T_base_tip())

    def _link(self, joint: int, name: str) -> Any:
        m = self.model
        dof = int(m.jnt_dofadr[joint])
        limits: dict[str, Any] = {}
        if m.jnt_limited[joint]:
            limits["lower"], limits["upper"] = map(float, m.jnt_range[joint])
        if m.jnt_actfrclimited[joint]:
            limits["effort"] = float(np.abs(m.jnt_actfrcrange[joint]).max())
        return kr5_cell.ArmLink(
            joint=name,
            type="prismatic" if self.slides(joint) else "revolute",
            T_base_link=self._axis_frame(joint),
            viscous=float(m.dof_damping[dof]),
            coulomb=float(m.dof_frictionloss[dof]),
            armature=float(m.dof_armature[dof]),
            **limits,
        )

    def slides(self, joint: int) -> bool:
        import mujoco

        return bool(int(self.model.jnt_type[joint]) == mujoco.mjtJoint.mjJNT_SLIDE)

    def _axis_frame(self, joint: int) -> np.ndarray:
        """Frame on the axis of a joint, its x axis on the side of that of the body."""
        point, z = self.axis_line(joint)
        R = self.T_base_body(int(self.model.jnt_bodyid[joint]))[:3, :3]
        x = R[:, 0] if np.linalg.norm(np.cross(R[:, 0], z)) > 0.1 else R[:, 1]
        x = x - x @ z * z
        x /= np.linalg.norm(x)
        T = np.eye(4)
        T[:3, :3] = np.column_stack([x, np.cross(z, x), z])
        T[:3, 3] = point
        return T


def notes_of(arm: MjcfArm) -> list[str]:
    """What of the model a cell cannot hold, or what was made of it, in words."""
    m = arm.model
    dofs = [int(m.jnt_dofadr[j]) for j in arm.joints]
    named = dict(zip(arm.joints, arm.names))
    notes = []
    if arm.ends:
        notes.append(
            f"the arm ends at {arm.tip}, behind which several bodies follow ({', '.join(arm.ends)}); another end is"
            " named by --tip"
        )
    if open_joints := kr5_cell.joints_without_range(arm.links()):
        notes.append(
            f"the limits of {', '.join(open_joints)} are no range (0 and 0, crossed or huge), so the cell has none;"
            " write them into its robot.limits"
        )
    if arm.held:
        notes.append(
            "joints beside the arm are held where the model begins, their mass is added to the links that carry them:"
            f" {', '.join(arm.held)}"
        )
    rubbing = [n for j, n in named.items() if _has_drive(m, int(m.jnt_dofadr[j]))]
    if rubbing:
        notes.append(
            f"damping, frictionloss and armature of {', '.join(rubbing)} are in the drives, with gears of 1 and"
            " 1 N m/A, so that a current is a joint torque"
        )
    if springs := [n for j, n in named.items() if m.jnt_stiffness[j] != 0]:
        notes.append(f"springs of {', '.join(springs)} (stiffness, springref) have no place in a cell")
    if any(np.any(getattr(m, key)[rows]) for key, rows in _polynomials(m, arm.joints, dofs)):
        notes.append("damping or stiffness that depends on the square of speed or angle has no place in a cell")
    if lifted := [m.body(b).name for b, c in arm.carriers.items() if c != FIXED and m.body_gravcomp[b] != 0]:
        notes.append(f"compensated gravity (gravcomp) of {', '.join(lifted)} has no place in a cell")
    if m.opt.density > 0 or m.opt.viscosity > 0:
        notes.append("forces of the fluid (density, viscosity) have no place in a cell")
    if m.ntendon:
        notes.append(f"tendons have no place in a cell: {_listed(m.tendon(i).name for i in range(m.ntendon))}")
    notes += servo_notes(m, named)
    carried = [b for b, c in arm.carriers.items() if c != FIXED]
    if any(m.geom_bodyid[g] in carried and (m.geom_contype[g] or m.geom_conaffinity[g]) for g in range(m.ngeom)):
        notes.append("contacts of the geoms have no place in a cell")
    return notes


def _has_drive(model: Any, dof: int) -> bool:
    return bool(model.dof_damping[dof] or model.dof_frictionloss[dof] or model.dof_armature[dof])


def _polynomials(model: Any, joints: list[int], dofs: list[int]) -> list[tuple[str, list[int]]]:
    """Arrays of higher terms, which not every version of MuJoCo has."""
    wanted = (("dof_dampingpoly", dofs), ("jnt_stiffnesspoly", joints))
    return [(key, rows) for key, rows in wanted if hasattr(model, key)]


def _listed(names: Iterable[str]) -> str:
    return ", ".join(name or "unnamed" for name in names)


def cell_of_mjcf(arm: MjcfArm) -> Any:
    """The cell with the arm, its gravity and the name of the model."""
    out = kr5_cell.cell_of_links(arm.links())
    out.robot.gravity = arm.gravity()
    out.servo = servos_of(arm.model, arm.joints)
    out.name = str(arm.spec.modelname)
    return out
