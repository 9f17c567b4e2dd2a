"""A simple picture of a scene in space: matt spheres in the colour of what they belong to, on a grained ground."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from dloftbs.camera import PinholeCamera
from dloftbs.support.arrays import ByteArray, FloatArray
from dloftbs_lab.synthetic.space_scene import Rendering

CABLE_BGR, SKIN_BGR = (196.0, 92.0, 12.0), (132.0, 164.0, 214.0)
COLOURS_BGR = np.array([(40.0, 40.0, 200.0), (200.0, 90.0, 30.0), (50.0, 160.0, 60.0), (40.0, 190.0, 220.0)])
_GROUND_BGR = (150.0, 156.0, 160.0)
_GRAIN, _GRAIN_PX = 9.0, 5.0
_LIGHT = np.array([-0.40, -0.62, -0.675])


def paint(seen: Rendering, camera: PinholeCamera, seed: int) -> ByteArray:
    """Return the picture of a cable and of hands, shape (H, W, 3) BGR."""
    colours = np.where((np.arange(len(seen.radius)) < seen.cable)[:, None], CABLE_BGR, SKIN_BGR)
    return paint_spheres(seen, colours, camera, [seed])


def paint_spheres(seen: Rendering, colours: FloatArray, camera: PinholeCamera, key: Sequence[int]) -> ByteArray:
    """Return the picture, shape (H, W, 3) BGR, of spheres in colours (n, 3) BGR of their own."""
    height, width = seen.depth.shape
    grain = np.random.default_rng([*key, 2]).standard_normal((height, width), dtype=np.float32)
    grain = _GRAIN * _GRAIN_PX * cv2.GaussianBlur(grain, (0, 0), _GRAIN_PX)
    picture = np.add(_GROUND_BGR, grain[:, :, None], dtype=np.float32)
    rows, columns = np.nonzero(seen.sample >= 0)
    sample = seen.sample[rows, columns]
    surface = camera.deproject(np.stack((columns, rows), axis=1), seen.depth[rows, columns])
    normal = (surface - seen.centers[sample]) / seen.radius[sample, None]
    light = 0.35 + 0.75 * np.clip(normal @ _LIGHT, 0.0, 1.0)
    picture[rows, columns] = light[:, None] * colours[sample]
    return np.clip(picture, 0.0, 255.0).round().astype(np.uint8)
