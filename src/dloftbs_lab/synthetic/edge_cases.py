"""Drawn edge cases: single images of one or two cables, each with one thing that is hard about them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.data.frame import Frame
from dloftbs_lab.synthetic import edge_case_drawings as drawings
from dloftbs_lab.synthetic.edge_case_drawings import Drawn, Sheet
from dloftbs_lab.synthetic.free_ends import END_STYLES, EndStyle, draw_cable_mask
from dloftbs_lab.synthetic.generated import GeneratedSequence, check_choice, count_at, truth_of
from dloftbs_lab.synthetic.sketch import smooth_noise
from dloftbs_lab.synthetic.workbench import draw_wood
from dloftbs_lab.truth import Truth

Draw = Callable[[np.random.Generator, Sheet, float], list[Drawn]]

_TOLERANCE_PX = 5.0
_WIDTHS_PX = (4.0, 12.0)
_ANGLES_DEG = (90, 75, 60, 45, 40, 35, 30)
_FLAT: tuple[EndStyle, ...] = ("flat",)
_FULL = 24
"""Images of a kind at scale 1."""
_SHADE = 0.45  # how much darker a cable is at its edges
_GRAIN = 4.0  # grey levels
_BLUR_PX = 0.6


@dataclass(frozen=True)
class _Kind:
    """Drawing of one kind; the last argument of `draw` goes from 0 to 1 through the images of a sequence.

    Without `width_px` each image has cables of a width of its own; with `picture` each has a colour picture too.
    """

    draw: Draw
    width_px: float | None = None
    picture: bool = False


def _bend(degrees: int) -> Draw:
    return lambda rng, sheet, share: drawings.bend(
        rng, sheet, math.radians(degrees), 2.0 * math.pi * (share + float(rng.uniform(0.0, 1.0 / _FULL)))
    )


_KINDS: Mapping[str, _Kind] = {
    **{f"bend of {deg} degrees, {width:g} px": _Kind(_bend(deg), width) for deg in _ANGLES_DEG for width in _WIDTHS_PX},
    "facing flat ends": _Kind(lambda rng, sheet, _: drawings.facing(rng, sheet, _FLAT)),
    "facing ends": _Kind(lambda rng, sheet, _: drawings.facing(rng, sheet, END_STYLES)),
    "facing flat ends, picture": _Kind(lambda rng, sheet, _: drawings.facing(rng, sheet, _FLAT), picture=True),
    "facing ends, picture": _Kind(lambda rng, sheet, _: drawings.facing(rng, sheet, END_STYLES), picture=True),
    "T": _Kind(lambda rng, sheet, _: drawings.junction(rng, sheet, (math.radians(70.0), math.radians(110.0)))),
    "Y": _Kind(lambda rng, sheet, _: drawings.junction(rng, sheet, (math.radians(25.0), math.radians(55.0)))),
    "parallel": _Kind(lambda rng, sheet, _: drawings.parallel(rng, sheet)),
    "ends at the border": _Kind(lambda rng, sheet, _: drawings.border(rng, sheet)),
    "crossed ring": _Kind(lambda rng, sheet, _: drawings.crossed_ring(rng, sheet)),
    "broken": _Kind(lambda rng, sheet, _: drawings.broken(rng, sheet)),
    "ends near each other": _Kind(lambda rng, sheet, _: drawings.nearby(rng, sheet)),
    "broken, picture": _Kind(lambda rng, sheet, _: drawings.broken(rng, sheet), picture=True),
    "close ends, picture": _Kind(lambda rng, sheet, _: drawings.close(rng, sheet), picture=True),
    "frayed near the camera": _Kind(lambda rng, sheet, _: drawings.frayed(rng, sheet)),
}

EDGE_CASES = tuple(_KINDS)
"""Drawings: sharp bends, ends that face each other, a cable that ends under another at 90 degrees or less, cables
side by side, two that the border cuts, a ring with a cable across it, a cable whose mask is broken where its picture is
not, ends of two cables that lie near each other and lead elsewhere, and such that face each other across a break; a
cable that comes near the camera with a frayed end."""


class EdgeCaseSequence(GeneratedSequence):
    """Single images of one kind, as perfect masks or with colour pictures beside them; lengths and widths are in px.

    Free ends are flat, round, frayed or tapered; those of sharp bends flat or round.

    Parameters
    ----------
    kind : str
        One of `EDGE_CASES`.
    frames : int
        Number of images; sharp bends are turned all the way round in them.
    size : (int, int)
        ``(H, W)`` px; drawings grow no larger than in an image of 640 x 480.
    seed : int
        Another seed gives other images.

    Raises
    ------
    InputError
        If a value is out of range.
    """

    tolerance_px = _TOLERANCE_PX

    def __init__(self, kind: str, frames: int = _FULL, size: tuple[int, int] = (480, 640), seed: int = 0) -> None:
        check_choice("kind", kind, EDGE_CASES)
        super().__init__(kind, frames, size, seed, None)

    def _make_frame(self, index: int) -> Frame:
        """Return one frame with the mask, shape (H, W) bool, and the image, shape (H, W, 3), where the kind has any."""
        mask = self.truth(index).mask
        assert mask is not None  # all truths here have masks
        image = None
        if _KINDS[self.name].picture:
            cables, width = self._draw(index)
            whole = self._owners([replace(cable, gaps=()) for cable in cables], width) >= 0
            image = paint_picture(self._rng(index, 1), whole)
        return Frame(image, mask, **self._labels(index))

    def _make_truth(self, index: int) -> Truth:
        cables, width = self._draw(index)
        return truth_of((cable.curve() for cable in cables), self._owners(cables, width))

    def _draw(self, index: int) -> tuple[list[Drawn], float]:
        """Draw one image: its cables, and their width, px."""
        kind, rng = _KINDS[self.name], self._rng(index, 0)
        width = float(rng.uniform(*_WIDTHS_PX)) if kind.width_px is None else kind.width_px
        return kind.draw(rng, Sheet(self.size, width), index / self._frames), width

    def _owners(self, cables: Sequence[Drawn], width: float) -> npt.NDArray[np.int16]:
        """Return the number of the uppermost cable at each pixel, shape (H, W); -1 for none."""
        owner = np.full(self.size, -1, np.int16)
        for number, cable in enumerate(cables):
            for points, widths, ends in cable.pieces:
                owner[draw_cable_mask(points, width * widths, self.size, ends)] = number
        return owner

    def _rng(self, index: int, purpose: int) -> np.random.Generator:
        return np.random.default_rng([self.seed, EDGE_CASES.index(self.name), index, purpose])


def paint_picture(rng: np.random.Generator, mask: npt.NDArray[np.bool_]) -> npt.NDArray[np.uint8]:
    """Paint cables of one colour, given by their mask (H, W), on wood or cloth; shape (H, W, 3) BGR."""
    size = mask.shape[0], mask.shape[1]
    if rng.random() < 0.5:
        ground = draw_wood(rng, size, 1.0)
    else:
        tone, weave = rng.uniform(40.0, 200.0, 3), smooth_noise(rng, size, (3.0, 3.0))
        ground = tone + 14.0 * weave[..., None] + 10.0 * smooth_noise(rng, size, (90.0, 90.0))[..., None]
    hue = np.array([[[rng.integers(180), rng.integers(150, 256), rng.integers(120, 256)]]], np.uint8)
    dye = cv2.cvtColor(hue, cv2.COLOR_HSV2BGR)[0, 0].astype(np.float64)
    depth = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    light = 1.0 - _SHADE * (1.0 - depth / max(float(depth.max()), 1.0)) ** 2
    cover = cv2.GaussianBlur(mask.astype(np.float64), (0, 0), _BLUR_PX)[..., None]
    picture = ground + cover * (dye * light[..., None] - ground) + rng.normal(0.0, _GRAIN, (*size, 3))
    return picture.clip(0.0, 255.0).round().astype(np.uint8)


def edge_cases(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[EdgeCaseSequence]:
    """Return 24 images of each of the `EDGE_CASES`, by the scale; at least three."""
    return [EdgeCaseSequence(kind, count_at(scale, _FULL, 3), size, seed) for kind in EDGE_CASES]
