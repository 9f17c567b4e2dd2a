"""Whatever ends the process, what the sinks wrote can be read; only arrays and COCO's labels are written at the end."""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import time
from pathlib import Path
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest
import sinks.sink_examples as examples

from dloftbs import sinks
from dloftbs.errors import SinkError

HERE = Path(__file__).parent


@pytest.fixture(params=range(4))
def killed(request, tmp_path):
    """Return the folder of a process killed at a random moment, and how many frames it had written for sure."""
    command = [sys.executable, str(HERE / "process_to_kill.py"), str(tmp_path)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        first = process.stdout.readline()
        assert first == "1\n"
        time.sleep(random.Random(request.param).uniform(0.0, 0.6))
        process.kill()
        lines = (first + process.stdout.read()).splitlines()
    assert process.returncode == -signal.SIGKILL
    return tmp_path, int(lines[-1])


@pytest.mark.skipif(sys.platform == "win32", reason="no SIGKILL")
def test_after_a_kill_every_frame_written_can_be_read(killed):
    folder, count = killed

    records = list(sinks.read_json_lines(folder / "a.jsonl"))
    assert [record["index"] for record in records] == list(range(len(records)))
    assert count <= len(records) <= count + 1

    assert not (folder / "a.npz").exists()
    assert not (folder / "a.json").exists()

    table = (folder / "a.csv").read_text().splitlines()
    assert len(table) - 1 >= 200 * count
    assert all(line.count(",") == 20 for line in table[: 200 * count + 1])

    meshes = sorted((folder / "a").glob("*.ply"))
    assert count <= len(meshes) + (folder / "a.ply").is_file() <= count + 1

    samples = (folder / "a.usda").read_text().partition("timeSamples = {\n")[2].partition("}")[0].splitlines()[:-1]
    assert count < 4 or 2 * len(samples) >= count // 2  # every second frame has objects in space
    ElementTree.parse(folder / "a.xml")

    pictures = read_video(folder / "a.mp4")
    whole = count - 1  # a fragment ends where the next picture begins
    assert len(pictures) >= whole
    for i in range(0, whole, 10):
        assert abs(float(pictures[i].mean()) - (40 + 3 * (i % 60))) < 4

    pictures = sorted((folder / "pictures").glob("*.png"))
    assert len(pictures) >= count
    assert all(cv2.imread(str(picture)) is not None for picture in pictures)

    labels = sorted((folder / "b.labelme").glob("*.json"))
    assert count <= len(labels) <= count + 1
    for label in labels:
        assert (folder / "b.labelme" / json.loads(label.read_text())["imagePath"]).is_file()


def read_video(path: Path) -> list[np.ndarray]:
    capture = cv2.VideoCapture(str(path))
    pictures = []
    while True:
        there, picture = capture.read()
        if not there:
            return pictures
        pictures.append(picture)


@pytest.mark.parametrize("error", [KeyboardInterrupt(), RuntimeError("the camera is gone")])
@pytest.mark.parametrize(
    "name", ["a.jsonl", "a.npz", "a.csv", "a.ply", "a.usda", "a.xml", "a.json", "a.mp4", "pictures/", "b.labelme/"]
)
def test_an_error_in_the_block_closes_the_sink(tmp_path, name, error):
    sink = examples.open_sink(f"{tmp_path}/{name}")

    def work():
        with sink:
            sink.write(examples.frame(), examples.detected(in_space=True))
            raise error

    with pytest.raises(type(error)) as caught:
        work()
    assert caught.value is error
    with pytest.raises(SinkError, match="closed"):
        sink.write(examples.frame(), examples.detected())
    assert [f"{path.name}" for path in tmp_path.iterdir()] == [name.rstrip("/")]
