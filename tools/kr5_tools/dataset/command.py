"""`kr5 dataset guess`: proposes a dataset.yaml for a folder, with its reasons."""

from pathlib import Path
from typing import Annotated

import typer
from kr5.files.writing import check_writable, write_json, write_text

from kr5_tools.calibrate.dataset_proposal import find_images, find_texts, propose_dataset
from kr5_tools.cli.arguments import JsonOption
from kr5_tools.cli.tables import make_table
from kr5_tools.cli.terminal import console, fail

app = typer.Typer()


@app.callback()
def group() -> None:
    """Description of a folder of images and robot poses."""


@app.command(epilog="Example:  kr5 dataset guess my_folder -o my_folder/dataset.yaml")
def guess(
    folder: Annotated[Path, typer.Argument(help="Folder of images and robot poses.")],
    target: Annotated[str | None, typer.Option(help="Target, when it is known, e.g. chessboard:6x9:0.0236.")] = None,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="dataset.yaml", help="File to write the proposal to.")
    ] = None,
    json_file: JsonOption = None,
) -> None:
    """Proposal of a dataset.yaml: which images and poses belong together, the convention of the poses, target, camera
    and mount.
    """
    if not folder.is_dir():
        fail(f"{folder}: no such folder; expected one with images and robot poses")
    check_writable(output, json_file, inputs=[*find_images(folder, []), *find_texts(folder)])
    out = console(json_file)
    proposal = propose_dataset(folder, target)
    rows = [[r.item, r.proposal, f"{r.confidence}: {r.why}"] for r in proposal.reasons]
    out.print(make_table(f"Proposal for {folder}", ["item", "proposal", "confidence and reason"], rows, text=(1, 2)))
    if output:
        write_text(proposal.text, output)
    else:
        out.print(proposal.text, markup=False)
    reasons = [
        {"what": r.item, "proposal": r.proposal, "because": r.why, "confidence": r.confidence} for r in proposal.reasons
    ]
    write_json({"dataset": proposal.keys, "reasons": reasons}, json_file)
