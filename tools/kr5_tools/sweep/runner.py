"""Runs what is done in batches, as the trials of a sweep: in this process, on the cores of this machine, or on a Dask
cluster."""

import contextlib
import importlib.util
import logging
import os
import signal
import time
import warnings
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass
from typing import Any

import kr5
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from kr5_tools.cli import terminal
from kr5_tools.sweep.trials import Grid, Key, Trial, run_batch

MOST_IN_BATCH = 8  # some seconds of work: what a killed worker costs
DEATHS = 20  # workers that may die over one batch before the batch is blamed
SAY_EVERY = 10.0  # [s] where there is no terminal for a bar


def make_batches(keys: list[Key], workers: int) -> list[list[Key]]:
    """Small enough that a killed worker costs seconds and that all workers end together."""
    size = max(1, min(MOST_IN_BATCH, len(keys) // (4 * workers)))
    return [keys[i : i + size] for i in range(0, len(keys), size)]


@dataclass(frozen=True)
class Job:
    """Work that is done in batches, anywhere: `function` of the arguments of a batch gives the version of the library
    and a list of what came of it, whichever process runs it."""

    function: Callable[..., tuple[str, list[Any]]]
    batches: Callable[[int], list[tuple[Any, ...]]]  # for a number of workers
    total: int
    doing: str  # beside the bar
    things: str  # what is counted


def run_trials(
    cell: str, keys: list[Key], grid: Grid, workers: int, scheduler: str | None, keep: Callable[[list[Trial]], None]
) -> None:
    """Runs all trials; `keep` gets them as they are finished."""

    def batches(count: int) -> list[tuple[Any, ...]]:
        return [
            (cell, batch, grid.insert_by, grid.seed) for batch in make_batches(keys, count if count > 1 else len(keys))
        ]

    run_job(Job(run_batch, batches, len(keys), "inserting", "trials"), workers, scheduler, keep)


def run_job(job: Job, workers: int, scheduler: str | None, keep: Callable[[list[Any]], None]) -> None:
    """Runs all of a job; `keep` gets what is finished, batch by batch."""
    if not job.total:
        return
    finished = on_dask(job, workers, scheduler) if scheduler or workers > 1 else run_in_process(job)
    with progress_bar(job) as advance, contextlib.closing(finished):
        for version, results in finished:
            check_version(version, scheduler)
            keep(results)
            advance(len(results))


def run_in_process(job: Job) -> Generator[tuple[str, list[Any]], None, None]:
    for batch in job.batches(1):
        yield job.function(*batch)


def on_dask(job: Job, workers: int, scheduler: str | None) -> Generator[tuple[str, list[Any]], None, None]:
    """Batches as they are finished. A batch whose worker died is run again by another one."""
    if importlib.util.find_spec("distributed") is None:
        raise kr5.InvalidArgument(
            "several workers need Dask, which is not installed: pip install 'kr5[cluster]' (or use --workers 1)"
        )
    import dask
    from dask.distributed import KilledWorker, as_completed

    with (
        dask.config.set({"distributed.scheduler.allowed-failures": DEATHS}),
        open_cluster(workers, scheduler) as client,
    ):
        count = len(client.ncores()) or workers
        futures = [client.submit(job.function, *batch, pure=False) for batch in job.batches(count)]
        for future in as_completed(futures, loop=client.loop):
            try:
                yield future.result()
            except ImportError as error:
                raise kr5.InvalidArgument(
                    f"--scheduler {scheduler}: a worker has no kr5 with its simulator and commands ({error}): pip"
                    " install kr5 where the workers run"
                ) from error
            except KilledWorker:
                raise kr5.InvalidArgument(
                    f"{DEATHS} workers ended during the same {job.things}; is there enough memory? Finished"
                    f" {job.things} are kept, and the same command continues"
                ) from None
            future.release()


@contextlib.contextmanager
def open_cluster(workers: int, scheduler: str | None) -> Iterator[Any]:
    """A client of the scheduler named, or of workers of our own, which are gone with it."""
    from dask.distributed import Client, LocalCluster
    from distributed.comm import resolve_address

    logging.getLogger("distributed").setLevel(
        logging.ERROR
    )  # a worker that dies is replaced, and not the user's concern
    if scheduler:
        try:
            resolve_address(scheduler)  # a client that fails at this takes long to go
            client = Client(scheduler, timeout="10s", set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise kr5.InvalidArgument(
                f"--scheduler {scheduler}: there is no scheduler ({error}); start one with `dask scheduler`, and"
                " workers with `dask worker ADDRESS`"
            ) from error
        with client:
            if not client.ncores():
                warnings.warn(
                    f"{scheduler} has no worker yet; waiting for one, start it with: dask worker {scheduler}",
                    kr5.Caution,
                    stacklevel=2,
                )
            yield client
        return
    # Where Ctrl-C ends this process at once, a helper of Python's would complain of what the workers leave to it.
    os.environ.setdefault("PYTHONWARNINGS", "ignore::UserWarning:multiprocessing.resource_tracker")
    with ignore_sigint():
        try:
            own = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                dashboard_address=None,
                memory_limit=0,
                silence_logs=logging.ERROR,
            )
        except (RuntimeError, OSError, TimeoutError) as error:  # "Nanny failed to start"
            raise kr5.InvalidArgument(
                f"--workers {workers}: a worker ended during its start ({error}); is there enough memory for this"
                " number? The same command continues; --workers 1 runs without workers"
            ) from error
    with own, Client(own, set_as_default=False) as client:
        yield client


@contextlib.contextmanager
def ignore_sigint() -> Iterator[None]:
    """Processes that are started inside do not hear Ctrl-C, which a terminal sends to all of them: this one ends
    them."""
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


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
