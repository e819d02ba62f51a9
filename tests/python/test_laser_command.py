"""`kr5 calibrate laser`, `kr5 calibrate laser-study` and what Python has of them."""

import json
import math
from pathlib import Path

import kr5
import numpy as np
import pytest
from kr5 import calibration, cell
from kr5.files.paths import find_shipped_cell
from PIL import Image

SCANNER = kr5.to_pose([0.114, 0.046, 0.340, 3.0, 0.2, -0.5])
BALL, RADIUS = np.array([0.7, 0.05, 0.125]), 0.02
PLANE = 0.1  # height of the table in the base [m]
X = np.linspace(-0.05, 0.05, 161)


def ranges(T_base_scanner, ball, random, noise=2e-5):
    """A profile of the table, with the ball or a pin of 45 degrees on it."""
    start = (T_base_scanner @ np.vstack([X, 0 * X, 0 * X, 1 + 0 * X]))[:3].T
    along = T_base_scanner[:3, 2]
    z = (PLANE - start[:, 2]) / along[2]
    if ball:
        b = (start - BALL) @ along
        c = ((start - BALL) ** 2).sum(1) - RADIUS**2
        root = np.sqrt(np.maximum(b * b - c, 0))
        z = np.where(b * b > c, np.minimum(z, -b - root), z)
    z = z + random.normal(0, noise, z.shape)
    return np.where((z > 0.12) & (z < 0.28), z, np.nan)


def make_scans(count=36, seed=1, robot=5e-5):
    """Profiles of the ball and, every third, of the table alone, with noisy poses."""
    random = np.random.default_rng(seed)
    profiles, poses, targets = [], [], []
    for k in range(count):
        table = k % 3 == 2
        at = [random.uniform(-0.02, 0.02), random.uniform(-0.4, 0.4) * RADIUS, random.uniform(0.18, 0.21)]
        T = kr5.to_pose([0, 0, 0, 0, 0, random.uniform(-2, 2)]) @ np.diag([1.0, -1.0, -1.0, 1.0])
        T = T @ kr5.to_pose([0, 0, 0, *random.uniform(-0.3, 0.3, 2), 0])
        point = BALL if not table else np.array([*random.uniform(-0.03, 0.03, 2) + BALL[:2], PLANE])
        T[:3, 3] = point - T[:3, :3] @ at
        profiles.append(ranges(T, not table, random))
        flange = T @ np.linalg.inv(SCANNER)
        flange[:3, 3] += random.normal(0, robot, 3)
        poses.append(flange)
        targets.append("table" if table else "ball")
    return profiles, poses, targets


def write_profiles(file, profiles, targets=None, x_scale=1.0, z_scale=1.0, times=None, names=("x", "z")):
    head = ["profile", *(["t"] if times is not None else []), *names, *(["target"] if targets else [])]
    lines = [",".join(head)]
    for k, z in enumerate(profiles):
        for a, b in zip(X, z, strict=True):
            time = [repr(float(times[k]))] if times is not None else []
            place = [repr(float(x_scale * a)), repr(float(z_scale * b)) if math.isfinite(b) else ""]
            lines.append(",".join([str(k), *time, *place, *([targets[k]] if targets else [])]))
    file.write_text("\n".join(lines) + "\n")


def write_poses(file, poses, times=None, numbers=True):
    head = [*(["profile"] if numbers else []), *(["t"] if times is not None else [])]
    lines = [",".join([*head, "x", "y", "z", "rx", "ry", "rz"])]
    for k, T in enumerate(poses):
        values = [*([times[k]] if times is not None else []), *kr5.to_vector(T)]
        lines.append(",".join([*([str(k)] if numbers else []), *(repr(float(v)) for v in values)]))
    file.write_text("\n".join(lines) + "\n")


@pytest.fixture
def folder(tmp_path):
    profiles, poses, targets = make_scans()
    write_profiles(tmp_path / "profiles.csv", profiles, targets)
    write_poses(tmp_path / "poses.csv", poses)
    return tmp_path


TARGETS = ("--target", f"ball=sphere:{RADIUS}", "--target", "table=plane")


