"""`kr5 identify study`: error of a circle-point analysis by device, noise and arc, on a simulated arm."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import kr5.cell
import kr5.kinematics
import numpy as np
import typer
from kr5 import calibration, cell, kinematics
from kr5.files.paths import find_shipped_cell
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, track
from kr5_tools.identify.devices import Device, make_devices

app = typer.Typer()
LEAST = 6  # measurements of an arc
DEGREE = np.pi / 180


@app.command(epilog="Example:  kr5 identify study --arc 20 --arc 50 --trials 20 -o study.json")
def study(
    cell_file: Annotated[
        Path | None, typer.Option("--cell", help="Cell with the arm and the camera; by default that of the book.")
    ] = None,
    device: Annotated[
        list[str] | None,
        typer.Option(help="total_station, laser_tracker or camera; may be given several times; by default all."),
    ] = None,
    arc: Annotated[
        list[float] | None,
        typer.Option(help="Arc of each joint \\[deg]; may be given several times; by default 20, 50."),
    ] = None,
    noise: Annotated[
        list[float] | None,
        typer.Option(
            help=(
                "Noise in units of the device's usual one (total station 1 mm, laser tracker 0.01 mm, camera 0.2 px);"
                " may be given several times; by default 0.5, 1, 2."
            )
        ),
    ] = None,
    home: Annotated[
        str | None,
        typer.Option(metavar="Q1,Q2,…", help="Posture about which the joints turn \\[deg]; by default mid-range."),
    ] = None,
    samples: Annotated[
        int | None,
        typer.Option(
            min=LEAST,
            max=10000,
            help="Measurements of each arc; by default total station 20, laser tracker 200, camera 40.",
        ),
    ] = None,
    trials: Annotated[
        int, typer.Option(min=2, max=100000, help="Number of simulated identifications of each kind.")
    ] = 10,
    map_error: Annotated[
        float, typer.Option(min=0.0, help="Standard deviation of each marker's place in the map of the camera \\[m].")
    ] = 2e-4,
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 1,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Noise study of the identification of axes: total station, laser tracker and camera before a map of markers, over
    arcs and noises, with the RMS error of the lengths and angles that follow (Hayat et al. 2022, Table 4.2).

    Errors are root mean squares over the parameters and the trials. Lengths are a, and b between axes that are not
    parallel; angles are those between neighbouring axes.
    """
    check_writable(output, json_file, inputs=[f for f in (cell_file,) if f])
    believed = cell.load_cell(cell_file or _shipped_cell())
    chain = believed.nominal_chain()
    posture = _home(home, believed, len(chain.joints))
    wanted = _devices(device, make_devices_of(believed, chain.flange(posture), map_error, seed))
    arcs, factors = _positive("--arc", arc or [20.0, 50.0], 300.0), _positive("--noise", noise or [0.5, 1.0, 2.0], 1e3)
    cases = [(d, a, f) for d in wanted for a in arcs for f in factors]
    rows = []
    for number, (one, a, f) in enumerate(track(cases, "Simulating")):
        found = simulate(
            chain, posture, one, a * DEGREE, f * one.noise, samples or one.samples, trials, seed + 1000 * number
        )
        rows.append(
            {
                "device": one.name,
                "label": one.label,
                "arc_deg": a,
                "noise": f * one.noise,
                "samples": samples or one.samples,
                "unit": one.unit,
                "factor": f,
                **found,
            }
        )
    keys = _keys(rows, believed, posture, samples, trials, map_error, seed)
    _show(keys, console(json_file))
    write_json(write_result(output, "kr5-axes-study/1", **keys), json_file)


def make_devices_of(believed: kr5.cell.Cell, home_flange: np.ndarray, map_error: float, seed: int) -> dict[str, Device]:
    """Devices for a cell; without a camera only those that track a reflector."""
    if believed.camera is not None and (believed.camera.T_flange_camera is not None or believed.tool is not None):
        return make_devices(believed, home_flange, map_error, seed)
    return make_devices(cell.load_cell(_shipped_cell()), home_flange, map_error, seed)


def _shipped_cell() -> Path:
    if (found := find_shipped_cell()) is None:
        fail("--cell: is missing, and the cell that ships with kr5 was not found")
    return found


def _home(text: str | None, believed: kr5.cell.Cell, joints: int) -> np.ndarray:
    if text is None:
        limits = believed.robot.limits
        if len(limits.lower) != joints:
            fail("--home: is missing; the cell has no joint limits, whose middle could be taken")
        return np.asarray(0.5 * (np.asarray(limits.lower) + np.asarray(limits.upper)))
    try:
        values = np.array([float(v) for v in text.split(",")])
    except ValueError:
        fail(f"--home: found {text!r}, expected {joints} joint values in degrees, e.g. 0,20,-90,0,30,0")
    if len(values) != joints or not np.isfinite(values).all():
        fail(f"--home: found {len(values)} values, expected {joints} finite joint values in degrees")
    return values * DEGREE


def _devices(names: list[str] | None, known: dict[str, Device]) -> list[Device]:
    for name in names or ():
        if name not in known:
            fail(f"--device: found {name!r}, expected one of {', '.join(known)}")
    return [known[name] for name in dict.fromkeys(names or known)]


def _positive(flag: str, values: list[float], most: float) -> list[float]:
    for value in values:
        if not 0 < value <= most:
            fail(f"{flag}: found {value:g}, expected a number above 0, at most {most:g}")
    return list(dict.fromkeys(values))


@dataclass
class Errors:
    """Parameters of a chain between neighbouring axes, and whether each is a length."""

    names: list[str]
    lengths: np.ndarray
    values: np.ndarray


