"""`kr5 repeatability`."""

import json

import kr5
import numpy as np
import pytest
from kr5 import calibration, vision

COMMANDS = {
    "P1": kr5.from_xyzrpy([0.8, 0.1, 0.4, 3.0, 0.2, 0.5]),
    "P2": kr5.from_xyzrpy([0.9, 0.0, 0.5, 3.0, -0.1, 0.1]),
}
OFFSET = np.array([3e-4, 0, -4e-4])
SIGMA = 2e-5


def rows_of(poses, form):
    return np.array([calibration.to_row(T, form) for T in poses])


def draw(count=30, seed=1):
    random = np.random.default_rng(seed)
    out = []
    for _ in range(count):
        for name, T in COMMANDS.items():
            there = T @ kr5.to_pose([0, 0, 0, *random.normal(0, 1e-4, 3)])
            there[:3, 3] += OFFSET + random.normal(0, SIGMA, 3)
            out.append((name, there))
    return out


def write(file, returns, commanded=True, kuka=False, header="point"):
    form = calibration.PoseFormat()
    names = ["x", "y", "z", "qx", "qy", "qz", "qw"]
    if kuka:
        form = calibration.PoseFormat(position="mm", rotation="kuka_abc", angle="deg")
        names = ["x", "y", "z", "a", "b", "c"]
    rows = rows_of([T for _, T in returns], form)
    columns = [header, *names]
    if commanded:
        rows = np.hstack([rows, rows_of([COMMANDS[p] for p, _ in returns], form)])
        columns += [f"commanded_{n}" for n in names]
    lines = [",".join([p, *map(repr, map(float, row))]) for (p, _), row in zip(returns, rows)]
    file.write_text(",".join(columns) + "\n" + "\n".join(lines) + "\n")


def measure(run_kr5, tmp_path, *args, code=0):
    done = run_kr5("repeatability", *args, "-o", "r.json")
    assert done.returncode == code, done.stdout + done.stderr
    return done if code else json.loads((tmp_path / "r.json").read_text())


@pytest.mark.parametrize("kuka", [False, True])
def test_repeatability_and_accuracy_of_every_point_and_all(run_kr5, tmp_path, kuka):
    write(tmp_path / "returns.csv", draw(), kuka=kuka)
    data = measure(run_kr5, tmp_path, "returns.csv", "--png", "plots")
    assert (tmp_path / "plots/returns.png").is_file()
    assert data["format"] == "kr5-repeatability/1" and data["verdict"]["word"] == "good" and not data["causes"]
    expected = SIGMA * (2 * np.sqrt(2 / np.pi) + 3 * np.sqrt(3 - 8 / np.pi))  # of Maxwell's distribution
    overall = data["result"]["overall"]
    assert overall["RP"]["low"] < expected < overall["RP"]["high"]
    for p in data["result"]["points"]:
        assert p["RP"]["value"] == pytest.approx(expected, rel=0.4)
        assert p["AP"]["value"] == pytest.approx(np.linalg.norm(OFFSET), abs=5 * SIGMA / np.sqrt(30))
        assert p["RR_A"]["value"] == pytest.approx(3e-4, rel=0.5)
    figures = {f["name"]: f["value"] for f in data["figures"]}
    for k, a in enumerate("abc"):
        shown = figures[f"AP_{a}, {data['result']['points'][0]['point']}"]
        assert shown == pytest.approx(np.degrees(data["result"]["points"][0]["offset"][3 + k]), rel=1e-5)
    assert run_kr5("report", "r.json", "-o", "page.html", "--png", "plots").returncode == 0
    assert {f.stem for f in (tmp_path / "plots").iterdir()} >= {"returns", "return_distances", "return_order"}


def test_commanded_poses_may_stand_in_a_file_of_their_own(run_kr5, tmp_path):
    write(tmp_path / "returns.csv", draw(), commanded=False)
    write(tmp_path / "commanded.csv", list(COMMANDS.items()), commanded=False)
    assert measure(run_kr5, tmp_path, "returns.csv")["result"]["points"][0]["AP"] is None
    data = measure(run_kr5, tmp_path, "returns.csv", "--commanded", "commanded.csv")
    assert data["result"]["points"][1]["AP"]["value"] == pytest.approx(5e-4, rel=0.1)


