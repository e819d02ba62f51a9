"""Attacks every command of `kr5` with files that are not as they should be.

    ./tools/run fuzz --minutes 60                                           all of the following, with the day's seed
    python tests/fuzz/commands unchanged                                    inputs as they are get past the checks
    python tests/fuzz/commands found                                        what was found before
    python tests/fuzz/commands files --minutes 10 --seed 3                  changed files of all kinds
    python tests/fuzz/commands cells --minutes 30                           one number of a cell after the other
    python tests/fuzz/commands files --seed 3 --run 1234 --keep /tmp/here   one run again, its files kept

A run must end with exit code 0, 1 or 2, within its time and memory, without a traceback; with 2 it must say why and
leave the outputs that were there. Run n of a seed is the same everywhere. Exit code 1 when there was a finding, which
--save keeps among those that are run again.
"""

import argparse
import collections
import datetime
import itertools
import random
import shutil
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import found
import inputs
import mutations
import runner

PARTS = ("unchanged", "found", "files", "cells")
CELL_SHARE = 0.25  # of the runs with changed files: one number of a cell, far from what it was
LARGEST = 1 << 20  # bytes of an input that is saved


@dataclass
class Case:
    """One run: its number, its job, and what was done to its files."""

    number: int | str
    job: inputs.Job
    how: str
    outcome: runner.Outcome
    change: found.Change | None = None  # None: the inputs were as they are
    there: tuple[str, ...] = ()  # outputs that were there before


def main() -> int:
    given = arguments()
    runner.import_commands()
    with tempfile.TemporaryDirectory(prefix="kr5-fuzz-") as place:
        root = Path(place)
        prepare(root / "inputs")
        return tell(itertools.chain.from_iterable(cases(part, root, given) for part in given.parts), given)


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"{', '.join(PARTS)}; by default the first three")
    parser.add_argument("--minutes", type=float, default=1.0, help="when to end, of each part with changed files")
    parser.add_argument("--runs", type=int, help="end after so many runs, if that is sooner")
    parser.add_argument("--seed", type=int, default=datetime.date.today().toordinal(), help="by default the day's own")
    parser.add_argument("--first", type=int, default=0, help="number of the first run")
    parser.add_argument(
        "--only", default="", metavar="WORDS", help="only jobs whose group or command holds these words"
    )
    parser.add_argument("--run", type=int, metavar="N", help="this run alone")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="keep the files of runs with a finding here")
    parser.add_argument(
        "--save", action="store_true", help=f"save the first finding of each kind below {found.PLACE.name}/"
    )
    given = parser.parse_args()
    given.parts = given.parts or PARTS[:3]
    if wrong := [part for part in given.parts if part not in PARTS]:
        parser.error(f"found the part {wrong[0]!r}, expected one of {', '.join(PARTS)}")
    return given


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


def cases(part: str, root: Path, given: argparse.Namespace) -> Iterator[Case]:
    def wanted(jobs: Iterable[inputs.Job]) -> list[inputs.Job]:
        return [j for j in jobs if given.only in j.group + " " + j.arguments]

    if part == "unchanged":
        yield from unchanged_cases(root, wanted(inputs.JOBS))
    elif part == "found":
        yield from found_cases(root, given)
    elif part == "files":
        yield from limited(file_cases(root, wanted(inputs.JOBS), wanted(inputs.CELL_JOBS), given), given)
    else:
        yield from limited(cell_cases(root, wanted(inputs.CELL_JOBS), given), given)


def unchanged_cases(root: Path, jobs: list[inputs.Job]) -> Iterator[Case]:
    """Every job with its inputs as they are: what they are refused for, changed ones would be, too."""
    for number, job in enumerate(jobs):
        outcome = run(fresh(root, job), job, ())
        if not outcome.problem and outcome.code != job.code:
            outcome.problem = f"exit code {outcome.code} of unchanged inputs, expected {job.code}"
        yield Case(f"unchanged {number}", job, "nothing", outcome)


def found_cases(root: Path, given: argparse.Namespace) -> Iterator[Case]:
    """What was found before, again."""
    for number, one in enumerate(found.load()):
        folder = fresh(root, one.job)
        found.put(one.change, folder)
        outcome = run(folder, one.job, one.there, given, f"found-{number}")
        yield Case(f"found {number}", one.job, one.how, outcome, one.change, one.there)


def file_cases(
    root: Path, jobs: list[inputs.Job], cell_jobs: list[inputs.Job], given: argparse.Namespace
) -> Iterator[Case]:
    """Runs of jobs with one of their files changed."""
    for number in [given.run] if given.run is not None else itertools.count(given.first):
        r = random.Random(f"{given.seed}/{number}")
        if cell_jobs and r.random() < CELL_SHARE:
            yield cell_case(root, number, r.choice(cell_jobs), r.random(), r.choice(mutations.CELL_NUMBERS), given)
            continue
        job = r.choices(jobs, [j.weight for j in jobs])[0]
        folder = fresh(root, job)
        file = r.choice(sorted(f for pattern in job.files for f in folder.glob(pattern)))
        how = f"{file.relative_to(folder)}: {mutations.mutate(r, file)}"
        yield changed_case(number, job, folder, file, how, r, given)


