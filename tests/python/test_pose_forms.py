"""Poses as OpenCV, NumPy and programs of people write them, and the answer that each of them gives."""

import io
import json

import kr5
import numpy as np
import pytest
from kr5.tables.pose_list import read_pose_list

from test_hand_eye_pairs import X, check_place, pairs

NAMES = ("R_gripper2base", "t_gripper2base", "R_target2cam", "t_target2cam")


def matrix(values, indent):
    rows, cols = values.shape
    data = ", ".join(repr(float(v)) for v in values.ravel())
    return f"!!opencv-matrix\n{indent}rows: {rows}\n{indent}cols: {cols}\n{indent}dt: d\n{indent}data: [ {data} ]\n"


def as_yaml(content):
    """A FileStorage of matrices and of lists of matrices."""
    out = "%YAML:1.0\n---\nframeCount: 14\n"
    for name, value in content.items():
        if isinstance(value, list):
            out += f"{name}:\n" + "".join("   - " + matrix(v, " " * 6) for v in value)
        else:
            out += f"{name}: " + matrix(value, " " * 3)
    return out


def as_xml(content):
    def element(tag, values):
        rows, cols = values.shape
        data = " ".join(repr(float(v)) for v in values.ravel())
        inner = f"<rows>{rows}</rows>\n<cols>{cols}</cols>\n<dt>d</dt>\n<data>\n{data}</data>"
        return f'<{tag} type_id="opencv-matrix">{inner}</{tag}>\n'

    out = '<?xml version="1.0"?>\n<opencv_storage>\n<frameCount>14</frameCount>\n'
    for name, value in content.items():
        if isinstance(value, list):
            out += f"<{name}>" + "".join(element("_", v) for v in value) + f"</{name}>\n"
        else:
            out += element(name, value)
    return out + "</opencv_storage>\n"


def as_json(content):
    def entry(values):
        rows, cols = values.shape
        return {"type_id": "opencv-matrix", "rows": rows, "cols": cols, "dt": "d", "data": values.ravel().tolist()}

    return json.dumps({n: [entry(v) for v in c] if isinstance(c, list) else entry(c) for n, c in content.items()})


def numbered(robot, seen):
    out = {}
    for i, (T, M) in enumerate(zip(robot, seen, strict=True)):
        out |= {f"T1_{i}": T, f"T2_{i}": M}
    return out


def parts(robot, seen):
    """As cv::calibrateHandEye takes them."""
    lists = (
        [T[:3, :3] for T in robot],
        [T[:3, 3:] for T in robot],
        [M[:3, :3] for M in seen],
        [M[:3, 3:] for M in seen],
    )
    return dict(zip(NAMES, lists, strict=True))


def vectors(robot, seen):
    """The camera's before the robot's, rotations as vectors, and the robot's poses inverted."""

    def of(T):
        return np.array(kr5.to_vector(T)[3:]).reshape(3, 1)

    inverse = [np.linalg.inv(T) for T in robot]
    return {
        "rvec_target2cam": [of(M) for M in seen],
        "tvec_target2cam": [M[:3, 3:] for M in seen],
        "rvec_base2gripper": [of(T) for T in inverse],
        "tvec_base2gripper": [T[:3, 3:] for T in inverse],
    }


@pytest.mark.parametrize("content", [numbered, parts, vectors])
@pytest.mark.parametrize(("ending", "written"), [("yml", as_yaml), ("xml", as_xml), ("json", as_json)])
def test_matrices_of_opencv_give_the_camera(run_kr5, tmp_path, content, ending, written):
    (tmp_path / f"pairs.{ending}").write_text(written(content(*pairs())))
    done = run_kr5("calibrate", "hand-eye", f"pairs.{ending}", "--mount", "eye_in_hand", "-o", "r.json")
    assert done.returncode == 0, done.stderr
    data = json.loads((tmp_path / "r.json").read_text())
    check_place(data, X)
    assert data["input"]["source"] == "OpenCV"


def test_storage_that_holds_no_pairs_is_refused_with_what_it_holds(run_kr5, tmp_path):
    robot, seen = pairs(4)
    content = numbered(robot, seen)
    del content["T2_3"]
    unequal = parts(robot, seen) | {"t_gripper2base": [T[:3, 3:] for T in robot[:-1]]}
    for text, said in (
        (as_xml(content), "found the poses 4 named T1…, 3 named T2…; expected two families"),
        (as_xml(unequal), "found 4 R_gripper2base, but 3 t_gripper2base"),
        (as_xml({}), "found the poses none"),
        (as_xml(content).replace("<cols>4", "<cols>5", 1), "expected 4 x 5 numbers"),
        (as_xml(content).replace("</opencv_storage>", ""), "is not valid XML"),
        ('<!DOCTYPE a [<!ENTITY b "c">]>' + as_xml(content), "which OpenCV does not write"),
    ):
        (tmp_path / "pairs.xml").write_text(text)
        done = run_kr5("calibrate", "hand-eye", "pairs.xml", "--mount", "eye_in_hand")
        assert done.returncode == 2 and said in " ".join(done.stderr.split()), (said, done.stderr)


