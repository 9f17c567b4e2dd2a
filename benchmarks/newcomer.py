"""Time a newcomer's way from a video to curves, with the commands that README gives: `python -m benchmarks.newcomer`.

The video is made by the package: a pink cable, of which README's range for red finds but parts. Each thing that a
person does is an action: to run a command, to open the page, to draw, to press a key.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic, perf_counter
from typing import Any

import cv2
import numpy as np

from dloftbs import Frame, FrameResult, sinks
from dloftbs_lab.synthetic import DemoSequence

README = Path(__file__).parents[1] / "README.md"
VIDEO = "cable.mp4"
MAX_ACTIONS = 10
SIZE = (480, 854)
PINK_HUE = 169.0
CHROMIUM = ("--disable-gpu", "--disable-background-networking", "--disable-component-update", "--disable-sync",
            "--no-first-run", "--disable-quic", *["--no-sandbox"] * (os.getuid() == 0))  # fmt: skip
_DLOFTBS = [sys.executable, "-m", "dloftbs"]


@dataclass
class Journey:
    """What was done, and how long it took."""

    actions: list[tuple[str, float]] = field(default_factory=list)

    def do(self, what: str, action: Callable[[], Any]) -> Any:
        since = perf_counter()
        made = action()
        self.actions.append((what, perf_counter() - since))
        return made


def make_video(path: Path, frames: int) -> DemoSequence:
    """Write the demo's first cable, dyed pink."""
    sequence = DemoSequence(frames=frames, size=SIZE, cables=1, occluder=False)
    with sinks.OverlayVideoSink(path, fps=30.0, draw=lambda frame, _: pink(frame, sequence)) as video:
        for frame in sequence:
            video.write(frame, FrameResult((), (), None, frame.size, index=frame.index))
    return sequence


def pink(frame: Frame, sequence: DemoSequence) -> Any:
    hsv = cv2.cvtColor(np.asarray(frame.image), cv2.COLOR_BGR2HSV)
    cable = sequence.truth(frame.index).visible_masks[0]
    around = cv2.dilate(cable.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    dyed = around & (hsv[..., 1] > 90) & (hsv[..., 0] > 90)
    hsv[dyed, 0] = (PINK_HUE + (hsv[dyed, 0].astype(float) - 106.0)) % 180
    hsv[dyed, 1] = (0.55 * hsv[dyed, 1]).astype(np.uint8)
    return cv2.cvtColor(hsv, cv2.COLOR_HSV2BGR)


def command_of(verb: str) -> list[str]:
    """Return README's command for the video with a verb, as a shell takes it apart."""
    found = re.search(rf"^dloftbs ({verb} {VIDEO} .*)$", README.read_text("utf-8"), re.MULTILINE)
    if found is None:
        raise ValueError(f"README has no command `dloftbs {verb} {VIDEO} ...`")
    return shlex.split(found[1], comments=True)


def travel(folder: Path, frames: int = 60, screenshot: Path | None = None) -> tuple[Journey, list[dict[str, Any]]]:
    """Go the whole way, and return it with the lines of the curves."""
    from playwright.sync_api import sync_playwright

    sequence = make_video(folder / VIDEO, frames)
    journey = Journey()
    tune = [*_DLOFTBS, *command_of("tune"), "--no-browser", "--port", "0"]
    process, address = journey.do("run README's `dloftbs tune`", lambda: started(tune, folder))
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=shutil.which("chromium"), args=CHROMIUM)
            page = browser.new_page(viewport={"width": 1440, "height": 900})
            page.set_default_timeout(240_000)  # kernels may have to be compiled
            journey.do("open the address", lambda: page.goto(address))
            page.locator("#hint:visible").wait_for()
            journey.do("draw along the cable", lambda: draw(page, sequence))
            page.locator("#stroke-count", has_text="1 stroke").wait_for()
            journey.do("look at the strip", lambda: page.wait_for_timeout(1500))
            journey.do("press S to save", lambda: page.keyboard.press("s"))
            page.locator("#saved:visible").wait_for()
            if screenshot is not None:
                page.locator("#toast").wait_for(state="hidden")
                page.screenshot(path=screenshot, type="jpeg", quality=82)
            command = journey.do("copy the command", lambda: page.locator("#command").inner_text())
            browser.close()
    finally:
        process.terminate()
        process.communicate()
    arguments = [*_DLOFTBS, *shlex.split(command)[1:]]
    journey.do("run it", lambda: subprocess.run(arguments, cwd=folder, check=True, capture_output=True))
    lines = (folder / "curves.jsonl").read_text("utf-8").splitlines()
    return journey, [json.loads(line) for line in lines]


def started(command: list[str], folder: Path) -> tuple[subprocess.Popen[str], str]:
    """Start a command that serves a page, and return it with the address that it prints."""
    process = subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None  # it is a pipe
    end, text = monotonic() + 60.0, ""
    while monotonic() < end and (line := process.stderr.readline()):
        text += line
        if found := re.search(r"http://\S+", line):
            return process, found[0]
    raise RuntimeError(f"no address: {text}")


def draw(page: Any, sequence: DemoSequence) -> None:
    """Drag the pointer along a third of the cable, as a hand does."""
    box = page.locator("#canvas").bounding_box()
    scale = min(box["width"] / SIZE[1], box["height"] / SIZE[0])
    left = box["x"] + (box["width"] - SIZE[1] * scale) / 2
    top = box["y"] + (box["height"] - SIZE[0] * scale) / 2
    points = sequence.truth(0).curves[0](np.linspace(0.35, 0.65, 12))
    points += np.random.default_rng(0).uniform(-1.5, 1.5, points.shape)
    places = [(left + (x + 0.5) * scale, top + (y + 0.5) * scale) for x, y in points]
    page.mouse.move(*places[0])
    page.mouse.down()
    for place in places[1:]:
        page.mouse.move(*place, steps=3)
    page.mouse.up()


def ids(lines: list[dict[str, Any]]) -> Counter[int]:
    """Return in how many frames each track is."""
    return Counter(track["id"] for line in lines for track in line["tracks"])


def main() -> None:
    with tempfile.TemporaryDirectory() as text:
        screenshot = Path(sys.argv[1]) if len(sys.argv) > 1 else None
        journey, lines = travel(Path(text), screenshot=screenshot)
        for what, seconds in journey.actions:
            print(f"{seconds:7.2f} s  {what}")
        total = sum(seconds for _, seconds in journey.actions)
        print(f"{total:7.2f} s  {len(journey.actions)} actions, at most {MAX_ACTIONS}")
        print(f"frames of each track: {dict(ids(lines))} of {len(lines)}")


if __name__ == "__main__":
    main()
