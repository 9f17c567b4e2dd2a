"""The confidence that lumps of the mask leave of the course of a curve."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest

from dloftbs import detect
from dloftbs.linking.kernels.lumps import course_confidence

SIZE = (240, 640)
ROWS, COLUMNS = np.mgrid[: SIZE[0], : SIZE[1]]

Mask = npt.NDArray[np.bool_]
Points = npt.NDArray[np.float64]


def bar(width: int, start: int = 40, stop: int = 600, y: int = 120) -> Mask:
    return (abs(ROWS - y) <= width // 2) & (start <= COLUMNS) & (stop > COLUMNS)


def disc(x: float, y: float, diameter: float, stretched: float = 1.0) -> Mask:
    return ((COLUMNS - x) / stretched) ** 2 + (ROWS - y) ** 2 <= 0.25 * diameter**2


def slowly(mask: npt.NDArray[np.uint8], points: Points, closed: bool, width: float) -> float:
    """The same by arrays, of one line."""
    steps = np.hypot(*np.diff(points, axis=0, append=points[:1]).T)
    at = np.concatenate(([0.0], np.cumsum(steps)))
    length = at[-1] if closed else at[-2]
    turns = np.arange(16) * math.pi / 8.0
    ring = np.column_stack((np.cos(turns), np.sin(turns)))
    radii = 0.5 * math.sqrt(2.0) * width + 0.5 * np.arange(900)

    def disc_at(middle: np.ndarray) -> float:
        columns, rows = np.floor(middle + radii[:, None, None] * ring + 0.5).astype(int).transpose(2, 0, 1)
        inside = (rows >= 0) & (rows < mask.shape[0]) & (columns >= 0) & (columns < mask.shape[1])
        on = inside & (mask[rows * inside, columns * inside] != 0)
        first = int(np.argmin(on.all(axis=1)))
        return 2.0 * radii[first] - 0.5 if first else width

    places, discs, due = [], [], 0.0
    for place, middle in zip(at, points, strict=False):
        if place < due:
            continue
        places.append(place)
        discs.append(disc_at(middle))
        due = place + 0.125 * max(discs[-1], 2.0 * width)
    places, discs = np.array(places), np.array(discs)
    sure = 1.0
    for k in np.flatnonzero(discs > 2.0 * width):
        ahead = places - places[k]
        forth, back = (ahead % length, -ahead % length) if closed else (ahead, -ahead)
        near = ((forth >= 0.0) & (forth < discs[k])) | ((back >= 0.0) & (back < discs[k]))
        if (discs[near] > discs[k]).any():
            continue
        sides = []
        for way in (forth, back):
            far = np.flatnonzero(way >= discs[k])
            sides.append(discs[far[np.argmin(way[far])]] if len(far) else np.inf)
        sure = min(sure, 2.0 * max(sides) / discs[k])
    for along in () if closed else (points, points[::-1]):
        away = along[0] - along
        tangent = away[np.argmax(np.hypot(*away.T) >= 1.5 * width)]
        angles = math.atan2(tangent[1], tangent[0]) + np.radians(np.arange(-80, 90, 10))
        around = along[0] + (1.2 * width + 1.0) * np.column_stack((np.cos(angles), np.sin(angles)))
        columns, rows = np.floor(around + 0.5).astype(int).T
        inside = (rows >= 0) & (rows < mask.shape[0]) & (columns >= 0) & (columns < mask.shape[1])
        goes_on = mask[rows[inside], columns[inside]].any() and disc_at(along[0]) <= 2.0 * width
        sure *= 0.35 if goes_on else 1.0
    return sure * max(1.0 - (max(discs.max(), width) / length) ** 2, 0.0)


@pytest.mark.parametrize("seed", range(20))
def test_it_is_what_arrays_say(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = np.zeros(SIZE, np.bool_)
    width = rng.uniform(3.0, 14.0)
    turn = np.linspace(0.0, 2.0 * math.pi, 800, endpoint=False)
    lines = [np.column_stack((np.arange(40.0, 600.0), 120.0 + 30.0 * np.sin(np.arange(560.0) / 90.0)))]
    lines.append(np.column_stack((300.0 + 200.0 * np.cos(turn), 120.0 + 80.0 * np.sin(turn))))
    for line in lines:
        for x, y in line[::2]:
            mask[int(y - width / 2) : int(y + width / 2) + 1, int(x - width / 2) : int(x + width / 2) + 1] = True
    for _ in range(rng.integers(0, 6)):
        x, y = lines[rng.integers(2)][rng.integers(500)]
        mask |= disc(x, y, rng.uniform(1.0, 6.0) * width)
    pixels = mask.astype(np.uint8)
    points = np.concatenate([lines[0], lines[1]])
    spans = np.array([(0, 200, 1), (200, 560, 1), (560 + 799, 559, -1)])
    found = course_confidence(
        pixels, points, spans, np.array([0, 2, 3]), 1, np.array((width, width)), np.zeros((1, 2), bool)
    )
    wanted = slowly(pixels, lines[0], False, width), slowly(pixels, lines[1][::-1], True, width)
    assert found.tolist() == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize("stretched", [2.5, 3.0])
def test_what_is_hardly_longer_than_wide_is_not_sure(stretched: float) -> None:
    (found,) = detect(disc(300.0, 120.0, 40.0, stretched))
    assert found.confidence < 0.9


@pytest.mark.parametrize("start", [100, 560])
@pytest.mark.parametrize("widths", [3.0, 4.0, 6.0])
def test_a_knot_on_the_way_lowers_it(start: int, widths: float) -> None:
    (found,) = detect(bar(9) | disc(0.5 * start + 60.0, 120.0, 9.0 * widths))
    assert found.confidence == pytest.approx(2.0 / widths, abs=0.12)
    assert found.reversed().confidence == found.confidence


@pytest.mark.parametrize("diameter", [30.0, 60.0, 100.0])
def test_a_hand_at_the_end_leaves_a_long_cable_sure(diameter: float) -> None:
    (found,) = detect(bar(9, start=60) | disc(60.0, 120.0, diameter))
    assert found.confidence > 0.95


def test_a_cable_that_grows_thick_is_sure() -> None:
    wedge = (abs(ROWS - 120) <= 2 + 18 * (COLUMNS - 40) / 560) & (COLUMNS > 40) & (COLUMNS < 600)
    for mask in (bar(9) | bar(41, start=300), wedge):
        (found,) = detect(mask)
        assert found.confidence > 0.98


@pytest.mark.parametrize("slope", [0.2, 0.6, 2.0, 10.0])
@pytest.mark.parametrize("width", [5, 9, 21])
def test_a_crossing_is_no_lump(slope: float, width: int) -> None:
    across = abs((ROWS - 120) - slope * (COLUMNS - 300)) <= 4.5 * math.hypot(1.0, slope)
    result = detect(bar(width) | across)
    assert len(result) == 2
    assert all(one.centerline.course_confidence > 0.98 for one in result)


@pytest.mark.parametrize("degrees", [40, 65, 90, 120])
def test_an_end_on_another_cable_is_hardly_sure_and_the_other_cable_is(degrees: int) -> None:
    dx, dy = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    along, aside = (COLUMNS - 300) * dx - (ROWS - 120) * dy, (COLUMNS - 300) * dy + (ROWS - 120) * dx
    result = detect(bar(9) | ((abs(aside) <= 4.5) & (along >= 0.0) & (along <= 110.0)))
    confidences = sorted(one.confidence for one in result)
    assert len(result) == 2
    assert confidences[0] < 0.4
    assert confidences[1] > 0.9


def test_a_turned_mask_is_as_sure() -> None:
    mask = bar(9) | disc(250.0, 123.0, 37.0) | disc(590.0, 118.0, 50.0)
    turned = [np.rot90(mask, k) for k in range(4)] + [np.rot90(mask.T, k) for k in range(4)]
    assert len({detect(np.ascontiguousarray(one))[0].confidence for one in turned}) == 1
