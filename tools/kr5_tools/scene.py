"""`kr5 scene`: scenes in DART."""

from pathlib import Path
from typing import Annotated

import typer

from . import common

app = typer.Typer(no_args_is_help=True)


@app.callback()
def scene() -> None:
    """Scenes in DART: a cell, what drives it, and what must come of it (format kr5-scene/1)."""


@app.command(epilog="Example: kr5 scene run share/scenes/peg_insertion.yaml --csv rows.csv")
def run(
    file: Annotated[Path, typer.Argument(metavar="SCENE.yaml", help="The scene.")],
    csv: Annotated[Path | None, typer.Option("--csv", metavar="ROWS.csv", help="Write a row every controller cycle here.")] = None,
    json_file: common.Json = None,
) -> None:
    """Runs a scene and says what came of each expectation. Exit code 1 when one did not come true, 2 for bad input."""
    import kr5.io
    import kr5.sim

    with common.working(f"running {file}"):
        result = kr5.sim.run_scene(file)
    to = common.console(json_file)
    to.print(common.table(str(file), ["column", "statistic", "came", "least", "most", "verdict"], [_row(c) for c in result.checks]))
    if csv:
        kr5.io.save_csv(result.rows, csv)
        to.print(f"{csv}: {len(result.rows.values)} rows.", soft_wrap=True)
    checks = [check.to_dict() for check in result.checks]
    common.write_json({"passed": result.passed, "steps": result.steps, "checks": checks}, json_file)
    if not result.passed:
        raise typer.Exit(1)


def _row(check) -> list[str]:
    e = check.expected
    bounds = ["" if bound is None else f"{bound:g}" for bound in (e.least, e.most)]
    return [e.column, str(e.statistic), f"{check.value:g}", *bounds, "ok" if check.passed else "[red]failed[/red]"]
