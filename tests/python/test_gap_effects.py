"""`kr5 gap effects`: every effect of the catalogue, as its row says it, and a picture of what it does."""

import json

import kr5.cell
import kr5.gap
import kr5.predict
import numpy as np
import pytest

from kr5_tools.gap import effect_pictures


@pytest.fixture(scope="module")
def cell(share):
    nominal = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    nominal.effects = {}
    return nominal


@pytest.fixture(scope="module")
def experiments(cell):
    return effect_pictures.standard_experiments(cell)


def test_every_effect_is_listed_as_its_row_says(run_kr5, tmp_path, torque_servo_effects):
    done = run_kr5("gap", "effects", "--json", "effects.json")
    assert done.returncode == 0, done.stderr
    rows = {row.id: row for row in kr5.cell.effect_catalogue()}
    listed = json.loads((tmp_path / "effects.json").read_text())
    assert [e["id"] for e in listed] == list(rows) and done.stdout.startswith(f"{len(rows)} effects")
    words = {word.rstrip(";") for word in done.stdout.split()}
    whole = run_kr5("gap", "effects", "--all").stdout
    for row in rows.values():
        assert words >= {word.rstrip(";") for word in f"{row.shows_in} {row.description}".split()}
        assert all(p.name in whole for p in row.parameters)
    assert done.stdout.count("where it shows") == 1  # the table is not divided
    for e in listed:
        row = rows[e["id"]]
        assert row.id in words and e["target"] == str(row.target)
        assert (e["description"], e["shows_in"], e["remedy"]) == (row.description, row.shows_in, row.remedy)
        assert [p["name"] for p in e["parameters"]] == [p.name for p in row.parameters]
        there = any(p["typical"] is not None for p in e["parameters"])
        assert there == bool(e["targets"])
    without = {e["id"] for e in listed if not e["targets"]}  # the shipped cell has no torque servos
    assert without == torque_servo_effects


def test_one_effect_is_told_with_its_size_bounds_and_remedy(run_kr5, tmp_path, cell):
    done = run_kr5("gap", "effects", "coulomb_friction", "--json", "one.json")
    told, row = " ".join(done.stdout.split()), kr5.cell.find_effect("coulomb_friction")
    for text in (row.shows_in, row.remedy, "joint1, joint2", "N m", row.parameters[0].description):
        assert text in told, told
    (parameter,) = json.loads((tmp_path / "one.json").read_text())["parameters"]
    nominal = cell.drives.friction.coulomb[0]
    assert parameter["nominal"] == nominal
    changed = kr5.gap.with_typical_effect(cell, "coulomb_friction", "joint1")
    assert parameter["typical"] == changed.effects.get("coulomb_friction", "joint1", "coulomb") > nominal
    assert f"{nominal:g}" in told and f"{parameter['typical']:.4g}" in told


def test_an_unknown_effect_is_refused_with_the_nearest(run_kr5, tmp_path):
    done = run_kr5("gap", "effects", "coulomb_frict", "--pictures", "pictures")
    assert done.returncode == 2 and "did you mean 'coulomb_friction'?" in done.stderr
    assert not (tmp_path / "pictures").exists()


def test_effects_that_a_cell_cannot_carry_have_no_target(run_kr5, tmp_path, share):
    text = (share / "cells/kr5_arc.yaml").read_text()
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    cell.tube = None
    kr5.cell.save_cell(cell, tmp_path / "cell.yaml")
    assert "tube" in text
    done = run_kr5("gap", "effects", "tube_tilt", "--cell", "cell.yaml", "--json", "e.json")
    assert done.returncode == 0 and json.loads((tmp_path / "e.json").read_text())["targets"] == []
    assert "Targets in this cell: none" in done.stdout


def test_the_value_of_a_cell_without_the_effect_has_that_head(run_kr5):
    shown = run_kr5("gap", "effects", "payload", width=300).stdout
    assert "parameter unit without the effect typical" in " ".join(shown.split())


@pytest.mark.parametrize(
    "effect, kind, column, variable",
    [
        ("coulomb_friction", "motion", "i", "velocity of joint"),
        ("payload", "motion", "t", "position of joint"),
        ("camera_focal", "views", ("u", "v"), "image coordinate"),
        ("tube_tilt", "profile", "z", "direction of the tilt"),
    ],
)
def test_a_picture_shows_the_effect_where_it_shows_most(cell, experiments, effect, kind, column, variable):
    picture = effect_pictures.picture_of(effect, cell, experiments)
    assert picture.kind == kind and picture.column.startswith(column) and variable in picture.variable_name
    without, with_effect = (np.sqrt(np.nanmean(r**2)) for r in (picture.without, picture.with_effect))
    assert without > 1.5 * with_effect
    rows = np.isfinite(picture.with_effect).sum()
    assert abs(with_effect - 1) < 5 / np.sqrt(2 * rows)  # what the effect leaves is noise
    assert len(picture.over) == len(picture.variable) == len(picture.without)


def test_no_picture_is_made_of_what_a_cell_cannot_show(cell, experiments):
    motions = [e for e in experiments if str(e.kind) == "motion"]
    assert effect_pictures.picture_of("camera_focal", cell, motions) is None


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_pictures_are_written_in_both_formats(run_kr5, tmp_path, ending):
    done = run_kr5("gap", "effects", "backlash", "--pictures", "new", "--format", ending)
    assert done.returncode == 0 and "new: 1 picture." in done.stdout, done.stderr
    data = (tmp_path / f"new/backlash.{ending}").read_bytes()
    assert data.startswith(b"\x89PNG" if ending == "png" else b"<?xml") and len(data) > 10000


def test_an_effect_that_moves_the_tool_shows_in_every_sensor_that_looks_from_there(cell, experiments):
    simulator = kr5.predict.FastSimulator()
    columns = {"poses": "y", "views": "u", "scan": "z"}
    seen = [e for e in experiments if str(e.kind) in columns]
    movers = [row.id for row in kr5.cell.effect_catalogue() if row.moves_tool]
    assert {str(e.kind) for e in seen} == set(columns)
    assert {"encoder_offset", "link_length", "transmission_error"} <= set(movers) and "tool_offset" not in movers
    for effect in movers:
        targets = cell.effect_targets(effect)
        moved = kr5.gap.with_typical_effect(cell, effect, "joint2" if "joint2" in targets else targets[0], 0.0, 3600.0)
        for e in seen:
            before, after = (np.asarray(simulator.predict(c, e)[columns[str(e.kind)]]) for c in (cell, moved))
            assert np.nanmax(np.abs(after - before)) > 0, (effect, e.name)
