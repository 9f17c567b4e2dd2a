"""Faults of masks that break objects up: threads along edges, holes and specks, and the setting that removes them."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import cv2
import msgspec
import numpy as np

from dloftbs.cleaning import clean
from dloftbs.config import CleaningConfig
from dloftbs.data.detection import Detection
from dloftbs.support.arrays import AnyArray, ByteArray

_MAX_MASKS = 5
"""Number of masks that are looked at.

Source: bounds time; as many are cleaned in some milliseconds each.
"""
_SIDES_PX = (3, 5, 7, 9, 11)
"""Sides of the squares that are tried for an opening or a closing, px.

Source: by definition, the odd numbers, up to an opening that few cables survive.
"""
_MIN_LEFT = 0.5
"""Largest share of the faults that a setting may leave to be worth its name.

Source: by hand; most are gone.
"""
_MIN_KEPT = 0.9
"""Least share of the thick part of a mask that a setting must keep.

Source: by hand; an opening as wide as a cable takes all of it.
"""


class _Faults(NamedTuple):
    """Sizes of the faults of masks, px: lengths of threads, widths of holes and of specks."""

    threads: list[float]
    holes: list[float]
    specks: list[float]


class MaskSamples:
    """The last masks with which the number of objects changed; nothing is measured before somebody asks.

    Parameters
    ----------
    config : CleaningConfig
        That the masks are cleaned with.
    """

    def __init__(self, config: CleaningConfig) -> None:
        self._config = config
        self._masks: deque[tuple[AnyArray, float]] = deque(maxlen=_MAX_MASKS)
        self._count: int | None = None

    def add(self, mask: AnyArray | None, detections: Sequence[Detection], count: int) -> None:
        """Take the mask of a frame, what was found in it, and the number of tracks."""
        if mask is not None and detections and self._count not in (None, count):
            self._masks.append((mask, float(np.median([detection.width_px for detection in detections]))))
        self._count = count

    def describe(self) -> str | None:
        """Return the faults that the cleaning leaves, and the setting that removes most of them; None without any."""
        before, thick = self._measured(self._config)
        if not any(before):
            return None
        seen = " and ".join(_told(*kind, len(self._masks)) for kind in zip(_KINDS, before, strict=True) if kind[1])
        for changes in self._settings(before):
            after, kept = self._measured(msgspec.structs.replace(self._config, **changes))
            if _number(after) <= _MIN_LEFT * _number(before) and kept >= _MIN_KEPT * thick:
                options = " ".join(f"--set cleaning.{name}={str(value).lower()}" for name, value in changes.items())
                share = 100.0 * (1.0 - _number(after) / _number(before))
                return f"in a frame, {seen}; {options} removes {share:.0f} % of them"
        return f"in a frame, {seen}"

    def _settings(self, faults: _Faults) -> Iterator[dict[str, Any]]:
        """Yield the settings that may help, those that change least first."""
        if faults.threads and self._config.thin_px:
            yield {"thin_px": 0}
        if faults.holes and not self._config.fill_holes:
            yield {"fill_holes": True}
        for side in _SIDES_PX:
            if (faults.specks or faults.threads) and side > self._config.open_px:
                yield {"open_px": side}
                if self._config.thin_px:  # by which larger specks come back
                    yield {"open_px": side, "thin_px": 0}
            if faults.holes and side > self._config.close_px:
                yield {"close_px": side}

    def _measured(self, config: CleaningConfig) -> tuple[_Faults, int]:
        """Return the faults of all masks once they are cleaned, and the pixels of their thick parts."""
        faults, thick = _Faults([], [], []), 0
        for mask, width_px in self._masks:
            crop = clean(mask, config)
            if crop is not None:
                h, w = crop.size
                thick += _measure(np.ascontiguousarray(crop.pixels[1 : h + 1, 1 : w + 1]), width_px, faults)
        return faults, thick


_KINDS = ("thread along an edge", "hole", "speck")


def _number(faults: _Faults) -> int:
    return sum(len(sizes) for sizes in faults)


def _told(kind: str, sizes: list[float], masks: int) -> str:
    """Return how many there are of a kind in a frame, and their median size."""
    count = max(round(len(sizes) / masks), 1)
    name = kind if count == 1 else kind.replace("thread ", "threads ").replace("an edge", "edges")
    plural = "" if count == 1 or name.startswith("threads") else "s"
    return f"{count} {name}{plural} of about {np.median(sizes):.0f} px"


def _measure(mask: ByteArray, width_px: float, faults: _Faults) -> int:
    """Add the faults of a mask of 0 and 1 to the others; return the pixels of its thick part, specks aside."""
    square = np.ones((3, 3), np.uint8)
    padded = cv2.copyMakeBorder(mask, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=0)
    thick = cv2.dilate(cv2.erode(padded, square), square)[1:-1, 1:-1]
    beside = cv2.dilate(thick, np.ones((7, 7), np.uint8))  # a slit of two pixels away at most
    for area, near, length in _parts(mask & ~thick & 1, beside):
        if 2 * near > area and length > width_px:
            faults.threads.append(length)
    most = width_px * width_px
    specks = [(area, marked) for area, marked, _ in _parts(mask, thick) if area < most]
    faults.specks.extend(float(np.sqrt(area)) for area, _ in specks)
    ground = cv2.copyMakeBorder(1 - mask, 1, 1, 1, 1, cv2.BORDER_CONSTANT, value=1)
    outside = np.zeros_like(ground)
    outside[0] = 1
    inner = (area for area, marked, _ in _parts(ground, outside, connectivity=4) if not marked)
    faults.holes.extend(float(np.sqrt(area)) for area in inner if area < most)
    return int(np.count_nonzero(thick)) - sum(marked for _, marked in specks)


def _parts(pixels: ByteArray, marked: ByteArray, connectivity: int = 8) -> Iterator[tuple[int, int, float]]:
    """Yield the number of pixels of each connected part, of those among them that are marked, and its length, px."""
    number, labels, stats, _ = cv2.connectedComponentsWithStats(np.ascontiguousarray(pixels), connectivity=connectivity)
    inside = np.bincount(labels.ravel(), weights=marked.ravel() != 0, minlength=number)
    for label in range(1, number):
        sides = stats[label, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]]
        yield int(stats[label, cv2.CC_STAT_AREA]), int(inside[label]), float(np.hypot(*sides))
