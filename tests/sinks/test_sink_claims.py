"""Nobody writes what somebody else writes; who is gone keeps nobody out."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest
import sinks.sink_examples as examples
from sinks.sink_examples import open_sink

from dloftbs import sinks
from dloftbs.errors import SinkError
from dloftbs.support import claims
from dloftbs.support.claims import Claim

WRITER = Path(__file__).with_name("process_that_writes.py")
NAMES = ("a.jsonl", "a.npz", "a.csv", "b.ply", "a.usda", "a.xml", "a.json", "a.mp4", "pictures/", "c.labelme/")


def start(folder, *names):
    """Start a process that has written two frames, and waits."""
    command = [sys.executable, str(WRITER), "0", *(f"{folder}/{name}" for name in names)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    assert process.stdout.readline() == "writing\n"
    return process


def contents(folder):
    return {path: path.read_bytes() for path in Path(folder).rglob("*") if path.is_file()}


def test_a_second_process_is_refused_and_the_first_loses_nothing(tmp_path):
    with start(tmp_path, *NAMES) as first:
        before = contents(tmp_path)
        for name in NAMES:
            with pytest.raises(SinkError, match=r"somebody else.*wait"):
                open_sink(f"{tmp_path}/{name}")
        assert contents(tmp_path) == before
        first.stdin.close()
        assert first.wait(30) == 0
    assert len(list(sinks.read_json_lines(tmp_path / "a.jsonl"))) == 2
    for name in NAMES:
        open_sink(f"{tmp_path}/{name}").close()
    assert [path for path in tmp_path.rglob("*") if path.suffix in (".lock", ".tmp")] == []


def test_a_killed_process_keeps_nobody_out(tmp_path):
    with start(tmp_path, *NAMES) as first:
        first.kill()
    for name in NAMES:
        with open_sink(f"{tmp_path}/{name}") as sink:
            sink.write(examples.frame(), examples.detected(in_space=True))
    assert [path for path in tmp_path.rglob("*") if path.suffix == ".lock"] == []


@pytest.mark.parametrize("name", NAMES)
def test_two_sinks_in_one_process(tmp_path, name):
    with open_sink(f"{tmp_path}/{name}"), pytest.raises(SinkError, match="somebody else"):
        open_sink(f"{tmp_path}/{name}")
    open_sink(f"{tmp_path}/{name}").close()


@pytest.mark.parametrize("name", ["a.jsonl", "a.npz", "a.csv", "b.ply", "a.usda", "a.xml", "a.json"])
def test_a_sink_that_cannot_be_opened_holds_nothing(tmp_path, name):
    (tmp_path / name).mkdir()
    with pytest.raises(SinkError, match="Is a directory"):
        open_sink(f"{tmp_path}/{name}")
    (tmp_path / name).rmdir()
    open_sink(f"{tmp_path}/{name}").close()


def test_a_link_is_the_file_that_it_leads_to(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "b.jsonl").symlink_to("folder/a.jsonl")
    with sinks.open(tmp_path / "b.jsonl"), pytest.raises(SinkError, match="somebody else"):
        sinks.open(tmp_path / "folder" / "a.jsonl")


def test_devices_are_for_all(tmp_path):
    (tmp_path / "a.csv").symlink_to(os.devnull)
    with sinks.open(tmp_path / "a.csv"), sinks.open(tmp_path / "a.csv"):
        pass


def test_a_file_may_have_the_longest_name(tmp_path):
    name = "x" * 250 + ".csv"
    with sinks.open(tmp_path / name):
        assert len(list(tmp_path.iterdir())) == 2
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_lock_whose_file_was_removed_meanwhile_is_taken_again(tmp_path, monkeypatch):
    first, real = Claim(tmp_path / "a"), claims._lock

    def lock(file):
        first.release()  # removes the file that is open here already
        real(file)

    monkeypatch.setattr(claims, "_lock", lock)
    with Claim(tmp_path / "a"):
        monkeypatch.setattr(claims, "_lock", real)
        with pytest.raises(SinkError, match="somebody else"):
            Claim(tmp_path / "a")


def test_a_file_system_without_locks_is_written_with_a_warning(tmp_path, monkeypatch, caplog):
    def refuse(file):
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(claims, "_lock", refuse)
    with sinks.open(tmp_path / "a.jsonl") as sink:
        sink.write(examples.frame(), examples.nothing())
    assert len(list(sinks.read_json_lines(tmp_path / "a.jsonl"))) == 1
    assert "a.jsonl is not locked against other writers: No locks available" in caplog.text


def test_where_no_file_can_be_locked_is_written_with_a_warning(tmp_path, monkeypatch, caplog):
    def refuse(claim):
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Claim, "_locked", refuse)
    with sinks.open(tmp_path / "a.jsonl") as sink:
        sink.write(examples.frame(), examples.nothing())
    assert len(list(sinks.read_json_lines(tmp_path / "a.jsonl"))) == 1
    assert "a.jsonl is not locked against other writers" in caplog.text


def test_a_lock_that_another_user_left_behind_keeps_nobody_out(tmp_path, monkeypatch):
    (tmp_path / ".a.lock").touch()
    real = Path.open

    def refuse(path, mode="r", **options):
        if mode == "ab":
            raise PermissionError(errno.EACCES, "Permission denied")
        return real(path, mode, **options)

    monkeypatch.setattr(Path, "open", refuse)
    with Claim(tmp_path / "a"), pytest.raises(SinkError, match="somebody else"):
        Claim(tmp_path / "a")
