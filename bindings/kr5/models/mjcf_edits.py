"""What has to change in an MJCF so that its arm is that of a cell."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

import kr5
import kr5.cell
from kr5 import cell as kr5_cell
from kr5.kinematics import Body, body_without, is_real, merged_body, transformed_body
from kr5.models.mjcf_actuators import AS_FOUND, DryFriction, position_servo
from kr5.models.mjcf_arm import MjcfArm, pose

SAME = 1e-12  # [m, rad, relative] what rounding leaves of no difference
REMEDY = "; give the MJCF from which the cell was imported, with the same base and tip"


def massless() -> Any:
    return Body(mass=0.0, com=np.zeros(3), inertia=np.zeros(6))


@dataclass
class Edits:
    """Values by the number of the element in the compiled model; angles in rad, poses 4x4 [m]."""

    joints: dict[int, dict[str, list[float]]] = field(default_factory=dict)  # by attribute of the MJCF
    bodies: dict[int, np.ndarray] = field(default_factory=dict)  # in the parent, as the model begins
    inertials: dict[int, Any] = field(default_factory=dict)  # kinematics.Body in the frame of the body
    sites: dict[int, np.ndarray] = field(default_factory=dict)  # in its body
    new_site: tuple[int, str, np.ndarray] | None = None  # body, name, pose in it
    actuators: dict[int, dict[str, float]] = field(default_factory=dict)  # kp, kv, limit, in units of the actuator
    gravity: np.ndarray | None = None  # in the world [m/s^2]
    changes: list[str] = field(default_factory=list)  # in words, in the order of the chain

    def geometry(self) -> bool:
        """Whether anything moves."""
        moved = any({"pos", "axis"} & set(values) for values in self.joints.values())
        return bool(self.bodies or self.sites or self.new_site or moved)


def edits_of(arm: MjcfArm, cell: kr5.cell.Cell, springs: np.ndarray, friction: DryFriction = AS_FOUND) -> Edits:
    """The edits that make the arm of an MJCF that of a cell, effects apart.

    springs: stiffness [N m/rad or N/m] and joint value without torque, n x 2, added to the springs of the MJCF.
    friction: how dry friction is stated. Raises IoError for a cell of another robot, and for masses that MuJoCo does
    not take.
    """
    names = list(cell.robot.joint_names)
    if names and names != arm.names:
        raise kr5.IoError(
            f"{arm.file}: the joints from {arm.base} to {arm.tip} are {', '.join(arm.names)}, those of the cell are"
            f" {', '.join(names)}{REMEDY}"
        )
    now = kr5_cell.arm_links(cell)
    try:
        displaced = kr5_cell.link_displacements(arm.links(), now)
    except kr5.InvalidArgument as error:
        raise kr5.IoError(f"{arm.file}: {error}{REMEDY}") from None
    return _Planner(arm, cell, now, [np.eye(4), *displaced], springs, friction).run()


def alike(a: npt.ArrayLike, b: npt.ArrayLike) -> bool:
    return bool(np.abs(np.asarray(a) - np.asarray(b)).max() <= SAME * max(1.0, float(np.abs(b).max())))


def turned_about(point: np.ndarray, direction: np.ndarray, slides: bool, value: float) -> np.ndarray:
    """The displacement of a joint by a value, about (or along) its axis."""
    if slides:
        return kr5.to_pose([*(value * direction), 0.0, 0.0, 0.0])
    T = kr5.to_pose([0.0, 0.0, 0.0, *(value * direction)])
    T[:3, 3] = point - T[:3, :3] @ point
    return T


class _Planner:
    def __init__(
        self,
        arm: MjcfArm,
        cell: kr5.cell.Cell,
        now: kr5_cell.ArmLinks,
        displaced: list[np.ndarray],
        springs: np.ndarray,
        friction: DryFriction,
    ) -> None:
        self.arm, self.cell, self.now, self.springs, self.friction = arm, cell, now, springs, friction
        self.displaced = [np.eye(4) if alike(T, np.eye(4)) else T for T in displaced]
        tool = cell.tool.T_flange_tool if cell.tool is not None else np.eye(4)
        self.T_base_tip = now.T_base_tip @ tool
        self.behind_tip: set[int] = set()
        self.out = Edits()

    def run(self) -> Edits:
        self._place_tip()
        for k, joint in enumerate(self.arm.joints):
            self._plan_drive(k, joint)
            self._plan_servo(k, joint)
        for body in self._moving_bodies():
            self._plan_geometry(body)
        for carrier in range(1, len(self.arm.joints) + 1):
            self._plan_bodies(carrier)
        self._plan_tip()
        self._plan_gravity()
        return self.out

    # Places

    def _tip_moves_alone(self) -> bool:
        """Whether the tip is a site or a fixed body, so that it can be placed apart from the joint that carries it."""
        return self.arm.tip_site is not None or not self._has_joints(self.arm.tip_body)

    def _has_joints(self, body: int) -> bool:
        return bool(self.arm.model.body_jntnum[body])

    def _place_tip(self) -> None:
        carried = self.displaced[-1] @ self.arm.T_base_tip()
        if alike(self.T_base_tip, carried):
            self.T_base_tip = carried
        if self.arm.tip_site is None and self._tip_moves_alone():
            parents = self.arm.model.body_parentid
            for body in sorted(self.arm.carriers):  # children have higher numbers
                if body == self.arm.tip_body or int(parents[body]) in self.behind_tip:
                    self.behind_tip.add(body)

    def _T_body(self, body: int) -> np.ndarray:
        """Where a body lies now, in the base."""
        before = self.arm.T_base_body(body)
        if body in self.behind_tip:
            T: np.ndarray = self.T_base_tip @ np.linalg.inv(self.arm.T_base_tip()) @ before
        else:
            T = self.displaced[self.arm.carriers[body]] @ before
        return T

    def _moving_bodies(self) -> list[int]:
        return list(dict.fromkeys(int(self.arm.model.jnt_bodyid[j]) for j in self.arm.joints))

    def _plan_geometry(self, body: int) -> None:
        """Body and joints such that every axis lies right when the joint values are zero.

        The model begins with its joints at `ref`; from there each has been turned back to zero, the first before the
        second. So the last joint is undone first.
        """
        m = self.arm.model
        parent = int(m.body_parentid[body])
        T = self._T_body(body)
        numbers = [k for k, j in enumerate(self.arm.joints) if m.jnt_bodyid[j] == body]
        for k in reversed(numbers):
            joint = self.arm.joints[k]
            point, direction = self.arm.axis_line(joint)
            D = self.displaced[k + 1]
            point, direction = D[:3, :3] @ point + D[:3, 3], D[:3, :3] @ direction
            slides, ref = self.arm.slides(joint), float(m.qpos0[m.jnt_qposadr[joint]])
            T = turned_about(point, direction, slides, ref) @ T
            R = T[:3, :3].T
            values = {"pos": R @ (point - T[:3, 3]), "axis": R @ direction}
            if not alike(values["pos"], m.jnt_pos[joint]) and not slides:
                self._set(k, "pos", values["pos"])
            if not alike(values["axis"], m.jnt_axis[joint]):
                self._set(k, "axis", values["axis"])
        T_parent = self._T_body(parent) if parent in self.arm.carriers else self.arm.T_base_body(parent)
        T = np.linalg.inv(T_parent) @ T
        if not alike(T, pose(m.body_pos[body], m.body_quat[body])):
            self.out.bodies[body] = T
            self.out.changes.append(f"body {self._name(body)}: pos, quat")

    def _set(self, k: int, attribute: str, value: npt.ArrayLike) -> None:
        values = [float(v) + 0.0 for v in np.atleast_1d(value)]
        self.out.joints.setdefault(self.arm.joints[k], {})[attribute] = values
        self.out.changes.append(f"joint {self.arm.names[k]}: {attribute}")

    def _name(self, body: int) -> str:
        return str(self.arm.model.body(body).name) or f"body {body}"

    def _plan_tip(self) -> None:
        if alike(self.T_base_tip, self.displaced[-1] @ self.arm.T_base_tip()):
            return
        body = self.arm.tip_body
        if self.arm.tip_site is not None:
            self.out.sites[self.arm.tip_site] = np.linalg.inv(self._T_body(body)) @ self.T_base_tip
            self.out.changes.append(f"site {self.arm.tip}: pos, quat")
        elif self._tip_moves_alone():
            parent = int(self.arm.model.body_parentid[body])
            self.out.bodies[body] = np.linalg.inv(self._T_body(parent)) @ self.T_base_tip
            self.out.changes.append(f"body {self._name(body)}: pos, quat")
        else:
            self.out.new_site = (body, "tool_tip", np.linalg.inv(self._T_body(body)) @ self.T_base_tip)
            self.out.changes.append(f"site tool_tip: added to {self._name(body)}")

    def _plan_gravity(self) -> None:
        if alike(self.arm.gravity(), self.cell.robot.gravity):
            return
        R = pose(self.arm.data.xpos[self.arm.base_body], self.arm.data.xmat[self.arm.base_body])[:3, :3]
        self.out.gravity = R @ self.cell.robot.gravity
        self.out.changes.append("option: gravity")

    # Drives

    def _plan_drive(self, k: int, joint: int) -> None:
        m, dof, link = self.arm.model, int(self.arm.model.jnt_dofadr[joint]), self.now.links[k]
        if self.cell.drives is not None:
            dry = self.friction.scale * link.coulomb
            rows = (("damping", link.viscous), ("frictionloss", dry), ("armature", link.armature))
            for attribute, value in rows:
                if getattr(m, f"dof_{attribute}")[dof] != value:
                    higher = getattr(m, f"dof_{attribute}poly", None)
                    self._set(k, attribute, with_higher_terms(value, higher, dof))
            for attribute, values in self.friction.solver().items() if dry else ():
                self._set(k, attribute, values)
        stiffness, rest = map(float, self.springs[k])
        if stiffness == 0.0:
            return
        before, adr = float(m.jnt_stiffness[joint]), int(m.jnt_qposadr[joint])
        both = before + stiffness
        higher = getattr(m, "jnt_stiffnesspoly", None)
        self._set(k, "stiffness", with_higher_terms(both, higher, joint))
        self._set(k, "springref", (before * float(m.qpos_spring[adr]) + stiffness * rest) / both)

    def _plan_servo(self, k: int, joint: int) -> None:
        before = position_servo(self.arm.model, joint)
        servo = self.cell.servo
        if servo is None or not servo.torque or before is None:
            return
        now = servo.torque_of(k)
        values: dict[str, float] = {}
        if not (alike(now.stiffness, before.stiffness) and alike(now.damping, before.damping)):
            values |= {"kp": now.stiffness / before.gear**2, "kv": now.damping / before.gear**2}
        if now.torque_limit is not None and (before.limit is None or not alike(now.torque_limit, before.limit)):
            values["limit"] = now.torque_limit / abs(before.gear)
        if values:
            self.out.actuators[before.number] = values
            self.out.changes.append(f"actuator {before.name}: {', '.join(values)}")

    # Masses

    def _plan_bodies(self, carrier: int) -> None:
        m = self.arm.model
        last = carrier == len(self.arm.joints)
        main = int(m.jnt_bodyid[self.arm.joints[carrier - 1]])
        whole = self._carried_body(carrier)
        if not last and m.jnt_bodyid[self.arm.joints[carrier]] == main:  # the link between two joints of one body
            if whole.mass > 0:
                raise kr5.IoError(
                    f"{self.arm.file}: body {self._name(main)} has several joints, and the cell a mass of"
                    f" {whole.mass:g} kg between them, which an MJCF cannot have there"
                )
            return
        others = [b for b, at in self.arm.carriers.items() if at == carrier and b != main and m.body_mass[b] > 0]
        before = self._merged(main, [main, *others])
        if _alike_bodies(before, whole) or (not len(self.cell.robot.links) and before.mass > 0):
            return
        alone, emptied = body_without(whole, self._merged(main, others)), []
        if alone is None:  # bodies that move by joints of their own keep their masses, which MuJoCo demands
            emptied = [b for b in others if not self._has_joints(b)]
            kept = [b for b in others if self._has_joints(b)]
            alone = body_without(whole, self._merged(main, kept)) if kept else whole
        if alone is None or not is_real(alone):
            raise kr5.IoError(
                f"{self.arm.file}: link {carrier} of the cell has the mass {whole.mass:g} kg, and no real body is left"
                f" for {self._name(main)} (two principal moments add up to less than the third), which MuJoCo demands"
            )
        self.out.inertials[main] = alone
        self.out.changes.append(f"body {self._name(main)}: inertial")
        for body in emptied:
            self.out.inertials[body] = massless()
            self.out.changes.append(f"body {self._name(body)}: no mass, it is in that of {self._name(main)}")

    def _merged(self, main: int, bodies: list[int]) -> Any:
        """Bodies of the model as one, where they lie now, in the frame of `main`."""
        out = massless()
        T_main = np.linalg.inv(self._T_body(main))
        for body in bodies:
            out = merged_body(out, transformed_body(T_main @ self._T_body(body), self.arm.body_of(body)))
        return out

    def _carried_body(self, carrier: int) -> Any:
        """All that a joint of the arm carries by itself, in the body that it moves."""
        link = self.now.links[carrier - 1]
        T_main = np.linalg.inv(self._T_body(int(self.arm.model.jnt_bodyid[self.arm.joints[carrier - 1]])))
        out = transformed_body(T_main @ link.T_base_link, link.body)
        tool = self.cell.tool
        if carrier < len(self.arm.joints) or tool is None:
            return out
        below = Body(mass=tool.mass, com=tool.com, inertia=tool.inertia)
        return merged_body(out, transformed_body(T_main @ self.now.T_base_tip @ tool.T_flange_sensor, below))


def with_higher_terms(value: float, higher: np.ndarray | None, row: int) -> list[float]:
    """A coefficient and those of higher order that the model has, without zeros at the end."""
    values = [value, *(float(v) for v in (higher[row] if higher is not None else ()))]
    while len(values) > 1 and values[-1] == 0:
        values.pop()
    return values


def _alike_bodies(a: Body, b: Body) -> bool:
    """Whether two bodies are the same in every torque, to rounding."""
    if a.mass == 0 == b.mass:
        return alike(a.inertia, b.inertia)
    return alike(a.mass, b.mass) and alike(a.com, b.com) and alike(a.inertia, b.inertia)
