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


def test_the_page_in_the_checkout_is_that_of_its_data(monkeypatch):
    spec = importlib.util.spec_from_file_location("bench", ROOT / "tools/benchmarks/__main__.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    data = json.loads((figures.DOC / "benchmarks.json").read_text())
    assert set(data) <= set(module.BENCHES)
    assert (figures.DOC / "benchmarks.md").read_text() == figures.render_page(data, module.BENCHES)
