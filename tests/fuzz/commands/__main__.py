"""Attacks every command of `kr5` with files that are not as they should be.

    python tests/fuzz/commands --minutes 10 --seed 3                  changed files of all kinds
    python tests/fuzz/commands --cells --minutes 30                   one number of a cell after the other
    python tests/fuzz/commands --seed 3 --run 1234 --keep /tmp/here   one run again, its files kept

A run must end with exit code 0, 1 or 2, within its time and memory, without a traceback; with 2 it must say why and
leave the outputs that were there. Run n of a seed is the same everywhere. Exit code 1 when there was a finding.
"""

import argparse
import collections
import itertools
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import inputs
import mutations
import runner


@dataclass
class Case:
    """One run: its number, its job, and what was done to its files."""

    number: int
    job: inputs.Job
    change: str
    outcome: runner.Outcome


def main() -> int:
    given = arguments()
    runner.import_commands()
    with tempfile.TemporaryDirectory(prefix="kr5-fuzz-") as place:
        root = Path(place)
        prepare(root / "inputs")
        jobs = [j for j in inputs.JOBS if not given.only or given.only in j.group + " " + j.arguments]
        numbers = [given.run] if given.run is not None else itertools.count(given.first)
        cases = cell_cases(root, given) if given.cells else file_cases(root, jobs, numbers, given)
        return tell(limited(cases, given), given)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=1.0, help="when to end")
    parser.add_argument("--runs", type=int, help="end after so many runs, if that is sooner")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first run")
    parser.add_argument(
        "--only", default="", metavar="WORDS", help="only jobs whose group or command holds these words"
    )
    parser.add_argument("--cells", action="store_true", help="the numbers of a cell, in place of changed files")
    parser.add_argument("--run", type=int, metavar="N", help="this run alone")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep the files of runs with a finding here")
    return parser.parse_args()


def prepare(folder: Path) -> None:
    """The inputs, made in a fork too."""
    folder.mkdir()

    def run(where: Path, words: str) -> None:
        done = runner.run(where, words.split(), 120)
        if done.code != 0:
            raise SystemExit(f"kr5 {words}: exit code {done.code}\n{done.text}")
        (where / ".stderr").unlink(missing_ok=True)

    done = runner.forked(folder, lambda: inputs.prepare(folder, run), 300)
    if done.code != 0:
        raise SystemExit(f"the inputs cannot be made:\n{done.text}")


def file_cases(root: Path, jobs: list[inputs.Job], numbers: Iterator[int], given: argparse.Namespace) -> Iterator[Case]:
    """Runs of jobs with one of their files changed."""
    weights = [j.weight for j in jobs]
    for number in numbers:
        r = random.Random(f"{given.seed}/{number}")
        job = r.choices(jobs, weights)[0]
        folder = fresh(root, job)
        files = sorted(f for pattern in job.files for f in folder.glob(pattern))
        file = r.choice(files)
        change = f"{file.relative_to(folder)}: {mutations.mutate(r, file)}"
        yield run(number, job, folder, change, r, given)


def cell_cases(root: Path, given: argparse.Namespace) -> Iterator[Case]:
    """Runs of jobs with one number of their cell changed: all of them, in an order drawn from the seed."""
    text = (inputs.SHARE / "cells" / "kr5_arc.yaml").read_text(encoding="utf-8")
    jobs = [j for j in inputs.CELL_JOBS if not given.only or given.only in j.group + " " + j.arguments]
    all_of_them = list(itertools.product(jobs, mutations.cell_numbers(text), mutations.CELL_NUMBERS))
    random.Random(given.seed).shuffle(all_of_them)
    for number, (job, span, value) in enumerate(all_of_them):
        if number < given.first or given.run not in (None, number):
            continue
        folder = fresh(root, job)
        file = folder / job.files[0]
        own = file.read_text(encoding="utf-8")
        spans = mutations.cell_numbers(own) if own != text else None
        at = spans[mutations.cell_numbers(text).index(span) % len(spans)] if spans else span
        file.write_text(mutations.set_cell_number(own, at, value), encoding="utf-8")
        line = own[: at[0]].count("\n") + 1
        yield run(
            number,
            job,
            folder,
            f"line {line}, {own.splitlines()[line - 1].strip()[:60]!r}: {own[at[0] : at[1]]} -> {value}",
            random.Random(number),
            given,
        )


def fresh(root: Path, job: inputs.Job) -> Path:
    folder = root / "run"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(root / "inputs" / job.folder, folder)
    return folder


def run(number: int, job: inputs.Job, folder: Path, change: str, r: random.Random, given: argparse.Namespace) -> Case:
    before = {name: r.random() < 0.5 for name in job.outputs}
    for name in (n for n, there in before.items() if there):
        (folder / name).write_bytes(runner.KEPT)
    outcome = runner.run(folder, job.words())
    if not outcome.problem and outcome.code == 2 and not outcome.text.strip() and "check" not in job.arguments:
        outcome.problem = "exit code 2 without a word"
    outcome.problem = outcome.problem or runner.check_outputs(folder, before, outcome.code)
    if given.keep and (outcome.problem or given.run is not None):
        shutil.copytree(folder, given.keep / str(number), dirs_exist_ok=True, symlinks=True)
    return Case(number, job, change, outcome)


def limited(cases: Iterator[Case], given: argparse.Namespace) -> Iterator[Case]:
    end = time.monotonic() + 60 * given.minutes
    for case in itertools.islice(cases, given.runs):
        yield case
        if time.monotonic() > end:
            return


def tell(cases: Iterator[Case], given: argparse.Namespace) -> int:
    """Prints the findings as they come, then a table; gives the exit code."""
    runs: collections.Counter[str] = collections.Counter()
    bad: collections.Counter[str] = collections.Counter()
    classes: dict[str, list[Case]] = {}
    for case in cases:
        runs[case.job.group] += 1
        if given.run is not None:
            print(f"kr5 {case.job.arguments}\n{case.change}\nexit code {case.outcome.code}\n{case.outcome.text}")
        if not case.outcome.problem:
            continue
        bad[case.job.group] += 1
        same = classes.setdefault(case.outcome.problem, [])
        same.append(case)
        if len(same) <= 3:
            print(
                f"run {case.number}: {case.outcome.problem}\n    kr5 {case.job.arguments}\n    {case.change}",
                flush=True,
            )
            print(
                "".join(f"    | {line[:160]}\n" for line in case.outcome.text.strip().splitlines()[-3:]),
                end="",
                flush=True,
            )
    print(f"\n{'class':<24}{'runs':>7}{'bad':>6}")
    for group in sorted(runs):
        print(f"{group:<24}{runs[group]:>7}{bad[group]:>6}")
    print(f"{'all':<24}{sum(runs.values()):>7}{sum(bad.values()):>6}")
    for problem, found in sorted(classes.items(), key=lambda c: -len(c[1])):
        print(f"{len(found):>5}  {problem}   (runs {', '.join(str(c.number) for c in found[:6])})")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
