"""How many effects a diagnosis finds: cells with none, one, three and five effects and with one outside the catalogue,
diagnosed with up to two effects and with up to six.

    python tools/benchmarks/effect_count.py [--cells 6] [--seed 1]

The cells are those of `blind_check`, drawn and recorded by a program of its own. A cause is judged on a second
recording of the same cell, which the diagnosis has not seen: with the cause, the misfit must be less than without it.
"""

import json
import os
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import kr5.cell
import kr5.gap
import kr5.predict
import numpy as np

import arguments
import comparison
from blind_check.cell_score import CellScore, score_cell
from blind_check.generate import draw_one_cell, plan_cells
from blind_check.protocol import CASES
from kr5_tools.sweep.rate_table import success_rate

LIMITS = (2, 6)  # greatest numbers of effects
SORTS = {"none": "healthy", "one": "single", "three": "several 3", "five": "several 5", "outside": "unknown"}
SEEN = 1.5  # an effect of this size must be named


@dataclass
class Diagnosed:
    """One cell, diagnosed with one limit."""

    score: CellScore
    limit: int
    seconds: float
    needless: int  # causes without which a fresh recording fits no worse


def misfit(recording: kr5.cell.Recording, cell: kr5.cell.Cell) -> float:
    """Sum of squares over the noise."""
    return float(sum(c.gap**2 * c.rows for c in kr5.gap.measure(recording, kr5.predict.FastSimulator(), cell).columns))


def needless_causes(fresh: kr5.cell.Recording, diagnosis: kr5.gap.Diagnosis) -> int:
    whole = misfit(fresh, diagnosis.cell)
    count = 0
    for cause in diagnosis.causes:
        without = kr5.cell.parse_cell(diagnosis.cell.to_yaml())
        for parameter in cause.parameters:
            without.set_effect(cause.effect, cause.target, parameter.name, None)
        count += misfit(fresh, without) <= whole
    return count


def as_result(diagnosis: kr5.gap.Diagnosis) -> dict:
    """As `score_cell` reads a diagnosis."""
    return {
        "verdict": str(diagnosis.verdict),
        "causes": [
            {
                "effect": c.effect,
                "target": c.target,
                "probability": c.probability,
                "tied_with": [{"effect": t.effect, "target": t.target} for t in c.tied_with],
            }
            for c in diagnosis.causes
        ],
    }


def diagnose(folder: Path, name: str, label: dict, limit: int) -> Diagnosed:
    recording = kr5.cell.load_recording(folder / "recordings" / name)
    start = time.monotonic()
    found = kr5.gap.diagnose(
        recording, kr5.predict.FastSimulator(), kr5.gap.DiagnoseOptions(max_effects=limit, threads=1)
    )
    seconds = time.monotonic() - start
    fresh = kr5.cell.load_recording(folder / "fresh" / name)
    return Diagnosed(score_cell(name, label, as_result(found)), limit, seconds, needless_causes(fresh, found))


def draw(folder: Path, group: str, count: int, seed: int) -> dict[str, dict]:
    """Labels of the cells of one group, recorded into the folder."""
    planned = plan_cells(400, seed, False)
    out = {}
    for k, (_, _, turn, own_seed, _) in enumerate(planned[:count]):
        name = f"{group}-{k}"
        out[name] = draw_one_cell(folder, name, SORTS[group], turn, own_seed, CASES)
    return out


def rate_row(what: str, hits: list[bool], wanted: str, reached: bool) -> comparison.Row:
    if not hits:
        return comparison.Row(what, "none drawn", wanted, True)
    found = success_rate(sum(hits), len(hits))
    interval = f"[{100 * found['low']:.0f}, {100 * found['high']:.0f}] %"
    return comparison.Row(what, f"{sum(hits)} of {len(hits)}", wanted, reached, interval=interval)


def rows_of(group: str, limit: int, cells: list[Diagnosed]) -> list[comparison.Row]:
    head = f"{group} effect{'' if group in ('one', 'outside') else 's'}, up to {limit}"
    named = [n for d in cells for e, n in zip(d.score.label["effects"], d.score.named) if e["largest"] >= SEEN]
    whole = [all(d.score.named) for d in cells if d.score.largest >= SEEN]
    false = [any(not right for _, right in d.score.causes) for d in cells]
    must = limit > LIMITS[0]  # the fewer are the comparison
    out = []
    if group == "none":
        sound = [d.score.verdict == "no_gap" for d in cells]
        return [rate_row(f"{head}: called sound", sound, "all", all(sound))]
    if group == "outside":
        explained = [d.score.verdict == "explained" for d in cells]
        return [rate_row(f"{head} the catalogue: called explained", explained, "none", not any(explained))]
    out.append(rate_row(f"{head}: all named", whole, "all" if must else "–", not must or all(whole)))
    out.append(rate_row(f"{head}: each named", named, "–", True))
    out.append(
        rate_row(f"{head}: something else blamed beside", false, "none" if must else "–", not (must and any(false)))
    )
    return out


def main() -> int:
    parser = arguments.parser(__doc__)
    parser.add_argument("--cells", type=int, default=6, help="of each number of effects")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", type=Path, help="write what was named here")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        labels = {group: draw(folder, group, given.cells, given.seed + k) for k, group in enumerate(SORTS)}
        jobs = [(group, cell, limit) for group in SORTS for cell in labels[group] for limit in LIMITS]
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            tasks = [pool.submit(diagnose, folder, cell, labels[group][cell], limit) for group, cell, limit in jobs]
            done = [(job, task.result()) for job, task in comparison.progress(list(zip(jobs, tasks)), "Diagnoses")]
    rows = []
    for group in SORTS:
        for limit in LIMITS:
            rows += rows_of(group, limit, [d for (g, _, m), d in done if (g, m) == (group, limit)])
    causes, needless = sum(len(d.score.causes) for _, d in done), sum(d.needless for _, d in done)
    rows.append(
        comparison.Row(
            "causes without which a fresh recording of the cell fits no worse",
            f"{needless} of {causes}",
            "0",
            needless == 0,
        )
    )
    times = {limit: [d.seconds for _, d in done if d.limit == limit] for limit in LIMITS}
    ratios = [b / a for a, b in zip(times[LIMITS[0]], times[LIMITS[1]], strict=True)]
    rows.append(
        comparison.Row(
            "time with up to six effects over that with up to two: median, most [-]",
            f"{np.median(ratios):.2f}, {max(ratios):.2f}",
            "–",
            True,
        )
    )
    comparison.print_comparisons(rows, "Number of effects")
    if given.json:
        found = [
            {"cell": d.score.name, "limit": d.limit, "effects": d.score.label["effects"], "causes": d.score.causes,
             "named": d.score.named, "verdict": d.score.verdict, "needless": d.needless, "seconds": d.seconds}
            for _, d in done
        ]  # fmt: skip
        given.json.write_text(json.dumps(found, indent=1))
    return 0 if all(row.reached for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
