"""An MJCF compiled by MuJoCo, and the arm found in it."""

import warnings
from pathlib import Path
from types import ModuleType
from typing import Any

import kr5
from kr5 import cell as kr5_cell
from kr5.files.paths import library_path
from kr5.models.mjcf_arm import FIXED, MjcfArm, import_mujoco, one_line


def load_mjcf(file: Path, base: str = "", tip: str = "") -> MjcfArm:
    """Compiles an MJCF and finds the arm in it.

    base, tip: names of bodies; the tip may be a site. By default the world, and the only end. Raises IoError for what
    MuJoCo does not compile, and for a model without such an arm.
    """
    mujoco = import_mujoco(file)
    try:
        spec = mujoco.MjSpec.from_file(library_path(file))
        drop_missing_meshes(spec, file)
        drop_missing_pictures(spec, file)
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


def drop_missing_pictures(spec: Any, file: Path) -> None:
    """Textures whose pictures are not there become plain ones: no colour is part of an arm."""
    import mujoco

    folder = file.parent / (spec.texturedir or "")
    for texture in spec.textures:
        names = [name for name in (texture.file, *texture.cubefiles) if name]
        if all((folder / name).exists() for name in names):
            continue
        texture.file, texture.cubefiles = "", [""] * len(texture.cubefiles)
        texture.builtin, texture.width, texture.height = mujoco.mjtBuiltin.mjBUILTIN_FLAT, 1, 1
        if texture.type != mujoco.mjtTexture.mjTEXTURE_2D:
            texture.height = 6


class _Finder:
    """Finds the bodies and joints of the arm."""

    def __init__(self, file: Path, mujoco: ModuleType, spec: Any, model: Any) -> None:
        self.file, self.mujoco, self.spec, self.model = file, mujoco, spec, model
        self.ends: list[str] = []  # bodies behind the tip, where several follow it and none was named
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
            ends=self.ends,
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
        """The end of the only chain. Where several ways end without a joint, or as the fingers of a hand do, the body
        before them is the end of the arm."""
        at, joints = base, 0
        while True:
            ways = self.children.get(at, [])
            if any(map(self._moves, ways)):
                ways = [body for body in ways if self._moves(body)]
            elif at == base:
                self._refuse_base(base)
            if not ways:
                return at
            if len(ways) > 1 and self._ends_at(joints, ways):
                self.ends = [self._name(body) for body in ways]
                return at
            if len(ways) > 1:
                where = "the world" if at == 0 else f"body {self._name(at)}"
                names = ", ".join(self._name(body) for body in ways)
                self.fail(
                    f"behind {where} the model branches to {names}; name the body or site that is the tip (--tip)"
                )
            at = ways[0]
            joints += len(self._joints(at))

    def _ends_at(self, joints: int, ways: list[int]) -> bool:
        """Whether an arm of so many joints ends before these bodies."""
        return kr5_cell.arm_ends_before(joints, max(map(self._longest_way, ways)))

    def _longest_way(self, body: int) -> int:
        """Joints on the longest way from a body to an end."""
        if self._floats(body):
            return 0
        return len(self._joints(body)) + max(map(self._longest_way, self.children.get(body, [])), default=0)

    def _refuse_base(self, base: int) -> None:
        """Complains that nothing on a base moves, and names arms on bodies that float behind it."""
        floating = [body for body in self._behind(base) if self._floats(body)]
        arms = {body: names for body in floating if (names := self._hinge_names(body))}
        if not arms:
            self.fail("no joint moves; expected an arm of hinges and slides")
        ways = "; ".join(
            f"behind {self.model.joint(self._joints(body)[0]).name or 'the free joint'} of body {self._name(body)}"
            f" move {', '.join(names)} (--base {self._name(body)})"
            for body, names in arms.items()
        )
        self.fail(f"every joint is behind a free joint, and an arm stands on its base; name it with --base: {ways}")

    def _behind(self, body: int) -> list[int]:
        """All bodies that a body carries, from it on."""
        children = self.children.get(body, [])
        return [*children, *(b for child in children for b in self._behind(child))]

    def _hinge_names(self, body: int) -> list[str]:
        """Joints behind a body, those that float apart."""
        joints = [j for b in self._behind(body) if not self._floats(b) for j in self._joints(b)]
        return [str(self.model.joint(j).name) or f"joint {j}" for j in joints]

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
                self.fail(
                    f"equality {name} ties the joint {joint}; the joints of an arm must be independent: remove it,"
                    " which makes the joint one with values and torques of its own, or end the arm before it (--tip)"
                )
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
