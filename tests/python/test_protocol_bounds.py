"""Numbers of a protocol or a map that would fill the memory or make no motion: refused with the place."""

import kr5.cell
import numpy as np
import pytest
from kr5.logs.values import Series, low_pass

from kr5_tools.simulation import protocol_file

HOME = "format: kr5-protocol/1\nhome: [0.0, 0.02, -2.75, 0.0, -0.3, 1.571]\nexperiments:\n"
BAD = [
    ("motion", "signal: fourier, duration: 1.0e+9"),
    ("motion", "signal: fourier, duration: 1.0e-300"),
    ("motion", "signal: fourier, duration: 0.02"),
    ("motion", "signal: fourier, duration: .nan"),
    ("motion", "signal: fourier, harmonics: 1000000000"),
    ("motion", "signal: fourier, harmonics: 2.5"),
    ("motion", "signal: fourier, speed: 0"),
    ("motion", "signal: fourier, reach: -1"),
    ("motion", "signal: fourier, start: [0]"),
    ("motion", "signal: fourier, start: null"),
    ("motion", "signal: way_points, speed: 1.0e-300"),
    ("motion", "signal: way_points, pause: .inf"),
    ("motion", "signal: way_points, count: 1.0e+9"),
    ("motion", "signal: one_by_one, swing: 0"),
    ("motion", "signal: [fourier]"),
    ("motion", "signal: {a: 1}"),
    ("poses", "count: 0"),
    ("poses", "count: true"),
    ("views", "near: .inf"),
    ("scan", "points: -5"),
    ("scan", "speeds: 0.1"),
    ("scan", "speeds: []"),
    ("step", "heights: [[0.1]]"),
    ("step", "rest: -1"),
    ("press", "speeds: [0]"),
    ("press", "speeds: [1.0e-6], depth: 10"),
    ("profile", "rows: 1"),
    ("profile", "tilts: [0.1]"),
    ("profile", "cx: 5"),
]


@pytest.fixture(scope="module")
def arm(share):
    return kr5.cell.load_cell(share / "cells" / "kr5_arc.yaml")


def refusal(call):
    with pytest.raises(kr5.IoError) as end:
        call()
    return str(end.value)


@pytest.mark.parametrize("kind, parameters", BAD)
def test_bad_parameters_are_refused(arm, tmp_path, kind, parameters):
    file = tmp_path / "protocol.yaml"
    file.write_text(f"{HOME}- {{name: one, kind: {kind}, split: fit, {parameters}}}\n")
    said = refusal(lambda: protocol_file.load_protocol(file, arm, 1))
    assert str(file) in said and "\n" not in said


def test_a_cell_in_which_a_motion_takes_forever_is_named(arm, tmp_path):
    slow = kr5.cell.parse_cell(arm.to_yaml(), "cell.yaml")
    servo = slow.servo
    servo.cycle = 1e-9
    slow.servo = servo
    file = tmp_path / "protocol.yaml"
    file.write_text(f"{HOME}- {{name: one, kind: motion, split: fit, signal: way_points}}\n")
    assert "servo.cycle" in refusal(lambda: protocol_file.load_protocol(file, slow, 1))


@pytest.mark.parametrize("t", [np.arange(20.0), np.append(np.arange(100.0), 1e12)])
def test_what_cannot_be_smoothed_is_refused(t):
    series = Series(t, np.zeros((len(t), 1)))
    assert "map.yaml: resample.low_pass" in refusal(lambda: low_pass(series, 0.1, "map.yaml"))
