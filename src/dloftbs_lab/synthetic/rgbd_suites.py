"""The suites of cables in space: clean ones that bend and move hard, and ones that hands manipulate."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from dloftbs.errors import InputError
from dloftbs_lab.synthetic.depth_noise import PERFECT_DEPTH, TYPICAL_NOISE, DepthNoise
from dloftbs_lab.synthetic.generated import proportion
from dloftbs_lab.synthetic.rgbd import RgbdSequence
from dloftbs_lab.synthetic.rgbd_artificial_scenes import ARTIFICIAL
from dloftbs_lab.synthetic.rgbd_manipulation_scenes import MANIPULATION
from dloftbs_lab.synthetic.scene_parts import MakeScene
from dloftbs_lab.synthetic.space_scene import SpaceScene

_FEWEST_FRAMES = 3
_SEEDS_APART = 100
_FAR_M = 1.4
_STEREO_GRAIN_PX, _STEREO_QUANTUM_M = 2.0, 0.002  # px of an HD image


def rgbd_artificial(
    scale: float = 1.0,
    seed: int = 0,
    size: tuple[int, int] = (720, 1280),
    noise: DepthNoise = PERFECT_DEPTH,
    *,
    with_image: bool = False,
) -> list[RgbdSequence]:
    """Return five sequences of a cable of 8 to 10 mm at 0.6 to 1.2 m, 1400 frames at full scale, none less than 3.

    0 bends it tightly, 1 lays it over itself as well, 2 opens a loop, 3 and 4 shake and whip it. In 0 to 2 it moves by
    up to about 15 px a frame at full scale and size, in 3 and 4 by up to about 60. The view stays the same in all
    sizes, so that the cable's width goes with them. With an image, frames have a shaded colour image too.
    """
    return _sequences(ARTIFICIAL, scale, seed, size, noise, with_image)


def rgbd_noisy(scale: float = 1.0, seed: int = 0, size: tuple[int, int] = (720, 1280)) -> list[RgbdSequence]:
    """Return the artificial sequences as two kinds of cameras measure them, near and far, 1400 frames at full scale.

    Each scene comes four times, with a quarter of its frames: at the 0.6 to 1.0 m of `rgbd_artificial` and at 1.3 to
    1.5 m, where noise is twice as large and the cable half as wide; as a time-of-flight camera gives it, with noise of
    its own in each pixel, and as a stereo camera does, with noise that goes together over some pixels and depth in
    steps of 2 mm at 1 m. All have the noise of `depth_sigma`, holes over 5 % of the cable, and flying pixels on half of
    the edges.
    """
    stereo = replace(TYPICAL_NOISE, grain_px=_STEREO_GRAIN_PX * proportion(size), quantum_m=_STEREO_QUANTUM_M)
    made = []
    for camera, noise in (("time of flight", TYPICAL_NOISE), ("stereo", stereo)):
        for where, makers in (("near", ARTIFICIAL), ("far", tuple(map(_far, ARTIFICIAL)))):
            made.append(_sequences(makers, scale / 4.0, seed, size, noise, with_image=False))
            for sequence in made[-1]:
                sequence.name = f"{sequence.name}, {camera}, {where}"
    return [sequence for of_scene in zip(*made, strict=True) for sequence in of_scene]


def _far(make: MakeScene) -> MakeScene:
    """Return what makes the same scene, seen from far away."""

    def made(rng: np.random.Generator) -> SpaceScene:
        scene = make(rng)
        return replace(scene, view=replace(scene.view, distance_m=_FAR_M))

    return made


def rgbd_manipulation(
    scale: float = 1.0,
    seed: int = 0,
    size: tuple[int, int] = (720, 1280),
    noise: DepthNoise = TYPICAL_NOISE,
    *,
    with_image: bool = False,
) -> list[RgbdSequence]:
    """Return ten sequences of cables of 4 to 20 mm that hands manipulate at 0.5 to 1.5 m, 2500 frames at full scale.

    Fingers and arms hide parts of the cable: the mask lacks those, and the depth there is the hand's. Arguments are
    those of `rgbd_artificial`.
    """
    return _sequences(MANIPULATION, scale, seed, size, noise, with_image)


def _sequences(
    makers: Sequence[MakeScene], scale: float, seed: int, size: tuple[int, int], noise: DepthNoise, with_image: bool
) -> list[RgbdSequence]:
    if not 0.0 < scale <= 100.0 or seed < 0:
        raise InputError(f"expected 0 < scale <= 100 and seed >= 0, got {scale} and {seed}")
    scenes = [make(np.random.default_rng([seed, number])) for number, make in enumerate(makers)]
    lengths = [max(_FEWEST_FRAMES, round(scale * scene.frames)) for scene in scenes]
    return [
        RgbdSequence(scene, length, size, _SEEDS_APART * seed + number, noise, with_image=with_image)
        for number, (scene, length) in enumerate(zip(scenes, lengths, strict=True))
    ]
