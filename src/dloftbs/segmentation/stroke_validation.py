"""Expected quality of a mask from strokes: what is found beneath each stroke by the others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.config import ColourConfig, Stroke
from dloftbs.segmentation.colour_model import ColourModel, picture_of
from dloftbs.segmentation.stroke_widths import axes_beneath, cables_beneath


class Expected(NamedTuple):
    """Shares of the cables, and of the ground beside them, that a mask takes for cable."""

    cable: float
    ground: float


def cross_validate(image: npt.NDArray[np.uint8], strokes: Sequence[Stroke]) -> Expected | None:
    """Return what a model of strokes is expected to find; None with fewer than two strokes along cables.

    Each stroke along a cable is left out in turn. What lies beneath it, from edge to edge, and beside it is compared
    with the mask by the other strokes. A cable of a colour of its own needs two strokes, or it is missed.

    Parameters
    ----------
    image : numpy.ndarray, shape (H, W, 3), uint8
        BGR.
    strokes : sequence of Stroke

    Raises
    ------
    InputError
        If a stroke leaves the picture.
    """
    shares = []
    axes = axes_beneath(image, strokes)
    for number, stroke in enumerate(strokes):
        others = [*strokes[:number], *strokes[number + 1 :]]
        if not stroke.cable or not any(one.cable for one in others):
            continue
        beneath = cables_beneath(image, [stroke], axes)
        if not beneath.width_px > 0.0 or not beneath.beside.any():
            continue
        mask = ColourModel(ColourConfig(pictures=(picture_of(image, others, axes=axes),)))(image)
        shares.append((mask[beneath.cable].mean(), mask[beneath.beside].mean()))
    return Expected(*(float(share) for share in np.mean(shares, axis=0))) if shares else None
