"""Values of every type for cameras, frames, configurations and curves; hypothesis draws them, and makes them small."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

import dloftbs
from dloftbs import (
    BSplineCurve,
    Config,
    ConfigError,
    DloftbsError,
    Frame,
    HsvRange,
    InputError,
    PinholeCamera,
    Pipeline,
    SourceError,
)
from fuzz.checks import check_result, own, strict_json

EXAMPLES = 60
"""Examples of one case."""

NUMBERS = st.one_of(
    st.floats(),
    st.integers(-(10**3), 10**3),
    st.sampled_from([0, -1, 1e-300, 5e-324, 1e300, 10**400, -(10**400), 2**63, 2**64, 1e9, 500.0, 640]),
    st.floats(width=32).map(np.float32),
    st.integers(-100, 100).map(np.int16),
)
JUNK = st.one_of(
    NUMBERS,
    st.none(),
    st.booleans(),
    st.text(max_size=8),
    st.binary(max_size=8),
    st.sampled_from([1j, Decimal("NaN"), Fraction(1, 3), object(), np.array(3.0), np.array([1.0]), "NaN", "9" * 400]),
    st.sampled_from([np.str_("1"), np.bool_(True), np.datetime64("NaT"), np.timedelta64(1, "s"), float, ()]),
    st.lists(NUMBERS, max_size=5),
    st.dictionaries(st.text(max_size=3), NUMBERS, max_size=2),
)
TREES = st.recursive(
    JUNK,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4), st.dictionaries(st.one_of(st.text(max_size=4), NUMBERS), inner, max_size=4)
    ),
    max_leaves=12,
)


def mostly(good: st.SearchStrategy[Any], bad: st.SearchStrategy[Any] = JUNK) -> st.SearchStrategy[Any]:
    """Draw what is right three times out of four."""
    return st.one_of(good, good, good, bad)


FOCAL = mostly(st.floats(1.0, 5000.0), NUMBERS)
CENTRE = mostly(st.floats(-100.0, 1000.0), NUMBERS)
LENSES = mostly(st.sampled_from([0, 4, 5, 8, 12, 14]).flatmap(lambda n: st.lists(mostly(st.floats(-1, 1)), min_size=n)))
SIZES = st.one_of(st.none(), st.tuples(st.integers(1, 2000), st.integers(1, 2000)), JUNK)
CAMERAS = st.fixed_dictionaries(
    {"fx": FOCAL, "fy": FOCAL, "cx": CENTRE, "cy": CENTRE},
    optional={"distortion": LENSES, "model": mostly(st.sampled_from(["polynomial", "fisheye"])), "size": SIZES},
)


_SETTINGS = settings(
    max_examples=EXAMPLES,
    database=None,
    deadline=None,
    derandomize=False,
    phases=(Phase.generate, Phase.shrink),
    suppress_health_check=list(HealthCheck),
)


def examine(strategy: st.SearchStrategy[Any], check: Callable[[Any], None], number: int) -> None:
    """Check examples of a strategy; the error of the smallest that fails is raised."""

    @seed(number)
    @_SETTINGS
    @given(strategy)
    def examined(value: Any) -> None:
        check(value)

    examined()


def of(strategy: st.SearchStrategy[Any], check: Callable[[Any], None]) -> Callable[[Any, Path], None]:
    """Return the check of a family whose case is a seed, or one value where it is a fixed case."""

    def checked(case: Any, _: Path) -> None:
        if isinstance(case, Fixed):
            check(case.value)
        else:
            examine(strategy, check, int(case))

    return checked


class Fixed:
    """A value that was a finding once."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def __repr__(self) -> str:
        return f"Fixed({self.value!r})"


def fixed(values: Mapping[str, Any]) -> dict[str, Fixed]:
    """Return fixed cases of a family of hypothesis."""
    return {name: Fixed(value) for name, value in values.items()}