def pose_error(T):
    d = kr5.pose_difference(SCANNER, np.array(T))
    return np.linalg.norm(d[:3]), np.linalg.norm(d[3:])


def test_a_folder_of_profiles_gives_the_scanner_a_cloud_a_cell_and_a_page(folder, run_kr5):
    done = run_kr5(
        *("calibrate", "laser", ".", *TARGETS, "-o", "laser.json", "--cloud", "cloud.ply"),
        *("--cell", find_shipped_cell(), "--write-cell", "cell.yaml"),
    )
    assert done.returncode == 0, done.stderr
    data = json.loads((folder / "laser.json").read_text())
    result = data["result"]
    position, rotation = pose_error(result["T_flange_scanner"])
    covariance = np.array(result["covariance"])
    d = kr5.pose_difference(SCANNER, np.array(result["T_flange_scanner"]))
    assert d @ np.linalg.solve(covariance, d) < 22.5  # chi-square of 6, one in a thousand
    assert position < 5e-4 and rotation < 2e-3
    assert data["verdict"]["word"] == "good", data["verdict"]["text"]
    assert result["sigma_position"] == pytest.approx(5e-5, rel=0.4)
    assert data["held_out"]["rms_mm"] < 0.3
    written = cell.load_cell(folder / "cell.yaml")
    assert pose_error(written.T_flange_scanner()) == pytest.approx((position, rotation), abs=1e-9)
    head, _, body = (folder / "cloud.ply").read_bytes().partition(b"end_header\n")
    count = int(head.split(b"element vertex ")[1].split()[0])
    points = np.frombuffer(body, [("xyz", "<f4", 3), ("profile", "<i4")])
    assert len(points) == count > 3000
    off = np.minimum(np.abs(points["xyz"][:, 2] - PLANE), np.abs(np.linalg.norm(points["xyz"] - BALL, axis=1) - RADIUS))
    assert np.sqrt((off**2).mean()) < 2e-4
    done = run_kr5("report", "laser.json", "-o", "page.html", "--png", "plots")
    assert done.returncode == 0, done.stderr
    assert {"profile_errors.png", "cloud.png", "correlation.png"} <= {f.name for f in (folder / "plots").iterdir()}


def tilted(*degrees):
    """Roll, pitch and yaw, without a place."""
    return kr5.from_xyzrpy([0, 0, 0, *np.radians(degrees)])


@pytest.mark.parametrize(
    ("case", "expected", "rms"),
    [
        # Ten profiles of a ball from the side: another minimum lies beside the right one, at an RMS of 0.63 mm.
        ("linescan_side", [0.0835, -0.0072, 0.164, *np.radians([-3.2, -0.3, 132.35])], 0.07),
        # A scanner that counts from the middle of its range, 130 mm before its origin at (60, 10, 80) mm: most z are
        # negative, and what is found is the frame in which the profiles are given.
        (
            "linescan_centred",
            [*(kr5.to_pose([0.06, 0.01, 0.08, 0, 0, 0]) @ tilted(2, -3, 30) @ [0, 0, 0.13, 1])[:3]],
            None,
        ),
    ],
)
def test_a_ball_is_found_from_any_start(case, expected, rms, tmp_path, run_kr5):
    source = Path(__file__).parent / "data" / case
    ball = ("--target", "sphere:0.0125", "--length-unit", "mm", "--profile-length-unit", "mm")
    done = run_kr5("calibrate", "laser", source, *ball, "-o", "laser.json")
    assert done.returncode == 0, done.stderr
    result = json.loads((tmp_path / "laser.json").read_text())["result"]
    T, spread = np.array(result["T_flange_scanner"]), np.sqrt(np.diag(result["covariance"]))
    found = np.array(kr5.to_xyzrpy(T))
    assert np.abs(found[:3] - expected[:3]).max() < max(4 * spread[:3].max(), 5e-4)
    if len(expected) == 6:
        assert np.abs(found[3:] - expected[3:]).max() < max(4 * spread[3:].max(), 0.01)
    if rms:
        assert 1e3 * result["rms"] == pytest.approx(rms, abs=0.02)


