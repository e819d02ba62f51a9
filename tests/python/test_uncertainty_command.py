"""`kr5 uncertainty`: the cases of the book, chains against drawn poses, and what is refused."""

import json

import kr5
import numpy as np
import pytest
from typer.testing import CliRunner

from kr5_tools.app import make_app
from kr5_tools.uncertainty.documents import BOOK

CHAIN = """\
length: mm
angle: deg
chain:
- {name: T_base_flange, T: [600, 100, 800, 10, -20, 30], sigma: [0.05, 0.05, 0.1, 0.02, 0.02, 0.05]}
- {name: T_flange_camera, T: [0, 50, 120, 0, 5, 90], sigma: [0.2, 0.2, 0.3, 0.1, 0.1, 0.1]}
point: {value: [10, -20, 350], sigma: [0.1, 0.1, 0.5]}
"""


@pytest.fixture
def invoke(tmp_path, monkeypatch):
    """The command in this process, with its JSON where it succeeds."""
    monkeypatch.chdir(tmp_path)
    app = make_app(("uncertainty",))

    def run(*args):
        done = CliRunner().invoke(app, ["uncertainty", *map(str, args), "--json", "out.json"])
        assert done.exception is None or isinstance(done.exception, SystemExit), done.exception
        done.data = json.loads((tmp_path / "out.json").read_text()) if done.exit_code == 0 else None
        return done

    return run


def test_a_chain_has_the_covariance_of_drawn_poses(tmp_path, invoke):
    (tmp_path / "chain.yaml").write_text(CHAIN)
    done = invoke("chain", "chain.yaml")
    assert done.exit_code == 0, done.stderr
    found = done.data["result"]
    random = np.random.default_rng(3)
    factors = np.repeat([1e-3, np.pi / 180], 3)
    poses = [kr5.from_xyzrpy(factors * np.array(v)) for v in ([600, 100, 800, 10, -20, 30], [0, 50, 120, 0, 5, 90])]
    sigmas = [factors * np.array(s) for s in ([0.05, 0.05, 0.1, 0.02, 0.02, 0.05], [0.2, 0.2, 0.3, 0.1, 0.1, 0.1])]
    nominal = poses[0] @ poses[1]
    point = np.array([10e-3, -20e-3, 350e-3, 1])
    errors, places = [], []
    for _ in range(4000):
        T = np.eye(4)
        for pose, sigma in zip(poses, sigmas):
            T = T @ pose @ kr5.to_pose(random.normal(0, sigma))
        errors.append(kr5.pose_difference(nominal, T))
        places.append((T @ (point + np.append(random.normal(0, [1e-4, 1e-4, 5e-4]), 0)))[:3])
    drawn, seen = np.cov(np.array(errors).T), np.cov(np.array(places).T)
    for order in ("first_order", "unscented"):
        C = np.array(found[order]["covariance"])
        assert np.allclose(found[order]["T"], nominal, atol=1e-5)
        # 4000 draws: deviations within 1.1 %, of which this is five.
        assert np.allclose(np.sqrt(np.diag(C)), np.sqrt(np.diag(drawn)), rtol=0.06)
    whole, book = (np.array(found["point"][k]["covariance"]) for k in ("with_rotation", "eq_3_49"))
    assert np.trace(whole) == pytest.approx(np.trace(seen), rel=0.1)
    assert np.trace(book) < 0.6 * np.trace(seen)  # the lever of 350 mm is what eq. 3.49 leaves out
    assert done.data["verdict"]["word"] == "good" and "2.7955 standard deviations" in done.stdout


def test_large_rotations_are_told_to_need_the_second_order(tmp_path, invoke):
    pose = "T: [1000, 0, 0, 0, 0, 0], sigma: [0.1, 0.1, 0.1, 0, 0, 30]"
    (tmp_path / "chain.yaml").write_text(
        f"length: mm\nangle: deg\nchain: [{{name: a, {pose}}}, {{name: b, {pose}, inverse: true}}]\n"
    )
    done = invoke("chain", "chain.yaml")
    assert done.exit_code == 0 and done.data["verdict"]["word"] == "doubtful", done.stderr
    assert "use the unscented covariance" in done.data["verdict"]["text"]


def test_robot_and_grid_with_and_without_the_error_of_the_rotation(invoke):
    point = invoke("chain").data["result"]["point"]
    book, whole = (1e6 * np.array(point[k]["covariance"]) for k in ("eq_3_49", "with_rotation"))
    assert np.diag(book) == pytest.approx([0.141**2 + 1e-4, 0.05**2 + 1e-4, 0.126**2 + 1e-4])
    lever = (340 * np.radians(0.1)) ** 2  # 0.59 mm
    assert np.diag(whole - book) == pytest.approx([lever, lever, 0], abs=1e-9)


