"""Workers of a dask cluster that work on inputs, on as many machines as it has."""

from __future__ import annotations

import asyncio
import time
import uuid
from collections.abc import Generator, Sequence
from typing import Any

from dloftbs.cli.batch.input_list import BatchInput
from dloftbs.cli.batch.input_run import record_death, run_input
from dloftbs.cli.batch.settings import BatchSettings
from dloftbs.cli.batch.status_file import Event
from dloftbs.errors import DloftbsError
from dloftbs.pipeline.kernel_loading import load_kernels

TICK_S = 0.2
"""Time after which who waits is asked whether to go on."""
PATIENCE_S = 10.0
"""Time in which a scheduler has to answer."""


def in_cluster(items: Sequence[BatchInput], settings: BatchSettings, address: str) -> Generator[Event, None, None]:
    """Let the workers of a cluster work on inputs, and yield what happens, every now and then nothing.

    They see the inputs and the folder of the results under the same paths. The input of a worker that dies is begun
    again by another one, as often as the scheduler's setting `allowed-failures` has it. Closing this takes back what
    has not begun.

    Raises
    ------
    SinkError
        If a result cannot be written.
    DloftbsError
        If dask is not installed, no scheduler answers, or it loses its tasks.
    """
    try:
        from distributed import Client, KilledWorker, as_completed
    except ImportError as error:
        raise DloftbsError("--scheduler needs dask's distributed: pip install 'dloftbs[cluster]'") from error
    with _connected(Client, address) as client:
        # One worker a machine: the others find the kernels in its cache.
        client.run(
            load_kernels, workers=list({worker.rpartition(":")[0]: worker for worker in client.nthreads()}.values())
        )
        batch = uuid.uuid4().hex
        futures = {
            client.submit(run_input, item, settings, key=f"dloftbs-{batch}-{number}", pure=False): item
            for number, item in enumerate(items)
        }
        try:
            done = as_completed(futures)
            while not done.is_empty():
                if not done.has_ready():
                    time.sleep(TICK_S)
                    yield Event()
                    continue
                future = next(done)
                if future.cancelled():
                    raise DloftbsError(f"the scheduler {address} has lost its tasks; the same command goes on")
                failure = future.exception()
                if isinstance(failure, KilledWorker):
                    why = "its worker died, and others that began it again did: too little memory, or a crash"
                    yield Event(record_death(futures[future], settings, why))
                elif failure is not None:
                    raise failure
                else:
                    yield Event(future.result())
        finally:
            client.cancel(list(futures))


def _connected(client: Any, address: str) -> Any:
    try:
        return client(address, timeout=PATIENCE_S)
    except (OSError, ValueError, asyncio.TimeoutError) as error:  # the last is no OSError before Python 3.11
        raise DloftbsError(f"no scheduler of dask answers at {address!r}: {error}") from error
