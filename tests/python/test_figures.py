"""The table of figures that `./tools/run bench --write` keeps."""

import importlib.util
import json
import sys

import pytest

from conftest import ROOT

sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "tools/benchmarks")]

import comparison
import figures

BENCHES = {
    "tags": figures.Bench("Tags", "all of it"),
    "sweep": figures.Bench("Sweep", "the grid", command="by hand"),
}


FIGURES = ("first", "second", "third")


def row(what: str, reached: bool = True) -> dict:
    return comparison.plain_row(comparison.Row(what, "1 | 2", "0", reached))


@pytest.fixture(autouse=True)
def files(tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "DATA", tmp_path / "figures.json")
    monkeypatch.setattr(figures, "PAGE", tmp_path / "figures.md")
    monkeypatch.setattr(figures.load_rows, "__defaults__", (tmp_path / "figures.json",))


def test_a_run_replaces_the_rows_of_its_bench_alone():
    figures.update_rows("sweep", [row("ratio", reached=False)], "2026-01-01", BENCHES)
    figures.update_rows("tags", [row("found"), row("time")], "2026-01-02", BENCHES)
    figures.update_rows("tags", [row("seen")], "2026-01-03", BENCHES)
    data = figures.load_rows()
    assert list(data) == ["tags", "sweep"]
    assert [r["what"] for r in data["tags"]["rows"]] == ["seen"] and data["tags"]["date"] == "2026-01-03"
    page = figures.PAGE.read_text()
    assert "`./tools/run bench tags`, measured 2026-01-03. Seen while developing: all of it." in page
    assert "| seen | 1 \\| 2 | – | – | 0 | yes |" in page
    assert "`by hand`, measured 2026-01-01" in page and "| 0 | **no** |" in page


def test_printed_rows_are_handed_on_when_asked_for(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv(comparison.ROWS_FILE, str(tmp_path / "rows.jsonl"))
    comparison.print_comparisons([comparison.Row("a", "1", "2", True)])
    comparison.print_comparisons([comparison.Row("b", "1", "2", False)])
    rows = [json.loads(line) for line in (tmp_path / "rows.jsonl").read_text().splitlines()]
    assert [(r["what"], r["reached"]) for r in rows] == [("a", True), ("b", False)]


def load_bench():
    spec = importlib.util.spec_from_file_location("bench", ROOT / "tools/benchmarks/__main__.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_group_prints_what_answers_its_figures_in_their_order(tmp_path, capsys):
    rows = [
        comparison.plain_row(comparison.Row("second data", "3 mm", "2 mm", False, figure="second")),
        comparison.plain_row(
            comparison.Row("first data", "1 mm", "2 mm", True, "peer 4 mm", figure="first", ratio=4.0)
        ),
        comparison.plain_row(comparison.Row("other data", "1 mm", "2 mm", True)),
    ]
    comparison.print_figures("Figures", ("first", "second", "third"), rows)
    lines = [line for line in capsys.readouterr().out.splitlines() if line.strip()]
    first, second, third = (next(k for k, line in enumerate(lines) if line.split()[:1] == [w]) for w in FIGURES)
    assert first < second < third
    assert "peer 4 mm" in lines[first] and lines[first].split()[-1] == "4" and " yes " in lines[first]
    assert " NO " in lines[second] and "not measured" in lines[third]
    assert not any("other data" in line for line in lines)


def test_every_figure_of_a_group_is_answered_by_a_bench_of_it():
    module = load_bench()
    for group in module.GROUPS.values():
        assert set(group.benches) <= set(module.BENCHES)
        sources = [
            file.read_text() for name in group.benches for file in (ROOT / "tools/benchmarks").glob(f"{name}*.py")
        ]
        for figure in group.figures:
            name = figure.removeprefix("UR5 ").removeprefix("WAM ")
            assert any(f'"{name}"' in text or f' {name}"' in text for text in sources), figure


def test_a_ratio_stands_behind_the_peer():
    entry = {
        "what": "time",
        "ours": "1 s",
        "peers": "4 s",
        "interval": "–",
        "wanted": "2 s",
        "reached": True,
        "ratio": 4.0,
    }
    page = figures.render_section("tags", {"date": "2026-01-01", "rows": [entry]}, BENCHES["tags"])
    assert "| time | 1 s | 4 s; 4 times ours |" in page


def test_the_page_in_the_checkout_is_that_of_its_data(monkeypatch):
    module = load_bench()
    data = json.loads((figures.DOC / "benchmarks.json").read_text())
    assert set(data) <= set(module.BENCHES)
    assert (figures.DOC / "benchmarks.md").read_text() == figures.render_page(data, module.BENCHES)
