"""A unit of depth that makes a cable as thick as a barrel, or as thin as a hair, is reported with the one that fits."""

from __future__ import annotations

import logging

import numpy as np
import pytest
from drawings import draw_cable, wave

import dloftbs
from dloftbs import Frame, Pipeline
from dloftbs.camera import PinholeCamera
from dloftbs.pipeline.thickness import THICKEST_M, thickness_m

SIZE = (240, 400)
CAMERA = PinholeCamera(400.0, 400.0, 199.5, 119.5)
MASK = draw_cable(wave(SIZE), 12, SIZE) != 0


def frame(metres: float, unit_m: float, **changes: object) -> Frame:
    """Return a frame whose depth has a unit, and is believed to be in millimetres."""
    depth = np.full(SIZE, round(metres / unit_m), np.uint16)
    return Frame(**{"mask": MASK, "depth": depth, "camera": CAMERA, **changes})  # type: ignore[arg-type]


def test_the_thickness_is_the_width_at_its_distance() -> None:
    (cable,) = dloftbs.detect(frame(0.5, 0.001))
    thick_m, distance_m = thickness_m(cable) or (0.0, 0.0)
    assert thick_m == pytest.approx(cable.width_px * 0.5 / 400.0, rel=0.05)
    assert distance_m == pytest.approx(0.5, rel=0.05)
    assert thickness_m(dloftbs.detect(MASK)[0]) is None


@pytest.mark.parametrize(
    ("metres", "unit_m", "changes", "said"),
    [
        (0.5, 0.001, {}, None),
        (0.5, 0.0001, {}, "is a count of the depth 0.1 mm? Set depth_unit_m=0.0001 (--depth-unit 0.0001)"),
        (0.5, 0.0001, {"depth_unit_m": 0.0001}, None),
        (0.5, 0.001, {"depth_unit_m": 0.00001}, "is a count of the depth 0.1 mm? Set depth_unit_m=0.0001"),
        (9.0, 0.001, {"depth": np.full(SIZE, 9.0, np.float32)}, "is the depth in metres? Multiply it by 0.1"),
    ],
)
def test_the_unit_that_fits_is_named_once(
    metres: float, unit_m: float, changes: dict[str, object], said: str | None, caplog: pytest.LogCaptureFixture
) -> None:
    pipeline, given = Pipeline(), frame(metres, unit_m, **changes)
    with caplog.at_level(logging.WARNING, "dloftbs"):
        for _ in range(3):
            result = pipeline.process(given)
            assert result.detections[0].curve_3d is not None
            assert result.diagnosis == tuple(caplog.messages)
    assert len(caplog.messages) == (said is not None)
    if said is not None:
        assert said in caplog.messages[0]
        assert caplog.messages[0].startswith("a cable of 1")
        assert "or check the camera's focal length" in caplog.messages[0]


def test_a_unit_that_puts_a_cable_beyond_what_is_read_is_named_in_the_reason() -> None:
    (cable,) = dloftbs.detect(frame(2.3, 0.0001))
    assert cable.curve_3d is None
    reason = cable.no_3d_reason or ""
    assert "median of the depth is 23 m" in reason
    assert "--depth-unit" in reason
    assert dloftbs.detect(frame(2.3, 0.0001, depth_unit_m=0.0001))[0].curve_3d is not None


def test_what_is_named_is_plausible(caplog: pytest.LogCaptureFixture) -> None:
    for metres in np.geomspace(0.1, 1.5, 8):
        with caplog.at_level(logging.WARNING, "dloftbs"):
            caplog.clear()
            dloftbs.detect(frame(metres, 0.0001, name="a.png"))
        thick_m = 12 * metres / 400.0
        if abs(10 * thick_m / THICKEST_M - 1) > 0.15:
            assert bool(caplog.messages) is bool(10 * thick_m > THICKEST_M)
        for message in caplog.messages:
            assert message.startswith("a.png: a cable of 1")
            assert "--depth-unit 0.0001)" in message
