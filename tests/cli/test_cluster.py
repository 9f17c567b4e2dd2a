"""A batch on a local cluster, of which a worker is killed."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from pathlib import Path

import pytest
from cli import batch_workers
from cli.cli_inputs import run
from ros import bag_examples as bags

from dloftbs import InputError
from dloftbs.cli.batch_inputs import list_inputs
from dloftbs.cli.batch_job import Job, run_job
from dloftbs.cli.cluster import run_on_cluster
from dloftbs.cli.options import InputOptions
from dloftbs.config import Config

distributed = pytest.importorskip("distributed")
pytestmark = pytest.mark.filterwarnings("ignore")  # those of dask are not ours


@pytest.fixture
def cluster(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, host="127.0.0.1", dashboard_address=None
    ) as started:
        yield started


def test_a_worker_that_is_killed_costs_nothing(cluster):
    Path("recordings").mkdir()
    for i in range(4):
        bags.write_mcap(Path(f"recordings/{i}.mcap"), bags.entries(30, depth=False))
    config = Config().replace({"segmentation.hsv": ("170:10",)})
    options = InputOptions("auto", None, None, None, None, None, None)
    for one in list_inputs(["recordings/*.mcap"]):
        assert run_job(Job(one, "alone", ".jsonl", config, options)).state == "done"

    def kill() -> None:
        while not list(Path("results").glob(".part.*.jsonl")):
            time.sleep(0.001)
        os.kill(next(iter(cluster.workers.values())).pid, signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    command = ("batch", "recordings/*.mcap", "--hsv", "170:10", "--out", "results")
    said = run(*command, "--scheduler", cluster.scheduler_address).stderr
    killer.join()
    assert "4 done, 0 of them before; 0 failed" in said
    for i in range(4):
        assert Path(f"results/{i}.mcap.jsonl").read_bytes() == Path(f"alone/{i}.mcap.jsonl").read_bytes()


def test_results_of_a_cluster(cluster):
    done = dict(run_on_cluster(batch_workers.square, batch_workers.died, [1, 2, 4], cluster.scheduler_address))
    assert done == {1: 1, 2: 4, 4: 16}


def test_a_scheduler_that_is_not_there(monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr("dloftbs.cli.cluster._PATIENCE_S", "1s")
        with pytest.raises(InputError, match="no scheduler answers at tcp"):
            list(run_on_cluster(batch_workers.square, batch_workers.died, [1], "tcp://127.0.0.1:9"))
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"pip install 'dloftbs\[cluster\]'"):
        list(run_on_cluster(batch_workers.square, batch_workers.died, [1], "tcp://127.0.0.1:9"))


def test_jobs_are_for_processes_here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bags.write_mcap(Path("run.mcap"), bags.entries(1))
    run("batch", "run.mcap", "--hsv", "170:10", "--out", "r", "--jobs", "2", "--scheduler", "tcp://127.0.0.1:9", code=2)
