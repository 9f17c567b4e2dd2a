"""Gaps over grounds of photographs: ends in plain sight, covers, sleeves, and cables that the mask leaves out.

Run it in the repository with ``python -m benchmarks.pictured_gaps FOLDER``, where the folder holds photographs as
``networks/ewd/*.jpg``, ``mbest/*/*.jpg`` and ``cables/*.jpg``. A cable of 4 to 20 px is drawn over a part of one, half
of them with a shadow and a third in nearly the colour of the ground. It has a gap of one of the `KINDS`: two ends in
plain sight, with caps of another colour or without; the same, with a strip over one of them; a strip across it, of
another photograph that is tinted or of one colour; the tip of such a strip; a sleeve of another colour; or the mask
alone is broken. Depth is that of a cable on a table or above it, with a depth camera's errors. Printed is how
often the number of cables found is right, and how often what is wrong is stated above .9: by the mask alone, and with
more.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
import numpy.typing as npt

import dloftbs
from benchmarks.gap_relief import Relief
from dloftbs import Frame

GROUNDS = ("networks/ewd/*.jpg", "mbest/*/*.jpg", "cables/*.jpg")
KINDS = ("ends in sight", "ends by a strip", "under a strip", "under a tip", "under a sleeve", "mask broken")
GIVEN = {
    "mask alone": (),
    "image": ("image",),
    "depth": ("depth", "camera"),
    "image and depth": ("image", "depth", "camera"),
}
"""Fields of `Frame` that are given besides the mask, by the name of their column."""

ENDS = KINDS[:2]
"""Kinds that show two cables."""

_SIZE = (480, 900)
_NOISE = 3.0  # grey levels
_SURE = 0.9
_DULL, _NEAR = 0.3, 25.0  # share of cables in nearly the colour of their ground, and how near, grey levels
_GROUND_WIDTHS, _GROUND_PX = 1.5, 6.0  # of the ground in sight beside a strip, at least: the sum of both
_MIN_STRIP = 0.3  # share of such a gap

_Image = npt.NDArray[np.uint8]
_Points = npt.NDArray[np.float64]


class Gap(NamedTuple):
    """A frame with a gap, and points along the cables that it shows."""

    frame: Frame
    cables: tuple[_Points, ...]


def main() -> None:
    """Print how the gaps over each kind of ground are read."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--number", type=int, default=100, help="frames of each kind over each kind of ground")
    given = parser.parse_args()
    print(f"| grounds | gap | frames | {' | '.join(GIVEN)} |")
    print("| --- | --- | ---: |" + " ---: |" * len(GIVEN))
    for pattern in GROUNDS:
        grounds = sorted(given.folder.glob(pattern))
        for kind in KINDS if grounds else ():
            read = np.sum([_read(gap) for gap in list_gaps(grounds, kind, given.seed, given.number)], axis=0)
            cells = " | ".join(f"{right}, {sure}" for right, sure in read.tolist())
            print(f"| {pattern} | {kind} | {given.number} | {cells} |", flush=True)


def _read(gap: Gap) -> list[tuple[bool, bool]]:
    """Return whether the number of cables is right, and if it is surely wrong, by each of what is `GIVEN`."""
    found = []
    for names in GIVEN.values():
        result = dloftbs.detect(Frame(mask=gap.frame.mask, **{name: getattr(gap.frame, name) for name in names}))
        is_right = len(result) == len(gap.cables)
        is_sure = min((one.confidence for one in result), default=1.0) > _SURE
        found.append((is_right, is_sure and not is_right))
    return found


def list_gaps(grounds: Sequence[Path], kind: str, seed: int, number: int) -> Iterator[Gap]:
    """Yield frames of one of the `KINDS`, with image, mask and depth."""
    for index in range(number):
        key = seed, index, KINDS.index(kind)
        relief = Relief(_SIZE, np.random.default_rng((*key, 1)))
        yield _draw(np.random.default_rng(key), relief, grounds, kind)


