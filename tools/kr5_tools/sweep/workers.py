"""Processes that work for a long run: those of this machine, or those of a Dask cluster."""

import contextlib
import importlib.util
import logging
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass
from typing import Any

import kr5

from kr5_tools.sweep.processes import Processes, WorkerDied

PATIENCE = 60.0  # [s] for which a scheduler may be without workers


@dataclass(frozen=True)
class Workers:
    """What runs functions in other processes."""

    submit: Callable[..., Future[Any]]  # function, arguments
    count: Callable[[], int]  # of calls that run at once, now
    died: type[BaseException]  # what a call raises whose worker died
    check: Callable[[], None]  # raises kr5.Error when none is left


@contextlib.contextmanager
def local_workers(count: int) -> Iterator[Workers]:
    """Processes on this machine, which are gone at the end."""
    try:
        processes = Processes(count)
    except OSError as error:
        raise kr5.InvalidArgument(
            f"--workers {count}: so many processes cannot be started ({error}); choose a smaller number"
        ) from error
    try:
        yield Workers(processes.submit, lambda: count, WorkerDied, lambda: None)
    finally:
        processes.end()


@contextlib.contextmanager
def cluster_workers(scheduler: str) -> Iterator[Workers]:
    """The workers of a Dask scheduler; those that come later work, too."""
    if importlib.util.find_spec("distributed") is None:
        raise kr5.InvalidArgument(
            "--scheduler needs Dask, which is not installed: pip install 'kr5[cluster]' (or leave it out: the processes"
            " of --workers need nothing more)"
        )
    from dask.distributed import KilledWorker
    from distributed.client import ClosedClientError
    from distributed.comm import CommClosedError

    with _open_client(scheduler) as client:

        def count() -> int:
            return sum(client.ncores().values())

        def check() -> None:
            if not count():
                raise kr5.InvalidArgument(
                    f"--scheduler {scheduler}: there was no worker for {PATIENCE:g} s; start one with: dask worker"
                    f" {scheduler}"
                )

        if not count():
            warnings.warn(
                f"{scheduler} has no worker yet; waiting up to {PATIENCE:g} s for one, start it with: dask worker"
                f" {scheduler}",
                kr5.Caution,
                stacklevel=2,
            )
        executor = client.get_executor(pure=False)
        try:
            yield Workers(executor.submit, count, KilledWorker, check)
        except ImportError as error:
            raise kr5.InvalidArgument(
                f"--scheduler {scheduler}: a worker has no kr5 with its simulator and commands ({error}): pip"
                " install kr5 where the workers run"
            ) from error
        except kr5.Error:
            raise
        except (CancelledError, CommClosedError, ClosedClientError, OSError) as error:
            raise kr5.InvalidArgument(
                f"--scheduler {scheduler}: the scheduler is gone; the same command continues"
            ) from error
        finally:
            with contextlib.suppress(OSError, ClosedClientError):  # of a scheduler that is gone
                executor.shutdown(wait=False)


def _open_client(scheduler: str) -> Any:
    from dask.distributed import Client
    from distributed.comm import resolve_address

    logging.getLogger("distributed").setLevel(logging.ERROR)  # a worker that dies is not the user's concern
    try:
        resolve_address(scheduler)  # a client that fails at this takes long to go
        return Client(scheduler, timeout="10s", set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise kr5.InvalidArgument(
            f"--scheduler {scheduler}: there is no scheduler ({error}); start one with `dask scheduler`, and"
            " workers with `dask worker ADDRESS`"
        ) from error
