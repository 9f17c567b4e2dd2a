"""Streams that jump, lose rows, come and go, and change size, camera and depth as they go."""

from __future__ import annotations

import gc
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from dloftbs import BSplineCurve, Config, DloftbsError, Frame, FrameResult, PinholeCamera, Pipeline, Tracker
from fuzz import masks
from fuzz.checks import check_result, in_time, own, timeless

Rng = np.random.Generator


@dataclass(frozen=True)
class Stream:
    """The arguments of frames, and the changes of the configuration."""

    frames: tuple[dict[str, Any], ...]
    changes: dict[str, Any]


def _changes(rng: Rng) -> dict[str, Any]:
    changes: dict[str, Any] = {}
    if rng.random() < 0.2:
        changes["tracking.smoothing_s"] = float(rng.choice([0.01, 0.1, 3.0]))
    if rng.random() < 0.3:
        changes["tracking.gate"] = float(rng.choice([1e-6, 0.3, 10.0]))
    if rng.random() < 0.2:
        changes["linking.objects"] = int(rng.integers(1, 5))
    return changes


def moving(rng: Rng) -> Stream:
    """Something that moves, of which stretches come and go."""
    start = masks.tangle(rng, (120, 160)) if rng.random() < 0.5 else _cropped(masks.any_mask(rng))
    height, width = start.shape
    velocity, spin, frames = rng.normal(0, 3, 2), rng.normal(0, 3), []
    for i in range(int(rng.integers(6, 18))):
        turn = cv2.getRotationMatrix2D((width / 2, height / 2), spin * i, 1.0)
        turn[:, 2] += velocity * i
        mask = cv2.warpAffine(start, turn, (width, height), flags=cv2.INTER_NEAREST)
        event = rng.random()
        if event < 0.1:
            mask[:] = 0
        elif event < 0.3:
            mask[rng.random(height) < 0.4] = 0
        elif event < 0.4:
            mask[:, int(rng.integers(width)) :] = 0
        elif event < 0.45:
            mask = masks.tangle(rng, start.shape)
        frames.append({"mask": mask, "stamp": i / 30})
    return Stream(tuple(frames), _changes(rng))


def _cropped(mask: np.ndarray) -> np.ndarray:
    return np.pad(mask, 4)[:140, :180]


def changing(rng: Rng) -> Stream:
    """Everything changes: the size, the camera, depth, what brings the frame, the stamps."""
    frames: list[dict[str, Any]] = []
    stamp = 0.0
    for _ in range(int(rng.integers(4, 12))):
        mask = _cropped(masks.any_mask(rng))
        frame: dict[str, Any] = {"mask": mask, "name": str(rng.choice(["", "a", "../../x", "/x", "ä\0", "\udcff"]))}
        stamp += float(rng.choice([0.0, 1 / 30, 1e-9, 1e9, -1.0, 1e-300]))
        if rng.random() < 0.7:
            frame["stamp"] = stamp
        if rng.random() < 0.1:
            frame["stamp"] = rng.choice([np.nan, np.inf, -np.inf, 1e308, -1e308])
        if rng.random() < 0.5:
            depth = rng.uniform(0.2, 3.0, mask.shape) if rng.random() < 0.5 else np.full(mask.shape, 0.8)
            frame["depth"] = depth if rng.random() < 0.7 else (1000 * depth).astype(np.uint16)
        if rng.random() < 0.6:
            focal = float(rng.choice([10.0, 300.0, 1e5]))
            frame["camera"] = PinholeCamera(focal, focal, 50.0, 50.0)
        if rng.random() < 0.2:
            frame["image"] = rng.integers(0, 255, (*mask.shape, 3)).astype(np.uint8)
        frames.append(frame)
    return Stream(tuple(frames), _changes(rng))


def crowded(rng: Rng) -> Stream:
    """Hundreds of objects, which shake."""
    size = (360, 640)
    mask = np.zeros(size, np.uint8)
    kind = int(rng.integers(3))
    if kind == 0:
        pitch, sweep = int(rng.integers(24, 40)), float(rng.choice([360.0, 300.0]))
        for y in range(20, size[0] - 20, pitch):
            for x in range(20, size[1] - 20, pitch):
                turn, thick = float(rng.uniform(0, 360)), int(rng.integers(2, 4))
                cv2.ellipse(mask, (x, y), (9, 7), turn, 0.0, sweep, 1, thick)
    elif kind == 1:
        order = int(rng.integers(4, 7))
        masks.stroke(mask, masks.fitted(masks.hilbert(order), size, 8.0), 2 if order == 6 else 4)
    else:
        for y in range(20, size[0], 26):
            text = "".join(chr(int(code)) for code in rng.integers(65, 91, 40))
            cv2.putText(mask, text, (4, y), cv2.FONT_HERSHEY_SIMPLEX, 0.8, 1, 2)
    shifts = rng.integers(-2, 3, (3, 2))
    return Stream(tuple({"mask": np.roll(mask, tuple(shift), (0, 1))} for shift in shifts), {})


def come_and_go(rng: Rng) -> Stream:
    """A real mask twice, then with some of its rows missing for some frames."""
    found = masks.real_masks()
    return _with_missing_rows(found[int(rng.integers(len(found)))], int(rng.integers(2, 9)), rng)


