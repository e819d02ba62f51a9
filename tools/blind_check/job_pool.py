"""Spreads calls over processes of this machine, or over a Dask cluster, with progress and time left."""

import contextlib
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, as_completed

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

errors = Console(stderr=True, highlight=False)


@contextlib.contextmanager
def _workers(jobs: int | None, scheduler: str | None) -> Iterator[Executor]:
    """Those of Dask are asked as those of this machine are."""
    if scheduler is None:
        with ProcessPoolExecutor(jobs or os.cpu_count()) as pool:
            yield pool
        return
    from dask.distributed import Client

    with Client(scheduler) as client, client.get_executor(pure=False) as executor:
        yield executor


def run_jobs(
    function: Callable, calls: list[tuple], what: str, jobs: int | None = None, scheduler: str | None = None
) -> list:
    """Results in the order of the calls. On Dask the workers must see the same folders."""
    columns = [
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    ]
    out: list = [None] * len(calls)
    hidden = not errors.is_terminal
    with (
        Progress(*columns, console=errors, transient=True, disable=hidden) as progress,
        _workers(jobs, scheduler) as workers,
    ):
        task = progress.add_task(what, total=len(calls))
        numbers = {workers.submit(function, *call): k for k, call in enumerate(calls)}
        for future in as_completed(numbers):
            out[numbers[future]] = future.result()
            progress.advance(task)
    return out
