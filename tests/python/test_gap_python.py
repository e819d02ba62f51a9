"""kr5.gap as people call it: a folder, and nothing else."""

import os

import kr5
import kr5.cell
import kr5.gap
import kr5.predict
import pytest


@pytest.fixture(scope="module")
def folder():
    return kr5.share("data/recording")


@pytest.fixture(scope="module")
def found(folder):
    """A diagnosis, and the progress that it told."""
    told = []
    return kr5.gap.diagnose(folder, progress=lambda stage, fraction: told.append((stage, fraction))), told


def names(causes):
    return {(cause.effect, cause.target) for cause in causes}


def test_a_folder_is_enough_for_a_diagnosis(found):
    diagnosis, told = found
    assert str(diagnosis.verdict) == "explained"
    assert names(diagnosis.causes) == {("stribeck_friction", "joint2"), ("tool_offset", "tool")}
    assert told and all(stage and 0 <= fraction <= 1 for stage, fraction in told)


def test_a_recording_and_a_simulator_give_the_same(folder, found):
    recording = kr5.cell.load_recording(folder)
    options = kr5.gap.DiagnoseOptions()
    again = kr5.gap.diagnose(recording, kr5.predict.FastSimulator(), options)
    assert [c.to_dict() for c in again.causes] == [c.to_dict() for c in found[0].causes]


@pytest.mark.parametrize("kind", [str, os.fsencode, lambda path: path], ids=["text", "bytes", "path"])
def test_a_path_in_any_form_is_measured(folder, kind):
    measured = kr5.gap.measure(kind(folder))
    assert measured.gap == kr5.gap.measure(kr5.cell.load_recording(folder), kr5.predict.FastSimulator()).gap > 6


def test_a_gap_of_another_cell_is_measured(folder, found):
    assert kr5.gap.measure(folder, cell=found[0].cell).gap < 1.1


def test_effects_are_named_as_on_the_command_line(folder, found):
    fits = kr5.gap.fit_effects(folder, ["coulomb_friction:joint2", "stribeck_friction:joint2"])
    assert [fit.effect for fit in fits] == ["stribeck_friction", "coulomb_friction"]
    name = kr5.gap.EffectName(effect="stribeck_friction", target="joint2")
    (left,) = kr5.gap.fit_effects(folder, [name, "payload:tool"], cell=found[0].cell)[:1]
    assert left.explained_fraction < 0.1  # the tuned cell has it
    best = kr5.gap.fit_best_effects(folder, except_=["tool_offset:tool"], most=1)
    assert best and best[0].effect != "tool_offset"


def test_a_plan_takes_the_same_names(folder):
    options = kr5.gap.PlanOptions()
    plan = kr5.gap.plan(
        folder, ["coulomb_friction:joint3", ["viscous_friction:joint3", "payload:tool"]], options=options
    )
    assert plan.experiments and plan.experiments[0].separation > 0
    compared = kr5.gap.compare_models(
        [folder, kr5.cell.load_recording(folder)], ["stribeck_friction:joint2", "payload:tool"]
    )
    assert compared.best == 0 and compared.probability[0] > 0.99


def test_ties_of_a_diagnosis_are_alternatives_of_a_plan(found):
    assert kr5.gap.tied_alternatives(found[0]) == []
    tie = kr5.gap.Cause(effect="payload", target="tool", tied_with=[kr5.gap.EffectName(effect="ft_bias", target="fz")])
    pairs = kr5.gap.tied_alternatives(kr5.gap.Diagnosis(causes=[tie]))
    assert [[(n.effect, n.target) for n in names] for names in pairs] == [[("payload", "tool")], [("ft_bias", "fz")]]


def test_residuals_and_their_parts_come_from_a_folder(folder):
    columns = kr5.gap.residual_columns(folder)
    parts = kr5.gap.gap_parts(folder, columns)
    assert columns and {"motion-1", "poses-2"} <= {part.name for part in parts}


@pytest.mark.parametrize(
    "call, error, words",
    [
        (lambda folder: kr5.gap.diagnose("nowhere"), kr5.IoError, "nowhere"),
        (lambda folder: kr5.gap.measure(folder / "cell.yaml"), kr5.IoError, "cell.yaml"),
        (lambda folder: kr5.gap.diagnose(None), TypeError, "None"),
        (lambda folder: kr5.gap.diagnose(3), TypeError, "recording"),
        (lambda folder: kr5.gap.measure(folder, 3), TypeError, "predict"),
        (
            lambda folder: kr5.gap.fit_effects(folder, ["payload"]),
            kr5.InvalidArgument,
            "'payload', expected effect:target",
        ),
        (lambda folder: kr5.gap.fit_effects(folder, [":tool"]), kr5.InvalidArgument, "effect:target"),
        (lambda folder: kr5.gap.fit_effects(folder, ["paylod:tool"]), kr5.InvalidArgument, "payload"),
        (lambda folder: kr5.gap.plan(folder, ["payload:tool"]), kr5.InvalidArgument, "at least two"),
    ],
)
def test_what_cannot_be_meant_is_refused(folder, call, error, words):
    with pytest.raises(error, match=words):
        call(folder)


def test_the_documentation_says_what_may_be_left_out():
    for function in (kr5.gap.diagnose, kr5.gap.measure, kr5.gap.fit_effects, kr5.gap.plan):
        assert "or the folder of one" in function.__doc__ and "simulator" in function.__doc__


def test_files_that_ship_are_found_and_others_are_not():
    assert kr5.share("cells/kr5_arc.yaml").is_file()
    assert kr5.share().is_dir() and (kr5.share() / "data/demo").is_dir()
    with pytest.raises(FileNotFoundError, match=r"cells/kr5\.yaml: no such file ships with kr5.*kr5_arc\.yaml"):
        kr5.share("cells/kr5.yaml")
