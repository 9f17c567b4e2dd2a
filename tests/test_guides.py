"""The pages by task: their commands have options that exist, and what needs no file runs as it stands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import cv2
import numpy as np
import pytest
from drawings import draw_cable, wave

from dloftbs.cli import main

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(DOCS.rglob("*.md"))
SIZE = (240, 320)


def blocks(page: Path, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", page.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


def commands(page: Path) -> list[list[str]]:
    """Return the words of each ``dloftbs`` command in the blocks of a page."""
    lines = "\n".join(blocks(page, "(?:ba)?sh")).replace("\\\n", " ").splitlines()
    return [shlex.split(line, comments=True)[1:] for line in lines if line.startswith("dloftbs ")]


@pytest.mark.parametrize("page", [page for page in PAGES if commands(page)], ids=lambda page: page.stem)
def test_every_command_and_option_exists(page):
    for name, *words in commands(page):
        command = main.commands[name]
        if isinstance(command, click.Group):
            command = command.commands.get(words[0], command) if words else command
        known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
        given = {word.partition("=")[0] for word in words if re.match(r"--?[a-z]", word)}
        assert given <= known | {"--help"}, (name, given - known)


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")], ids=lambda page: page.stem)
def test_every_block_of_python_can_be_compiled(page):
    for block in blocks(page, "python"):
        compile(block, str(page), "exec")


@pytest.mark.parametrize("name", ["guides/network.md", "fitting.md"])
def test_pages_that_need_no_file_run(name):
    names: dict[str, object] = {}
    for block in blocks(DOCS / name, "python"):
        exec(compile(block, name, "exec"), names)


def test_the_length_of_a_black_cable_over_time(tmp_path, monkeypatch):
    pytest.importorskip("pandas")
    monkeypatch.chdir(tmp_path)
    video = cv2.VideoWriter("cable.mp4", cv2.VideoWriter_fourcc(*"mp4v"), 30.0, SIZE[::-1])
    for i in range(4):
        image = np.full((*SIZE, 3), 200, np.uint8)
        image[draw_cable(wave(SIZE, 1.0, 0.05 * i), 9, SIZE) > 0] = (25, 22, 20)
        video.write(image)
    video.release()
    names: dict[str, object] = {}
    find, _ = blocks(DOCS / "guides" / "over-time.md", "python")
    exec(compile(find, "over-time.md", "exec"), names)
    table = names["table"]
    assert set(table.id) == {1}
    assert len(table) == 4
    assert table.length_px.min() > 200