def test_outliers_mixed_points_and_drift_are_named_with_their_lines(run_kr5, tmp_path):
    returns = draw()
    returns[7][1][2, 3] += 1e-3
    returns[20], returns[21] = (returns[21][0], returns[20][1]), (returns[20][0], returns[21][1])
    write(tmp_path / "returns.csv", returns)
    data = measure(run_kr5, tmp_path, "returns.csv")
    causes = {c["cause"]: c["text"] for c in data["causes"]}
    assert "returns.csv:9" in causes["outlier_returns"]
    assert "returns.csv:22 (is at P1)" in causes["points_mixed_up"] and "is at P2" in causes["points_mixed_up"]
    assert data["verdict"]["word"] == "doubtful"
    sound = measure(run_kr5, tmp_path, "returns.csv", "--leave-out-outliers")["result"]["overall"]
    assert sound["RP"]["value"] < 1.3e-4 < data["result"]["overall"]["RP"]["value"]
    warm = draw()
    for k, (_, T) in enumerate(warm):
        T[1, 3] += 2e-4 * k / len(warm)
    write(tmp_path / "returns.csv", warm)
    causes = {c["cause"]: c["text"] for c in measure(run_kr5, tmp_path, "returns.csv")["causes"]}
    assert "y 0.19" in causes["drift"] and "probability below 1e-09" in causes["drift"]


def test_images_of_a_board_are_returns(run_kr5, tmp_path):
    target, camera = (
        "chessboard:4x5:0.03",
        {"width": 640, "height": 480, "fx": 600.0, "fy": 600.0, "cx": 319.5, "cy": 239.5},
    )
    lens = kr5.Pinhole.from_dict(camera)
    (tmp_path / "camera.yaml").write_text("\n".join(f"{k}: {v}" for k, v in camera.items()) + "\n")
    random = np.random.default_rng(3)
    spread = 2e-4
    board = kr5.parse_target(target)
    for point, middle in (("left", [-0.08, -0.05, 0.4]), ("right", [-0.03, -0.04, 0.45])):
        (tmp_path / "images" / point).mkdir(parents=True)
        for k in range(6):
            M = kr5.to_pose([*(np.array(middle) + random.normal(0, spread, 3)), 0.2, -0.15, 0.05])
            image = vision.render([vision.PlacedTarget(target=board, T_camera_target=M)], lens)
            vision.save_image(image, str(tmp_path / "images" / point / f"{k}.png"))
    args = ("images", "--target", target, "--camera", "camera.yaml")
    data = measure(run_kr5, tmp_path, *args)
    points = data["result"]["points"]
    assert [p["point"] for p in points] == ["left", "right"] and data["causes"][0]["cause"] == "few_returns"
    truth = spread * (2 * np.sqrt(2 / np.pi) + 3 * np.sqrt(3 - 8 / np.pi))
    assert data["result"]["overall"]["RP"]["low"] < truth < 1.5 * data["result"]["overall"]["RP"]["high"]
    assert "--target and --camera are needed" in measure(run_kr5, tmp_path, "images", code=2).stderr


def test_input_that_is_no_test_is_refused(run_kr5, tmp_path):
    def refused(*args, words):
        done = measure(run_kr5, tmp_path, *args, code=2)
        text = " ".join(done.stderr.split())
        assert "Traceback" not in text and words in text, text

    refused("none.csv", words="none.csv")
    returns = draw()
    write(tmp_path / "r.csv", returns, header="place")
    refused("r.csv", words="missing: point (the name of a point; see --point and --columns)")
    measure(run_kr5, tmp_path, "r.csv", "--point", "place")
    write(tmp_path / "r.csv", [*returns, ("P3", COMMANDS["P1"])], commanded=False)
    refused("r.csv", words="point P3 has 1 return;")
    write(tmp_path / "r.csv", returns, kuka=True)
    refused("r.csv", "--length-unit", "m", words="millimetres")
    refused("r.csv", "--convention", "quaternion", words="missing: qx")
    text = (tmp_path / "r.csv").read_text().splitlines()
    (tmp_path / "r.csv").write_text("\n".join([*text[:3], text[3].replace(",", ",nan,", 1), *text[4:]]) + "\n")
    refused("r.csv", words="r.csv: line 4: found")
    (tmp_path / "r.csv").write_text(
        "\n".join([text[0], text[1].split(",", 1)[0] + "," + text[1].split(",", 2)[2]]) + "\n"
    )
    refused("r.csv", words="r.csv: line 2: found")
    (tmp_path / "r.csv").write_text("")
    refused("r.csv", words="r.csv: is empty")
    write(tmp_path / "r.csv", returns, commanded=False)
    write(tmp_path / "c.csv", [("P1", COMMANDS["P1"]), ("P1", COMMANDS["P1"])], commanded=False)
    refused("r.csv", "--commanded", "c.csv", words="stands twice")
    write(tmp_path / "c.csv", [("P9", COMMANDS["P1"])], commanded=False)
    refused("r.csv", "--commanded", "c.csv", words="P9 has a command, but no returns")


def result(folder):
    write(folder / "returns.csv", draw())
    return "repeatability", "returns.csv", "-o", "r.json"


RESULTS = {"kr5-repeatability/1": result}

DAMAGED = [("repeatability", "repeatability returns.csv -o out.json", "poses", ("returns.csv",), ("out.json",), 2)]
