"""What the columns of a log show, by their names: which quantity, of which joint of the arm. What words mean is the
library's (`kr5/arm_log/column_words.hpp`)."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from kr5 import arm_log
from kr5.arm_log import words_of
from kr5.logs.log import Log

JOINT = "#"  # stands for the joint in a stem

NUMBER = re.compile(r"\d+")
PLAIN_JOINT = re.compile(r"_?(joint|link|revolute|prismatic)_?")


@dataclass
class Family:
    """Columns of one quantity, one a joint in the order of the arm."""

    name: str  # q, qc, i, tau or qd
    columns: list[str]
    stem: str = ""
    unit: str | None = None  # as the name says it
    motor_side: bool = False
    named: bool = False  # by the names of the joints, not by numbers
    note: str = ""  # what of a vector of the log was left out, or taken by its place alone
    guessed_gripper: bool = False  # whether a component was left out as a gripper by its place alone


@dataclass
class FoundFamilies:
    """What was recognised; of each quantity the family that is used first."""

    families: dict[str, list[Family]] = field(default_factory=dict)
    joint_words: list[str] = field(default_factory=list)  # what stands where a joint should, of columns that do not fit
    lacking: dict[str, list[str]] = field(default_factory=dict)  # of a quantity of named joints, those without it
    vectors: dict[str, int] = field(default_factory=dict)  # those of other sizes than the arm, with their size

    def lacking_of(self, name: str) -> list[str]:
        """Joints without a column of a quantity that others have."""
        return [] if name in self.families else self.lacking.get(name, [])

    def first(self, name: str) -> Family | None:
        return self.families[name][0] if name in self.families else None


def find_families(log: Log, joints: Sequence[str], number: int) -> FoundFamilies:
    """The families of an arm with these names of joints (none: unnamed) and this number of them.

    A joint is recognised by its name; else by the name that a column of text gives for its index, as in exports of
    joint states; else by the words in which the columns of a family differ; else by its number.
    """
    found = FoundFamilies()
    for stem, columns in log.arrays.items():
        name = quantity_of_vector(stem)
        if name is not None:
            _add_vector(found, name, stem, columns, log, joints, number)
    stems = _stems(log, joints, number)
    for stem, keyed in stems.items():
        name = quantity_of(stem)
        if name is None:
            continue
        ordered, named = _in_order(keyed, joints, number)
        if ordered is None:
            found.joint_words += [key for key in keyed if key not in found.joint_words]
            if any(j in keyed for j in joints):
                found.lacking.setdefault(name, [j for j in joints if j not in keyed])
            continue
        found.families.setdefault(name, []).append(_family(name, ordered, stem, named))
    for families in found.families.values():
        families.sort(key=_preference)
    return found


def _add_vector(
    found: FoundFamilies, name: str, stem: str, columns: list[str], log: Log, joints: Sequence[str], number: int
) -> None:
    """A vector of the log: by the names of its components, else by their places, without a gripper."""
    labels = [log.labels.get(column, "") for column in columns]
    by_name = _by_labels(columns, labels, joints)
    grippers = [c for c, label in zip(columns, labels) if arm_log.names_gripper(label)]
    ordered, note, guessed_gripper = by_name, "", False
    if by_name is not None:
        rest = [column for column in columns if column not in by_name]
        note = f"{', '.join(rest)} {_is_are(rest)} left out, a gripper or no joint of the arm" if rest else ""
    elif len(columns) == number:
        ordered = columns
    elif grippers and len(columns) - len(grippers) == number:
        ordered = [column for column in columns if column not in grippers]
        note = f"{', '.join(grippers)} {_is_are(grippers)} left out, since a gripper is no joint of the arm"
    elif len(columns) == number + 1 and not any(labels):
        ordered, guessed_gripper = columns[:-1], True
        note = f"{columns[-1]} is left out, taken for a gripper: the arm has {number} joints, and the vector one more"
    if ordered is None:
        found.joint_words += [label for label in labels if label and label not in found.joint_words]
        found.vectors[stem] = len(columns)
        return
    if by_name is None and joints and any(labels):
        told = [log.labels[c] for c in ordered]
        place = f"{', '.join(told)} of {stem} are taken in this order for {', '.join(joints)}"
        note = f"{note}; {place}" if note else place
    family = _family(name, list(ordered), f"{stem}.{JOINT}", by_name is not None)
    family.note, family.guessed_gripper = note, guessed_gripper
    found.families.setdefault(name, []).append(family)


def _family(name: str, columns: list[str], stem: str, named: bool) -> Family:
    """Columns of a quantity, with what their stem tells of unit and side."""
    return Family(name, columns, stem, arm_log.unit_in(stem) or None, arm_log.on_motor_side(stem), named)


def _is_are(columns: Sequence[str]) -> str:
    return "is" if len(columns) == 1 else "are"


def _by_labels(columns: Sequence[str], labels: Sequence[str], joints: Sequence[str]) -> list[str] | None:
    """The columns in the order of the arm, where their labels name its joints."""
    if not joints or not any(labels):
        return None
    holding = {joint: [c for c, label in zip(columns, labels) if _holds(label, joint)] for joint in joints}
    exact = {joint: [c for c, label in zip(columns, labels) if label == joint] for joint in joints}
    best = [exact[joint] or holding[joint] for joint in joints]
    if all(len(found) == 1 for found in best):
        return [found[0] for found in best]
    match = _matched(labels, joints)
    return [columns[labels.index(match[joint])] for joint in joints] if match else None


def spoken_joints(columns: Sequence[str]) -> list[str]:
    """What stands in the place of joints in columns such as /joint_states/elbow/position."""
    fields = [column.split("/") for column in columns]
    between = [parts[-2] for parts in fields if len(parts) > 2 and _tells_position(parts[-1])]
    return list(dict.fromkeys(between))


def _tells_position(name: str) -> bool:
    return any(arm_log.meaning_of(word) == arm_log.ColumnWord.Position for word in words_of(name))


def is_quantity(word: str) -> bool:
    """Whether a word of a name tells a quantity or how it was come by, not a joint."""
    return arm_log.meaning_of(word.lower()) != arm_log.ColumnWord.None_


def quantity_of_vector(stem: str) -> str | None:
    """The family of a vector of the log, by its name."""
    return quantity_of(f"{stem}.{JOINT}")


def quantity_of(stem: str) -> str | None:
    """The family of a stem, a name in which `#` stands for the joint."""
    family = arm_log.family_of(stem)
    return None if family == arm_log.ColumnFamily.None_ else str(family)


def _preference(family: Family) -> tuple[bool, bool, bool, int]:
    """States of joints before those of controllers, and these before what the controller puts out; names before
    numbers; short before long."""
    words = set(words_of(family.stem))
    return (not family.named, "controller" in words, "output" in words, len(family.stem))


def _stems(log: Log, joints: Sequence[str], number: int) -> dict[str, dict[str, str]]:
    """Columns by their names without the joint: the joint's name, or its number, to the column; of an arm with one
    joint, whose columns need not name it, all of the name."""
    in_vectors = {column for columns in log.arrays.values() for column in columns}
    by_length = sorted(joints, key=len, reverse=True)
    out: dict[str, dict[str, str]] = {}
    rest = []
    for column in log.columns:
        if column in in_vectors:
            continue
        joint = next((j for j in by_length if _holds(column, j)), None)
        if joint is not None:
            out.setdefault(_replaced(column, joint), {}).setdefault(joint, column)
        else:
            rest.append(column)
    spoken = _spoken_names(log)
    for column in rest:
        if matches := list(NUMBER.finditer(column)):
            last = matches[-1]
            stem = column[: last.start()] + JOINT + column[last.end() :]
            key = spoken.get(_group(column), {}).get(int(last[0]), last[0])
            out.setdefault(stem, {}).setdefault(key, column)
        elif number == 1:
            out.setdefault(column, {"1": column})
    for stem, columns in _differing_words(rest).items():
        out.setdefault(stem, columns)
    return out


def _holds(column: str, joint: str) -> bool:
    return re.search(rf"(?<![A-Za-z0-9]){re.escape(joint)}(?![A-Za-z0-9])", column) is not None


def _replaced(column: str, joint: str) -> str:
    return re.sub(rf"(?<![A-Za-z0-9]){re.escape(joint)}(?![A-Za-z0-9])", JOINT, column, count=1)


def _group(column: str) -> str:
    """What stands before the last word and number: arrays of one message share it."""
    return re.sub(r"[A-Za-z_]*\[?\d+\]?$", "", column)


def _spoken_names(log: Log) -> dict[str, dict[int, str]]:
    """Of each message, the names of its joints by index, where columns of text say them (`field.name0`: elbow)."""
    out: dict[str, dict[int, str]] = {}
    for column, cell in log.text_columns.items():
        match = re.search(r"names?\[?(\d+)\]?$", column.lower())
        if match:
            out.setdefault(_group(column), {})[int(match[1])] = cell.text
    return out


def _differing_words(columns: Sequence[str]) -> dict[str, dict[str, str]]:
    """Columns that differ in one word that names a part (q_torso, q_arm1): by what they have in common."""
    out: dict[str, dict[str, str]] = {}
    for column in columns:
        parts = re.split(r"[_./\s]+", column)
        for k, part in enumerate(parts):
            if len(parts) > 1 and re.search(r"[A-Za-z]", part):
                out.setdefault("_".join([*parts[:k], JOINT, *parts[k + 1 :]]), {}).setdefault(part, column)
    return {stem: found for stem, found in out.items() if len(found) > 1}


def _in_order(columns: dict[str, str], joints: Sequence[str], number: int) -> tuple[list[str] | None, bool]:
    """The columns in the order of the arm, and whether names told it; nothing where they are not those of the arm."""
    if joints and all(j in columns for j in joints):
        return [columns[j] for j in joints], True
    if joints and (match := _matched(list(columns), joints)):
        return [columns[match[j]] for j in joints], True
    if len(columns) == number and all(NUMBER.fullmatch(key) for key in columns):
        return [columns[key] for key in sorted(columns, key=int)], False
    return None, False


def _matched(words: Sequence[str], joints: Sequence[str]) -> dict[str, str] | None:
    """One word for each joint, where the plain names leave no choice: `torso` for `torso_lift_joint`."""
    plain: Callable[[str], str] = lambda name: re.sub(r"[^a-z0-9]", "", PLAIN_JOINT.sub("_", name.lower()))
    out: dict[str, str] = {}
    for joint in joints:
        own = plain(joint)
        fitting = [w for w in words if re.search(r"[a-z]", w.lower()) and _same_part(plain(w), own)]
        if len(fitting) != 1 or fitting[0] in out.values():
            return None
        out[joint] = fitting[0]
    return out


def _same_part(word: str, joint: str) -> bool:
    """Whether one begins with the other; digits are not cut (`arm1` is no beginning of `arm10`)."""
    short, long = sorted((word, joint), key=len)
    return len(short) >= 2 and long.startswith(short) and not (short[-1].isdigit() and long[len(short) :][:1].isdigit())
