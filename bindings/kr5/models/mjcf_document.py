"""Edits of an MJCF written into its document, so that all else keeps its text."""

import os
import re
import xml.etree.ElementTree as xml
from pathlib import Path
from typing import Any

import numpy as np

import kr5
import kr5.kinematics
from kr5.files.xml_text import number_text, quaternion
from kr5.models.mjcf_arm import MjcfArm, one_line
from kr5.models.mjcf_edits import Edits
from kr5.models.simulator_masses import inertial_attributes

# What makes bodies or joints that have no element of their own in the file.
GENERATORS = ("include", "replicate", "attach", "composite", "flexcomp")
# Attributes of joints to which MuJoCo gives other names in its own model.
SPEC_NAMES = {"solreffriction": "solref_friction", "solimpfriction": "solimp_friction"}
ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")
FLATTENED = (
    "the file is built from others or from patterns (include, replicate, attach), so the result is one file as MuJoCo"
    " writes it: without patterns, numbers to six digits"
)


def edited_mjcf(arm: MjcfArm, edits: Edits, folder: Path) -> tuple[str, list[str]]:
    """The document with the edits in it, to be written into `folder`, and notes on what became of it."""
    if edits.geometry():
        _refuse_frames(arm, edits)
    if edits.inertials:
        refuse_computed_masses(arm)
    document = _XmlDocument.read(arm)
    if document is not None:
        document.apply(edits, folder)
        return document.text(), []
    return _flattened(arm, edits, folder), [FLATTENED]


def _refuse_frames(arm: MjcfArm, edits: Edits) -> None:
    """Complains of elements that move and whose place is that of a <frame> around them."""
    spec = arm.spec
    elements = {
        "body": [spec.bodies[b] for b in edits.bodies],
        "joint": [spec.joints[j] for j, values in edits.joints.items() if {"pos", "axis"} & set(values)],
        "site": [spec.sites[s] for s in edits.sites],
    }
    for kind, found in elements.items():
        for element in found:
            if element.frame is not None:
                raise kr5.IoError(
                    f"{arm.file}: {kind} {element.name} stands in a <frame>, and its place has changed; move the place"
                    " of the frame into the elements first"
                )


def refuse_computed_masses(arm: MjcfArm) -> None:
    """Complains of settings that would change inertials after they have been read."""
    compiler = arm.spec.compiler
    settings = {
        "settotalmass": compiler.settotalmass > 0,
        "inertiafromgeom": int(compiler.inertiafromgeom) == 1,
        "balanceinertia": bool(compiler.balanceinertia),
    }
    if found := [name for name, on in settings.items() if on]:
        raise kr5.IoError(
            f"{arm.file}: the compiler setting {found[0]} computes masses anew, so that those of the cell cannot stand"
            " in the file; compile it once and save it with MuJoCo (mj_saveLastXML), then give that file"
        )


def _relative(folder: str, arm: MjcfArm, target: Path) -> str:
    """A folder of assets, named from the file or absolute, as named from the folder of the new file."""
    return os.path.relpath(arm.file.resolve().parent / folder, target.resolve())


