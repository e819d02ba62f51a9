"""The Python surface that is made from field lists: every struct and every enumeration, found by looking."""

import copy
import importlib
import inspect
import json
import pickle
import pkgutil

import kr5
import numpy as np
import pytest

MODULES = [kr5] + [
    importlib.import_module(f"kr5.{m.name}") for m in pkgutil.iter_modules(kr5.__path__) if m.name[0] != "_"
]
CLASSES = {c for module in MODULES for _, c in inspect.getmembers(module, inspect.isclass)}
STRUCTS = sorted((c for c in CLASSES if hasattr(c, "fields")), key=str)
ENUMS = sorted((c for c in CLASSES if hasattr(c, "__members__") and c.__module__.startswith("kr5._kr5")), key=str)


@pytest.fixture(params=STRUCTS, ids=lambda c: c.__name__)
def struct(request):
    return request.param


def other_value(field):
    """A value of the field's type that is not its default; None for types that have no obvious one."""
    if field["choices"]:
        return next(c for c in field["choices"] if c != field["default"])
    kind = field["type"].removesuffix(" | None")
    simple = {
        "bool": lambda d: not d,
        "int": lambda d: (d or 0) + 3,
        "float": lambda d: (d or 0.0) + 0.5,
        "str": lambda d: f"{d or ''}x",
    }
    return simple[kind](field["default"]) if kind in simple else None


def test_there_are_structs_and_enumerations_to_test():
    assert {"FitReport", "Pinhole", "View"} <= {c.__name__ for c in STRUCTS}
    assert "FitStatus" in {c.__name__ for c in ENUMS}


def test_every_field_reads_back_what_was_written_and_touches_no_other(struct):
    defaults = struct().to_dict()
    for field in struct.fields():
        value = other_value(field)
        if value is None:
            continue
        name = field["name"]
        for made in (struct(**{name: value}), struct.from_dict({name: value})):
            assert made.to_dict() == {**defaults, name: value}
        changed = struct()
        setattr(changed, name, value)
        assert changed.to_dict() == {**defaults, name: value}
        read = getattr(changed, name)
        assert str(read) == value if field["choices"] else read == value


def test_every_field_takes_its_own_value_back(struct):
    value = struct()
    for field in struct.fields():
        setattr(value, field["name"], getattr(value, field["name"]))
    assert value.to_dict() == struct().to_dict()


def test_every_struct_survives_json_pickle_and_copy(struct):
    fields = {f["name"]: v for f in struct.fields() if (v := other_value(f)) is not None}
    value = struct(**fields)
    plain = value.to_dict()
    assert struct.from_dict(json.loads(json.dumps(plain))).to_dict() == plain
    assert pickle.loads(pickle.dumps(value)).to_dict() == plain
    assert copy.deepcopy(value).to_dict() == plain


def test_every_field_is_documented_in_class_and_property(struct):
    for field in struct.fields():
        assert field["doc"] and field["name"] in struct.__doc__
        assert inspect.getdoc(getattr(struct, field["name"])) == field["doc"]


def test_unit_and_meaning_of_a_field_stand_apart_and_a_covariance_says_of_what_it_is(struct):
    names = {field["name"] for field in struct.fields()}
    for field in struct.fields():
        assert field["meaning"] and "[" not in field["meaning"]
        assert field["unit"] == "" or f"[{field['unit']}]" in field["doc"]
        for owner in field["covariance_of"]:
            whole, _, part = owner.partition(".")
            assert whole in names - {field["name"]}
            assert not part or hasattr(getattr(struct(), whole), part)


def test_an_unknown_keyword_names_the_nearest_field(struct):
    name = struct.fields()[0]["name"]
    with pytest.raises(TypeError, match="no field"):
        struct(**{f"{name}_zzz": 1})


def test_the_nearest_field_is_offered():
    with pytest.raises(TypeError, match="did you mean 'final_rms'"):
        kr5.FitReport(final_rmss=1.0)


@pytest.mark.parametrize("enum", ENUMS, ids=lambda c: c.__name__)
def test_every_enumerator_round_trips_by_name_and_number(enum):
    assert enum.__members__
    for value in enum.__members__.values():
        assert enum(str(value)) == value
        assert enum(int(value)) == value
        assert pickle.loads(pickle.dumps(value)) == value


def test_an_unknown_enumerator_lists_those_there_are():
    with pytest.raises(
        ValueError, match=r"FitReport.status: found 'nope', expected one of converged \| max_iterations"
    ):
        kr5.FitReport(status="nope")


def test_a_value_of_the_wrong_type_names_the_field():
    with pytest.raises(TypeError, match="FitReport.iterations: expected int, found 1.5"):
        kr5.FitReport(iterations=1.5)
    with pytest.raises(TypeError, match=r"View.points: expected an array of numbers of shape \(3, n\)"):
        kr5.View(points=np.zeros((2, 4)))


def test_a_pose_is_a_4x4_array_and_must_be_rigid():
    T = kr5.from_xyzrpy([1, 2, 3, 0.1, 0.2, 0.3])
    assert T.shape == (4, 4)
    assert np.allclose(kr5.to_xyzrpy(T), [1, 2, 3, 0.1, 0.2, 0.3])
    for bad in (np.eye(3), np.diag([1.0, 1, -1, 1]), np.diag([2.0, 2, 2, 1]), np.full((4, 4), np.nan)):
        with pytest.raises(ValueError, match="a pose is a 4x4 array"):
            kr5.to_vector(bad)


def test_arrays_of_a_struct_cannot_be_changed_behind_its_back():
    view = kr5.View(points=np.zeros((3, 4)))
    with pytest.raises(ValueError, match="read-only"):
        view.points[0, 0] = 1


def test_exceptions_are_python_ones_too():
    with pytest.raises(kr5.InvalidArgument, match="width"):
        kr5.Pinhole().validate()
    assert issubclass(kr5.InvalidArgument, kr5.Error) and issubclass(kr5.InvalidArgument, ValueError)
    assert issubclass(kr5.IoError, kr5.Error) and issubclass(kr5.IoError, OSError)


def test_project_and_rays_are_inverse():
    camera = kr5.Pinhole(width=640, height=480, fx=500, fy=510, cx=320, cy=240, k1=-0.1)
    points = np.array([[0.1, -0.2, 0.3, 0.2], [0.05, 0.1, 0.2, 0.1], [1.0, 1.0, 1.0, 1.0]])
    assert np.allclose(camera.rays(camera.project(points)), points)


def test_vision_is_imported_on_first_use_only():
    import subprocess
    import sys

    code = (
        "import sys, kr5, kr5.calibration; assert 'kr5._kr5_vision' not in sys.modules; kr5.vision; assert"
        " 'kr5._kr5_vision' in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_exceptions_of_the_vision_extension_are_those_of_kr5():
    with pytest.raises(kr5.Error):
        kr5.vision.load_image("no-such-image.png")
