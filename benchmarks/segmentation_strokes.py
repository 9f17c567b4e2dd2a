"""Strokes as a person draws them: along a cable more or less, partly beside it, and through what a mask gets wrong."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt
from skimage.morphology import skeletonize

from benchmarks.segmentation_scenes import Picture, Rng
from dloftbs.segmentation import Stroke

_STEP_PX = 7.0  # between the points that a mouse reports
_LENGTHS_PX = 60.0, 200.0  # of a stroke
_SHORT_PX = 80.0
_JITTER_WIDTHS = 0.3  # of the hand, as a share of the cable's width, and no more than
_JITTER_PX = 3.0
_MIN_BLOB_PX = 60  # a person does not care for less
_MAX_BLOBS = 3  # strokes for what is wrong, each way

Mask = npt.NDArray[np.bool_]


def along_cables(picture: Picture, rng: Rng, each: int = 2) -> list[Stroke]:
    """Draw some strokes on each cable."""
    return [_along(picture.labels == number, rng) for number in picture.numbers for _ in range(each)]


def short_strokes(picture: Picture, rng: Rng, hand: float = 1.0) -> list[Stroke]:
    """Draw two strokes of 80 px on each cable, with a hand that trembles so many times as much as usual."""
    return [
        _along(picture.labels == number, rng, length_px=_SHORT_PX, hand=hand)
        for number in picture.numbers
        for _ in range(2)
    ]


def second_round(picture: Picture, mask: npt.NDArray[np.uint8] | npt.NDArray[np.bool_], rng: Rng) -> list[Stroke]:
    """Draw two strokes of 80 px on the largest parts that are missing, and one on the largest that is no cable."""
    missing, extra = _wrong(picture, mask)
    found = []
    for blob in _largest(missing)[:2]:
        row, column = np.argwhere(blob)[rng.integers(blob.sum())]
        cable = picture.labels == picture.labels[row, column]
        found.append(_along(cable, rng, (float(column), float(row)), length_px=_SHORT_PX))
    return found + [_along(blob, rng, cable=False, length_px=_SHORT_PX) for blob in _largest(extra)[:1]]


def _wrong(picture: Picture, mask: npt.NDArray[np.uint8] | npt.NDArray[np.bool_]) -> tuple[Mask, Mask]:
    """Return missing cable, and ground that is taken for cable."""
    true = picture.labels > 0
    return true & (mask == 0), (mask > 0) & ~cv2.dilate(true.astype(np.uint8), np.ones((5, 5))).astype(bool)


def corrections(picture: Picture, mask: npt.NDArray[np.uint8] | npt.NDArray[np.bool_], rng: Rng) -> list[Stroke]:
    """Draw strokes through the largest parts that are wrong: missing cable, and ground taken for cable."""
    missing, extra = _wrong(picture, mask)
    strokes = []
    for blob in _largest(missing):
        row, column = np.argwhere(blob)[rng.integers(blob.sum())]
        strokes.append(_along(picture.labels == picture.labels[row, column], rng, (float(column), float(row))))
    return strokes + [_along(blob, rng, cable=False) for blob in _largest(extra)]


def _largest(wrong: Mask) -> list[Mask]:
    joined = cv2.morphologyEx(wrong.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5)))
    _, labels, stats, _ = cv2.connectedComponentsWithStats(joined)
    areas = stats[1:, cv2.CC_STAT_AREA]
    order = np.argsort(-areas)[:_MAX_BLOBS]
    return [labels == 1 + k for k in order if areas[k] >= _MIN_BLOB_PX]


def _along(
    part: Mask,
    rng: Rng,
    near: tuple[float, float] | None = None,
    *,
    cable: bool = True,
    length_px: float | None = None,
    hand: float = 1.0,
) -> Stroke:
    """Draw along the middle of a part, with a hand that trembles."""
    places = np.argwhere(skeletonize(part))[:, ::-1].astype(np.float64)
    if len(places) == 0:
        places = np.argwhere(part)[:, ::-1].astype(np.float64)
    width = 2.0 * float(cv2.distanceTransform(part.astype(np.uint8), cv2.DIST_L2, 5)[part].max())
    at = places[rng.integers(len(places))] if near is None else places[_nearest(places, near)]
    path, length = [at], 0.0
    left = places
    heading = rng.normal(0.0, 1.0, 2)
    wanted = rng.uniform(*_LENGTHS_PX) if length_px is None else length_px
    while length < wanted:  # on to the place about a step away that turns least
        away = left - at
        distance = np.hypot(*away.T)
        ring = np.flatnonzero((distance > 0.7 * _STEP_PX) & (distance < 1.5 * _STEP_PX))
        ring = ring[away[ring] @ heading > 0.0] if len(path) > 1 else ring
        if len(ring) == 0:
            break
        best = ring[np.argmax((away[ring] @ heading) / distance[ring])]
        heading, at, length = away[best], left[best], length + float(distance[best])
        path.append(at)
    points = np.array(path)
    wander = np.cumsum(rng.normal(0.0, 1.0, points.shape), axis=0)
    wander -= np.linspace(wander[0], wander[-1], len(wander))
    tremble = rng.normal(0.0, 1.0, points.shape)
    offset = 0.5 * wander / max(float(np.std(wander)), 1.0) + 0.8 * tremble + rng.normal(0.0, 0.4, 2)
    size = part.shape
    points = np.clip(points + hand * min(_JITTER_WIDTHS * width, _JITTER_PX) * offset, 0.0, (size[1] - 1, size[0] - 1))
    return Stroke(points=points.round(1).tolist(), cable=cable)


def _nearest(places: npt.NDArray[np.float64], point: tuple[float, float]) -> int:
    return int(np.argmin(np.hypot(*(places - point).T)))
