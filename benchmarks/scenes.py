"""What is timed: masks of cables 12 px wide at 1280 x 720, made from seeds; of other sizes where it is about these."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from dloftbs.sources.synthetic import draw_tube_mask, random_curve

SIZE = (720, 1280)
WIDTH_PX = 12.0
Mask = npt.NDArray[np.uint8]


def cables(
    count: int,
    seed: int = 0,
    length_px: float = 1500.0,
    size: tuple[int, int] = SIZE,
    width_px: float = WIDTH_PX,
) -> Mask:
    """Return the mask (H, W), 0 and 255, of `count` cables that lie across each other."""
    rng = np.random.default_rng(seed)
    mask = np.zeros(size, dtype=bool)
    radius_px = 40.0 * size[0] / SIZE[0]
    for _ in range(count):
        mask |= draw_tube_mask(random_curve(rng, length_px, size, min_radius_px=radius_px), width_px, size)
    return mask.astype(np.uint8) * 255


def photograph(seed: int = 0) -> Mask:
    """Return a frame (720, 1280, 3) of the demo: textured cables on a cluttered table."""
    from dloftbs.sources.synthetic import DemoSequence

    image = DemoSequence(frames=90, seed=seed).frame(40).image
    assert image is not None  # the demo has images
    return image
