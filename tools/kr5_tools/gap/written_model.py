"""A model that was written of a tuned cell: what MuJoCo says of it, and what its format cannot hold."""

import warnings

import kr5
import kr5.cell
from kr5.logs.compared_source import ComparedSource, SourceOptions
from kr5.models.kinds import Kind
from kr5.models.mujoco_check import MujocoCheck, confirm_written, has_commanded_motions
from kr5.models.writing import WrittenModel, original_of

from kr5_tools.cli import tables, terminal
from kr5_tools.cli.terminal import Console


def confirmed_in_mujoco(
    written: WrittenModel | None, tuned: kr5.cell.Cell, compared: ComparedSource, reading: SourceOptions
) -> MujocoCheck | None:
    """What MuJoCo says of a model, where that is an MJCF with servos; a caution where it cannot say anything."""
    if written is None or written.kind != Kind.MJCF or not has_commanded_motions(compared.recording):
        return None
    original = original_of(compared.model, written.file)
    file, base, tip = (original.file, reading.base, reading.tip) if original else (None, "", "")
    try:
        with terminal.share_bar("Moving the model in MuJoCo") as progress:
            return confirm_written(written, compared.recording, tuned, file, base, tip, progress)
    except kr5.IoError as error:
        warnings.warn(f"MuJoCo has not confirmed the model: {error}", kr5.Caution, stacklevel=2)
        return None


def print_left_out(written: WrittenModel, to: Console) -> None:
    """What a model does not hold, and its notes."""
    if written.losses:
        rows = [list(row) for row in dict.fromkeys((x.effect, x.target, x.reason) for x in written.losses)]
        to.print(tables.make_table("Not in the model", ["effect", "target", "reason"], rows, text=(1, 2)))
    for note in written.notes:
        to.print(f"Note: {note}.", soft_wrap=True, markup=False)
