"""The background of the demo: a bench of wooden planks with things lying on it."""

from __future__ import annotations

import numpy as np

from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic import props
from dloftbs_lab.synthetic.sketch import Image, Sprite, smooth_noise

_PLANK = 186.0
_PALE = np.array([150.0, 184.0, 206.0])
_DARK = np.array([98.0, 134.0, 164.0])


def draw_workbench(rng: np.random.Generator, size: tuple[int, int], scale: float) -> Image:
    """Draw the bench, shape (H, W, 3) BGR.

    Parameters
    ----------
    rng : numpy.random.Generator
    size : (int, int)
        ``(H, W)``.
    scale : float
        Pixels per pixel of a 1280 x 720 image, in whose units the things are measured.
    """
    canvas = np.clip(draw_wood(rng, size, scale), 0.0, 255.0).round().astype(np.uint8)
    for sprite, x, y, angle in _layout(rng, scale):
        position = (x * size[1], y * size[0])
        sprite.paste(canvas, position, angle)
    return canvas


def draw_wood(rng: np.random.Generator, size: tuple[int, int], scale: float) -> FloatArray:
    """Draw planks that run from left to right, shape (H, W, 3)."""
    y = np.arange(size[0])[:, None] / scale + rng.uniform(0.0, _PLANK)
    plank = (y // _PLANK).astype(int)
    shift = rng.uniform(-60.0, 60.0, int(plank.max()) + 1)[plank]
    warp = smooth_noise(rng, size, (70.0 * scale, 420.0 * scale))
    bow = smooth_noise(rng, size, (160.0 * scale, 240.0 * scale))
    rings = (y + shift) * 0.085 + 2.6 * warp + 1.4 * bow
    # Early wood is pale and wide, late wood a thin dark line: a sawtooth with a soft flank.
    part = rings - np.floor(rings)
    late = part**3 * np.clip((1.0 - part) / 0.12, 0.0, 1.0)
    fibre = smooth_noise(rng, size, (1.1 * scale, 70.0 * scale))
    pore = np.maximum(smooth_noise(rng, size, (1.4 * scale, 16.0 * scale)) - 0.55, 0.0)
    crop = smooth_noise(rng, size, (120.0 * scale, 300.0 * scale))
    dark = np.clip(0.20 + 0.52 * late + 0.10 * fibre + 0.55 * pore + 0.12 * crop, 0.0, 1.0)
    tint = (1.0 + rng.uniform(-0.09, 0.07, int(plank.max()) + 1))[plank]
    edge = np.minimum(y % _PLANK, _PLANK - y % _PLANK)
    seam = 1.0 - 0.72 * np.exp(-((edge / 1.5) ** 2)) - 0.10 * np.exp(-edge / 7.0)
    wood = _PALE + dark[..., None] * (_DARK - _PALE)
    return wood * (tint * seam)[..., None] * _lamp(size)[..., None]


def _lamp(size: tuple[int, int]) -> FloatArray:
    """Return the light of a lamp beyond the upper left corner, shape (H, W)."""
    y, x = np.linspace(0.0, 1.0, size[0])[:, None], np.linspace(0.0, 1.0, size[1])
    return 1.10 - 0.16 * x - 0.12 * y


def _layout(rng: np.random.Generator, scale: float) -> list[tuple[Sprite, float, float, float]]:
    """Return what lies where: sprite, x and y as shares of the image, angle."""
    corners = [(0.10, 0.80), (0.86, 0.20), (0.12, 0.18), (0.90, 0.80)]
    turn = rng.permutation(4)
    spots = [corners[i] for i in turn]

    def near(spot: tuple[float, float], spread: float = 0.03) -> tuple[float, float, float]:
        x, y = spot + rng.uniform(-spread, spread, 2)
        return float(x), float(y), float(rng.uniform(-0.5, 0.5))

    mat_x, mat_y = rng.uniform(0.36, 0.62), rng.uniform(0.42, 0.60)
    things = [
        (props.cutting_mat(scale, rng), float(mat_x), float(mat_y), float(rng.uniform(-0.12, 0.12))),
        (props.sheet(scale, rng), *near(spots[0])),
        (props.ruler(scale), *near((float(mat_x) - 0.02, float(mat_y) + 0.27))),
        (props.wrench(scale), *near(spots[1])),
        (props.screwdriver(scale), *near(spots[2])),
        (props.tape(scale), *near(spots[3])),
        (props.pencil(scale), *near((spots[0][0] + 0.06, spots[0][1] - 0.02))),
    ]
    small = [props.nut(scale), props.washer(scale), props.screw(scale)]
    # Nothing balances on the tools in the corners.
    places = [
        (x, y) for x, y in rng.uniform(0.05, 0.95, (24, 2)) if all(np.hypot(x - u, y - v) > 0.22 for u, v in spots)
    ]
    for x, y in places[:9]:
        things.append((small[int(rng.integers(3))], float(x), float(y), float(rng.uniform(-3.1, 3.1))))
    return things
