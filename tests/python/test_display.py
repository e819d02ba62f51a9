"""What results show of themselves at the prompt and in a notebook."""

import importlib
import inspect
import pickle
import pkgutil
import pydoc
import re
import sys
from html.parser import HTMLParser

import kr5
import kr5.cell
import kr5.gap
import kr5.picking
import kr5.sim
import kr5.vision
import numpy as np
import pytest
from kr5 import calibration
from kr5._display import fields_of


class Tables(HTMLParser):
    """Rows of the tables of a page, and whether its elements are closed in order."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.open = [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] in ("td", "th"):
            self.rows[-1][-1] += data


def classes():
    """Every class of kr5 that can be made without arguments, and some results."""
    for name, module in sorted(sys.modules.items()):
        if re.match(r"kr5\._kr5", name):
            for cls in vars(module).values():
                if inspect.isclass(cls) and hasattr(cls, "_repr_html_"):
                    yield cls


def hand_eye_result():
    covariance = np.diag([1e-8, 4e-8, 9e-8, 1e-6, 1e-6, 1e-6])
    return calibration.HandEyeResult(
        T_mount_camera=kr5.to_pose([0.0123456, 0.05, 0.1, 0, 0, np.pi / 2]),
        covariance=covariance,
        views=[calibration.HandEyeViewReport(name=f"view {k}", rms_px=0.1 * k) for k in range(20)],
        fit=kr5.FitReport(status="converged"),
    )


def test_every_class_shows_itself():
    shown = 0
    for cls in classes():
        try:
            item = cls()
        except (TypeError, kr5.InvalidArgument):
            continue
        text = repr(item)
        assert text.startswith(cls.__name__ + "(") and text.endswith(")") and " object at 0x" not in text
        assert all(len(line) < 1500 for line in text.splitlines())
        Tables(item._repr_html_())
        shown += 1
    assert shown > 200


def test_a_small_array_is_shown_and_a_large_one_with_its_shape():
    view = kr5.View(name="a", points=np.arange(12.0).reshape(3, 4) / 7, pixels=np.zeros((2, 200)))
    text = repr(view)
    assert "points=[[      0, 0.14286, 0.28571, 0.42857],\n" in text
    assert "pixels=array 2 x 200: [[0, 0, …, 0, 0], [0, 0, …, 0, 0]]" in text


def test_a_short_struct_stands_on_one_line():
    assert repr(kr5.FitReport(status="converged", iterations=3, final_rms=0.98765432)) == (
        "FitReport(status='converged', iterations=3, initial_rms=0, final_rms=0.987654, message='not run')"
    )


def test_rounding_left_of_a_zero_is_a_zero_but_a_small_number_is_not():
    result = hand_eye_result()
    text = repr(result)
    assert "[0, -1, 0, 0.012346]" in re.sub(r" +", " ", text).replace("[ ", "[")
    assert "1e-08" in text and "4e-08" in text


def test_a_long_list_tells_its_length():
    assert "views=[20 x HandEyeViewReport]" in repr(hand_eye_result())
    assert "(9 in all)" in repr(kr5.View(ids=list(range(9))))


def test_a_notebook_shows_figures_with_uncertainty_unit_and_meaning():
    head, *below = Tables(hand_eye_result()._repr_html_()).rows
    rows = {row[0]: row for row in below}
    assert head == ["field", "value", "± std", "unit", "meaning"]
    # T_mount_camera turns the axes of the camera by a quarter: its y is the x of the flange.
    assert rows["T_mount_camera x"][1:4] == ["0.01235", "0.00020", "m"]
    assert rows["T_mount_camera y"][1:4] == ["0.05000", "0.00010", "m"]
    assert rows["T_mount_camera yaw"][1:4] == ["1.5708", "0.0010", "rad"]
    assert "covariance" not in rows
    assert rows["sigma_pixel"][1:] == ["0", "", "px", "Noise of a detected point, given or estimated."]
    assert rows["view 11"][:2] == ["view 11", "1.1"] and "view 12" not in rows


def test_the_numbers_of_a_camera_have_their_uncertainty():
    covariance = np.zeros((12, 12))
    covariance[0, 0], covariance[3, 3] = 0.25, 0.01
    camera = kr5.Pinhole(width=640, height=480, fx=500.123, cy=240)
    calibrated = kr5.vision.CameraCalibration(camera=camera, covariance=covariance)
    rows = {row[0]: row for row in Tables(calibrated._repr_html_()).rows}
    assert rows["camera.fx"][1:4] == ["500.12", "0.50", "px"]
    assert rows["camera.cy"][1:4] == ["240.00", "0.10", "px"]
    assert "camera.fy" not in rows  # held


def test_numbers_that_a_covariance_names_have_their_uncertainty():
    covariance = np.diag([1e-8, 4e-8, 9e-8, 16e-8])
    lengths = calibration.ParallelPlaneLengths(a1=0.15, a2=0.6, a3=0.12, b4=0.62, covariance=covariance)
    rows = {row[0]: row for row in Tables(lengths._repr_html_()).rows}
    assert rows["a1"][1:4] == ["0.15000", "0.00010", "m"] and rows["b4"][1:4] == ["0.62000", "0.00040", "m"]
    assert "covariance" not in rows
    scanner = calibration.ScannerResult(covariance=np.diag([1e-8] * 6))
    assert "covariance" not in {row[0] for row in Tables(scanner._repr_html_()).rows}


def test_a_verdict_and_causes_stand_first():
    cause = kr5.gap.Cause(
        effect="payload",
        target="tool",
        probability=0.99,
        parameters=[kr5.gap.ParameterEstimate(name="mass", value=[0.2617], std=[0.0012], unit="kg")],
    )
    text = kr5.gap.Diagnosis(verdict="partly_explained", causes=[cause])._repr_html_()
    assert text.index("<b>partly explained</b>") < text.index("<table>")
    assert "<details open><summary><b>causes (1)</b>" in text
    assert ["payload", "tool", "0.99", "mass 0.2617 ± 0.0012 kg", "0", ""] in Tables(text).rows
    names = [f.name for f in fields_of(kr5.gap.Diagnosis())]
    empty = [name for name in names if getattr(kr5.gap.Diagnosis(), name) in ([], "", None)]
    assert "where" in empty and not [name for name in empty if name != "causes" and f">{name}<" in text]
    assert text.index("causes (1)") < min(text.index(f">{name}<") for name in names if f">{name}<" in text)
    diagnosis = calibration.HandEyeDiagnosis(verdict="doubtful", text="Because 1 < 2.")
    assert "<b>doubtful</b>: Because 1 &lt; 2." in diagnosis._repr_html_()
    told = kr5.gap.Diagnosis(verdict="explained", causes=[cause], seconds=3.0, seconds_screening=1.0, spikes=2)
    shown = told._repr_html_()
    assert "Cause: " in shown and "spikes" in shown  # the sentence, and what is not zero
    for nothing in ("seconds", "next_experiment", "outliers", "clock_reset", "effects_limit"):
        assert nothing not in shown
    failed = hand_eye_result()
    failed.fit = kr5.FitReport(status="degenerate", message="one axis")
    assert "<b>not usable</b>: one axis" in failed._repr_html_()


def test_results_that_are_no_structs_show_their_properties(share):
    scene = kr5.sim.run_scene(share / "scenes/free_swing.yaml")
    assert re.match(r"SceneResult\(\n  passed=True,\n  steps=\d+,\n  checks=\[", repr(scene))
    rows = {row[0]: row for row in Tables(scene._repr_html_()).rows}
    assert rows["passed"][1] == "True"
    reading = kr5.sim.DrivenArm(kr5.cell.load_cell(share / "cells/kr5_arc.yaml")).read()
    assert "wrench=[" in repr(reading)
    assert {row[0]: row[2] for row in Tables(reading._repr_html_()).rows}["current"] == "A"


def test_an_insertion_shows_its_pegs(share):
    cell = kr5.cell.load_cell(share / "cells/kr5_arc.yaml")
    result = kr5.sim.run_insertion(cell, kr5.sim.InsertionSetup(clearance=0.0005, pegs=1))
    assert f"inserted={result.inserted}" in repr(result) and "pegs=[PegOutcome(" in repr(result)
    assert "<details open><summary><b>pegs (1)</b>" in result._repr_html_()


@pytest.mark.parametrize(
    "function",
    [calibration.calibrate_hand_eye, kr5.gap.diagnose, kr5.vision.find_target, kr5.sim.run_insertion],
)
def test_a_signature_names_its_default_options_on_one_line(function):
    """Else it could not be read, by people or by what writes the stubs."""
    assert re.search(r"= \w+Options\(\)|= InsertionSetup\(\)", function.__doc__.splitlines()[0])


def test_a_pose_with_its_uncertainty():
    values, std = kr5.xyzrpy_with_std(kr5.to_pose([1, 2, 3, 0, 0, np.pi / 2]), np.diag([1, 4, 9, 1e-4, 4e-4, 9e-4]))
    assert np.allclose(values, [1, 2, 3, 0, 0, np.pi / 2])
    assert np.allclose(std, [2, 1, 3, 1e-2, 2e-2, 3e-2], rtol=1e-5)


def public_functions():
    for info in pkgutil.iter_modules(kr5.__path__):
        if not info.name.startswith("_"):
            module = importlib.import_module(f"kr5.{info.name}")
            yield from ((module, name) for name, item in vars(module).items() if is_public_function(name, item))
    yield from ((kr5, name) for name, item in vars(kr5).items() if is_public_function(name, item))


def is_public_function(name, item):
    return not name.startswith("_") and inspect.isroutine(item)


def test_help_and_inspect_tell_the_arguments_of_functions():
    count = 0
    for module, name in public_functions():
        function = getattr(module, name)
        assert "pybind11" not in pydoc.render_doc(function), (module, name)
        inspect.signature(function)
        count += 1
    assert count > 300
    shown = inspect.signature(kr5.gap.diagnose)
    assert list(shown.parameters) == ["recording", "simulator", "options", "progress"]
    assert str(shown.parameters["options"]) == "options=DiagnoseOptions()"
    help_text = pydoc.plain(pydoc.render_doc(calibration.calibrate_hand_eye))
    assert "function calibrate_hand_eye in module kr5.calibration" in help_text
    assert pickle.loads(pickle.dumps(kr5.to_pose)) is kr5.to_pose
    with pytest.raises(TypeError, match="to_pose"):
        kr5.to_pose("nothing", 3)
