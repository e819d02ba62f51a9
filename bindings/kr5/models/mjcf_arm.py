"""The serial arm in an MJCF, the XML of MuJoCo: its joints from base to tip, and what each of them carries."""

import re
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

import kr5
from kr5 import cell as kr5_cell
from kr5.files.paths import library_path
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


def load_mjcf(file: Path, base: str = "", tip: str = "") -> MjcfArm:
    """Compiles an MJCF and finds the arm in it.

    base, tip: names of bodies; the tip may be a site. By default the world, and the only end. Raises IoError for what
    MuJoCo does not compile, and for a model without such an arm.
    """
    mujoco = import_mujoco(file)
    try:
        spec = mujoco.MjSpec.from_file(library_path(file))
        drop_missing_meshes(spec, file)
        fusestatic, spec.compiler.fusestatic = bool(spec.compiler.fusestatic), False
        with warnings.catch_warnings(action="ignore"):  # of what is out of date in the file
            model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        raise kr5.IoError(f"{file}: cannot be compiled by MuJoCo: {one_line(error)}") from None
    arm = _Finder(file, mujoco, spec, model).run(base, tip)
    arm.fusestatic = fusestatic
    return arm


def drop_missing_meshes(spec: Any, file: Path) -> None:
    """Leaves out the meshes whose files are not there, with the geoms that show them: masses stated beside them count,
    and neither is what a cell holds."""
    folder = file.parent / (spec.meshdir or "")
    missing = [mesh for mesh in spec.meshes if mesh.file and not (folder / mesh.file).exists()]
    names = {mesh.name or Path(mesh.file).stem for mesh in missing}
    for geom in [g for g in spec.geoms if g.meshname in names]:
        spec.delete(geom)
    for mesh in missing:
        spec.delete(mesh)


