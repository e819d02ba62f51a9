"""Cells written as models of simulators, with what was found in them; and what a format cannot hold."""

import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

import kr5
import kr5.cell
from kr5 import cell as kr5_cell
from kr5 import physics
from kr5.files import writing
from kr5.files.paths import shown_name
from kr5.models.forms import FORMS, Form, lost_field_reason
from kr5.models.kinds import NAMES, Kind, kind_of_file, kind_of_output, model_text
from kr5.models.mjcf_actuators import AS_FOUND, DryFriction

# Parts of a cell that a model of a robot does not have.
OTHER_PARTS = ("servo", "camera", "board", "targets", "laser", "contact", "peg", "tube")


@dataclass
class FoldedParameter:
    """A parameter of an effect that the model holds as a nominal value."""

    effect: str
    target: str
    parameter: str
    value: Any  # number, list or 4x4
    unit: str
    field: str  # of the cell, where it is; empty for an effect of an application

    def to_dict(self) -> dict[str, Any]:
        return dict(self.__dict__)


@dataclass
class Loss:
    """A parameter of an effect that the model cannot hold."""

    effect: str
    target: str
    parameter: str
    value: Any
    unit: str
    reason: str

    def to_dict(self) -> dict[str, Any]:
        return dict(self.__dict__)


@dataclass
class WrittenModel:
    """What became of a cell in a model file."""

    file: Path
    kind: Kind
    folded: list[FoldedParameter]
    losses: list[Loss]
    changes: list[str] = field(default_factory=list)  # elements of the original that changed, in words
    notes: list[str] = field(default_factory=list)  # what else the model lacks, in words

    def to_dict(self) -> dict[str, Any]:
        return {**self.__dict__, "file": str(self.file), "kind": str(self.kind)}


def original_of(model: Any, output: Path | str | None) -> Any:
    """The model that was read (kr5.models.reading.Model, or None), where the one to be written is this with changes;
    else None."""
    if output is None or model is None:
        return None
    kind = kind_of_output(Path(output))
    return model if kind == model.kind and kind in (Kind.URDF, Kind.MJCF) else None


def write_model(
    cell: kr5.cell.Cell,
    output: Path | str,
    original: Path | str | None = None,
    base: str = "",
    tip: str = "",
    friction: DryFriction = AS_FOUND,
) -> WrittenModel:
    """Writes a cell, with its effects, as the model that the ending of `output` names: .urdf, .xml (MJCF), .sdf
    (Gazebo), .drake.sdf (Drake), .py (actuators of Isaac Lab), or .yaml (a cell, whose effects that no nominal value
    holds stay effects).

    original: URDF or MJCF from which the cell was made, of the kind of the output. It is edited in place: names, meshes
    and comments stay. base, tip: as given when it was read. friction: how an MJCF states dry friction, which MuJoCo
    softens. Raises kr5.IoError for an ending, an original or a cell that does not fit, before anything is written.
    """
    out, text = composed_model(cell, output, original, base, tip, friction)
    writing.write_text(text, out.file)
    return out


def composed_model(
    cell: kr5.cell.Cell,
    output: Path | str,
    original: Path | str | None = None,
    base: str = "",
    tip: str = "",
    friction: DryFriction = AS_FOUND,
) -> tuple[WrittenModel, str]:
    """What write_model makes of a cell, and the text that it writes: a command writes nothing before it has ended."""
    output = Path(output)
    kind = kind_of_output(output)
    _check_original(output, kind, original)
    found = physics.fold_effects(cell, add_drives=kind != Kind.CELL)
    out = WrittenModel(output, kind, *_accounts(found, kind))
    out.notes = _notes(found, kind)
    return out, _text(found.cell, out, _Place(Path(original) if original else None, base, tip, friction))


def check_editable(original: Path | str, base: str = "", tip: str = "") -> None:
    """Raises kr5.IoError for a URDF or MJCF whose settings leave no place for what a cell states, whatever that is."""
    if kind_of_file(Path(original)) == Kind.MJCF:
        from kr5.models.mjcf_document import refuse_computed_masses
        from kr5.models.mjcf_loading import load_mjcf

        refuse_computed_masses(load_mjcf(Path(original), base, tip))


