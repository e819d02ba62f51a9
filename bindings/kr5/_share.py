"""Files that ship with kr5: cells, protocols, scenes, data of the demo, notebooks."""

from pathlib import Path

_INSTALLED = Path(__file__).parent / "share"
_CHECKOUT = Path(__file__).resolve().parents[2] / "share"


def share(name: str = "") -> Path:
    """Path of a file or folder that ships with kr5, for instance `share("cells/kr5_arc.yaml")`; without a name, of the
    folder with all of them.

    Raises FileNotFoundError for a name that there is not.
    """
    folder = _INSTALLED if _INSTALLED.is_dir() else _CHECKOUT
    path = folder / name
    if not path.exists():
        near = path.parent if path.parent.is_dir() else folder
        there = ", ".join(sorted(p.name for p in near.iterdir() if p.name[0] != ".")) if near.is_dir() else "nothing"
        raise FileNotFoundError(f"{name}: no such file ships with kr5; in {near} there is {there}")
    return path
