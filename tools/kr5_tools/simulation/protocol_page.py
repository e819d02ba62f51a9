"""The page of a protocol (`kr5-protocol/1`): its experiments and what each asks for."""

import inspect
from pathlib import Path
from typing import Any

from kr5.files.documents import read_document
from kr5.files.result_types import ResultData

from kr5_tools.pages.tables_page import write_tables_page
from kr5_tools.simulation.protocol_file import EXPECTED, KINDS, ExperimentEntry, ProtocolFile


def write_page(source: Path, output: Path, png: Path | None) -> list[Path]:
    """Writes the page; a protocol has no plots."""
    protocol = read_document(source, ProtocolFile, EXPECTED)
    columns = ["experiment", "kind", "split", "signal", "parameters"]
    rows = [experiment_row(entry) for entry in protocol.experiments]
    texts = [experiment_text(entry) for entry in protocol.experiments if entry.given is None]
    home = f"Motions begin at {', '.join(f'{q:g}' for q in protocol.home)} [rad or m]." if protocol.home else ""
    load = f"A weight of {protocol.load:g} kg hangs on the tool." if protocol.load else ""
    table = {"title": "", "columns": columns, "rows": rows, "texts": []}
    parts: list[dict[str, Any]] = [
        {"title": "Experiments", "texts": [t for t in (home, load) if t], "plots": [], "tables": [table]},
        {"title": "What they are", "texts": list(dict.fromkeys(texts)), "plots": [], "tables": []},
        {
            "title": "In motion",
            "texts": [f"`kr5 replay {source} --cell CELL.yaml` shows the motion in 3D with the signals that it gives."],
            "plots": [],
            "tables": [],
        },
    ]
    data: ResultData = {"command": f"kr5 report {source}"}
    return write_tables_page(data, protocol.name or "Protocol", "kr5 report", source.name, parts, output, png)


def experiment_row(entry: ExperimentEntry) -> list[str]:
    parameters = entry.__pydantic_extra__ or {}
    text = ", ".join(f"{name} {value}" for name, value in parameters.items()) or "by default"
    source = f"file {entry.given}" if entry.given else (entry.signal or entry.kind).replace("_", " ")
    return [entry.name, entry.kind, entry.split, source, "–" if entry.given else text]


def experiment_text(entry: ExperimentEntry) -> str:
    """What its function says of it."""
    signals = KINDS[entry.kind]
    name = entry.signal if entry.signal in signals else next(iter(signals))
    text = " ".join(str(inspect.getdoc(signals[name])).split())
    return f"{name.replace('_', ' ').capitalize()}: {text}"
