"""Blocks and commands of README and of the two pages that go on from it, run as they stand, with what they read."""

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
from dloftbs_lab.commands import demo_names
from dloftbs_lab.commands.demo_files import _WHAT

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
COMMANDS, PYTHON = ROOT / "docs" / "commands.md", ROOT / "docs" / "python.md"
MAX_LINES = 120
DEMO = "demo/"
"""Where README's commands find what `dloftbs demo` has written; `tests/lab/commands/test_cli_demo.py` runs that."""
SIZE = (240, 320)
SERVE = ("tune", "view")
"""Commands that run until Ctrl-C: `tests/ui/test_newcomer.py` follows them."""
CAMERA = "fx: 300.0\nfy: 300.0\ncx: 159.5\ncy: 119.5\n"


def blocks(page: Path, language: str) -> list[str]:
    """Return the blocks of code of one language, in their order."""
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


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


def test_the_table_beside_others_has_the_last_results() -> None:
    """Its rows are written by hand, since they have figures of several pages."""
    text = README.read_text(encoding="utf-8")
    kinds = (ROOT / "docs" / "results" / "kinds.md").read_text(encoding="utf-8")
    clean = {
        row[0]: {"ours": row[1].partition(" [")[0], "authors": row[5], "mbest": row[7]}
        for row in (cells(line) for line in kinds.partition("### kinds\n")[0].splitlines() if line.startswith("| "))
    }
    columns = ("ours", "authors", "mbest")
    rows = {
        "right: high curvature, %": ["high curvature"],
        "right: one loop, %": ["one loop"],
        "right: a loop that unties, %": ["a loop that unties"],
        "right: three cables, five, %": ["three cables", "five cables"],
    }
    for title, names in rows.items():
        (line,) = [line for line in text.splitlines() if line.startswith(f"| {title} |")]
        quoted = [cell.strip("*").split(", ") for cell in cells(line)[1:4]]
        for column, figures in zip(columns, quoted, strict=True):
            known = [clean[name][column] for name in names]
            assert [float(f) for f in figures if f != "-"] == [float(f) for f in known if f != "-"], (title, column)
    results = (ROOT / "docs" / "results.md").read_text(encoding="utf-8")
    (times,) = re.findall(r"\*\*Time:\*\* (\S+ to \S+) ms", results)
    assert f"| ms a frame, by the paper | **{times}** (here) |" in text


def cells(line: str) -> list[str]:
    """Return the cells of a row of a table."""
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_readme_is_short_and_begins_with_a_picture_and_the_two_commands() -> None:
    lines = README.read_text(encoding="utf-8").splitlines()
    assert len(lines) <= MAX_LINES
    first = "\n".join(lines[:20])
    (picture,) = re.findall(r"\]\((docs/images/\S+)\)", first)
    assert 100_000 < (ROOT / picture).stat().st_size < 3_000_000
    assert re.findall(r"^make (\w+)", first, re.MULTILINE) == ["demo", "test"]


@pytest.mark.parametrize("page", [README, COMMANDS, PYTHON, ROOT / "CONTRIBUTING.md", ROOT / "SECURITY.md"], ids=str)
def test_links_lead_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8"))
    assert [link for link in links if not link.startswith("http") and not (page.parent / link).exists()] == []


@pytest.mark.parametrize("page", [README, PYTHON], ids=lambda page: page.name)
def test_the_blocks_of_python_run_one_after_the_other(
    page: Path, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names: dict[str, object] = {}
    for block in blocks(page, "python"):
        exec(compile(block, str(page), "exec"), names)
    found = names["found"]
    assert isinstance(found, dloftbs.FrameResult)
    assert len(found) == 1
    assert found[0].curve_3d is not None
    assert found[0].curve_3d.end[2] == pytest.approx(0.6, abs=0.03)
    assert len(capsys.readouterr().out.splitlines()) > 4


def test_the_commands_run(folder: Path) -> None:
    lines = [line for page in (README, COMMANDS) for block in blocks(page, "sh") for line in block.splitlines()]
    commands = [line.removeprefix("dloftbs ") for line in lines if line.startswith("dloftbs ")]
    for text in commands:
        arguments = shlex.split(text, comments=True)
        if arguments[0] == "tune":  # as Save would
            Path(arguments[arguments.index("--out") + 1]).write_text('segmentation: {hsv: ["170:10"]}\n')
        elif arguments[0] not in SERVE and arguments[0] != "demo":
            run(*arguments)
    assert {shlex.split(text)[0] for text in commands} >= {"demo", "tune", "view", "detect", "track", "batch"}
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


def test_what_the_demo_leaves_is_what_the_next_command_reads() -> None:
    (view,) = re.findall(r"^dloftbs view (.*?) +#", README.read_text(encoding="utf-8"), re.MULTILINE)
    source, option, config = shlex.split(view)
    assert option == "--config"
    assert source == f"{DEMO}{demo_names.INPUT}"
    assert config.removeprefix(DEMO) in _WHAT


def test_each_question_is_answered_in_three_lines() -> None:
    text = PYTHON.read_text(encoding="utf-8")
    answers = text[text.index("Where is the end of the cable?") :]
    given = re.findall(r"```python\n(.*?)```", answers, re.DOTALL)
    assert len(given) == 5
    assert all(len(answer.splitlines()) <= 3 for answer in given)


def test_its_colours_are_told_apart(folder: Path) -> None:
    """The ranges of the paragraph on colours: a cable of each colour, black and white too, is found."""
    text = " ".join(COMMANDS.read_text(encoding="utf-8").split())
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
