"""The command ``dloftbs batch``: whatever ends it, the same command goes on, and gives the same results."""

import json
import os
import random
import signal
import sys
import time

import numpy as np
import psutil
import pytest
from cli.batch.batch_inputs import SIZE, contents, stack
from cli.cli_inputs import RED, mask, photo, run, save, start

from dloftbs.cli.batch import batch_report

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")

FRAMES = 1000
"""Of a recording, which takes about half a second."""
DEADLINE_S = 300.0


@pytest.fixture(scope="module")
def recordings(tmp_path_factory):
    """Return a folder with four recordings, and one that cannot be read."""
    folder = tmp_path_factory.mktemp("recordings")
    for i in range(4):
        stack(folder / f"day{i % 2}" / f"{i}.npy", FRAMES, 20 + i)
    (folder / "day1" / "broken.npy").write_bytes(b"nothing")
    return folder


@pytest.fixture(scope="module")
def undisturbed(recordings, tmp_path_factory):
    """Return the results of a run that nothing disturbed, and what it printed."""
    out = tmp_path_factory.mktemp("undisturbed")
    result = run("batch", f"{recordings}/**/*.npy", "--out", out, "--jobs", 2, code=1)
    return contents(out), result


def begin(recordings, out, *more):
    return start("batch", f"{recordings}/**/*.npy", "--out", out, "--jobs", 2, *more, start_new_session=True)


def wait_until(what):
    deadline = time.monotonic() + DEADLINE_S
    while not what():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def parts(out):
    """Return the hidden folders of what is being worked on."""
    return [path for path in out.rglob(".*.part") if path.is_dir()]


def statuses(out):
    return {path.name: json.loads(path.read_text())["state"] for path in sorted(out.rglob("*.status.json"))}


def worker_on(process, name):
    """Return the process that has a file open."""
    for child in psutil.Process(process.pid).children():
        try:
            if any(os.path.basename(file.path).startswith(name) for file in child.open_files()):
                return child
        except psutil.Error:
            continue
    return None


def test_each_input_has_a_result_and_a_status(undisturbed):
    results, result = undisturbed
    names = {f"day{i % 2}/{i}.npy" for i in range(4)}
    made = {f"{name}.jsonl" for name in names} | {f"{name}.status.json" for name in names}
    assert results.keys() == made | {"day1/broken.npy.status.json", "batch.config.yaml"}
    assert all(results[f"{name}.jsonl"].count(b"\n") == FRAMES for name in names)
    table = [line.split()[:3] for line in result.stdout.splitlines()]
    assert table[0] == ["input", "state", "frames"]
    assert ["day1/broken.npy", "failed", "0"] in table
    assert ["day1/3.npy", "done", str(FRAMES)] in table
    assert "warning: failed: day1/broken.npy: " in result.stderr
    assert result.stderr.splitlines()[-1].startswith(f"5 inputs: 4 done, 1 failed; {4 * FRAMES} frames in ")


@pytest.mark.slow
def test_killed_again_and_again_it_gives_the_same_results(recordings, undisturbed, tmp_path):
    chance = random.Random(1)
    for kills in range(2):
        process = begin(recordings, tmp_path)
        wait_until(lambda: parts(tmp_path))
        time.sleep(chance.uniform(0.0, 1.2))
        workers = psutil.Process(process.pid).children()
        process.send_signal(signal.SIGKILL)
        process.communicate(timeout=DEADLINE_S)
        assert psutil.wait_procs(workers, timeout=DEADLINE_S)[1] == []
        assert not parts(tmp_path), "a worker puts away what it is at, even if the first process is killed"
        done = [name for name, state in statuses(tmp_path).items() if state == "done"]
        assert len(done) < 4 or kills == 1
    done = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.jsonl")}
    result = run("batch", f"{recordings}/**/*.npy", "--out", tmp_path, "--jobs", 2, code=1)
    assert contents(tmp_path) == undisturbed[0]
    assert all(path.stat().st_mtime_ns == before for path, before in done.items())
    assert "again" not in result.stderr


@pytest.mark.slow
def test_a_worker_that_is_killed_costs_its_input_alone(recordings, undisturbed, tmp_path):
    process = begin(recordings, tmp_path)
    wait_until(lambda: worker_on(process, "0.npy.jsonl"))
    worker_on(process, "0.npy.jsonl").kill()
    _, stderr = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 1
    assert "failed: day0/0.npy: its process ended by signal 9 (Killed)" in stderr
    assert "Traceback" not in stderr
    assert statuses(tmp_path)["0.npy.status.json"] == "failed"
    assert not parts(tmp_path)
    missing = {name: data for name, data in undisturbed[0].items() if name != "day0/0.npy.jsonl"}
    assert contents(tmp_path) == missing
    again = run("batch", f"{recordings}/**/*.npy", "--out", tmp_path, code=1)
    assert "2 failed" in again.stderr
    again = run("batch", f"{recordings}/**/*.npy", "--out", tmp_path, "--jobs", 1, "--retry-failed", code=1)
    assert "2 of 5 inputs are done again: failed before" in again.stderr
    assert contents(tmp_path) == undisturbed[0]


