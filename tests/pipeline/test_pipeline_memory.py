"""A pipeline that runs for long: what it holds does not grow, whatever changes in mid-stream."""

from __future__ import annotations

import gc
import logging
import sys

import numpy as np
import pytest

from dloftbs.camera import PinholeCamera
from dloftbs.data.frame import Frame
from dloftbs.pipeline import Pipeline

SIZES = ((64, 96), (96, 64), (80, 80), (48, 120))
WARM_UP, FRAMES = 500, 750
MAX_BLOCKS = 750  # one a frame; with other tracks alive than before, it is some hundreds, either way


def varied_frame(rng: np.random.Generator, number: int) -> Frame:
    """Return one of cables, noise or nothing, with depth and a camera or without, in sizes that change."""
    rows, columns = size = SIZES[number // 7 % len(SIZES)]
    mask = np.zeros(size, np.uint8)
    for _ in range(int(rng.integers(0, 4))):
        y, x = (int(rng.integers(6, side - 6)) for side in size)
        if rng.random() < 0.5:
            mask[y - 2 : y + 2, 4 : columns - 4] = 1
        else:
            mask[4 : rows - 4, x - 2 : x + 2] = 1
    if number % 11 == 0:
        mask |= rng.random(size) < 0.3
    depth = rng.uniform(0.5, 1.0, size).astype(np.float32) if number % 3 else None
    lens = (0.1, 0.01, 0.0, 0.0) if number % 5 == 0 else ()
    camera = PinholeCamera(100.0 + number % 13, 100.0, columns / 2, rows / 2, lens) if number % 2 else None
    image = rng.integers(0, 255, (*size, 3), np.uint8) if number % 4 == 0 else None
    return Frame(image=image, mask=mask, depth=depth, camera=camera, index=number, stamp=number / 30)


def blocks_after(pipeline: Pipeline, rng: np.random.Generator, numbers: range) -> int:
    """Return how many blocks of memory Python holds after some frames; every array is one of them, or more."""
    for number in numbers:
        pipeline.process(varied_frame(rng, number))
    gc.collect()
    return sys.getallocatedblocks()


@pytest.mark.slow
def test_many_varied_frames_leave_nothing_behind(caplog):
    caplog.set_level(logging.CRITICAL, "dloftbs")  # pytest keeps all messages, and each size makes one
    rng = np.random.default_rng(5)
    pipeline = Pipeline()
    before = blocks_after(pipeline, rng, range(WARM_UP))
    after = blocks_after(pipeline, rng, range(WARM_UP, WARM_UP + FRAMES))
    assert after - before < MAX_BLOCKS


def test_sizes_cameras_and_depth_may_change_in_mid_stream():
    rng = np.random.default_rng(7)
    pipeline, shown = Pipeline(), 0
    for number in range(60):
        frame = varied_frame(rng, number)
        result = pipeline.process(frame)
        assert result.size == frame.size
        shown += len(result.tracks)
        assert all(np.isfinite(track.curve.control_points).all() for track in result.tracks)
        in_space = frame.depth is not None and frame.camera is not None
        assert in_space or all(found.curve_3d is None for found in result.detections)
    assert shown > 60
