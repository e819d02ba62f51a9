"""`kr5 pick` and `kr5 bin empty`, on simulated bins and on clouds in other files."""

import json

import kr5
import numpy as np
import pytest
import yaml
from kr5 import picking, sim
from matplotlib.colors import to_rgb

from command_runner import run_command
from kr5_tools.pages.plot_style import plt
from kr5_tools.picking.picture import draw_bin
from kr5_tools.picking.simulate import true_pellets


@pytest.fixture(scope="module")
def scanned(tmp_path_factory):
    """A small bin, scanned: its folder and the truth."""
    folder = tmp_path_factory.mktemp("scanned")
    (folder / "own.yaml").write_text("T_base_bin: [0.5, 0.2, 0.1, 0.02, -0.03, 0.4]\nsize: [0.12, 0.12, 0.08]\n")
    words = ["bin", "simulate", "out", "--bin", "own.yaml", "--pellets", "24", "--pitch", "0.0007", "--seed", "4"]
    done = run_command(*words, cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "out", json.loads((folder / "out/truth.json").read_text())


def right(pellet, truth):
    """Number of the true cylinder within 2 mm and 5 degrees, or None."""
    for i, t in enumerate(truth):
        near = np.linalg.norm(np.subtract(pellet["centre"], t["centre"])) < 0.002
        if near and abs(np.dot(pellet["axis"], t["axis"])) > np.cos(np.radians(5)):
            return i
    return None


def median_error(pellets, truth):
    near = [(p, right(p, truth)) for p in pellets]
    off = [np.subtract(p["centre"], truth[i]["centre"]) for p, i in near if i is not None]
    return float(np.median(np.linalg.norm(off, axis=1)))


def test_an_image_refines_what_the_cloud_does_not_tell(tmp_path):
    words = ["bin", "simulate", "out", "--pellets", "60", "--pitch", "0.001", "--noise", "0.0002", "--seed", "6"]
    assert run_command(*words, cwd=tmp_path).returncode == 0
    folder = tmp_path / "out"
    truth = json.loads((folder / "truth.json").read_text())["pellets"]
    words = ["pick", "cloud.npz", "--bin", "bin.yaml", "--json", "-"]
    plain = json.loads(run_command(*words, cwd=folder).stdout)["pellets"]
    done = run_command(*words, "--image", "image.png", "--camera", "camera.yaml", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "refined by it" in done.stderr
    seen = json.loads(done.stdout)["pellets"]
    refined = [p for p in seen if p["image"]["status"] == "refined"]
    assert len(refined) > 10
    assert {p["image"]["moved"] for p in seen if p["image"]["status"] == "not_needed"} == {0.0}
    where = [np.asarray(p["centre"]) for p in refined]
    same = [p for p in plain if min(np.linalg.norm(np.subtract(w, p["centre"])) for w in where) < 0.002]
    assert median_error(refined, truth) < median_error(same, truth)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--image", "image.png"], "--image and --camera belong together"),
        (["--image", "nosuch.png", "--camera", "camera.yaml"], "nosuch.png: No such file"),
        (["--image", "bin.yaml", "--camera", "camera.yaml"], "cannot be read as an image"),
        (["--image", "image.png", "--camera", "small.yaml"], "is a camera of 640 x 480 px, but"),
        (["--image", "image.png", "--camera", "bare.yaml"], "T_base_camera is missing"),
        (["--image", "image.png", "--camera", "bad.yaml"], "expected six numbers x y z roll pitch yaw"),
        (["--image", "image.png", "--camera", "away.yaml", "--refine-above", "0"], "shows none of the cylinders"),
        (["--image", "image.png", "--camera", "camera.yaml", "--camera-position-std", "0"], "a positive number"),
    ],
)
def test_images_that_cannot_refine_are_refused_in_words(scanned, words, text):
    folder, _ = scanned
    camera = yaml.safe_load((folder / "camera.yaml").read_text())
    pose = camera.pop("T_base_camera")
    (folder / "bare.yaml").write_text(yaml.safe_dump(camera))
    (folder / "bad.yaml").write_text(yaml.safe_dump(camera | {"T_base_camera": [1, 2, "x"]}))
    (folder / "away.yaml").write_text(yaml.safe_dump(camera | {"T_base_camera": [*pose[:3], 0.0, 0.0, 0.0]}))
    (folder / "small.yaml").write_text(yaml.safe_dump(camera | {"width": 640, "height": 480, "T_base_camera": pose}))
    done = run_command("pick", "cloud.npz", "--bin", "bin.yaml", *words, cwd=folder)
    assert done.returncode == 2
    assert text in done.stderr and "Traceback" not in done.stderr