class _Finder:
    """Finds the bodies and joints of the arm."""

    def __init__(self, file: Path, mujoco: ModuleType, spec: Any, model: Any) -> None:
        self.file, self.mujoco, self.spec, self.model = file, mujoco, spec, model
        self.children: dict[int, list[int]] = {}
        for body in range(1, model.nbody):
            self.children.setdefault(int(model.body_parentid[body]), []).append(body)

    def fail(self, message: str) -> Any:
        raise kr5.IoError(f"{self.file}: {message}")

    def run(self, base: str, tip: str) -> MjcfArm:
        base_body = self._body(base, "base") if base else 0
        tip_body, tip_site = self._tip(tip) if tip else (self._only_end(base_body), None)
        path = self._path(base_body, tip_body)
        joints = [j for body in path for j in self._joints(body)]
        names = self._names(joints)
        if not joints:
            self.fail(f"no joint moves between {base or 'the world'} and {tip or self._name(tip_body)}")
        arm = MjcfArm(
            file=self.file,
            spec=self.spec,
            model=self.model,
            data=self._at_zero(joints),
            base=base or "world",
            tip=tip or self._name(tip_body),
            base_body=base_body,
            tip_body=tip_body,
            tip_site=tip_site,
            joints=joints,
            names=names,
            carriers={},
        )
        self._carry(arm, base_body, FIXED, set(path))
        self._refuse_equalities(arm)
        return arm

    def _name(self, body: int) -> str:
        return str(self.model.body(body).name) or f"body {body}"

    def _body(self, name: str, what: str) -> int:
        body = self.mujoco.mj_name2id(self.model, self.mujoco.mjtObj.mjOBJ_BODY, name)
        if body < 0:
            names = [self._name(b) for b in range(self.model.nbody)]
            self.fail(f'there is no body "{name}" for the {what}; the bodies are {", ".join(names)}')
        return int(body)

    def _tip(self, name: str) -> tuple[int, int | None]:
        """A body, or a site on one."""
        site = self.mujoco.mj_name2id(self.model, self.mujoco.mjtObj.mjOBJ_SITE, name)
        if site >= 0 and self.mujoco.mj_name2id(self.model, self.mujoco.mjtObj.mjOBJ_BODY, name) < 0:
            return int(self.model.site_bodyid[site]), int(site)
        return self._body(name, "tip"), None

    def _joints(self, body: int) -> list[int]:
        first, count = int(self.model.body_jntadr[body]), int(self.model.body_jntnum[body])
        return list(range(first, first + count))

    def _floats(self, body: int) -> bool:
        free = self.mujoco.mjtJoint.mjJNT_FREE
        return any(int(self.model.jnt_type[j]) == free for j in self._joints(body))

    def _moves(self, body: int) -> bool:
        """Whether a body has joints, or carries one that has; what floats free is no part of an arm."""
        if self._floats(body):
            return False
        return bool(self._joints(body)) or any(map(self._moves, self.children.get(body, [])))

    def _only_end(self, base: int) -> int:
        at = base
        while True:
            ways = self.children.get(at, [])
            if any(map(self._moves, ways)):
                ways = [body for body in ways if self._moves(body)]
            elif at == base:
                self.fail("no joint moves; expected an arm of hinges and slides")
            if not ways:
                return at
            if len(ways) > 1:
                where = "the world" if at == 0 else f"body {self._name(at)}"
                names = ", ".join(self._name(body) for body in ways)
                self.fail(
                    f"behind {where} the model branches to {names}; name the body or site that is the tip (--tip)"
                )
            at = ways[0]

    def _path(self, base: int, tip: int) -> list[int]:
        path: list[int] = []
        at = tip
        while at != base:
            if at == 0:
                self.fail(f"the tip {self._name(tip)} is not carried by the base {self._name(base)}")
            path.insert(0, at)
            at = int(self.model.body_parentid[at])
        return path

    def _names(self, joints: list[int]) -> list[str]:
        names = []
        for joint in joints:
            name, kind = self.model.joint(joint).name, self.mujoco.mjtJoint(int(self.model.jnt_type[joint]))
            name = name or f"{self._name(int(self.model.jnt_bodyid[joint]))}_joint{joint}"
            if kind in (self.mujoco.mjtJoint.mjJNT_FREE, self.mujoco.mjtJoint.mjJNT_BALL):
                word = "free" if kind == self.mujoco.mjtJoint.mjJNT_FREE else "a ball"
                self.fail(f"joint {name} is {word}; an arm has hinges and slides, so name a base behind it (--base)")
            names.append(name)
        return names

    def _at_zero(self, joints: list[int]) -> Any:
        data = self.mujoco.MjData(self.model)
        for joint in joints:
            data.qpos[self.model.jnt_qposadr[joint]] = 0.0
        self.mujoco.mj_kinematics(self.model, data)
        return data

    def _carry(self, arm: MjcfArm, body: int, carrier: int, path: set[int]) -> None:
        arm.carriers[body] = carrier
        for child in self.children.get(body, []):
            joints = self._joints(child)
            if child in path:
                self._carry(arm, child, carrier + len(joints), path)
                continue
            if carrier != FIXED:
                arm.held += [self.model.joint(j).name or f"joint {j}" for j in joints]
            if not self._floats(child):
                self._carry(arm, child, carrier, path)

    def _refuse_equalities(self, arm: MjcfArm) -> None:
        """Complains of constraints that make the joints of the arm depend on each other."""
        m, kinds = self.model, self.mujoco.mjtEq
        for e in range(m.neq):
            if not m.eq_active0[e]:
                continue
            name, kind, pair = m.equality(e).name or f"number {e}", int(m.eq_type[e]), (m.eq_obj1id[e], m.eq_obj2id[e])
            if kind == kinds.mjEQ_JOINT and (tied := [j for j in pair if j in arm.joints]):
                joint = m.joint(tied[0]).name
                self.fail(f"equality {name} ties the joint {joint}; the joints of an arm must be independent")
            if kind not in (kinds.mjEQ_CONNECT, kinds.mjEQ_WELD):
                continue
            bodies = [self._equality_body(int(m.eq_objtype[e]), int(i)) for i in pair]
            if any(m.body_mocapid[b] >= 0 for b in bodies):
                continue  # what leads an arm about is no part of it
            carriers = {arm.carriers.get(b, FIXED) for b in bodies}
            if len(carriers) > 1:
                names = " and ".join(self._name(b) for b in bodies)
                self.fail(f"equality {name} joins {names}, which closes a loop; a closed chain is not a serial arm")

    def _equality_body(self, kind: int, number: int) -> int:
        if kind == self.mujoco.mjtObj.mjOBJ_SITE:
            return int(self.model.site_bodyid[number])
        return max(number, 0)


def notes_of(arm: MjcfArm) -> list[str]:
    """What of the model a cell cannot hold, or what was made of it, in words."""
    m = arm.model
    dofs = [int(m.jnt_dofadr[j]) for j in arm.joints]
    named = dict(zip(arm.joints, arm.names))
    notes = []
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
