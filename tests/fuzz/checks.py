"""What must hold of every result, whatever went in."""

from __future__ import annotations

import functools
import itertools
import json
import math
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from drawings import EIGHT_VERSIONS, turn, turn_points
from scipy.spatial import cKDTree

import dloftbs
from dloftbs import BSplineCurve, Config, Detection, DloftbsError, Frame, FrameResult, Pipeline
from dloftbs.linking.end_matching import PRIOR_BONUS

T = TypeVar("T")

FRAME_CPU_S = 10.0
"""CPU time that a frame of a megapixel may take at most: tens of times what the worst takes, for slow machines."""
EXACT_PX = 1e-6
"""Curves of turned and shifted masks agree up to rounding."""
_FINE, _SHARE = 20_001, 1e-4  # points of a polyline, and what lengths may differ from it, as shares
PAPER = Config.paper()


class OffTheMask(AssertionError):
    """A curve is said to be seen where there is no mask."""


def own(call: Callable[[], T]) -> T | DloftbsError:
    """Return what a call returns, or its error if it is one of the package's; any other error is a finding."""
    try:
        return call()
    except DloftbsError as error:
        text = str(error)
        assert text.strip(), "an error without a message"
        assert len(text) < 5000, f"a message of {len(text)} characters"
        return error


def in_time(call: Callable[[], T]) -> T:
    """Return what a call returns, if its CPU time is bounded."""
    since = time.process_time()
    result = call()
    spent = time.process_time() - since
    assert spent < FRAME_CPU_S, f"took {spent:.1f} s of CPU time"
    return result


def strict_json(value: Any) -> str:
    """Return a public value's dictionary as strict JSON, by the encoder of the standard library."""
    return json.dumps(value.to_dict(), allow_nan=False)


def timeless(result: FrameResult) -> dict[str, Any]:
    """Return what a result says, but for the milliseconds."""
    return {key: value for key, value in result.to_dict().items() if key != "stage_ms"}


def check_share(name: str, value: float) -> None:
    """Check that a value is a number in 0..1."""
    assert isinstance(value, float), f"{name} is {value!r}"
    assert 0.0 <= value <= 1.0, f"{name} is {value!r}"


def check_intervals(name: str, intervals: Sequence[tuple[float, float]]) -> None:
    """Check that intervals of ``u`` lie in 0..1, ascend and are disjoint."""
    ends = [end for interval in intervals for end in interval]
    assert all(type(end) is float for end in ends), f"{name} holds other types than float: {intervals}"
    assert all(0.0 <= end <= 1.0 for end in ends), f"{name} leaves 0..1: {intervals}"
    assert all(low <= high for low, high in intervals), f"{name} holds intervals upside down: {intervals}"
    assert all(a[1] <= b[0] for a, b in itertools.pairwise(intervals)), f"{name} overlap: {intervals}"


@functools.lru_cache(maxsize=256)  # the same curve comes back from each repeat, and from track to track
def check_curve(curve: BSplineCurve) -> None:
    """Check that a curve is finite everywhere and comes back from JSON as it was."""
    assert np.isfinite(curve.control_points).all(), "control points that are not finite"
    assert np.isfinite(curve.sample(64)).all(), "points that are not finite"
    assert math.isfinite(curve.length), f"a length of {curve.length}"
    assert curve.length > 0.0, "a curve without length"
    assert BSplineCurve.from_dict(json.loads(strict_json(curve))) == curve
    t = np.linspace(0.0, 1.0, max(_FINE, 200 * len(curve.control_points)))  # a long curve needs more
    along = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(curve.spline(t), axis=0), axis=1))))
    assert abs(curve.length / along[-1] - 1.0) < _SHARE, f"a length of {curve.length}, a polyline of {along[-1]}"
    assert np.abs(curve.u_at(t) - along / along[-1]).max() < _SHARE, "u is not the share of the length"


