"""Outputs: written beside and renamed, all or none, through links and into devices, and never over what a command
reads.
"""

import errno
import json
import os
import resource
import shutil
import stat
import subprocess
import sys
import threading
from pathlib import Path

import kr5.rsi
import kr5.vision
import numpy as np
import pytest
import typer
from kr5.files import writing
from kr5.files.inputs import is_read
from kr5.logs.log_file import read_log

from arm_logs import STATES, state, written_bag
from command_runner import run_command
from kr5_tools.pages.rendering import script_json


@pytest.fixture
def cell_file(share, tmp_path):
    return shutil.copy(share / "cells" / "kr5_arc.yaml", tmp_path / "cell.yaml")


def only(folder, *names):
    """The folder holds these files and no temporary one."""
    return sorted(f.name for f in folder.iterdir()) == sorted(names)


def test_a_file_is_replaced_whole_and_keeps_its_rights(tmp_path):
    file = tmp_path / "a.txt"
    file.write_text("old")
    file.chmod(0o640)
    writing.write_text("new", file)
    assert file.read_text() == "new" and stat.S_IMODE(file.stat().st_mode) == 0o640 and only(tmp_path, "a.txt")


def test_a_failure_leaves_the_old_file_and_no_other(tmp_path):
    file = tmp_path / "a.png"
    file.write_bytes(b"old")
    with pytest.raises(KeyboardInterrupt), writing.beside(file) as new:
        new.write_bytes(b"half")
        raise KeyboardInterrupt
    assert file.read_bytes() == b"old" and only(tmp_path, "a.png")


def test_two_writers_do_not_share_a_temporary_file(tmp_path):
    file = tmp_path / "a.txt"
    with writing.beside(file) as one, writing.beside(file) as two:
        one.write_text("one")
        two.write_text("two")
        assert one != two
    assert file.read_text() == "one" and only(tmp_path, "a.txt")


def test_a_link_is_followed(tmp_path):
    (tmp_path / "there").mkdir()
    link = tmp_path / "link.txt"
    link.symlink_to("there/real.txt")
    writing.write_text("new", link)
    assert link.is_symlink() and (tmp_path / "there" / "real.txt").read_text() == "new"


def test_links_in_a_circle_and_folders_are_refused(tmp_path):
    circle = tmp_path / "circle"
    circle.symlink_to("circle")
    for target in (circle, tmp_path):
        with pytest.raises(kr5.FileError, match="cannot be written") as ended:
            writing.write_text("new", target)
        assert ended.value.file == target
    assert circle.is_symlink()


def test_what_is_no_regular_file_is_written_to_and_stays(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()))
    reader.start()
    writing.write_text("new", pipe)
    reader.join()
    assert read == ["new"] and stat.S_ISFIFO(pipe.stat().st_mode) and only(tmp_path, "pipe")


def test_a_full_disk_is_said_with_the_name_of_the_file(tmp_path, monkeypatch):
    def no_space(*_):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    file = tmp_path / "a.txt"
    file.write_text("old")
    monkeypatch.setattr("pathlib.Path.write_bytes", no_space)
    with pytest.raises(kr5.FileError, match="a.txt: cannot be written: No space left on device"):
        writing.write_text("new", file)
    assert file.read_text() == "old"
    assert only(tmp_path, "a.txt")


RENDER = """\
camera: {width: 320, height: 240, fx: 300, fy: 300, cx: 159.5, cy: 119.5}
targets: [{target: "chessboard:3x4:0.03", T_camera_target: [-0.04, -0.03, 0.4, 0.2, 0.1, 0.1]}]
options: {noise: 4, seed: 4}
"""


