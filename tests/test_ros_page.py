"""The commands and blocks of the page on ROS, run as they stand."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest
from cli.cli_inputs import run
from ros import bag_examples as bags

import dloftbs

PAGE = (Path(__file__).parents[1] / "docs" / "ros.md").read_text(encoding="utf-8")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    bags.write_mcap(Path("run.mcap"), bags.entries(4))
    masks = [
        ("/sam2/mask", at, bags.raw_image(bags.mask_of(i), "mono8", at)) for i in range(4) if (at := bags.stamp_of(i))
    ]
    bags.write_mcap(Path("segmented.mcap"), [*bags.entries(4), *masks])
    return tmp_path


def test_the_commands_run(folder):
    blocks = "".join(re.findall(r"^```sh\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)).replace("\\\n", " ")
    commands = [line.removeprefix("dloftbs ") for line in blocks.splitlines() if line.startswith("dloftbs ")]
    for command in commands:
        run(*shlex.split(command, comments=True))
    assert len(commands) >= 5
    for written in ("curves.jsonl", "overlay.mp4", "curves.npz", "masked.jsonl", "curves.mcap", "curves/metadata.yaml"):
        assert (folder / written).stat().st_size > 100, written
    assert len(list((folder / "cable").glob("*.ply"))) == 4


def test_the_blocks_of_python_run(folder, capsys):
    names: dict[str, object] = {"pipeline": dloftbs.Pipeline(hsv="170:10")}
    for block in re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL):
        exec(compile(block, "docs/ros.md", "exec"), names)
    assert len(capsys.readouterr().out.splitlines()) == 4
    points, pixels, markers = names["points_m"], names["points_px"], names["markers"]
    assert (pixels.width, len(markers.markers)) == (100, 1 + points.width // 100)  # the first one removes older ones
    assert pixels.header.frame_id == "camera_color_optical_frame/pixels"
    result = names["on_image"](bags.raw_image(bags.photo_of(0), "bgr8"))
    assert len(result.tracks) == 1


def test_the_encodings_of_the_page_are_those_that_there_are():
    from dloftbs.ros.image_messages import ENCODINGS

    row = next(line for line in PAGE.splitlines() if line.startswith("| `Image`"))
    for name in ENCODINGS:
        assert (re.sub("bayer_.*", "bayer_*8", name)) in row.lower(), name


def test_the_topics_of_the_page_are_those_that_are_written(folder):
    from dloftbs.ros import Recording

    np.savez("run.npz", images=[bags.photo_of(0)], depth=np.ones((1, *bags.SIZE)), camera=[150.0, 150.0, 80.0, 60.0])
    run("track", "run.npz", "--hsv", "170:10", "--out", "curves.mcap", "--with-input")
    named = set(re.findall(r"`(/dloftbs/[\w/]+)`", PAGE)) | {"/dloftbs/depth", "/dloftbs/camera_info"}
    assert {topic.name for topic in Recording(Path("curves.mcap")).topics} | {"/dloftbs/mask"} == named
