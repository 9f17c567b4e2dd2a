"""README's blocks and commands, run as they stand, in a folder with what they read."""

from __future__ import annotations

import os
import re
import shlex
from pathlib import Path

import cv2
import numpy as np
import pytest
from cli.cli_inputs import run
from drawings import draw_cable, wave
from ros.bag_examples import COLOUR_TOPIC, raw_image, stamp_of, write_mcap

import dloftbs

README = Path(__file__).parents[1] / "README.md"
SIZE = (240, 320)
SERVE = ("tune", "view")
"""Commands that run until Ctrl-C: `tests/ui/test_newcomer.py` follows them."""
CAMERA = "fx: 300.0\nfy: 300.0\ncx: 159.5\ncy: 119.5\n"


def blocks(language: str) -> list[str]:
    """Return the blocks of code of one language, in their order."""
    return re.findall(rf"^```{language}\n(.*?)^```", README.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def mask_of(shift: float) -> np.ndarray:
    return draw_cable(wave(SIZE, 1.0, shift), 9, SIZE)


def photo_of(shift: float) -> np.ndarray:
    image = np.full((*SIZE, 3), (90, 120, 90), np.uint8)
    image[mask_of(shift) > 0] = (30, 20, 210)
    return image


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return the current folder, with all files that README names."""
    monkeypatch.chdir(tmp_path)
    for name in ("masks", "frames", "depth"):
        Path(name).mkdir()
    video = cv2.VideoWriter("cable.mp4", cv2.VideoWriter_fourcc(*"mp4v"), 30.0, SIZE[::-1])
    for i in range(4):
        shift = 0.05 * i
        video.write(photo_of(shift))
        cv2.imwrite(f"masks/{i}.png", 255 * (mask_of(shift) > 0).astype(np.uint8))
        cv2.imwrite(f"frames/{i}.png", photo_of(shift))
        cv2.imwrite(f"depth/{i}.png", np.full(SIZE, 600, np.uint16))
    video.release()
    images = [raw_image(photo_of(0.05 * i), "bgr8", stamp_of(i)) for i in range(4)]
    write_mcap(tmp_path / "run.mcap", [(COLOUR_TOPIC, stamp_of(i), image) for i, image in enumerate(images)])
    Path("recordings/day1").mkdir(parents=True)
    os.link("cable.mp4", "recordings/day1/cable.mp4")
    cv2.imwrite("photo.jpg", photo_of(0.0))
    cv2.imwrite("mask.png", mask_of(0.0))
    cv2.imwrite("depth.png", np.full(SIZE, 600, np.uint16))
    Path("camera_info.yaml").write_text(CAMERA)
    return tmp_path


def test_the_blocks_of_python_run_one_after_the_other(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names: dict[str, object] = {}
    for block in blocks("python"):
        exec(compile(block, str(README), "exec"), names)
    assert len(blocks("python")) >= 8
    found = names["found"]
    assert isinstance(found, dloftbs.FrameResult)
    assert len(found) == 1
    assert found[0].curve_3d is not None
    assert found[0].curve_3d.end[2] == pytest.approx(0.6, abs=0.03)
    assert len(capsys.readouterr().out.splitlines()) > 100


def test_the_commands_run(folder: Path) -> None:
    commands = [line for block in blocks("sh") for line in block.splitlines() if line.startswith("dloftbs ")]
    inline = re.findall(r"`dloftbs (track[^`]*)`", README.read_text(encoding="utf-8"))
    for text in (*(line.removeprefix("dloftbs ") for line in commands), *inline):
        arguments = shlex.split(text, comments=True)
        if arguments[0] not in SERVE:
            run(*arguments)
    assert len(commands) >= 5
    for written in (
        "overlay.png",
        "stages.png",
        "curves.jsonl",
        "overlay.mp4",
        "curves.npz",
        "curves.mcap",
        "points.csv",
        "results/day1/cable.mp4.jsonl",
    ):
        assert (folder / written).stat().st_size > 100, written
    assert len(list((folder / "cable").glob("*.ply"))) == 4  # one a frame


def test_each_question_is_answered_in_three_lines() -> None:
    text = README.read_text(encoding="utf-8")
    answers = text[text.index("Where is the end of the cable?") : text.index("## What it is not for")]
    given = re.findall(r"```python\n(.*?)```", answers, re.DOTALL)
    assert len(given) == 5
    assert all(len(answer.splitlines()) <= 3 for answer in given)


def test_its_colours_are_told_apart(folder: Path) -> None:
    """The ranges of the paragraph on colours: a cable of each colour, black and white too, is found."""
    text = README.read_text(encoding="utf-8")
    ranges = dict(re.findall(r"(red is|yellow|green|blue|magenta) ([0-9]+:[0-9]+)", text))
    ranges |= {"black": "0:179,0:255,0:60", "white": "0:179,0:40,180:255"}
    assert all(hsv in text for hsv in ranges.values())
    colours = {
        "red is": (40, 40, 200), "yellow": (30, 200, 220), "green": (60, 160, 50), "blue": (200, 90, 40),
        "magenta": (180, 40, 200), "black": (35, 30, 30), "white": (240, 245, 240),
    }  # fmt: skip
    assert ranges.keys() == colours.keys()
    for name, colour in colours.items():
        image = np.full((*SIZE, 3), (120, 125, 130), np.uint8)
        image[mask_of(0.0) > 0] = colour
        assert [len(dloftbs.detect(image, hsv=hsv)) for hsv in ranges.values()].count(1) == 1, name
        assert len(dloftbs.detect(image, hsv=ranges[name])) == 1
