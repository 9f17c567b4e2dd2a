"""Thickness of cables in metres, and what it says of the unit of depth."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from dloftbs.data.detection import Detection
from dloftbs.data.frame import Frame

THINNEST_M, THICKEST_M = 0.0005, 0.1
"""Thickness of the thinnest and the thickest cable that is plausible, metres.

Source: by hand; wire for electronics has 0.6 mm with its insulation, a fire hose 75 mm, and a unit that is wrong is so
by a factor of ten or more.
"""


def thickness_m(detection: Detection) -> tuple[float, float] | None:
    """Return how thick a cable is, and its median distance along the optical axis, both m; None without depth."""
    curve, width_m = detection.curve_3d, detection.width_m
    if curve is None or width_m is None:
        return None
    return width_m, float(np.median(curve.control_points[:, 2]))


def doubt_unit(detections: Sequence[Detection], frame: Frame) -> str | None:
    """Return why the unit of a frame's depth is hardly what it is taken for; None if it may be.

    The cable of the median thickness counts.
    """
    known = sorted((measured, one.width_px) for one in detections if (measured := thickness_m(one)) is not None)
    if not known or frame.depth is None:
        return None
    (thick_m, distance_m), width_px = known[len(known) // 2]
    if THINNEST_M <= thick_m <= THICKEST_M:
        return None
    too_thick = thick_m > THICKEST_M
    # The least power of ten that makes it plausible: cameras count 1 mm or 0.1 mm.
    powers = math.ceil(math.log10(thick_m / THICKEST_M if too_thick else THINNEST_M / thick_m))
    factor = 10.0 ** (-powers if too_thick else powers)
    found = f"a cable of {width_px:.0f} px would be {1e3 * thick_m:.3g} mm thick at {distance_m:.3g} m"
    if frame.depth.dtype.kind == "f":
        return f"{found}: is the depth in metres? Multiply it by {factor:g}, or check the camera's focal length"
    unit_m = factor * frame.depth_unit_m
    return (
        f"{found}: is a count of the depth {1e3 * unit_m:g} mm? Set depth_unit_m={unit_m:g} (--depth-unit {unit_m:g}), "
        "or check the camera's focal length"
    )