def _with_missing_rows(mask: np.ndarray, period: int, rng: Rng) -> Stream:
    frames = [mask, mask]
    for _ in range(int(rng.integers(1, 4))):
        cut = mask.copy()
        for row in range(int(rng.integers(1, period))):
            cut[row::period] = 0
        frames += [cut, cut]
        frames += [mask] * int(rng.integers(0, 3))
    return Stream(tuple({"mask": frame} for frame in frames), {})


def _mask_019() -> Stream:
    """The authors' mask 019, or what stands in for it, twice, then with three of eight rows missing."""
    path = masks.SHARED_DATA / "masks" / "019.png"
    mask = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) if path.is_file() else masks.real_masks()[0]
    cut = mask.copy()
    for row in range(3):
        cut[row::8] = 0
    return Stream(tuple({"mask": frame} for frame in (mask, mask, cut, cut)), {})


COME_AND_GO_FOUND = {"mask 019": _mask_019()}


def check_stream(case: Stream, _: Path) -> None:
    """Check every frame's result, and that the same stream gives the same bits again."""
    config = own(lambda: Config().replace(case.changes))
    assert isinstance(config, Config)
    results = _results(case, config)
    for result in results:
        if isinstance(result, FrameResult):
            check_result(result)
    first = [_bits(result) for result in results]
    again = [_bits(result) for result in _results(case, config)]  # what is the same need not be checked twice
    assert first == again, "the same stream gives other bits"
    ids = [track["id"] for result in first if result is not None for track in result["tracks"]]
    assert all(number >= 1 for number in ids)


def _results(case: Stream, config: Config) -> list[FrameResult | DloftbsError]:
    """Return what each frame gave; an error of one is not the end of the others."""
    pipeline = Pipeline(config)
    kept = [
        {key: value.copy() for key, value in frame.items() if isinstance(value, np.ndarray)} for frame in case.frames
    ]
    results = []
    for index, frame in enumerate(case.frames):

        def process(index: int = index, frame: dict[str, Any] = frame) -> FrameResult:
            return in_time(lambda: pipeline.process(Frame(index=index, **frame)))

        results.append(own(process))
    for frame, copies in zip(case.frames, kept, strict=True):
        for key, copy in copies.items():
            np.testing.assert_array_equal(frame[key], copy)
    return results


def _bits(result: FrameResult | DloftbsError) -> dict[str, Any] | None:
    return None if isinstance(result, DloftbsError) else timeless(result)


def check_long_stream(seed: int, _: Path) -> None:
    """Check that a pipeline holds no more after many varied frames than after some."""
    rng = np.random.default_rng(seed)
    pipeline, counts = Pipeline(), []
    frames = [_cropped(masks.any_mask(rng))[:64, :90] for _ in range(60)]
    for number in range(900):
        pipeline.process(Frame(mask=frames[int(rng.integers(len(frames)))], stamp=number / 30))
        if number % 300 == 299:
            pipeline.process(Frame(mask=np.zeros((64, 90), np.uint8), stamp=number / 30))
            gc.collect()
            counts.append(len(gc.get_objects()))
    assert counts[-1] - counts[0] < 3000, f"objects that are held: {counts}"


@dataclass(frozen=True)
class Bare:
    """Bare curves for the tracker, a list a frame, with stamps."""

    curves: tuple[tuple[BSplineCurve, ...], ...]
    stamps: tuple[float | None, ...]


def bare_curves(rng: Rng) -> Bare:
    """Curves of any shape and scale, from any detector."""
    scale, ndim = float(rng.choice([1e-12, 1e-3, 1.0, 100.0, 1e6, 1e9])), 2
    frames, stamps = [], []
    for i in range(int(rng.integers(2, 10))):
        frames.append(tuple(_random_curve(rng, scale, ndim) for _ in range(int(rng.integers(0, 4)))))
        stamps.append(None if rng.random() < 0.2 else i * float(rng.choice([1e-6, 1 / 30, 1e3])))
    return Bare(tuple(frames), tuple(stamps))


def _random_curve(rng: Rng, scale: float, ndim: int) -> BSplineCurve:
    n = int(rng.integers(4, 12))
    control = rng.normal(0, scale, (n, ndim))
    if rng.random() < 0.2:
        control[:] = control[0]
    if rng.random() < 0.2:
        control[:, 0] = 0.0
    inner = rng.random(n - 4)
    if rng.random() < 0.3:  # a kink
        inner[:3] = 0.5
    return BSplineCurve(np.concatenate((np.zeros(4), np.sort(inner), np.ones(4))), control)


def check_bare_curves(case: Bare, _: Path) -> None:
    """Check the tracker with bare curves."""
    tracker = Tracker()
    for curves, stamp in zip(case.curves, case.stamps, strict=True):
        tracks = own(lambda curves=curves, stamp=stamp: in_time(lambda: tracker.update(list(curves), stamp)))
        if isinstance(tracks, DloftbsError):
            continue
        for track in tracks:
            assert np.isfinite(track.curve.control_points).all()
            assert math.isfinite(track.confidence)
