"""The commands and blocks of the page on simulators, run as they stand."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import cv2
import numpy as np
import pytest
from cli.cli_inputs import run
from drawings import draw_cable, wave

pytest.importorskip("mujoco")

PAGE = (Path(__file__).parents[1] / "docs" / "simulators.md").read_text(encoding="utf-8")
SIZE = (240, 320)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name in ("frames", "depth"):
        Path(name).mkdir()
    for i in range(3):
        image = np.full((*SIZE, 3), (90, 120, 90), np.uint8)
        image[draw_cable(wave(SIZE, 1.0, 0.05 * i), 9, SIZE) > 0] = (30, 20, 210)
        cv2.imwrite(f"frames/{i}.png", image)
        cv2.imwrite(f"depth/{i}.png", np.full(SIZE, 600, np.uint16))
    Path("camera_info.yaml").write_text("fx: 300.0\nfy: 300.0\ncx: 159.5\ncy: 119.5\n")
    return tmp_path


def test_the_commands_and_the_blocks_run(folder: Path) -> None:
    commands = "".join(re.findall(r"^```sh\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)).splitlines()
    assert len(commands) == 1
    run(*shlex.split(commands[0])[1:])
    assert (folder / "scene.usda").read_text().count(": [(") == 3  # time samples
    assert 'gravity="0 0 0"' in (folder / "scene.xml").read_text()
    Path("pose.yaml").write_text("translation_m: [0.0, 0.0, 1.0]\nrpy: [3.1416, 0.0, 0.0]\n")
    run(*shlex.split(commands[0])[1:], "--camera-pose", "pose.yaml")
    assert 'gravity="0 0 -9.81"' in (folder / "scene.xml").read_text()
    assert "the world, z upwards" in (folder / "scene.usda").read_text()
    names: dict[str, object] = {}
    for block in re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL):
        exec(compile(block, "docs/simulators.md", "exec"), names)
    assert 'gravity="0 0 -9.81"' in (folder / "scene.xml").read_text()
    assert names["model"].body("cable_1_B_last").id > names["first"].id
