"""The pictures of docs/tracking.md: a few frames of generated sequences, with the tracks that the default method has.

Run it in the repository with ``python -m benchmarks.tracking_strip``. It draws a PNG a strip into docs/images/tracking.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from dloftbs import Config, Pipeline
from dloftbs.data.frame_result import FrameResult
from dloftbs.viz import Style, contact_sheet, draw
from dloftbs.viz.shapes import Picture
from dloftbs.viz.style import Colour
from dloftbs_lab.synthetic import TrackingSequence

PICTURES = Path("docs/images/tracking")

_SIZE = (432, 768)
_TILE_PX = 480
_COLUMNS = 3
_OCCLUDER: Colour = (86, 60, 44)
_WIDTH_PX = 11.0
# As large as they must be to be read in tiles of less than half the width of an HD image.
_STYLE = Style(
    line_px=6.0, halo_px=2.5, dash_px=18.0, arrow_px=17.0, arrow_spacing_px=220.0, marker_px=11.0, text_px=28.0
)


@dataclass(frozen=True)
class Strip:
    """Frames of a sequence.

    Parameters
    ----------
    name : str
        Of the picture.
    family : str
    cables, number : int
        As `TrackingSequence` takes them.
    shown : tuple of int
        The frames to show, ascending.
    """

    name: str
    family: str
    cables: int
    number: int
    shown: tuple[int, ...]


STRIPS = (
    Strip("occlusion", "occluded", 3, 1, (4, 18, 26, 34, 42, 56)),
    Strip("hidden", "hidden", 1, 0, (10, 18, 22, 28, 34, 44)),
)


def main() -> None:
    """Draw all strips."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    for strip in STRIPS:
        cv2.imwrite(str(PICTURES / f"{strip.name}.png"), draw_strip(strip), [cv2.IMWRITE_PNG_COMPRESSION, 9])


def draw_strip(strip: Strip) -> Picture:
    """Follow the cables of a sequence, and return some of its frames with their tracks, side by side."""
    sequence = TrackingSequence(strip.family, strip.cables, strip.number, size=_SIZE, width_px=_WIDTH_PX)
    pipeline = Pipeline(Config())
    tiles = []
    for index in range(max(strip.shown) + 1):
        result = pipeline.process(sequence.frame(index))
        if index in strip.shown:
            tiles.append(_tile(sequence, index, result))
    return contact_sheet(tiles, [f"frame {index}" for index in strip.shown], columns=_COLUMNS, tile_width=_TILE_PX)


def _tile(sequence: TrackingSequence, index: int, result: FrameResult) -> Picture:
    """Return a frame with its tracks: cables grey, occluders blue."""
    picture = np.empty((*_SIZE, 3), np.uint8)
    picture[:] = _STYLE.ink
    picture[sequence.covered(index)] = _OCCLUDER
    picture[sequence.truth(index).mask] = _STYLE.mask
    return draw(picture, result, style=_STYLE)


if __name__ == "__main__":
    main()