def limit_size():
    """Files of this process cannot grow beyond a few kilobytes, as on a disk that is full."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))


@pytest.mark.parametrize(
    "words",
    [
        ("target", "print", "--target", "chessboard:6x9:0.025", "-o", "old.png"),
        ("target", "print", "--target", "chessboard:6x9:0.025", "-o", "old.pdf"),
        ("cell", "show", "cell.yaml", "-o", "old.png"),
        ("render", "scene.yaml", "-o", "old.png"),
    ],
    ids=lambda w: f"{w[0]} {w[-1]}",
)
def test_a_picture_that_cannot_be_written_leaves_the_old_one(cell_file, tmp_path, words):
    (tmp_path / "scene.yaml").write_text(RENDER)
    (tmp_path / words[-1]).write_bytes(b"old")
    command = [sys.executable, "-m", "kr5_tools", *words]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, preexec_fn=limit_size)
    assert done.returncode == 2 and "Traceback" not in done.stderr, done.stderr
    assert f"{words[-1]}: cannot be written" in " ".join(done.stderr.split())
    assert (tmp_path / words[-1]).read_bytes() == b"old" and only(tmp_path, "cell.yaml", "scene.yaml", words[-1])
    assert subprocess.run(command, cwd=tmp_path, capture_output=True).returncode == 0
    assert (tmp_path / words[-1]).stat().st_size > 3000


def test_an_image_of_the_library_is_written_whole_or_not_at_all(tmp_path):
    code = (
        "import sys, numpy, resource, kr5, kr5.vision\n"
        "image = numpy.random.default_rng(1).integers(0, 255, (200, 200)).astype(numpy.uint8)\n"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (3000, 3000))\n"
        "try: kr5.vision.save_image(image, 'old.png')\n"
        "except kr5.IoError as error: sys.exit(f'{error}')\n"
    )
    (tmp_path / "real.png").write_bytes(b"old")
    (tmp_path / "old.png").symlink_to("real.png")
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 1 and "old.png: cannot be written" in done.stderr, done.stderr
    assert (tmp_path / "real.png").read_bytes() == b"old" and only(tmp_path, "old.png", "real.png")
    kr5.vision.save_image(np.zeros((4, 4), np.uint8), str(tmp_path / "old.png"))
    assert (tmp_path / "old.png").is_symlink() and (tmp_path / "real.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(kr5.IoError, match="extension"):
        kr5.vision.save_image(np.zeros((4, 4), np.uint8), str(tmp_path / "old.none"))
    assert only(tmp_path, "old.png", "real.png")


def test_files_of_a_command_appear_together_or_not_at_all(tmp_path):
    def two_files(*, fail):
        with writing.held_back():
            writing.write_text("1", tmp_path / "one")
            writing.write_text("2", tmp_path / "two")
            assert not (tmp_path / "one").exists()
            if fail:
                raise typer.Exit(2)

    with pytest.raises(typer.Exit):
        two_files(fail=True)
    assert only(tmp_path)
    two_files(fail=False)
    assert only(tmp_path, "one", "two")


def test_an_output_that_was_there_stays_when_another_cannot_be_written(kr5_here, cell_file, tmp_path):
    if not Path("/dev/full").exists():
        pytest.skip("needs /dev/full, a device on which there is never room")
    assert kr5_here("cell", "export", cell_file, "-o", "robot.urdf").exit_code == 0
    (tmp_path / "out.yaml").write_text("kept")
    done = kr5_here("cell", "import", "robot.urdf", "-o", "out.yaml", "--json", "/dev/full")
    assert done.exit_code == 2 and "/dev/full: cannot be written: No space left on device" in done.stderr
    assert (tmp_path / "out.yaml").read_text() == "kept" and only(tmp_path, "cell.yaml", "out.yaml", "robot.urdf")


def test_a_new_folder_is_complete_or_not_there(tmp_path):
    folder = tmp_path / "recording"
    with pytest.raises(KeyboardInterrupt), writing.folder_beside(folder) as new:
        writing.write_text("1", new / "one.csv")
        raise KeyboardInterrupt
    assert only(tmp_path)
    with writing.held_back(), writing.folder_beside(folder) as new:
        (new / "images").mkdir()
        writing.write_text("1", new / "images" / "one.csv")
    assert (folder / "images" / "one.csv").read_text() == "1" and only(tmp_path, "recording")
    with pytest.raises(kr5.FileError, match="exists already"), writing.folder_beside(folder):
        pass
    assert (folder / "images" / "one.csv").read_text() == "1"


INPUT_IS_OUTPUT = [
    ("cell", "export", "cell.yaml", "-o", "{}"),
    ("cell", "show", "cell.yaml", "--json", "{}"),
    ("replay", "cell.yaml", "-o", "{}"),
    ("insert", "--cell", "cell.yaml", "--json", "{}"),
    ("recording", "guess", "log.csv", "--cell", "cell.yaml", "-o", "{}"),
    ("sweep", "insertion", "--cell", "cell.yaml", "--json", "{}"),
]


@pytest.mark.parametrize("words", INPUT_IS_OUTPUT, ids=lambda w: " ".join(w[:2]))
@pytest.mark.parametrize("other", ["cell.yaml", "link.yaml", "folder/../cell.yaml"])
def test_an_output_is_no_input(kr5_here, cell_file, tmp_path, words, other):
    before = (tmp_path / "cell.yaml").read_bytes()
    (tmp_path / "log.csv").write_text("t,q1\n1,2\n")
    (tmp_path / "folder").mkdir()
    (tmp_path / "link.yaml").symlink_to("cell.yaml")
    done = kr5_here(*(word.format(other) for word in words))
    assert done.exit_code == 2 and "is an input of this command" in done.stderr
    assert (tmp_path / "cell.yaml").read_bytes() == before


@pytest.mark.parametrize(
    "words",
    [
        ("report", "in.json", "-o", "in.json"),
        ("render", "in.json", "-o", "a.png", "--truth", "in.json"),
        ("calibrate", "tool", "in.json", "-o", "in.json"),
        ("calibrate", "timed", "in.json", "in.json", "-o", "in.json"),
        ("calibrate", "camera", "in.json", "--target", "chessboard:4x5:0.03", "-o", "in.json"),
        ("calibrate", "map", "in.json", "--camera", "in.json", "--size", "0.1", "-o", "in.json"),
        ("scene", "run", "in.json", "--csv", "in.json"),
        ("record", "--cell", "in.json", "--protocol", "in.json", "-o", "new", "--json", "in.json"),
        ("recording", "import", "in.json", "--map", "in.json", "-o", "new", "--json", "in.json"),
        ("cell", "import", "in.json", "-o", "in.json"),
        ("cell", "show", "in.json", "-o", "a.png", "--json", "a.png"),
    ],
    ids=lambda w: " ".join(w[:2]),
)
def test_no_command_writes_over_what_it_reads(kr5_here, tmp_path, words):
    (tmp_path / "in.json").write_text("{}")
    done = kr5_here(*words)
    assert done.exit_code == 2 and (
        "is an input of this command" in done.stderr or "the file of two outputs" in done.stderr
    ), done.stderr
    assert (tmp_path / "in.json").read_text() == "{}"


def test_a_hand_eye_folder_keeps_its_poses(kr5_here, share, tmp_path):
    folder = tmp_path / "demo"
    shutil.copytree(share / "data" / "demo", folder)
    before = (folder / "poses.csv").read_bytes()
    done = kr5_here("calibrate", "hand-eye", folder, "-o", folder / "poses.csv")
    assert (
        done.exit_code == 2
        and "is an input of this command" in done.stderr
        and (folder / "poses.csv").read_bytes() == before
    )


# Commands that are given a folder, and a file of it that they read.
FOLDER_IS_INPUT = [
    (("gap", "measure", "monday", "--json"), "monday/motion-1.csv"),
    (("gap", "diagnose", "monday", "-o"), "monday/recording.yaml"),
    (("gap", "plan", "monday", "-o"), "monday/cell.yaml"),
    (("gap", "explain", "monday", "--json"), "monday/motion-4.csv"),
    (("gap", "cases", "days", "--json"), "days/monday/motion-1.csv"),
    (("replay", "monday", "--json"), "monday/motion-1.csv"),
    (("cell", "check", "monday", "--json"), "monday/cell.yaml"),
    (("cell", "show", "monday", "-o"), "monday/cell.yaml"),
    (("identify", "dynamics", "monday", "-o"), "monday/motion-1.csv"),
    (("identify", "payload", "monday", "-o"), "monday/recording.yaml"),
    (("calibrate", "tool", "touches", "-o"), "touches/touches.csv"),
    (("calibrate", "laser", "scan", "--target", "sphere:0.02", "--cloud"), "scan/profiles.csv"),
    (("recording", "import", "bag", "--map", "map.yaml", "-o", "new", "--json"), "bag/bag.db3"),
    (("recording", "guess", "bag", "--cell", "monday/cell.yaml", "-o"), "bag/bag.db3"),
    (("sensitivity", "model.py:f", "--inputs", "inputs.yaml", "--json"), "model.py"),
    (("gap", "explain", "inputs.yaml", "--recording", "monday", "--json"), "monday/motion-1.csv"),
    (("report", "inputs.yaml", "--recording", "monday", "-o"), "monday/recording.yaml"),
    (("calibrate", "cell", "demo", "-o"), "demo/poses.csv"),
    (("calibrate", "cell", "demo", "--json"), "demo/camera.yaml"),
    (("calibrate", "cell", "demo", "--dataset", "monday/dataset.yaml", "-o"), "monday/dataset.yaml"),
    (("calibrate", "cell", "demo", "--scan", "scan", "-o"), "scan/profiles.csv"),
    (("calibrate", "cell", "demo", "--camera", "monday/camera.yaml", "-o"), "monday/camera.yaml"),
    (("repeatability", "demo", "-o"), "demo/images/view_01.png"),
]


@pytest.mark.parametrize(
    "words, file", FOLDER_IS_INPUT, ids=lambda value: " ".join(value[:2]) if isinstance(value, tuple) else ""
)
def test_no_command_writes_over_a_file_of_the_folder_that_it_reads(kr5_here, share, tmp_path, words, file):
    shutil.copytree(share / "data/friction", tmp_path / "monday")
    shutil.copytree(share / "data/friction", tmp_path / "days/monday")
    shutil.copytree(share / "data/touches", tmp_path / "touches")
    shutil.copytree(share / "data/demo", tmp_path / "demo")
    for name in ("dataset.yaml", "camera.yaml"):
        shutil.copy(share / "data/demo" / name, tmp_path / "monday")
    for name in ("scan/profiles.csv", "bag/metadata.yaml", "bag/bag.db3", "map.yaml", "inputs.yaml", "model.py"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("kept")
    (tmp_path / "link").symlink_to(file)
    before = (tmp_path / file).read_bytes()
    for output in (file, "link"):
        done = kr5_here(*words, output)
        assert done.exit_code == 2 and f"{output}: is an input of this command" in done.stderr, done.output
        assert (tmp_path / file).read_bytes() == before


def test_a_result_in_the_folder_that_was_read_may_be_written_again(kr5_here, share, tmp_path):
    shutil.copytree(share / "data/friction", tmp_path / "monday")
    for _ in range(2):
        assert kr5_here("gap", "measure", "monday", "--json", "monday/gap.json").exit_code == 0
    (tmp_path / "bag").mkdir()
    for name, text, read in (
        ("gap.json", (tmp_path / "monday/gap.json").read_text(), False),
        ("page.html", "<html>", False),
        ("info.json", '{"fps": 50}', True),
        ("bag.db3", "rows", True),
    ):
        (tmp_path / "bag" / name).write_text(text)
        assert is_read(tmp_path / "bag" / name, tmp_path / "bag") == read
    assert not is_read(tmp_path / "bag/new.yaml", tmp_path / "bag")


@pytest.mark.parametrize("text", ["", ".", "..", "/", "./", "../..", "x" * 300, "y/" * 3000, "nul\\0"])
def test_texts_of_a_recording_that_name_no_file_hold_none(text, tmp_path):
    folder = tmp_path / "monday"
    folder.mkdir()
    (tmp_path / "beside.csv").write_text("t")
    for name in ("own.csv", "motion.csv"):
        (folder / name).write_text("t")
    (folder / "recording.yaml").write_text(f'note: "{text}"\nfile: motion.csv\n')
    assert is_read(folder / "motion.csv", folder) and is_read(folder / "recording.yaml", folder)
    assert not is_read(folder / "own.csv", folder) and not is_read(tmp_path / "beside.csv", folder)


def test_names_with_brackets_are_shown_as_they_are(kr5_here, cell_file, tmp_path):
    odd = tmp_path / "[bold]x[" / "red].yaml"
    odd.parent.mkdir()
    shutil.move(cell_file, odd)
    for words in (("cell", "check", odd), ("cell", "show", odd), ("cell", "export", odd, "-o", "[a].urdf")):
        done = kr5_here(*words)
        assert done.exit_code == 0, done.output
    assert "[bold]x[/red].yaml" in kr5_here("cell", "check", odd).stdout
    odd.write_text("format: [bold]")
    done = kr5_here("cell", "check", odd)
    assert done.exit_code == 2 and "[bold]x[/red].yaml" in done.stdout


@pytest.mark.parametrize("name", ["<!--<script>", "</script>", "a\u2028b", "<b>"])
def test_a_name_ends_no_script(name):
    text = script_json({"name": name})
    assert "<" not in text and json.loads(text) == {"name": name}


def test_a_name_that_is_no_utf_8_is_read_and_told(run_kr5, share, tmp_path):
    file = os.fsencode(tmp_path) + b"/z\xff.yaml"
    shutil.copy(share / "cells" / "kr5_arc.yaml", file)
    for words in (("cell", "check"), ("cell", "show")):
        done = run_kr5(*words, os.fsdecode(file), "--json", "out.json")
        assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr
        json.loads((tmp_path / "out.json").read_text())
    os.rename(file, os.fsencode(tmp_path) + b"/z\xff.png")
    done = run_kr5("detect", os.fsdecode(os.fsencode(tmp_path) + b"/z\xff.png"), "--family", "36h11")
    assert done.returncode == 2 and done.stderr.startswith("error:") and "Traceback" not in done.stderr


ODD = os.fsdecode(b"z\xff")  # in the name of every input
ODD_INPUTS = [
    ("gap", "measure", ODD, "--json", "m.json", "--png", "m.png"),
    ("gap", "measure", f"{ODD}.csv", "--model", f"{ODD}.urdf"),
    ("gap", "measure", f"{ODD}.parquet", "--model", f"{ODD}.urdf"),
    ("gap", "measure", f"{ODD}.db3", "--model", f"{ODD}.urdf"),
    ("gap", "measure", f"{ODD}-bag", "--model", f"{ODD}.urdf"),
    ("replay", ODD, "-o", f"{ODD}.html"),
    ("cell", "export", f"{ODD}.yaml", "--original", f"{ODD}.urdf", "-o", f"{ODD}-new.urdf"),
    ("cell", "import", f"{ODD}.xml", "-o", f"{ODD}-new.yaml"),
    ("rsi", "files", f"{ODD}-link.xml", "-o", f"{ODD}-new"),
    ("report", f"{ODD}.json", "-o", f"{ODD}-page.html"),
]


@pytest.fixture(scope="module")
def odd_inputs(share, tmp_path_factory):
    """A recording, a log in several forms, models of its arm, a link and a result: of names that are no UTF-8."""
    rosbags = pytest.importorskip("rosbags.typesys", reason="pip install 'kr5[bags]'")
    parquet = pytest.importorskip("pyarrow.parquet", reason="pip install 'kr5[parquet]'")
    import pyarrow

    folder = tmp_path_factory.mktemp("odd")
    shutil.copytree(share / "data/friction", folder / ODD)
    for name in ("arm.urdf", "joint_states.csv"):
        shutil.copy(share / "data/arm_log" / name, folder / f"{ODD}{Path(name).suffix}")
    for words in (
        ("cell", "import", f"{ODD}.urdf", "-o", f"{ODD}.yaml"),
        ("cell", "export", f"{ODD}.yaml", "-o", f"{ODD}.xml"),
        ("gap", "measure", ODD, "-o", f"{ODD}.json"),
    ):
        done = run_command(*words, cwd=folder)
        assert done.returncode == 0, done.stderr
    (folder / f"{ODD}-link.xml").write_text(kr5.rsi.layout_xml(kr5.rsi.usual_layout("krc4")))
    log = read_log(folder / f"{ODD}.csv")
    with (folder / f"{ODD}.parquet").open("wb") as stream:
        parquet.write_table(pyarrow.table({name.replace("/", "."): v for name, v in log.columns.items()}), stream)
    ros = rosbags.get_typestore(rosbags.Stores.ROS2_HUMBLE)
    joints = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
    columns = [f"/joint_states/{joint}_joint" for joint in joints]
    q, tau = (np.column_stack([log.columns[f"{c}/{what}"] for c in columns]) for what in ("position", "effort"))
    times = log.columns["__time"]
    rows = [("/joint_states", t, state(ros, t, [f"{j}_joint" for j in joints], *now)) for t, *now in zip(times, q, tau)]
    written_bag(folder / "bag", ros, STATES, rows)
    shutil.copy(next((folder / "bag").glob("*.db3")), folder / f"{ODD}.db3")
    (folder / "bag").rename(folder / f"{ODD}-bag")
    return folder


@pytest.mark.parametrize("words", ODD_INPUTS, ids=lambda words: os.fsencode(" ".join(words[:3])).decode("latin1"))
def test_inputs_of_names_that_are_no_utf_8_are_read_in_every_form(run_kr5, odd_inputs, tmp_path, words):
    for file in odd_inputs.iterdir():
        (tmp_path / file.name).symlink_to(file)
    done = run_kr5(*words)
    assert done.returncode == 0 and "Traceback" not in done.stderr, done.stderr


KILLED = """
import os
import signal
from kr5.files import writing

