"""README's moving picture, from the demo's overlay: `python -m benchmarks.moving_picture demo/overlay.mp4`.

An animated WebP: every second frame, in the time of the video. Needs OpenCV 4.11 or newer.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2

from dloftbs import sources

OUT = Path(__file__).parents[1] / "docs" / "images" / "demo.webp"
SIZE = (960, 540)
EVERY = 2
QUALITY = 75


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("video", type=Path)
    parser.add_argument("--out", type=Path, default=OUT)
    given = parser.parse_args()
    with sources.open(given.video) as source:
        frames = [cv2.resize(frame.image, SIZE, interpolation=cv2.INTER_AREA) for frame in source]
        duration_ms = round(EVERY * 1e3 / (source.fps or 30.0))
    animation = cv2.Animation()
    animation.frames = frames[::EVERY]
    animation.durations = [duration_ms] * len(animation.frames)
    cv2.imwriteanimation(str(given.out), animation, [cv2.IMWRITE_WEBP_QUALITY, QUALITY])
    print(f"{given.out}: {len(animation.frames)} frames, {given.out.stat().st_size / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
