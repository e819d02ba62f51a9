"""`kr5 demo`: the whole job on images and a cell whose truth is known, and how near the answers came."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Annotated, Any

import typer
from kr5.files import writing
from kr5.files.documents import read_json, read_yaml
from kr5.files.paths import find_shipped

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.interruption import run_child, tell_when_stopped
from kr5_tools.cli.numbers import format_number
from kr5_tools.cli.terminal import Console

app = typer.Typer()

DATA = Path("share/data/demo")
FRICTION = "friction"  # folder beside the data of the demo: a recording that is diagnosed
WORN_CELL = "worn_cell_recording"  # a name that nobody's own folder has: it is replaced


@app.command(epilog="Example: kr5 demo share/data/demo -o kr5-demo")
def demo(
    data: Annotated[
        Path | None,
        typer.Argument(
            metavar="FOLDER",
            help=(
                "Data of the demo, beside the folder `friction` of the recording to diagnose; by default those"
                " that ship with kr5."
            ),
        ),
    ] = None,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for results, pages and plots.")
    ] = Path("kr5-demo"),
    json_file: arguments.JsonOption = None,
) -> None:
    """Demonstration of the main commands on data with known truth: camera and hand-eye calibration from images, a
    recording of a worn cell with its gap to the nominal cell, the diagnosis of another one, and an insertion.

    Exit code 1 when the truth lies outside the estimated 99.9 % region, the disturbed view is not identified, the
    largest gap is not at the worn joint, the diagnosis does not name the true cause, or the peg is not inserted.
    """
    begin = time.monotonic()
    data = data or find_shipped(DATA) or DATA
    truth, friction = _load(data / "truth.yaml"), _load(data.parent / FRICTION / "truth.yaml")
    worn, target = _worn(data), _load(data / "dataset.yaml")["target"]
    out = terminal.console(json_file)
    _run(_jobs(data, target, _emptied(output)), out)
    found = _found(output, truth)
    _tell(out, found["figures"], found["named"], found["region_99_9"], truth)
    _tell_of_cell(out, found, worn, friction)
    pages = [output / f"{name}.html" for name in ("hand_eye", "camera", "diagnosis", "replay", "insertion")]
    listed = f"{', '.join(map(str, pages[:-1]))} and {pages[-1]}"
    out.print(f"Took {time.monotonic() - begin:.1f} s. Open {listed} in a browser.", soft_wrap=True)
    writing.write_json({**found, "bumped": truth["bumped"], "worn": worn, "output": str(output)}, json_file)
    if not _is_as_claimed(found, truth, worn, friction):
        raise typer.Exit(1)


def _emptied(output: Path) -> Path:
    """The folder for the results, without the recording of the demo before, whole or not."""
    output.mkdir(parents=True, exist_ok=True)
    if (output / WORN_CELL).exists():
        shutil.rmtree(output / WORN_CELL)
    tell_when_stopped(lambda: f"the finished files are kept in {output}")
    return output


def _jobs(data: Path, target: str, output: Path) -> list[list[list[str]]]:
    """All commands of the demo."""
    images = sorted(str(p) for p in (data / "images").glob("*.png"))
    return [
        _calibration("camera", ["camera", *images, "--target", target], output),
        _calibration("hand_eye", ["hand-eye", str(data)], output),
        _worn_cell(data, output),
        _diagnosis(data.parent / FRICTION, output),
        _insertion(data, output),
    ]


def _found(output: Path, truth: dict[str, Any]) -> dict[str, Any]:
    """What the commands found, from their files."""
    camera, hand_eye = (read_json(output / f"{name}.json") for name in ("camera", "hand_eye"))
    return {
        "figures": [*_camera_rows(camera, truth), *_hand_eye_rows(hand_eye, truth)],
        "region_99_9": _region(hand_eye, truth),
        "named": [v["name"] for v in hand_eye["views"] if v.get("outlier")],
        "gaps": read_json(output / "gap.json")["columns"],
        "causes": read_json(output / "diagnosis.json")["causes"],
        "insertion": read_json(output / "insertion.json"),
    }


def _widest(gaps: dict[str, float]) -> str:
    """The column with the widest gap."""
    return max(gaps, key=gaps.__getitem__)


def _tell_of_cell(out: Console, found: dict[str, Any], worn: dict[str, str], friction: dict[str, Any]) -> None:
    """The gap of the worn cell, the diagnosis and the insertion, for people."""
    widest = _widest(found["gaps"])
    out.print(
        f"\nThe cell that ran carries {worn['effect']} on {worn['target']}; the widest gap to the nominal cell is that"
        f" of {widest}, {found['gaps'][widest]:.1f} times the noise.",
        soft_wrap=True,
    )
    out.print(_cause_text(found["causes"], friction), soft_wrap=True)
    out.print(_peg_words(found["insertion"]), soft_wrap=True)


def _is_as_claimed(
    found: dict[str, Any], truth: dict[str, Any], worn: dict[str, str], friction: dict[str, Any]
) -> bool:
    """Whether every part of the demo found the truth."""
    bumped = [Path(name).stem for name in found["named"]] == [Path(truth["bumped"]).stem]
    where = _widest(found["gaps"]).endswith(f".i{worn['target'].removeprefix('joint')}")
    named = _is_named(found["causes"], friction)
    return found["region_99_9"] <= 1 and bumped and where and named and found["insertion"]["inserted"]


def _calibration(name: str, command: list[str], output: Path) -> list[list[str]]:
    """A calibration and its page."""
    result = str(output / f"{name}.json")
    return [
        ["calibrate", *command, "-o", result],
        ["report", result, "-o", str(output / f"{name}.html"), "--png", str(output / f"{name}_plots")],
    ]


def _worn_cell(data: Path, output: Path) -> list[list[str]]:
    """What the worn cell records, the gap of every column against the nominal cell, and a replay."""
    recording = output / WORN_CELL
    cell, protocol = str(data / "worn_cell.yaml"), str(data / "protocol.yaml")
    return [
        ["record", "--cell", cell, "--protocol", protocol, "-o", str(recording), "--nominal"],
        ["gap", "measure", str(recording), "--json", str(output / "gap.json"), "--png", str(output / "gap.png")],
        ["replay", str(recording), "-o", str(output / "replay.html")],
    ]


def _diagnosis(recording: Path, output: Path) -> list[list[str]]:
    """Why simulation and recording disagree, and its page."""
    page = ["-o", str(output / "diagnosis.json"), "--report", str(output / "diagnosis.html")]
    return [["gap", "diagnose", str(recording), *page]]


def _is_named(causes: Sequence[Mapping[str, object]], truth: Mapping[str, object]) -> bool:
    """Whether the true effect is the only cause."""
    return [(c["effect"], c["target"]) for c in causes] == [(truth["effect"], truth["target"])]


def _cause_text(causes: list[dict[str, Any]], truth: dict[str, Any]) -> str:
    ((name, true),) = truth["parameters"].items()
    found = ", ".join(f"{c['effect']} on {c['target']}" for c in causes) or "no cause"
    text = (
        f"Diagnosis of a recording whose cell carries {truth['effect']} on {truth['target']} ({name} {true:.3f} N m):"
        f" found {found}"
    )
    if not _is_named(causes, truth):
        return f"{text}."
    estimate = causes[0]["parameters"][name]
    value, std = float(estimate["value"]), float(estimate["std"])
    return f"{text}, {name} {format_number(value, std)} ± {format_number(std, std)} N m."


def _insertion(data: Path, output: Path) -> list[list[str]]:
    """The worn cell searches for a tube and inserts its peg."""
    task = ["--clearance", "0.05", "--offset", "4", "-3"]
    return [
        [
            "insert",
            "--cell",
            str(data / "worn_cell.yaml"),
            *task,
            "-o",
            str(output / "insertion.html"),
            "--json",
            str(output / "insertion.json"),
        ]
    ]


def _peg_words(result: dict[str, Any]) -> str:
    peg = result["pegs"][0]
    if not peg["inserted"]:
        return f"The worn cell did not insert its peg: {peg['reason']} in {peg['phase']}."
    return (
        "The worn cell inserts its peg into a tube 5 mm from its assumed position, with 0.05 mm of clearance, at"
        f" attempt {peg['attempts']} after {peg['time']:.1f} s; it presses with {peg['max_force']:.0f} N at most."
    )


def _worn(data: Path) -> dict[str, str]:
    """What the worn cell carries."""
    ((effect, targets),) = _load(data / "worn_cell.yaml")["effects"].items()
    return {"effect": effect, "target": next(iter(targets))}


def _load(file: Path) -> Any:
    return read_yaml(file, "the data of the demo; specify their folder: kr5 demo CHECKOUT/share/data/demo")


def _run(jobs: list[list[list[str]]], out: Console) -> None:
    """Jobs side by side, as many as there are cores; the commands of a job one after the other."""
    with terminal.spinner("Running the commands"), ThreadPoolExecutor(os.cpu_count()) as pool:
        done = list(pool.map(lambda job: _run_job(job, out), jobs))
    failed = [d for d in done if d.returncode]
    for job in failed:
        terminal.errors.print(job.stderr, markup=False, end="")
    if failed:
        raise typer.Exit(failed[0].returncode)


def _run_job(commands: list[list[str]], out: Console) -> subprocess.CompletedProcess[str]:
    """How the last command that ran ended."""
    for command in commands:
        shown = " ".join(command) if len(command) < 12 else f"{' '.join(command[:3])} … {' '.join(command[-4:])}"
        out.print(f"$ kr5 {shown}", style="bold", soft_wrap=True)
        done = run_child([sys.executable, "-m", "kr5_tools", *command])
        if done.returncode:
            break
    return done


def _row(name: str, value: float, std: float, true: float, unit: str) -> dict[str, Any]:
    return {"name": name, "value": value, "std": std, "truth": true, "error": value - true, "unit": unit}


def _camera_rows(data: dict[str, Any], truth: dict[str, Any]) -> list[dict[str, Any]]:
    result = data["result"]
    return [
        _row(name, result["camera"][name], result["covariance"][i][i] ** 0.5, truth["camera"][name], "px")
        for i, name in enumerate(("fx", "fy", "cx", "cy"))
    ]


def _hand_eye_rows(data: dict[str, Any], truth: dict[str, Any]) -> list[dict[str, Any]]:
    found = tables.pose_figures("camera on flange,", data["result"]["T_mount_camera"], data["result"]["covariance"])
    true = tables.pose_figures("", truth["T_flange_camera"], data["result"]["covariance"])
    return [_row(f["name"], f["value"], f["std"], t["value"], f["unit"]) for f, t in zip(found, true)]


def _region(data: dict[str, Any], truth: dict[str, Any]) -> float:
    """Squared distance to the truth over that of the 99.9 % region: 1 on its border."""
    import kr5
    import kr5.uncertainty
    import numpy as np

    d = kr5.pose_difference(data["result"]["T_mount_camera"], truth["T_flange_camera"])
    return float(d @ np.linalg.solve(np.array(data["result"]["covariance"]), d)) / kr5.uncertainty.chi_square_quantile(
        0.999, 6
    )


def _tell(out: Console, rows: list[dict[str, Any]], named: list[str], ratio: float, truth: dict[str, Any]) -> None:
    import numpy as np

    cells = (
        [
            r["name"],
            format_number(r["value"], r["std"]),
            format_number(r["std"], r["std"]),
            format_number(r["truth"], r["std"]),
            format_number(r["error"], r["std"]),
            r["unit"],
        ]
        for r in rows
    )
    out.print(
        tables.make_table("\nEstimate and truth", ["quantity", "estimate", "± std", "truth", "error", "unit"], cells)
    )
    place = [r for r in rows if r["unit"] == "mm"]
    error, claimed = (float(np.sqrt(sum(r[key] ** 2 for r in place))) for key in ("error", "std"))
    verdict = "within" if ratio <= 1 else "outside"
    out.print(
        f"\nThe camera's place on the flange is {error:.3f} mm from the truth; {claimed:.3f} mm was claimed (one"
        f" standard deviation). The truth lies {verdict} the claimed 99.9 % region.",
        soft_wrap=True,
    )
    out.print(
        f"The arm was disturbed in {truth['bumped']}; found to contradict the others: {', '.join(named) or 'none'}.",
        soft_wrap=True,
    )
