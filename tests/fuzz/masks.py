"""Masks that look like no cable, or like too many."""

from __future__ import annotations

import zlib
from functools import cache
from pathlib import Path

import cv2
import numpy as np

Rng = np.random.Generator
Mask = np.ndarray

SHARED_DATA = Path(__file__).resolve().parents[3] / "shared" / "data"


def some_size(rng: Rng, largest: int = 260) -> tuple[int, int]:
    """Return ``(H, W)``, now and then very flat."""
    height, width = (int(n) for n in np.exp(rng.uniform(np.log(24), np.log(largest), 2)))
    return (height, width) if rng.random() < 0.9 else (int(rng.integers(1, 8)), width)


def stroke(mask: Mask, points: np.ndarray, width: int, closed: bool = False) -> Mask:
    """Draw a polyline (n, 2) into a mask."""
    fixed = np.rint(np.asarray(points, np.float64) * 16).clip(-(2**20), 2**20).astype(np.int32)
    cv2.polylines(mask, [fixed.reshape(-1, 1, 2)], closed, 1, max(1, int(width)), cv2.LINE_8, 4)
    return mask


def fitted(points: np.ndarray, size: tuple[int, int], margin: float) -> np.ndarray:
    """Scale points into an image of a size, up to a margin."""
    low, high = points.min(axis=0), points.max(axis=0)
    room = np.maximum(np.array(size[::-1]) - 1 - 2 * margin, 1.0)
    return margin + (points - low) * (room / np.maximum(high - low, 1e-9)).min()


def smooth_path(rng: Rng, size: tuple[int, int], turns: int) -> np.ndarray:
    """Return points (300, 2) of a random smooth path, which may leave the image."""
    knots = rng.uniform(-0.1, 1.1, (turns + 3, 2)) * size[::-1]
    at = np.linspace(0, len(knots) - 1, 300)
    rough = np.stack([np.interp(at, np.arange(len(knots)), axis) for axis in knots.T], axis=1)
    return cv2.GaussianBlur(rough, (1, 0), sigmaX=1e-3, sigmaY=12.0, borderType=cv2.BORDER_REPLICATE)


def noise(rng: Rng) -> Mask:
    size = some_size(rng)
    values = rng.random(size)
    if rng.random() < 0.6:
        values = cv2.GaussianBlur(values, (0, 0), float(rng.uniform(0.5, 6.0)))
    return (values < np.quantile(values, rng.uniform(0.02, 0.98))).astype(np.uint8)


def labyrinth(rng: Rng) -> Mask:
    """A maze: a random spanning tree of a grid."""
    rows, columns = (int(n) for n in rng.integers(2, 14, 2))
    pitch, width = int(rng.integers(6, 20)), int(rng.integers(1, 8))
    mask = np.zeros((rows * pitch + pitch, columns * pitch + pitch), np.uint8)
    seen, trail = {(0, 0)}, [(0, 0)]
    while trail:
        r, c = trail[-1]
        steps = [(r + a, c + b) for a, b in ((0, 1), (1, 0), (0, -1), (-1, 0))]
        free = [(y, x) for y, x in steps if 0 <= y < rows and 0 <= x < columns and (y, x) not in seen]
        if not free:
            trail.pop()
            continue
        y, x = free[rng.integers(len(free))]
        stroke(mask, (np.array([(c, r), (x, y)]) + 1) * pitch, width)
        seen.add((y, x))
        trail.append((y, x))
    return mask


def comb(rng: Rng) -> Mask:
    size = (int(rng.integers(40, 200)), int(rng.integers(60, 300)))
    mask = np.zeros(size, np.uint8)
    back, width, pitch = int(rng.integers(0, size[0])), int(rng.integers(1, 9)), int(rng.integers(3, 30))
    stroke(mask, np.array([(5, back), (size[1] - 6, back)]), int(rng.integers(1, 14)))
    for x in range(8, size[1] - 8, pitch):
        reach = rng.uniform(-1.0, 1.0) * size[0] if rng.random() < 0.5 else size[0]
        stroke(mask, np.array([(x, back), (x + rng.uniform(-3, 3), back + reach)]), width)
    return mask


