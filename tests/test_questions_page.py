"""docs/questions.md, run as it stands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import cv2
import numpy as np
import pytest
from cli.cli_inputs import run

PAGE = (Path(__file__).parents[1] / "docs" / "questions.md").read_text(encoding="utf-8")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    mask = np.zeros((240, 320), np.uint8)
    x = np.arange(40, 281)
    for middle in (90, 170):
        line = np.stack((x, middle + 20.0 * np.sin((x - 40) / 40.0)), axis=1)
        cv2.polylines(mask, [np.rint(line).astype(np.int32)], False, 255, 7)
    image = np.full((240, 320, 3), (90, 120, 90), np.uint8)
    image[mask > 0] = (30, 20, 210)
    cv2.imwrite("photo.jpg", image)
    cv2.imwrite("depth.png", np.where(mask > 0, 600, 650).astype(np.uint16))
    video = cv2.VideoWriter("cable.mp4", cv2.VideoWriter_fourcc(*"mp4v"), 30.0, (320, 240))
    for _ in range(2):
        video.write(image)
    video.release()
    Path("camera_info.yaml").write_text("fx: 300.0\nfy: 300.0\ncx: 159.5\ncy: 119.5\n")
    return tmp_path


def test_the_answers(folder: Path) -> None:
    names: dict[str, object] = {}
    for block in re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL):
        exec(compile(block, "questions.md", "exec"), names)
    assert names["radius_px"] == pytest.approx(80.0, rel=0.1)  # 40 ** 2 / 20
    assert names["radius_m"] == pytest.approx(0.16, rel=0.15)
    assert names["touch"] is False
    assert names["distance_m"] == pytest.approx(0.16, rel=0.15)
    assert 0.0 < names["slack_m"] < 0.05  # type: ignore[operator]
    assert names["poses"].shape == (3, 4, 4)  # type: ignore[attr-defined]
    assert names["in_base"].length == pytest.approx(names["cable"].curve_3d.length)  # type: ignore[attr-defined]
    assert names["in_base"].start[2] == pytest.approx(0.4, abs=0.03)  # type: ignore[attr-defined]  # 1 m - 0.6 m
    assert names["pixels"].shape == (100, 2)  # type: ignore[attr-defined]
    assert len(names["spans"]) == 1  # type: ignore[arg-type]
    assert (names["std_px"] < 1.5).all()  # type: ignore[operator]
    assert (names["std_m"] < 0.01).all()  # type: ignore[operator]


def test_the_commands(folder: Path) -> None:
    commands = re.findall(r"`dloftbs ([^`]*)`", PAGE)
    said = [run(*shlex.split(command)).stderr for command in commands]
    assert len(commands) == 2
    assert "below 40 px" not in said[0]
    assert (folder / "curves.csv").read_text().splitlines()[0].endswith(",bend_radius_px,bend_radius_m")
    assert '"std":' in (folder / "curves.jsonl").read_text()
    assert '"bend_radius_px":' in (folder / "curves.jsonl").read_text()