def lost_effects(cell: kr5.cell.Cell, kind: Kind) -> list[tuple[str, str]]:
    """The effects of a cell, with their targets, of which a model of this kind cannot hold every parameter."""
    losses = _accounts(physics.fold_effects(cell, add_drives=kind != Kind.CELL), kind)[1]
    return list(dict.fromkeys((loss.effect, loss.target) for loss in losses))


def _check_original(output: Path, kind: Kind, original: Path | str | None) -> None:
    if original is None:
        return
    given = kind_of_file(Path(original))
    if kind not in (Kind.URDF, Kind.MJCF):
        raise kr5.IoError(f"{output}: {NAMES[kind]} is written anew; an original serves .urdf and .xml only")
    if given != kind:
        raise kr5.IoError(
            f"{original}: is {NAMES[given]}, and {output} asks for {NAMES[kind]}; expected an original of the same kind"
        )


@dataclass
class _Place:
    """What a model is written into."""

    original: Path | None
    base: str
    tip: str
    friction: DryFriction


def _text(cell: kr5.cell.Cell, out: WrittenModel, to: _Place) -> str:
    springs = physics.cable_springs(cell)
    if out.kind == Kind.CELL:
        return str(cell.to_yaml())
    if out.kind in (Kind.SDF, Kind.DRAKE):
        from kr5.models.new_sdf import sdf_text

        return sdf_text(cell, springs, out.kind)
    if out.kind == Kind.ISAAC:
        from kr5.models.isaac_actuators import isaac_text

        return isaac_text(cell)
    if out.kind == Kind.URDF:
        return _updated_urdf(cell, out, to.original, to.base, to.tip) if to.original else str(kr5_cell.to_urdf(cell))
    if to.friction != AS_FOUND:
        out.notes.append(_friction_note(to.friction))
    if to.original is None:
        from kr5.models.new_mjcf import mjcf_text

        return mjcf_text(cell, springs, to.friction)
    return _updated_mjcf(cell, out, to, springs)


def _updated_urdf(cell: kr5.cell.Cell, out: WrittenModel, original: Path, base: str, tip: str) -> str:
    update = kr5_cell.update_urdf(cell, model_text(original), shown_name(original), base, tip)
    out.changes = list(update.changes)
    if out.file.resolve().parent == original.resolve().parent:
        return str(update.xml)
    return _with_meshes_of(update.xml, original, out.file)


def _with_meshes_of(xml: str, original: Path, output: Path) -> str:
    """Names of meshes without a package are named from the folder of the URDF."""

    def renamed(found: re.Match[str]) -> str:
        path = original.resolve().parent / found.group("path")
        return found.group("before") + os.path.relpath(path, output.resolve().parent)

    attribute = r"""<(?:mesh|texture)\b[^>]*?\bfilename\s*=\s*(?P<quote>["'])"""
    named = rf"(?P<before>{attribute})(?!\w+:|/)(?P<path>.+?)(?=(?P=quote))"
    return re.sub(named, renamed, xml)


def _friction_note(friction: DryFriction) -> str:
    said = [f"frictionloss is {friction.scale:.3g} times the dry friction of the cell"]
    said += [f"{name} {' '.join(f'{v:g}' for v in values)}" for name, values in friction.solver().items()]
    return f"dry friction, which MuJoCo softens, is stated as it fits best there: {', '.join(said)}"


def _updated_mjcf(cell: kr5.cell.Cell, out: WrittenModel, to: _Place, springs: np.ndarray) -> str:
    from kr5.models.mjcf_document import edited_mjcf
    from kr5.models.mjcf_edits import edits_of
    from kr5.models.mjcf_loading import load_mjcf

    assert to.original is not None, "is edited"
    arm = load_mjcf(to.original, to.base, to.tip)
    edits = edits_of(arm, cell, springs, to.friction)
    text, notes = edited_mjcf(arm, edits, out.file.parent)
    out.changes = edits.changes
    out.notes += notes
    return text


