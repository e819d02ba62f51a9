"""`kr5 calibrate laser-study`: error of a scanner on the arm against stand-off and scanning speed."""

from pathlib import Path
from typing import Annotated, Any

import kr5
import typer
from kr5 import calibration, cell
from kr5.files.paths import find_shipped_cell
from kr5.files.results import write_result
from kr5.files.writing import check_writable, write_json

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.tables import make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, track
from kr5_tools.cli.value_list import parse_values

app = typer.Typer()
STAND_OFFS = (5e-3, 5.0)  # of any scanner [m]
MOST_SPEED = 5.0  # of any arm [m/s]
USUAL = calibration.ScanErrorOptions()
SLOW = 0.01  # speed at which stand-offs are compared [m/s]


@app.command(
    epilog="Example:  kr5 calibrate laser-study --stand-offs 0.15:0.23:0.01 --speeds 0.01,0.05,0.2 -o study.json"
)
def laser_study(
    cell_file: Annotated[
        Path | None, typer.Option("--cell", help="Cell with a scanner and its target; by default the shipped one.")
    ] = None,
    stand_offs: Annotated[
        str, typer.Option(metavar="LIST|FROM:TO:STEP", help="Ranges of the top of the sphere \\[m].")
    ] = "0.15:0.23:0.005",
    speeds: Annotated[
        str, typer.Option(metavar="LIST|FROM:TO:STEP", help="Speeds of the scanner along its own Y \\[m/s].")
    ] = "0.01,0.03,0.1,0.2,0.3",
    bias: Annotated[
        float, typer.Option(help="Range error at the cell's bias_distance from the best stand-off \\[m].")
    ] = USUAL.bias,
    delay: Annotated[float, typer.Option(help="Time by which the stamps of profiles are late \\[s].")] = USUAL.delay,
    passes: Annotated[int, typer.Option(min=2, help="Passes over the sphere, each.")] = USUAL.passes,
    seed: Annotated[int, typer.Option(min=0, help="Random seed of the noise.")] = USUAL.seed,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Error of points in the base against stand-off and scanning speed, on simulated scans of a sphere on a plane, with
    profiles as stamped and with their delay taken out by interpolation of the poses.
    """
    check_writable(output, json_file, inputs=[cell_file])
    file = cell_file or find_shipped_cell()
    if file is None:
        fail("--cell: is missing")
    scanned = cell.load_cell(file)
    if scanned.laser is None:
        fail("the cell has no laser with a mount and a target")
    options = calibration.ScanErrorOptions(bias=bias, delay=delay, passes=passes, seed=seed)
    at = parse_values("--stand-offs", stand_offs)
    if found := next((v for v in at if not STAND_OFFS[0] <= v <= STAND_OFFS[1]), None):
        fail(f"--stand-offs: found {found:g}, expected {STAND_OFFS[0]:g} to {STAND_OFFS[1]:g}; they are in metres")
    rates = parse_values("--speeds", speeds)
    if max(rates) > MOST_SPEED:
        fail(f"--speeds: found {max(rates):g}, expected at most {MOST_SPEED:g}; they are in metres per second")
    best = scanned.laser.stand_off
    by_stand_off = [_measure(scanned, d, SLOW, options) for d in track(at, "Simulating scans by stand-off")]
    by_speed = [_measure(scanned, best, v, options) for v in track(rates, "Simulating scans by speed")]
    given = {"cell": str(file), "bias": bias, "delay": delay, "passes": passes, "seed": seed}
    study = {"stand_off": by_stand_off, "speed": by_speed, "best_stand_off": best}
    data = write_result(None, "kr5-laser-study/1", input=given, verdict=_verdict(by_stand_off, by_speed), study=study)
    _show(data, console(json_file))
    write_json(data, output)
    write_json(data, json_file)


def _measure(of: cell.Cell, stand_off: float, speed: float, options: calibration.ScanErrorOptions) -> dict[str, float]:
    """Errors of the clouds of some passes [m]."""
    found = calibration.simulate_scan_error(of, stand_off, speed, options)
    if not found.fit.usable:
        raise kr5.InvalidArgument(f"at a stand-off of {1e3 * stand_off:.0f} mm, {found.fit.message}")
    out = {"stand_off": stand_off, "speed": speed}
    for name, error in (("as_stamped", found.as_stamped), ("synchronised", found.synchronised)):
        out |= {f"rms_{name}": error.rms, f"centre_{name}": error.centre}
    return out


def _verdict(by_stand_off: list[dict[str, float]], by_speed: list[dict[str, float]]) -> dict[str, str]:
    good = [row["stand_off"] for row in by_stand_off if row["centre_as_stamped"] < 1e-3]
    least = min(by_stand_off, key=lambda row: row["rms_as_stamped"])
    fastest = max(by_speed, key=lambda row: row["speed"])
    text = f"the error is least at a stand-off of {1e3 * least['stand_off']:.0f} mm"
    if good:
        text += f" and below 1 mm from {1e3 * min(good):.0f} to {1e3 * max(good):.0f} mm"
    text += (
        f"; at {1e3 * fastest['speed']:.0f} mm/s a sphere is misplaced by {1e3 * fastest['centre_as_stamped']:.3f} mm,"
        f" with the poses at the times of the profiles by {1e3 * fastest['centre_synchronised']:.3f} mm"
    )
    return {"word": "good", "text": text}


def _show(data: dict[str, Any], out: Console) -> None:
    print_result(data, out)
    heads = ["points, as stamped [mm]", "synchronised [mm]", "sphere, as stamped [mm]", "synchronised [mm]"]
    keys = ("rms_as_stamped", "rms_synchronised", "centre_as_stamped", "centre_synchronised")
    for key, title, head in (
        ("stand_off", f"Error against stand-off, at {1e3 * SLOW:.0f} mm/s", "stand-off [mm]"),
        ("speed", "Error against speed, at the best stand-off", "speed [mm/s]"),
    ):
        rows = [[f"{1e3 * row[key]:.0f}", *(f"{1e3 * row[k]:.4f}" for k in keys)] for row in data["study"][key]]
        out.print()
        out.print(make_table(title, [head, *heads], rows))