def rings(rng: Rng) -> Mask:
    """Rings: concentric, chained, tiny, cut, with lines through them."""
    size = some_size(rng)
    mask = np.zeros(size, np.uint8)
    middle = rng.uniform(0, size[::-1])
    for _ in range(int(rng.integers(1, 9))):
        if rng.random() < 0.5:
            middle = rng.uniform(0, size[::-1])
        axes = rng.uniform(1, max(size) / 2, 2) if rng.random() < 0.5 else np.full(2, rng.uniform(1, max(size) / 2))
        turn, sweep = float(rng.uniform(0, 360)), float(rng.choice([360.0, 350.0, 200.0]))
        centre, radii = tuple(int(v) for v in middle), tuple(int(v) for v in axes)
        cv2.ellipse(mask, centre, radii, turn, 0.0, sweep, 1, int(rng.integers(1, 12)))
    if rng.random() < 0.4:
        stroke(mask, rng.uniform(0, 1, (2, 2)) * size[::-1], int(rng.integers(1, 8)))
    return mask


def spiral(rng: Rng) -> Mask:
    size = some_size(rng)
    t = np.linspace(0.0, rng.uniform(1, 12) * 2 * np.pi, 1500)
    radius = t if rng.random() < 0.5 else np.exp(0.1 * t)
    points = np.stack((radius * np.cos(t), radius * np.sin(t)), axis=1)
    return stroke(np.zeros(size, np.uint8), fitted(points, size, rng.uniform(-5, 8)), int(rng.integers(1, 9)))


def hilbert(order: int) -> np.ndarray:
    """Return the points of Hilbert's curve on a grid of ``2**order`` cells a side."""
    points = np.zeros(1, np.complex128)
    for _ in range(order):
        points = np.concatenate(_four_times(points))
    return np.stack((points.real, points.imag), axis=1)


def _four_times(points: np.ndarray) -> tuple[np.ndarray, ...]:
    side = 2.0 ** round(np.log2(len(points)) / 2)
    swapped = points.imag + 1j * points.real
    last = (2 * side - 1) - points.imag + 1j * ((side - 1) - points.real)
    return swapped, points + 1j * side, points + side + 1j * side, last


def _by_rules(rules: dict[str, str], text: str, times: int, angle: float) -> np.ndarray:
    """Return the path of a turtle that follows a Lindenmayer system: letters go ahead, signs turn."""
    for _ in range(times):
        text = "".join(rules.get(sign, sign) for sign in text)
    at, heading, points = 0j, 1 + 0j, [0j]
    for sign in text:
        if sign in "+-":
            heading *= np.exp(1j * np.radians(angle if sign == "+" else -angle))
        elif sign.isupper():
            at += heading
            points.append(at)
    return np.stack((np.real(points), np.imag(points)), axis=1)


def fractal(rng: Rng) -> Mask:
    size = (int(rng.integers(60, 400)), int(rng.integers(60, 400)))
    kind = int(rng.integers(4))
    if kind == 0:
        points = hilbert(int(rng.integers(1, 7)))
    elif kind == 1:
        points = _by_rules({"F": "F+G", "G": "F-G"}, "F", int(rng.integers(3, 11)), 90)
    elif kind == 2:
        points = _by_rules({"F": "F-F++F-F"}, "F++F++F", int(rng.integers(1, 4)), 60)
    else:
        points = _by_rules({"F": "G-F-G", "G": "F+G+F"}, "F", int(rng.integers(2, 7)), 60)
    return stroke(np.zeros(size, np.uint8), fitted(points, size, rng.uniform(2, 10)), int(rng.integers(1, 8)))


def letters(rng: Rng) -> Mask:
    """Lines of random text."""
    size = (int(rng.integers(40, 300)), int(rng.integers(60, 500)))
    mask = np.zeros(size, np.uint8)
    scale, thick = float(rng.uniform(0.3, 3.0)), int(rng.integers(1, 8))
    for y in range(int(24 * scale), size[0], max(8, int(34 * scale))):
        text = "".join(chr(int(code)) for code in rng.integers(33, 127, 40))
        cv2.putText(mask, text, (int(rng.integers(-20, 20)), y), int(rng.integers(0, 8)), scale, 1, thick)
    return mask