def saved(folder, name, arrays):
    np.savez(folder / name, **arrays)
    return name


def test_profiles_become_a_cloud_with_the_lag_taken_out(tmp_path):
    words = ["bin", "simulate", "out", "--pellets", "20", "--delay", "0.02", "--seed", "5", "--noise", "0.00002"]
    assert run_command(*words, cwd=tmp_path).returncode == 0
    folder = tmp_path / "out"
    truth = json.loads((folder / "truth.json").read_text())["pellets"]
    with np.load(folder / "cloud.npz") as data:
        arrays = {k: data[k] for k in ("profile_x", "profile_z", "times", "T_base_flange", "T_flange_scanner", "delay")}
    profiles = saved(folder, "profiles.npz", arrays)
    words = ["--bin", "bin.yaml", "--json", "-"]
    corrected = json.loads(run_command("pick", profiles, *words, cwd=folder).stdout)["pellets"]
    ignored = json.loads(run_command("pick", profiles, "--delay", "0", *words, cwd=folder).stdout)["pellets"]
    stamped = json.loads(run_command("pick", "cloud.npz", *words, cwd=folder).stdout)["pellets"]
    assert median_error(ignored, truth) == pytest.approx(0.02 * 0.05, rel=0.25), "the speed of the scan times the delay"
    assert median_error(corrected, truth) < 0.3 * median_error(ignored, truth)
    assert median_error(stamped, truth) == pytest.approx(median_error(ignored, truth), rel=1e-6)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"times": None}, "times is missing: time of each profile"),
        ({"profile_z": np.zeros((3, 4))}, "expected arrays of the same profiles x samples"),
        ({"T_base_flange": np.zeros((5, 3))}, "expected pose of the flange"),
        ({"T_base_flange": np.tile(np.eye(4), (2, 1, 1))}, "found 2 poses, expected one a time"),
        ({"times": "falling"}, "times"),
        ({"T_flange_scanner": np.full((4, 4), np.nan)}, "T_flange_scanner"),
    ],
)
def test_damaged_profiles_are_refused_in_words(scanned, change, text):
    folder, _ = scanned
    with np.load(folder / "cloud.npz") as data:
        arrays = {k: data[k] for k in ("profile_x", "profile_z", "times", "T_base_flange", "T_flange_scanner", "delay")}
    for name, value in change.items():
        if value is None:
            del arrays[name]
        else:
            arrays[name] = arrays[name][::-1] if isinstance(value, str) else value
    done = run_command("pick", saved(folder, "damaged.npz", arrays), "--bin", "bin.yaml", cwd=folder)
    assert done.returncode == 2
    assert text in done.stderr and "Traceback" not in done.stderr


def test_a_lag_belongs_to_profiles(scanned):
    folder, _ = scanned
    np.save(folder / "plain.npy", np.zeros((10, 3)))
    done = run_command("pick", "plain.npy", "--bin", "bin.yaml", "--delay", "0.01", cwd=folder)
    assert done.returncode == 2 and "holds no profiles" in done.stderr


