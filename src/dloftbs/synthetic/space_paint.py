"""A simple picture of a scene in space: matt spheres in the colour of what they belong to, on a grained ground."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.camera import PinholeCamera
from dloftbs.synthetic.space_scene import Rendering

CABLE_BGR, SKIN_BGR = (196.0, 92.0, 12.0), (132.0, 164.0, 214.0)
_GROUND_BGR = (150.0, 156.0, 160.0)
_GRAIN, _GRAIN_PX = 9.0, 5.0
_LIGHT = np.array([-0.40, -0.62, -0.675])


def paint(seen: Rendering, camera: PinholeCamera, seed: int) -> npt.NDArray[np.uint8]:
    """Return the picture, shape (H, W, 3) BGR."""
    height, width = seen.depth.shape
    grain = np.random.default_rng([seed, 2]).standard_normal((height, width), dtype=np.float32)
    grain = _GRAIN * _GRAIN_PX * cv2.GaussianBlur(grain, (0, 0), _GRAIN_PX)
    picture = np.add(_GROUND_BGR, grain[:, :, None], dtype=np.float32)
    rows, columns = np.nonzero(seen.sample >= 0)
    sample = seen.sample[rows, columns]
    surface = camera.deproject(np.stack((columns, rows), axis=1), seen.depth[rows, columns])
    normal = (surface - seen.centers[sample]) / seen.radius[sample, None]
    light = 0.35 + 0.75 * np.clip(normal @ _LIGHT, 0.0, 1.0)
    colour = np.where((sample < seen.cable)[:, None], CABLE_BGR, SKIN_BGR)
    picture[rows, columns] = light[:, None] * colour
    return np.clip(picture, 0.0, 255.0).round().astype(np.uint8)
