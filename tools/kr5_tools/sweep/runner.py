"""Runs what is done in batches, as the trials of a sweep: in this process, in others of this machine, or on a Dask
cluster."""

import contextlib
import os
import time
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any

import kr5
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from kr5_tools.cli import terminal
from kr5_tools.sweep.trials import Grid, Key, Trial, run_batch
from kr5_tools.sweep.workers import PATIENCE, Workers, cluster_workers, local_workers

MOST_IN_BATCH = 8  # some seconds of work: what a killed worker costs
DEATHS = 3  # of workers during one batch before the batch is blamed
SAY_EVERY = 10.0  # [s] where there is no terminal for a bar

Batch = tuple[Any, ...]  # arguments of a call
Finished = tuple[str, list[Any]]  # what a call gives: version of the library, results


def make_batches(keys: list[Key], workers: int) -> list[list[Key]]:
    """Small enough that a killed worker costs seconds and that all workers end together."""
    size = max(1, min(MOST_IN_BATCH, len(keys) // (4 * workers)))
    return [keys[i : i + size] for i in range(0, len(keys), size)]


@dataclass(frozen=True)
class Job:
    """Work that is done in batches, anywhere: `function` of the arguments of a batch gives the version of the library
    and a list of what came of it, whichever process runs it."""

    function: Callable[..., Finished]
    batches: Callable[[int], list[Batch]]  # for a number of workers
    total: int
    doing: str  # beside the bar
    things: str  # what is counted


def run_trials(
    cell: str, keys: list[Key], grid: Grid, workers: int, scheduler: str | None, keep: Callable[[list[Trial]], None]
) -> None:
    """Runs all trials; `keep` gets them as they are finished."""

    def batches(count: int) -> list[Batch]:
        return [
            (cell, batch, grid.insert_by, grid.seed) for batch in make_batches(keys, count if count > 1 else len(keys))
        ]

    run_job(Job(run_batch, batches, len(keys), "inserting", "trials"), workers, scheduler, keep)


def run_job(job: Job, workers: int, scheduler: str | None, keep: Callable[[list[Any]], None]) -> None:
    """Runs all of a job; `keep` gets what is finished, batch by batch."""
    if not job.total:
        return
    if scheduler:
        finished = run_on_workers(job, cluster_workers(scheduler))
    elif workers > 1:
        finished = run_on_workers(job, local_workers(workers))
    else:
        finished = run_in_process(job)
    with progress_bar(job) as advance, contextlib.closing(finished):
        for version, results in finished:
            check_version(version, scheduler)
            keep(results)
            advance(len(results))


def run_in_process(job: Job) -> Generator[Finished, None, None]:
    for batch in job.batches(1):
        yield job.function(*batch)


def run_on_workers(job: Job, opened: AbstractContextManager[Workers]) -> Generator[Finished, None, None]:
    """Batches as they are finished. A batch whose worker died is run again."""
    with opened as workers:
        batches = job.batches(max(1, workers.count()))
        todo, running, deaths = list(reversed(range(len(batches)))), dict[Future[Finished], int](), Counter[int]()
        while todo or running:
            while todo and len(running) <= workers.count():  # one more than run, which is at hand
                number = todo.pop()
                running[workers.submit(job.function, *batches[number])] = number
            done, _ = wait(running, timeout=PATIENCE, return_when=FIRST_COMPLETED)
            if not done:
                workers.check()
            for future in done:
                number = running.pop(future)
                try:
                    finished = future.result()
                except workers.died:
                    todo.append(number)
                    deaths[number] += 1
                    check_deaths(deaths[number], job)
                else:
                    yield finished


def check_deaths(count: int, job: Job) -> None:
    """Blames a batch for the end of workers after DEATHS of them."""
    if count == DEATHS:
        raise kr5.InvalidArgument(
            f"{DEATHS} workers ended during the same {job.things}; is there enough memory? Finished {job.things} are"
            " kept, and the same command continues; --workers 1 runs without workers"
        )


def check_version(found: str, scheduler: str | None) -> None:
    if found != kr5.__version__:
        raise kr5.InvalidArgument(
            f"--scheduler {scheduler}: a worker has kr5 {found}, but this machine has"
            f" {kr5.__version__}; install the same version"
        )


@contextlib.contextmanager
def progress_bar(job: Job) -> Iterator[Callable[[int], None]]:
    """A bar with the time left; in a log a line now and then."""
    columns = [
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    ]
    begin = said = time.monotonic()
    done = 0
    with terminal.progress_bar(*columns) as bar:
        task = bar.add_task(job.doing, total=job.total)

        def advance(count: int) -> None:
            nonlocal done, said
            done += count
            bar.advance(task, count)
            now = time.monotonic()
            if not terminal.errors.is_terminal and now - said > SAY_EVERY and done < job.total:
                said = now
                terminal.errors.print(
                    f"{done} of {job.total} {job.things}, about {(now - begin) / done * (job.total - done):.0f} s left"
                )

        yield advance


def core_count() -> int:
    """Those that this process may use."""
    return len(os.sched_getaffinity(0))