def test_the_scanner_at_the_flange_is_the_corrected_print(invoke):
    done = invoke("laser")
    assert done.exit_code == 0, done.stderr
    C = 1e6 * np.array(done.data["result"]["measurements"]["scanner"]["eq_3_61"]["covariance"])
    corrected = np.array([[0.0187, 0.0146, -0.0663], [0.0146, 0.0115, -0.024], [-0.0663, -0.024, 0.9341]])
    assert np.abs(C - corrected).max() < 0.007
    printed, put_right = done.data["result"]["printed"]
    assert "negative eigenvalue -0.020" in printed["defect"] and put_right["defect"] == ""
    turned = invoke("laser", "--sigma-rotation", 0.1, "--sigma-translation", 0.033).data["result"]["measurements"]
    both = turned["scanner"]
    book, whole = (1e6 * np.array(both[k]["covariance"]) for k in ("eq_3_61", "with_rotation"))
    assert np.trace(book) == pytest.approx(np.trace(C) + 3 * (0.033**2 - 1e-4))
    assert np.trace(whole - book) == pytest.approx(2 * (192.5 * np.radians(0.1)) ** 2)  # about the scanner's origin


def test_fused_is_better_than_each_and_the_printed_one_is_refused(invoke):
    done = invoke("fusion", "--report", "page.html", "--png", "plots", "-o", "fusion.json")
    assert done.exit_code == 0, done.stderr
    result = done.data["result"]
    each = [np.array(m["eq_3_61"]["covariance"]) for m in result["measurements"].values()]
    fused = np.array(result["fused"]["covariance"])
    assert np.trace(fused) < min(np.trace(C) for C in each)
    assert np.allclose(np.linalg.inv(fused), sum(np.linalg.inv(C) for C in each), rtol=1e-9)
    for C in each:
        assert np.linalg.eigvalsh(C - fused).min() > 0
    (printed,) = result["printed"]
    assert "no covariance" in printed["defect"] and "negative eigenvalue -0.00046" in printed["defect"]
    assert "It is not used" in done.stdout


def test_the_camera_matrix_is_linear_in_the_noise_and_exact(invoke):
    done = invoke("camera-matrix", "--draws", 1000)
    assert done.exit_code == 0, done.stderr
    noise, found = done.data["result"]["noise"], done.data["result"]["results"]
    assert noise == [0.05, 0.1, 0.5, 1]
    corner = next(c for c in found[0]["corners"] if c["point"] == done.data["result"]["corner"])
    slopes = []
    for sigma, result in zip(noise, found):
        same = next(c for c in result["corners"] if c["index"] == corner["index"])
        exact, simulated = (np.sqrt(np.diag(same[k]))[[0, 2]] for k in ("covariance", "simulated"))
        assert exact / sigma == pytest.approx(np.sqrt(np.diag(corner["covariance"]))[[0, 2]] / 0.05, rel=1e-9)
        slopes.append(simulated / sigma)
        assert simulated == pytest.approx(exact, rel=0.12)  # 1000 draws: 2.2 %, five of them
    assert np.allclose(slopes, slopes[0], rtol=0.02)  # the same draws, so that only the second order differs
    assert "neither the number of squares nor the" in done.stdout.replace("\n", " ")
    size = [np.trace(c["covariance"]) for c in found[0]["corners"]]
    away = [np.hypot(c["point"][0] - 0.048, c["point"][2] - 0.042) for c in found[0]["corners"]]
    assert size[int(np.argmin(away))] < 0.5 * size[int(np.argmax(away))]  # Table 3.4: less toward the middle
    nearer = invoke("camera-matrix", "--draws", 100, "--distance", 200).data["result"]["mm_per_pixel"]
    assert nearer[0] < 0.7 * done.data["result"]["mm_per_pixel"][0]


@pytest.mark.parametrize("command", ["chain", "laser", "fusion", "camera-matrix"])
def test_every_result_becomes_a_page(tmp_path, run_kr5, invoke, browser, command):
    more = ["--draws", 100] if command == "camera-matrix" else []
    assert invoke(command, *more, "-o", "result.json", "--report", "page.html", "--png", "plots").exit_code == 0
    if command != "laser":
        assert len(list((tmp_path / "plots").glob("*.png"))) >= 1
    browser.open_whole(tmp_path / "page.html", 390)
    report = CliRunner().invoke(make_app(("report",)), ["report", "result.json", "-o", "again.html"])
    assert report.exit_code == 0, report.stderr
    assert (tmp_path / "again.html").read_text() == (tmp_path / "page.html").read_text().replace(
        f"{command.replace('-', '_')}.yaml", "result.json"
    ).replace("grid.yaml", "result.json")


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("sigma: [0.2, 0.2", "sigma: [-0.2, 0.2", "chain[1].sigma: found the standard deviation -0.2"),
        ("length: mm", "length: inch", "length: found 'inch', expected m, cm, mm or um"),
        ("T: [600, 100,", "T: [.nan, 100,", "a finite number"),
        ("T: [600, 100,", "T: [100,", "chain[0].T"),
        ("name: T_flange_camera", "name: T_base_flange", "two named 'T_base_flange'"),
        ("value: [10, -20, 350]", "value: [10, -20]", "point.value"),
        (
            "point: {value: [10, -20, 350], sigma: [0.1, 0.1, 0.5]}",
            "point: {value: [0, 0, 1], covariance: [[1, 2, 0], [2, 1, 0], [0, 0, 1]]}",
            "point.covariance: is no covariance: it has the negative eigenvalue -1 (the largest is 3)",
        ),
        (
            "point: {value: [10, -20, 350], sigma: [0.1, 0.1, 0.5]}",
            "point: {value: [0, 0, 1], covariance: [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}",
            "is not symmetric",
        ),
        (
            "T: [600, 100, 800, 10, -20, 30]",
            "T: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]]",
            "chain[0].T: its rotation part is not a rotation matrix: determinant -1",
        ),
        (
            "point: {value: [10, -20, 350], sigma: [0.1, 0.1, 0.5]}",
            "point: {value: [0, 0, 1], sigma: [1, 1, 1], covariance: [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}",
            "found both, expected sigma or covariance",
        ),
        (CHAIN, "chain: []\n", "at least 1"),
        (CHAIN, "", "expected a map"),
        (CHAIN, CHAIN[:90], "not valid YAML"),
        ("sigma: [0.2, 0.2", "sigmas: [0.2, 0.2", "unknown key 'sigmas'"),
    ],
)
def test_a_chain_that_is_none_is_told_with_its_field(tmp_path, invoke, old, new, words):
    assert old in CHAIN
    (tmp_path / "chain.yaml").write_text(CHAIN.replace(old, new))
    done = invoke("chain", "chain.yaml", "-o", "result.json")
    assert done.exit_code == 2 and words in " ".join(done.stderr.split()), done.stderr
    assert not (tmp_path / "result.json").exists()