class _XmlDocument:
    """The elements of a file, by the numbers of the compiled model."""

    def __init__(self, arm: MjcfArm, before: str, root: xml.Element, after: str) -> None:
        self.arm, self.before, self.root, self.after = arm, before, root, after
        self.spaced = False  # whether empty elements end with a blank: <a />
        self.bodies: list[xml.Element] = [xml.Element("worldbody")]
        self.joints: list[xml.Element] = []
        self.sites: list[xml.Element] = []
        self.actuators = [element for section in root.findall("actuator") for element in section]
        self.actuators = [element for element in self.actuators if isinstance(element.tag, str)]
        worlds = root.findall("worldbody")
        self._collect_elements(worlds)
        for world in worlds:
            self._walk(world)

    @classmethod
    def read(cls, arm: MjcfArm) -> "_XmlDocument | None":
        """The document, or nothing where its elements are not those of the compiled model, one to one."""
        text = arm.file.read_text(encoding="utf-8-sig")
        start, end = re.search(r"<mujoco\b", text), text.rfind("</mujoco>")
        if start is None or end < 0:
            return None
        end += len("</mujoco>")
        builder = xml.TreeBuilder(insert_comments=True, insert_pis=True)
        try:
            root = xml.fromstring(text[start.start() : end], parser=xml.XMLParser(target=builder))
        except xml.ParseError:  # a <mujoco> in a comment before the model
            return None
        if any(root.find(f".//{name}") is not None for name in GENERATORS):
            return None
        found = cls(arm, text[: start.start()], root, text[end:])
        found.spaced = 2 * text.count(" />") > text.count("/>")
        return found if found._is_model() else None

    def _walk(self, element: xml.Element) -> None:
        """Numbers bodies as MuJoCo does: a body before its children, in the order of the file."""
        for body in self._children(element, ("body",)):
            self.bodies.append(body)
            self._collect_elements([body])
            self._walk(body)

    def _collect_elements(self, parents: list[xml.Element]) -> None:
        for parent in parents:
            self.joints += self._children(parent, ("joint", "freejoint"))
            self.sites += self._children(parent, ("site",))

    def _children(self, element: xml.Element, tags: tuple[str, ...]) -> list[xml.Element]:
        """Of an element, those in frames included."""
        out = []
        for child in element:
            if child.tag in tags:
                out.append(child)
            elif child.tag == "frame":
                out += self._children(child, tags)
        return out

    def _is_model(self) -> bool:
        m = self.arm.model
        names = (
            [m.body(i).name for i in range(1, m.nbody)],
            [m.joint(i).name for i in range(m.njnt)],
            [m.site(i).name for i in range(m.nsite)],
            [m.actuator(i).name for i in range(m.nu)],
        )
        found = (self.bodies[1:], self.joints, self.sites, self.actuators)
        return all([e.get("name", "") for e in elements] == named for elements, named in zip(found, names))

    def apply(self, edits: Edits, folder: Path) -> None:
        for number, values in edits.joints.items():
            for name, value in values.items():
                self.joints[number].set(name, number_text(_in_its_unit(self.arm, number, name, value)))
        for number, T in edits.bodies.items():
            _place(self.bodies[number], T)
        for number, T in edits.sites.items():
            _place(self.sites[number], T)
        if edits.new_site is not None:
            number, name, T = edits.new_site
            _place(_append(self.bodies[number], "site", {"name": name}), T)
        for number, body in edits.inertials.items():
            self._put_inertial(self.bodies[number], body)
        for number, gains in edits.actuators.items():
            self._put_servo(self.actuators[number], gains)
        if edits.gravity is not None:
            self._setting("option").set("gravity", number_text(edits.gravity))
        self._move_assets(folder)

    def _put_servo(self, element: xml.Element, values: dict[str, float]) -> None:
        """Gains of a position servo, which one in terms of a damping ratio becomes a `general` for."""
        if "limit" in values:
            element.set("forcerange", number_text([-values["limit"], values["limit"]]))
            element.set("forcelimited", "true")
        if "kp" not in values:
            return
        kp, kv = values["kp"], values["kv"]
        if element.tag == "position" and not any("dampratio" in e.attrib for e in self.root.iter()):
            element.set("kp", number_text(kp))
            element.set("kv", number_text(kv))
            return
        element.tag = "general"
        for name in ("kp", "kv", "dampratio", "timeconst", "inheritrange"):
            element.attrib.pop(name, None)
        for name, value in (("gaintype", "fixed"), ("biastype", "affine"), ("dyntype", "none")):
            element.set(name, value)
        element.set("gainprm", number_text(kp))
        element.set("biasprm", number_text([0.0, -kp, -kv]))

    def _put_inertial(self, body: xml.Element, found: kr5.kinematics.Body) -> None:
        for old in body.findall("inertial"):
            _remove(body, old)
        values = {"pos": number_text(found.com), "mass": number_text(found.mass)}
        values |= {name: number_text(v) for name, v in inertial_attributes(found).items()}
        _append(body, "inertial", values, first=True)

    def _setting(self, name: str) -> xml.Element:
        found = self.root.find(name)
        return _append(self.root, name, {}, first=True) if found is None else found

    def _move_assets(self, folder: Path) -> None:
        """Files of assets are named from the folder of the model."""
        if folder.resolve() == self.arm.file.resolve().parent or not any(e.get("file") for e in self.root.iter()):
            return
        compiler = self._setting("compiler")
        compiler.attrib.pop("assetdir", None)
        for name, value in (("meshdir", self.arm.spec.meshdir), ("texturedir", self.arm.spec.texturedir)):
            compiler.set(name, _relative(value, self.arm, folder))

    def text(self) -> str:
        """The document with its beginning and end, which no element holds."""
        text = xml.tostring(self.root, encoding="unicode")
        return self.before + (text if self.spaced else text.replace(" />", "/>")) + self.after


