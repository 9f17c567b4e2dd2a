"""Many recordings: each has a result, a broken one stops nothing, and what was stopped goes on."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import time
from dataclasses import replace
from pathlib import Path

import click
import pytest
from cli import batch_workers
from cli.cli_inputs import mask, run, save, start
from ros import bag_examples as bags

from dloftbs import SourceError
from dloftbs.cli import batch_job
from dloftbs.cli.batch_inputs import list_inputs, of_shard, read_shard
from dloftbs.cli.batch_job import Job, finished, run_job
from dloftbs.cli.batch_report import table
from dloftbs.cli.options import InputOptions
from dloftbs.cli.worker_processes import run_in_processes
from dloftbs.config import Config

RED = ("--hsv", "170:10")
CONFIG = Config().replace({"segmentation.hsv": ("170:10",)})
OPTIONS = InputOptions("auto", None, None, None, None, None, None)


@pytest.fixture
def recordings(tmp_path, monkeypatch) -> Path:
    """Return the current folder with four recordings in it: one in a folder below, one broken."""
    monkeypatch.chdir(tmp_path)
    Path("recordings/day").mkdir(parents=True)
    for name, count in (("recordings/run10.mcap", 5), ("recordings/run2.mcap", 4), ("recordings/day/run2.mcap", 3)):
        bags.write_mcap(Path(name), bags.entries(count, depth=False))
    Path("recordings/broken.mcap").write_bytes(b"no recording at all")
    return tmp_path


def jobs_of(*patterns: str, out: str = "results", suffix: str = ".jsonl") -> list[Job]:
    return [Job(one, out, suffix, CONFIG, OPTIONS) for one in list_inputs(patterns)]


def results(folder: str) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(Path(folder).rglob("*")) if p.is_file()}


def test_each_recording_has_its_result_and_a_second_run_goes_on(recordings):
    command = ("batch", "recordings/**/*.mcap", *RED, "--out", "results", "--jobs", "2")
    said = run(*command, code=1).stderr
    assert "3 done, 0 of them before; 1 failed; 12 frames" in said
    assert "cannot be read as a recording" in said
    names = {"broken.mcap.status.json", "day/run2.mcap.status.json", "run10.mcap.status.json", "run2.mcap.status.json"}
    names |= {"day/run2.mcap.jsonl", "run10.mcap.jsonl", "run2.mcap.jsonl"}
    first = results("results")
    assert first.keys() == names
    assert Path("results.config.yaml").exists()
    rows = [json.loads(line) for line in first["run10.mcap.jsonl"].splitlines()]
    run("track", "recordings/run10.mcap", *RED, "--out", "alone.jsonl")
    alone = [json.loads(line) for line in Path("alone.jsonl").read_text().splitlines()]
    assert rows == [{**row, "stage_ms": {}} for row in alone]
    status = json.loads(first["run10.mcap.status.json"])
    assert (status["state"], status["frames"], status["skipped"], status["tracks"]) == ("done", 5, 0, 1)

    times = {name: Path("results", name).stat().st_mtime_ns for name in names}
    bags.write_mcap(Path("recordings/broken.mcap"), bags.entries(2, depth=False))
    said = run(*command).stderr
    assert "4 done, 3 of them before; 0 failed; 14 frames" in said
    changed = {name for name in names if Path("results", name).stat().st_mtime_ns != times[name]}
    assert changed == {"broken.mcap.status.json"}


def test_a_run_that_was_killed_and_run_again_gives_the_same_bytes(recordings):
    """Killed without a chance to clean up, first while it writes the first result, then once there is one."""
    pattern = "recordings/**/run*.mcap"
    for job in jobs_of(pattern, out="undisturbed"):
        assert run_job(job).state == "done"
    command = ("batch", pattern, *RED, "--out", "results", "--jobs", "2")
    for awaited in ("**/.part.*.jsonl", "**/*.status.json"):
        with start(*command) as process:
            while process.poll() is None and not list(Path("results").glob(awaited)):
                time.sleep(0.001)
            os.kill(process.pid, signal.SIGKILL)
    said = run(*command).stderr
    assert "3 done" in said
    assert "3 done, 0 of them before" not in said
    written = {name: data for name, data in results("results").items() if not Path(name).name.startswith(".")}
    assert written == results("undisturbed")


def test_a_job_that_nothing_has_changed_of_is_finished(recordings):
    (job,) = jobs_of("recordings/run2.mcap")
    assert finished(job) is None
    outcome = run_job(job)
    assert finished(job) == outcome
    assert finished(replace(job, config=Config())) is None
    assert finished(replace(job, inputs=replace(OPTIONS, kind="image"))) is None
    assert finished(replace(job, suffix=".csv")) is None
    os.utime(job.given.path, ns=(1, 1))
    assert finished(job) is None
    run_job(job)
    job.result.unlink()
    assert finished(job) is None
    job.status.write_text("{")
    assert finished(job) is None


@pytest.mark.parametrize("suffix", [".jsonl", ".npz", ".csv"])
def test_results_are_the_same_bytes_whenever_they_are_made(recordings, suffix):
    for out in ("one", "two"):
        for job in jobs_of("recordings/run*.mcap", out=out, suffix=suffix):
            assert run_job(job).state == "done"
    assert results("one") == results("two")


def test_failures_of_any_kind_are_outcomes(recordings, monkeypatch):
    (job,) = jobs_of("recordings/run2.mcap")
    without = run_job(replace(job, config=Config()))
    assert (without.state, "nothing says what in it is cable" in str(without.error)) == ("failed", True)

    def broken(_job):
        raise RuntimeError("a bug")

    with monkeypatch.context() as patch:
        patch.setattr(batch_job, "_track", broken)
        assert run_job(job).error == "unexpected RuntimeError: a bug"
    assert json.loads(job.status.read_text())["state"] == "failed"
    Path("blocked").write_text("")
    blocked = run_job(replace(job, out="blocked"))
    assert blocked.state == "failed"
    assert "cannot write" in str(blocked.error)


def test_warnings_are_part_of_the_status(recordings):
    data = Path("recordings/run10.mcap").read_bytes()
    Path("recordings/run10.mcap").write_bytes(data[: len(data) // 2])
    (job,) = jobs_of("recordings/run10.mcap")
    outcome = run_job(job)
    assert outcome.state == "done"
    assert "read as far as it goes" in outcome.warnings[0]
    assert "read as far as it goes" in table([outcome], 0)
    assert finished(job) == outcome


def test_inputs_in_natural_order_with_folders_of_recordings_as_one(recordings):
    bags.write_ros2(Path("recordings/bag"), bags.entries(1))
    found = [(one.path, one.result) for one in list_inputs(["recordings/**/*.mcap"])]
    assert found == [
        ("recordings/bag", "bag"),
        ("recordings/broken.mcap", "broken.mcap"),
        ("recordings/day/run2.mcap", "day/run2.mcap"),
        ("recordings/run2.mcap", "run2.mcap"),
        ("recordings/run10.mcap", "run10.mcap"),
    ]
    assert [one.result for one in list_inputs(["recordings/bag/*.mcap", "recordings/bag"])] == ["bag"]


def test_inputs_that_are_not_there_or_would_have_one_result(recordings):
    with pytest.raises(SourceError, match="nothing matches the pattern"):
        list_inputs(["elsewhere/*.mcap"])
    with pytest.raises(SourceError, match="there is no file or folder"):
        list_inputs(["gone.mcap"])
    with pytest.raises(click.UsageError, match="would have the same result"):
        list_inputs(["recordings/run2.mcap", "recordings/day/run2.mcap"])


def test_a_result_replaces_no_input(recordings):
    Path("frames").mkdir()
    for i in range(2):
        save(Path(f"frames/{i}.png"), mask())
    run("track", "frames", "--out", "frames.npz")
    said = run("batch", "frames", "frames.npz", "--out", ".", "--format", "npz", code=2).stderr
    assert "would replace an input" in said
    run("batch", "frames", "--out", "x", "--depth", "depth/", code=2)


@pytest.mark.parametrize(
    ("text", "environment", "expected"),
    [
        (None, {}, (1, 1)),
        ("2/8", {}, (2, 8)),
        ("auto", {"SLURM_ARRAY_TASK_ID": "5", "SLURM_ARRAY_TASK_COUNT": "4", "SLURM_ARRAY_TASK_MIN": "3"}, (3, 4)),
        ("auto", {"SLURM_ARRAY_TASK_ID": "0", "SLURM_ARRAY_TASK_COUNT": "4"}, (1, 4)),
        ("auto", {"SLURM_PROCID": "3", "SLURM_NTASKS": "4"}, (4, 4)),
    ],
)
def test_shards(text, environment, expected):
    assert read_shard(text, environment) == expected


@pytest.mark.parametrize(
    ("text", "environment"),
    [
        ("0/4", {}),
        ("5/4", {}),
        ("1", {}),
        ("a/b", {}),
        ("auto", {}),
        ("auto", {"SLURM_PROCID": "x", "SLURM_NTASKS": "4"}),
    ],
)
def test_shards_that_are_none(text, environment):
    with pytest.raises(click.UsageError, match="--shard must be I/N"):
        read_shard(text, environment)


def test_shards_are_all_inputs_once(recordings):
    inputs = list_inputs(["recordings/**/*.mcap"])
    parts = [of_shard(inputs, (i, 3)) for i in (1, 2, 3)]
    assert sorted(one.path for part in parts for one in part) == sorted(one.path for one in inputs)


def test_a_process_that_dies_costs_its_job_alone():
    done = dict(run_in_processes(batch_workers.square, batch_workers.died, [1, 2, 3, 4, 5], 2))
    assert done == {1: 1, 2: 4, 3: -3007, 4: 16, 5: 25}


def test_processes_end_when_nobody_wants_their_results():
    running = run_in_processes(batch_workers.square, batch_workers.died, [1, 10, 11], 2)
    assert next(running) == (1, 1)
    running.close()
    assert not multiprocessing.active_children()