def of_two(one, other):
    """Numbered matrices of hand and target; each a map of numbers to matrices."""
    return {f"T1_{i}": T for i, T in one.items()} | {f"T2_{i}": T for i, T in other.items()}


def test_numbered_matrices_are_paired_by_their_numbers(run_kr5, tmp_path):
    robot, seen = (dict(enumerate(poses)) for poses in pairs())
    backwards = dict(reversed(seen.items()))
    (tmp_path / "pairs.xml").write_text(as_xml(of_two(robot, backwards)))
    words = ("calibrate", "hand-eye", "pairs.xml", "--mount", "eye_in_hand")
    done = run_kr5(*words, "-o", "r.json")
    assert done.returncode == 0, done.stderr
    check_place(json.loads((tmp_path / "r.json").read_text()), X)
    del robot[2], seen[1]
    rotations = {f"R_target2cam_{i}": T[:3, :3] for i, T in robot.items()}
    translations = {f"t_target2cam_{i}": T[:3, 3:] for i, T in seen.items()}
    for content, said in (
        (of_two(robot, seen), "found the numbers 1 of T1… alone and 2 of T2… alone"),
        (rotations | translations, "found the numbers 1 of R_target2cam… alone and 2 of t_target2cam… alone"),
        (of_two(robot, robot) | {"T1_01": robot[1]}, "T1_01: found number 1 of T1… twice"),
    ):
        (tmp_path / "pairs.xml").write_text(as_xml(content))
        done = run_kr5(*words)
        assert done.returncode == 2 and said in " ".join(done.stderr.split()), (said, done.stderr)


def test_names_of_matrices_are_no_patterns(run_kr5, tmp_path):
    names = ("R_hand(base", "t_hand(base", "R_target[cam", "t_target[cam")
    (tmp_path / "pairs.yml").write_text(as_yaml(dict(zip(names, parts(*pairs()).values(), strict=True))))
    done = run_kr5("calibrate", "hand-eye", "pairs.yml", "--mount", "eye_in_hand", "-o", "r.json")
    assert done.returncode == 0, done.stderr
    check_place(json.loads((tmp_path / "r.json").read_text()), X)


def test_matrices_that_are_no_poses_are_named(run_kr5, tmp_path):
    robot, seen = pairs(4)
    listed, inverse = parts(robot, seen), {f"base2gripper_{i}": T for i, T in enumerate(robot)}
    inverse |= {f"target2cam_{i}": M for i, M in enumerate(seen)}
    whole = as_yaml(numbered(robot, seen))
    first = repr(float(robot[0][0, 0]))
    short = [robot[0][:3, 3:], np.ones((1, 1)), *(T[:3, 3:] for T in robot[2:])]
    for ending, text, said in (
        ("yml", as_yaml(listed | {"t_gripper2base": short}), "t_gripper2base…: number 1 is 1 x 1, expected the three"),
        ("yml", as_yaml(inverse | {"base2gripper_1": np.ones((4, 4))}), "base2gripper…: number 1 has no inverse"),
        ("yml", whole.replace(first, ".inf", 1), "T1…: number 0 holds infinity"),
        ("yml", whole.replace(first, "9" * 400, 1), "T1_0: data: found something that is no number"),
        ("yml", whole.replace("rows: 4", "rows: .inf", 1), "T1_0: rows and cols: expected whole numbers"),
        ("yml", whole.replace("rows: 4", "rows: -1", 1), "T1_0: rows and cols: expected whole numbers"),
        ("json", as_json(listed).replace('"rows": 3', '"rows": 1e999', 1), "rows and cols: expected whole numbers"),
        ("xml", as_xml(listed).replace("<rows>3", "<rows>inf", 1), "found inf in rows, expected a whole number"),
        ("xml", as_xml(listed).replace("<rows>3", "<rows>nan", 1), "found nan in rows, expected a whole number"),
        ("xml", as_xml(listed).replace("<rows>3", "<rows>1e300", 1), "rows and cols: expected whole numbers"),
    ):
        (tmp_path / f"pairs.{ending}").write_text(text)
        done = run_kr5("calibrate", "hand-eye", f"pairs.{ending}", "--mount", "eye_in_hand")
        assert done.returncode == 2 and said in " ".join(done.stderr.split()), (said, done.stderr)