def _in_its_unit(arm: MjcfArm, joint: int, attribute: str, values: list[float]) -> list[float]:
    """Values of an attribute of a joint as the file states angles."""
    if attribute == "springref" and not arm.slides(joint) and arm.spec.compiler.degree:
        return [float(v) for v in np.degrees(values)]
    return values


def _place(element: xml.Element, T: np.ndarray) -> None:
    for name in ORIENTATIONS:
        element.attrib.pop(name, None)
    element.attrib.pop("fromto", None)
    element.set("pos", number_text(T[:3, 3]))
    element.set("quat", number_text(quaternion(T)))


def _append(parent: xml.Element, tag: str, values: dict[str, str], first: bool = False) -> xml.Element:
    """A new child on a line of its own, before the others or after them."""
    out = xml.Element(tag, values)
    if not len(parent):
        parent.append(out)
    elif first:
        out.tail = parent.text
        parent.insert(0, out)
    else:
        out.tail, parent[-1].tail = parent[-1].tail, parent.text
        parent.append(out)
    return out


def _remove(parent: xml.Element, child: xml.Element) -> None:
    """Removes a child with the white space behind it."""
    at = list(parent).index(child)
    if at:
        parent[at - 1].tail = child.tail
    else:
        parent.text = child.tail
    parent.remove(child)


def _flattened(arm: MjcfArm, edits: Edits, folder: Path) -> str:
    """The whole model as MuJoCo writes it, with the edits in it."""
    spec = arm.spec
    bodies, joints, sites = spec.bodies, spec.joints, spec.sites
    for number, values in edits.joints.items():
        for name, value in values.items():
            _set_value(joints[number], name, _in_its_unit(arm, number, name, value))
    placed = [(bodies[n], T) for n, T in edits.bodies.items()] + [(sites[n], T) for n, T in edits.sites.items()]
    if edits.new_site is not None:
        number, name, T = edits.new_site
        placed.append((bodies[number].add_site(name=name), T))
    for element, T in placed:
        element.pos, element.quat = T[:3, 3], quaternion(T)
        element.alt.type = 0  # mjORIENTATION_QUAT
    for number, body in edits.inertials.items():
        element = bodies[number]
        element.explicitinertial = True
        element.mass, element.ipos = body.mass, body.com
        stated = inertial_attributes(body)
        element.iquat = stated.get("quat", np.array([1.0, 0.0, 0.0, 0.0]))
        element.inertia = stated.get("diaginertia", np.zeros(3))
        element.fullinertia = stated.get("fullinertia", np.full(6, np.nan))  # of which MuJoCo takes one
    for number, gains in edits.actuators.items():
        _set_servo(spec.actuators[number], gains)
    if edits.gravity is not None:
        spec.option.gravity = edits.gravity
    if folder.resolve() != arm.file.resolve().parent:
        spec.meshdir, spec.texturedir = (_relative(d, arm, folder) for d in (spec.meshdir, spec.texturedir))
    try:
        spec.compile()
        spec.compiler.fusestatic = arm.fusestatic
        return str(spec.to_xml())
    except (ValueError, RuntimeError) as error:
        raise kr5.IoError(f"{arm.file}: cannot be written by MuJoCo: {one_line(error)}") from None


def _set_servo(element: Any, values: dict[str, float]) -> None:
    if "limit" in values:
        element.forcerange, element.forcelimited = [-values["limit"], values["limit"]], 1
    if "kp" in values:
        element.gainprm[0], element.biasprm[1], element.biasprm[2] = values["kp"], -values["kp"], -values["kv"]


def _set_value(element: Any, attribute: str, value: list[float]) -> None:
    """A number, or as many as the version of MuJoCo has of it. attribute: of a joint of MJCF."""
    name = SPEC_NAMES.get(attribute, attribute)
    before = getattr(element, name)
    if np.ndim(before) == 0:
        setattr(element, name, value[0])
        return
    after = np.array(before, float)
    after[: len(value)] = value
    setattr(element, name, after)
