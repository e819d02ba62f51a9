"""`kr5 gap compare`: what differs between two recordings."""

import json
from pathlib import Path
from typing import Annotated, Any

import kr5.arm_log
import kr5.gap
import typer
from kr5.files import results, writing
from kr5.logs.compared_source import SourceOptions, input_files
from rich.markup import escape

from kr5_tools.cli import arguments, tables, terminal
from kr5_tools.cli.arm_file import BaseOption, TipOption
from kr5_tools.cli.options import options_from
from kr5_tools.cli.table_options import ColumnsOption, EpisodesOption
from kr5_tools.cli.terminal import Console
from kr5_tools.gap.compare_page import changes_table, common_texts
from kr5_tools.gap.diagnosis_run import progress_of_diagnosis
from kr5_tools.gap.source import ModelOption, SetOption, TrustOption, overrides_of, print_source, read_source
from kr5_tools.gap.terminal_report import VERDICTS

FirstArgument = Annotated[
    Path,
    typer.Argument(
        metavar="FIRST", help="Recording (folder), or log of a robot with --model: the state to compare with."
    ),
]
SecondArgument = Annotated[
    Path, typer.Argument(metavar="SECOND", help="The same of another day, with another load, or of another robot.")
]


def add_to(app: typer.Typer) -> None:
    app.command(
        "compare",
        epilog="Examples: kr5 gap compare monday.csv today.csv --model robot.urdf; kr5 gap compare empty.csv loaded.csv"
        " --model robot.urdf --json change.json",
    )(compare)


@options_from(kr5.gap.DiagnoseOptions)
def compare(
    first: FirstArgument,
    second: SecondArgument,
    options: kr5.gap.DiagnoseOptions,
    model: ModelOption = None,
    base: BaseOption = "",
    tip: TipOption = "",
    every: arguments.EveryOption = None,
    columns: ColumnsOption = None,
    episodes: EpisodesOption = "",
    overrides: SetOption = None,
    trust: TrustOption = False,
    full: arguments.FullOption = False,
    everything: arguments.AllOption = False,
    json_file: arguments.JsonOption = None,
    output: arguments.ResultOption = None,
) -> None:
    """Differences between two recordings of a robot: effects that changed, their sizes, and what both have in common.

    Errors of the model that both recordings have are not told as a change. The recordings may hold other motions; what
    the first one does not determine makes the uncertainty of a change larger.
    """
    options.validate()
    reading = SourceOptions(model, base, tip, every, overrides_of(overrides, columns), trust, episodes)
    writing.check_writable(json_file, output, inputs=[*input_files([first, second], reading)])
    to = terminal.console(json_file)
    sources = [read_source([path], reading) for path in (first, second)]
    with progress_of_diagnosis() as progress:
        recordings = [source.recording for source in sources]
        found = kr5.arm_log.compare_recordings(
            recordings[0], recordings[1], arguments.make_simulator(full), options, progress
        )
    inputs = dict(zip(("first", "second"), (source.inputs for source in sources)))
    data = results.write_result(output, **comparison_dict(found), input=inputs)
    writing.write_json(data, json_file)
    print_comparison(found, to)
    for path, source in zip((first, second), sources):
        if source.reasons or source.notes:
            to.print(f"\n{path}", style="bold", soft_wrap=True)
        print_source(source, to, everything)


def comparison_dict(found: kr5.arm_log.RecordingComparison) -> dict[str, Any]:
    """The file form kr5-gap-comparison/1."""
    return {
        "format": "kr5-gap-comparison/1",
        "text": found.text,
        "reversed": found.reversed,
        "by_arm": found.by_arm,
        "changes": [change.to_dict() | {"text": change.text()} for change in found.changes],
        "common": [name.to_dict() for name in found.common],
        "gap_with_model": found.gap_with_model,
        "gap_with_first": found.gap_with_first,
        "first": json.loads(found.first.to_json()),
        "difference": json.loads(found.difference.to_json()),
    }


def print_comparison(found: kr5.arm_log.RecordingComparison, to: Console) -> None:
    colour, _ = VERDICTS[str(found.difference.verdict)]
    to.print(f"[bold {colour}]{escape(found.text)}[/]", soft_wrap=True, markup=True)
    if found.changes:
        shown = changes_table([change.to_dict() for change in found.changes])
        to.print()
        to.print(tables.make_table(shown["title"], shown["columns"], shown["rows"], text=(1,)))
    if found.common:
        to.print("\nIn both recordings, other than in the model", style="bold")
        for text in common_texts([name.to_dict() for name in found.common]):
            to.print(f"  - {text}", soft_wrap=True)
