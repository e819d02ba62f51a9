"""`kr5 bin empty`: a simulated bin emptied pick by pick, with every decision."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, cast

import numpy as np
import typer
from kr5 import picking, sim
from kr5.files.result_types import ResultData
from kr5.files.results import write_result
from kr5.files.writing import check_page, check_writable, publish, write_json, write_text

from kr5_tools.cli.arguments import JsonOption
from kr5_tools.cli.tables import figure_row, print_result
from kr5_tools.cli.terminal import console, open_page, share_bar, spinner
from kr5_tools.picking.emptying import BinRun, Emptying, EmptyingOptions
from kr5_tools.picking.heights import height_range
from kr5_tools.picking.simulated_bin import bin_shape

app = typer.Typer()
PAGE = Path("bin.html")
SCAN_TIME, PICK_TIME = 7.0, 16.0  # [s] of the book's cell (Hayat et al. 2022, section 6.2)


@app.command(epilog="Example:  kr5 bin empty --pellets 60 --seed 3 --view")
def empty(
    pellets: Annotated[int, typer.Option(help="Number of cylinders in each bin.")] = 125,
    radius: Annotated[float, typer.Option(help=r"Radius of the cylinders \[m].")] = 0.008,
    height: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help=r"Range of their heights, or one height \[m].")
    ] = "0.014:0.017",
    bins: Annotated[int, typer.Option(min=1, help="Number of bins, with consecutive seeds.")] = 1,
    seed: Annotated[int, typer.Option(help="Random seed of the first bin.")] = 1,
    pitch: Annotated[float, typer.Option(help=r"Distance of two profiles of the scanner \[m].")] = 0.0005,
    noise: Annotated[float, typer.Option(help=r"Standard deviation of a range \[m].")] = 5e-5,
    pose_error: Annotated[
        float, typer.Option(help=r"Standard deviation of the cell's calibration, in each direction \[m].")
    ] = 3e-4,
    bin_file: Annotated[
        Path | None, typer.Option("--bin", metavar="BIN.yaml", help="Pose and inner size of the bin.")
    ] = None,
    refine: Annotated[
        bool,
        typer.Option(
            "--image/--no-image", help="Refine by the image the cylinders whose pose the cloud determines poorly."
        ),
    ] = True,
    view: Annotated[
        bool,
        typer.Option(
            "--view", help=f"Write the page ({PAGE} unless -o names another) and open it where there is a screen."
        ),
    ] = False,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="PAGE.html", help="Page with a picture of every decision."),
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Empties simulated bins: scan, find, plan, pick, look for what moved, scan again or shake when that pays.

    A pick succeeds when the cup meets a surface squarely and holds it; pulling a cylinder out moves what it touches.
    The controller sees clouds and images only, and its cell has errors. Exit code: 0 when every bin was emptied, 1
    when not, 2 for bad input.
    """
    output = output or (PAGE if view else None)
    check_writable(output, json_file, inputs=[bin_file])
    check_page(output)
    low, high = height_range(height)
    options = picking.PelletOptions(radius=radius, min_height=low, max_height=high)
    options.validate()
    runs = []
    for number in range(bins):
        with share_bar(f"Bin {number + 1} of {bins}") as progress:
            runs.append(
                empty_one(
                    seed + number, pellets, options, bin_shape(bin_file), pitch, noise, pose_error, progress, refine
                )
            )
    keys = result_keys(runs)
    print_result(keys, console(json_file))
    data = write_result(None, "kr5-bin-run/1", **keys)
    if output:
        from kr5_tools.picking.run_page import run_page

        with spinner("Drawing"):
            write_text(run_page(cast(ResultData, data), runs[0], bin_shape(bin_file)), output)
    write_json(data, json_file)
    if view:
        publish()
        open_page(output)
    if keys["verdict"]["word"] != "good":
        raise typer.Exit(1)


