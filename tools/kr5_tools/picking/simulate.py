"""`kr5 bin simulate`: a pile of cylinders in a bin, as scanner and camera show it, with its truth."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import kr5
import numpy as np
import typer
import yaml
from kr5 import sim
from kr5.files.writing import check_new_folder, check_writable, folder_beside, save_figure, to_plain, write_json

from kr5_tools.cli.arguments import JsonOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.terminal import console, fail, print_note, share_bar, spinner
from kr5_tools.picking.heights import height_range
from kr5_tools.picking.simulated_bin import CAMERA, bin_shape

app = typer.Typer()
VISIBLE = 0.4  # share of a pellet that is exposed, from which on it counts as visible (Hayat et al. 2022, 2.5.3)


@app.command(
    epilog="Example:  kr5 bin simulate bin --pellets 125 --radius 0.008 --height 0.014:0.017 --pitch 0.0005"
    " --noise 0.00005 --seed 1"
)
@options_from(sim.BinScannerOptions, skip=("T_flange_scanner", "seed"), argument="scanner")
def simulate(
    folder: Annotated[
        Path, typer.Argument(metavar="OUT_DIR", help="Folder to write; must not exist yet, or be empty.")
    ],
    scanner: sim.BinScannerOptions,
    pellets: Annotated[int, typer.Option(help="Number of cylinders.")] = 125,
    radius: Annotated[float, typer.Option(help=r"Radius of the cylinders \[m].")] = 0.008,
    height: Annotated[
        str, typer.Option(metavar="LOW:HIGH", help=r"Range of their heights, or one height \[m].")
    ] = "0.014:0.017",
    seed: Annotated[int, typer.Option(help="Random seed of pile, scan and picture.")] = 1,
    bin_file: Annotated[
        Path | None,
        typer.Option(
            "--bin",
            metavar="BIN.yaml",
            help="Pose and inner size of the bin; by default 0.22 x 0.22 x 0.1 m, 0.6 m"
            " before the base and 0.1 m above it.",
        ),
    ] = None,
    pour_width: Annotated[
        float,
        typer.Option(help=r"Side of the square into which the cylinders fall \[m]; small for a heap."),
    ] = 0.12,
    friction: Annotated[float, typer.Option(help=r"Coefficient of friction \[-].")] = 0.4,
    camera_height: Annotated[float, typer.Option(help=r"Height of the camera above the floor of the bin \[m].")] = 0.36,
    json_file: JsonOption = None,
) -> None:
    """Pile of cylinders in a bin, settled under gravity, scanned and photographed, with the truth of each cylinder.

    Writes cloud.npz (points and their origins in the base, profiles, poses of the arm), bin.yaml, truth.json,
    image.png, camera.yaml and the overview bin.png.
    """
    check_new_folder(folder)
    check_writable(json_file, inputs=[bin_file])
    shape = bin_shape(bin_file)
    low, high = height_range(height)
    pour = sim.PourOptions(pellets=pellets, radius=radius, height_min=low, height_max=high, width=pour_width, seed=seed)
    scanner.seed = seed
    path, T_base_camera = sim.scan_path(shape, scanner), sim.camera_above(shape, camera_height)
    _check_fan(scanner, shape)
    with share_bar("Pouring") as progress:
        pile = sim.pour_pellets(shape, pour, sim.PileOptions(friction=friction), progress)
    with spinner("Scanning"):
        scan = sim.scan_bin(pile.scene, path, scanner)
        shown = Shown(pile.scene, scan, np.asarray(sim.exposed_shares(pile.scene)), scanner.delay)
    with spinner("Rendering"):
        camera = kr5.Pinhole(**CAMERA)
        image, _ = sim.render_bin(pile.scene, camera, T_base_camera, sim.BinImageOptions(seed=seed))
    with spinner("Writing"), folder_beside(folder) as new:
        write_bin(new, shown, seed)
        save_image(new / "image.png", image)
        _write_yaml(new / "camera.yaml", {**camera.to_dict(), "T_base_camera": _six(T_base_camera)})
        draw_overview(new / "bin.png", shown, image)
    figures = _figures(pile, shown)
    write_json({"folder": str(folder), **figures}, json_file)
    if not pile.state.at_rest:
        print_note(f"the pile still moved after {pile.state.time:.1f} s")
    console(json_file).print(
        f"{folder}: {figures['pellets']} cylinders, {figures['visible']} of them visible (at least {VISIBLE:.0%}"
        f" exposed), pile {1e3 * figures['height']:.0f} mm high, deepest overlap"
        f" {1e3 * figures['deepest_overlap']:.2f} mm; {figures['points']} points in {figures['profiles']} profiles",
        soft_wrap=True,
    )


class Shown:
    """A bin as the scanner shows it, with the truth."""

    def __init__(self, scene: sim.PelletScene, scan: sim.BinScan, exposed: np.ndarray, delay: float) -> None:
        self.scene, self.scan, self.exposed, self.delay = scene, scan, exposed, delay
        self.points, self.surface = scan.cloud()
        self.pellets = true_pellets(scene, exposed, np.asarray(scan.seen))


def _figures(pile: sim.SettledPile, shown: Shown) -> dict[str, Any]:
    return {
        "pellets": len(shown.pellets),
        "visible": int((shown.exposed >= VISIBLE).sum()),
        "points": len(shown.points),
        "profiles": len(shown.scan.times),
        "height": max(float(p["top"]) for p in shown.pellets),
        "at_rest": pile.state.at_rest,
        "settled_after": pile.state.time,
        "deepest_overlap": pile.state.penetration,
    }


def write_bin(folder: Path, shown: Shown, seed: int) -> None:
    """cloud.npz, bin.yaml and truth.json."""
    shape = shown.scene.bin
    write_scan(folder / "cloud.npz", shown)
    _write_yaml(folder / "bin.yaml", bin_keys(shape))
    write_json(
        {"T_base_bin": shape.T_base_bin, "size": shape.size, "seed": seed, "pellets": shown.pellets},
        folder / "truth.json",
    )


def true_pellets(scene: sim.PelletScene, exposed: np.ndarray, seen: np.ndarray) -> list[dict[str, Any]]:
    """The cylinders in the base. `exposed`: share seen from straight above; `seen`: share that laser and receiver see;
    `top`: highest point above the floor [m]."""
    rows = []
    for pellet, share, scanned in zip(scene.pellets, exposed, seen, strict=True):
        T_bin_pellet = np.asarray(pellet.T_bin_pellet)
        T = np.asarray(scene.bin.T_base_bin) @ T_bin_pellet
        upright = min(1.0, abs(T_bin_pellet[2, 2]))
        top = T_bin_pellet[2, 3] + pellet.height / 2 * upright + pellet.radius * math.sqrt(1 - upright**2)
        rows.append(
            {
                "centre": T[:3, 3],
                "axis": T[:3, 2],
                "radius": pellet.radius,
                "height": pellet.height,
                "exposed": share,
                "seen": scanned,
                "top": top,
            }
        )
    return rows


def write_scan(file: Path, shown: Shown) -> None:
    """Cloud in the base, with the place of the laser and the truth of each point, and the profiles behind it. The
    points stand where the arm was at the stamps: the delay of the stamps is not taken out."""
    scan = shown.scan
    with file.open("wb") as stream:
        np.savez(
            stream,
            points=shown.points,
            origins=scan.origins(),
            surface=shown.surface,
            profile_x=scan.x,
            profile_z=scan.z,
            profile_surface=scan.surface,
            times=scan.times,
            T_base_flange=scan.T_base_flange,
            T_flange_scanner=scan.T_flange_scanner,
            delay=shown.delay,
        )


def bin_keys(shape: sim.BinShape) -> dict[str, Any]:
    """The keys of a file that `kr5 pick --bin` reads."""
    return {"T_base_bin": _six(shape.T_base_bin), "size": to_plain(shape.size), "wall_thickness": shape.wall}


def draw_overview(file: Path, shown: Shown, image: np.ndarray) -> None:
    """The cloud from above, each cylinder in a colour of its own, beside the picture of the camera."""
    from kr5_tools.pages.plot_style import STYLE, plt

    surface, T_bin_base = shown.surface, np.linalg.inv(np.asarray(shown.scene.bin.T_base_bin))
    local = 1e3 * (shown.points @ T_bin_base[:3, :3].T + T_bin_base[:3, 3])
    of_pellet = surface >= 0
    colours = np.random.default_rng(0).permutation(int(surface.max(initial=0)) + 1)
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(13, 6))
        left.plot(*local[~of_pellet, :2].T, ",", color="#d1d5db")
        left.scatter(*local[of_pellet, :2].T, s=0.15, c=colours[surface[of_pellet]], cmap="nipy_spectral")
        left.set(xlabel="x of the bin [mm]", ylabel="y of the bin [mm]", aspect="equal", title="Cloud from above")
        right.imshow(image, cmap="gray", vmin=0, vmax=255)
        right.set(xlabel="u [px]", ylabel="v [px]", title="Picture of the camera")
        right.grid(False)
        save_figure(figure, file, dpi=110)
        plt.close(figure)


def save_image(file: Path, image: np.ndarray) -> None:
    """An image of grey levels, uint8 of shape (height, width)."""
    from PIL import Image

    Image.fromarray(image).save(file)


def _check_fan(scanner: sim.BinScannerOptions, shape: sim.BinShape) -> None:
    """Refuses a scanner below the rim, and notes a fan that does not span the bin."""
    rim = float(shape.size[2])
    if scanner.stand_off <= rim:
        fail(f"--stand-off: found {scanner.stand_off:g} m, expected more than the height of the walls, {rim:g} m")
    if scanner.width < shape.size[0]:
        print_note(
            f"the fan of the laser is {scanner.width:g} m wide at the floor and the bin {shape.size[0]:g} m: its sides"
            " are not scanned; choose a larger --width"
        )


def _six(T: np.ndarray) -> list[float]:
    return [float(f"{v:.12g}") + 0.0 for v in kr5.to_xyzrpy(T)]


def _write_yaml(file: Path, data: Mapping[str, object]) -> None:
    file.write_text(yaml.safe_dump(to_plain(data), sort_keys=False), encoding="utf-8")