def check_camera(values: dict[str, Any]) -> None:
    """Check that a camera is refused where it is made, or works with points, depth and JSON."""
    camera = own(lambda: PinholeCamera(**values))
    again = own(lambda: PinholeCamera.from_dict(values))
    if isinstance(camera, DloftbsError):
        assert isinstance(camera, InputError)
        return
    assert camera == again
    assert PinholeCamera.from_dict(json.loads(strict_json(camera))) == camera
    mask = np.zeros((40, 90), np.uint8)
    mask[18:23, 5:85] = 1
    frame = own(lambda: Frame(mask=mask, depth=np.full(mask.shape, 0.7), camera=camera))
    if isinstance(frame, Frame):
        check_result(Pipeline().process(frame))
        check_result(Pipeline(Config.paper()).process(frame))
    points = camera.deproject(np.array([[0.0, 0.0], [30.0, 20.0], [500.0, 500.0]]), np.array([0.5, 1.0, 20.0]))
    seen = points[np.isfinite(points).all(axis=1)]
    own(lambda: camera.project(seen))
    own(lambda: camera.scaled((480, 640)))


CAMERAS_FOUND = {
    "focal length of 1e-300": {"fx": 1e-300, "fy": 1e-300, "cx": 0.0, "cy": 0.0},
    "a focal length of 0.03": {"fx": 1.0, "fy": 0.03125, "cx": 0.0, "cy": 0.0},
    "distortion of 1e300": {"fx": 500.0, "fy": 500.0, "cx": 45.0, "cy": 20.0, "distortion": (1e300,) * 4},
    "integers of 400 digits": {"fx": 10**400, "fy": 500.0, "cx": 0.0, "cy": 0.0},
    "a focal length of float32": {"fx": np.float32(500), "fy": 500, "cx": np.int16(3), "cy": 0},
}

STAMPS = st.one_of(st.none(), st.floats(0, 100), NUMBERS, JUNK)
FRAMES = st.fixed_dictionaries(
    {}, optional={"stamp": STAMPS, "index": mostly(st.integers(0, 9)), "name": mostly(st.text()), "camera": JUNK}
)


def check_frame(values: dict[str, Any]) -> None:
    """Check that what a frame says of itself is refused where it enters, or comes out as plain values."""
    mask = np.zeros((40, 90), np.uint8)
    mask[18:23, 5:85] = 1
    frame = own(lambda: Frame(mask=mask, **values))
    if isinstance(frame, DloftbsError):
        assert isinstance(frame, (InputError, SourceError))  # text is the path of a camera
        return
    pipeline = Pipeline()
    check_result(pipeline.process(Frame(mask=mask, stamp=0.0)))
    result = own(lambda: pipeline.process(frame))
    if isinstance(result, dloftbs.FrameResult):
        check_result(result)
        assert result.stamp is None or type(result.stamp) is float
    own(lambda: check_result(pipeline.process(Frame(mask=np.zeros_like(mask), stamp=1.0))))


FRAMES_FOUND = {
    "a stamp of NaN": {"stamp": math.nan},
    "an infinite stamp": {"stamp": math.inf},
    "a stamp of text": {"stamp": "1.0"},
    "a stamp of 400 digits": {"stamp": 10**400},
    "a stamp of float32": {"stamp": np.float32(0.1)},
    "a camera of text": {"camera": "x"},
}

_KEYS = {section: sorted(values) for section, values in Config().to_dict().items()}
_SOME_KEYS = [f"{section}.{key}" for section, keys in _KEYS.items() for key in keys]
GOOD_VALUES: dict[str, st.SearchStrategy[Any]] = {
    "cleaning.open_px": st.sampled_from([1, 3, 5, 99]),
    "cleaning.close_px": st.sampled_from([1, 3, 9, 99]),
    "cleaning.thin_px": st.sampled_from([0, 1, 20, 10**6]),
    "segments.max_segments": st.sampled_from([1, 50, 10**6]),
    "linking.objects": st.sampled_from([None, 1, 2, 100]),
    "linking.max_gap_widths": st.sampled_from([0.0, 1e-9, 5.0, 1e9, math.inf]),
    "fitting.knots": st.sampled_from([None, 2, 3, 25, 1000]),
    "fitting.tolerance_px": st.sampled_from([1e-12, 0.01, 5.0, 1e9]),
    "tracking.gate": st.floats(1e-9, 1e9),
    "tracking.keep_lost_s": st.sampled_from([0.0, 1e-9, 1e9]),
    "tracking.smoothing_s": st.sampled_from([0.0, 1e-9, 0.1, 1e9]),
    "tracking.frame_s": st.sampled_from([1e-9, 1 / 30, 1e9]),
    "linking.method": st.sampled_from(["bending", "greedy"]),
    "lifting.method": st.sampled_from(["axis", "pixels"]),
}
CHANGES = st.dictionaries(st.sampled_from(_SOME_KEYS), st.one_of(JUNK, NUMBERS), max_size=3) | st.fixed_dictionaries(
    {}, optional=GOOD_VALUES
)


