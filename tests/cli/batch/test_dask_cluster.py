"""A batch on a dask cluster of this machine, whose workers may be killed."""

import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from cli.batch.batch_inputs import contents, stack
from cli.cli_inputs import run, start

pytest.importorskip("distributed", reason="needs the extra cluster")
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

FRAMES = 1000
"""Of a recording, which takes about half a second."""


@pytest.fixture
def cluster():
    """Start a cluster, and return its address and the processes of its workers."""
    command = [sys.executable, str(Path(__file__).with_name("local_cluster.py"))]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, text=True, **pipes) as process:
        address, *pids = process.stdout.readline().split()
        yield address, [psutil.Process(int(pid)) for pid in pids]
        process.stdin.close()
        process.wait(60)


@pytest.fixture
def recordings(tmp_path):
    for i in range(4):
        stack(tmp_path / "rec" / f"{i}.npy", FRAMES, 20 + i)
    (tmp_path / "rec" / "broken.npy").write_bytes(b"nothing")
    return tmp_path / "rec"


@pytest.mark.slow
def test_the_input_of_a_killed_worker_is_done_by_another_one(cluster, recordings, tmp_path):
    address, workers = cluster
    out = tmp_path / "out"
    process = start("batch", f"{recordings}/*.npy", "--out", out, "--scheduler", address)
    deadline = time.monotonic() + 300
    while not (busy := [worker for worker in workers if any(".part" in file.path for file in worker.open_files())]):
        assert time.monotonic() < deadline
        time.sleep(0.02)  # leaves the core to the cluster, which loads its kernels meanwhile
    busy[0].send_signal(signal.SIGKILL)
    stdout, stderr = process.communicate(timeout=300)
    assert process.returncode == 1, stderr
    assert "warning: failed: broken.npy" in stderr
    assert "5 inputs: 4 done, 1 failed" in stderr
    assert "Traceback" not in stderr
    assert stdout.count("done") == 4
    run("batch", f"{recordings}/*.npy", "--out", tmp_path / "local", code=1)
    assert contents(out) == contents(tmp_path / "local")


def test_without_a_scheduler_it_ends_with_a_word(recordings, tmp_path, monkeypatch):
    monkeypatch.setattr("dloftbs.cli.batch.dask_cluster.PATIENCE_S", 0.5)
    result = run("batch", f"{recordings}/*.npy", "--out", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:9", code=1)
    assert "no scheduler of dask answers at 'tcp://127.0.0.1:9'" in result.stderr


def test_an_address_that_is_none_is_an_error(recordings, tmp_path):
    result = run("batch", f"{recordings}/*.npy", "--out", tmp_path / "out", "--scheduler", "nonsense://x", code=1)
    assert "error: no scheduler of dask answers" in result.stderr


def test_without_dask_it_says_what_to_install(recordings, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    result = run("batch", f"{recordings}/*.npy", "--out", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:9", code=1)
    assert "pip install 'dloftbs[cluster]'" in result.stderr
