"""Reasons, in words, for a frame without objects."""

from __future__ import annotations

from dloftbs.config import Config, ObjectsConfig
from dloftbs.data.frame import Frame
from dloftbs.pipeline.plausibility import grey_hint
from dloftbs.support.arrays import AnyArray


def why_nothing_is_left(mask: AnyArray, config: Config, frame: Frame, is_soft: bool) -> str:
    """Say why the cleaned mask is empty, which may be that of a probability."""
    if mask.any():
        side = config.cleaning.open_px
        hint = (
            "" if frame.mask is not None else ": the segmentation marks only specks; widen the colour, or draw a stroke"
        )
        return f"nothing of the mask is left after the opening by {side} x {side} px{hint}"
    if frame.mask is not None:
        if is_soft:
            return "the mask is a probability that nowhere is one half or more: threshold it lower (mask > 31)"
        return "the mask is empty"
    if frame.image is None:
        return "the mask is empty: the segmentation finds no cable"
    hint = grey_hint(frame.image, config.segmentation)
    if not hint and not frame.name:  # an array of somebody's own
        hint = " (arrays are BGR: turn an RGB one by image[..., ::-1])"
    return f"the mask is empty: the segmentation finds no cable in the image{hint}"


def why_too_short(config: ObjectsConfig) -> str:
    """Say how long an object has to be."""
    return (
        f"nothing is as long as linking.min_length_px = {config.min_length_px} and "
        f"linking.min_length_widths = {config.min_length_widths:g}"
    )


def too_many(found: int, most: int) -> str:
    """Say that there are more segments than are looked at."""
    return f"{found} segments are more than segments.max_segments = {most}: this mask is noise"
