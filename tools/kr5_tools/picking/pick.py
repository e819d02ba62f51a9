"""`kr5 pick`: poses of the cylinders in a scanned bin, and the order to pick them."""

from pathlib import Path
from typing import Annotated, Any, Literal

import kr5
import kr5.picking
import numpy as np
import typer
from kr5 import picking
from kr5.files.results import write_result
from kr5.files.writing import beside, check_writable, write_json

from kr5_tools.cli.arguments import JsonOption, ResultOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.tables import figure_row, make_table, print_result
from kr5_tools.cli.terminal import Console, console, fail, print_note, spinner
from kr5_tools.picking.bin_file import EXAMPLE, read_bin
from kr5_tools.picking.clouds import ENDINGS, CloudFile, read_cloud
from kr5_tools.picking.heights import height_range
from kr5_tools.picking.image_refinement import REFINED_ABOVE, Refined, read_view, refine, require_seen

app = typer.Typer()
SHOWN = 12


@app.command(epilog="Example:  kr5 pick cloud.npz --bin bin.yaml --radius 0.008 --height 0.014:0.017 --json picks.json")
@options_from(picking.GraspOptions, skip=("gripper", "min_exposed", "cup_radius"), argument="grasp")
@options_from(picking.PelletOptions, skip=("radius", "radius_tolerance", "min_height", "max_height", "min_exposed"))
def pick(
    cloud_file: Annotated[
        Path,
        typer.Argument(
            metavar="CLOUD",
            help=f"Cloud, a file that ends in {ENDINGS}; or profiles of a scanner on a moving arm (NPZ).",
        ),
    ],
    options: picking.PelletOptions,
    grasp: picking.GraspOptions,
    radius: Annotated[float, typer.Option(help=r"Radius of the cylinders \[m].")] = 0.008,
    height: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help=r"Range of their heights, or one height \[m].")
    ] = "0.014:0.017",
    bin_file: Annotated[
        Path | None, typer.Option("--bin", metavar="BIN.yaml", help="Pose and inner size of the bin.")
    ] = None,
    frame: Annotated[
        str | None,
        typer.Option(
            "--frame",
            metavar="X,Y,Z,R,P,Y",
            help=r"Pose of the cloud's frame in the base \[m, rad]; its origin is then the sensor, where the file names"
            " none. By default the cloud is in the base, seen from above the bin.",
        ),
    ] = None,
    length: Annotated[
        Literal["m", "mm"] | None,
        typer.Option(
            "--length-unit", help="Unit of the points; by default as the names of columns or the numbers show, else m."
        ),
    ] = None,
    delay: Annotated[
        float | None,
        typer.Option(
            help=r"Time by which a profile is stamped later than it was exposed; for a file of profiles, whose own is"
            r" used by default \[s]."
        ),
    ] = None,
    image: Annotated[
        Path | None,
        typer.Option(
            "--image", metavar="IMAGE.png", help="Image that refines cylinders whose pose the cloud determines poorly."
        ),
    ] = None,
    camera: Annotated[
        Path | None,
        typer.Option("--camera", metavar="CAMERA", help="Camera of the image; its file may hold T_base_camera."),
    ] = None,
    camera_pose: Annotated[
        str | None,
        typer.Option(
            "--camera-pose", metavar="X,Y,Z,R,P,Y", help=r"Pose of the camera in the base \[m, rad]; Z looks ahead."
        ),
    ] = None,
    camera_position_std: Annotated[
        float, typer.Option(help=r"Standard deviation of the camera's position in each direction \[m].")
    ] = 0.0003,
    camera_rotation_std: Annotated[
        float, typer.Option(help=r"Standard deviation of its orientation about each axis \[rad].")
    ] = 0.0005,
    refine_above: Annotated[
        float,
        typer.Option(help=r"Standard deviation of a centre above which the image is used \[m]."),
    ] = REFINED_ABOVE,
    radius_tolerance: Annotated[
        float | None, typer.Option(help=r"Maximum deviation of a radius; by default a sixteenth of it \[m].")
    ] = None,
    cup_radius: Annotated[
        float | None, typer.Option(help=r"Radius of the suction cup; by default half that of the cylinders \[m].")
    ] = None,
    gripper_radius: Annotated[
        float | None,
        typer.Option(help=r"Radius of the gripper above the cup; by default five eighths of the cylinders' \[m]."),
    ] = None,
    gripper_length: Annotated[float, typer.Option(help=r"Length of that part \[m].")] = 0.15,
    min_exposed: Annotated[float, typer.Option(help=r"Minimum visible share of a cylinder to be picked \[-].")] = 0.4,
    output: ResultOption = None,
    png: Annotated[
        Path | None,
        typer.Option("--png", metavar="PICKS.png", help="Picture of the bin from above with every decision."),
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Poses of the cylinders of a pile with uncertainty, which of them the gripper can pick, and in which order.

    Cylinders are listed when enough of them is visible to determine their pose; for each that cannot be picked the
    reason is given. Exit code:
    0 when something can be picked, 1 when nothing can, 2 when the input is invalid or the cloud does not fit the bin.
    """
    check_writable(output, png, json_file, inputs=[f for f in (cloud_file, bin_file, image, camera) if f])
    options.radius = radius
    options.radius_tolerance = radius / 16 if radius_tolerance is None else radius_tolerance
    options.min_height, options.max_height = height_range(height)
    grasp.min_exposed = min_exposed
    grasp.cup_radius = radius / 2 if cup_radius is None else cup_radius
    rod = 0.625 * radius if gripper_radius is None else gripper_radius
    grasp.gripper = [picking.GripperPart(radius=rod, start=0.001, end=gripper_length)]
    options.validate()
    grasp.validate()
    if bin_file is None:
        fail(f"--bin is missing: a file such as\n{EXAMPLE}states where the bin stands and how large it is")
    bin_ = read_bin(bin_file)
    if (image is None) != (camera is None):
        fail("--image and --camera belong together: the image, and the camera that took it")
    view = None
    if image is not None and camera is not None:
        pose = _pose("--camera-pose", camera_pose)
        view = read_view(image, camera, pose, camera_position_std, camera_rotation_std)
    cloud = cloud_in_base(read_cloud(cloud_file, delay, length), _pose("--frame", frame))
    with spinner("Looking for cylinders"):
        found = picking.find_pellets(cloud, bin_, options)
        said: list[Refined] = []
        if view is not None:
            found.pellets, said = refine(found.pellets, view, refine_above)
            require_seen(said)
        if str(found.check.finding) == "good":
            plan = picking.plan_picks(found.pellets, cloud, bin_, grasp)
    if str(found.check.finding) != "good" and str(found.check.finding) != "no_pellets":
        hint = " (--length-unit mm)" if found.check.finding == picking.CloudFinding("wrong_unit") else ""
        fail(f"{cloud_file}: {found.check.message.removesuffix('.')}{hint}")
    if str(found.check.finding) == "no_pellets":
        plan = []
    keys = result_keys(found, plan, said)
    keys["input"] = {"cloud": str(cloud_file), "bin": str(bin_file), "points": found.check.finite}
    if image is not None:
        keys["input"] |= {"image": str(image), "camera": str(camera)}
    _show(keys, console(json_file))
    data = write_result(output, "kr5-pick/1", **keys)
    if png:
        from kr5_tools.picking.picture import write_picture

        with beside(png) as new:
            write_picture(new, np.asarray(cloud.points), bin_, keys["pellets"])
    write_json(data, json_file)
    if not any(p["graspable"] for p in keys["pellets"]):
        raise typer.Exit(1)


def cloud_in_base(file: CloudFile, T_base_cloud: np.ndarray | None) -> Any:
    """The cloud in the frame of the base, with the origins of its rays as far as they are known."""
    points, origins = file.points, file.origins
    if T_base_cloud is not None:
        if origins is None:
            origins = np.zeros((1, 3))
        points = points @ T_base_cloud[:3, :3].T + T_base_cloud[:3, 3]
        origins = origins @ T_base_cloud[:3, :3].T + T_base_cloud[:3, 3]
    out = picking.Cloud()
    out.points = kr5.points_from_rows(points)
    if origins is not None:
        out.origins = kr5.points_from_rows(origins)
    return out


def result_keys(
    found: kr5.picking.PelletResult, plan: list[picking.Grasp], said: list[Refined] | None = None
) -> dict[str, Any]:
    """Keys of a result: the cylinders in the order to pick them, what was made of the cloud, and what an image said of
    each cylinder."""
    pellets = [pellet_keys(found.pellets[g.pellet], g) for g in plan]
    if said:
        for keys, g in zip(pellets, plan, strict=True):
            keys["image"] = {"status": said[g.pellet].status, "moved": said[g.pellet].moved}
    ready = sum(p["graspable"] for p in pellets)
    text = f"{len(pellets)} cylinders found, {ready} can be picked now"
    if not pellets:
        text = found.check.message if str(found.check.finding) != "good" else "no cylinder was found"
    if found.unexplained:
        text += f"; {found.unexplained} points of the sample belong to none"
    counts: dict[str, int] = {}
    for g in plan:
        counts[str(g.finding)] = counts.get(str(g.finding), 0) + 1
    figures = [
        figure_row("cylinders found", len(pellets), None, "-"),
        figure_row("of these: can be picked", ready, None, "-"),
        figure_row("too uncertain to be listed", found.doubtful, None, "-"),
        figure_row("points of the sample that belong to none", found.unexplained, None, "-"),
        figure_row("noise of the points, along the normals", 1e3 * found.noise, None, "mm"),
        figure_row("spacing of the points", 1e3 * found.check.spacing, None, "mm"),
    ]
    if said:
        asked = [s for s in said if s.status != "not_needed"]
        refined = [s for s in asked if s.status == "refined"]
        figures.append(figure_row("cylinders looked at in the image", len(asked), None, "-"))
        figures.append(figure_row("of these: refined by it", len(refined), None, "-"))
        if refined:
            moved = float(np.median([s.moved for s in refined]))
            figures.append(figure_row("median distance it moved them", 1e3 * moved, None, "mm"))
    return {
        "verdict": {"word": "good" if ready else "doubtful", "text": text + "."},
        "figures": figures,
        "findings": counts,
        "pellets": pellets,
    }


def pellet_keys(pellet: kr5.picking.Pellet, g: kr5.picking.Grasp) -> dict[str, Any]:
    """One cylinder of the result. The covariance is that of the centre [m] and of a small rotation [rad], in the axes
    of the base."""
    frame, small = np.asarray(pellet.frame), np.asarray(pellet.covariance)
    J = np.zeros((6, 5))
    J[:3, :3], J[3:, 3:] = frame, frame[:, :2]
    return {
        "centre": pellet.centre,
        "axis": pellet.axis,
        "radius": pellet.radius,
        "height": pellet.height,
        "covariance": J @ small[:5, :5] @ J.T,
        "sigma_radius": float(np.sqrt(small[5, 5])),
        "sigma_height": float(np.sqrt(small[6, 6])),
        "exposed": pellet.exposed,
        "graspable": g.finding == picking.GraspFinding.Graspable,
        "finding": str(g.finding),
        "reason": g.reason,
        "T_base_gripper": g.T_base_gripper if g.finding == picking.GraspFinding.Graspable else None,
        "clearance": g.clearance if g.finding == picking.GraspFinding.Graspable else None,
        "covered_by": list(g.covered_by),
        "rms": pellet.rms,
    }


def _pose(option: str, text: str | None) -> np.ndarray | None:
    if text is None:
        return None
    try:
        values = [float(p) for p in text.split(",")]
    except ValueError:
        values = []
    if len(values) != 6 or not all(np.isfinite(values)):
        fail(f"{option}: found {text!r:.80}, expected six numbers x,y,z,roll,pitch,yaw in metres and radians")
    return np.asarray(kr5.from_xyzrpy(np.array(values)))


def _show(keys: dict[str, Any], to: Console) -> None:
    print_result(keys, to)
    rows = [
        [i + 1, *(1e3 * float(v) for v in p["centre"]), 100 * p["exposed"], "pick" if p["graspable"] else p["reason"]]
        for i, p in enumerate(keys["pellets"][:SHOWN])
    ]
    if rows:
        columns = ["no.", "x [mm]", "y [mm]", "z [mm]", "seen [%]", "decision"]
        to.print()
        to.print(make_table("In the order to pick", columns, rows, text=(5,)))
        if len(keys["pellets"]) > SHOWN:
            print_note(f"{len(keys['pellets']) - SHOWN} more are not shown; -o and --json write all")
