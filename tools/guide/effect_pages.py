"""The page of the catalogue of effects, with a picture of each."""

from pathlib import Path
from typing import Any

from guide_markdown import code, escape, table
from kr5_tools.gap import effects
from kr5_tools.gap_report.messages import capitalised

INTRODUCTION = """\
# Effects

The effects that a diagnosis tries, and that a cell may carry under `effects:`. Each is one row of the catalogue and one
law of the library. `kr5 gap effects` prints this list, `kr5 gap effects EFFECT` one of them, and

```sh
kr5 gap effects coulomb_friction --pictures pictures
```

draws what an effect does to a recording. In the pictures, orange is the residual of a simulation without the effect,
grey with it, both in units of the noise; on the left over time or row, on the right over the variable that orders the
residual best. An effect of your own is a few lines of Python: see [Python](python.md#an-effect-of-your-own).
"""


def effects_page(pictures: Path | None) -> str:
    """The page; without a folder of pictures, without them."""
    cell = effects.load_cell(None)
    import kr5.cell

    found = [effects.effect_dict(row, cell) for row in kr5.cell.effect_catalogue()]
    overview = table(
        ("effect", "on", "parameters", "in words"),
        [
            (
                f"[{code(e['id'])}](#{e['id']})",
                e["target"].replace("_", " "),
                ", ".join(f"{p['name']} [{p['unit']}]" for p in e["parameters"]),
                escape(e["description"]),
            )
            for e in found
        ],
    )
    return "\n\n".join([INTRODUCTION, overview, *(_section(e, pictures) for e in found)])


def _section(e: dict[str, Any], pictures: Path | None) -> str:
    parts = [
        f"## `{e['id']}` {{ #{e['id']} }}",
        f"**{capitalised(e['label'])}.** {escape(capitalised(e['description']))}.",
        f"Shows in {escape(e['shows_in'])}.",
    ]
    if e["remedy"]:
        parts.append(f"Remedy: {escape(e['remedy'])}")
    rows = [
        (
            code(p["name"]),
            p["unit"],
            effects.value_text(p["nominal"] if p["nominal_when_off"] else p["off"], p),
            effects.value_text(p["typical"], p),
            f"{p['lower']:g}",
            f"{p['upper']:g}",
            escape(p["description"]),
        )
        for p in e["parameters"]
    ]
    where = f" on {code(e['targets'][0])} of the shipped KR5 Arc" if e["targets"] else ""
    parts.append(f"Parameters; what is off and typical is that{where}." if where else "Parameters.")
    parts.append(table(("parameter", "unit", "off", "typical", "at least", "at most", "meaning"), rows))
    name = f"{e['id']}.png"
    if pictures and (pictures / name).is_file():
        parts.append(f"![Residuals with and without {e['id']}](pictures/{name})")
    return "\n\n".join(parts)


def draw_pictures(folder: Path, stamp: str) -> None:
    """Draws every effect into the folder, unless a run with the same stamp has."""
    noted = folder / "made-from"
    if noted.is_file() and noted.read_text() == stamp:
        return
    import kr5.cell

    from kr5_tools.gap.effect_pictures import write_effect_pictures

    folder.mkdir(parents=True, exist_ok=True)
    names = [row.id for row in kr5.cell.effect_catalogue()]
    write_effect_pictures(names, effects.load_cell(None), folder)
    noted.write_text(stamp)