def star(rng: Rng) -> Mask:
    """Strokes that meet in one point."""
    size = some_size(rng)
    mask = np.zeros(size, np.uint8)
    middle = rng.uniform(0, 1, 2) * size[::-1]
    rays, turn, reach = int(rng.integers(2, 24)), rng.uniform(0, 7), rng.uniform(5, max(size))
    angles = turn + 2 * np.pi * np.arange(rays) / rays + rng.normal(0, 0.1 * rng.integers(2), rays)
    for angle in angles:
        tip = middle + reach * np.array((np.cos(angle), np.sin(angle)))
        stroke(mask, np.array((middle, tip)), int(rng.integers(1, 10)))
    return mask


def tangle(rng: Rng, size: tuple[int, int] | None = None) -> Mask:
    """Smooth cables, one over the other, of several widths."""
    size = size or (int(rng.integers(60, 300)), int(rng.integers(60, 400)))
    mask = np.zeros(size, np.uint8)
    for _ in range(int(rng.integers(1, 9))):
        stroke(mask, smooth_path(rng, size, int(rng.integers(1, 9))), int(rng.integers(1, 14)))
    for _ in range(int(rng.integers(0, 4))):  # what lies on top
        y, x = (int(rng.integers(0, n)) for n in size)
        mask[y : y + int(rng.integers(1, 40)), x : x + int(rng.integers(1, 40))] = 0
    return mask


def blob_at_border(rng: Rng) -> Mask:
    """Cables that run into a hand, a gripper or a connector, which the border cuts."""
    side, (short, long) = int(rng.integers(4)), (int(rng.integers(120, 240)), int(rng.integers(120, 320)))
    mask = np.zeros((short, long), np.uint8)
    where, radius, width = rng.uniform(0.2, 0.8) * long, rng.uniform(10, 45), int(rng.integers(3, 12))
    for _ in range(int(rng.integers(1, 4))):
        start = (where + rng.uniform(-0.9, 0.9) * radius, rng.uniform(0.0, 0.8) * radius)
        middle, end = rng.uniform(0.1, 1.0, (2, 2)) * (long, short)
        t = np.linspace(0.0, 1.0, 80)[:, None]
        stroke(mask, (1 - t) ** 2 * start + 2 * t * (1 - t) * middle + t**2 * end, width)
    if rng.random() < 0.5:
        cv2.circle(mask, (int(where), int(rng.uniform(-0.5, 0.9) * radius)), int(radius), 1, -1)
    else:
        left = max(int(where - radius), 0)
        mask[: int(radius), left : left + int(2 * radius)] = 1
    return np.ascontiguousarray(np.rot90(mask, side))


def _blob_found(seed: int, number: int) -> Mask:
    """Return a mask that a run of the suite drew once."""
    return blob_at_border(np.random.default_rng([seed, zlib.crc32(b"border-blobs-seen"), number]))


BORDER_BLOBS_FOUND = {
    "a loop in a hand, its inside filled": _blob_found(141414, 15),
    "a corner whose way leaves the mask": _blob_found(202611, 4383),
    "a gap before a piece without points": _blob_found(202611, 31730),
    "a curve that bulges out of a blob": _blob_found(202611, 46500),
}


def bars(rng: Rng) -> Mask:
    """Rectangles: parallel, touching, crossing at right angles, of any shape."""
    size = some_size(rng)
    mask = np.zeros(size, np.uint8)
    for _ in range(int(rng.integers(1, 25))):
        y, x = (int(rng.integers(0, n)) for n in size)
        thick, long = int(rng.integers(1, 14)), int(rng.integers(1, max(size)))
        down, right = (thick, long) if rng.random() < 0.5 else (long, thick)
        mask[y : y + down, x : x + right] = 1
    return mask


