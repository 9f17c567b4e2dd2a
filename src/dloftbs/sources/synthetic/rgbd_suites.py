"""The suites of cables in space: clean ones that bend and move hard, and ones that hands manipulate."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dloftbs.errors import InputError
from dloftbs.sources.synthetic.rgbd import RgbdSequence
from dloftbs.sources.synthetic.rgbd_artificial_scenes import ARTIFICIAL
from dloftbs.sources.synthetic.rgbd_manipulation_scenes import MANIPULATION
from dloftbs.sources.synthetic.scene_parts import MakeScene

_FEWEST_FRAMES = 3
_SEEDS_APART = 100


def rgbd_artificial(
    scale: float = 1.0,
    seed: int = 0,
    size: tuple[int, int] = (720, 1280),
    *,
    depth_noise: float = 0.0,
    hole_share: float = 0.0,
    flying: float = 0.0,
    with_image: bool = False,
) -> list[RgbdSequence]:
    """Return five sequences of a cable of 8 to 10 mm at 0.6 to 1.2 m, 1400 frames at full scale, with perfect depth.

    0 bends it tightly, 1 lays it over itself as well, 2 opens a loop, 3 and 4 shake and whip it. In 0 to 2 it moves by
    up to about 15 px a frame at full scale and size, in 3 and 4 by up to about 60.

    Parameters
    ----------
    scale : float
        Multiplies the numbers of frames; none has less than 3.
    seed : int
        Not negative; another seed gives other shapes and motions.
    size : (int, int)
        ``(H, W)`` px. The view stays the same, so that the cable's width goes with the size.
    depth_noise, hole_share, flying : float
        How imperfect depth is, see `DepthNoise`.
    with_image : bool
        Whether frames have a shaded colour image too.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    return _sequences(ARTIFICIAL, scale, seed, size, depth_noise, hole_share, flying, with_image)


def rgbd_manipulation(
    scale: float = 1.0,
    seed: int = 0,
    size: tuple[int, int] = (720, 1280),
    *,
    depth_noise: float = 1.0,
    hole_share: float = 0.05,
    flying: float = 0.5,
    with_image: bool = False,
) -> list[RgbdSequence]:
    """Return ten sequences of cables of 4 to 20 mm that hands manipulate at 0.5 to 1.5 m, 2500 frames at full scale.

    Fingers and arms hide parts of the cable: the mask lacks those, and the depth there is the hand's.

    Parameters
    ----------
    scale, seed, size, with_image
        As for `rgbd_artificial`.
    depth_noise, hole_share, flying : float
        How imperfect depth is, see `DepthNoise`.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    return _sequences(MANIPULATION, scale, seed, size, depth_noise, hole_share, flying, with_image)


def _sequences(
    makers: Sequence[MakeScene],
    scale: float,
    seed: int,
    size: tuple[int, int],
    depth_noise: float,
    hole_share: float,
    flying: float,
    with_image: bool,
) -> list[RgbdSequence]:
    if not 0.0 < scale <= 100.0 or seed < 0:
        raise InputError(f"expected 0 < scale <= 100 and seed >= 0, got {scale} and {seed}")
    sequences = []
    for number, make in enumerate(makers):
        scene = make(np.random.default_rng([seed, number]))
        sequences.append(
            RgbdSequence(
                scene,
                max(_FEWEST_FRAMES, round(scale * scene.frames)),
                size,
                _SEEDS_APART * seed + number,
                depth_noise=depth_noise,
                hole_share=hole_share,
                flying=flying,
                with_image=with_image,
            )
        )
    return sequences
