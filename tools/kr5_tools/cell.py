"""`kr5 cell`: check a cell or a recording, and show it."""

from pathlib import Path
from typing import Annotated, Any

import typer

from . import common

app = typer.Typer(no_args_is_help=True)

What = Annotated[Path, typer.Argument(metavar="PATH", help="A cell file, a recording, or a folder of any of these.")]
DEG = 57.29577951308232


@app.command(epilog="Example: kr5 cell check recordings/ --json problems.json")
def check(path: What, json_file: common.Json = None) -> None:
    """Names every problem: file, line, field, the value found and what was expected. Exit code 2 when there is any."""
    import kr5.cell

    with common.working(f"reading {path}"):
        documents = kr5.cell.find_documents(path)
        problems = kr5.cell.check(path)
    common.write_json({"checked": [str(d) for d in documents], "problems": [p.to_dict() for p in problems]}, json_file)
    to = common.console(json_file)
    if not problems:
        recordings = sum(d.name == "recording.yaml" for d in documents)
        to.print(f"{path}: clean, {_count(recordings, 'recording')} and {_count(len(documents) - recordings, 'cell')} checked.",
                 soft_wrap=True)
        return
    _show_problems(problems, path, to)
    raise typer.Exit(2)


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _show_problems(problems: list[Any], path: Path, to: Any) -> None:
    from rich.markup import escape
    from rich.table import Table

    by_file: dict[str, list[Any]] = {}
    for problem in problems:
        by_file.setdefault(problem.file, []).append(problem)
    for file, found in by_file.items():
        table = Table(title=escape(file), title_justify="left", box=None, header_style="bold")
        table.add_column("line", justify="right")
        for column in ("field", "found", "expected"):
            table.add_column(column, overflow="fold")
        for p in found:
            table.add_row(str(p.line or ""), escape(p.field), escape(p.found), escape(p.expected))
        to.print(table)
    files = _count(len(by_file), "file")
    to.print(f"[red]{_count(len(problems), 'problem')} in {files}[/red] of {escape(str(path))}.", soft_wrap=True)


@app.command("import", epilog="Example: kr5 cell import panda.urdf --tip panda_hand -o panda.yaml")
def import_robot(
    robot: Annotated[Path, typer.Argument(metavar="ROBOT.urdf", help="A URDF; a xacro file goes through xacro first.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="CELL.yaml", help="Write the cell here.")],
    base: Annotated[str, typer.Option(metavar="LINK", help="Link that becomes the base B; by default the root.")] = "",
    tip: Annotated[str, typer.Option(metavar="LINK", help="Link that becomes the tool tip E; by default the end, when "
                                     "there is but one.")] = "",
    json_file: common.Json = None,
) -> None:
    """Makes a cell of a robot's URDF: the serial arm from base to tip, its poses and masses exact."""
    import kr5.cell

    found = kr5.cell.import_urdf(robot, base, tip)
    kr5.cell.save_cell(found.cell, output)
    common.write_json({"cell": found.cell, "base": found.base, "tip": found.tip, "joints": found.joints,
                       "notes": found.notes}, json_file)
    to = common.console(json_file)
    to.print(f"{output}: {_count(len(found.joints), 'joint')} from {found.base} to {found.tip}: {', '.join(found.joints)}.",
             soft_wrap=True, markup=False)
    for note in found.notes:
        to.print(f"Note: {note}.", soft_wrap=True, markup=False)


@app.command("export", epilog="Example: kr5 cell export cell.yaml -o robot.urdf")
def export_robot(
    cell: Annotated[Path, typer.Argument(metavar="CELL.yaml", help="A cell file.")],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="ROBOT.urdf", help="Write the URDF here.")],
) -> None:
    """Writes the arm of a cell, and the mass of its tool, as a URDF."""
    import kr5.cell

    kr5.cell.export_urdf(kr5.cell.load_cell(cell), output)
    common.console(None).print(f"{output}: written.", soft_wrap=True, markup=False)