def grid(rng: Rng) -> Mask:
    """Regular patterns: grids, checkers, stripes."""
    size = some_size(rng)
    rows, columns = np.indices(size)
    period, on = int(rng.integers(2, 30)), int(rng.integers(1, 10))
    kind = int(rng.integers(4))
    if kind == 0:
        found = (rows % period < on) | (columns % period < on)
    elif kind == 1:
        found = (rows // on + columns // on) % 2 == 0
    elif kind == 2:
        found = (rows + columns) % period < on
    else:
        found = (rows % period < on) & (columns % period < on)
    return found.astype(np.uint8)


def few_pixels(rng: Rng) -> Mask:
    """All, none, or some single pixels of an image that may be a single row."""
    size = (int(rng.integers(1, 70)), int(rng.integers(1, 70)))
    mask = np.full(size, int(rng.random() < 0.3), np.uint8)
    for _ in range(int(rng.integers(0, 12))):
        y, x = (int(rng.integers(0, n)) for n in size)
        mask[y, x] ^= 1
    return mask


def at_borders(rng: Rng) -> Mask:
    """Lines along, across and into the borders."""
    size = some_size(rng)
    mask = np.zeros(size, np.uint8)
    height, width = size
    corners = np.array([(0, 0), (width - 1, 0), (width - 1, height - 1), (0, height - 1)], np.float64)
    thick = int(rng.integers(1, 14))
    for side in range(4):
        if rng.random() < 0.6:
            stroke(mask, corners[[side, (side + 1) % 4]] + rng.integers(-3, 4), thick)
    for _ in range(int(rng.integers(0, 5))):
        start = corners[int(rng.integers(4))] * rng.choice([1.0, rng.random()])
        stroke(mask, np.array([start, rng.uniform(-0.2, 1.2, 2) * (width, height)]), thick)
    return mask


def thickness(rng: Rng) -> Mask:
    """Cables of one pixel, and of half the image; of a width that changes along them."""
    size = (int(rng.integers(60, 260)), int(rng.integers(60, 360)))
    mask = np.zeros(size, np.uint8)
    path = smooth_path(rng, size, int(rng.integers(1, 4)))
    kind = int(rng.integers(3))
    if kind < 2:
        return stroke(mask, path, 1 if kind else int(rng.uniform(0.2, 0.7) * min(size)))
    widths = np.abs(np.interp(np.arange(len(path)), np.linspace(0, 299, 6), rng.uniform(-4, 30, 6)))
    for start, stop, width in zip(path[:-1], path[1:], widths, strict=False):
        stroke(mask, np.array((start, stop)), int(width) + 1)
    return mask


def zigzag(rng: Rng) -> Mask:
    """Sharp bends, hairpins, and runs that nearly touch."""
    size = (int(rng.integers(60, 260)), int(rng.integers(60, 360)))
    n = int(rng.integers(3, 14))
    x = np.linspace(0, 1, n) if rng.random() < 0.5 else np.repeat(np.linspace(0, 1, n), 2)[:-1]
    y = np.arange(len(x)) % 2 if len(x) == n else (np.arange(len(x)) + 1) // 2 % 2
    points = np.stack((x * rng.uniform(0.2, 3), y + rng.normal(0, 0.1, len(x))), axis=1)
    return stroke(np.zeros(size, np.uint8), fitted(points, size, rng.uniform(0, 20)), int(rng.integers(1, 12)))


def real_masks() -> tuple[Mask, ...]:
    """Return real masks, at most 400 px wide; tangles in their place where the data are not there."""
    return photographed_masks() or _drawn_tangles()


@cache
def _drawn_tangles() -> tuple[Mask, ...]:
    return tuple(tangle(np.random.default_rng(i), (240, 400)) for i in range(30))


@cache
def photographed_masks() -> tuple[Mask, ...]:
    """Return real masks, at most 400 px wide; none where the data are not there."""
    folders = (("masks", "0*.png"), ("mbest", "*/*.labels.png"), ("cables", "*_mask_all.png"))
    paths = [path for folder, pattern in folders for path in sorted((SHARED_DATA / folder).glob(pattern))]
    return tuple(_small(cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) > 0) for path in paths)


def _small(mask: Mask) -> Mask:
    scale = min(1.0, 400 / mask.shape[1])
    return cv2.resize(mask.astype(np.uint8), None, fx=scale, fy=scale, interpolation=cv2.INTER_NEAREST)


def real(rng: Rng) -> Mask:
    """A real mask, worked over."""
    masks = real_masks()
    mask = masks[int(rng.integers(len(masks)))].copy()
    for _ in range(int(rng.integers(1, 4))):
        mask = mutated(rng, mask, masks)
    return np.ascontiguousarray(mask)


