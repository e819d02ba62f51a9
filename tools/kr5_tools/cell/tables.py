"""The tables of `kr5 cell show`: all that a cell or a recording holds, with units."""

from typing import Any

import kr5.cell

from kr5_tools.cell.frames import DEG, fixed_frames, flange_frames, is_slide, joint_unit
from kr5_tools.cli import tables
from kr5_tools.cli.numbers import format_values


def cell_tables(cell: kr5.cell.Cell) -> list[Any]:
    """Everything a cell holds, with units."""
    return [
        t
        for t in (
            _dh(cell),
            _links(cell),
            _drives(cell),
            _servo(cell),
            _poses(cell),
            _sensors(cell),
            _noise(cell),
            _effects(cell),
        )
        if t
    ]


def _tidy(value: float, decimals: int = 4) -> float:
    """Without the digits that rounding leaves, such as -3e-13, and without a minus before 0."""
    return round(value, decimals) + 0.0


def _dh(cell: kr5.cell.Cell) -> Any:
    limits = cell.robot.limits
    rows = []
    for i, row in enumerate(cell.robot.dh):
        slide = is_slide(cell, i)
        scale, unit = (1000, "mm") if slide else (DEG, "°")
        bounds = f"{scale * limits.lower[i]:.0f} to {scale * limits.upper[i]:.0f} {unit}" if limits else "–"
        speed = f"{scale * limits.velocity[i]:.0f} {unit}/s" if limits and len(limits.velocity) else "–"
        rows.append(
            [
                f"{i + 1} {row.type}",
                _tidy(1000 * row.b),
                _tidy(DEG * row.theta_offset),
                _tidy(1000 * row.a),
                _tidy(DEG * row.alpha),
                _tidy(DEG * row.beta),
                bounds,
                speed,
            ]
        )
    title = f"{cell.name}: joints, Rz(q + θ) Tz(b) Tx(a) Rx(α) Ry(β)"
    return tables.make_table(title, ["joint", "b [mm]", "θ [°]", "a [mm]", "α [°]", "β [°]", "limits", "speed"], rows)


def _links(cell: kr5.cell.Cell) -> Any:
    if not cell.robot.links and not (cell.tool and cell.tool.mass):
        return None
    bodies = [(f"link {i + 1}", link) for i, link in enumerate(cell.robot.links)] + (
        [("tool, in S", cell.tool)] if cell.tool else []
    )
    rows = [[name, body.mass, *(_tidy(1000 * float(x)) for x in (*body.com, *body.inertia))] for name, body in bodies]
    moments = (f"I{axes} [g m²]" for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))
    return tables.make_table(
        "Masses and centres of mass, with the moments of inertia about them",
        ["body", "mass [kg]", "x [mm]", "y [mm]", "z [mm]", *moments],
        rows,
    )


def _drives(cell: kr5.cell.Cell) -> Any:
    d = cell.drives
    if not d:
        return None
    n = len(d.rotor_inertia)
    rows = [
        [
            f"{i + 1}",
            *(float(d.structure[i][j]) for j in range(n)),
            1e6 * float(d.rotor_inertia[i]),
            float(d.torque_constant[i]),
            float(d.friction.coulomb[i]),
            float(d.friction.viscous[i]),
        ]
        for i in range(n)
    ]
    return tables.make_table(
        "Drives: motor angle = S q; friction on the joint side",
        [
            "motor",
            *(f"S·{j + 1} [-]" for j in range(n)),
            "rotor [kg mm²]",
            "torque constant [N m/A]",
            "Coulomb [N m]",
            "viscous [N m s/rad]",
        ],
        rows,
    )


def _servo(cell: kr5.cell.Cell) -> Any:
    if not cell.servo:
        return None
    loops = [
        ("all joints" if len(cell.servo.joint) == 1 else f"joint {i + 1}", s) for i, s in enumerate(cell.servo.joint)
    ]
    loops += [("path correction", cell.servo.tool)] if cell.servo.tool else []
    rows = [[name, s.natural_frequency, s.damping_ratio, 1000 * s.delay] for name, s in loops]
    return tables.make_table(
        f"Servo, cycle {1000 * cell.servo.cycle:g} ms", ["loop", "ωn [rad/s]", "damping [-]", "delay [ms]"], rows
    )


