"""Tables in the terminal: whatever the width, every number is there as a whole."""

import re

import pytest
from rich.console import Console

from kr5_tools.cli.tables import make_table, print_result

HEADS = ["column", "gap [-]", "limit of noise [N m s/rad]", "RMS", "noise", "what it depends on"]
ROWS = [
    ["motion-1.i6", "4.126", "1.054", "1.98e-05", "-0.000020", "the velocity of joint 6, and the temperature"],
    ["a name that is quite long", "16.2", "1.033", "0.124", "0.03", "time"],
]


def shown(table, width):
    console = Console(width=width, markup=False, emoji=False, highlight=False)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


@pytest.mark.parametrize("width", [24, 40, 60, 80, 200])
def test_no_number_is_cut_at_any_width(width):
    text = shown(make_table("Gap", HEADS, ROWS, text=(5,)), width)
    words = text.split()
    for row in ROWS:
        for number in row[1:5]:
            assert number in words
    assert "…" not in text and max(map(len, text.splitlines())) <= width
    for word in " ".join(row[5] for row in ROWS).split():
        assert word in words


def test_a_unit_stays_in_one_line():
    for width in (24, 60, 80):
        assert "[N m s/rad]" in shown(make_table("Gap", HEADS, ROWS, text=(5,)), width)


def test_what_does_not_fit_stands_below_with_the_first_column_again():
    text = shown(make_table("Gap", ["name", *(f"column {i}" for i in range(30))], [["here", *map(str, range(30))]]), 80)
    assert len(re.findall(r"^ here ", text, re.MULTILINE)) >= 2
    assert all(str(i) in text.split() for i in range(30))


def test_every_part_of_a_split_table_has_its_key_columns():
    heads = ["effect", "target", *(f"column {i}" for i in range(20))]
    rows = [["friction", f"joint{k}", *map(str, range(20))] for k in (1, 2)]
    text = shown(make_table("", heads, rows, text=(1,), keys=2), 80)
    parts = text.split("\n\n")
    assert len(parts) > 1 and all(re.findall(r"^ friction +joint[12] ", part, re.MULTILINE) for part in parts)
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("width", [24, 80])
def test_a_number_wider_than_the_terminal_is_broken_and_not_cut(width):
    long = ", ".join(f"{k}.25" for k in range(40))
    text = shown(make_table("", ["noise", "std"], [["torque", long], ["force", "0.15"]]), width)
    assert max(map(len, text.splitlines())) <= width
    assert "".join(text.split()) == "noisestdtorque" + long.replace(" ", "") + "force0.15"


def test_empty_columns_are_left_out():
    text = shown(make_table("", ["name", "none", "dash", "value"], [["a", "", "–", "1"], ["b", "", "–", "2"]]), 80)
    assert text.split() == ["name", "value", "a", "1", "b", "2"]


def test_a_table_without_rows_keeps_its_heads():
    assert shown(make_table("", ["name", "value"], []), 80).split() == ["name", "value"]


def test_marks_in_texts_are_shown_as_they_are():
    assert "[bold]x[/bold] :B:" in shown(make_table("", ["[a] b", "t"], [["[bold]x[/bold] :B:", "1"]]), 80)


def test_the_verdict_comes_before_the_numbers():
    data = {
        "verdict": {"word": "doubtful", "text": "One view is off."},
        "causes": [{"cause": "outlier_views", "text": "a.png contradicts the others.", "remedy": "Check it."}],
        "figures": [{"name": "x", "value": 1.0, "std": 0.1, "unit": "mm", "corrected": [2.0, 0.01]}],
    }
    console = Console(width=80, markup=False)
    with console.capture() as capture:
        print_result(data, console)
    lines = [line for line in capture.get().splitlines() if line.strip()]
    assert lines[0] == "Doubtful: One view is off." and "outlier views: a.png" in lines[1]
    assert lines[-1].split() == ["x", "1.00", "0.10", "2.000", "0.010", "mm"]
