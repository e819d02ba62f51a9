"""Spreads calls over processes of this machine, or over a Dask cluster, with progress and time left."""

import os
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

errors = Console(stderr=True, highlight=False)


def _finished(
    function: Callable, calls: list[tuple], jobs: int | None, scheduler: str | None
) -> Iterator[tuple[int, object]]:
    if scheduler:
        from dask.distributed import Client
        from dask.distributed import as_completed as dask_completed

        with Client(scheduler) as client:
            futures = {client.submit(function, *call, pure=False): k for k, call in enumerate(calls)}
            for future, result in dask_completed(list(futures), with_results=True):
                yield futures[future], result
        return
    with ProcessPoolExecutor(jobs or os.cpu_count()) as pool:
        futures = {pool.submit(function, *call): k for k, call in enumerate(calls)}
        for future in as_completed(futures):
            yield futures[future], future.result()


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
    with Progress(*columns, console=errors, transient=True, disable=not errors.is_terminal) as progress:
        task = progress.add_task(what, total=len(calls))
        for k, result in _finished(function, calls, jobs, scheduler):
            out[k] = result
            progress.advance(task)
    return out
