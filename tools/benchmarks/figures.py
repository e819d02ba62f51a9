"""The table of figures: `share/doc/benchmarks.json` holds the rows last measured, `share/doc/benchmarks.md` shows them.

`./tools/run bench --write` replaces the rows of the benches that ran; the others stay as they are.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

DOC = Path(__file__).resolve().parents[2] / "share/doc"
DATA, PAGE = DOC / "benchmarks.json", DOC / "benchmarks.md"

HEAD = """# Figures

Written by `./tools/run bench --write`, which measures libkr5 beside other software on the same input and replaces the
rows of the benches that ran. Each section says how to measure it again, when it was measured, and what of its data was
seen while the library was developed: such data can flatter, fresh data cannot. Times are those of one machine: read
ratios, not milliseconds. Intervals cover 95 %.
"""


@dataclass(frozen=True)
class Bench:
    """A bench, the text of its section and the arguments of its program."""

    title: str
    seen: str  # what of its data was seen while developing
    arguments: tuple[str, ...] = ()
    quick: tuple[str, ...] = ()  # arguments of a short run
    command: str = ""  # of figures that a person measures
    remarks: str = ""  # why figures fall short, where that is known

    def shown_command(self, name: str) -> str:
        return self.command or f"./tools/run bench {name}"


@dataclass(frozen=True)
class Group:
    """Benches that together answer a table of wanted figures; their rows name the figure they answer."""

    title: str
    benches: tuple[str, ...]
    figures: tuple[str, ...]


def load_rows(file: Path = DATA) -> dict[str, dict[str, Any]]:
    """Of each bench: `date` and `rows`."""
    return dict(json.loads(file.read_text(encoding="utf-8"))) if file.is_file() else {}


def update_rows(name: str, rows: list[dict[str, Any]], date: str, benches: dict[str, Bench]) -> None:
    """Replaces the rows of one bench, in the data and on the page."""
    data = load_rows() | {name: {"date": date, "rows": rows}}
    ordered = {key: data[key] for key in benches if key in data}
    DATA.write_text(json.dumps(ordered, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    PAGE.write_text(render_page(ordered, benches), encoding="utf-8")


def render_page(data: dict[str, dict[str, Any]], benches: dict[str, Bench]) -> str:
    return "\n".join([HEAD, *(render_section(name, entry, benches[name]) for name, entry in data.items())])


def render_section(name: str, entry: dict[str, Any], bench: Bench) -> str:
    head = ("what", "kr5", "best other", "difference or rate, 95 %", "wanted", "reached")
    rows = [
        (r["what"], r["ours"], shown_peers(r), r["interval"], r["wanted"], "yes" if r["reached"] else "**no**")
        for r in entry["rows"]
    ]
    lines = [f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in row)} |" for row in rows]
    remarks = f"\n{bench.remarks}\n" if bench.remarks else ""
    return (
        f"## {bench.title}\n\n`{bench.shown_command(name)}`, measured {entry['date']}. Seen while developing:"
        f" {bench.seen}.\n\n| {' | '.join(head)} |\n|{'---|' * len(head)}\n" + "\n".join(lines) + f"\n{remarks}"
    )


def shown_peers(row: dict[str, Any]) -> str:
    """What others reach, with its ratio to ours where one was measured."""
    ratio = row.get("ratio")
    return str(row["peers"]) if ratio is None else f"{row['peers']}; {ratio:.3g} times ours"