def _poses(cell: kr5.cell.Cell) -> Any:
    import kr5

    rows = []
    for parent, poses in (("F", flange_frames(cell)), ("B", fixed_frames(cell))):
        for name, T in poses.items():
            v = [1000 * x for x in kr5.to_xyzrpy(T)[:3]] + [DEG * x for x in kr5.to_xyzrpy(T)[3:]]
            rows.append([f"{name} in {parent}", *(f"{_tidy(x, 3):.3f}" for x in v)])
    return (
        tables.make_table("Frames", ["pose", "x [mm]", "y [mm]", "z [mm]", "roll [°]", "pitch [°]", "yaw [°]"], rows)
        if rows
        else None
    )


def _sensors(cell: kr5.cell.Cell) -> Any:
    rows = []
    if c := cell.camera:
        rows += [
            ["camera", f"{c.width} x {c.height} px, fx {c.fx:g} fy {c.fy:g} cx {c.cx:g} cy {c.cy:g} px"],
            ["lens", f"{c.distortion.model}: {', '.join(f'{v:g}' for v in c.distortion.values)}"],
        ]
    if b := cell.board:
        rows.append(
            ["board", f"{b.rows} x {b.cols} markers {b.family} of {1000 * b.marker:g} mm, {1000 * b.gap:g} mm apart"]
        )
    rows += [
        ["target", f"{t.name}: {t.kind}" + (f" {t.rows} x {t.cols}" if t.rows else f" of {len(t.map)}")]
        for t in cell.targets
    ]
    if (laser := cell.laser) and laser.target:
        rows.append(
            [
                "scanner target",
                f"sphere of radius {1000 * laser.target.radius:g} mm on the plane z = {1000 * laser.target.plane:g} mm",
            ]
        )
    if k := cell.contact:
        rows.append(["contact", f"{k.stiffness / 1000:g} N/mm, damping {k.damping:g} N s/m, friction {k.friction:g}"])
    if p := cell.peg:
        rows.append(
            ["peg", f"radius {1000 * p.radius:g} mm, length {1000 * p.length:g} mm, chamfer {1000 * p.chamfer:g} mm"]
        )
    if t := cell.tube:
        rows.append(
            [
                "tube",
                (
                    f"radii {1000 * t.inner_radius:g} and {1000 * t.outer_radius:g} mm, depth {1000 * t.depth:g} mm,"
                    f" chamfer {1000 * t.chamfer:g} mm"
                ),
            ]
        )
    return tables.make_table("Sensors and task", ["part", "description"], rows, text=(1,)) if rows else None


def _noise(cell: kr5.cell.Cell) -> Any:
    rows = []
    for field in type(cell.noise).fields():
        value = getattr(cell.noise, field["name"])
        unit, text = field["unit"], field["meaning"].removesuffix(".")
        if isinstance(value, list):
            for k, v in enumerate(value):
                rows.append([field["name"], str(k + 1), v, joint_unit(cell, k, unit), "" if k else text])
        elif value:
            rows.append([field["name"], "", value, unit, text])
    heads = ["noise", "joint", "std", "unit", "quantity"]
    return tables.make_table("Noise, standard deviations", heads, rows, text=(3, 4)) if rows else None


def _effects(cell: kr5.cell.Cell) -> Any:
    import kr5.cell

    rows = []
    for effect, targets in cell.effects.to_dict().items():
        row = kr5.cell.find_effect(effect)
        for target, parameters in targets.items():
            units = {p.name: p.unit for p in row.parameters}
            text = ", ".join(f"{name} {format_values(value)} {units[name]}" for name, value in parameters.items())
            rows.append([effect, target, text, row.description])
    return (
        tables.make_table("Effects", ["effect", "target", "parameters", "meaning"], rows, text=(1, 2, 3))
        if rows
        else None
    )


def recording_table(recording: kr5.cell.Recording) -> Any:
    """What a recording holds."""
    rows = []
    for e in recording.experiments:
        t = e["t"]
        measured = [c.name for c in recording_columns(recording, e) if str(c.role) == "predicted" and c.name in e.data]
        rows.append([e.name, str(e.kind), str(e.split), len(e.data), f"{t[0]:g} to {t[-1]:g}", " ".join(measured)])
    heads = ["experiment", "kind", "split", "rows", "t [s]", "measured"]
    return tables.make_table(f"Recording {recording.folder}", heads, rows, text=(1, 2, 5))


def recording_columns(recording: kr5.cell.Recording, experiment: kr5.cell.Experiment) -> list[Any]:
    import kr5.cell

    return kr5.cell.columns(experiment.kind, recording.cell.robot.joints)