def _draw(rng: np.random.Generator, relief: Relief, grounds: Sequence[Path], kind: str) -> Gap:
    height, across_px = _SIZE
    image, mask = _patch(rng, grounds), np.zeros(_SIZE, np.uint8)
    is_thin, colour = bool(rng.random() < 0.5), _colour(rng)
    if rng.random() < _DULL:
        colour = tuple(np.clip(image.mean(axis=(0, 1)) + rng.normal(0.0, _NEAR, 3), 0.0, 255.0).tolist())
    width = int(rng.integers(4, 8) if is_thin else rng.integers(8, 20))
    x = np.arange(40.0, across_px - 40.0)
    wave = rng.uniform(20.0, 70.0) * np.sin(x / rng.uniform(90.0, 200.0) + rng.uniform(0.0, 6.0))
    curve = np.column_stack((x, 0.5 * height + wave))
    middle, gap = rng.uniform(300.0, 600.0), rng.uniform(25.0, 90.0) if is_thin else rng.uniform(2.5, 9.0) * width
    cables: tuple[_Points, ...] = (curve,)
    covered = middle, gap
    if kind == "ends by a strip":
        in_sight = _GROUND_WIDTHS * width + _GROUND_PX
        gap = max(gap, 2.0 * in_sight)
        strip = rng.uniform(_MIN_STRIP, 1.0 - in_sight / gap) * gap
        covered = middle + 0.5 * rng.choice([-1.0, 1.0]) * (gap - strip), strip
    if kind in ENDS:
        cables = curve[x < middle - 0.5 * gap], curve[x > middle + 0.5 * gap]
    if rng.random() < 0.5:
        _cast_shadow(image, cables, np.array([rng.uniform(-0.5, 0.5), rng.uniform(0.2, 0.8)]) * width, width)
    for one in cables:
        _stroke(image, one, colour, width)
        _stroke(mask, one, (255,), width)
        _raise(relief, one, width)
    if kind == "ends in sight":
        cap, of_caps = int(rng.choice([0.0, 1.5, 2.5]) * width), _colour(rng)
        for one in (cables[0][-cap:], cables[1][:cap]) if cap else ():
            _stroke(image, one, of_caps, width)
            _stroke(mask, one, (0,), width + 2)
    elif kind == "mask broken":
        mask[:, np.abs(np.arange(across_px) - middle) < 0.5 * gap] = 0
    else:
        cover = _cover(rng, relief, curve, kind, *covered, width)
        paint = np.broadcast_to(_colour(rng), image.shape)
        if kind != "under a sleeve" and rng.random() < 0.5:
            paint = 0.5 * _patch(rng, grounds) + 0.5 * paint
        image[cover], mask[cover] = paint[cover], 0
    seen = cv2.GaussianBlur(image, (0, 0), 0.7) + rng.normal(0.0, _NOISE, image.shape)
    depth, camera = relief.measure(mask > 127)
    image = np.clip(seen, 0.0, 255.0).astype(np.uint8)
    return Gap(Frame(mask=mask > 127, image=image, depth=depth, camera=camera), cables)


def _cover(
    rng: np.random.Generator, relief: Relief, curve: _Points, kind: str, middle: float, gap: float, width: int
) -> npt.NDArray[np.bool_]:
    """Return the pixels that a sleeve, a strip or the tip of one covers."""
    if kind == "under a sleeve":
        return _raise(relief, curve[np.abs(curve[:, 0] - middle) < 0.5 * gap], int(rng.uniform(1.0, 1.6) * width))
    row, column = np.mgrid[: _SIZE[0], : _SIZE[1]]
    turn, at = rng.uniform(-1.0, 1.0), float(np.interp(middle, *curve.T))
    across, down = column - middle, row - at
    strip = np.abs(across * np.cos(turn) + down * np.sin(turn)) < 0.5 * gap
    if kind == "under a tip":
        beyond = rng.choice([-1.0, 1.0]) * (down * np.cos(turn) - across * np.sin(turn))
        strip &= beyond < rng.uniform(0.7, 2.0) * width
    relief.add_cover(strip)
    return np.asarray(strip)


def _raise(relief: Relief, points: _Points, width: int) -> npt.NDArray[np.bool_]:
    """Add a cable along some points to the relief, and return its pixels."""
    band = np.zeros(_SIZE, np.uint8)
    _stroke(band, points, (255,), width)
    relief.add_cable(band > 127, width)
    return band > 0


def _cast_shadow(image: _Image, cables: Sequence[_Points], shift: _Points, width: int) -> None:
    """Halve the light, at most, beside some cables."""
    shadow = np.zeros(_SIZE, np.uint8)
    for one in cables:
        _stroke(shadow, one + shift, (255,), width)
    dark = cv2.GaussianBlur(shadow, (0, 0), 0.3 * width) / 255.0
    image[:] = (image * (1.0 - 0.5 * dark[..., None])).astype(np.uint8)


def _patch(rng: np.random.Generator, grounds: Sequence[Path]) -> _Image:
    """Return a part of one of the photographs, enlarged where it is too small."""
    picture = np.asarray(cv2.imread(str(grounds[int(rng.integers(len(grounds)))])), np.uint8)
    height, width = _SIZE
    scale = max(height / picture.shape[0], width / picture.shape[1]) * rng.uniform(1.0, 1.6)
    picture = np.asarray(cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA), np.uint8)
    top, left = (int(rng.integers(has - needs + 1)) for has, needs in zip(picture.shape[:2], _SIZE, strict=True))
    return picture[top : top + height, left : left + width].copy()


def _colour(rng: np.random.Generator) -> tuple[int, ...]:
    return tuple(rng.integers(0, 256, 3).tolist())


def _stroke(image: _Image, points: _Points, colour: tuple[int, ...], width: int) -> None:
    cv2.polylines(image, [np.rint(8.0 * points).astype(np.int32)], False, colour, width, cv2.LINE_AA, 3)


if __name__ == "__main__":
    main()