def check_detection(detection: Detection) -> None:
    """Check what an object of one frame says of itself."""
    check_curve(detection.curve)
    assert math.isfinite(detection.width_px), f"a width of {detection.width_px}"
    assert detection.width_px > 0.0, f"a width of {detection.width_px}"
    check_share("confidence", detection.confidence)
    check_intervals("inferred", detection.inferred)
    check_intervals("inferred_3d", detection.inferred_3d)
    assert (detection.curve_3d is None) == (detection.no_3d_reason is not None)
    if detection.curve_3d is not None:
        check_curve(detection.curve_3d)
    for joint in detection.joints:
        assert 0.0 <= joint.u[0] <= joint.u[1] <= 1.0, f"a joint at {joint.u}"
        check_share("a joint's confidence", joint.confidence)
        assert math.isfinite(joint.cost), f"a cost of {joint.cost}"
    strict_json(detection)


def check_result(result: FrameResult) -> None:
    """Check all that a frame's result says."""
    assert (result.reason is None) == bool(result.detections), f"reason {result.reason!r}, {len(result.detections)}"
    for detection in result.detections:
        check_detection(detection)
        alone = not result.tracks  # a prior may outweigh two joints of a frame
        least = 0.0 if alone else -2.0 * PRIOR_BONUS
        assert all(joint.margin >= least for joint in detection.joints), f"margins of {detection.joints}"
    for crossing in result.crossings:
        assert np.isfinite(crossing.position).all(), f"a crossing at {crossing.position}"
        check_share("a crossing's confidence", crossing.confidence)
        for index, u in crossing.passes:
            assert 0 <= index < len(result.detections)
            check_share("u of a crossing", u)
    ids = [track.id for track in result.tracks]
    assert ids == sorted(set(ids)), f"ids {ids}"
    for track in result.tracks:
        check_curve(track.curve)
        if track.curve_3d is not None:
            check_curve(track.curve_3d)
        check_intervals("a track's inferred", track.inferred)
        check_share("a track's confidence", float(track.confidence))
        assert track.width_px is None or track.width_px > 0.0
        strict_json(track)
    plain = json.loads(strict_json(result))
    assert json.loads(strict_json(FrameResult.from_dict(plain))) == plain, "a result is lost on its way through a file"


def check_seen(detections: Iterable[Detection], mask: np.ndarray) -> None:
    """Check that what is said to be seen lies on the mask, or beside it by half a width.

    Raises
    ------
    OffTheMask
        If a point lies farther away than half the object's width, and than 1.5 px.
    """
    pixels = np.argwhere(mask)[:, ::-1]
    tree = cKDTree(pixels)
    for number, detection in enumerate(detections):
        u = np.linspace(0.0, 1.0, max(64, int(2 * detection.curve.length)))
        for low, high in detection.inferred:
            u = u[(u < low) | (u > high)]
        points = detection.curve(u)
        _, nearest = tree.query(points, k=min(4, len(pixels)))
        beside = np.abs(pixels[nearest.reshape(len(points), -1)] - points[:, None])
        away = np.linalg.norm(np.maximum(beside - 0.5, 0.0), axis=2).min(axis=1, initial=math.inf)
        if len(u) and away.max() > max(1.5, detection.width_px / 2.0):
            at = tuple(round(float(v), 1) for v in points[away.argmax()])
            raise OffTheMask(
                f"detection {number}, {detection.width_px:.1f} px wide, is said to be seen {away.max():.1f} px "
                f"off the mask, at {at} and u = {u[away.argmax()]:.3f}"
            )


def check_repeats(mask: np.ndarray, config: Config) -> FrameResult:
    """Check that a mask gives the same bits twice, in a pipeline of its own as in one that saw it before."""
    frame = Frame(mask=mask)
    before = mask.copy()
    pipeline = Pipeline(config)
    first = in_time(lambda: pipeline.process(frame))
    check_result(first)
    assert [d.to_dict() for d in pipeline.detect(frame).detections] == [d.to_dict() for d in first.detections]
    again = Pipeline(config).process(Frame(mask=before))
    assert timeless(again) == timeless(first), "the same mask gives other bits"
    np.testing.assert_array_equal(mask, before)
    return first