def chain_errors(found: kinematics.DhChain, true: kinematics.DhChain) -> Errors:
    """Errors of a found chain [m and rad]. The last row ends in whatever was measured, and where the first frame lies
    along axis 1 is a matter of choice; beside parallel axes b is, too."""
    names, lengths, values = [], [], []

    def add(name: str, length: bool, value: float) -> None:
        names.append(name)
        lengths.append(length)
        values.append(value)

    for k, (f, t) in enumerate(zip(found.joints[:-1], true.joints[:-1], strict=True)):
        add(f"a{k + 1}", True, f.a - t.a)
        if k > 0 and not kinematics.has_near_parallel_axes(t):
            add(f"b{k + 1}", True, f.b - t.b)
        turned = (f.alpha - t.alpha + np.pi) % (2 * np.pi) - np.pi
        add(f"alpha{k + 1}", False, float(np.hypot(turned, f.beta - t.beta)))
    return Errors(names, np.array(lengths), np.array(values))


def simulate(
    chain: kr5.kinematics.DhChain,
    home: np.ndarray,
    device: Device,
    arc: float,
    noise: float,
    samples: int,
    trials: int,
    seed: int,
) -> dict[str, Any]:
    """Errors of several identifications with one device, arc and noise."""
    true = kinematics.chain_from_axes(kinematics.axes_of(chain, home), home, chain.flange(home))
    offsets = np.linspace(-arc / 2, arc / 2, samples)
    turns = []
    for k in range(len(home)):
        postures = home + np.outer(offsets, np.eye(len(home))[k])
        turns.append([(float(q[k]), chain.flange(q)) for q in postures])
    errors, quality, refused = [], [], ""
    for trial in range(trials):
        random = np.random.default_rng([seed, trial])
        device.begin(random)
        found, text = _arm([device.measure(turn, noise, random) for turn in turns], home)
        if found is None:
            refused = text
            continue
        quality += [axis.quality for axis in found.axes]
        errors.append(chain_errors(found.arm, true))
    out: dict[str, Any] = {"trials": trials, "refused": trials - len(errors), "reason": refused}
    if not errors:
        return out
    of = errors[0]
    rms = np.sqrt(np.mean([e.values**2 for e in errors], axis=0))
    return {
        **out,
        "length_rms_mm": 1e3 * float(np.sqrt(np.mean(rms[of.lengths] ** 2))),
        "angle_rms_deg": float(np.sqrt(np.mean(rms[~of.lengths] ** 2))) / DEGREE,
        "quality_min": float(min(quality)),
        "quality_max": float(max(quality)),
        "parameters": {
            name: float(value * (1e3 if length else 1 / DEGREE))
            for name, length, value in zip(of.names, of.lengths, rms, strict=True)
        },
    }


def _arm(turns: list[list[calibration.JointSample]], home: np.ndarray) -> tuple[calibration.ArmAxesResult | None, str]:
    """The arm, or why there is none."""
    for k, turn in enumerate(turns):
        if len(turn) < LEAST:
            return None, f"joint {k + 1}: the target was seen in {len(turn)} postures only"
    found = calibration.identify_arm_axes(turns, home)
    return (found, "") if found.fit.usable else (None, found.fit.message)


def _keys(
    rows: list[dict[str, Any]],
    believed: kr5.cell.Cell,
    home: np.ndarray,
    samples: int | None,
    trials: int,
    map_error: float,
    seed: int,
) -> dict[str, Any]:
    figures = []
    for row in rows:
        if "length_rms_mm" in row and row["factor"] == min((r["factor"] for r in rows), key=lambda f: abs(f - 1)):
            name = f"{row['label']}, {row['noise']:g} {row['unit']}, {row['arc_deg']:g} deg"
            figures += [
                figure_row(f"{name}: lengths, RMS", row["length_rms_mm"], None, "mm"),
                figure_row(f"{name}: angles, RMS", row["angle_rms_deg"], None, "deg"),
            ]
    refused = [r for r in rows if r["refused"]]
    text = f"{sum(r['trials'] for r in rows)} identifications of the arm of {believed.name} were simulated"
    if refused:
        worst = max(refused, key=lambda r: r["refused"] / r["trials"])
        text += (
            f"; {sum(r['refused'] for r in refused)} gave no arm, most with the {worst['label']} at"
            f" {worst['noise']:g} {worst['unit']} and {worst['arc_deg']:g} deg ({worst['reason']})"
        )
    return {
        "input": {
            "cell": believed.name,
            "home_deg": np.round(np.degrees(home), 3),
            "samples": samples or "by device",
            "trials": trials,
            "map_error_mm": 1e3 * map_error,
            "seed": seed,
        },
        "verdict": {"word": "good", "text": text},
        "figures": figures,
        "result": {"rows": rows},
    }


def _show(data: dict[str, Any], out: Console) -> None:
    print_result({**data, "figures": []}, out)
    table = []
    for r in data["result"]["rows"]:
        found = "length_rms_mm" in r
        table.append(
            [
                r["label"],
                f"{r['noise']:g} {r['unit']}",
                f"{r['arc_deg']:g}",
                f"{r['quality_min']:.0f} to {r['quality_max']:.0f}" if found else "–",
                r["length_rms_mm"] if found else float("nan"),
                r["angle_rms_deg"] if found else float("nan"),
                f"{r['refused']} of {r['trials']}",
            ]
        )
    names = ["device", "noise", "arc [deg]", "s1/s3 [-]", "lengths, RMS [mm]", "angles, RMS [deg]", "refused"]
    out.print()
    out.print(make_table("Error of the identified arm", names, table))