def test_poses_are_interpolated_at_the_times_of_the_profiles(tmp_path, run_kr5):
    profiles, poses, _ = make_scans(30)
    ball = [k for k in range(30) if k % 3 != 2]
    # Poses every 20 ms, the middle of five at a profile, and stamps of profiles that are 7 ms late.
    t, stream = [], []
    for n, k in enumerate(ball):
        for step in range(-2, 3):
            t.append(0.2 * n + 0.02 * step)
            stream.append(poses[k] @ kr5.to_pose([0, 0.5 * 0.02 * step, 0, 0, 0, 0]))
    write_profiles(tmp_path / "profiles.csv", [profiles[k] for k in ball], times=[0.2 * n + 0.007 for n in range(20)])
    write_poses(tmp_path / "poses.csv", stream, t, numbers=False)
    common = ("calibrate", "laser", ".", "--target", f"sphere:{RADIUS}")
    done = run_kr5(*common, "--delay", 0.007, "--json", "right.json")
    assert done.returncode == 0, done.stderr
    late = run_kr5(*common, "--json", "late.json")
    assert late.returncode == 0, late.stderr
    right, wrong = (json.loads((tmp_path / f).read_text())["result"] for f in ("right.json", "late.json"))
    # A constant speed and delay look like a scanner mounted elsewhere, by their product of 3.5 mm.
    assert pose_error(right["T_flange_scanner"])[0] < 1e-3
    assert pose_error(wrong["T_flange_scanner"])[0] == pytest.approx(3.5e-3, abs=1e-3)
    done = run_kr5(*common, "--delay", 100)
    assert done.returncode == 2 and "no profile was taken between two poses" in done.stderr


def test_a_recording_with_a_moved_scanner_is_calibrated(tmp_path, run_kr5):
    believed = cell.load_cell(find_shipped_cell())
    tool = np.array(believed.tool.T_flange_tool)
    moved = np.array(believed.T_flange_scanner()) @ kr5.to_pose([0.003, -0.002, 0.004, 0.01, -0.02, 0.015])
    believed.effects = cell.Effects(
        {"laser_mount": {"laser": {"T_E_L": list(kr5.to_xyzrpy(np.linalg.inv(tool) @ moved))}}}
    )
    cell.save_cell(believed, tmp_path / "cell.yaml")
    protocol = (
        "format: kr5-protocol/1\nhome: [0.0, 0.02, -2.75, 0.0, -0.3, 1.571]\nexperiments:\n- {name: scan-1, kind: scan,"
        " split: fit, passes: 6, lines: 9, points: 91, speeds: [0.01]}\n"
    )
    (tmp_path / "protocol.yaml").write_text(protocol)
    done = run_kr5("record", "--cell", "cell.yaml", "--protocol", "protocol.yaml", "-o", "recording", "--nominal")
    assert done.returncode == 0, done.stderr
    done = run_kr5("calibrate", "laser", "recording", "-o", "laser.json")
    assert done.returncode == 0, done.stderr
    found = np.array(json.loads((tmp_path / "laser.json").read_text())["result"]["T_flange_scanner"])
    d = kr5.pose_difference(moved, found)
    before = kr5.pose_difference(moved, np.array(believed.T_flange_scanner()))
    assert np.linalg.norm(d[:3]) < 0.2 * np.linalg.norm(before[:3])
    assert np.linalg.norm(d[3:]) < 0.2 * np.linalg.norm(before[3:])


def spoil(folder, **changes):
    profiles, _, targets = make_scans()
    write_profiles(folder / "profiles.csv", profiles, targets, **changes)


def edit(file, change):
    file.write_text(change(file.read_text()))