def _accounts(found: physics.FoldedCell, kind: Kind) -> tuple[list[FoldedParameter], list[Loss]]:
    """What the model holds, and what is lost."""
    folded, losses = [], []
    for effect in found.folded:
        if not effect.field or FORMS[kind].holds(effect.field):
            folded += [FoldedParameter(*row, effect.field) for row in _rows(effect)]
        else:
            losses += [Loss(*row, lost_field_reason(kind, effect.field)) for row in _rows(effect)]
    for left in found.remaining:
        if kind == Kind.CELL:
            continue
        if FORMS[kind].springs and _is_spring(found, left):
            folded += [FoldedParameter(*row, "spring of the joint") for row in _rows(left)]
            continue
        what = kr5_cell.find_effect(left.effect).description
        losses += [Loss(*row, f"{NAMES[kind]} cannot express this: {what}") for row in _rows(left)]
    return folded, losses


def _rows(effect: physics.FoldedEffect | physics.RemainingEffect) -> list[tuple[str, str, str, Any, str]]:
    units = {p.name: p.unit for p in kr5_cell.find_effect(effect.effect).parameters}
    return [
        (effect.effect, effect.target, name, writing.to_plain(value), units[name])
        for name, value in effect.parameters.items()
    ]


def _is_spring(found: physics.FoldedCell, effect: physics.RemainingEffect) -> bool:
    """Whether an effect acts as the spring of a joint, which some formats have."""
    bare = found.cell
    without = bare.effects.to_dict()
    del without[effect.effect][effect.target]
    bare.effects = without
    return not np.array_equal(physics.cable_springs(bare), physics.cable_springs(found.cell))


def _unheld_servo_parts(servo: kr5.cell.Servo, form: Form) -> list[str]:
    """What of the torque servos a form does not have, by the names of the fields."""
    stated = [name for name in servo.torque[0].to_dict() if name != "hold"]
    out = [name for name in stated if name not in form.servo and any(getattr(one, name) for one in servo.torque)]
    held = all(str(one.hold) == "held" for one in servo.torque)
    return out if held else [*out, "hold"]


def _notes(found: physics.FoldedCell, kind: Kind) -> list[str]:
    """What the model lacks beside the effects; of a cell, which of them stay effects."""
    cell, form = found.cell, FORMS[kind]
    if kind == Kind.CELL:
        left = ", ".join(f"{effect.effect} {effect.target}" for effect in found.remaining)
        return [f"these stay effects, for no nominal value holds them: {left}"] if left else []
    notes = []
    held: tuple[str, ...] = ()
    if form.servo and cell.servo is not None and cell.servo.torque:
        held = ("servo",)
        if lacking := _unheld_servo_parts(cell.servo, form):
            notes.append(f"{NAMES[kind]} has no place for these parts of a servo: {', '.join(lacking)}")
        notes += [form.limits] if form.limits else []
    if parts := [name for name in OTHER_PARTS if getattr(cell, name) and name not in held]:
        notes.append(f"{NAMES[kind]} has no place for these parts of the cell: {', '.join(parts)}")
    return [*notes, *_drive_notes(cell, kind), *_robot_notes(cell, kind)]


def _drive_notes(cell: kr5.cell.Cell, kind: Kind) -> list[str]:
    drives, form, notes = cell.drives, FORMS[kind], []
    if drives is None:
        return []
    S, J = np.asarray(drives.structure), np.asarray(drives.rotor_inertia)
    coupled = S.T @ np.diag(J) @ S
    if form.rotors and np.abs(coupled - np.diag(np.diag(coupled))).max() > 1e-12 * np.abs(coupled).max():
        notes.append("the rotors of coupled joints turn with their own joint alone: armature couples no joints")
    if not form.rotors and J.any():
        notes.append(f"{NAMES[kind]} has no place for the inertia of the rotors")
    if not form.holds("drives.friction.coulomb[0]") and np.any(drives.friction.coulomb):
        notes.append(f"{NAMES[kind]} has no place for dry friction of the joints")
    return notes


def _robot_notes(cell: kr5.cell.Cell, kind: Kind) -> list[str]:
    if kind == Kind.ISAAC:
        return ["the arm itself stands in its USD or URDF, which has to hold its masses and lengths"]
    if FORMS[kind].gravity or np.allclose(cell.robot.gravity, (0.0, 0.0, -9.81), atol=1e-12):
        return []
    g = " ".join(f"{v:g}" for v in cell.robot.gravity)
    return [f"gravity is the world's in {NAMES[kind]}: set it to {g} m/s^2 in axes of the base"]