def check_changes(changes: dict[str, Any]) -> None:
    """Check that a configuration is refused, or works and comes back from its YAML."""
    config = own(lambda: Config().replace(changes))
    if isinstance(config, DloftbsError):
        assert isinstance(config, ConfigError)
        return
    assert Config.from_dict(config.to_dict()) == config
    rng = np.random.default_rng(3)
    mask = np.zeros((70, 110), np.uint8)
    for _ in range(3):
        start, stop = rng.integers(5, 65, 2), rng.integers(5, 65, 2)
        points = np.linspace(start, stop, 200).astype(int)
        for dy in range(4):
            mask[points[:, 0] + dy, points[:, 1] + 20] = 1
    depth = np.full(mask.shape, 0.6)
    camera = PinholeCamera(100.0, 100.0, 50.0, 30.0)
    pipeline = Pipeline(config)
    for i in range(3):
        frame = Frame(mask=np.roll(mask, 2 * i, 1), depth=depth, camera=camera, stamp=i / 30)
        own(lambda frame=frame: check_result(pipeline.process(frame)))


CHANGES_FOUND = {
    "thin_px of 1e30": {"cleaning.thin_px": 1e30},
    "thin_px of 10**30": {"cleaning.thin_px": 10**30},
    "max_segments of 10**30": {"segments.max_segments": 10**30},
    "objects of 10**30": {"linking.objects": 10**30},
}

NESTED = st.one_of(
    TREES,
    st.dictionaries(st.sampled_from(sorted(_KEYS)), st.dictionaries(st.sampled_from(_SOME_KEYS), TREES), max_size=3),
)


def check_from_dict(tree: Any) -> None:
    """Check that everything that is built from a dictionary refuses what is none of its own."""
    for build in (Config.from_dict, PinholeCamera.from_dict, BSplineCurve.from_dict):
        own(lambda build=build: build(tree))


FROM_DICT_FOUND = {"None": None, "a list": [], "text": "camera", "a number": 3, "bytes": b"{}"}


def check_hsv(text: str) -> None:
    """Check a colour range."""
    box = own(lambda: HsvRange.parse(text))
    assert isinstance(box, (HsvRange, ConfigError))


HSV = st.one_of(st.text(max_size=30), st.from_regex(r"[0-9:,\-+ _²٣]{0,20}", fullmatch=True))

CURVES = st.fixed_dictionaries(
    {
        "knots": mostly(st.just([0, 0, 0, 0, 1, 1, 1, 1]) | st.lists(NUMBERS, min_size=8, max_size=8)),
        "control_points": mostly(
            st.lists(st.lists(mostly(st.floats(-1e3, 1e3), NUMBERS), min_size=2, max_size=2), min_size=4, max_size=4)
        ),
        "degree": mostly(st.just(3)),
        "closed": mostly(st.booleans()),
    }
)


def check_curve_values(values: dict[str, Any]) -> None:
    """Check that a curve is refused where it is made, or can be evaluated."""
    curve = own(lambda: BSplineCurve.from_dict(values))
    if isinstance(curve, DloftbsError):
        assert isinstance(curve, InputError)
        return
    assert BSplineCurve.from_dict(json.loads(strict_json(curve))) == curve
    assert np.isfinite(curve.sample(5)).all()
    own(lambda: curve.sample(1))


CURVES_FOUND = {
    "control points of 1e150": {
        "knots": [0, 0, 0, 0, 1, 1, 1, 1],
        "control_points": [[0.0, 0.0], [1e150, 0.0], [1e150, 1e150], [0.0, 1e150]],
        "degree": 3,
        "closed": False,
    }
}
