"""`kr5 calibrate laser-study`: error of a scanner on the arm against stand-off and scanning speed."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import kr5
import numpy as np
import typer
from kr5 import calibration, cell, kinematics, predict
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
LINES, POINTS, WIDTH = 41, 181, 0.09  # of one pass; a profile is WIDTH wide [m]
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
    ] = 2e-4,
    lag: Annotated[float, typer.Option(help="Time by which profiles are late \\[s].")] = 6e-3,
    passes: Annotated[int, typer.Option(min=2, help="Passes over the sphere, each.")] = 12,
    seed: Annotated[int, typer.Option(min=0, help="Random seed of the noise.")] = 1,
    output: ResultOption = None,
    json_file: JsonOption = None,
) -> None:
    """Error of points in the base against stand-off and scanning speed, on simulated scans of a sphere on a plane, with
    profiles as stamped and with their lag taken out by interpolation of the poses.
    """
    check_writable(output, json_file, inputs=[cell_file])
    file = cell_file or find_shipped_cell()
    if file is None:
        fail("--cell: is missing")
    study = Study(cell.load_cell(file), bias, lag, passes, seed)
    at = parse_values("--stand-offs", stand_offs)
    if found := next((v for v in at if not STAND_OFFS[0] <= v <= STAND_OFFS[1]), None):
        fail(f"--stand-offs: found {found:g}, expected {STAND_OFFS[0]:g} to {STAND_OFFS[1]:g}; they are in metres")
    rates = parse_values("--speeds", speeds)
    if max(rates) > MOST_SPEED:
        fail(f"--speeds: found {max(rates):g}, expected at most {MOST_SPEED:g}; they are in metres per second")
    by_stand_off = [study.measure(d, SLOW) for d in track(at, "Simulating scans by stand-off")]
    by_speed = [study.measure(study.best, v) for v in track(rates, "Simulating scans by speed")]
    data = write_result(None, "kr5-laser-study/1", **_keys(study, by_stand_off, by_speed, str(file)))
    _show(data, console(json_file))
    write_json(data, output)
    write_json(data, json_file)


@dataclass
class Study:
    """Scans of the sphere of a cell with a biased and late scanner."""

    cell: Any
    bias: float
    lag: float
    passes: int
    seed: int

    def __post_init__(self) -> None:
        laser = self.cell.laser
        if laser is None or laser.target is None or self.cell.T_flange_scanner() is None:
            fail("the cell has no laser with a mount and a target")
        if self.cell.robot.limits is None:
            fail("the cell states no robot.limits, within which postures are chosen")
        self.best = float(laser.stand_off)
        self.centre, self.radius = np.asarray(laser.target.sphere), float(laser.target.radius)
        self.scanner = np.asarray(self.cell.T_flange_scanner())
        self.chain = self.cell.nominal_chain()
        self.real = cell.parse_cell(self.cell.to_yaml())
        for parameter, value in (("bias", self.bias), ("lag", self.lag)):
            effect, target = _scanner_effect(self.real, parameter)
            self.real.set_effect(effect, target, parameter, value)
        self.simulator = predict.FastSimulator()

    def measure(self, stand_off: float, speed: float) -> dict[str, float]:
        """Errors of the cloud of some passes [m]."""
        random = np.random.default_rng([self.seed, round(1e6 * stand_off), round(1e6 * speed)])
        rows = [self._one_pass(stand_off, speed, 2 * np.pi * k / self.passes, random) for k in range(self.passes)]
        stamped, synchronised = np.array(rows).transpose(1, 0, 2)
        out = {"stand_off": stand_off, "speed": speed}
        for name, values in (("as_stamped", stamped), ("synchronised", synchronised)):
            out[f"rms_{name}"] = float(np.sqrt((values[:, 0] ** 2).mean()))
            out[f"centre_{name}"] = float(np.sqrt((values[:, 1] ** 2).mean()))
        return out

    def _one_pass(
        self, stand_off: float, speed: float, azimuth: float, random: np.random.Generator
    ) -> list[tuple[float, float]]:
        """RMS distance of points from the sphere and error of its centre, as stamped and synchronised."""
        t, q, poses = self._path(stand_off, speed, azimuth)
        x = np.linspace(-WIDTH / 2, WIDTH / 2, POINTS)
        lines = range(1, LINES + 1)  # the first pose lies before the first profile, for the lag
        joints = [f"q{k + 1}" for k in range(q.shape[1])]
        rows = np.vstack([np.column_stack([np.tile([i, t[i], speed, *q[i]], (POINTS, 1)), x]) for i in lines])
        scan = cell.Experiment(name="scan", kind="scan", file="scan.csv", split="fit")
        scan.data = kr5.io.Table(["line", "t", "speed", *joints, "x"], rows)
        shown = self.simulator.predict(self.real, scan)
        z = np.asarray(shown["z"]).reshape(LINES, POINTS)
        z = z + random.normal(0.0, self.cell.noise.laser, z.shape)
        sphere = np.asarray(shown["sphere"]).reshape(LINES, POINTS) > 0
        profiles = [calibration.TimedProfile(t=t[i], profile=calibration.LineProfile(x=x, z=z[i - 1])) for i in lines]
        out = []
        for delay in (0.0, self.lag):
            options = calibration.ProfileCloudOptions(delay=delay, max_gap=1e9)
            cloud = calibration.timed_profiles_to_cloud(profiles, list(t), poses, self.scanner, options)
            on_sphere = sphere[np.isfinite(z)]
            out.append(self._errors(np.asarray(cloud.points).T, on_sphere))
        return out

    def _path(self, stand_off: float, speed: float, azimuth: float) -> tuple[np.ndarray, np.ndarray, list[Any]]:
        """Times, joint values and flange poses of a straight pass along Y of the scanner, looking down."""
        R = kr5.to_pose([0, 0, 0, 0, 0, azimuth])[:3, :3] @ np.diag([1.0, -1.0, -1.0])
        middle = self.centre - R[:, 2] * (stand_off + self.radius)
        along = np.linspace(-1.1 * self.radius, 1.1 * self.radius, LINES)
        step = along[1] - along[0]
        ahead = max(1.0, np.ceil(speed * abs(self.lag) / step))  # poses before and after, for the lag
        along = np.concatenate([[along[0] - ahead * step], along, [along[-1] + ahead * step]])
        limits = self.cell.robot.limits
        options = kinematics.InverseOptions(lower=limits.lower, upper=limits.upper)
        q, poses = [], []
        for y in along:
            T = np.eye(4)
            T[:3, :3], T[:3, 3] = R, middle + R[:, 1] * y
            found = kinematics.inverse_kinematics(self.chain, T @ np.linalg.inv(self.scanner), options)
            usable = next((np.asarray(p.q) for p in found.postures if p.usable), None)
            if usable is None:
                fail(f"the arm does not reach a pass at a stand-off of {1e3 * stand_off:.0f} mm; move the target")
            options.near = usable
            q.append(usable)
            poses.append(self.chain.flange(usable))
        return (along - along[0]) / speed, np.array(q), poses

    def _errors(self, points: np.ndarray, on_sphere: np.ndarray) -> tuple[float, float]:
        ball = points[on_sphere]
        off = np.linalg.norm(ball - self.centre, axis=1) - self.radius
        centre = self.centre.copy()
        for _ in range(20):  # Gauss-Newton for the centre of a sphere of known radius
            away = ball - centre
            distance = np.linalg.norm(away, axis=1)
            J = -away / distance[:, None]
            centre = centre + np.linalg.lstsq(J, self.radius - distance, rcond=None)[0]
        return float(np.sqrt((off**2).mean())), float(np.linalg.norm(centre - self.centre))


def _scanner_effect(model: cell.Cell, parameter: str) -> tuple[str, str]:
    """Effect and target of the scanner with the given parameter."""
    for row in cell.effect_catalogue():
        targets = model.effect_targets(row.id)
        if targets == ["laser"] and [p.name for p in row.parameters] == [parameter]:
            return row.id, targets[0]
    raise RuntimeError(f"no effect of the scanner has the parameter {parameter} alone")


def _keys(
    study: Study, by_stand_off: list[dict[str, Any]], by_speed: list[dict[str, Any]], file: str
) -> dict[str, Any]:
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
    return {
        "input": {"cell": file, "bias": study.bias, "lag": study.lag, "passes": study.passes, "seed": study.seed},
        "verdict": {"word": "good", "text": text},
        "study": {"stand_off": by_stand_off, "speed": by_speed, "best_stand_off": study.best},
    }


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