@app.command(epilog="Example: kr5 cell show cell.yaml -o arm.png --q 0,-20,-120,0,30,0")
def show(
    path: Annotated[Path, typer.Argument(metavar="PATH", help="A cell file, or the folder of a recording.")],
    output: Annotated[Path | None, typer.Option("-o", "--output", metavar="ARM.png", help="Draw the arm here.")] = None,
    q: Annotated[str | None, typer.Option(metavar="Q1,Q2,...", help="Joint values to draw it at, in degrees (mm for a "
                                          "slide); by default the first posture recorded, or one near zero within the limits.")] = None,
    json_file: common.Json = None,
) -> None:
    """Prints a cell's tables and draws the arm in its frames; of a recording also what is in it."""
    import kr5.cell

    recording = kr5.cell.load_recording(path) if (path / "recording.yaml").is_file() else None
    if recording is None and path.is_dir():
        common.fail(f"{path}: is a folder without a recording.yaml; expected a cell file or the folder of a recording")
    cell = recording.cell if recording else kr5.cell.load_cell(path)
    posture = parse_posture(q, cell) if q else rest_posture(cell, recording)
    to = common.console(json_file)
    for table in cell_tables(cell) + ([recording_table(recording)] if recording else []):
        to.print(table)
        to.print()
    if output:
        draw(cell, posture, output)
        to.print(f"{output}: the arm of {cell.name or path} at q = {posture_text(posture, cell)}.", soft_wrap=True)
    data = {"cell": cell, "q": posture, "frames": frames(cell, posture)}
    if recording:
        data["experiments"] = [{**e.to_dict(), "rows": len(e.data), "columns": e.data.columns} for e in recording.experiments]
    common.write_json(data, json_file)


def is_slide(cell: Any, joint: int) -> bool:
    return str(cell.robot.dh[joint].type) == "prismatic"


def parse_posture(text: str, cell: Any) -> list[float]:
    """Joint values in rad and m from degrees and millimetres."""
    words = text.replace(",", " ").split()
    if len(words) != cell.robot.joints:
        common.fail(f"--q: found {len(words)} values, expected {cell.robot.joints}, one a joint, such as --q 0,-20,45")
    try:
        return [float(w) / (1000 if is_slide(cell, i) else DEG) for i, w in enumerate(words)]
    except ValueError:
        common.fail(f"--q: found '{text}', expected numbers in degrees (mm for a slide) with commas between")


def posture_text(q: list[float], cell: Any) -> str:
    return ", ".join(f"{1000 * v:.1f} mm" if is_slide(cell, i) else f"{round(DEG * v, 1) + 0.0:.1f}°" for i, v in enumerate(q))


def rest_posture(cell: Any, recording: Any) -> list[float]:
    """The first posture of a recording; else zero, or the nearest to it that the limits allow."""
    n = cell.robot.joints
    for experiment in recording.experiments if recording else ():
        if "q1" in experiment.data:
            return [float(experiment[f"q{i + 1}"][0]) for i in range(n)]
    limits = cell.robot.limits
    if limits is None:
        return [0.0] * n
    inside = [min(max(0.0, low), high) for low, high in zip(limits.lower, limits.upper)]
    middle = [(low + high) / 2 for low, high in zip(limits.lower, limits.upper)]
    return [float(z if z == 0.0 else m) for z, m in zip(inside, middle)]


def frames(cell: Any, q: list[float]) -> list[dict[str, Any]]:
    """Every frame of the cell in the base, as in result files."""
    links = {f"link {i + 1}": T for i, T in enumerate(cell.link_poses(q))}
    return [{"name": name, "parent": None, "T": T} for name, T in {**links, **fixed_frames(cell), **carried_frames(cell, q)}.items()]


def target_frames(cell: Any, key: str) -> dict[str, Any]:
    """Poses of the board and the targets that have `key`, T_B_W or T_F_W; numbered when there are several."""
    boards = [("board", cell.board)] if cell.board else []
    boards += [(t.name or str(t.kind), t) for t in cell.targets]
    letters = ["W"] if len(boards) == 1 else [f"W{i + 1}" for i in range(len(boards))]
    poses = {f"{letter} {name}": getattr(board, key, None) for letter, (name, board) in zip(letters, boards)}
    return {name: T for name, T in poses.items() if T is not None}


def fixed_frames(cell: Any) -> dict[str, Any]:
    """Pose in the base of each frame that stands still."""
    out = target_frames(cell, "T_B_W")
    if cell.camera and cell.camera.T_B_C is not None:
        out["C camera"] = cell.camera.T_B_C
    if cell.tube:
        out["T tube"] = cell.tube.T_B_T
    return out


def carried_frames(cell: Any, q: list[float]) -> dict[str, Any]:
    """Pose in the base of each frame that the flange carries."""
    T_B_F = cell.flange(q)
    on_flange = {"S force sensor": cell.tool and cell.tool.T_F_S, "E tool tip": cell.tool and cell.tool.T_F_E,
                 "C camera": cell.T_F_C(), "L scanner": cell.T_F_L(), **target_frames(cell, "T_F_W")}
    return {"F flange": T_B_F, **{name: T_B_F @ T for name, T in on_flange.items() if T is not None}}