def cell_cases(root: Path, jobs: list[inputs.Job], given: argparse.Namespace) -> Iterator[Case]:
    """Runs of jobs with one number of their cell changed: all of them, in an order drawn from the seed."""
    count = len(mutations.cell_numbers((inputs.SHARE / "cells" / "kr5_arc.yaml").read_text(encoding="utf-8")))
    all_of_them = list(itertools.product(jobs, range(count), mutations.CELL_NUMBERS))
    random.Random(given.seed).shuffle(all_of_them)
    for number, (job, at, value) in enumerate(all_of_them):
        if number >= given.first and given.run in (None, number):
            yield cell_case(root, number, job, at / count, value, given)


def cell_case(root: Path, number: int, job: inputs.Job, share: float, value: str, given: argparse.Namespace) -> Case:
    """With another value for the number that stands after this share of all numbers of the cell."""
    folder = fresh(root, job)
    file = folder / job.files[0]
    text = file.read_text(encoding="utf-8")
    spans = mutations.cell_numbers(text)
    at = spans[int(share * len(spans))]
    file.write_text(mutations.set_cell_number(text, at, value), encoding="utf-8")
    line = text[: at[0]].count("\n") + 1
    how = f"line {line}, {text.splitlines()[line - 1].strip()[:60]!r}: {text[at[0] : at[1]]} -> {value}"
    return changed_case(number, job, folder, file, how, random.Random(number), given)


def changed_case(
    number: int, job: inputs.Job, folder: Path, file: Path, how: str, r: random.Random, given: argparse.Namespace
) -> Case:
    change = found.take(file, folder)
    there = tuple(name for name in job.outputs if r.random() < 0.5)
    return Case(number, job, how, run(folder, job, there, given, str(number)), change, there)


def fresh(root: Path, job: inputs.Job) -> Path:
    folder = root / "run"
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(root / "inputs" / job.folder, folder)
    return folder


def run(
    folder: Path, job: inputs.Job, there: tuple[str, ...], given: argparse.Namespace | None = None, name: str = ""
) -> runner.Outcome:
    """Runs a job in a folder where these outputs are there already."""
    for output in there:
        (folder / output).write_bytes(runner.KEPT)
    outcome = runner.run(folder, job.words())
    if not outcome.problem and outcome.code == 2 and not outcome.text.strip() and "check" not in job.arguments:
        outcome.problem = "exit code 2 without a word"
    before = {output: output in there for output in job.outputs}
    outcome.problem = outcome.problem or runner.check_outputs(folder, before, outcome.code)
    if given and given.keep and (outcome.problem or given.run is not None):
        no_copy = lambda place, names: [n for n in names if (Path(place) / n).is_fifo()]
        shutil.copytree(folder, given.keep / name, dirs_exist_ok=True, symlinks=True, ignore=no_copy)
    return outcome


def limited(all_of_them: Iterator[Case], given: argparse.Namespace) -> Iterator[Case]:
    end = time.monotonic() + 60 * given.minutes
    for case in itertools.islice(all_of_them, given.runs):
        yield case
        if time.monotonic() > end:
            return


def tell(all_of_them: Iterable[Case], given: argparse.Namespace) -> int:
    """Prints the findings as they come, then a table; gives the exit code."""
    print(f"seed {given.seed}", flush=True)
    runs: collections.Counter[str] = collections.Counter()
    bad: collections.Counter[str] = collections.Counter()
    classes: dict[str, list[Case]] = {}
    for case in all_of_them:
        runs[case.job.group] += 1
        if given.run is not None:
            print(f"kr5 {case.job.arguments}\n{case.how}\nexit code {case.outcome.code}\n{case.outcome.text}")
        if not case.outcome.problem:
            continue
        bad[case.job.group] += 1
        same = classes.setdefault(case.outcome.problem, [])
        same.append(case)
        if len(same) <= 3 or case.change is None:
            print_finding(case)
        if given.save and len(same) == 1:
            save(case)
    print(f"\n{'class':<24}{'runs':>7}{'bad':>6}")
    for group in sorted(runs):
        print(f"{group:<24}{runs[group]:>7}{bad[group]:>6}")
    print(f"{'all':<24}{sum(runs.values()):>7}{sum(bad.values()):>6}")
    for problem, alike in sorted(classes.items(), key=lambda c: -len(c[1])):
        print(f"{len(alike):>5}  {problem}   (runs {', '.join(str(c.number) for c in alike[:6])})")
    return 1 if bad else 0


def print_finding(case: Case) -> None:
    print(f"run {case.number}: {case.outcome.problem}\n    kr5 {case.job.arguments}\n    {case.how}")
    last = case.outcome.text.strip().splitlines()[-3:]
    print("".join(f"    | {line[:160]}\n" for line in last), end="", flush=True)


def save(case: Case) -> None:
    """Keeps a finding for later runs, unless it is one of those, or too large for a checkout."""
    if isinstance(case.number, str) or case.change is None:
        return
    if len(case.change.content) > LARGEST:
        print(f"    not saved: {case.change.name} has {len(case.change.content)} bytes", flush=True)
        return
    folder = found.save(found.Found(case.job, case.change, case.how, case.outcome.problem, case.there))
    print(f"    saved in {folder}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