BAD = {
    "missing": (lambda f: (f / "poses.csv").unlink(), "no such file"),
    "empty": (lambda f: (f / "profiles.csv").write_text(""), "is empty"),
    "header only": (lambda f: (f / "profiles.csv").write_text("profile,x,z\n"), "no row of numbers"),
    "truncated": (lambda f: edit(f / "poses.csv", lambda t: t[: len(t) // 2]), "no pose of profile"),
    "text": (lambda f: edit(f / "poses.csv", lambda t: t.replace("0.", "zero", 1)), "expected a number"),
    "nan pose": (lambda f: edit(f / "poses.csv", lambda t: t[: t.rindex(",")] + ",nan\n"), "expected a finite number"),
    "metres as millimetres": (lambda f: spoil(f, x_scale=1e-3, z_scale=1e-3), "--profile-length-unit mm"),
    "swapped": (lambda f: spoil(f, names=("z", "x")), "are the columns x and z swapped?"),
    "towards": (lambda f: spoil(f, z_scale=-1), "z is negative"),
    "columns": (lambda f: spoil(f, names=("a", "b")), "missing: x (points of a profile; see --columns)"),
    "a pose less": (
        lambda f: edit(f / "poses.csv", lambda t: "\n".join(t.splitlines()[:-1]) + "\n"),
        "no pose of profile 35",
    ),
    "few": (
        lambda f: edit(f / "profiles.csv", lambda t: "\n".join(t.splitlines()[: 1 + 3 * len(X)]) + "\n"),
        "3 of 3 profiles show their target, expected at least 4",
    ),
}


def scaled_poses():
    out = []
    for T in make_scans()[1]:
        T = np.array(T)
        T[:3, 3] *= 1e3
        out.append(T)
    return out


@pytest.mark.parametrize("fault", BAD)
def test_broken_files_are_told_in_words(folder, fault, run_kr5):
    change, words = BAD[fault]
    change(folder)
    done = run_kr5("calibrate", "laser", ".", *TARGETS, "-o", "laser.json")
    assert done.returncode == 2, done.stdout
    assert words in done.stderr and "Traceback" not in done.stderr
    assert not (folder / "laser.json").exists()


def test_millimetres_are_found_unless_metres_are_stated(folder, run_kr5):
    spoil(folder, x_scale=1e3, z_scale=1e3)
    write_poses(folder / "poses.csv", scaled_poses())
    stated = ("--profile-length-unit", "mm", "--length-unit", "mm")
    found = []
    for words in (stated, ()):
        done = run_kr5("calibrate", "laser", ".", *TARGETS, *words, "-o", "laser.json")
        assert done.returncode == 0, done.stderr
        found.append(json.loads((folder / "laser.json").read_text())["figures"])
    assert found[0] == found[1] and "is read in mm" in done.stderr
    done = run_kr5("calibrate", "laser", ".", *TARGETS, "--profile-length-unit", "m")
    assert done.returncode == 2 and "are they in millimetres? (--profile-length-unit mm)" in done.stderr
    done = run_kr5("calibrate", "laser", ".", *TARGETS, "--length-unit", "m")
    assert done.returncode == 2 and "is it in millimetres?" in done.stderr and "--length-unit" in done.stderr


def test_wrong_targets_are_told(folder, run_kr5):
    done = run_kr5("calibrate", "laser", ".")
    assert done.returncode == 2 and "--target: is missing" in done.stderr
    done = run_kr5("calibrate", "laser", ".", "--target", "cube")
    assert done.returncode == 2 and "expected [NAME=]tip" in done.stderr
    done = run_kr5("calibrate", "laser", ".", *TARGETS, "--target", "cup=tip", "--refine-arm")
    assert done.returncode == 2 and "needs --cell" in done.stderr


def test_profiles_that_never_show_the_tip_are_told(folder, run_kr5):
    profiles, poses, targets = make_scans()
    table = [k for k, name in enumerate(targets) if name == "table"]
    write_profiles(folder / "profiles.csv", [profiles[k] for k in table])
    write_poses(folder / "poses.csv", [poses[k] for k in table])
    done = run_kr5("calibrate", "laser", ".", "--target", "tip")
    assert done.returncode == 2 and "0 of 12 profiles show their target" in done.stderr
    assert "the tip is not in it" in done.stderr


def test_a_shifted_list_is_refused_and_outliers_are_named(folder, run_kr5):
    _, poses, _ = make_scans()
    write_poses(folder / "poses.csv", poses[1:] + poses[:1])
    done = run_kr5("calibrate", "laser", ".", *TARGETS)
    assert done.returncode == 2 and "one list is shifted" in done.stderr
    for k in (4, 13):
        poses[k][:3, 3] += [0.01, -0.005, 0.01]
    write_poses(folder / "poses.csv", poses)
    done = run_kr5("calibrate", "laser", ".", *TARGETS, "-o", "laser.json")
    assert done.returncode == 0, done.stderr
    verdict = json.loads((folder / "laser.json").read_text())["verdict"]
    assert verdict["word"] == "doubtful" and "contradict the others: profile 13, 4" in verdict["text"].replace(
        "4, 13", "13, 4"
    )


def line_image(camera, T_camera_scanner, z):
    """An image in which the laser line shines where the scanner sees it."""
    points = np.vstack([X, 0 * X, z])[:, np.isfinite(z)]
    dense = np.linspace(0, points.shape[1] - 1, 4000)
    points = np.array([np.interp(dense, np.arange(points.shape[1]), row) for row in points])
    pixels = np.asarray(camera.project(T_camera_scanner[:3, :3] @ points + T_camera_scanner[:3, 3:]))
    image = np.random.default_rng(3).normal(40, 3, (camera.height, camera.width))
    v, u = np.mgrid[-3:4, -3:4]
    for x, y in pixels.T:
        i, j = round(x), round(y)
        if 4 <= i < camera.width - 4 and 4 <= j < camera.height - 4:
            spot = 180 * np.exp(-((u + i - x) ** 2 + (v + j - y) ** 2) / 2)
            image[j - 3 : j + 4, i - 3 : i + 4] = np.maximum(image[j - 3 : j + 4, i - 3 : i + 4], 40 + spot)
    return np.clip(image, 0, 255).astype(np.uint8)


def test_profile_points_lie_on_the_laser_line_of_the_image(folder, run_kr5):
    camera = kr5.Pinhole(width=640, height=480, fx=600.0, fy=600.0, cx=320.0, cy=240.0)
    T_camera_scanner = kr5.to_pose([0.01, 0.065, 0.05, 0.35, 0, 0])
    profile = make_scans()[0][0]
    Image.fromarray(line_image(camera, T_camera_scanner, profile)).save(folder / "line.png")
    believed = cell.load_cell(find_shipped_cell())
    for k, off in enumerate(([0.0] * 6, [0.0, 0.01, 0.0, 0, 0, 0])):
        mounted = believed.camera
        mounted.T_tool_camera = None
        mounted.T_flange_camera = SCANNER @ np.linalg.inv(T_camera_scanner @ kr5.to_pose(off))
        for name in ("width", "height", "fx", "fy", "cx", "cy"):
            setattr(mounted, name, getattr(camera, name))
        mounted.distortion = cell.Distortion()
        believed.camera = mounted
        cell.save_cell(believed, folder / "cell.yaml")
        done = run_kr5(
            *("calibrate", "laser", ".", *TARGETS, "--cell", "cell.yaml", "--overlay", "line.png=0"),
            *("-o", f"laser{k}.json"),
        )
        assert done.returncode == 0, done.stderr
    right, wrong = (json.loads((folder / f"laser{k}.json").read_text()) for k in range(2))
    shown = right["overlays"][0]
    assert shown["points_with_line"] > 0.8 * shown["points"]
    d = kr5.pose_difference(T_camera_scanner, np.array(right["camera_scanner"]["T"]))
    assert d @ np.linalg.solve(np.array(right["camera_scanner"]["covariance"]), d) < 22.5
    assert shown["rms_px"] < 3 * shown["expected_std_px"] + 0.5
    assert wrong["overlays"][0]["rms_px"] > 5 and "from the laser line" in wrong["verdict"]["text"]
    with Image.open(folder / "line_overlay.png") as picture:
        assert picture.size == (640, 480)
    done = run_kr5("calibrate", "laser", ".", *TARGETS, "--overlay", "line.png=0")
    assert done.returncode == 2 and "needs --hand-eye" in done.stderr


def test_the_error_grows_with_speed_and_interpolation_removes_it(tmp_path, run_kr5):
    done = run_kr5(
        *("calibrate", "laser-study", "--stand-offs", "0.16:0.22:0.015", "--speeds", "0.01,0.1,0.3"),
        *("--delay", 0.006, "--bias", 0.002, "--passes", 6, "-o", "study.json"),
    )
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "study.json").read_text())
    by_speed, by_stand_off = data["study"]["speed"], data["study"]["stand_off"]
    for row in by_speed:  # a sphere is misplaced by speed times lag along the path, and by noise
        assert row["centre_as_stamped"] == pytest.approx(row["speed"] * 0.006, abs=2e-5 + 0.05 * row["speed"] * 0.006)
        assert row["centre_synchronised"] < 5e-5
    best = min(by_stand_off, key=lambda row: row["rms_synchronised"])["stand_off"]
    assert abs(best - 0.19) < 0.02
    assert max(row["rms_synchronised"] for row in by_stand_off) > 3 * min(
        row["rms_synchronised"] for row in by_stand_off
    )
    done = run_kr5("report", "study.json", "-o", "study.html", "--png", "plots")
    assert done.returncode == 0 and (tmp_path / "plots/study.png").exists(), done.stderr
    done = run_kr5("calibrate", "laser-study", "--speeds", "-3")
    assert done.returncode == 2 and "--speeds" in done.stderr
    done = run_kr5("calibrate", "laser-study", "--stand-offs", "150:230:5")
    assert done.returncode == 2 and "--stand-offs: found 150, expected 0.005 to 5; they are in metres" in done.stderr
    done = run_kr5("calibrate", "laser-study", "--speeds", "10,30")
    assert done.returncode == 2 and "--speeds: found 30, expected at most 5; they are in metres per s" in done.stderr


def test_the_error_stays_below_a_millimetre_around_the_best_stand_off(tmp_path, run_kr5):
    # Hayat et al. 2022, section 3.5: below 1 mm at 185 to 200 mm.
    study = ("calibrate", "laser-study", "--speeds", "0.01", "--passes", 4, "-o", "study.json")
    done = run_kr5(*study, "--stand-offs", "0.185:0.2:0.005")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "study.json").read_text())
    assert "below 1 mm from 185 to 200 mm" in data["verdict"]["text"]
    assert [row["stand_off"] for row in data["study"]["stand_off"]] == pytest.approx([0.185, 0.19, 0.195, 0.2])
    assert all(0 < row["centre_as_stamped"] < 1e-3 for row in data["study"]["stand_off"])
    # A scanner that is biased a hundred times as much is so at its best stand-off alone.
    done = run_kr5(*study, "--stand-offs", "0.15,0.19,0.23", "--bias", 0.02)
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "study.json").read_text())
    assert "below 1 mm from 190 to 190 mm" in data["verdict"]["text"]
    near, best, far = (row["centre_as_stamped"] for row in data["study"]["stand_off"])
    assert best < 1e-3 < 5e-3 < min(near, far)