def test_pick_finds_the_visible_cylinders_and_says_what_to_do_with_each(scanned):
    folder, truth = scanned
    words = ["pick", "cloud.npz", "--bin", "bin.yaml", "--radius", "0.008", "--height", "0.014:0.017"]
    done = run_command(*words, "--json", "picks.json", "--png", "picks.png", "-o", "result.json", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "can be picked now" in done.stdout and "mm" in done.stdout
    data = json.loads((folder / "picks.json").read_text())
    assert data["format"] == "kr5-pick/1"
    found = [right(p, truth["pellets"]) for p in data["pellets"]]
    visible = [i for i, t in enumerate(truth["pellets"]) if min(t["exposed"], t["seen"]) >= 0.4]
    assert found.count(None) <= 1
    assert len(set(visible) - set(found)) <= 1, "at most one visible cylinder is missed"
    graspable = [p["graspable"] for p in data["pellets"]]
    assert graspable == sorted(graspable, reverse=True) and any(graspable), "in the order to pick"
    for p in data["pellets"]:
        assert p["reason"] and np.linalg.norm(p["axis"]) == pytest.approx(1)
        C = np.array(p["covariance"])
        assert C.shape == (6, 6) and np.allclose(C, C.T) and np.linalg.eigvalsh(C).min() > -1e-12
    assert (folder / "picks.png").read_bytes()[:4] == b"\x89PNG"
    page = run_command("report", "result.json", "-o", "page.html", cwd=folder)
    assert page.returncode == 0, page.stderr
    assert "Picks from a bin" in (folder / "page.html").read_text()


def as_pcd(points):
    head = (
        "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {len(points)}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {len(points)}\nDATA binary\n"
    )
    return head.encode() + points.astype("<f4").tobytes()


def as_ply(points):
    head = f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n"
    head += "".join(f"property float {axis}\n" for axis in "xyz") + "end_header\n"
    return (head + "\n".join(f"{x:.6f} {y:.6f} {z:.6f}" for x, y, z in points) + "\n").encode()


def as_csv(points):
    return ("x,y,z\n" + "\n".join(f"{x:.6f},{y:.6f},{z:.6f}" for x, y, z in points) + "\n").encode()


@pytest.mark.parametrize(("ending", "writer"), [("pcd", as_pcd), ("ply", as_ply), ("csv", as_csv)])
def test_clouds_of_other_programs_give_the_same_cylinders(scanned, tmp_path, ending, writer):
    folder, truth = scanned
    points = np.load(folder / "cloud.npz")["points"]
    (tmp_path / f"cloud.{ending}").write_bytes(writer(points))  # without the places they were seen from
    words = ["pick", f"cloud.{ending}", "--bin", str(folder / "bin.yaml"), "--json", "picks.json"]
    done = run_command(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = [right(p, truth["pellets"]) for p in json.loads((tmp_path / "picks.json").read_text())["pellets"]]
    visible = [i for i, t in enumerate(truth["pellets"]) if min(t["exposed"], t["seen"]) >= 0.4]
    assert len(set(visible) - set(found)) <= 2 and found.count(None) <= 1


def test_an_organised_cloud_in_the_frame_of_the_sensor_is_taken_with_its_pose(scanned, tmp_path):
    folder, truth = scanned
    points = np.load(folder / "cloud.npz")["points"]
    T = kr5.from_xyzrpy([0.5, 0.2, 0.6, np.pi, 0, 0])  # looking down
    local = (points - T[:3, 3]) @ T[:3, :3]
    rows = np.full((-(-len(local) // 500) * 500, 3), np.nan)
    rows[: len(local)] = local
    np.save(tmp_path / "cloud.npy", rows.reshape(-1, 500, 3))
    frame = "0.5,0.2,0.6,3.141592653589793,0,0"
    words = ["pick", "cloud.npy", "--bin", str(folder / "bin.yaml"), "--frame", frame, "--json", "-"]
    done = run_command(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = {right(p, truth["pellets"]) for p in json.loads(done.stdout)["pellets"]} - {None}
    assert len(found) >= 12


@pytest.mark.parametrize(
    ("change", "words", "text"),
    [
        (lambda p: 1000 * p, ["--length-unit", "m"], "--length-unit mm"),
        (lambda p: p + np.array([0.5, 0, 0]), [], "lie within the bin"),
        (lambda p: p * np.array([1, 1, -1]) + np.array([0, 0, 0.17]), [], "upside down"),
        (lambda p: p * np.nan, [], "measured points"),
        (lambda p: p[:5], [], "measured points"),
        (lambda p: p, ["--radius", "-1"], "radius"),
        (lambda p: p, ["--height", "tall"], "LOW:HIGH"),
        (lambda p: p, ["--height", "0.02:0.01"], "LOW:HIGH"),
        (lambda p: p, ["--frame", "1,2"], "six numbers"),
        (lambda p: p[:, :2], [], "n x 3"),
    ],
)
def test_clouds_and_options_that_cannot_be_used_are_refused_in_words(scanned, tmp_path, change, words, text):
    folder, _ = scanned
    np.savez(tmp_path / "cloud.npz", points=change(np.load(folder / "cloud.npz")["points"]))
    done = run_command(
        "pick", "cloud.npz", "--bin", str(folder / "bin.yaml"), *words, "--json", "out.json", cwd=tmp_path
    )
    assert done.returncode == 2
    assert text in done.stderr
    assert not (tmp_path / "out.json").exists()


@pytest.mark.parametrize(
    ("head", "unit", "words", "note"),
    [
        ("x,y,z", 1000, [], "the points are read in mm"),
        ("x,y,z", 1000, ["--length-unit", "mm"], ""),
        ("x [mm],y [mm],z [mm]", 1000, [], ""),
        ("z [m],intensity,x [m],y [m]", 1, [], ""),
    ],
)
def test_clouds_in_other_units_give_the_same_cylinders(scanned, tmp_path, head, unit, words, note):
    folder, truth = scanned
    points = unit * np.load(folder / "cloud.npz")["points"]
    columns = {axis: points[:, i] for i, axis in enumerate("xyz")}
    order = [columns.get(name[0], np.full(len(points), 7)) for name in head.split(",")]
    np.savetxt(tmp_path / "cloud.csv", np.transpose(order), fmt="%.5f", delimiter=",", header=head, comments="")
    words = ["pick", "cloud.csv", "--bin", str(folder / "bin.yaml"), *words, "--json", "picks.json"]
    done = run_command(*words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert note in done.stderr and (note or "read in mm" not in done.stderr)
    found = {right(p, truth["pellets"]) for p in json.loads((tmp_path / "picks.json").read_text())["pellets"]} - {None}
    assert len(found) >= 12


def test_columns_in_no_unit_of_length_are_refused(scanned, tmp_path):
    folder, _ = scanned
    (tmp_path / "cloud.csv").write_text("x [deg],y [mm],z [mm]\n1,2,3\n")
    done = run_command("pick", "cloud.csv", "--bin", str(folder / "bin.yaml"), cwd=tmp_path)
    assert done.returncode == 2 and "x [deg], y [mm], z [mm], expected x, y, z in one unit" in done.stderr


def test_the_picture_tells_what_is_not_seen_from_what_is_high_and_every_finding_apart():
    grid = np.stack(np.meshgrid(np.arange(-49, 50, 0.4), np.arange(-49, 20, 0.4)), -1).reshape(-1, 2) / 1000
    points = np.vstack([grid.T, np.where(np.abs(grid[:, 0]) < 0.01, 0.054, 0.0)])
    place = {"centre": [0, 0, 0.02], "axis": [0, 0, 1], "radius": 0.008, "height": 0.015}
    kinds = ["graspable", "covered", "touches_bin", "touches_pile", "hidden"]
    pellets = [{**place, "finding": kind, "graspable": kind == "graspable"} for kind in kinds]
    figure, axes = plt.subplots()
    draw_bin(axes, points, picking.Bin(size=[0.1, 0.1, 0.08]), pellets)
    shades = [to_rgb(axes.images[0].cmap(x)) for x in np.linspace(0, 1, 50)]
    unseen = to_rgb(axes.get_facecolor())
    assert min(np.abs(np.subtract(unseen, shade)).max() for shade in shades) > 0.2
    legend = figure.legends[0]
    assert "not seen by the scanner" in [text.get_text() for text in legend.get_texts()]
    looks = [(line.get_color(), line.get_linestyle()) for line in legend.get_lines()]
    assert len(set(looks)) == len(looks) == len(kinds)
    assert axes.get_xlim() == (-50, 50) and axes.get_ylim() == (-50, 50)
    plt.close(figure)


def test_files_that_are_no_cloud_or_no_bin_are_named(scanned, tmp_path):
    folder, _ = scanned
    (tmp_path / "bin.yaml").write_text("T_base_bin: [0, 0, 0]\nsize: [0.1, 0.1, 0.1]\n")
    assert "T_base_bin" in run_command("pick", str(folder / "cloud.npz"), "--bin", "bin.yaml", cwd=tmp_path).stderr
    assert "--bin" in run_command("pick", str(folder / "cloud.npz"), cwd=tmp_path).stderr
    (tmp_path / "cut.pcd").write_bytes(as_pcd(np.zeros((50, 3)))[:-40])
    assert "cut.pcd" in run_command("pick", "cut.pcd", "--bin", str(folder / "bin.yaml"), cwd=tmp_path).stderr
    (tmp_path / "cloud.stl").write_text("solid")
    assert ".pcd" in run_command("pick", "cloud.stl", "--bin", str(folder / "bin.yaml"), cwd=tmp_path).stderr
    np.savez(tmp_path / "other.npz", depth=np.zeros(3))
    assert "depth" in run_command("pick", "other.npz", "--bin", str(folder / "bin.yaml"), cwd=tmp_path).stderr


def test_an_empty_bin_offers_no_pick(tmp_path):
    g = np.arange(-0.1, 0.1, 0.001)
    x, y = np.meshgrid(g, g)
    np.savez(tmp_path / "cloud.npz", points=np.stack([x, y, 0 * x + 1e-4 * np.sin(900 * x)], -1).reshape(-1, 3))
    (tmp_path / "bin.yaml").write_text("T_base_bin: [0, 0, 0, 0, 0, 0]\nsize: [0.2, 0.2, 0.1]\n")
    done = run_command("pick", "cloud.npz", "--bin", "bin.yaml", "--json", "out.json", cwd=tmp_path)
    assert done.returncode == 1 and "the bin is empty" in done.stdout
    assert json.loads((tmp_path / "out.json").read_text())["pellets"] == []


def test_the_clock_of_the_scanner_is_taken_into_account():
    shape = sim.BinShape(size=[0.12, 0.12, 0.08])
    pile = sim.pour_pellets(shape, sim.PourOptions(pellets=14, width=0.08, seed=5)).scene
    scanner = sim.BinScannerOptions(delay=0.05, speed=0.1)
    scan = sim.scan_bin(pile, sim.scan_path(shape, scanner), scanner)
    profiles = picking.ProfileScan(
        times=scan.times, T_base_flange=list(scan.T_base_flange), pose_times=scan.times, delay=0.05
    )
    profiles.x, profiles.z, profiles.T_flange_scanner = scan.x, scan.z, scan.T_flange_scanner
    box = picking.Bin(size=shape.size)
    truth = true_pellets(pile, np.asarray(sim.exposed_shares(pile)), np.asarray(scan.seen))
    corrected = picking.find_pellets(picking.cloud_from_profiles(profiles), box).pellets
    profiles.delay = 0.0
    ignored = picking.find_pellets(picking.cloud_from_profiles(profiles), box).pellets

    def count(pellets):
        return sum(right({"centre": p.centre, "axis": p.axis}, truth) is not None for p in pellets)

    assert count(corrected) >= 10
    assert count(ignored) < count(corrected) / 2, "5 mm of delay move everything out of its place"


def test_a_small_bin_is_emptied_with_a_page_of_every_decision(tmp_path, browser):
    (tmp_path / "own.yaml").write_text("T_base_bin: [0.5, 0.2, 0.1, 0, 0, 0.4]\nsize: [0.12, 0.12, 0.08]\n")
    words = ["bin", "empty", "--pellets", "8", "--bin", "own.yaml", "--pitch", "0.001", "--seed", "2"]
    done = run_command(*words, "-o", "page.html", "--json", "run.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr + done.stdout
    data = json.loads((tmp_path / "run.json").read_text())
    one = data["bins"][0]
    assert one["left"] == 0 and one["picked"] == 8 and one["wall_touches"] == 0
    assert one["scans"] < 1 + one["attempts"], "several are picked from one scan"
    page = (tmp_path / "page.html").read_text()
    assert "Every decision" in page and "picked by its" in page
    browser.open_whole(tmp_path / "page.html", 1200)
    upright = browser.evaluate("outline([0, 0, 8, 0, 0, 1, 8, 15])")
    assert np.ptp(upright, axis=0) == pytest.approx([16, 16], abs=0.1)
    assert browser.evaluate("document.querySelector('.verdict.good').innerText").startswith("✓")
