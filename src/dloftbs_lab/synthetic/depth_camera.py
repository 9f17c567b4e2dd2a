"""Errors of depth, as stereo cameras make them of thin things: displaced, fattened, and with what lies behind."""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from dloftbs.errors import InputError
from dloftbs.support.arrays import FloatArray
from dloftbs_lab.synthetic.depth_noise import holes, in_steps, with_flying_pixels

_QUADRATIC_PER_M = 4e-3
_EIGHTH_M = 0.125 / (900.0 * 0.05)
_SPELL_WIDTHS = (3.0, 8.0)
_TABLE_SHARE = 0.1
_FLYING_SHARE = 0.5


@dataclass(frozen=True)
class DepthCamera:
    """Errors of a depth camera; without any it is perfect.

    Parameters
    ----------
    noise : bool
        Gaussian noise of each pixel, ``4e-3 z**2`` m.
    steps : bool
        Disparity in eighths of a pixel, for 5 cm from eye to eye and 900 px of focal length.
    fattened : bool
        What is near covers 2 to 4 px more to every side.
    flying : bool
        Half of the pixels at edges lie between the two surfaces.
    holes : bool
        10 to 30 % of a cable has no depth.
    misregistered : bool
        Depth is displaced against the mask by 1 to 2 px, in any direction.
    behind : bool
        Along stretches of 3 to 8 widths, a tenth of the length, depth shows what lies behind the cable.
    """

    noise: bool = False
    steps: bool = False
    fattened: bool = False
    flying: bool = False
    holes: bool = False
    misregistered: bool = False
    behind: bool = False

    def displacement(self, rng: np.random.Generator) -> FloatArray:
        """Return by how much the depth image is displaced, shape (2,) px."""
        size, angle = rng.uniform(1.0, 2.0), rng.uniform(0.0, 2.0 * math.pi)
        return size * np.array([math.cos(angle), math.sin(angle)]) * self.misregistered

    def measure(
        self,
        depth: npt.NDArray[np.float32],
        background: npt.NDArray[np.float32],
        along: npt.NDArray[np.float32],
        mask: npt.NDArray[np.bool_],
        rng: np.random.Generator,
    ) -> npt.NDArray[np.float32]:
        """Return true depth as the camera measures it.

        Parameters
        ----------
        depth, background : numpy.ndarray, shape (H, W)
            With the cables and without them, m, both displaced.
        along : numpy.ndarray, shape (H, W)
            Arc length of the cable that a pixel shows, widths, counted on from cable to cable; NaN elsewhere.
        mask : numpy.ndarray, shape (H, W)
            Of the cables, not displaced.
        rng : numpy.random.Generator

        Returns
        -------
        numpy.ndarray, shape (H, W), float32
            0 where nothing was measured.
        """
        if self.behind:
            depth = np.where(_in_spells(along, rng), background, depth)
        if self.fattened:
            reach = int(rng.integers(2, 5))
            disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))
            depth = cv2.erode(depth, disc)
        if self.flying:
            depth = with_flying_pixels(depth, _FLYING_SHARE, rng)
        if self.noise:
            depth = depth + np.float32(_QUADRATIC_PER_M) * depth**2 * rng.standard_normal(depth.shape, np.float32)
        if self.steps:
            depth = in_steps(depth, _EIGHTH_M)
        if self.holes and mask.any():
            depth = np.where(holes(mask, rng.uniform(0.1, 0.3), rng), np.float32(0.0), depth)
        return depth


DEPTH_CAMERAS = {
    "perfect": DepthCamera(),
    "noise": DepthCamera(noise=True),
    "steps": DepthCamera(steps=True),
    "fattened": DepthCamera(fattened=True),
    "flying": DepthCamera(flying=True),
    "holes": DepthCamera(holes=True),
    "misregistered": DepthCamera(misregistered=True),
    "behind": DepthCamera(behind=True),
    "all but fattened": DepthCamera(True, True, False, True, True, True, True),
    "all": DepthCamera(True, True, True, True, True, True, True),
}
"""The errors one by one, and together, by name."""


def depth_camera(name: str) -> DepthCamera:
    """Return one of `DEPTH_CAMERAS`.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    if name not in DEPTH_CAMERAS:
        raise InputError(f"errors must be one of {', '.join(DEPTH_CAMERAS)}, got {name!r}")
    return DEPTH_CAMERAS[name]


def _in_spells(along: npt.NDArray[np.float32], rng: np.random.Generator) -> npt.NDArray[np.bool_]:
    """Return which pixels (H, W) lie in stretches, drawn until they cover a tenth of the length."""
    end = float(np.nanmax(along, initial=0.0))
    spells = np.zeros(along.shape, np.bool_)
    left = _TABLE_SHARE * end
    while left > 0.0:
        length = min(rng.uniform(*_SPELL_WIDTHS), max(left, _SPELL_WIDTHS[0]))
        start = rng.uniform(0.0, max(end - length, 0.0))
        spells |= (along >= start) & (along <= start + length)
        left -= length
    return spells
