"""The simulated bin from Python and `kr5 bin simulate`."""

import json

import kr5
import kr5.sim as sim
import numpy as np
import pytest
import yaml
from PIL import Image

from command_runner import run_command

SMALL = """\
T_base_bin: [0.7, -0.1, 0.2, 0.0, 0.0, 0.4]
size: [0.1, 0.09, 0.08]
"""


def simulate(arguments, cwd):
    """Runs `kr5 bin simulate out` with these words."""
    return run_command("bin", "simulate", "out", *arguments.split(), cwd=cwd)


def small_pile(count=12, progress=None):
    shape = sim.BinShape(size=[0.1, 0.09, 0.08], T_base_bin=kr5.from_xyzrpy([0.7, -0.1, 0.2, 0.0, 0.0, 0.4]))
    return sim.pour_pellets(shape, sim.PourOptions(pellets=count, width=0.06, seed=2), progress=progress)


def distance(pellet, points):
    """Of points in the frame of the pellet's bin from its surface [m], negative inside."""
    T = np.linalg.inv(pellet["T"])
    p = points @ T[:3, :3].T + T[:3, 3]
    q = np.stack([np.hypot(p[:, 0], p[:, 1]) - pellet["radius"], abs(p[:, 2]) - pellet["height"] / 2])
    return np.hypot(*np.maximum(q, 0)) + np.minimum(q.max(axis=0), 0)


def test_a_pile_is_told_about_settles_and_gives_a_pellet_away():
    shares = []
    pile = small_pile(progress=shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0
    assert pile.state.at_rest and pile.state.penetration < 3e-4
    assert sim.deepest_overlap(pile.scene) == pile.state.penetration
    exposed = sim.exposed_shares(pile.scene)
    assert exposed.shape == (12,) and ((exposed >= 0) & (exposed <= 1)).all()
    top = int(np.argmax([p.T_bin_pellet[2, 3] for p in pile.scene.pellets]))
    out = sim.remove_pellet(pile.scene, top, [0, 0, 1])
    assert out.removed and len(out.scene.pellets) == 11 and out.shift.shape == (12,)
    with pytest.raises(kr5.InvalidArgument, match="pellet: must be 0 to 11"):
        sim.remove_pellet(pile.scene, 12, [0, 0, 1])


def test_what_a_progress_callback_raises_ends_the_pour():
    def stop(share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        small_pile(progress=stop)


def test_a_scan_is_arrays_that_fit_each_other():
    scene = small_pile().scene
    options = sim.BinScannerOptions(points=120, pitch=0.001, noise=0.0, width=0.15)
    scan = sim.scan_bin(scene, sim.scan_path(scene.bin, options), options)
    profiles = len(scan.times)
    assert scan.x.shape == scan.z.shape == scan.surface.shape == (profiles, 120)
    assert scan.T_base_flange.shape == (profiles, 4, 4) and scan.seen.shape == (12,)
    points, surface = scan.cloud()
    assert points.shape == (np.isfinite(scan.z).sum(), 3) and surface.shape == points.shape[:1]
    T_base_scanner = scan.T_base_flange @ scan.T_flange_scanner
    own = np.stack([scan.x, np.zeros_like(scan.x), scan.z, np.ones_like(scan.x)], axis=-1)
    mapped = np.einsum("kij,kpj->kpi", T_base_scanner, own)[..., :3][np.isfinite(scan.z)]
    np.testing.assert_allclose(points, mapped, atol=1e-12)
    lasers = np.repeat(T_base_scanner[:, :3, 3], np.isfinite(scan.z).sum(axis=1), axis=0)
    np.testing.assert_allclose(scan.origins(), lasers, atol=1e-12)
    assert {sim.BIN_WALL, sim.BIN_FLOOR} <= set(surface) and sim.BIN_NOTHING not in surface


def test_the_command_writes_a_bin_whose_truth_fits_cloud_and_picture(tmp_path):
    (tmp_path / "given.yaml").write_text(SMALL)
    done = simulate(
        "--pellets 15 --pour-width 0.06 --bin given.yaml --width 0.15 --points 200 --noise 0.00005 --specular 0"
        " --seed 3 --json summary.json",
        tmp_path,
    )
    assert done.returncode == 0, done.stderr
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["pellets"] == 15 and summary["at_rest"] and summary["deepest_overlap"] < 3e-4
    out = tmp_path / "out"
    shape = yaml.safe_load((out / "bin.yaml").read_text())
    assert shape["T_base_bin"] == [0.7, -0.1, 0.2, 0.0, 0.0, 0.4] and shape["size"] == [0.1, 0.09, 0.08]
    truth = json.loads((out / "truth.json").read_text())["pellets"]
    cloud = np.load(out / "cloud.npz")
    assert cloud["points"].shape == cloud["origins"].shape == (summary["points"], 3)
    for number, pellet in enumerate(truth):
        rotation = np.column_stack([*np.linalg.svd(np.atleast_2d(pellet["axis"]))[2][1:], pellet["axis"]])
        pellet["T"] = np.block([[rotation, np.array(pellet["centre"])[:, None]], [np.zeros((1, 3)), 1]])
        own = cloud["points"][cloud["surface"] == number]
        assert abs(distance(pellet, own)).max(initial=0) < 4e-4
        if pellet["seen"] > 0.5:
            assert len(own) > 50
        assert 0 <= pellet["exposed"] <= 1
    _check_picture(out, truth)
    assert Image.open(out / "bin.png").width > 800
    again = simulate("", tmp_path)
    assert again.returncode == 2 and "exists already" in again.stderr


def _check_picture(out, truth):
    """Where a cylinder lies open, the pixel of its middle is darker than the floor beside it."""
    image = np.asarray(Image.open(out / "image.png"))
    fields = yaml.safe_load((out / "camera.yaml").read_text())
    T_camera_base = np.linalg.inv(kr5.from_xyzrpy(fields.pop("T_base_camera")))
    camera = kr5.Pinhole(**fields)
    assert image.shape == (camera.height, camera.width) and image.dtype == np.uint8
    lying = [p for p in truth if p["exposed"] == 1 and abs(p["axis"][2]) < 0.1]
    assert lying
    for pellet in lying:
        point = T_camera_base[:3, :3] @ np.array(pellet["centre"]) + T_camera_base[:3, 3]
        u, v = np.round(camera.project(point)).astype(int).ravel()
        patch = image[v - 15 : v + 16, u - 15 : u + 16].astype(float)
        assert patch.min() < 0.5 * np.median(image[image > 60])  # the black back of a pellet
        assert patch.max() > 2 * patch.min()  # and the gloss on it


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("--height 17:14", "--height: found '17:14'"),
        ("--height a", "expected LOW:HIGH or one number in metres"),
        ("--pellets 0", "pellets: must be 1 to 5000"),
        ("--radius nan", "radius: must be positive"),
        ("--radius 8", "size: must be longer than the diagonal of a pellet"),
        ("--stand-off 0.05", "--stand-off: found 0.05 m, expected more than the height of the walls"),
        ("--far 0.1", "far: must be more than near"),
        ("--bin none.yaml", "none.yaml: No such file"),
        ("--camera-height 0", "height: must be positive"),
    ],
)
def test_what_cannot_be_simulated_is_said_in_a_line(tmp_path, arguments, said):
    done = simulate(f"--pellets 2 {arguments}", tmp_path)
    assert done.returncode == 2
    assert said in done.stderr
    assert not (tmp_path / "out").exists()
