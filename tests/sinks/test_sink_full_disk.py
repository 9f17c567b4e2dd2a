"""A disk that is full: every error is a `SinkError`, and what was written stays valid."""

from __future__ import annotations

import struct
import subprocess
import sys
from pathlib import Path

import cv2
import pytest
from sinks.sink_examples import MAX_FRAMES

from dloftbs import sinks

WRITER = Path(__file__).with_name("process_that_writes.py")

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="no limits of processes")


def fill(folder, limit, *names):
    """Return of each sink how many frames it wrote when its file reached a limit."""
    command = [sys.executable, str(WRITER), str(limit), *(f"{folder}/{name}" for name in names)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=120)
    assert done.stderr == ""
    counts = []
    for name, line in zip(names, done.stdout.splitlines(), strict=True):
        count, _, error = line.partition(" ")
        assert name in error
        assert "File too large" in error
        counts.append(int(count))
    return counts


@pytest.mark.parametrize("limit", [30_000, 53_333])
def test_lines_and_rows_are_cut_at_the_last_whole_frame(tmp_path, limit):
    lines, tables = fill(tmp_path, limit, "a.jsonl", "a.csv")

    text = (tmp_path / "a.jsonl").read_bytes()
    assert text.endswith(b"}\n")
    assert [record["index"] for record in sinks.read_json_lines(tmp_path / "a.jsonl")] == list(range(lines)) != []

    rows = (tmp_path / "a.csv").read_text().splitlines(keepends=True)
    assert len(rows) == 1 + 200 * tables > 1
    assert all(row.count(",") == 20 and row.endswith("\n") for row in rows)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.csv", "a.jsonl"]


def test_a_video_ends_with_a_whole_fragment(tmp_path):
    (count,) = fill(tmp_path, 20_000, "a.mp4")

    data, at, kinds = (tmp_path / "a.mp4").read_bytes(), 0, []
    while at < len(data):
        (size,) = struct.unpack(">I", data[at : at + 4])
        kinds.append(data[at + 4 : at + 8])
        at += size
    assert at == len(data)
    assert kinds[-2:] == [b"moof", b"mdat"]
    capture, pictures = cv2.VideoCapture(str(tmp_path / "a.mp4")), 0
    while capture.read()[0]:
        pictures += 1
    assert pictures == count - 1 > 1


@pytest.mark.slow
def test_what_is_replaced_as_a_whole_stays_as_it_was(tmp_path):
    assert fill(tmp_path, 1000, "a.ply", "a.obj", "a.usda", "a.xml") == [0, 0, 0, 0]
    assert list(tmp_path.iterdir()) == []
    assert fill(tmp_path, 100, "pictures") == [0]
    assert list((tmp_path / "pictures").iterdir()) == []
    (tmp_path / "b.npz").write_text("precious")
    for limit in (1000, 300_000):
        assert fill(tmp_path, limit, "b.npz") == [MAX_FRAMES]  # the error comes when it is closed
        assert (tmp_path / "b.npz").read_text() == "precious"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["b.npz", "pictures"]
