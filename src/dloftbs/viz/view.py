"""A part of a frame, enlarged or reduced."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np

from dloftbs.data.curve import BSplineCurve
from dloftbs.support.arrays import BoolArray, ByteArray, FloatArray
from dloftbs.viz.shapes import Picture

_MIN_SIDE_PX = 24
_MARGIN = 0.08
# Where the object fills more of the frame than this, the whole frame is shown.
_WHOLE_FROM = 0.6
_MIN_ASPECT = 0.6


@dataclass(frozen=True)
class View:
    """Part of a frame that is shown, and its scale.

    Whole coordinates are the centres of pixels, in the frame and in the view: ``p``, counted from the part's corner, is
    shown at ``(p + 0.5) * zoom - 0.5``.

    Parameters
    ----------
    left, top, width, height : int
        The part, px of the frame.
    zoom : float
        Pixels of the view for one of the frame.
    """

    left: int
    top: int
    width: int
    height: int
    zoom: float

    @classmethod
    def around(cls, mask: BoolArray, panel_px: int) -> View:
        """Return the view of a mask's bounding box, or of the whole frame, with a longer side of about `panel_px`."""
        left, top, width, height = _box(mask)
        zoom = panel_px / max(width, height)
        # Whole factors, so that all pixels come out alike.
        return cls(left, top, width, height, float(max(1, round(zoom))) if zoom > 2.0 / 3.0 else zoom)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the view, px."""
        return max(1, round(self.width * self.zoom)), max(1, round(self.height * self.zoom))

    def picture(self, picture: Picture) -> Picture:
        """Return the part of a picture (H, W, 3) of the frame."""
        return self._resized(picture)

    def mask(self, mask: BoolArray) -> BoolArray:
        """Return the part of a mask (H, W) of the frame; a set pixel stays visible however small it gets."""
        return self._resized(np.where(mask, np.uint8(255), np.uint8(0))) > 0

    def points(self, points: FloatArray) -> FloatArray:
        """Return where points (n, 2) of the frame are shown."""
        return points * self.zoom + self._offset

    def curve(self, curve: BSplineCurve) -> BSplineCurve:
        """Return a curve in the frame as it is shown."""
        return curve.transformed(np.eye(2) * self.zoom, self._offset)

    @property
    def _offset(self) -> FloatArray:
        return (0.5 - np.array([self.left, self.top])) * self.zoom - 0.5

    def _resized(self, array: ByteArray) -> ByteArray:
        part = array[self.top : self.top + self.height, self.left : self.left + self.width]
        how = cv2.INTER_NEAREST if self.zoom >= 1.0 else cv2.INTER_AREA
        return cv2.resize(part, self.size, interpolation=how).astype(np.uint8, copy=False)


def _box(mask: BoolArray) -> tuple[int, int, int, int]:
    height, width = mask.shape
    columns, rows = np.flatnonzero(mask.any(axis=0)), np.flatnonzero(mask.any(axis=1))
    if not len(columns):
        return 0, 0, width, height
    wide, high = int(columns[-1] - columns[0]) + 1, int(rows[-1] - rows[0]) + 1
    margin = 2.0 * _MARGIN * max(wide, high)
    wide_room = max(wide + margin, _MIN_ASPECT * (high + margin), _MIN_SIDE_PX)
    high_room = max(high + margin, _MIN_ASPECT * (wide + margin), _MIN_SIDE_PX)
    if wide_room * high_room > _WHOLE_FROM * width * height:
        return 0, 0, width, height
    left, wide = _centred(int(columns[0]), wide, wide_room, width)
    top, high = _centred(int(rows[0]), high, high_room, height)
    return left, top, wide, high


def _centred(start: int, extent: int, wanted: float, limit: int) -> tuple[int, int]:
    """Grow an interval to the wanted extent about its middle, and push it inside of 0..limit."""
    size = min(math.ceil(wanted), limit)
    return max(0, min(start + (extent - size) // 2, limit - size)), size
