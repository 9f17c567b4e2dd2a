"""Jobs on a cluster of dask."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeVar

from dloftbs.errors import InputError

J = TypeVar("J")
R = TypeVar("R")

_PATIENCE_S = "30s"
"""Time to wait for a scheduler to answer."""


def run_on_cluster(
    work: Callable[[J], R], died: Callable[[J, int | None], R], jobs: Iterable[J], address: str
) -> Iterator[tuple[J, R]]:
    """Yield each job with its result, as they get ready; what a worker that dies was at is done again by another.

    Parameters
    ----------
    work : callable
        A function of a module, which workers import.
    died : callable
        Makes the result of a job that killed several workers, or that they could not run; its exit code is not known.
    jobs : iterable
    address : str
        Of the scheduler, as in ``tcp://host:8786``.

    Raises
    ------
    InputError
        If dask.distributed is not installed, or nothing answers at the address.
    """
    try:
        distributed: Any = importlib.import_module("distributed")
    except ImportError as missing:
        raise InputError("--scheduler needs dask.distributed: pip install 'dloftbs[cluster]'") from missing
    try:
        client = distributed.Client(address, timeout=_PATIENCE_S)
    except (OSError, ValueError) as error:
        raise InputError(f"no scheduler answers at {address}: {error}") from error
    with client:
        futures = {client.submit(work, job, pure=False): job for job in jobs}
        for future in distributed.as_completed(list(futures)):
            job = futures.pop(future)
            yield job, future.result() if future.status == "finished" else died(job, None)
