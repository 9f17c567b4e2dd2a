"""Labels for training in labelme's form: the line of each object, in a file beside each picture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from dloftbs.data.frame import Frame
from dloftbs.data.frame_result import FrameResult
from dloftbs.sinks._earlier_files import EarlierFiles
from dloftbs.sinks._images import BgrImage, encode
from dloftbs.sinks._seen import CATEGORY, SeenObject, seen_objects
from dloftbs.sinks.overlay_pictures import picture_name
from dloftbs.sinks.sink import PathSink
from dloftbs.support.arrays import FloatArray
from dloftbs.support.json_text import encode as json_of
from dloftbs.support.safe_files import UnusedNames, claim_folder, write_whole

_VERSION = "5.5.0"
"""Version of labelme whose files these are like; it warns of others."""

_DEVIATION_PX = 0.5
"""Largest distance of a line from the curve, px.

Source: geometry; half a pixel moves no edge to the next pixel.
"""

_DIGITS = 2
"""Decimals of coordinates and widths, px."""


class LabelmeSink(PathSink):
    """Writes a picture of each frame and, beside it, the lines of its objects as labelme reads and edits them.

    ``labelme FOLDER`` opens the folder. A frame has two files, named as in an `OverlayImagesSink`: ``photo.png``, the
    frame's image without loss, or its mask in white where it has no image; and ``photo.json``, with ``imageHeight``,
    ``imageWidth``, ``imagePath`` and ``shapes``. A frame without objects has no shapes.

    Each shape is a ``linestrip`` with the label ``cable``. Its points ``[x, y]`` lie on the object's curve; pixel
    centres are whole numbers. ``description`` holds the object's width, as ``width_px=7.5``. Parts that the frame does
    not show are left out, as in a `CocoSink`; the parts that are left share a ``group_id``, the id of the track, or the
    number of the detection where there are no tracks. A loop ends at its first point.

    Each file appears as a whole or not at all, whenever the process dies, and a picture before its lines.

    Parameters
    ----------
    folder : str or Path
        Made where it is missing; files of an earlier run are replaced, and closing warns in the log of those that stay.

    Raises
    ------
    SinkError
        If the folder cannot be made.
    """

    def __init__(self, folder: str | Path) -> None:
        super().__init__(folder)
        self._unused = UnusedNames()
        self._earlier = EarlierFiles(self._path, ".png", ".json")
        self._claim = claim_folder(self._path)

    def _write(self, frame: Frame, result: FrameResult) -> None:
        name = self._unused(picture_name(frame))
        picture = f"{name}.png"
        height, width = frame.size
        content: dict[str, Any] = {
            "version": _VERSION,
            "flags": {},
            "shapes": [shape for seen in seen_objects(result) for shape in _shapes_of(seen)],
            "imagePath": picture,
            "imageData": None,
            "imageHeight": height,
            "imageWidth": width,
        }
        self._earlier.replaced_by(picture, f"{name}.json")
        write_whole(self._path / picture, encode(_picture_of(frame), ".png"))
        write_whole(self._path / f"{name}.json", json_of(content, indent=2))

    def _close(self) -> None:
        self._claim.release()  # every file is complete already
        self._earlier.warn()


def _picture_of(frame: Frame) -> BgrImage:
    if frame.image is not None:
        return frame.image
    is_cable = frame.is_cable
    assert is_cable is not None  # a frame has one of the two
    return np.where(is_cable, np.uint8(255), np.uint8(0))


def _shapes_of(seen: SeenObject) -> list[dict[str, Any]]:
    """Return the lines of an object, one for each part that is seen."""
    return [
        {
            "label": CATEGORY,
            "points": _line_along(seen, span).tolist(),
            "group_id": seen.row.name,
            "description": f"width_px={round(seen.width_px, _DIGITS)}",
            "shape_type": "linestrip",
            "flags": {},
            "mask": None,
        }
        for span in seen.spans
    ]


def _line_along(seen: SeenObject, span: tuple[float, float]) -> FloatArray:
    """Return the few points (n, 2) of a line that stays on an interval of the curve."""
    import cv2

    low, high = span
    points = seen.curve(np.linspace(low, high, 2 + int((high - low) * seen.curve.length))).astype(np.float32)
    is_loop = seen.curve.closed and high - low == 1.0
    kept = cv2.approxPolyDP(points[:-1] if is_loop else points, _DEVIATION_PX, closed=is_loop)[:, 0]
    line: FloatArray = (np.vstack((kept, kept[:1])) if is_loop else kept).astype(np.float64).round(_DIGITS)
    return line
