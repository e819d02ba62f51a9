"""The frame of the command `kr5`: flags from field lists, complaints, result files. Commands have tests of their
own."""

import importlib
import json
import math
import re
import subprocess
import sys

import kr5
import numpy as np
import pytest
import typer
import typer.main
from kr5.files import images, results, writing
from kr5.logs import map_file
from typer.testing import CliRunner

from conftest import ROOT
from kr5_tools import app as command_line
from kr5_tools.cli import numbers, tables
from kr5_tools.cli.options import options_from


def run(command, *args):
    app = typer.Typer(cls=command_line.CleanErrors)
    app.command("go")(command)
    app.callback()(lambda: None)
    return CliRunner().invoke(app, ["go", *args])


@options_from(kr5.FitReport, skip=("message",))
def show(options: kr5.FitReport) -> None:
    print(json.dumps(options.to_dict()))


def test_every_field_is_a_flag_and_what_is_not_given_keeps_the_default_of_the_struct():
    done = run(show, "--status", "converged", "--final-rms", "1.5")
    assert json.loads(done.stdout) == {**kr5.FitReport().to_dict(), "status": "converged", "final_rms": 1.5}


@options_from(kr5.calibration.ToolOptions, skip=("previous",))
@options_from(kr5.FitReport, skip=("message",), argument="report")
def show_two(options: kr5.calibration.ToolOptions, report: kr5.FitReport) -> None:
    print(json.dumps([options.min_rotation, report.final_rms]))


def test_a_command_takes_the_flags_of_two_structs():
    assert json.loads(run(show_two, "--final-rms", "1.5", "--min-rotation", "0.5").stdout) == [0.5, 1.5]


def test_two_structs_cannot_share_a_flag():
    with pytest.raises(ValueError, match="duplicate"):
        options_from(kr5.FitReport, skip=("message",))(lambda options, iterations: None)


@pytest.mark.parametrize(
    "files, names",
    [
        (["/x/a/1.png", "/x/a/2.png"], ["1.png", "2.png"]),
        (["/x/a/1.png", "/x/b/1.png", "/2.png"], ["a/1.png", "b/1.png", "2.png"]),
        (["1.png", "../1.png", "./1.png"], ["c/1.png", "b/1.png", "c/1.png"]),
        (["/1.png", "/a/1.png"], ["1.png", "a/1.png"]),
        ([], []),
    ],
)
def test_short_names_tell_files_apart(files, names, monkeypatch, tmp_path):
    (tmp_path / "b/c").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "b/c")
    assert images.short_names(files) == names


def test_help_shows_flag_unit_choices_and_default():
    text = " ".join(run(show, "--help").stdout.split())
    for words in ("--final-rms", "[-]", "converged|max_iterations", "(default: 0.0)"):
        assert words in text
    assert "--message" not in text


def test_a_flag_of_the_wrong_type_is_refused_with_exit_code_2():
    assert run(show, "--iterations", "many").exit_code == 2
    assert run(show, "--status", "nope").exit_code == 2


def test_a_field_no_flag_can_give_must_be_left_out_by_name():
    with pytest.raises(TypeError, match="points is of type numpy.ndarray"):
        options_from(kr5.View)(lambda options: None)


@pytest.mark.parametrize(
    "error", [kr5.InvalidArgument("sigma: [px] negative"), kr5.IoError("a.yaml: gone"), OSError("disk full")]
)
def test_bad_input_is_one_line_on_standard_error_with_exit_code_2(error):
    def command() -> None:
        raise error

    done = run(command)
    assert (done.exit_code, done.stdout, done.stderr) == (2, "", f"error: {error}\n")


def test_a_bug_is_not_hidden_as_bad_input():
    def command() -> None:
        raise ZeroDivisionError

    assert isinstance(run(command).exception, ZeroDivisionError)