def symmetries(cleaned: np.ndarray) -> list[tuple[int, int, int]]:
    """Return under which flips and transpositions a cleaned mask, cut to its box, looks the same."""
    rows, columns = np.flatnonzero(cleaned.any(axis=1)), np.flatnonzero(cleaned.any(axis=0))
    if len(rows) == 0:
        return [(0, 0, 0)]
    box = cleaned[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return [how for how in EIGHT_VERSIONS if np.array_equal(turn(box, *how), box)]


def check_turns(mask: np.ndarray, first: FrameResult, config: Config) -> None:
    """Check that curves move along with a mask that is turned or flipped.

    A mask with a symmetry of its own may be read in any of the poses in which it looks the same; which one it is
    depends on the order in which it came, so that all are right.
    """
    cleaned = Pipeline(config).trace(Frame(mask=mask)).cleaned
    same = symmetries(cleaned)
    if len(same) > 1:  # the image's border, at which no gap is bridged, need not have the mask's symmetries
        mask = np.pad(mask, min(mask.shape) // 2 + 3)
        first = Pipeline(config).detect(Frame(mask=mask))
        cleaned = Pipeline(config).trace(Frame(mask=mask)).cleaned
        same = symmetries(cleaned)
    middle = _middle(cleaned)
    base = [d.curve.sample(40) for d in first.detections]
    allowed = [[_about(points, middle, how) for points in base] for how in same]
    for how in EIGHT_VERSIONS[1:]:
        found = [d.curve.sample(40) for d in dloftbs.detect(np.ascontiguousarray(turn(mask, *how)), config=config)]
        expected = [[turn_points(points, mask.shape, *how) for points in curves] for curves in allowed]
        assert any(_agree(found, curves) for curves in expected), f"turned by {how}, {_difference(found, expected[0])}"


def _middle(cleaned: np.ndarray) -> np.ndarray:
    """Return the middle of the box of a cleaned mask, ``(x, y)``."""
    rows, columns = np.nonzero(cleaned)
    if len(rows) == 0:
        return np.zeros(2)
    return np.array((columns.min() + columns.max(), rows.min() + rows.max())) / 2.0


def _about(points: np.ndarray, middle: np.ndarray, how: tuple[int, int, int]) -> np.ndarray:
    """Flip and transpose points about a middle."""
    moved = (points - middle) * (-1 if how[0] else 1, -1 if how[1] else 1)
    return (moved[:, ::-1] if how[2] else moved) + middle


def _agree(found: list[np.ndarray], expected: list[np.ndarray], tolerance: float = EXACT_PX) -> bool:
    return len(found) == len(expected) and all(
        np.allclose(a, b, rtol=0.0, atol=tolerance) for a, b in zip(found, expected, strict=True)
    )


def _difference(found: list[np.ndarray], expected: list[np.ndarray]) -> str:
    if len(found) != len(expected):
        return f"{len(found)} curves in place of {len(expected)}"
    farthest = max(float(np.abs(a - b).max()) for a, b in zip(found, expected, strict=True))
    return f"curves differ by {farthest:.3g} px"


def check_shift(mask: np.ndarray, config: Config) -> None:
    """Check that curves move along with a mask that is shifted, with so much room that no end lies at the border."""
    room = min(mask.shape) // 2
    here, there = np.pad(mask, room + 24), np.pad(mask, ((room + 3, room + 45), (room + 41, room + 7)))
    found = [d.curve.sample(40) for d in dloftbs.detect(there, config=config)]
    expected = [d.curve.sample(40) + np.array((17, -21)) for d in dloftbs.detect(here, config=config)]
    assert _agree(found, expected), f"shifted, {_difference(found, expected)}"


def check_mask(mask: np.ndarray, _: Path) -> None:
    """Check results, repeats, turns and shifts of one mask, by both methods."""
    for config in (Config(), PAPER):
        first = check_repeats(mask, config)
        check_turns(mask, first, config)
        check_shift(mask, config)


def check_curves_on_mask(mask: np.ndarray, _: Path) -> None:
    """Check where the curves of one mask lie."""
    check_seen(dloftbs.detect(mask), mask)