def empty_one(
    seed: int,
    pellets: int,
    options: picking.PelletOptions,
    shape: sim.BinShape,
    pitch: float,
    noise: float,
    pose_error: float,
    progress: Callable[[float], None] | None = None,
    refine: bool = True,
) -> Emptying:
    """One bin, poured and emptied."""
    pour = sim.PourOptions(
        pellets=pellets, radius=options.radius, height_min=options.min_height, height_max=options.max_height, seed=seed
    )
    pile = sim.pour_pellets(shape, pour).scene
    rim = float(shape.size[2])
    scanner = sim.BinScannerOptions(pitch=pitch, noise=noise)
    scanner.width = max(scanner.width, 1.2 * float(shape.size[0]))
    scanner.stand_off = max(scanner.stand_off, rim + 0.2)
    scanner.far = max(scanner.far, scanner.stand_off + 0.1)
    cell = EmptyingOptions(pose_error=pose_error, refine=refine)
    cell.camera_height = max(cell.camera_height, rim + 1.2 * float(max(shape.size[:2])))
    return BinRun(seed, pile, options, grasp_options(options.radius), scanner, cell).run(progress)


def grasp_options(radius: float) -> Any:
    """A suction cup of half the radius of the cylinders, on a slim rod."""
    out = picking.GraspOptions(cup_radius=radius / 2)
    out.gripper = [picking.GripperPart(radius=0.6 * radius, start=0.001, end=0.15)]
    return out


def result_keys(runs: list[Emptying]) -> dict[str, Any]:
    """Figures over all bins, and each bin."""
    import kr5.uncertainty

    attempts, picked = sum(r.attempts for r in runs), sum(r.picked for r in runs)
    scans, left, touches = sum(r.scans for r in runs), sum(r.left for r in runs), sum(r.wall_touches for r in runs)
    rate = kr5.uncertainty.binomial_interval(picked, max(attempts, 1))
    time = sum(r.vision_time for r in runs) / max(1, sum(r.found for r in runs))
    cycle = (SCAN_TIME * scans + PICK_TIME * attempts) / max(1, picked)
    causes = sorted({c for r in runs for c in r.failures})
    figures = [
        figure_row("picks that succeeded", 100 * picked / max(1, attempts), None, "%"),
        figure_row("lower bound of that rate (95 %)", 100 * rate.low, None, "%"),
        *(figure_row(f"picks that failed: {c}", sum(r.failures.get(c, 0) for r in runs), None, "-") for c in causes),
        figure_row("scans a bin", scans / len(runs), None, "-"),
        figure_row("cylinders refined by the image, a bin", sum(r.refined for r in runs) / len(runs), None, "-"),
        figure_row("shakes a bin", sum(r.shakes for r in runs) / len(runs), None, "-"),
        figure_row("cylinders left", left, None, "-"),
        figure_row("wall touches", touches, None, "-"),
        figure_row("minimum clearance of the gripper", 1e3 * min(r.min_clearance for r in runs), None, "mm"),
        figure_row("time to find a cylinder and plan its pick", 1e3 * time, None, "ms"),
        figure_row("time for each cylinder with the book's scan and pick", cycle, None, "s"),
    ]
    emptied = sum(r.left == 0 for r in runs)
    text = f"{emptied} of {len(runs)} bins emptied, {picked} of {attempts} picks succeeded, {touches} wall touches."
    return {
        "verdict": {"word": "good" if emptied == len(runs) and not touches else "doubtful", "text": text},
        "figures": figures,
        "bins": [
            {
                "seed": r.seed,
                "pellets": r.pellets,
                "picked": r.picked,
                "attempts": r.attempts,
                "failures": r.failures,
                "scans": r.scans,
                "found": r.found,
                "refined": r.refined,
                "scan_seconds": r.scan_seconds,
                "vision_seconds": r.vision_seconds,
                "trials": [
                    {"cycle": s.cycle, "success": bool(s.success), "text": s.text}
                    for s in r.steps
                    if s.action == "pick"
                ],
                "shakes": r.shakes,
                "left": r.left,
                "wall_touches": r.wall_touches,
                "min_clearance": r.min_clearance if np.isfinite(r.min_clearance) else None,
                "ended": r.ended,
            }
            for r in runs
        ],
    }
