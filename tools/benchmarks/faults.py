"""Faults of a job while it inserts a pellet: bad input, the network, and everything that stops the arm, one row each.

    python tools/benchmarks/faults.py [--trials 100] [--only NAME...] [--keep FILE.jsonl] [--workers 4]

Every fault is injected at random instants of an insertion through the real chain: job, link, sockets, emulated
controller and simulated cell in real time, the database on the disk. After each stop a person looks, releases it, and
the job goes on without faults. What happened is judged by the truth of the simulator, which no controller reads. The
clock of a computer may not be set by a test: its jumps are tried in lock step. With --keep trials that were done stay,
and are not repeated by the next run."""

import dataclasses
import json
import multiprocessing
import tempfile
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import arguments
import comparison
from fault_plans import FAULTS
from fault_trials import Insertion, Trial

CELL = Path(__file__).resolve().parents[2] / "share/cells/kr5_arc.yaml"
WORKERS = 4  # a trial waits for its real time, mostly
_insertion: Insertion | None = None
_folder: tempfile.TemporaryDirectory[str] | None = None


def begin(seed: int) -> None:
    """Of a process that makes trials."""
    global _insertion, _folder
    _folder = tempfile.TemporaryDirectory(prefix="kr5-faults-")
    _insertion = Insertion(CELL, seed, Path(_folder.name))


def try_fault(fault: str, number: int) -> Trial:
    assert _insertion is not None
    return _insertion.try_fault(fault, number)


def load_trials(file: Path | None) -> list[Trial]:
    if file is None or not file.is_file():
        return []
    return [Trial(**json.loads(line)) for line in file.read_text(encoding="utf-8").splitlines()]


def run_trials(faults: list[str], trials: int, seed: int, workers: int, keep: Path | None) -> list[Trial]:
    """Those that are not there yet are made, and kept one by one."""
    done = {(t.fault, t.number): t for t in load_trials(keep)}
    wanted = [(fault, number) for number in range(trials) for fault in faults]
    missing = [key for key in wanted if key not in done]
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, context, initializer=begin, initargs=(seed,)) as pool:
        runs = [pool.submit(try_fault, *key) for key in missing]
        for run in comparison.progress(runs, "Faults"):
            trial = run.result()
            done[trial.fault, trial.number] = trial
            if keep is not None:
                with keep.open("a", encoding="utf-8") as stream:
                    stream.write(json.dumps(dataclasses.asdict(trial)) + "\n")
    return [done[key] for key in wanted]


def fault_row(fault: str, trials: list[Trial]) -> comparison.Row:
    """What came of a fault."""
    ended = Counter(t.ended for t in trials)
    parts = [f"{ended[name]} {name}" for name in ("went on", "stopped", "refused", "hung") if ended[name]]
    reasons = Counter(t.reason.replace("_", " ") for t in trials if t.ended in ("stopped", "refused"))
    if reasons:
        parts[-1] += " (" + ", ".join(f"{reason} {count}" for reason, count in reasons.most_common()) + ")"
        resumed = [t.releases for t in trials if t.resumed]
        more = sum(releases > 1 for releases in resumed)
        parts.append(f"{len(resumed)} done after release" + (f", {more} of them after another" if more else ""))
    harms = {
        "in spite of it": sum(not t.unharmed for t in trials),
        "moving": sum(t.moving for t in trials),
        "not held": sum(t.ended == "stopped" and not t.held for t in trials),
        "above the limit": sum(t.over_limit for t in trials),
        "astray": sum(t.astray for t in trials),
    }
    parts += [f"{count} {name}" for name, count in harms.items() if count]
    parts.append(f"peak {max(t.max_force for t in trials):.1f} N")
    good = sum(t.sound() for t in trials)
    low, high = comparison.exact_interval(good, len(trials))
    return comparison.Row(
        f"{fault}, {len(trials)} insertions",
        "; ".join(parts),
        "no harm, and done in the end",
        good == len(trials),
        interval=f"{good} of {len(trials)} without harm [{100 * low:.1f}, {100 * high:.1f}] %",
    )


def main() -> int:
    parser = arguments.parser(__doc__)
    parser.add_argument("--trials", type=int, default=100, help="insertions of each fault")
    parser.add_argument("--only", nargs="+", choices=FAULTS, metavar="NAME", help="these faults alone")
    parser.add_argument("--seed", type=int, default=52001, help="seed of cell, instants and sizes")
    parser.add_argument("--workers", type=int, default=WORKERS, help="insertions at the same time")
    parser.add_argument("--keep", type=Path, help="file of the trials that were done")
    given = parser.parse_args()
    faults = given.only or list(FAULTS)
    trials = run_trials(faults, given.trials, given.seed, given.workers, given.keep)
    rows = [fault_row(fault, [t for t in trials if t.fault == fault]) for fault in faults]
    comparison.print_comparisons(rows, "Faults while a pellet is inserted, through the link in real time")
    return 0 if all(row.reached for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