def lines(poses, separator=" ", between=""):
    return between.join("\n".join(separator.join(f"{v:.9f}" for v in row) for row in T) + "\n" for T in poses)


def printed(poses):
    return "\n".join(str(T) for T in poses) + "\n"


@pytest.mark.parametrize(
    ("ending", "written"),
    [
        ("txt", lines),
        ("txt", lambda poses: lines(poses, between="\n")),
        ("csv", lambda poses: lines(poses, ",")),
        ("txt", printed),
        ("txt", lambda poses: "\n".join(" ".join(map(repr, map(float, T.ravel()))) for T in poses)),
    ],
    ids=["rows", "blocks", "csv", "printed", "one line a matrix"],
)
def test_matrices_as_text_give_the_camera(run_kr5, tmp_path, ending, written):
    for name, poses in zip(("robot", "camera"), pairs(noise=1e-5), strict=True):
        (tmp_path / f"{name}.{ending}").write_text(written(poses))
    done = run_kr5(
        *("calibrate", "hand-eye", f"robot.{ending}", "--camera-poses", f"camera.{ending}"),
        *("--mount", "eye_in_hand", "-o", "r.json"),
    )
    assert done.returncode == 0, done.stderr
    check_place(json.loads((tmp_path / "r.json").read_text()), X)


def test_arrays_of_numpy_give_the_camera(run_kr5, tmp_path):
    robot, seen = map(np.array, pairs())
    np.save(tmp_path / "robot.npy", robot)
    np.save(tmp_path / "camera.npy", seen[:, :3])
    words = ("calibrate", "hand-eye", "robot.npy", "--camera-poses", "camera.npy", "--mount", "eye_in_hand")
    done = run_kr5(*words, "-o", "r.json")
    assert done.returncode == 0, done.stderr
    check_place(json.loads((tmp_path / "r.json").read_text()), X)
    np.save(tmp_path / "camera.npy", np.ones((4, 5)))
    done = run_kr5(*words)
    assert done.returncode == 2 and "found an array of shape (4, 5), expected N x 4 x 4" in done.stderr


def saved(array):
    stream = io.BytesIO()
    np.save(stream, array)
    return stream.getvalue()


def zipped(array):
    stream = io.BytesIO()
    np.savez(stream, array)
    return stream.getvalue()


WHOLE = saved(pairs(5)[0])
ARRAYS = {
    "empty": (b"", "cannot be read as NPY"),
    "an archive": (zipped(np.eye(4)), "cannot be read as NPY"),
    "cut off in the header": (WHOLE[:40], "cannot be read as NPY"),
    "cut off in the numbers": (WHOLE[:-9], "cannot be read as NPY"),
    "an open bracket": (WHOLE.replace(b"(5, 4, 4)", b"(5, 4, 4 "), "cannot be read as NPY"),
    "a huge shape": (WHOLE.replace(b"(5, 4, 4)", b"(" + b"9" * 7 + b",)"), "cannot be read as NPY"),
    "objects": (saved(np.array([None, 1])), "cannot be read as NPY"),
    "no pose": (saved(np.zeros((0, 4, 4))), "found an array of shape (0, 4, 4)"),
    "no row": (saved(np.zeros((0, 16))), "found an array of shape (0, 16)"),
    "one number": (saved(1.0), "found an array of shape ()"),
    "a matrix": (saved(np.eye(4)), "found an array of shape (4, 4)"),
    "turned": (saved(np.zeros((4, 4, 5))), "found an array of shape (4, 4, 5)"),
    "words": (saved(np.array([["1"] * 16])), "found an array of <U1, expected numbers"),
}


@pytest.mark.parametrize("kind", ARRAYS)
def test_arrays_that_hold_no_poses_are_refused(kind, tmp_path):
    data, said = ARRAYS[kind]
    (tmp_path / "poses.npy").write_bytes(data)
    with pytest.raises(kr5.FileError, match="poses.npy") as refused:
        read_pose_list(tmp_path / "poses.npy")
    assert said in str(refused.value)


def test_every_byte_of_the_header_of_an_array_may_be_wrong(tmp_path):
    file = tmp_path / "poses.npy"
    for at in range(128):
        for value in (0x00, 0x28, 0x39, 0xFF):
            file.write_bytes(WHOLE[:at] + bytes([value]) + WHOLE[at + 1 :])
            try:
                assert len(read_pose_list(file).poses) == 5
            except kr5.IoError as error:
                assert "poses.npy" in str(error)
