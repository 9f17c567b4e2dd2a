"""What depth shows between two ends, and a mask of occluders, decides whether a gap is bridged."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from drawings import draw_cable

import dloftbs
from dloftbs import Frame, Pipeline
from dloftbs.errors import InputError
from dloftbs_lab.synthetic import DepthNoise

SIZE = (240, 400)
WIDTH = 12
LINE = np.array([(30.0, 130.0), (130.0, 112.0), (260.0, 118.0), (370.0, 105.0)])
GAPS = [(178, 212), (165, 225), (150, 250)]
TABLE_M, THICK_M = 0.7, 0.009
CAMERA_NOISE = DepthNoise(depth_noise=1.0, hole_share=0.1, flying=0.5)

seeds = pytest.mark.parametrize("seed", range(6))


def scene(gap: tuple[int, int], cover: str, seed: int, lift: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return a mask with a gap between two columns, and depth as a camera has it, m, of what it is called.

    A tilted table, a round cable that lies on it or `lift` m above, a cover 2 to 20 cm above that; edges are fattened
    by 2 px, and all is displaced by up to 2 px.
    """
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    whole = draw_cable(LINE, WIDTH, SIZE).astype(np.uint8)
    inside = np.zeros(SIZE, dtype=bool)
    inside[:, slice(*gap)] = True
    mask = (whole > 0) & ~inside
    table = TABLE_M + rng.uniform(-0.1, 0.1) * (x / SIZE[1] - 0.5) + rng.uniform(-0.1, 0.1) * (y / SIZE[0] - 0.5)
    off_axis = 1.0 - np.minimum(cv2.distanceTransform(whole, cv2.DIST_L2, 5) / (0.5 * WIDTH), 1.0)
    surface = table - lift - 0.5 * THICK_M * (1.0 + np.sqrt(1.0 - off_axis**2))
    depth = np.where(whole if cover == "cable" else mask, surface, table)
    if cover == "occluder":
        depth[60:180, slice(*gap)] = TABLE_M - lift - 0.06 - rng.uniform(0.02, 0.2)
    depth = cv2.erode(depth.astype(np.float32), np.ones((5, 5), np.uint8))
    depth = np.roll(depth, rng.integers(-2, 3, 2), axis=(0, 1))
    return mask, CAMERA_NOISE.apply(depth, mask, rng).astype(np.float32)


@seeds
@pytest.mark.parametrize("lift", [0.0, 0.08])
@pytest.mark.parametrize("gap", GAPS)
def test_ends_with_ground_between_them_stay_open(gap, lift, seed):
    mask, depth = scene(gap, "ground", seed, lift)
    assert len(dloftbs.detect(mask, depth=depth)) == 2


@seeds
@pytest.mark.parametrize("cover", ["occluder", "cable"])
@pytest.mark.parametrize("gap", GAPS)
def test_a_gap_that_something_hides_is_bridged(gap, cover, seed):
    mask, depth = scene(gap, cover, seed)
    (found,) = dloftbs.detect(mask, depth=depth)
    points = found.curve.sample(400)
    assert np.abs(points[:, 1] - np.interp(points[:, 0], *LINE.T)).max() < 8.0


@pytest.mark.parametrize("gap", [(166, 224), (150, 250)])
def test_depth_that_tells_nothing_changes_nothing(gap):
    mask, _ = scene(gap, "ground", 0)
    alone = dloftbs.detect(mask)
    for depth in (np.zeros(SIZE, np.uint16), np.full(SIZE, np.nan, np.float32), np.full(SIZE, 700, np.uint16)):
        assert [one.curve for one in dloftbs.detect(mask, depth=depth)] == [one.curve for one in alone]


@seeds
def test_counts_mean_what_the_frame_says(seed):
    mask, depth = scene(GAPS[1], "ground", seed)
    counts = np.rint(depth * 10000.0).astype(np.uint16)
    assert len(Pipeline().detect(Frame(mask=mask, depth=counts, depth_unit_m=1e-4)).detections) == 2
    assert len(dloftbs.detect(mask, depth=counts, depth_unit_m=1e-4)) == 2


@pytest.mark.parametrize("turns", range(4))
@pytest.mark.parametrize("gap", [(150, 250), (140, 250)])
def test_a_gap_under_occluders_is_bridged_although_its_ends_look_free(gap, turns):
    """From the mask alone two round ends so far apart are those of two cables."""
    ends = part(LINE[0, 0], gap[0] - WIDTH / 2), part(gap[1] + WIDTH / 2, LINE[-1, 0])
    mask = np.any([draw_cable(line, WIDTH, SIZE) for line in ends], axis=0)
    occluders = np.zeros((*SIZE, 1), np.uint8)
    occluders[40:200, slice(*gap)] = 255
    mask, occluders = np.rot90(mask, turns), np.rot90(occluders, turns)
    assert len(dloftbs.detect(mask, occluders=occluders)) == 1
    assert len(dloftbs.detect(mask)) == 2


def part(left: float, right: float) -> np.ndarray:
    """Return the line between two columns."""
    x = np.linspace(left, right, 60)
    return np.stack((x, np.interp(x, *LINE.T)), axis=1)


def test_occluders_elsewhere_say_nothing_of_a_gap():
    mask, _ = scene(GAPS[1], "ground", 0)
    occluders = np.zeros(SIZE, bool)
    occluders[:40] = True
    assert len(dloftbs.detect(mask, occluders=occluders)) == len(dloftbs.detect(mask))


def test_occluders_of_another_size_are_refused():
    mask, _ = scene(GAPS[1], "ground", 0)
    with pytest.raises(InputError, match="size"):
        dloftbs.detect(mask, occluders=np.zeros((5, 5), bool))
