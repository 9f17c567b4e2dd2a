"""Gaps over grounds of photographs: ends with caps that face each other, and cables that go on under a strip.

Run it in the repository with ``python -m benchmarks.pictured_gaps FOLDER``, where the folder holds photographs as
``networks/ewd/*.jpg``, ``mbest/*/*.jpg`` and ``cables/*.jpg``. A cable is drawn over a part of one: it has a gap in
which its ends, with caps of another colour or without, lie in plain sight, or which a strip of another photograph hides
that is tinted. Printed is how often as many cables are found as there are, with the image and by the mask alone, and
how often what is wrong with the image is stated above .9.
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
from dloftbs import Frame

GROUNDS = ("networks/ewd/*.jpg", "mbest/*/*.jpg", "cables/*.jpg")
KINDS = ("ends in sight", "under a strip")

_SIZE = (480, 900)
_NOISE = 3.0  # grey levels
_SURE = 0.9

_Image = npt.NDArray[np.uint8]
_Points = npt.NDArray[np.float64]


class Gap(NamedTuple):
    """A frame with a gap, and the number of cables that it shows."""

    frame: Frame
    cables: int


def main() -> None:
    """Print how the gaps over each kind of ground are read."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--number", type=int, default=100, help="frames of each kind over each kind of ground")
    given = parser.parse_args()
    print("| grounds | gap | frames | right, image | right, mask alone | wrong and above .9 |")
    print("| --- | --- | ---: | ---: | ---: | ---: |")
    for pattern in GROUNDS:
        grounds = sorted(given.folder.glob(pattern))
        for kind in KINDS if grounds else ():
            read = [_read(gap) for gap in list_gaps(grounds, kind, given.seed, given.number)]
            counts = " | ".join(str(sum(one[k] for one in read)) for k in range(3))
            print(f"| {pattern} | {kind} | {len(read)} | {counts} |", flush=True)


def _read(gap: Gap) -> tuple[bool, bool, bool]:
    """Return whether the number of cables is right with the image, and by the mask alone; and if it is surely wrong."""
    found = dloftbs.detect(gap.frame).detections
    is_right = len(found) == gap.cables
    is_sure = min((one.confidence for one in found), default=1.0) > _SURE
    return is_right, len(dloftbs.detect(Frame(mask=gap.frame.mask))) == gap.cables, is_sure and not is_right


def list_gaps(grounds: Sequence[Path], kind: str, seed: int, number: int) -> Iterator[Gap]:
    """Yield frames of one of the `KINDS`, with image and mask."""
    for index in range(number):
        yield _draw(np.random.default_rng((seed, index)), grounds, are_ends=kind == KINDS[0])


def _draw(rng: np.random.Generator, grounds: Sequence[Path], *, are_ends: bool) -> Gap:
    height, across_px = _SIZE
    image, mask = _patch(rng, grounds), np.zeros(_SIZE, np.uint8)
    width, colour = int(rng.integers(8, 20)), _colour(rng)
    x = np.arange(40.0, across_px - 40.0)
    wave = rng.uniform(20.0, 70.0) * np.sin(x / rng.uniform(90.0, 200.0) + rng.uniform(0.0, 6.0))
    curve = np.column_stack((x, 0.5 * height + wave))
    middle, gap = rng.uniform(300.0, 600.0), rng.uniform(2.5, 9.0) * width
    if are_ends:
        left, right = curve[x < middle - 0.5 * gap], curve[x > middle + 0.5 * gap]
        cap, of_caps = int(rng.choice([0.0, 1.5, 2.5]) * width), _colour(rng)
        for one in (left, right):
            _stroke(image, one, colour, width)
            _stroke(mask, one, (255,), width)
        for one in (left[-cap:], right[:cap]) if cap else ():
            _stroke(image, one, of_caps, width)
            _stroke(mask, one, (0,), width + 2)
    else:
        _stroke(image, curve, colour, width)
        _stroke(mask, curve, (255,), width)
        row, column = np.mgrid[:height, :across_px]
        turn, at = rng.uniform(-0.5, 0.5), float(np.interp(middle, x, curve[:, 1]))
        strip = np.abs((column - middle) * np.cos(turn) + (row - at) * np.sin(turn)) < 0.5 * gap
        image[strip] = (0.5 * _patch(rng, grounds) + 0.5 * np.array(_colour(rng)))[strip]
        mask[strip] = 0
    seen = cv2.GaussianBlur(image, (0, 0), 0.7) + rng.normal(0.0, _NOISE, image.shape)
    frame = Frame(mask=mask > 127, image=np.clip(seen, 0.0, 255.0).astype(np.uint8))
    return Gap(frame, 2 if are_ends else 1)


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