def kill(*_):
    os.kill(os.getpid(), signal.SIGKILL)

with writing.held_back():
    writing.write_text("new", "a")
    with writing.beside("b") as new:
        new.write_text("ne")
        if {before}:
            kill()
        new.write_text("new")
    put, done = writing._put, []
    def stop(*files):
        if done:
            kill()
        done.append(files)
        put(*files)
    writing._put = stop
"""


@pytest.mark.parametrize("before, left", [(True, ["old", "old"]), (False, ["new", "old"])])
def test_a_process_that_is_killed_leaves_whole_files(tmp_path, before, left):
    for name in ("a", "b"):
        (tmp_path / name).write_text("old")
    done = subprocess.run([sys.executable, "-c", KILLED.format(before=before)], cwd=tmp_path, check=False)
    assert done.returncode == -9
    assert [(tmp_path / name).read_text() for name in ("a", "b")] == left


def test_files_are_written_although_nobody_reads_what_is_said(share, tmp_path):
    words = ["gap", "measure", str(share / "data/friction"), "--json", str(tmp_path / "gap.json")]
    with subprocess.Popen([sys.executable, "-m", "kr5_tools", *words], stdout=subprocess.PIPE) as process:
        process.stdout.close()  # as `| head` does once it has its lines
        assert process.wait(timeout=60) == 0
    assert json.loads((tmp_path / "gap.json").read_text())["format"].startswith("kr5-gap")