def test_python_has_the_features_the_points_and_the_camera():
    feature = calibration.find_profile_feature(
        calibration.LineProfile(x=X, z=0.2 + 0.1 * X), "plane", calibration.ProfileFeatureOptions()
    )
    assert feature.fit.usable and np.allclose(feature.points[1], 0.2 + 0.1 * feature.points[0])
    seen = np.array([[0.0, 0.02, -0.01], [0.19, 0.2, 0.17]])
    known = SCANNER[:3, :3] @ np.vstack([seen[0], np.zeros(3), seen[1]]) + SCANNER[:3, 3:]
    assert pose_error(calibration.scanner_from_points(seen, kr5.points_from_columns(known)).T_flange_scanner)[0] < 1e-12
    camera = kr5.UncertainPose(T=kr5.to_pose([0, 0.05, 0.1, 0, 0, 1.0]), covariance=1e-8 * np.eye(6))
    pose = calibration.camera_scanner(camera, kr5.UncertainPose(T=SCANNER))
    assert np.allclose(np.array(camera.T) @ pose.T, SCANNER)
    with pytest.raises(kr5.InvalidArgument, match="at least four profiles"):
        calibration.calibrate_scanner([], [])


def result(folder):
    profiles, poses, targets = make_scans()
    write_profiles(folder / "profiles.csv", profiles, targets)
    write_poses(folder / "poses.csv", poses)
    return "calibrate", "laser", ".", *TARGETS, "-o", "r.json"


RESULTS = {"kr5-laser/1": result}
