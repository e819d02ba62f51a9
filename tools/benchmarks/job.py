"""The whole job in simulated cells: 35 pellets from bin to tube, unattended, and four from a fixed place; insertions by
clearance and tilt; programs killed at random instants. What faults do to an insertion: faults.py.

    python tools/benchmarks/job.py [--jobs 10] [--pellets 35] [--kills 1000] [--first-seed 52001]

Cells with the usual errors, of which their controller is not told. What is inserted is judged by the truth of the
simulator. A pellet stands or lies by how it goes over the stand: once, or laid down before it is stood up."""

import dataclasses
import os
import tempfile
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import kr5.cell
import kr5.robot
import kr5.work
import numpy as np
from kr5 import job

import arguments
import comparison
from insertion import insertions
from job_kills import kill_often
from kr5_tools.sweep.rate_table import success_rate
from kr5_tools.work.job_cell import JobSetup, make_cell, make_setup, work_options
from kr5_tools.work.journal_tables import laid_down

CELL = Path(__file__).resolve().parents[2] / "share/cells/kr5_arc.yaml"
INSERTED, TIME = 0.95, 16.0  # share [-] and mean time [s] to reach
FOUR_TIME = 22.5  # of four pellets from a fixed place [s]
TASKS = [(0.05, 15.0), (0.1, 15.0), (0.5, 15.0), (0.28, 10.0), (0.28, 20.0)]  # [mm, deg] beside the usual one
REST = 3.0  # in which the last pellet comes to rest [s]


@dataclasses.dataclass
class Done:
    """A job that has ended."""

    seed: int
    state: job.JobState
    statistics: job.JobStatistics
    truth: kr5.work.JobTruth
    lying: set[int]  # numbers of the pellets that were laid down before they were stood up
    force_limit: float  # [N]

    def pellets(self, lying: bool | None = None) -> list[job.PelletFigures]:
        return [p for p in self.statistics.pellets if lying is None or (p.number in self.lying) == lying]


def run_job(setup: JobSetup) -> Done:
    """One job until its end, without anybody."""
    cell = make_cell(kr5.cell.load_cell(CELL), setup)
    options = work_options(cell, setup)
    kr5.work.place_over_bin(cell, options)
    with tempfile.TemporaryDirectory() as folder:
        journal = job.Journal(Path(folder) / "job.db", f"seed {setup.seed}")
        runner = kr5.work.JobRunner(cell, options, journal)
        while not runner.finished:
            runner.step(cycles=500)
        for _ in range(round(REST / cell.cycle)):
            cell.read()
            cell.send(kr5.robot.RobotCommand())
        result, records = runner.result(), journal.records()
    lying = set(laid_down(records))
    limit = options.job.insertion.limits.force
    return Done(setup.seed, result.state, result.statistics, kr5.work.judge_job(cell), lying, limit)


def share(count: int, trials: int) -> tuple[str, str, float]:
    """A rate, its exact interval, and the lower end of that."""
    rate = success_rate(count, trials)
    if not trials:
        return "none", "–", 0.0
    return f"{count} of {trials}", f"[{100 * rate['low']:.1f}, {100 * rate['high']:.1f}] %", rate["low"]


def inserted_rows(jobs: list[Done], pellets: int) -> Iterator[comparison.Row]:
    what = f"{len(jobs)} jobs of {pellets} pellets, unattended"
    count, trials = sum(min(j.truth.in_tube, pellets) for j in jobs), pellets * len(jobs)
    text, interval, low = share(count, trials)
    wanted = f"lower bound ≥ {100 * INSERTED:.0f} %"
    yield comparison.Row(f"{what}: inserted, by the truth", text, wanted, low >= INSERTED, interval=interval)
    stopped = [
        f"seed {j.seed}: {j.state.stop} in {j.state.stopped_in}" for j in jobs if j.state.phase != job.Phase.Done
    ]
    ended = f"{len(jobs) - len(stopped)} of {len(jobs)}"
    text = f"{ended}; {', '.join(stopped)}".replace("_", " ") if stopped else ended
    yield comparison.Row("jobs that came to their end", text, "all", not stopped)


def time_rows(jobs: list[Done]) -> Iterator[comparison.Row]:
    means = [np.mean([p.time for p in j.pellets() if p.state == job.PelletState.Inserted]) for j in jobs]
    spread = f"from {min(means):.1f} to {max(means):.1f} s by job"
    mean = float(np.mean([p.time for j in jobs for p in j.pellets() if p.state == job.PelletState.Inserted]))
    yield comparison.Row("pick to place, mean", f"{mean:.1f} s", f"≤ {TIME:g} s", mean <= TIME, interval=spread)
    whole = [j.statistics.time for j in jobs]
    yield comparison.Row("time of a job, from least to most", f"{min(whole):.0f} to {max(whole):.0f} s", "–", True)


