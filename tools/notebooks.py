"""Executes the notebooks of share/notebooks and writes their outputs into them, without what changes with every run.

build/venv/bin/python tools/notebooks.py
"""

import tempfile
from pathlib import Path

import nbclient
import nbformat

NOTEBOOKS = Path(__file__).resolve().parents[1] / "share/notebooks"
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


def execute(file: Path, folder: Path, check: str = "") -> nbformat.NotebookNode:
    """The notebook as it is after a run in a folder; `check` is code that runs after its cells, as one more."""
    book = nbformat.read(file, as_version=4)
    if check:
        book.cells.append(nbformat.v4.new_code_cell(check))
    client = nbclient.NotebookClient(
        book,
        timeout=300,
        kernel_name="python3",
        record_timing=False,
        coalesce_streams=True,  # what a cell prints comes in more or fewer pieces
        resources={"metadata": {"path": str(folder)}},
    )
    client.execute()
    book.metadata = nbformat.from_dict(METADATA)
    return book


def main() -> None:
    for file in sorted(NOTEBOOKS.glob("*.ipynb")):
        with tempfile.TemporaryDirectory() as folder:
            nbformat.write(execute(file, Path(folder)), file)
        print(f"{file.relative_to(Path.cwd()) if file.is_relative_to(Path.cwd()) else file}: written")


if __name__ == "__main__":
    main()
