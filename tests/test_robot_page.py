"""The command and the block of the page on robots, run with the files as they stand there."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import cv2
import numpy as np
from cli.cli_inputs import run
from drawings import draw_cable, wave

PAGE = (Path(__file__).parents[1] / "docs" / "robot.md").read_text(encoding="utf-8")
SIZE = (240, 320)


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


def test_the_command_and_the_block_run(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("frames").mkdir()
    for i in range(3):
        image = np.full((*SIZE, 3), (90, 120, 90), np.uint8)
        image[draw_cable(wave(SIZE, 1.0, 0.05 * i), 9, SIZE) > 0] = (30, 20, 210)
        cv2.imwrite(f"frames/{i}.png", image)
    Path("camera_info.yaml").write_text("fx: 300.0\nfy: 300.0\ncx: 159.5\ncy: 119.5\n")
    (robot,), (joints,), (command,), (code,) = (blocks(kind) for kind in ("yaml", "text", "sh", "python"))
    Path("robot.yaml").write_text(robot)
    Path("joints.csv").write_text(joints)
    run(*shlex.split(command)[1:])
    rows = [json.loads(line) for line in Path("curves.jsonl").read_text().splitlines()]
    assert [len(row["tracks"]) for row in rows] == [1, 1, 1]
    names: dict[str, object] = {}
    exec(compile(code, "docs/robot.md", "exec"), names)
    assert len(capsys.readouterr().out.splitlines()) == 3
    assert names["covered"].sum() > 1000
    assert names["held_at"].shape == (1, 4)
