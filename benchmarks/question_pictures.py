"""Pictures of answers for docs/questions.md.

Run it in the repository with ``python -m benchmarks.question_pictures``.
"""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs import Frame, Pipeline, viz
from dloftbs.data.answers import BendLimit
from dloftbs.data.frame_result import FrameResult
from dloftbs.viz.answer_marks import mark_bends, mark_deviations

PICTURE = Path(__file__).parents[1] / "docs" / "images" / "questions.png"
_SIZE = (300, 400)
_BOX = ((120, 70), (290, 70), (290, 230), (120, 230))
_LIMIT_PX = 60.0
_AXES = ((60, 60, 220), (60, 170, 60))

_Picture = npt.NDArray[np.uint8]


def scene() -> Frame:
    """Return a frame with one cable whose edge is noisy and whose middle is hidden."""
    x = np.linspace(40.0, 360.0, 400)
    line = np.stack((x, 150.0 + 60.0 * np.sin(x / 38.0) * np.exp(-(((x - 110.0) / 100.0) ** 2))), axis=1)
    mask = np.zeros(_SIZE, np.uint8)
    cv2.polylines(mask, [np.rint(16.0 * line).astype(np.int32)], False, 255, 11, cv2.LINE_8, 4)
    noise = cv2.GaussianBlur(np.random.default_rng(57).normal(size=_SIZE), (0, 0), 2.0)
    mask[(cv2.GaussianBlur(mask, (0, 0), 1.5) / 255.0 + 1.2 * noise * (x[0] < np.arange(_SIZE[1]))) < 0.5] = 0
    mask[:, 285:310] = 0
    image = np.full((*_SIZE, 3), (205, 210, 205), np.uint8)
    image[mask > 0] = (150, 90, 40)
    return Frame(mask=mask > 0, image=image)


def bends(picture: _Picture, result: FrameResult) -> None:
    """Mark the bends that are too tight."""
    mark_bends(picture, result, BendLimit(_LIMIT_PX, in_pixels=True))


def poses(picture: _Picture, result: FrameResult) -> None:
    """Draw the axes of poses along the cable."""
    for pose in result[0].curve.poses(np.linspace(0.05, 0.95, 10)):
        start = pose[:2, 2]
        for axis, colour in enumerate(_AXES):
            ends = np.rint(16.0 * np.stack((start, start + 18.0 * pose[:2, axis]))).astype(int).tolist()
            cv2.arrowedLine(picture, ends[0], ends[1], colour, 2, cv2.LINE_AA, 4, 0.3)


def box(picture: _Picture, result: FrameResult) -> None:
    """Draw a box, and the part of the cable inside."""
    curve = result[0].curve
    cv2.polylines(picture, [np.array(_BOX)], True, (90, 90, 90), 1, cv2.LINE_AA)
    for low, high in curve.inside(_BOX):
        part = np.rint(16.0 * curve(np.linspace(low, high, 100))).astype(np.int32)
        cv2.polylines(picture, [part], False, _AXES[0], 4, cv2.LINE_AA, 4)


def main() -> None:
    """Write the picture."""
    frame = scene()
    result = Pipeline().detect(Frame(mask=frame.mask))  # the image would show that the gap is ground
    u, radius = result[0].tightest_bend()
    tiles = []
    for mark in (bends, poses, box, mark_deviations):
        picture = viz.draw(frame, result)
        mark(picture, result)
        tiles.append(picture)
    titles = [f"tightest bend: {radius:.0f} px at u = {u:.2f}", "poses", "part in a box", "two deviations"]
    PICTURE.write_bytes(viz.as_png(viz.contact_sheet(tiles, titles=titles, columns=2, tile_width=400)))


if __name__ == "__main__":
    main()