@pytest.mark.slow
def test_ctrl_c_ends_all_processes_and_leaves_nothing_half_done(recordings, undisturbed, tmp_path):
    process = begin(recordings, tmp_path)
    wait_until(lambda: parts(tmp_path))
    workers = psutil.Process(process.pid).children()
    os.killpg(process.pid, signal.SIGINT)  # as a terminal sends it
    _, stderr = process.communicate(timeout=DEADLINE_S)
    assert process.returncode == 130
    assert stderr.endswith("interrupted\n")
    assert "Traceback" not in stderr
    assert "left" in stderr
    assert psutil.wait_procs(workers, timeout=30)[1] == []
    assert not list(tmp_path.rglob(".*"))
    run("batch", f"{recordings}/**/*.npy", "--out", tmp_path, "--jobs", 1, code=1)
    assert contents(tmp_path) == undisturbed[0]


def test_shards_share_the_inputs(recordings, undisturbed, tmp_path, monkeypatch):
    for task in (1, 2):
        for name, value in (("ID", task), ("MIN", 1), ("COUNT", 2)):
            monkeypatch.setenv(f"SLURM_ARRAY_TASK_{name}", str(value))
        result = run(
            *("batch", f"{recordings}/**/*.npy", "--out", tmp_path, "--shard", "auto", "--limit", 3, "--jobs", 1),
            code=2 - task,
        )
        assert f"{4 - task} inputs: " in result.stderr
    assert sorted(statuses(tmp_path).values()) == ["done"] * 4 + ["failed"]
    result = run("batch", f"{recordings}/**/*.npy", "--out", tmp_path, "--limit", 3, code=1)
    assert "5 inputs: 4 done, 1 failed, 5 of them by an earlier run; 0 frames" in result.stderr


def test_a_shard_without_inputs_is_no_error(tmp_path):
    path = stack(tmp_path / "a.npy", 3)
    assert "0 inputs: none done" in run("batch", path, "--out", tmp_path / "out", "--shard", "2/2").stderr


@pytest.mark.slow
def test_a_changed_setting_or_input_is_said_and_done_again(tmp_path):
    path, out = stack(tmp_path / "a.npy", 3), tmp_path / "out"
    run("batch", path, "--out", out)
    result = run("batch", path, "--out", out, "--set", "linking.objects=1")
    assert "1 of 1 inputs are done again: with other settings" in result.stderr
    assert "objects: 1" in (out / "batch.config.yaml").read_text()
    stack(path, 4)
    result = run("batch", path, "--out", out, "--config", out / "batch.config.yaml")
    assert "1 of 1 inputs are done again: changed since" in result.stderr
    assert "4 frames" in result.stderr


def test_options_reach_the_processes(tmp_path):
    for i in range(6):
        save(tmp_path / "in" / "rgb" / f"{i}.png", photo(40 + i))
        save(tmp_path / "in" / "depth" / f"{i}.png", np.full((100, 200), 600, np.uint16))
    out = tmp_path / "out"
    options = (
        "--hsv",
        RED,
        "--depth",
        "../depth/{stem}.png",
        "--camera",
        "200,200,99.5,49.5",
        "--fps",
        10,
        "--every",
        2,
    )
    run("batch", f"{tmp_path}/in/*b/", "--out", out, *options, "--format", "jsonl")
    rows = [json.loads(line) for line in (out / "rgb.jsonl").read_text().splitlines()]
    assert [row["stamp"] for row in rows] == [0.0, 0.2, 0.4]
    assert all(row["tracks"][0]["curve_3d"] for row in rows)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "--out"),
        (("--out", "out", "--format", "ply"), "--format"),
        (("--out", "out", "--shard", "3/2"), "I/N"),
        (("--out", "out", "--shard", "auto"), "SLURM_ARRAY_TASK_ID"),
        (("--out", "out", "--masks", "masks"), "rules"),
        (("--out", "out", "--jobs", "2", "--scheduler", "tcp://127.0.0.1:1"), "--jobs"),
    ],
)
def test_bad_usage_is_2(tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SLURM_ARRAY_TASK_ID", raising=False)
    stack(tmp_path / "a.npy", 3)
    assert said in run("batch", "a.npy", *arguments, code=2).stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a.npy"]


def test_results_beside_inputs_that_they_would_join_are_refused_before_anything_is_written(tmp_path):
    stack(tmp_path / "a.npy", 3)
    assert "next run" in run("batch", f"{tmp_path}/*", "--out", tmp_path / "out", code=1).stderr
    assert [path.name for path in tmp_path.iterdir()] == ["a.npy"]


def test_a_folder_that_cannot_be_written_ends_the_run(tmp_path):
    path, out = stack(tmp_path / "a.npy", 3), tmp_path / "out"
    (out / "a.npy.jsonl").mkdir(parents=True)
    result = run("batch", path, "--out", out, code=1)
    assert "error: cannot write" in result.stderr
    assert statuses(out) == {}


def test_of_many_inputs_the_table_has_those_alone_with_which_something_is_wrong(tmp_path, monkeypatch):
    monkeypatch.setattr(batch_report, "MAX_ROWS", 1)
    save(tmp_path / "in" / "a" / "0.png", mask(30, SIZE))
    save(tmp_path / "in" / "b" / "0.png", mask(30, SIZE))
    save(tmp_path / "in" / "b" / "1.png", mask(30, SIZE)).write_bytes(b"no picture")
    result = run("batch", f"{tmp_path}/in/*/", "--out", tmp_path / "out", "--jobs", 1, code=1)
    _heading, row = result.stdout.splitlines()
    assert row.split()[:4] == ["b", "partial", "1", "1"]
    assert row.endswith("1 frames could not be read")
