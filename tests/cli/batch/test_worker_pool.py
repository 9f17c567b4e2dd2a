"""Processes of a batch; those that are killed at work are in the tests of the command."""

import os
import time

import pytest
from cli.batch.batch_inputs import only, settings, stack

from dloftbs.cli.batch.status_file import State
from dloftbs.cli.batch.worker_pool import in_processes
from dloftbs.errors import DloftbsError
from dloftbs.support.worker_process import starting_workers


class Poison:
    """Settings that end the process that reads them."""

    def __reduce__(self):
        return os._exit, (3,)


def test_a_process_that_cannot_begin_ends_the_batch(tmp_path):
    item = only(stack(tmp_path / "a.npy", 3), tmp_path / "out")
    with pytest.raises(DloftbsError, match="ended with exit code 3 before it could begin"):
        list(in_processes([item], Poison(), 1))
    assert not item.status.exists()


def test_what_is_closed_ends_at_once_and_leaves_nothing(tmp_path):
    item = only(stack(tmp_path / "a.npy", 20000), tmp_path / "out")
    events = in_processes([item], settings(), 1)
    assert next(event.unfinished for event in events if event.unfinished) > 0
    since = time.monotonic()
    events.close()
    assert time.monotonic() - since < 9.0, "it was killed, and did not end by itself"
    assert list((tmp_path / "out").iterdir()) == []


def test_frames_are_counted_and_the_last_event_of_an_input_is_its_status(tmp_path):
    items = [only(stack(tmp_path / f"{name}.npy", 3), tmp_path / "out") for name in "ab"]
    events = list(in_processes(items, settings(), 1))
    statuses = [event.status for event in events if event.status is not None]
    assert [(status.input, status.state) for status in statuses] == [("a.npy", State.DONE), ("b.npy", State.DONE)]
    assert {event.unfinished for event in events} <= {0, 1, 2, 3}
    assert events[-1].unfinished == 0


def test_variables_are_as_before_once_processes_are_started(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    with starting_workers():
        assert os.environ["OMP_NUM_THREADS"] == os.environ["OPENBLAS_NUM_THREADS"] == "1"
    assert os.environ["OMP_NUM_THREADS"] == "7"
    assert "OPENBLAS_NUM_THREADS" not in os.environ