@pytest.mark.parametrize(
    "args, words",
    [
        (["chain", "gone.yaml"], "gone.yaml: No such file"),
        (["chain", "--confidence", 1.5], "--confidence: found 1.5"),
        (["laser", "--sigma-rotation", -1], "--sigma-rotation: found -1"),
        (["camera-matrix", "--distance", 0], "--distance: found 0"),
        (["camera-matrix", "--distance", "nan"], "--distance: found nan"),
        (
            ["camera-matrix", "--distance", 0.4],
            "--distance: found 0.4 mm, expected 66.5 to 2.66e+04 mm before a board of 133 mm; is it in m?",
        ),
        (["camera-matrix", "--distance", 4e5], "--distance: found 400000 mm, expected 66.5"),
        (["camera-matrix", "metres.yaml"], "metres.yaml: board.square: found 12 m, expected 0.0002 to 1 m of a board"),
        (["camera-matrix", "far.yaml"], "far.yaml: distance: found 400 m, expected 0.0665 to 26.6 m before a board"),
        (["fusion", "exact.yaml"], "measurements[0].covariance: is singular in the common frame"),
        (["fusion", "both.yaml"], "expected sigma or covariance"),
        (["laser", "other.yaml"], "printed[0].of: found 'sonar', expected one of scanner"),
    ],
)
def test_options_and_sensors_that_make_no_sense_are_refused(tmp_path, invoke, args, words):
    text = (BOOK / "laser.yaml").read_text()
    (tmp_path / "exact.yaml").write_text(text.replace("  pose_sigma: [0.01, 0.01, 0.01, 0, 0, 0]\n", ""))
    (tmp_path / "both.yaml").write_text(text.replace("  point: [0, 0, 192.5]", "  sigma: [1, 1, 1]"))
    (tmp_path / "other.yaml").write_text(text.replace("  of: scanner", "  of: sonar"))
    scene = (BOOK / "camera_matrix.yaml").read_text()
    (tmp_path / "metres.yaml").write_text(scene.replace("length: mm", "length: m"))
    (tmp_path / "far.yaml").write_text(scene.replace("length: mm", "length: m").replace("square: 12", "square: 0.012"))
    done = invoke(*args)
    assert done.exit_code == 2 and words in " ".join(done.stderr.split()), done.stderr


def test_python_propagates_and_projects_back():
    chain = [kr5.UncertainPose(T=kr5.to_pose([1, 0, 0, 0, 0, 0.1]), covariance=1e-6 * np.eye(6))] * 2
    first, second = kr5.propagate_chain(chain), kr5.propagate_chain_unscented(chain)
    assert np.allclose(first.covariance, (chain[0] @ chain[1]).covariance)
    assert np.allclose(first.covariance, second.covariance, atol=1e-9)
    assert kr5.covariance_defect(np.eye(2)) == "" and "2 x 3" in kr5.covariance_defect(np.zeros((2, 3)))
    camera = kr5.Pinhole(width=640, height=480, fx=600, fy=600, cx=320, cy=240)
    M = kr5.projection_matrix(camera, kr5.to_pose([0, 0, 1, 0, 0, 0]))
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (3, 20))
    seen = M @ np.vstack([points, np.ones(20)])
    found = kr5.estimate_projection_matrix(points, seen[:2] / seen[2])
    assert np.allclose(found, M, atol=1e-6)
    assert np.allclose(kr5.back_project(M, seen[:2, 0] / seen[2, 0], kr5.Plane(distance=points[2, 0])), points[:, 0])
