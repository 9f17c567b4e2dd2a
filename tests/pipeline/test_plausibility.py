"""Input that is hardly meant: masks that are mostly set, and hints about units."""

from __future__ import annotations

import numpy as np
import pytest
from drawings import draw_cable, wave

from dloftbs.config import LiftingConfig
from dloftbs.pipeline.plausibility import doubt_mask, refuse_mask, share_set, unit_hint


def is_refused(mask: np.ndarray) -> bool:
    return refuse_mask(mask, share_set(mask), segmented=False) is not None


def strip(rows: int = 20, width: int = 14, columns: int = 200) -> np.ndarray:
    """Return a crop along a cable."""
    mask = np.zeros((rows, columns), bool)
    first = (rows - width) // 2
    mask[first : first + width] = True
    return mask


FULL = {
    "inverted": draw_cable(wave((480, 640)), 12, (480, 640)) == 0,
    "a photograph": np.random.default_rng(0).integers(0, 256, (480, 640), dtype=np.uint8),
    "noise": np.random.default_rng(0).random((480, 640)) < 0.7,
    "a half and more": np.repeat(np.arange(480) < 300, 640).reshape(480, 640),
    "a box": np.pad(np.ones((400, 560), bool), 40),
    "small": np.pad(np.ones((24, 34), bool), 3),
    "a stripe of ground": ~strip(96, 20, 640),
    "an inverted strip": ~strip(60, 12, 640),
    "all of a strip": np.ones((20, 200), bool),
}
READABLE = {
    "a cable": draw_cable(wave((480, 640)), 12, (480, 640)) != 0,
    "a thick cable": draw_cable(wave((120, 200)), 30, (120, 200)) != 0,
    "along a cable": strip(),
    "along two": np.vstack([strip(12, 8), strip(12, 8)]),
    "a half": np.repeat(np.arange(480) < 240, 640).reshape(480, 640),
    "no pixels": np.zeros((0, 7), bool),
}


@pytest.mark.parametrize("turn", [lambda mask: mask, np.transpose, np.flipud], ids=["as it is", "turned", "flipped"])
class TestShare:
    @pytest.mark.parametrize("mask", FULL.values(), ids=FULL)
    def test_a_mask_that_is_mostly_set_is_refused(self, mask: np.ndarray, turn: object) -> None:
        assert is_refused(turn(mask))  # type: ignore[operator]

    @pytest.mark.parametrize("mask", READABLE.values(), ids=READABLE)
    def test_cables_and_crops_along_them_are_not(self, mask: np.ndarray, turn: object) -> None:
        assert not is_refused(turn(mask))  # type: ignore[operator]


@pytest.mark.parametrize("size", [(50, 80), (480, 640)])
def test_the_limits_are_exact(size: tuple[int, int]) -> None:
    for percent, doubted, refused in ((50, False, False), (51, True, False), (60, True, False), (61, True, True)):
        mask = np.zeros(size, np.uint8)
        mask.ravel()[: mask.size * percent // 100] = 1
        share = share_set(mask)
        assert share == percent / 100
        assert (doubt_mask(share) is not None) is doubted
        assert is_refused(mask) is refused


@pytest.mark.parametrize(("unit_m", "hints"), [(1.0, False), (0.01, True), (0.001, True)])
@pytest.mark.parametrize("known", [1.0, 0.3])
def test_floating_point_depth_that_is_hardly_in_metres_is_hinted_at(unit_m: float, hints: bool, known: float) -> None:
    rng = np.random.default_rng(0)
    depth = rng.uniform(0.5, 0.9, (240, 320)) / unit_m
    depth[rng.random(depth.shape) > known] = rng.choice([0.0, np.nan, np.inf])
    hint = unit_hint(depth, 0.001, LiftingConfig())
    assert ("is it in metres?" in hint) is hints
    assert "0.001" not in hint  # any factor would be a guess


def test_counts_of_another_unit_are_hinted_at_with_what_sets_it() -> None:
    depth = np.full((24, 32), 26_000, np.uint16)
    hint = unit_hint(depth, 0.001, LiftingConfig())
    assert "the median of the depth is 26 m, beyond lifting.max_depth_m (20 m): is a count of the depth 1 mm?" in hint
    assert "depth_unit_m (--depth-unit)" in hint
    assert unit_hint(depth, 0.0001, LiftingConfig()) == ""
    assert unit_hint(depth, 0.001, LiftingConfig(max_depth_m=30.0)) == ""


@pytest.mark.parametrize("depth", [np.zeros((24, 32)), np.zeros((24, 32), np.uint16), np.full((24, 32), np.nan)])
def test_nothing_is_hinted_at_without_depth(depth: np.ndarray) -> None:
    assert unit_hint(depth, 0.001, LiftingConfig()) == ""