def draw(cell: Any, q: list[float], output: Path) -> None:
    from .cell_plot import arm_figure

    if output.suffix.lower() not in (".png", ".svg", ".pdf"):
        common.fail(f"{output}: found the ending '{output.suffix}', expected .png, .svg or .pdf")
    figure = arm_figure(cell, q, fixed_frames(cell), carried_frames(cell, q), f"{cell.name}, q = {posture_text(q, cell)}")
    try:
        figure.savefig(output, dpi=160)
    except OSError as error:
        common.fail(f"{output}: cannot be written: {error.strerror}; is its folder there?")


def cell_tables(cell: Any) -> list[Any]:
    """Everything a cell holds, with units."""
    return [t for t in (_dh(cell), _links(cell), _drives(cell), _servo(cell), _poses(cell), _sensors(cell), _noise(cell), _effects(cell)) if t]


def _dh(cell: Any) -> Any:
    limits = cell.robot.limits
    rows = []
    for i, row in enumerate(cell.robot.dh):
        slide = is_slide(cell, i)
        scale, unit = (1000, "mm") if slide else (DEG, "°")
        bounds = f"{scale * limits.lower[i]:.0f} to {scale * limits.upper[i]:.0f} {unit}" if limits else "–"
        speed = f"{scale * limits.velocity[i]:.0f} {unit}/s" if limits and len(limits.velocity) else "–"
        rows.append([f"{i + 1} {row.type}", 1000 * row.b, DEG * row.theta_offset, 1000 * row.a, DEG * row.alpha, DEG * row.beta, bounds, speed])
    title = f"{cell.name}: joints, Rz(q + θ) Tz(b) Tx(a) Rx(α) Ry(β)"
    table = common.table(title, ["joint", "b [mm]", "θ [°]", "a [mm]", "α [°]", "β [°]", "limits", "speed"], rows)
    for column in table.columns[-2:]:
        column.no_wrap = True
    return table


def _links(cell: Any) -> Any:
    if not cell.robot.links and not (cell.tool and cell.tool.mass):
        return None
    bodies = [(f"link {i + 1}", link) for i, link in enumerate(cell.robot.links)] + ([("tool, in S", cell.tool)] if cell.tool else [])
    rows = [[name, body.mass, *(1000 * float(x) for x in body.com), *(1000 * float(x) for x in body.inertia)] for name, body in bodies]
    moments = (f"I{axes}" for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))
    return common.table("Masses, with the moments of inertia about the com in g m²",
                        ["body", "m [kg]", "x [mm]", "y [mm]", "z [mm]", *moments], rows)


def _drives(cell: Any) -> Any:
    d = cell.drives
    if not d:
        return None
    n = len(d.rotor_inertia)
    rows = [[f"{i + 1}", *(float(d.structure[i][j]) for j in range(n)), 1e6 * float(d.rotor_inertia[i]), float(d.torque_constant[i]),
             float(d.friction.coulomb[i]), float(d.friction.viscous[i])] for i in range(n)]
    return common.table("Drives: motor angle = S q; rotor in kg mm², kt in N m/A, friction on the joint side in N m and N m s/rad",
                        ["motor", *(f"S·{j + 1}" for j in range(n)), "rotor", "kt", "coulomb", "viscous"], rows)


def _servo(cell: Any) -> Any:
    if not cell.servo:
        return None
    loops = [("all joints" if len(cell.servo.joint) == 1 else f"joint {i + 1}", s) for i, s in enumerate(cell.servo.joint)]
    loops += [("path correction", cell.servo.tool)] if cell.servo.tool else []
    rows = [[name, s.natural_frequency, s.damping_ratio, 1000 * s.delay] for name, s in loops]
    return common.table(f"Servo, cycle {1000 * cell.servo.cycle:g} ms", ["loop", "ωn [rad/s]", "damping [-]", "delay [ms]"], rows)