def test_help_is_quick_because_it_imports_neither_the_library_nor_numpy():
    code = (
        "import sys; sys.argv = ['kr5', '--help']\nfrom kr5_tools.app import main\n"
        "try: main()\nexcept SystemExit: pass\nassert not {'kr5', 'numpy', 'matplotlib'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)


def leaf_commands():
    """Every command of the whole tree with the words that call it; groups are walked through."""

    def walk(command, words):
        if children := getattr(command, "commands", None):
            for name, child in children.items():
                yield from walk(child, (*words, name))
        else:
            yield words, command

    return dict(walk(typer.main.get_command(command_line.make_app()), ()))


LEAVES = leaf_commands()


@pytest.mark.parametrize(
    ("words", "unused"),
    [(("report",), ("scipy", "numpy", "matplotlib")), (("calibrate", "tool"), ("scipy", "matplotlib"))],
)
def test_help_loads_nothing_that_it_does_not_need(words, unused):
    command = [sys.executable, "-X", "importtime", "-m", "kr5_tools", *words, "--help"]
    loaded = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    assert "kr5_tools.app" in loaded
    assert not [name for name in unused if re.search(rf"\| +{name}$", loaded, re.MULTILINE)]


WITHOUT_JSON = {
    ("gap", "bench"): "starts a program of its own, and hands every option on to it",
    ("job", "release"): "writes who released a stop into the database; `kr5 job show --json` tells the state",
}


def test_the_tree_of_commands_is_walked():
    assert {words[0] for words in LEAVES} == set(command_line.COMMANDS)
    assert {("gap", "explain"), ("calibrate", "camera"), ("report",)} <= set(LEAVES)


@pytest.mark.parametrize("words", LEAVES, ids=" ".join)
def test_every_command_has_help_an_example_and_json(words):
    command = LEAVES[words]
    assert command.help and command.help.strip()
    assert re.match(rf"Examples?: +kr5 .*\b{words[-1]}\b", command.epilog or ""), command.epilog
    options = {flag for parameter in command.params for flag in parameter.opts}
    assert ("--json" in options) == (words not in WITHOUT_JSON)


def test_the_help_of_a_command_shows_its_example(run_kr5):
    for words in (("report",), ("gap", "explain"), ("sweep", "insertion")):
        done = run_kr5(*words, "--help")
        assert done.returncode == 0 and "Example: kr5 " + " ".join(words) in " ".join(done.stdout.split()), done.stderr


def test_help_fills_its_lines_and_keeps_those_of_an_example(run_kr5):
    shown = run_kr5("recording", "import", "--help").stdout
    lines = [line.strip() for line in shown.splitlines()]
    first = lines.index("format: kr5-map/1")
    example = map_file.EXAMPLE.splitlines()
    copied = [line[1:].rstrip() for line in shown.splitlines()[first : first + len(example)]]
    assert copied == example  # line by line, to be copied
    assert (ROOT / re.search(r"All keys: (\S+\.md)", shown)[1]).is_file()
    told = next(k for k, line in enumerate(lines) if line.startswith("Logs with missing numbers"))
    assert all(len(line) > 60 for line in lines[told : told + 3])  # of 80
    assert "pip install 'kr5[rerun]'" in " ".join(re.sub("[│ ]+", " ", run_kr5("replay", "--help").stdout).split())


def test_every_command_is_attacked_with_damaged_files(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tests/fuzz/commands"))
    inputs = importlib.import_module("inputs")
    attacked = {words for words in LEAVES for job in inputs.JOBS if tuple(job.words()[: len(words)]) == words}
    assert attacked | set(inputs.WITHOUT_JOB) == set(LEAVES)
    assert not attacked & set(inputs.WITHOUT_JOB) and all(inputs.WITHOUT_JOB.values())


def test_a_group_without_help_is_named(monkeypatch):
    monkeypatch.setitem(command_line.COMMANDS, "measure", {"gap": command_line.CommandEntry("gap.command", "Gap.")})
    with pytest.raises(ValueError, match="'measure' has no entry in GROUP_HELP"):
        command_line.make_app()


def test_version_is_that_of_the_library(run_kr5):
    assert run_kr5("--version").stdout == f"kr5 {kr5.__version__}\n"


def test_a_result_file_is_read_back_and_says_what_made_it(tmp_path):
    file = tmp_path / "r.json"
    results.write_result(
        file, "kr5-camera/1", result=kr5.Pinhole(fx=500.0), figures=[tables.figure_row("fx", math.nan, None, "px")]
    )
    data = results.read_result(file, "kr5-camera/1")
    assert data["version"] == kr5.__version__ and data["result"]["fx"] == 500.0
    assert data["figures"][0]["value"] is None  # JSON has no NaN
    assert list(tmp_path.iterdir()) == [file]


def test_a_failed_write_leaves_the_old_file(tmp_path):
    file = tmp_path / "r.json"
    file.write_text("old")
    with pytest.raises(RuntimeError):
        writing.write_json({"a": Unwritable()}, file)
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]


class Unwritable:
    def __str__(self):
        raise RuntimeError


@pytest.mark.parametrize(
    "text, complaint",
    [("{", "is not valid JSON"), ('{"format": "x"}', "format: found 'x', expected that of a result"), ("[]", "format")],
)
def test_what_is_no_result_file_is_named(tmp_path, text, complaint):
    file = tmp_path / "r.json"
    file.write_text(text)
    with pytest.raises(kr5.FileError) as caught:
        results.read_result(file)
    assert caught.value.file == file and complaint in str(caught.value)


def test_pose_figures_agree_with_a_monte_carlo_of_the_covariance():
    rng = np.random.default_rng(5)
    A = rng.normal(size=(6, 6)) * 1e-3
    covariance = A @ A.T
    T = kr5.to_pose(np.array([0.1, 0.2, 0.3, 0.4, -0.5, 2.0]))
    drawn = [kr5.to_xyzrpy(T @ kr5.to_pose(d)) for d in rng.multivariate_normal(np.zeros(6), covariance, 4000)]
    expected = np.std(drawn, axis=0) * ([1e3] * 3 + [180 / np.pi] * 3)
    std = [f["std"] for f in tables.pose_figures("camera", T, covariance)]
    assert np.allclose(std, expected, rtol=4 / math.sqrt(2 * 4000))  # four deviations of a sample deviation


@pytest.mark.parametrize(
    "value, std, text", [(12.3456, 0.123, "12.35"), (1234.5, 20.0, "1234"), (0.5, None, "0.5"), (math.nan, 1.0, "–")]
)
def test_numbers_show_as_many_digits_as_their_doubt_allows(value, std, text):
    assert numbers.format_number(value, std) == text
