"""`kr5 rsi files`: what a controller is given."""

import json

import pytest
from kr5 import rsi


def test_the_files_of_a_controller_are_those_of_the_library(run_kr5, tmp_path):
    words = ("--corrections", "cartesian", "--address", "10.0.0.7", "--port", 6008, "--name", "my_cell")
    limits = ("--translation-limit", 0.01, "--mode", "relative", "-o", "out", "--json", "out.json")
    done = run_kr5("rsi", "files", "--controller", "krc4", *words, *limits)
    assert done.returncode == 0, done.stderr
    layout = rsi.usual_layout("krc4", space="cartesian")
    layout.address, layout.port = "10.0.0.7", 6008
    made = rsi.controller_files(layout, rsi.ProgramOptions(name="my_cell", translation_limit=0.01, mode="relative"))
    assert len(made.files) == 3
    for file in made.files:
        assert (tmp_path / "out" / file.name).read_text() == file.text
        assert file.name in done.stdout
    assert "SensorInterface" in done.stdout
    out = json.loads((tmp_path / "out.json").read_text())
    assert out["address"] == "10.0.0.7" and [f["name"] for f in out["files"]] == [f.name for f in made.files]


def test_a_configuration_keeps_its_elements_and_its_address(run_kr5, tmp_path):
    layout = rsi.job_layout("krc4")
    layout.address, layout.port = "10.0.0.8", 6009
    (tmp_path / "link.xml").write_text(rsi.layout_xml(layout))
    done = run_kr5("rsi", "files", "link.xml", "-o", "out")
    assert done.returncode == 0, done.stderr
    kept = rsi.load_layout(str(tmp_path / "out" / "kr5_rsi_ethernet.xml"))
    assert kept.to_dict() == rsi.load_layout(str(tmp_path / "link.xml")).to_dict()
    assert "to be wired by hand" in done.stderr and "FT.Fx" in done.stderr


def test_numbers_that_nobody_confirms_are_told(run_kr5):
    done = run_kr5(
        "rsi", "files", "--controller", "krc2", "--corrections", "cartesian", "--address", "10.0.0.7", "-o", "out"
    )
    made = rsi.controller_files(rsi.usual_layout("krc2", space="cartesian"))
    assert made.unconfirmed and all(name in done.stderr for name in made.unconfirmed)


@pytest.mark.parametrize(
    "words, complaint",
    [
        (("-o", "out"), "LAYOUT.xml: is missing"),
        (("--controller", "krc4", "-o", "out"), "--address"),
        (("none.xml", "-o", "out"), "none.xml"),
        (("--controller", "krc2", "--address", "1.2.3.4", "--cycle", 0.004, "-o", "out"), "cycle"),
        (("--controller", "krc4", "--address", "1.2.3.4", "--name", "a b", "-o", "out"), "name"),
    ],
)
def test_bad_input_is_named_and_nothing_is_written(run_kr5, tmp_path, words, complaint):
    done = run_kr5("rsi", "files", *words)
    assert done.returncode == 2 and complaint in done.stderr
    assert not list(tmp_path.iterdir())


def test_a_configuration_is_not_overwritten(run_kr5, tmp_path):
    (tmp_path / "kr5_rsi_ethernet.xml").write_text(rsi.layout_xml(rsi.usual_layout("krc4")))
    done = run_kr5("rsi", "files", "kr5_rsi_ethernet.xml", "-o", ".")
    assert done.returncode == 2 and "is an input of this command" in done.stderr