def _poses(cell: Any) -> Any:
    import kr5

    in_base = {name: T for name, T in fixed_frames(cell).items()}
    at_flange = {"E tool tip": cell.tool and cell.tool.T_F_E, "S force sensor": cell.tool and cell.tool.T_F_S,
                 "C camera": cell.T_F_C(), "L scanner": cell.T_F_L(), **target_frames(cell, "T_F_W")}
    rows = []
    for parent, poses in (("F", at_flange), ("B", in_base)):
        for name, T in poses.items():
            if T is not None:
                v = [1000 * x for x in kr5.to_xyzrpy(T)[:3]] + [DEG * x for x in kr5.to_xyzrpy(T)[3:]]
                rows.append([f"{name} in {parent}", *(f"{x + 0.0:.3f}".replace("-0.000", "0.000") for x in v)])
    return common.table("Frames", ["pose", "x [mm]", "y [mm]", "z [mm]", "roll [°]", "pitch [°]", "yaw [°]"], rows) if rows else None


def _sensors(cell: Any) -> Any:
    rows = []
    if c := cell.camera:
        rows += [["camera", f"{c.width} x {c.height} px, fx {c.fx:g} fy {c.fy:g} cx {c.cx:g} cy {c.cy:g} px"],
                 ["lens", f"{c.distortion.model}: {', '.join(f'{v:g}' for v in c.distortion.values)}"]]
    if b := cell.board:
        rows.append(["board", f"{b.rows} x {b.cols} markers {b.family} of {1000 * b.marker:g} mm, {1000 * b.gap:g} mm apart"])
    rows += [["target", f"{t.name}: {t.kind}" + (f" {t.rows} x {t.cols}" if t.rows else f" of {len(t.map)}")] for t in cell.targets]
    if (laser := cell.laser) and laser.target:
        rows.append(["scanner target", f"sphere of radius {1000 * laser.target.radius:g} mm on the plane z = {1000 * laser.target.plane:g} mm"])
    if c := cell.contact:
        rows.append(["contact", f"{c.stiffness / 1000:g} N/mm, damping {c.damping:g} N s/m, friction {c.friction:g}"])
    if p := cell.peg:
        rows.append(["peg", f"radius {1000 * p.radius:g} mm, length {1000 * p.length:g} mm, chamfer {1000 * p.chamfer:g} mm"])
    if t := cell.tube:
        rows.append(["tube", f"radii {1000 * t.inner_radius:g} and {1000 * t.outer_radius:g} mm, depth {1000 * t.depth:g} mm, chamfer {1000 * t.chamfer:g} mm"])
    if not rows:
        return None
    table = common.table("Sensors and task", ["part", "what it is"], rows)
    table.columns[1].justify = "left"
    return table


def _noise(cell: Any) -> Any:
    import re

    rows = []
    for field in type(cell.noise).fields():
        value = getattr(cell.noise, field["name"])
        unit = re.search(r"\[([^]]*)\]", field["doc"])[1]
        text = re.sub(r" \[[^]]*\]|\.$", "", field["doc"])
        if value:
            rows.append([field["name"], value, unit, text])
    if not rows:
        return None
    table = common.table("Noise, one standard deviation", ["noise", "sigma", "unit", "of what"], rows)
    for column in table.columns[2:]:
        column.justify = "left"
    return table


def _effects(cell: Any) -> Any:
    import kr5.cell

    rows = []
    for effect, targets in cell.effects.to_dict().items():
        row = kr5.cell.find_effect(effect)
        for target, parameters in targets.items():
            units = {p.name: p.unit for p in row.parameters}
            text = ", ".join(f"{name} {_short(value)} {units[name]}" for name, value in parameters.items())
            rows.append([effect, target, text, row.description])
    if not rows:
        return None
    table = common.table("Effects that are on", ["effect", "on", "parameters", "what it is"], rows)
    for column in table.columns[1:]:
        column.justify = "left"
    return table


def _short(value: Any) -> str:
    if isinstance(value, list):
        return "[" + ", ".join(_short(v) for v in value) + "]"
    return f"{value:.5g}"


def recording_table(recording: Any) -> Any:
    """What a recording holds."""
    rows = []
    for e in recording.experiments:
        t = e["t"]
        measured = [c.name for c in recording_columns(recording, e) if str(c.role) == "predicted" and c.name in e.data]
        rows.append([e.name, str(e.kind), str(e.split), len(e.data), f"{t[0]:g} to {t[-1]:g}", " ".join(measured)])
    table = common.table(f"Recording {recording.folder}", ["experiment", "kind", "split", "rows", "t [s]", "measured"], rows)
    for column in (1, 2, 5):
        table.columns[column].justify = "left"
    return table


def recording_columns(recording: Any, experiment: Any) -> list[Any]:
    import kr5.cell

    return kr5.cell.columns(experiment.kind, recording.cell.robot.joints)
