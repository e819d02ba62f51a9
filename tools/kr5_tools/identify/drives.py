"""`kr5 identify drives`: structure matrix, gear ratios and encoder counts, from readings of motors and joints."""

import math
from pathlib import Path
from typing import Annotated, Any

import kr5.identification
import numpy as np
import typer
from kr5 import identification
from kr5.files.results import write_if_usable, write_result
from kr5.files.writing import check_writable
from kr5.tables.options import TableOptions
from kr5.tables.roles import Role

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.cell_output import CellOption, WriteCellOption, load_target_cell, write_cell_file
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import AngleUnit, ColumnsOption, EpisodeOption, tell_notes
from kr5_tools.cli.tables import figure_row, print_result
from kr5_tools.cli.terminal import console, fail

JOINTS = Role("q", "joint angles", "angle", counted=True, may_lack=True)
COUNTS = Role("c", "encoder counts", counted=True, needed=False, may_lack=True)
MOTORS = Role("m", "motor angles", "angle", counted=True, needed=False, may_lack=True, follows="q", largest=math.inf)
GROUP = Role("group", "number of the experiment", needed=False)

app = typer.Typer()


@app.command(epilog="Example: kr5 identify drives readings.csv --angle-unit deg --common-zero -o drives.json")
@options_from(identification.DriveOptions, skip=("counts_per_turn",))
def drives(
    file: Annotated[
        Path,
        typer.Argument(
            metavar="READINGS",
            help=(
                "Table, a row a posture: joint angles q1, q2, …; encoder counts c1, c2, … or motor angles m1, m2, …, or"
                " both; empty where nothing was read. A column `group` numbers experiments with a zero of their own."
            ),
        ),
    ],
    options: identification.DriveOptions,
    counts_per_turn: Annotated[
        str | None,
        typer.Option(metavar="N,N,…", help="Encoder counts of a turn of each motor; one number for all of them. [-]"),
    ] = None,
    columns: ColumnsOption = None,
    episodes: EpisodeOption = "",
    angle: AngleUnit = None,
    output: ResultOption = None,
    cell: CellOption = None,
    write_cell: WriteCellOption = None,
    json_file: JsonOption = None,
) -> None:
    """Structure matrix S (motor angle = S q) with the couplings that the readings show, ratios and counts per turn.

    Readings that contradict the others are named and left out.
    """
    check_writable(output, write_cell, json_file, inputs=[file, *([cell] if cell else [])])
    believed = load_target_cell(cell, write_cell)
    wanted = TableOptions(columns, angle=angle, episodes=episodes)
    readings = read_readings(file, wanted)
    tell_notes(wanted.notes)
    n = readings.joint.shape[1]
    if counts_per_turn:
        given = read_counts(counts_per_turn)
        if len(given) not in (1, n):
            fail(f"--counts-per-turn: found {len(given)} numbers, expected 1 or {n}")
        options.counts_per_turn = np.full(n, given[0]) if len(given) == 1 else np.array(given)
    result = identification.identify_drives(readings, options)
    keys = result_keys(file, result)
    data = write_result(None, "kr5-drives/1", **keys)
    write_if_usable(data, result.fit, output, json_file)
    print_result(keys, console(json_file))
    if believed is not None:
        changed = believed.drives
        if changed is None or len(changed.structure) != n:
            fail(f"--cell: expected drives of {n} motors in the cell, into which the structure matrix is put")
        changed.structure = result.structure
        believed.drives = changed
        write_cell_file(believed, write_cell)


def read_counts(text: str) -> list[float]:
    """Numbers with commas."""
    try:
        out = [float(part) for part in text.split(",")]
    except ValueError:
        fail(f"--counts-per-turn: found {text!r}, expected numbers with commas, as 16384,16384")
    if not all(0 < x < np.inf for x in out):
        fail(f"--counts-per-turn: found {text!r}, expected numbers above 0")
    return out


def read_readings(file: Path, wanted: TableOptions) -> Any:
    """Readings of a table; columns that are not there were not read."""
    table = wanted.read(file, [JOINTS, COUNTS, MOTORS, GROUP])
    n = table["q"].shape[1]
    for role in ("c", "m"):
        if role in table and table[role].shape[1] != n:
            raise table.lacks(f"{role}{table[role].shape[1] + 1}", f"one of {n} joints")
    if "c" not in table and "m" not in table:
        fail(f"{file}: found neither encoder counts c1 to c{n} nor motor angles m1 to m{n}")
    empty = np.empty((0, 0))
    counts, motor = (empty if (found := table.get(role)) is None else found for role in ("c", "m"))
    group = [int(g) for g in table["group"]] if "group" in table else []
    return identification.DriveReadings(counts=counts, motor=motor, joint=table["q"], group=group)


def result_keys(file: Path, result: kr5.identification.DriveResult) -> dict[str, Any]:
    """What the result file holds beside its head."""
    S, sigma = np.asarray(result.structure), np.asarray(result.sigma)
    n = len(S)
    figures = [figure_row(f"ratio of joint {k + 1}", float(S[k, k]), float(sigma[k, k]), "-") for k in range(n)]
    figures += [figure_row(f"motor {c.motor} with joint {c.joint}", c.value, c.sigma, "-") for c in result.couplings]
    figures += [
        figure_row(f"counts per turn of motor {k + 1}", float(v), None, "-")
        for k, v in enumerate(result.counts_per_turn)
        if np.isfinite(v)
    ]
    warnings = [
        (
            f"motor {o.motor}, row {o.reading}: the joint angle is {180 / np.pi * o.residual:.3g} deg off"
            " the value by the other readings, and was left out"
        )
        for o in result.outliers
    ]
    warnings += result.warnings
    if unseen := result.unseen:
        warnings.append(f"{len(unseen)} couplings are not determined, for example {unseen[0].text}")
    text = f"{len(result.couplings)} couplings between joints and motors"
    return {
        "input": {"file": str(file)},
        "verdict": {"word": "doubtful" if warnings else "good", "text": "; ".join([text, *warnings])},
        "figures": figures,
        "result": result.to_dict(),
    }
