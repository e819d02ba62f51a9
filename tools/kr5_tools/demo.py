"""`kr5 demo`: the whole job on images whose truth is known, and how near the answer came."""

import json
import subprocess
import sys
import time
from pathlib import Path
from typing import Annotated, Any

import typer
import yaml

from . import common

app = typer.Typer()

CHECKOUT = Path(__file__).resolve().parents[2]


@app.command(epilog="Example: kr5 demo share/data/demo -o kr5-demo")
def demo(
    data: Annotated[Path | None, typer.Argument(metavar="FOLDER", help="The demo's data; by default share/data/demo of the checkout.")] = None,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Where results, pages and plots go.")] = Path("kr5-demo"),
    json_file: common.Json = None,
) -> None:
    """Calibrates the camera and its place on the arm from the demo's images, writes both pages, compares with the truth.

    Ends with exit code 1 when the truth lies outside the doubt that was claimed (99.9 %), or the bumped view is not named.
    """
    begin = time.monotonic()
    data = data or next((p for p in (CHECKOUT / "share/data/demo", Path("share/data/demo")) if p.is_dir()), Path("share/data/demo"))
    truth = _load(data / "truth.yaml")
    target = _load(data / "dataset.yaml")["target"]
    output.mkdir(parents=True, exist_ok=True)
    out = common.console(json_file)
    images = sorted(str(p) for p in (data / "images").glob("*.png"))
    steps = {"camera": ["calibrate", "camera", *images, "--board", target], "hand_eye": ["calibrate", "hand-eye", str(data)]}
    results = {}
    for name, command in steps.items():
        result, page = output / f"{name}.json", output / f"{name}.html"
        _run([*command, "-o", str(result)], out)
        _run(["report", str(result), "-o", str(page), "--png", str(output / f"{name}_plots")], out)
        results[name] = json.loads(result.read_text())
    rows = [*_camera_rows(results["camera"], truth), *_hand_eye_rows(results["hand_eye"], truth)]
    ratio = _region(results["hand_eye"], truth)
    named = [v["name"] for v in results["hand_eye"]["views"] if v.get("outlier")]
    _tell(out, rows, named, ratio, truth, output, time.monotonic() - begin)
    common.write_json({"figures": rows, "region_99_9": ratio, "named": named, "bumped": truth["bumped"], "output": str(output)}, json_file)
    if ratio > 1 or [Path(n).stem for n in named] != [Path(truth["bumped"]).stem]:
        raise typer.Exit(1)


def _load(file: Path) -> Any:
    try:
        return yaml.safe_load(file.read_text(encoding="utf-8"))
    except OSError as error:
        common.fail(f"{file}: {error.strerror}; name the folder of the demo's data: kr5 demo CHECKOUT/share/data/demo")


def _run(command: list[str], out: Any) -> None:
    shown = " ".join(command) if len(command) < 12 else f"{' '.join(command[:3])} … {' '.join(command[-4:])}"
    out.print(f"[bold]$ kr5 {shown}[/bold]", soft_wrap=True)
    with common.working("kr5 " + " ".join(command[:2]) + " …"):
        done = subprocess.run([sys.executable, "-m", "kr5_tools", *command], capture_output=True, text=True)
    if done.returncode:
        common.errors.print(done.stderr, markup=False, end="")
        raise typer.Exit(done.returncode)


def _row(name: str, value: float, std: float, true: float, unit: str) -> dict[str, Any]:
    return {"name": name, "value": value, "std": std, "truth": true, "error": value - true, "unit": unit}


def _camera_rows(data: dict[str, Any], truth: dict[str, Any]) -> list[dict[str, Any]]:
    result = data["result"]
    return [_row(name, result["camera"][name], result["covariance"][i][i] ** 0.5, truth["camera"][name], "px")
            for i, name in enumerate(("fx", "fy", "cx", "cy"))]


def _hand_eye_rows(data: dict[str, Any], truth: dict[str, Any]) -> list[dict[str, Any]]:
    found = common.pose_figures("camera on flange,", data["result"]["T_mount_camera"], data["result"]["covariance"])
    true = common.pose_figures("", truth["T_flange_camera"], data["result"]["covariance"])
    return [_row(f["name"], f["value"], f["std"], t["value"], f["unit"]) for f, t in zip(found, true)]


def _region(data: dict[str, Any], truth: dict[str, Any]) -> float:
    """Squared distance to the truth over that of the 99.9 % region: 1 on its border."""
    import kr5
    import kr5.uncertainty
    import numpy as np

    d = kr5.pose_difference(data["result"]["T_mount_camera"], truth["T_flange_camera"])
    return float(d @ np.linalg.solve(np.array(data["result"]["covariance"]), d)) / kr5.uncertainty.chi_square_quantile(0.999, 6)


def _tell(out: Any, rows: list[dict], named: list[str], ratio: float, truth: dict, folder: Path, seconds: float) -> None:
    import numpy as np

    cells = ([r["name"], common.number(r["value"], r["std"]), common.number(r["std"], r["std"]), common.number(r["truth"], r["std"]),
              common.number(r["error"], r["std"]), r["unit"]] for r in rows)
    out.print(common.table("\nEstimate against truth", ["what", "estimate", "± std", "truth", "error", "unit"], cells))
    place = [r for r in rows if r["unit"] == "mm"]
    error, claimed = (float(np.sqrt(sum(r[key] ** 2 for r in place))) for key in ("error", "std"))
    verdict = "within" if ratio <= 1 else "[red]outside[/red]"
    out.print(f"\nThe camera's place on the flange is {error:.3f} mm from the truth; {claimed:.3f} mm was claimed (one standard "
              f"deviation). The truth lies {verdict} the claimed 99.9 % region.", soft_wrap=True)
    out.print(f"The arm was bumped in {truth['bumped']}; named as contradicting the others: {', '.join(named) or 'none'}.", soft_wrap=True)
    out.print(f"Took {seconds:.1f} s. Open {folder / 'hand_eye.html'} and {folder / 'camera.html'} in a browser.", soft_wrap=True)
