"""Answers that go with a result on request: its topology, its shape, and how sure each point is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from importlib import import_module
from typing import Any

import numpy as np

from dloftbs.data.detection import Detection
from dloftbs.data.frame_result import FrameResult
from dloftbs.data.tracks import Track
from dloftbs.data.u_mapping import is_in_front
from dloftbs.errors import InputError
from dloftbs.support.values import shown

KINDS = ("topology", "shape", "std")
"""Answers that there are: `dloftbs.topology.describe` of the result, and bends and deviations of each object."""

_PLACES = tuple(np.linspace(0.0, 1.0, 11).tolist())
"""Places of the deviations, ``u``."""


def with_answers(result: FrameResult, kinds: Sequence[str]) -> dict[str, Any]:
    """Return `FrameResult.to_dict`, and with it what was asked for, under keys of those names.

    ``topology`` is a key of the result, or None where that cannot be said; ``shape`` and ``std`` are keys of each
    detection and each track.

    Raises
    ------
    InputError
        If there is no such answer.
    """
    check_kinds(kinds)
    row = result.to_dict()
    if "topology" in kinds:
        row["topology"] = import_module("dloftbs.topology").describe(result)
    for name, answer in _ANSWERS.items():
        if name in kinds:
            _add(name, answer, result.detections, row["detections"])
            _add(name, answer, result.tracks, row["tracks"])
    return row


def check_kinds(kinds: Sequence[str]) -> tuple[str, ...]:
    """Return the names of answers.

    Raises
    ------
    InputError
        If they are no sequence, or there is another name among them.
    """
    if isinstance(kinds, str) or not isinstance(kinds, Sequence):
        raise InputError(f"answers must be a sequence of {', '.join(KINDS)}, got {shown(kinds)}")
    for kind in kinds:
        if kind not in KINDS:
            raise InputError(f"answers are {', '.join(KINDS)}, got {shown(kind)}")
    return tuple(kinds)


def describe_shape(one: Detection | Track) -> dict[str, Any]:
    """Return length, width and tightest bend of an object, px and metres; None where it has no curve in space."""
    u, radius = one.tightest_bend()
    in_space = one.curve_3d is not None
    u_3d, radius_m = one.tightest_bend_3d() if in_space else (None, math.inf)
    return {
        "length_px": one.curve.length,
        "bend_u": u,
        "bend_radius_px": radius if math.isfinite(radius) else None,
        "length_m": None if one.curve_3d is None else one.curve_3d.length,
        "width_m": one.width_m,
        "bend_u_3d": u_3d,
        "bend_radius_m": radius_m if math.isfinite(radius_m) else None,
    }


def describe_std(one: Detection | Track) -> dict[str, Any]:
    """Return the deviations at eleven places of an object, even in the image, px and metres; None if not known."""
    seen = one if isinstance(one, Detection) else one.detection
    return {
        "u": list(_PLACES),
        "px": None if seen is None else one.curve_std(_PLACES).tolist(),
        "m": one.curve_3d_std(one.u_3d(_PLACES)).tolist() if _is_measured_in_space(one, seen) else None,
    }


def _is_measured_in_space(one: Detection | Track, seen: Detection | None) -> bool:
    """Return whether an object and what was seen of it have curves in space whose image is known."""
    if seen is None or seen.curve_3d is None or seen.camera is None or one.curve_3d is None or one.camera is None:
        return False
    return is_in_front(one.curve_3d) and is_in_front(seen.curve_3d)


_Answer = Callable[[Detection | Track], dict[str, Any]]
_ANSWERS: dict[str, _Answer] = {"shape": describe_shape, "std": describe_std}


def _add(name: str, answer: _Answer, objects: Sequence[Detection | Track], rows: list[dict[str, Any]]) -> None:
    for one, row in zip(objects, rows, strict=True):
        row[name] = answer(one)


class BendLimit:
    """Least radius of bends that is allowed.

    Parameters
    ----------
    radius : float
        Metres, or pixels.
    in_pixels : bool
        Whether it is in pixels, of curves in the image.
    """

    def __init__(self, radius: float, *, in_pixels: bool = False) -> None:
        self.radius = radius
        self.in_pixels = in_pixels

    @classmethod
    def parse(cls, text: str) -> BendLimit:
        """Read a limit: ``0.03`` is in metres, ``40px`` in pixels.

        Raises
        ------
        InputError
            If it is no positive number.
        """
        number = text.removesuffix("px")
        try:
            radius = float(number)
        except ValueError:
            radius = math.nan
        if not 0.0 < radius < math.inf:
            raise InputError(f"expected a radius in metres, such as 0.03, or in pixels, such as 40px, got {text!r}")
        return cls(radius, in_pixels=number != text)

    def __str__(self) -> str:
        return f"{self.radius:g} px" if self.in_pixels else f"{1e3 * self.radius:g} mm"

    def violations(self, result: FrameResult) -> Iterator[str]:
        """Yield a line for each object that bends more, the tracks of a result or else its detections.

        Objects of `unknown` give none.
        """
        for name, one in objects_of(result):
            if not self.in_pixels and one.curve_3d is None:
                continue
            u, radius = one.tightest_bend() if self.in_pixels else one.tightest_bend_3d()
            if radius < self.radius:
                found = f"{radius:.3g} px" if self.in_pixels else f"{1e3 * radius:.3g} mm"
                yield f"{name} bends to {found} at u = {u:.2f}, below {self}"

    def unknown(self, result: FrameResult) -> dict[str, str]:
        """Return why bends cannot be compared with the limit, by the names of the objects: no curve in space."""
        return {
            name: _why_not_in_space(one)
            for name, one in objects_of(result)
            if not self.in_pixels and one.curve_3d is None
        }

    def is_tighter(self, one: Detection | Track, u: Sequence[float]) -> list[bool]:
        """Return whether an object bends more at places ``u`` of its curve in the image; nowhere if it is not known."""
        if self.in_pixels:
            radii = one.bend_radius(u)
        elif one.curve_3d is None or one.camera is None:
            return [False] * len(u)
        else:
            radii = one.bend_radius_3d(one.u_3d(u))
        return (radii < self.radius).tolist()


def objects_of(result: FrameResult) -> list[tuple[str, Detection | Track]]:
    """Return the tracks of a result, or where it has none its detections, with names for people."""
    if result.tracks:
        return [(f"track {track.id}", track) for track in result.tracks]
    return [(f"detection {number}", one) for number, one in enumerate(result.detections)]


def _why_not_in_space(one: Detection | Track) -> str:
    seen = one if isinstance(one, Detection) else one.detection
    if seen is None:
        return "the frame does not show it, and it was not seen in space before"
    return seen.no_3d_reason or "nobody said why it has no curve in space"
