"""Expected quality of a mask from strokes: what is found beneath each stroke by the others."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from dloftbs.config import ColourConfig, Roi, Stroke
from dloftbs.data.frame_region import Region
from dloftbs.segmentation.colour_model import ColourModel, picture_of, width_in
from dloftbs.segmentation.stroke_widths import axes_beneath, cables_beneath


class Expected(NamedTuple):
    """Shares of the cables, and of the ground beside them, that a mask takes for cable."""

    cable: float
    ground: float


def cross_validate(
    image: npt.NDArray[np.uint8],
    strokes: Sequence[Stroke],
    learned: ColourConfig | None = None,
    number: int = 0,
    roi: Roi | None = None,
) -> Expected | None:
    """Return what a model of strokes is expected to find; None with fewer than two strokes along cables.

    Each stroke along a cable is left out in turn. What lies beneath it, from edge to edge, and beside it is compared
    with the mask by the other strokes. A cable of a colour of its own needs two strokes, or it is missed.

    Parameters
    ----------
    image : numpy.ndarray, shape (H, W, 3), uint8
        BGR.
    strokes : sequence of Stroke
    learned : ColourConfig, optional
        The model, with these strokes and maybe others; by default, of these strokes alone.
    number : int
        Of this picture among those of the model.
    roi : Roi, optional
        Region of interest in which the model is used.

    Raises
    ------
    InputError
        If a stroke leaves the picture, or the region does not lie within it.
    """
    before, after = ((), ()) if learned is None else (learned.pictures[:number], learned.pictures[number + 1 :])
    accepts = learned is not None and learned.accept_strokes
    height, width = image.shape[:2]
    region = Region(roi or (0, 0, width, height), (height, width))
    inside = region.paste(np.ones(region.size, np.bool_))
    axes = axes_beneath(image, strokes)
    shares = []
    for left_out, stroke in enumerate(strokes):
        others = [*strokes[:left_out], *strokes[left_out + 1 :]]
        is_known = any(one.cable for one in others) or any(picture.cable for picture in (*before, *after))
        if not stroke.cable or not is_known:
            continue
        beneath = cables_beneath(image, [stroke], axes)
        cable, beside = beneath.cable & inside, beneath.beside & inside
        if not beneath.width_px > 0.0 or not cable.any() or not beside.any():
            continue
        picture = picture_of(image, others, roi, axes=axes, width_px=width_in((*before, *after)))
        pictures = ColourModel.together((*before, picture, *after))
        model = ColourModel(ColourConfig(pictures=pictures, accept_strokes=accepts))
        mask = region.paste(model(region.cut(image)))
        shares.append((mask[cable].mean(), mask[beside].mean()))
    return Expected(*(float(share) for share in np.mean(shares, axis=0))) if shares else None