def mutated(rng: Rng, mask: Mask, others: tuple[Mask, ...]) -> Mask:
    """Return a mask with one thing changed."""
    height, width = mask.shape
    kind = int(rng.integers(9))
    side = int(rng.integers(2, 8))
    if kind == 0:
        return mask ^ (rng.random(mask.shape) < rng.uniform(0, 0.08)).astype(np.uint8)
    if kind == 1:
        return cv2.erode(mask, np.ones((side, side), np.uint8))
    if kind == 2:
        return cv2.dilate(mask, np.ones((side, side), np.uint8))
    if kind == 3:  # rows or columns are lost
        lost = rng.random(height) < rng.uniform(0, 0.4)
        return np.where(lost[:, None], 0, mask).astype(np.uint8)
    if kind == 4:
        return mask[int(rng.integers(height // 2)) :, int(rng.integers(width // 2)) :]
    if kind == 5:
        other = cv2.resize(others[int(rng.integers(len(others)))], (width, height), interpolation=cv2.INTER_NEAREST)
        return mask | other if rng.random() < 0.5 else mask & other
    if kind == 6:
        return np.roll(mask, (int(rng.integers(height)), int(rng.integers(width))), (0, 1))
    if kind == 7:
        squeezed = (max(4, int(width * rng.uniform(0.1, 1.5))), max(4, int(height * rng.uniform(0.1, 1.5))))
        return cv2.resize(mask, squeezed, interpolation=cv2.INTER_NEAREST)
    for _ in range(int(rng.integers(1, 8))):
        y, x, reach = int(rng.integers(height)), int(rng.integers(width)), int(rng.integers(1, 50))
        cv2.circle(mask, (x, y), reach, int(rng.random() < 0.3), -1)
    return mask


GENERATORS = {
    "noise": noise,
    "labyrinths": labyrinth,
    "combs": comb,
    "rings": rings,
    "spirals": spiral,
    "fractals": fractal,
    "letters": letters,
    "stars": star,
    "tangles": tangle,
    "bars": bars,
    "grids": grid,
    "pixels": few_pixels,
    "borders": at_borders,
    "thickness": thickness,
    "zigzags": zigzag,
    "real": real,
}
"""By the name of the family; `blob_at_border` has a family of its own."""


def any_mask(rng: Rng) -> Mask:
    """Return a mask of any of these kinds."""
    return list(GENERATORS.values())[int(rng.integers(len(GENERATORS)))](rng)


def _found(kind: str, seed: int, number: int) -> Mask:
    """Return a mask of a kind that a run drew once."""
    return GENERATORS[kind](np.random.default_rng([seed, zlib.crc32(kind.encode()), number]))


def stairs(step: int, width: int, size: tuple[int, int] = (240, 320)) -> Mask:
    """Stairs from one corner of an image to another."""
    corners = np.repeat(np.arange(min(size) // step), 2)
    return stroke(np.zeros(size, np.uint8), step // 2 + step * np.stack((corners[1:], corners[:-1]), axis=1), width)


ANYTHING_FOUND = {
    "stairs": stairs(28, 12),
    "a curve that is smoothed off a letter": _found("letters", 5001, 4),
    "a curve that comes back from beyond the image": _found("letters", 5001, 42),
    "an end on the ground": _found("letters", 5001, 103),
    "a loop that nobody sees closed": _found("fractals", 5001, 107),
    "rings through the holes of a board": _found("grids", 5001, 29),
    "a hole that is wider than the cable": _found("tangles", 5001, 33),
}


def drawn_tangle(rng: Rng) -> Mask:
    """One of the tangles that stand in for real masks."""
    masks = _drawn_tangles()
    return masks[int(rng.integers(len(masks)))]


def cables(rng: Rng) -> Mask:
    """Masks as they come: a real one, where the data are there, or one or two smooth cables inside the image."""
    masks = photographed_masks()
    if rng.random() < 0.3 and masks:
        return masks[int(rng.integers(len(masks)))]
    size = (int(rng.integers(160, 320)), int(rng.integers(240, 420)))
    mask = np.zeros(size, np.uint8)
    for _ in range(int(rng.integers(1, 3))):
        path = fitted(smooth_path(rng, size, int(rng.integers(0, 3))), size, 20.0)
        stroke(mask, path, int(rng.integers(4, 10)))
    return mask