def force_row(jobs: list[Done]) -> comparison.Row:
    peaks = [j.statistics.peak_force for j in jobs]
    limit = jobs[0].force_limit
    text = f"{np.median(peaks):.1f}, {max(peaks):.1f} N"
    return comparison.Row(
        "peak force on the tool: median and most of the jobs", text, f"< {limit:g} N", max(peaks) < limit
    )


def part_rows(jobs: list[Done]) -> Iterator[comparison.Row]:
    """What comes of pellets that stand and lie, and at which attempt."""
    for name, lying in (("stood up at once", False), ("laid down first", True)):
        tried = [p for j in jobs for p in j.pellets(lying)]
        inserted = [p for p in tried if p.state == job.PelletState.Inserted]
        text, interval, _ = share(len(inserted), len(tried))
        if inserted:
            text += f", {np.mean([p.time for p in inserted]):.1f} s each"
        yield comparison.Row(f"pellets {name}: inserted, by the journal", text, "–", True, interval=interval)
    counts: list[tuple[str, Callable[[job.PelletFigures], int]]] = [
        ("gripped at the first pick", lambda p: p.picks),
        ("inserted at the first attempt", lambda p: p.insertions),
    ]
    for name, count in counts:
        tried = [p for j in jobs for p in j.pellets() if count(p) > 0]
        first = sum(p.state == job.PelletState.Inserted and count(p) == 1 for p in tried)
        text, interval, _ = share(first, len(tried))
        yield comparison.Row(f"pellets in the tube, {name}", text, "–", True, interval=interval)


def task_rows(pellets: int, first_seed: int) -> Iterator[comparison.Row]:
    """Attempts to insert by clearance and tilt, one job each."""
    setups = [make_setup(pellets, first_seed + k, "usual", *task) for k, task in enumerate(TASKS)]
    for (clearance, tilt), done in zip(TASKS, run_jobs(setups, "Tasks")):
        tried = [p for p in done.pellets() if p.insertions > 0]
        inserted = [p for p in tried if p.state == job.PelletState.Inserted]
        text, interval, _ = share(sum(p.insertions == 1 for p in inserted), len(tried))
        text += f", {len(inserted)} in; {np.mean([p.time for p in inserted]):.1f} s each" if inserted else ""
        what = f"job of {pellets}, {clearance:g} mm, tilt {tilt:g}°: in at the first attempt to insert"
        yield comparison.Row(what, text, "–", True, interval=interval)


def kill_row(kills: int, first_seed: int) -> comparison.Row:
    """Jobs of two pellets whose programs are killed, also between the file of the cell and the records."""
    with tempfile.TemporaryDirectory() as folder:
        trial = kill_often(kr5.cell.load_cell(CELL), JobSetup(2, first_seed, "usual"), Path(folder), kills, first_seed)
    text = f"{trial.kills}, {len(trial.problems)} problems; first command {1e3 * trial.largest_first_step:.3f} mm off"
    return comparison.Row(
        "programs killed at random instants: what came of them; first command from the measured pose, most",
        "; ".join([text, *dict.fromkeys(trial.problems)]),
        "none twice, none lost",
        not trial.problems,
    )


def four_row(trials: int, first_seed: int) -> comparison.Row:
    times = [r.time for r in insertions(trials, first_seed, pegs=4)]
    return comparison.Row(
        f"four pellets from a fixed place, hole remembered: median, longest of {trials}",
        f"{np.median(times):.1f}, {max(times):.1f} s",
        f"≤ {FOUR_TIME:g} s",
        max(times) <= FOUR_TIME,
    )


def run_jobs(setups: list[JobSetup], what: str) -> list[Done]:
    """All of them, on all cores."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        runs = [pool.submit(run_job, setup) for setup in setups]
        return [run.result() for run in comparison.progress(runs, what)]


def main() -> int:
    parser = arguments.parser(__doc__)
    parser.add_argument("--jobs", type=int, default=10, help="number of jobs")
    parser.add_argument("--pellets", type=int, default=35, help="pellets of each")
    parser.add_argument("--first-seed", type=int, default=52001, help="seed of the first job; those behind it follow")
    parser.add_argument("--kills", type=int, default=1000, help="programs that are killed")
    given = parser.parse_args()
    seeds = range(given.first_seed, given.first_seed + given.jobs)
    jobs = run_jobs([JobSetup(given.pellets, seed, "usual") for seed in seeds], "Jobs")
    rows = [
        *inserted_rows(jobs, given.pellets),
        *time_rows(jobs),
        force_row(jobs),
        *part_rows(jobs),
        *task_rows(given.pellets, seeds[-1] + 1),
        kill_row(given.kills, given.first_seed),
        four_row(2 * given.jobs, given.first_seed),
    ]
    comparison.print_comparisons(rows, "The job from bin to tube")
    return 0 if all(row.reached for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
